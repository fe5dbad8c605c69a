"""The bubbles while they are packed, and what they are packed on."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ..boundary import Boundary
from ..mesh import Bools, Ints
from ..surface import Charts, Spots
from ..symmetry import Symmetry
from .rim import Lengths, Track


class Pins(NamedTuple):
    """Bubbles that stay where the designer wants them: their n places, and which are of the first row."""

    spots: Spots
    on_track: Bools


@dataclass(frozen=True)
class Ground:
    """What bubbles are packed on: the surface, its boundary (None where there is none), the first row's
    track, the packing metric at places, its value where it is the same everywhere, and the edge offset; the
    symmetry that the pattern shall have, or None; the pins, or None; and what a designer should know of
    these.
    """

    charts: Charts
    boundary: Boundary | None
    track: Track
    pitch: Lengths
    uniform: float | None
    edge_offset: float
    symmetry: Symmetry | None = None
    pins: Pins | None = None
    notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class Bubbles:
    """Places of n bubbles, of which the first `fixed` stay where they are: the first row along the boundary,
    whose even spacing is what the eye sees first, single rows in the middle of narrow places, and pins, of
    which the last `inner` are of no first row.

    In a symmetric pattern that is whole, partners (n, k) is the number of each bubble's image under each of
    the k isometries, the first of which leaves everything where it is, and orbit (n,) numbers those that are
    images of one another.
    """

    spots: Spots
    fixed: int = 0
    partners: Ints | None = None
    orbit: Ints | None = None
    inner: int = 0

    def __len__(self) -> int:
        return len(self.spots.row)


def joined(*parts: Spots) -> Spots:
    """Places one after the other."""
    return Spots(
        np.concatenate([part.row for part in parts]), np.concatenate([part.barycentric for part in parts])
    )


def can_move(bubbles: Bubbles) -> Bools:
    """Which bubbles may move, (n,)."""
    return np.arange(len(bubbles)) >= bubbles.fixed
