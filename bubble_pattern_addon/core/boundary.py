"""How far places on the region are from its boundary."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from .cycles import members
from .mesh import Floats, Ints
from .region import Region
from .vectors import dots

# Nearest samples whose segments are measured exactly; two segments meet at a corner, a sheet's fold may add
# some more.
CANDIDATES = 4
# More, where one that is farther away may count as nearer because it reserves room.
RESERVED_CANDIDATES = 24


@dataclass(frozen=True)
class Boundary:
    """The boundary of a `region`, ready to be asked for distances.

    start, along: (3, S) where each segment begins, with the region on its left, and the way to its end;
    square: (S,) of its length, never 0; owner: (K,) segment of each sample in `tree`; reach: the length over
    which two sheets of the region may face each other without being confused
    """

    region: Region
    start: Floats
    along: Floats
    square: Floats
    owner: Ints
    tree: cKDTree
    reach: float


def make_boundary(region: Region, spacing: float) -> Boundary | None:
    """Index of the region's boundary with samples no farther apart than `spacing`; None where it has no
    boundary.
    """
    if not len(region.rim):
        return None
    start = np.ascontiguousarray(region.boundary_segments[:, 0].T)
    along = region.boundary_segments[:, 1].T - start
    square = np.einsum("cs,cs->s", along, along)
    number = np.maximum(np.ceil(np.sqrt(square) / spacing).astype(np.int64), 1)
    owner, place = members(number)
    share = (place + 0.5) / number[owner]
    points = (start[:, owner] + share * along[:, owner]).T
    row = region.rim[owner, 0]
    reach = 8 * spacing
    tree = cKDTree(signature(region, points, row, reach))
    return Boundary(region, start, along, np.maximum(square, 1e-300), owner, tree, reach)


def signature(region: Region, points: Floats, row: Ints, reach: float) -> Floats:
    """Coordinates, (n, 3) or (n, 7), in which places on sheets that face each other are far apart although
    they touch in space. The first three are the points; more are there where the region has such sheets.

    points: (n, 3) on the triangles `row` (n,). Normals count with the length `reach`, so that both sides of a
    wall thinner than that are kept apart; parts of the region that are not connected are moved out of one
    another's sight.
    """
    if region.single_sheet:
        return points
    apart = 1e3 * (region.extent + reach) * region.sheet[row]
    return np.concatenate([points, reach * region.normals[row], apart[:, None]], axis=1)


def nearest_boundary(boundary: Boundary, points: Floats, row: Ints) -> tuple[Floats, Floats]:
    """Distance (n,) to the nearest boundary segment of the same sheet less what that one reserves, and the
    nearest point on it (n, 3).

    points: (n, 3) on the triangles `row` (n,)
    """
    distance, foot, segment = _nearest_segment(boundary, points, row)
    return distance - boundary.region.reserve[segment], foot


def inside_distance(boundary: Boundary, points: Floats, row: Ints) -> Floats:
    """Distance (n,) to the nearest boundary segment, negative on its other side, less what it reserves.

    points: (n, 3) in the planes of the triangles `row` (n,) of a flat region, inside it or not
    """
    distance, foot, segment = _nearest_segment(boundary, points, row)
    inward = np.cross(boundary.region.normals[row], boundary.along[:, segment].T)
    side = np.copysign(distance, dots(points - foot, inward))
    return side - boundary.region.reserve[segment]


def _nearest_segment(boundary: Boundary, points: Floats, row: Ints) -> tuple[Floats, Floats, Ints]:
    """Distance (n,), nearest point (n, 3) and number (n,) of the boundary segment that is nearest when what
    each reserves is taken off.
    """
    reserve = boundary.region.reserve
    count = min(RESERVED_CANDIDATES if reserve.any() else CANDIDATES, len(boundary.owner))
    _, near = boundary.tree.query(signature(boundary.region, points, row, boundary.reach), k=count)
    # a row per candidate and coordinate, several times faster to work on
    segment = boundary.owner[near.reshape(len(points), count).T]
    along = boundary.along[:, segment]
    away = points.T[:, None] - boundary.start[:, segment]
    share = np.einsum("ckn,ckn->kn", away, along) / boundary.square[segment]
    away -= np.clip(share, 0, 1) * along
    distance = np.sqrt(np.einsum("ckn,ckn->kn", away, away))
    best = (distance - reserve[segment]).argmin(axis=0)
    pick = np.arange(len(points))
    foot = points - away[:, best, pick].T
    return distance[best, pick], foot, segment[best, pick]
