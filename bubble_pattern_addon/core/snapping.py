"""The place on the target region that is nearest to a point in space."""

from __future__ import annotations

import numpy as np
import trimesh
from scipy.spatial import cKDTree

from .mesh import Floats
from .region import Region
from .surface import Spots


def snapped(region: Region, points: Floats) -> tuple[Spots, Floats]:
    """The places nearest to `points` (n, 3), and how far they are, (n,).

    Exact: of the triangles, in octaves of their size, those are measured that can be nearer than the nearest
    corner is.
    """
    corners = region.corners
    middle = corners.mean(axis=1)
    reach = np.linalg.norm(corners - middle[:, None], axis=2).max(axis=1)
    bound = cKDTree(corners.reshape(-1, 3)).query(points)[0] * (1 + 1e-9)
    octave = np.floor(np.log2(reach))
    asked, triangle = [], []
    for one in np.unique(octave):
        members = np.flatnonzero(octave == one)
        near = cKDTree(middle[members]).query_ball_point(points, bound + 2.0 ** (one + 1))
        asked.append(np.repeat(np.arange(len(points)), [len(found) for found in near]))
        triangle.append(members[np.concatenate([*near, []]).astype(np.int64)])
    own, met = np.concatenate(asked), np.concatenate(triangle)
    closest = trimesh.triangles.closest_point(corners[met], points[own])
    distance = np.linalg.norm(closest - points[own], axis=1)
    order = np.lexsort((met, distance, own))
    best = order[np.searchsorted(own[order], np.arange(len(points)))]
    return Spots(met[best], barycentric(region, met[best], closest[best])), distance[best]


def barycentric(region: Region, row: np.ndarray, points: Floats) -> Floats:
    """Barycentric coordinates (n, 3) of points (n, 3) on the triangles `row` (n,)."""
    found = trimesh.triangles.points_to_barycentric(region.corners[row], points)
    found = np.maximum(found, 0)
    return np.asarray(found / found.sum(axis=1, keepdims=True))
