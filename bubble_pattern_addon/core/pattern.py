"""A pattern: the bubbles of step 1 with the sizes of step 2, ready for step 3."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from .isometries import Isometries, same_isometries
from .mesh import Bools, Floats, Ints
from .metric import Places, end_to_end

COLUMNS = ("normal", "tangent", "pitch", "diameter", "row")

# Diameters that differ by a smaller share are the same.
SAME = 1e-9


@dataclass(frozen=True)
class Pattern:
    """Features in a stable order.

    places: where they are on the base, n of them
    normal: (n, 3) unit surface normals, outward
    tangent: (n, 3) unit vectors in the surface, along a row of the hexagonal arrangement
    pitch: (n,) packing metric at the bubble: the diameter of its territory
    diameter: (n,) size of the feature, from the shaping metric, within the limits
    row: (n,) 0 for the first row along a boundary, 1 for the next, ...
    wished: (n,) the size that the shaping metric asked for, of nominal sizes the nearest smaller one; None
    where nothing is known of it
    bubble: (n,) number of the feature's bubble, rising; None where every bubble has a feature
    dropped: the bubbles whose feature was left out as too small; None where none was
    notes: what a designer should know of the pattern, one sentence each
    packing_notes: those of them that are about the packing, which stay when features are shaped anew
    symmetry: the recipe's word for the symmetry that the bubbles have, None without one
    isometries: of that symmetry, None where nothing is known of them
    partners: (n, k) for each of its isometries, the first of which leaves everything where it is, the id of
    the bubble to which it takes this one: of its own where it is on the plane or axis
    axis: (n, 3) unit vectors along which the features stand, None for the normals
    heading: (n, 3) unit vectors square to the axes, the features' x axes, None for the tangents
    sizes: (n,) by the name of a feature's size that varies over the region, such as its depth
    share: (n,) share of the circle of its diameter that a feature takes, None for all of it
    """

    places: Places
    normal: Floats
    tangent: Floats
    pitch: Floats
    diameter: Floats
    row: Ints
    wished: Floats | None = None
    bubble: Ints | None = None
    dropped: Pattern | None = None
    notes: tuple[str, ...] = ()
    packing_notes: tuple[str, ...] = ()
    symmetry: str | None = None
    isometries: Isometries | None = None
    partners: Ints | None = None
    axis: Floats | None = None
    heading: Floats | None = None
    sizes: Mapping[str, Floats] = field(default_factory=dict)
    share: Floats | None = None

    def __len__(self) -> int:
        return len(self.pitch)

    @property
    def position(self) -> Floats:
        """Centres on the surface, (n, 3)."""
        return self.places.position

    @property
    def ids(self) -> Ints:
        """A feature's id, (n,): the number of its bubble, whatever becomes of the other features."""
        return np.arange(len(self)) if self.bubble is None else self.bubble

    @property
    def shrunk(self) -> Ints:
        """Rows of the features that the limits made smaller than the shaping metric asked for."""
        if self.wished is None:
            return np.empty(0, dtype=np.int64)
        return np.flatnonzero(self.diameter < self.wished * (1 - SAME))


def aimed(pattern: Pattern) -> Pattern:
    """The pattern with its features' axes for normals and their headings for tangents."""
    if pattern.axis is None and pattern.heading is None:
        return pattern
    return replace(
        pattern,
        normal=pattern.normal if pattern.axis is None else pattern.axis,
        tangent=pattern.tangent if pattern.heading is None else pattern.heading,
    )


def split(bubbles: Pattern, kept: Bools) -> Pattern:
    """The pattern of the bubbles `kept` (n,), the others in `dropped`."""
    if kept.all():
        return bubbles
    return replace(take(bubbles, kept), dropped=take(bubbles, ~kept))


def all_bubbles(pattern: Pattern) -> Pattern:
    """Every bubble of the pattern in the order of packing, those whose feature was left out among them."""
    if pattern.dropped is None:
        return pattern
    both = _end_to_end((pattern, pattern.dropped))
    order = np.argsort(both.ids)
    ids = both.ids[order]
    bubble = None if np.array_equal(ids, np.arange(len(ids))) else ids
    return replace(take(both, order), bubble=bubble, notes=pattern.notes)


