"""Large flat faces split for the time of a boolean.

A boolean triangulates what is left of each face it cut, in time that grows with the square of the holes in
that face: ten thousand holes in the two triangles of a plate take longer than the same holes in a curved
surface. So a triangle with many holes is split first, at points that lie on the holes' axes. No edge of the
triangle gets a new point, so no neighbour changes; the new points fall out with the holes; and the pieces
carry their triangle's identity, so that the boolean joins them again where nothing was cut.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial import Delaunay

from .mesh import Floats, Ints, Mesh

MANY = 150
"""Holes in one triangle from which on it is split: with fewer, the pieces' edges cost more than they save."""
PER_POINT = 8
"""Holes for each point at which a triangle is split."""


def split_crowded(mesh: Mesh, triangle: Ints, place: Floats, room: Floats) -> tuple[Mesh, Ints]:
    """`mesh` with its crowded triangles split, and the triangle of `mesh` each new one is part of, (T',).

    triangle, place: (k,), (k, 3) where the axes of cutters cross triangles; a cutter covers at least `room`,
        (k,), round it
    """
    holes = np.bincount(triangle, minlength=len(mesh.triangles))
    crowded = np.flatnonzero(holes >= MANY)
    if len(crowded) == 0:
        return mesh, np.arange(len(mesh.triangles))
    picked = _picked(mesh, triangle, place, room, holes)
    picked = picked[np.argsort(triangle[picked], kind="stable")]
    bounds = np.searchsorted(triangle[picked], np.stack([crowded, crowded + 1], axis=1))
    points, pieces, owners = [mesh.vertices], [], []
    count = len(mesh.vertices)
    split = np.zeros(len(mesh.triangles), dtype=bool)
    # few: each of these triangles holds at least MANY features
    for which, (start, end) in zip(crowded, bounds, strict=True):
        inner = place[picked[start:end]]
        piece = _pieces(mesh.vertices[mesh.triangles[which]], inner)
        if len(piece) == 0:
            continue
        names = np.concatenate([mesh.triangles[which], count + np.arange(len(inner))])
        points.append(inner)
        pieces.append(names[piece])
        owners.append(np.full(len(piece), which))
        count += len(inner)
        split[which] = True
    whole = np.flatnonzero(~split)
    triangles = np.concatenate([mesh.triangles[whole], *pieces])
    return Mesh(np.concatenate(points), triangles), np.concatenate([whole, *owners])


def _picked(mesh: Mesh, triangle: Ints, place: Floats, room: Floats, holes: Ints) -> Ints:
    """Which of `place` split their triangle: about one in PER_POINT, evenly spread, clear of the triangle's
    edges.
    """
    ready = np.flatnonzero(holes[triangle] >= MANY)
    corners = mesh.vertices[mesh.triangles[triangle[ready]]]
    normal = mesh.area_vectors[triangle[ready]]
    area = np.linalg.norm(normal, axis=1)[:, None]
    along = np.roll(corners, -1, axis=1) - corners
    along /= np.linalg.norm(along, axis=2)[..., None]
    inward = np.cross(normal[:, None] / area[:, None], along)
    offset = place[ready][:, None] - corners
    clear = np.einsum("mck,mck->mc", offset, inward).min(axis=1) > room[ready]
    # one point from each cell of a grid laid over the triangle, the one nearest to the cell's middle
    step = np.sqrt(area[:, 0] / 2 / holes[triangle[ready]] * PER_POINT)
    at = np.stack([np.einsum("mk,mk->m", offset[:, 0], way[:, 0]) / step for way in (along, inward)], axis=1)
    ready, at = ready[clear], at[clear]
    cell = np.floor(at).astype(np.int64)
    astray = np.abs(at - cell - 0.5).max(axis=1)
    key = np.column_stack([triangle[ready], cell])
    order = np.lexsort((ready, astray, key[:, 2], key[:, 1], key[:, 0]))
    new = np.ones(len(order), dtype=bool)
    new[1:] = np.any(key[order[1:]] != key[order[:-1]], axis=1)
    return ready[order[new]]


def _pieces(corners: Floats, inner: Floats) -> Ints:
    """Triangulation of a triangle, (3, 3), with the points `inner`, (m, 3), inside it, (2 m + 1, 3) or none.

    Indices into corners and then inner, wound like the triangle. Delaunay's hull is the triangle itself;
    should rounding say otherwise, the triangle stays whole.
    """
    none = np.zeros((0, 3), dtype=np.int64)
    if len(inner) == 0:
        return none
    normal = np.cross(corners[1] - corners[0], corners[2] - corners[0])
    drop = int(np.argmax(np.abs(normal)))
    size = np.abs(corners - corners[0]).max()
    # seen along the axis nearest to its normal, in units of its size
    flat = np.delete(np.concatenate([corners, inner]) - corners[0], drop, axis=1) / size
    pieces = Delaunay(flat).simplices.astype(np.int64)
    a, b, c = flat[pieces].swapaxes(0, 1)
    area = (b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]
    whole = abs(normal[drop]) / size**2
    if len(pieces) != 2 * len(inner) + 1 or abs(np.abs(area).sum() - whole) > 1e-9 * whole:
        return none
    turned = (area > 0) != ((normal[drop] > 0) == (drop != 1))
    pieces[turned] = pieces[turned][:, ::-1]
    return pieces
