"""The bubbles while they are packed, and what they are packed on."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..boundary import Boundary
from ..mesh import Bools
from ..surface import Charts, Spots
from .rim import Lengths, Track


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
    """Places of n bubbles, of which the first `fixed` stay where they are: the first row along the boundary,
    whose even spacing is what the eye sees first, and single rows in the middle of narrow places.
    """

    spots: Spots
    fixed: int = 0

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
