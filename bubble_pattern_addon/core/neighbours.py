"""Who stands next to whom in an arrangement of points on a surface: Delaunay neighbours, sheet by sheet."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from .mesh import Bools, Floats, Ints

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
class Neighbours:
    """Directed pairs of neighbouring bubbles, m of them, grouped by the first.

    first, second: (m,) indices of bubbles
    distance: (m,) straight distance of the two centres
    angle: (m,) direction from first to second in the tangent plane of the first, from an arbitrary zero
    ends: (m, 2) where the edge between both bubbles' Voronoi cells ends to the left and to the right of their
    middle, in shares of their distance; infinite where it is open
    """

    first: Ints
    second: Ints
    distance: Floats
    angle: Floats
    ends: Floats


def neighbours(position: Floats, normal: Floats, pitch: Floats) -> Neighbours:
    """Delaunay neighbours of every bubble in its own tangent plane and sheet, no farther than REACH pitches.

    The bubbles around one are turned into its tangent plane about it with their distances kept; those whose
    bisectors bound its Voronoi cell there are its neighbours (the dual of the Delaunay triangulation). The
    nearest few bound the cell almost always; where a farther one could still reach it, more are looked at.

    position: (n, 3); normal: (n, 3) unit; pitch: (n,)
    """
    axes = tangent_axes(normal)
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
        return Neighbours(none, none, np.zeros(0), np.zeros(0), np.zeros((0, 2)))
    columns = [np.concatenate(column) for column in zip(*found, strict=True)]
    grouped = np.argsort(columns[0], kind="stable")
    return Neighbours(*(column[grouped] for column in columns))


def _star(
    rows: Ints, k: int, tree: cKDTree, position: Floats, normal: Floats, axes: Floats, pitch: Floats
) -> tuple[tuple[Ints, Ints, Floats, Floats, Floats], Bools]:
    """Neighbours of the bubbles `rows` among the k nearest of each.

    Returns the pairs as (index into rows, second, distance, angle, ends), and for every row whether nobody
    beyond the k nearest could be a neighbour as well.
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
    cell, radius, left, right = _bounds_cell(flat, seen)
    sure = np.minimum(2 * radius, HORIZON) * pitch[rows] <= distance[:, -1]
    cell &= distance <= REACH * size
    cell |= near & (distance == 0)
    i, j = np.nonzero(cell)
    angle = np.arctan2(flat[i, j, 1], flat[i, j, 0])
    ends = np.stack([left[i, j], right[i, j]], axis=1)
    return (i, other[i, j], distance[i, j], angle, ends), sure


def tangent_axes(normal: Floats) -> Floats:
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


def _bounds_cell(flat: Floats, seen: Bools) -> tuple[Bools, Floats, Floats, Floats]:
    """Whose bisectors bear an edge of the origin's Voronoi cell, (n, k), the cell's radius, (n,), and the
    ends t of these edges to the left and right, (n, k).

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
    with np.errstate(divide="ignore", over="ignore", invalid="ignore"):
        bound = free / cross
    high = np.where(cross >= 1e-12, bound, np.inf).min(axis=2)
    low = np.where(cross <= -1e-12, bound, -np.inf).max(axis=2)
    square = np.where(seen, square, 1.0)
    cell = seen & ~hidden & ((high - low) * np.sqrt(square) > FLAT_CORNER)
    farthest = np.sqrt(square * (0.25 + np.maximum(high**2, low**2)))
    return cell, np.where(cell, farthest, 0.0).max(axis=1), high, low
