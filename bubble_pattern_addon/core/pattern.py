"""A pattern: the bubbles of step 1 with the sizes of step 2, ready for step 3."""

from __future__ import annotations

from dataclasses import dataclass

from .mesh import Floats, Ints
from .metric import Places


@dataclass(frozen=True)
class Pattern:
    """Bubbles in a stable order; a feature's id is its row number here.

    places: where the bubbles are on the base, n of them
    normal: (n, 3) unit surface normals, outward
    tangent: (n, 3) unit vectors in the surface, along a row of the hexagonal arrangement
    pitch: (n,) packing metric at the bubble: the diameter of its territory
    diameter: (n,) size of the feature, from the shaping metric
    row: (n,) 0 for the first row along a boundary, 1 for the next, ...
    """

    places: Places
    normal: Floats
    tangent: Floats
    pitch: Floats
    diameter: Floats
    row: Ints

    def __len__(self) -> int:
        return len(self.pitch)

    @property
    def position(self) -> Floats:
        """Centres on the surface, (n, 3)."""
        return self.places.position
