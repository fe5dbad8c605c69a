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
        # a column per coordinate: several times faster than rows of three
        x, y, z = np.ascontiguousarray(self.vertices.T)
        a, b, c = np.ascontiguousarray(self.triangles.T)
        ux, uy, uz = (side[b] - side[a] for side in (x, y, z))
        vx, vy, vz = (side[c] - side[a] for side in (x, y, z))
        return np.stack([uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx], axis=1)
