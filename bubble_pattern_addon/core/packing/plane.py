"""The hexagonal lattice of a region that lies in a plane, laid down at once."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.spatial import cKDTree

from ..boundary import Boundary, inside_distance
from ..mesh import Bools, Floats
from ..surface import Charts, Complex, Spots, in_plane, nearest_signpost, search, to_space

# A region that fills less than this share of the box round it is not worth laying a lattice over that box.
LEAST_FILLED = 0.1
# Neighbours in the lattice are one pitch apart.
NEXT = 1.01


def fills_its_box(charts: Charts, pitch: float) -> bool:
    """Whether each part of a flat region fills so much of its box that a lattice over it is no waste."""
    region = charts.region
    corners, _ = _corners_in_plane(charts)
    order = np.argsort(region.sheet, kind="stable")
    start = np.searchsorted(region.sheet[order], np.arange(region.sheet.max() + 1))
    low = np.minimum.reduceat(corners.min(axis=1)[order], start)
    high = np.maximum.reduceat(corners.max(axis=1)[order], start)
    boxes = float(np.prod(high - low + pitch, axis=1).sum())
    return region.area > LEAST_FILLED * boxes


def lay(
    charts: Charts,
    boundary: Boundary,
    pitch: float,
    clear: float,
    seeds: Spots,
    directions: Complex,
    origin: Floats,
    wanted: Callable[[Floats], Bools],
) -> Spots:
    """Places of the lattices of one `pitch` through the points `origin` (s, 3), one for each part of a flat
    region, with a row along the direction that each of `seeds` has, as far as they are farther inside the
    boundary than `clear` and, of points (n, 3), `wanted` (n,).
    """
    region = charts.region
    found: list[Spots] = []
    across, axes = _corners_in_plane(charts)
    along = to_space(charts, seeds.row, directions)
    for sheet in range(len(seeds.row)):
        rows = np.flatnonzero(region.sheet == sheet)
        points = _lattice_points(across[rows].reshape(-1, 2), axes, origin[sheet], along[sheet], pitch)
        points = points[wanted(points)]
        own = np.full(len(points), rows[0])
        points = points[inside_distance(boundary, points, own) > clear]
        sought = in_plane(charts, points)
        spots, there = search(charts, nearest_signpost(charts, sought, rows[:1]), sought)
        found.append(_all_found(charts, spots, there, points, pitch))
    return Spots(*(np.concatenate(parts) for parts in zip(*found, strict=True)))


def _corners_in_plane(charts: Charts) -> tuple[Floats, Floats]:
    """The triangles' corners (R, 3, 2) along two axes of the plane, and these axes (2, 3)."""
    axes = charts.axes[0]
    return np.einsum("rkc,ac->rka", charts.region.corners, axes), axes


def _lattice_points(corners: Floats, axes: Floats, origin: Floats, along: Floats, pitch: float) -> Floats:
    """Lattice points (n, 3) in the plane through `origin`, over the box round `corners` (m, 2)."""
    row = axes @ along
    beside = np.array([-row[1], row[0]])
    offset = corners - axes @ origin
    height = pitch * np.sqrt(0.75)
    u, v = offset @ row / pitch, offset @ beside / height
    number = np.arange(np.ceil(v.min()), np.floor(v.max()) + 1)
    step = np.arange(np.ceil(u.min()) - 1, np.floor(u.max()) + 1)
    # Every second row stands half a pitch aside.
    first = step[None, :] + 0.5 * (np.abs(number) % 2)[:, None]
    second = np.broadcast_to(number[:, None], first.shape)
    flat = pitch * first.reshape(-1, 1) * row + height * second.reshape(-1, 1) * beside
    return origin + flat @ axes


def _all_found(charts: Charts, spots: Spots, reached: Bools, points: Floats, pitch: float) -> Spots:
    """Places of the lattice `points` (n, 3): those `reached`, and the others if they are found from their
    neighbours, because a part of the boundary lay between them and their signpost.
    """
    if reached.all():
        return spots
    sought = in_plane(charts, points)
    pairs = cKDTree(points).query_pairs(NEXT * pitch, output_type="ndarray")
    pairs = np.concatenate([pairs, pairs[:, ::-1]])
    fresh = reached
    while True:
        tried = pairs[fresh[pairs[:, 0]] & ~reached[pairs[:, 1]]]
        if not len(tried):
            return spots.take(reached)
        arrived, there = search(charts, spots.row[tried[:, 0]], sought[tried[:, 1]])
        found = tried[there, 1]
        fresh = np.zeros(len(points), dtype=bool)
        fresh[found] = True
        spots.row[found], spots.barycentric[found] = arrived.take(there)
        reached = reached | fresh
