"""Figures of a pattern: its order, how even its gaps and its first row are, its webs, margins and open area.

All figures of `Quality` are relative to the local pitch: neither the unit nor the size of the part matters.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy.spatial import cKDTree

from .distance import boundary_distance
from .mesh import Bools, Floats, Ints

if TYPE_CHECKING:
    from .pattern import Pattern
    from .region import Region

INTERIOR = 1.25
"""A bubble farther than this many pitches from the region's boundary is interior: from the second row on."""

REACH = 1.9
"""Delaunay neighbours farther apart than this many pitches face each other across a void or an island."""

HORIZON = 3.0
"""Bubbles farther than this many pitches have no say in who the neighbours are."""

SHEET_TURN = -0.3
"""Normals with a smaller cosine are of different sheets: a box's edge is crossed, a thin wall is not."""

SHEET_STEP = 0.4
"""Largest share of two bubbles' distance that is along their mean normal: 0 on any arc, 1 when stacked."""

CANDIDATES = (12, 26, 60)
"""How many of the nearest bubbles are looked at for neighbours, more only where these leave a doubt."""

FLAT_CORNER = 1e-6
"""Shorter Voronoi edges (in pitches) do not count: four bubbles on one circle are no neighbours crosswise."""


@dataclass(frozen=True)
class Quality:
    """How good a packing is. A figure with nothing to measure (no interior bubble, no first row) is nan.

    six: share of interior bubbles with exactly six neighbours
    psi6: mean over interior bubbles of |sum of exp(6 i angle)| / number of neighbours; 1 on a perfect lattice
    gap_cv: standard deviation / mean of the distance to the nearest bubble relative to the pitch, all bubbles
    gap_min: smallest of these relative distances
    rim_cv: standard deviation / mean of the first row's distances to the boundary relative to the pitch
    """

    six: float
    psi6: float
    gap_cv: float
    gap_min: float
    rim_cv: float


def measure(pattern: Pattern, region: Region) -> Quality:
    """Quality of a pattern on its target region."""
    return measure_points(
        pattern.position, pattern.normal, pattern.pitch, pattern.row, region.boundary_segments
    )


def measure_points(
    position: Floats, normal: Floats, pitch: Floats, row: Ints, boundary_segments: Floats
) -> Quality:
    """Quality of any points, so that other programs' arrangements are measured by the same rule.

    position: (n, 3); normal: (n, 3) unit; pitch: (n,) local centre distance; row: (n,) 0 for the first row
    along the boundary; boundary_segments: (S, 2, 3), none for a closed surface
    """
    n = len(position)
    to_boundary = boundary_distance(position, boundary_segments) / pitch
    interior = to_boundary > INTERIOR
    near = neighbours(position, normal, pitch)
    count = np.bincount(near.first, minlength=n)
    star = np.bincount(near.first, np.cos(6 * near.angle), n) + 1j * np.bincount(
        near.first, np.sin(6 * near.angle), n
    )
    order = np.abs(star) / np.maximum(count, 1)
    gap = np.full(n, np.inf)
    np.minimum.at(gap, near.first, near.distance / pitch[near.first])
    gap = gap[np.isfinite(gap)]
    rim = to_boundary[(row == 0) & np.isfinite(to_boundary)]
    return Quality(
        six=_mean(count[interior] == 6),
        psi6=_mean(order[interior]),
        gap_cv=_variation(gap),
        gap_min=float(gap.min()) if len(gap) else np.nan,
        rim_cv=_variation(rim),
    )


def min_web(pattern: Pattern) -> float:
    """Least material between features of one sheet, |xi - xj| - (di + dj) / 2, a length in the unit of the
    base, below 0 where they overlap; inf without neighbours.
    """
    near = neighbours(pattern.position, pattern.normal, pattern.pitch)
    if not len(near.first):
        return np.inf
    web = near.distance - (pattern.diameter[near.first] + pattern.diameter[near.second]) / 2
    return float(web.min())


def min_margin(pattern: Pattern, region: Region) -> float:
    """Least distance from a feature's edge to the region's boundary, in the unit of the base, below 0 where
    it is crossed; inf when there is no such pair.
    """
    if not len(pattern) or not len(region.boundary_segments):
        return np.inf
    distance = boundary_distance(pattern.position, region.boundary_segments)
    return float((distance - pattern.diameter / 2).min())


def open_area(pattern: Pattern, region: Region) -> float:
    """Share of the region's area, 0 to 1, that the features take at the surface, rim and draft included."""
    share = 1.0 if pattern.share is None else pattern.share
    return float(np.pi / 4 * (share * pattern.diameter**2).sum() / region.area)


@dataclass(frozen=True)
class Neighbours:
    """Directed pairs of neighbouring bubbles, m of them, grouped by the first.

    first, second: (m,) indices of bubbles
    distance: (m,) straight distance of the two centres
    angle: (m,) direction from first to second in the tangent plane of the first, from an arbitrary zero
    """

    first: Ints
    second: Ints
    distance: Floats
    angle: Floats


