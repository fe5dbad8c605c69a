"""Triangle meshes: the base geometry before, the part after."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]


@dataclass(frozen=True)
class Mesh:
    """Triangles in space, wound counter-clockwise seen from outside.

    vertices: (V, 3) float64, in the unit of the base's file (metres inside Blender)
    triangles: (T, 3) int64, rows of vertex indices
    """

    vertices: Floats
    triangles: Ints

    @property
    def corners(self) -> Floats:
        """Corner positions of every triangle, (T, 3, 3)."""
        return self.vertices[self.triangles]

    @property
    def area_vectors(self) -> Floats:
        """Outward normals as long as twice the triangle's area, (T, 3)."""
        a, b, c = self.corners.swapaxes(0, 1)
        return np.cross(b - a, c - a)