def joined(patterns: Sequence[Pattern]) -> Pattern:
    """Patterns on one base as one, at least one of them; the ids of each go on from those before it."""
    if len(patterns) == 1:
        return patterns[0]
    numbered: list[Pattern] = []
    first = 0
    for pattern in patterns:
        parts = [part for part in (pattern, pattern.dropped) if part is not None]
        numbered.append(_renumbered(pattern, first))
        if pattern.dropped is not None:
            numbered[-1] = replace(numbered[-1], dropped=_renumbered(pattern.dropped, first))
        first += 1 + max(int(part.ids.max(initial=-1)) for part in parts)
    left_out = [pattern.dropped for pattern in numbered if pattern.dropped is not None]
    return replace(
        _end_to_end(numbered),
        dropped=_end_to_end(left_out) if left_out else None,
        notes=tuple(dict.fromkeys(note for pattern in patterns for note in pattern.notes)),
    )


def _renumbered(pattern: Pattern, first: int) -> Pattern:
    """The pattern with all ids raised by `first`."""
    partners = None if pattern.partners is None else pattern.partners + first
    return replace(pattern, bubble=pattern.ids + first, partners=partners)


def _end_to_end(parts: Sequence[Pattern]) -> Pattern:
    """The features of all parts with their ids, without what was left out."""

    def column(name: str) -> Any:
        return np.concatenate([getattr(part, name) for part in parts])

    # Parts with different symmetries, or one without, have none together.
    words = {None if part.partners is None else part.symmetry for part in parts}
    symmetric = len(words) == 1 and None not in words
    known = any(part.wished is not None for part in parts)
    wished = [part.diameter if part.wished is None else part.wished for part in parts]
    return Pattern(
        end_to_end([part.places for part in parts]),
        **{name: column(name) for name in COLUMNS},
        wished=np.concatenate(wished) if known else None,
        bubble=column("ids"),
        packing_notes=tuple(dict.fromkeys(note for part in parts for note in part.packing_notes)),
        symmetry=parts[0].symmetry if symmetric else None,
        isometries=same_isometries([part.isometries for part in parts]) if symmetric else None,
        partners=column("partners") if symmetric else None,
        axis=_given(parts, "axis", lambda part: part.normal),
        heading=_given(parts, "heading", lambda part: part.tangent),
        share=_given(parts, "share", lambda part: np.ones(len(part))),
        # what only some of the parts have varies with no field that all have
        sizes={
            name: np.concatenate([part.sizes[name] for part in parts])
            for name in parts[0].sizes
            if all(name in part.sizes for part in parts)
        },
    )


def _given(parts: Sequence[Pattern], name: str, otherwise: Callable[[Pattern], Floats]) -> Floats | None:
    """A column that a part may lack, where it is as `otherwise`; None where all lack it."""
    given = [getattr(part, name) for part in parts]
    if all(column is None for column in given):
        return None
    return np.concatenate(
        [otherwise(part) if one is None else one for one, part in zip(given, parts, strict=True)]
    )


def take(pattern: Pattern, which: Bools | Ints) -> Pattern:
    """The features `which`, a mask (n,) or rows, with their ids."""
    places = pattern.places
    return replace(
        pattern,
        places=Places(places.position[which], places.triangle[which], places.barycentric[which]),
        **{name: getattr(pattern, name)[which] for name in COLUMNS},
        wished=None if pattern.wished is None else pattern.wished[which],
        bubble=pattern.ids[which],
        partners=None if pattern.partners is None else pattern.partners[which],
        axis=None if pattern.axis is None else pattern.axis[which],
        heading=None if pattern.heading is None else pattern.heading[which],
        sizes={name: values[which] for name, values in pattern.sizes.items()},
        share=None if pattern.share is None else pattern.share[which],
        dropped=None,
    )
