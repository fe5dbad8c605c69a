"""What is measured on a finished part, and what is wrong with it in words."""

from __future__ import annotations

from dataclasses import dataclass

from .closed import Measures


@dataclass(frozen=True)
class Check:
    """Measured on the part, never assumed.

    watertight: every edge is shared by exactly two faces, in opposite directions
    euler, base_euler: V - E + F of the part and of the base; every through-hole takes two, a blind hole,
    a dimple or a bump nothing
    genus: handles of the part, all shells together
    bodies, base_bodies: closed shells round material; cavities: shells round enclosed hollows
    volume, base_volume, removed_volume: in cubic units; what bumps add counts as removed below 0
    through: holes that pierce their wall
    unchanged: the base's surface is the same wherever no feature touches it
    problems: one sentence each; empty when the part is good
    notes: one sentence each on what is worth knowing and does no harm
    """

    watertight: bool
    euler: int
    base_euler: int
    genus: int
    bodies: int
    base_bodies: int
    cavities: int
    volume: float
    base_volume: float
    removed_volume: float
    through: int
    unchanged: bool
    problems: tuple[str, ...]
    notes: tuple[str, ...] = ()

    @property
    def good(self) -> bool:
        """Nothing is wrong with the part."""
        return not self.problems


def check_part(
    part: Measures,
    base: Measures,
    through: int,
    unchanged: bool,
    problems: list[str],
    notes: list[str],
    change: int,
    kind: str,
) -> Check:
    """Judge what was measured on a part made from `base` with features of a `kind`, `through` of which are
    through-holes, and which should add `change` to its Euler characteristic; what is wrong comes after
    `problems`.
    """
    before, after = base.volumes, part.volumes
    euler, base_euler = part.euler, base.euler
    expected = base_euler + change
    bodies, base_bodies = int((after > 0).sum()), int((before > 0).sum())
    problems = list(problems)
    if not part.closed:
        problems.append("The part is not watertight: check the base for flaws near the features.")
    if euler != expected:
        problems.append(
            f"The part's Euler characteristic is {euler:,} instead of {expected:,}: "
            f"a {kind} is missing, torn open or goes through more than one wall."
        )
    if bodies > base_bodies:
        problems.append(
            f"{bodies - base_bodies:,} loose pieces were cut off the part: make the {kind}s smaller."
        )
    if not unchanged:
        problems.append(f"Faces of the base that no {kind} touches were changed: check the base for flaws.")
    return Check(
        watertight=part.closed,
        euler=euler,
        base_euler=base_euler,
        genus=len(after) - euler // 2,
        bodies=bodies,
        base_bodies=base_bodies,
        cavities=int((after < 0).sum()),
        volume=float(after.sum()),
        base_volume=float(before.sum()),
        removed_volume=float(before.sum() - after.sum()),
        through=through,
        unchanged=unchanged,
        problems=tuple(problems),
        notes=tuple(notes),
    )
