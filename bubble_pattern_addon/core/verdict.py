"""After the boolean: the part as it came out, measured and judged feature by feature."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor

import numpy as np

from . import carry
from .check import check_part
from .closed import measure, patch_euler
from .crossings import SHALLOWEST
from .feature_recipe import nouns
from .mesh import Bools, Floats, Ints, Mesh
from .part import Cut, Part
from .plan import Plan
from .undercut import undercuts
from .wall import DEEPEST, Fault

SAID = 3
"""Reasons why features could not be added that are given in the check's problems; the part lists them all."""


def judge(plan: Plan, left: Cut) -> Part:
    """The Part from what the boolean left: where its faces come from, and what can be measured on it."""
    # numpy's work on large arrays goes on beside the rest
    with ThreadPoolExecutor(1) as beside:
        measured = beside.submit(measure, left.mesh)
        sound = plan.sound
        known, named = carry.same_places(sound.mesh.vertices, left.mesh.vertices)
        whole, turn = carry.whole_faces(left.surface, named, left.face, known[sound.mesh.triangles])
        mesh = Mesh(left.mesh.vertices, carry.turned(left.mesh.triangles, turn))
        owner = left.feature[left.facet]
        source = np.concatenate([sound.triangle[left.face], -1 - owner])
        facet = np.concatenate([np.full(len(left.face), -1), left.facet])
        vertex = np.where(named >= 0, sound.vertex[named], -1)
        untouched = np.concatenate([whole, np.zeros(len(owner), dtype=bool)])
        shape = _wall_shapes(left, owner, len(plan.pattern))
        unchanged, notes = _unchanged(plan, left, named, whole)

    failures = _failures(plan)
    problems, pierced, change = _verdict(plan, shape, failures)
    undercut = (plan.fault == Fault.NONE) & undercuts(
        plan.feature, plan.sizes, plan.extent, plan.pattern, plan.normal
    )
    if undercut.any():
        notes = [*notes, _undercut_note(plan, undercut)]
    check = check_part(
        measured.result(),
        sound.measures,
        int(pierced.sum()),
        unchanged,
        problems,
        notes,
        change,
        plan.feature.kind,
    )
    thickness, kind = plan.wall.thickness, plan.feature.kind
    return Part(mesh, source, facet, vertex, untouched, thickness, pierced, failures, check, undercut, kind)


def _undercut_note(plan: Plan, undercut: Bools) -> str:
    first = _place(plan, int(np.flatnonzero(undercut)[0]))
    count = int(undercut.sum())
    return (
        f"{nouns(plan.feature.kind, count)} cannot be drawn off along the pull direction, the first is "
        f"{first}: give more draft, or let the axis follow the pull."
    )


def _verdict(
    plan: Plan, shape: Floats, failures: tuple[tuple[int, str], ...]
) -> tuple[list[str], Bools, int]:
    """What is wrong with single features; which of them pierce the wall, (n,); and by how much they change
    the Euler characteristic of the base.

    shape: (n,) see `_wall_shapes`. Of a solid with the characteristic x the base's surface swallows or cuts
    off regions with the sum r: its wall in the part has x - r, in the place of r, so that the part changes by
    x - 2r. A bump, a dimple or a blind hole (x = 2, r = 1) changes nothing, a hole through the wall, with a
    region on either side, takes two.
    """
    feature, cut = plan.feature, plan.fault == Fault.NONE
    euler, region = (2, 1) if plan.stamp is None else (plan.stamp.euler, plan.stamp.cap_euler)
    blind = cut & (shape == euler - region)
    # where a mesh comes out of the wall again, its regions may be of any kind
    pierced = cut & ((shape == 0) if plan.stamp is None else (shape < euler - region)) & (not feature.adds)
    problems = _told(plan, failures)
    good = pierced if feature.through else blind if plan.stamp is None else pierced | blind
    torn = np.flatnonzero(cut & ~good)
    if len(torn):
        state = "pierces one wall cleanly" if feature.through else "joins the surface in one clean edge"
        problems.append(
            f"Not every {feature.kind} {state}: {len(torn):,} do not, "
            f"the first is {_place(plan, int(torn[0]))}."
        )
    change = int((2 * shape[blind | pierced] - euler).sum())
    return problems, pierced, change


