"""What can be measured on a closed surface: is it closed, how many handles, shells, how much volume."""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_array, csr_array
from scipy.sparse.csgraph import connected_components

from .mesh import Floats, Ints, Mesh


def edge_keys(triangles: Ints) -> tuple[Ints, Ints]:
    """Directed edges of `triangles`, (T, 3), each as one number: 2 * (edge) + direction, and the vertex
    count V.

    The edge between vertices i < j is i * V + j; direction 1 runs from j to i. (3 T,), and V as a 0-d array.
    """
    start, end = triangles.ravel(), np.roll(triangles, -1, axis=1).ravel()
    number = np.asarray(triangles.max() + 1 if len(triangles) else 0)
    return (np.minimum(start, end) * number + np.maximum(start, end)) * 2 + (start > end), number


def is_closed(triangles: Ints) -> bool:
    """Is every edge shared by exactly two of `triangles`, (T, 3), that run along it in opposite ways?"""
    if len(triangles) == 0 or len(triangles) % 2:
        return False
    keys = np.sort(edge_keys(triangles)[0])
    first, second = keys[::2], keys[1::2]
    return bool(np.all(second == first + 1) and np.all(first % 2 == 0) and np.all(second[:-1] < first[1:]))


def euler_number(triangles: Ints) -> int:
    """V - E + F of the closed surface `triangles`, (T, 3), whose edges are 3/2 of its faces."""
    used = np.zeros(int(triangles.max()) + 1 if len(triangles) else 0, dtype=bool)
    used[triangles] = True
    return int(used.sum()) - len(triangles) * 3 // 2 + len(triangles)


def shells(mesh: Mesh) -> Ints:
    """Which connected shell each triangle belongs to, (T,), numbered from 0."""
    count = len(mesh.triangles)
    # a graph of triangles and, after them, vertices: in this order its rows are the mesh's own
    size = count + len(mesh.vertices)
    starts = np.minimum(3 * np.arange(size + 1), 3 * count).astype(np.int32)
    corners = (mesh.triangles.ravel() + count).astype(np.int32)
    graph = csr_array((np.ones(3 * count, dtype=np.int8), corners, starts), shape=(size, size))
    label = connected_components(graph, directed=False)[1][:count]
    # vertices that no triangle uses are labelled too
    used = np.zeros(label.max() + 1 if count else 0, dtype=bool)
    used[label] = True
    return (np.cumsum(used) - 1)[label]


def shell_volumes(mesh: Mesh) -> Floats:
    """Signed volume of every connected shell, (shells,), in cubic units; a cavity's is negative."""
    return np.bincount(shells(mesh), weights=signed_volumes(mesh))


def patch_euler(triangles: Ints, owner: Ints, count: int) -> Floats:
    """V - E + F of the patch of triangles of each owner 0 .. count-1 in a closed surface, (count,).

    triangles: (T, 3); owner: (T,), below 0 for none; patches share no vertices. A through-hole's wall is a
    ring, 0; a blind hole's with its floor a disc, 1. Every inner edge has two faces and every rim vertex one
    rim edge, so E = (3 F + rim vertices) / 2; where a patch's rim touches itself that is wrong, and so is
    the shape.
    """
    mine = owner >= 0
    number = int(triangles.max()) + 1 if len(triangles) else 0
    holder, rim = np.full(number, -1), np.zeros(number, dtype=bool)
    holder[triangles[mine]] = owner[mine, None]
    rim[triangles[~mine]] = True
    inner, edge = np.bincount(holder[holder >= 0], minlength=count), holder[rim & (holder >= 0)]
    return inner - (np.bincount(owner[mine], minlength=count) + np.bincount(edge, minlength=count)) / 2


def fans(triangles: Ints) -> Ints:
    """Which fan of faces round a vertex each corner belongs to, (T, 3), for a closed surface.

    Where a surface touches itself in a vertex, that vertex has several fans; everywhere else it has one.
    """
    order = np.argsort(edge_keys(triangles)[0], kind="stable")
    one, other = order[::2], order[1::2]
    # the corner at the start of one is the corner after the start of the other, its opposite
    after = np.arange(triangles.size).reshape(-1, 3)[:, [1, 2, 0]].ravel()
    links = (np.concatenate([one, other]), np.concatenate([after[other], after[one]]))
    size = triangles.size
    graph = coo_array((np.ones(size, dtype=np.int8), links), (size, size))
    return connected_components(graph, directed=False)[1].reshape(-1, 3)


def signed_volumes(mesh: Mesh) -> Floats:
    """Volume of the tetrahedron under each triangle, seen from the middle of the mesh, (T,); their sum is
    the volume.
    """
    middle = (mesh.vertices.min(axis=0) + mesh.vertices.max(axis=0)) / 2
    # a column per coordinate: several times faster than rows of three
    x, y, z = np.ascontiguousarray((mesh.vertices - middle).T)
    (ax, bx, cx), (ay, by, cy), (az, bz, cz) = (side[mesh.triangles.T] for side in (x, y, z))
    return (ax * (by * cz - bz * cy) + ay * (bz * cx - bx * cz) + az * (bx * cy - by * cx)) / 6