def neighbours(position: Floats, normal: Floats, pitch: Floats) -> Neighbours:
    """Delaunay neighbours of every bubble in its own tangent plane and sheet, no farther than REACH pitches.

    The bubbles around one are turned into its tangent plane about it with their distances kept; those whose
    bisectors bound its Voronoi cell there are its neighbours (the dual of the Delaunay triangulation). The
    nearest few bound the cell almost always; where a farther one could still reach it, more are looked at.

    position: (n, 3); normal: (n, 3) unit; pitch: (n,)
    """
    axes = _tangent_axes(normal)
    tree = cKDTree(position)
    rows = np.arange(len(position))
    found = []
    for candidates in CANDIDATES:
        k = min(candidates, len(position) - 1)
        if k < 1 or not len(rows):
            break
        step = max(1, 300_000 // k**2)  # a chunk's k x k tables of bisectors stay in the processor's cache
        last = k == len(position) - 1 or candidates == CANDIDATES[-1]
        unsure = []
        for start in range(0, len(rows), step):
            chunk = rows[start : start + step]
            pairs, sure = _star(chunk, k, tree, position, normal, axes, pitch)
            keep = sure | last
            found.append(tuple(column[keep[pairs[0]]] for column in (chunk[pairs[0]], *pairs[1:])))
            unsure.append(chunk[~keep])
        rows = np.concatenate(unsure)
    if not found:
        none = np.zeros(0, np.int64)
        return Neighbours(none, none, np.zeros(0), np.zeros(0))
    first, second, distance, angle = (np.concatenate(column) for column in zip(*found, strict=True))
    grouped = np.argsort(first, kind="stable")
    return Neighbours(first[grouped], second[grouped], distance[grouped], angle[grouped])


def _star(
    rows: Ints, k: int, tree: cKDTree, position: Floats, normal: Floats, axes: Floats, pitch: Floats
) -> tuple[tuple[Ints, Ints, Floats, Floats], Bools]:
    """Neighbours of the bubbles `rows` among the k nearest of each.

    Returns the pairs as (index into rows, second, distance, angle), and for every row whether nobody beyond
    the k nearest could be a neighbour as well.
    """
    size = pitch[rows, None]
    distance, other = tree.query(position[rows], k + 1)
    own = other == rows[:, None]
    own[~own.any(axis=1), -1] = True  # more than k bubbles in one place: any one of them is as good
    distance, other = distance[~own].reshape(-1, k), other[~own].reshape(-1, k)
    offset = position[other] - position[rows, None]
    flat = np.matmul(offset, axes[rows].swapaxes(1, 2))
    length = np.sqrt(flat[..., 0] ** 2 + flat[..., 1] ** 2)
    near = (distance <= HORIZON * size) & same_sheet(offset, normal[rows, None], normal[other], distance)
    seen = near & (length > 0)
    flat *= (distance / np.where(seen, length, 1.0) / size)[..., None]
    cell, radius = _bounds_cell(flat, seen)
    sure = np.minimum(2 * radius, HORIZON) * pitch[rows] <= distance[:, -1]
    cell &= distance <= REACH * size
    cell |= near & (distance == 0)
    i, j = np.nonzero(cell)
    angle = np.arctan2(flat[i, j, 1], flat[i, j, 0])
    return (i, other[i, j], distance[i, j], angle), sure


def _tangent_axes(normal: Floats) -> Floats:
    """Two unit vectors across every unit normal, (n, 2, 3), right-handed with it."""
    least = np.eye(3)[np.abs(normal).argmin(axis=1)]
    first = np.cross(normal, least)
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    return np.stack([first, np.cross(normal, first)], axis=1)


def same_sheet(offset: Floats, normal: Floats, other: Floats, distance: Floats) -> Bools:
    """Whether bubbles `offset` away with normals `other` lie on the sheet of those with `normal`, (n, k).

    Along an arc the chord is perpendicular to the mean of the two normals, whatever the curvature; between
    two sheets that face the same way it is not, and sheets back to back have opposite normals.
    """
    cosine = np.einsum("nkc,nkc->nk", np.broadcast_to(normal, other.shape), other)
    mean = normal + other
    height = np.abs(np.einsum("nkc,nkc->nk", offset, mean))
    return (cosine > SHEET_TURN) & (height <= SHEET_STEP * distance * np.linalg.norm(mean, axis=2))


def _bounds_cell(flat: Floats, seen: Bools) -> tuple[Bools, Floats]:
    """Whose bisectors bear an edge of the origin's Voronoi cell, (n, k), and the cell's radius, (n,).

    flat: (n, k, 2) in pitches; seen: (n, k) which of them count. A place on the bisector of j is
    p_j / 2 + t perp(p_j); every other point m bounds t: t perp(p_j) . p_m <= (|p_m|^2 - p_j . p_m) / 2.
    """
    x, y = flat[..., 0], flat[..., 1]
    square = x * x + y * y
    cross = x[:, :, None] * y[:, None, :] - y[:, :, None] * x[:, None, :]
    free = (square[:, None, :] - np.matmul(flat, flat.swapaxes(1, 2))) / 2
    cross = np.where(seen[:, None, :], cross, np.nan)  # a nan bounds nothing
    level = np.abs(cross) < 1e-12
    hidden = (level & (free < -1e-12)).any(axis=2)  # straight behind a nearer one
    with np.errstate(divide="ignore", invalid="ignore"):
        bound = free / cross
    high = np.where(cross >= 1e-12, bound, np.inf).min(axis=2)
    low = np.where(cross <= -1e-12, bound, -np.inf).max(axis=2)
    square = np.where(seen, square, 1.0)
    cell = seen & ~hidden & ((high - low) * np.sqrt(square) > FLAT_CORNER)
    farthest = np.sqrt(square * (0.25 + np.maximum(high**2, low**2)))
    return cell, np.where(cell, farthest, 0.0).max(axis=1)


def _mean(values: Floats | Bools) -> float:
    return float(values.mean()) if len(values) else np.nan


def _variation(values: Floats) -> float:
    return float(values.std() / values.mean()) if values.any() else np.nan