def _unchanged(plan: Plan, left: Cut, named: Ints, whole: Bools) -> tuple[bool, list[str]]:
    """Is the surface the same wherever no cutter reaches? And a note where it is, but in other faces.

    Every face there must come out whole. Only faces narrower than what single precision in a file can hold
    may be dissolved into their neighbours, as the boolean does with slivers and folds.
    """
    base = plan.sound.mesh
    other = np.ones(len(base.triangles), dtype=bool)
    other[left.face[whole]] = False
    other[plan.wall.seen_triangle[plan.meets]] = False
    changed = np.flatnonzero(other)
    if len(changed) == 0:
        return True, []
    slack = SHALLOWEST * float(np.linalg.norm(np.ptp(base.vertices, axis=0)))
    moved = carry.drift(left.mesh, left.face, named, changed, base)
    if moved > slack:
        return False, []
    lost = int((np.bincount(left.face, minlength=len(other))[changed] == 0).sum())
    # faces without area are no loss worth telling
    if lost == 0 or moved < 1e-6 * slack:
        return True, []
    faces = "1 face" if lost == 1 else f"{lost:,} faces"
    return True, [
        f"{faces} of the base narrower than {slack:.1g} merged into the neighbours; "
        f"the surface moved there by at most {moved:.1g}."
    ]


def _wall_shapes(left: Cut, owner: Ints, count: int) -> Floats:
    """Euler characteristic of each feature's wall and floor in the result, (count,): 0 a ring, as of a
    through-hole; 1 a cup, as of a blind one; -1 for a feature without any. owner: (W,) whose the walls are.
    """
    shape = patch_euler(left.walls, owner, left.surface, count)
    shape[np.bincount(owner, minlength=count) == 0] = -1
    return shape


_REASONS = {
    Fault.OFF: "does not lie on the base's surface",
    Fault.FOLDED: "covers a place where the surface folds away or rises steeply: move it or make it smaller",
    Fault.THICK: f"finds no far side of the wall within {DEEPEST:g} diameters, too thick to pierce: "
    "give it a depth or make the wall thinner",
    Fault.CROWDED: "cannot pierce the near wall without cutting into the wall behind it",
    Fault.COVERED: "cannot be reached without cutting into what lies over the surface there",
    Fault.BREAKS: "would break through the wall: make it shallower",
    Fault.MEETS: "would run into another {kind} inside the wall: make it smaller or give it a depth",
    Fault.CLOSED: "closes up before it comes to its end: less draft, a smaller rim or a wider profile helps",
    Fault.RIM: "has a rim deeper than itself or than the wall: make the rim smaller",
    Fault.FLAT: "is lost in the bend of the surface, which is deeper: give it more height or depth",
    Fault.STEEP_CAP: "is deeper than half its diameter, which no spherical cap can be: make it shallower",
    Fault.THIN: "finds no room for its foot in the wall, which is too thin or too steep to its axis",
    Fault.AVERTED: "lies on a surface that faces away from its axis: take another pull direction",
}


def _failures(plan: Plan) -> tuple[tuple[int, str], ...]:
    """A sentence for every feature that was not cut."""
    return tuple(
        (int(which), f"{_place(plan, int(which)).capitalize()} {_reason(plan, int(which))}.")
        for which in np.flatnonzero(plan.fault)
    )


def _told(plan: Plan, failures: tuple[tuple[int, str], ...]) -> list[str]:
    """What could not be added and why: a sentence for each of the commonest reasons."""
    told, kind = [], plan.feature.kind
    faults, first, count = np.unique(plan.fault[plan.fault != 0], return_index=True, return_counts=True)
    order = np.lexsort((first, -count))
    for at in order[:SAID]:
        which, sentence = failures[first[at]]
        if count[at] == 1:
            told.append(sentence)
            continue
        told.append(
            f"{nouns(kind, int(count[at]))} could not be added: {_place(plan, which)}, the first of them, "
            f"{_reason(plan, which)}."
        )
    if len(faults) > SAID:
        rest = int(count[order[SAID:]].sum())
        told.append(f"{nouns(f'more {kind}', rest)} could not be added for other reasons.")
    return told


def _reason(plan: Plan, which: int) -> str:
    return _REASONS[Fault(plan.fault[which])].format(kind=plan.feature.kind)


def _place(plan: Plan, which: int) -> str:
    x, y, z = plan.pattern.position[which]
    return f"{plan.feature.kind} {which} at ({x:.4g}, {y:.4g}, {z:.4g})"
