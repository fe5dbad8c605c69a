"""A pattern: the bubbles of step 1 with the sizes of step 2, ready for step 3."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from .mesh import Bools, Floats, Ints
from .metric import Places

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
    wished: (n,) the size that the shaping metric asked for; None where nothing is known of it
    bubble: (n,) number of the feature's bubble, rising; None where every bubble has a feature
    dropped: the bubbles whose feature was left out as too small; None where none was
    notes: what a designer should know of the pattern, one sentence each
    packing_notes: those of them that are about the packing, which stay when features are shaped anew
    symmetry: the recipe's word for the symmetry that the bubbles have, None without one
    partners: (n, k) for each of its isometries, the first of which leaves everything where it is, the id of
    the bubble to which it takes this one: of its own where it is on the plane or axis
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
    partners: Ints | None = None

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


def split(bubbles: Pattern, kept: Bools) -> Pattern:
    """The pattern of the bubbles `kept` (n,), the others in `dropped`."""
    if kept.all():
        return bubbles
    return replace(take(bubbles, kept), dropped=take(bubbles, ~kept))


def all_bubbles(pattern: Pattern) -> Pattern:
    """Every bubble of the pattern in the order of packing, those whose feature was left out among them."""
    if pattern.dropped is None:
        return pattern
    parts = (pattern, pattern.dropped)
    order = np.argsort(np.concatenate([part.ids for part in parts]))

    def joined(name: str) -> Any:
        return np.concatenate([getattr(part, name) for part in parts])[order]

    places = [part.places for part in parts]
    names = ("position", "triangle", "barycentric")
    return Pattern(
        Places(*(np.concatenate([getattr(place, name) for place in places])[order] for name in names)),
        **{name: joined(name) for name in COLUMNS},
        wished=None if pattern.wished is None else joined("wished"),
        packing_notes=pattern.packing_notes,
        symmetry=pattern.symmetry,
        partners=None if pattern.partners is None else joined("partners"),
    )


def take(pattern: Pattern, which: Bools) -> Pattern:
    """The features `which` (n,) with their ids."""
    places = pattern.places
    return replace(
        pattern,
        places=Places(places.position[which], places.triangle[which], places.barycentric[which]),
        **{name: getattr(pattern, name)[which] for name in COLUMNS},
        wished=None if pattern.wished is None else pattern.wished[which],
        bubble=pattern.ids[which],
        partners=None if pattern.partners is None else pattern.partners[which],
        dropped=None,
    )
