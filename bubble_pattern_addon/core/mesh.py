"""Triangle meshes: the base geometry before, the part after."""

from __future__ import annotations

import hashlib
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
        return np.ascontiguousarray(area_columns(self.columns).T)

    @property
    def columns(self) -> Floats:
        """Corner positions with a row per coordinate and corner, (3 coordinates, 3 corners, T): several times
        faster to work on than rows of three.
        """
        place = np.ascontiguousarray(self.triangles.T)
        return np.stack([coordinate[place] for coordinate in np.ascontiguousarray(self.vertices.T)])


def area_columns(columns: Floats) -> Floats:
    """Outward normals, as long as twice the area, of triangles given as `Mesh.columns`: (3, T)."""
    (ux, vx), (uy, vy), (uz, vz) = columns[:, 1:] - columns[:, :1]
    return np.stack([uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx])


def digest(*arrays: Floats | Ints) -> bytes:
    """What tells these arrays from others, for work that need not be done again."""
    result = hashlib.blake2b()
    for array in arrays:
        result.update(np.ascontiguousarray(array))
    return result.digest()
