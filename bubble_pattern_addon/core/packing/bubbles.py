"""The bubbles while they are packed: those of the first row on their track, the others free on the
surface.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..boundary import Boundary
from ..mesh import Bools, Floats, Ints
from ..surface import Charts, Spots, positions
from .rim import FirstRow, Lengths, Track, on_track, spots_on_track


@dataclass(frozen=True)
class Ground:
    """What bubbles are packed on: the surface, its boundary (None where there is none), the first row's
    track, the packing metric at places, its value where it is the same everywhere, and the edge offset.
    """

    charts: Charts
    boundary: Boundary | None
    track: Track
    pitch: Lengths
    uniform: float | None
    edge_offset: float


@dataclass(frozen=True)
class Bubbles:
    """first_row: m bubbles on the track; free: places of the k others, of which the first `held` stay where
    they are, in the middle of narrow places. Arrays over all bubbles have the first row first."""

    first_row: FirstRow
    free: Spots
    held: int = 0

    def __len__(self) -> int:
        return len(self.first_row.arc) + len(self.free.row)


def all_spots(ground: Ground, bubbles: Bubbles) -> Spots:
    """Places of all bubbles, exactly on the surface."""
    if not len(bubbles.first_row.arc):
        return bubbles.free
    rim = spots_on_track(ground.charts, ground.track, bubbles.first_row.wrapped())
    return Spots(
        np.concatenate([rim.row, bubbles.free.row]),
        np.concatenate([rim.barycentric, bubbles.free.barycentric]),
    )


def points_and_rows(ground: Ground, bubbles: Bubbles) -> tuple[Floats, Ints, Floats]:
    """Points (n, 3), region rows (n,) and the first row's unit tangents (m, 3).

    The first row's points are read off the track's chords, which is exact enough to feel forces by and quick.
    """
    free = positions(ground.charts, bubbles.free)
    if not len(bubbles.first_row.arc):
        return free, bubbles.free.row, np.empty((0, 3))
    rim, tangent, knot = on_track(ground.track, bubbles.first_row.wrapped())
    return (
        np.concatenate([rim, free]),
        np.concatenate([ground.track.spots.row[knot], bubbles.free.row]),
        tangent,
    )


def can_move(bubbles: Bubbles) -> Bools:
    """Which bubbles may move, (n,): all but the held ones."""
    number = np.arange(len(bubbles)) - len(bubbles.first_row.arc)
    return (number < 0) | (number >= bubbles.held)


def with_arc(row: FirstRow, arc: Floats) -> FirstRow:
    """The same first row at other arcs."""
    return replace(row, arc=arc)
