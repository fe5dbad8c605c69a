"""What can be measured on a closed surface: is it closed, how many handles, shells, how much volume."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components

from .mesh import Bools, Floats, Ints, Mesh
from .ranking import ranked

BLOCK = 1 << 14
"""Triangles worked on together: their values stay in the processor's own memory."""


@dataclass(frozen=True)
class Measures:
    """What is measured on a surface.

    closed: every edge is shared by exactly two triangles, which run along it in opposite directions
    euler: V - E + F of a closed surface
    volumes: signed volume of every connected shell, (shells,); a cavity's is negative
    """

    closed: bool
    euler: int
    volumes: Floats


def measure(mesh: Mesh) -> Measures:
    """All of `Measures` from one sorting of the edges."""
    triangles = mesh.triangles
    if len(triangles) == 0:
        return Measures(False, 0, np.zeros(0))
    keys, bits = edge_keys(triangles)
    keys.sort()
    closed = _pair_up(keys)
    edges = (keys[::2] if closed else keys) >> 1
    shell, used = _vertex_shells(edges >> bits, edges & ((1 << bits) - 1))
    volume = signed_volumes(mesh)
    if shell.max() == 0:
        volumes = volume.sum(keepdims=True)
    else:
        volumes = np.bincount(shell[triangles[:, 0]], weights=volume)
    # a closed surface has 3/2 as many edges as faces
    return Measures(closed, int(used.sum()) - len(triangles) * 3 // 2 + len(triangles), volumes)


def edge_keys(triangles: Ints) -> tuple[Ints, int]:
    """The directed edges of `triangles`, (T, 3), each as one number, and the bits that a vertex takes in it.

    The edge between vertices i < j is (i << bits | j) << 1, plus 1 where it runs from j to i. Edges stand in
    columns, (3 T,): all edges from first to second corners, then from second to third, from third to first.
    """
    bits = int(triangles.max(initial=0)).bit_length()
    keys = np.empty((3, len(triangles)), dtype=np.int64)
    for start in range(0, len(triangles), BLOCK):
        one = np.ascontiguousarray(triangles[start : start + BLOCK].T)
        other = one[[1, 2, 0]]
        key = np.minimum(one, other)
        key <<= bits
        key |= np.maximum(one, other)
        key <<= 1
        key |= one > other
        keys[:, start : start + BLOCK] = key
    return keys.ravel(), bits


def _pair_up(ranked: Ints) -> bool:
    """Do edges by rising key follow each other as one forward, the same backward, each once?"""
    if len(ranked) == 0 or len(ranked) % 2:
        return False
    first, second = ranked[::2], ranked[1::2]
    return bool(np.all(second == first + 1) and not np.any(first & 1) and np.all(second[:-1] < first[1:]))


def opposites(triangles: Ints) -> Ints | None:
    """For each directed edge of a closed surface the one that runs back along it, (3 T,); None where it is
    not closed. Edges are numbered as in `edge_keys`: edge k of triangle t is k T + t.
    """
    keys, bits = edge_keys(triangles)
    keys, order = ranked(keys, 2 * bits + 1)
    if not _pair_up(keys):
        return None
    opposite = np.empty(len(order), dtype=np.int64)
    opposite[order[::2]], opposite[order[1::2]] = order[1::2], order[::2]
    return opposite


def linked(neighbour: Ints, links: Bools) -> Ints:
    """Which group of triangles that hang together over `links` each belongs to, (T,), numbered from 0.

    neighbour, links: (3, T) the triangle across each edge, and whether the edge links the two, which both
    must say alike
    """
    count = neighbour.shape[1]
    starts = np.zeros(count + 1, dtype=np.int32)
    np.cumsum(links.sum(axis=0), out=starts[1:])
    others = neighbour.T[links.T].astype(np.int32)
    graph = csr_array((np.ones(len(others)), others, starts), shape=(count, count))
    # the graph leads both ways everywhere: so strongly connected is connected, and found twice as fast
    return connected_components(graph, connection="strong")[1].astype(np.int64)


def _vertex_shells(low: Ints, high: Ints) -> tuple[Ints, Bools]:
    """Which shell each vertex belongs to, numbered from 0, -1 for one without edges, and which have any.

    low, high: (E,) ends of the edges, by rising `low`
    """
    count = int(high.max()) + 1
    faced = np.bincount(low, minlength=count)
    starts = np.zeros(count + 1, dtype=np.int32)
    np.cumsum(faced, out=starts[1:])
    graph = csr_array((np.ones(len(high)), high.astype(np.int32), starts), shape=(count, count))
    shells, label = connected_components(graph, directed=False)
    used = faced > 0
    used[high] = True
    if used.all():
        return label.astype(np.int64), used
    present = np.zeros(shells, dtype=bool)
    present[label[used]] = True
    return np.where(used, (np.cumsum(present) - 1)[label], -1), used


def patch_euler(patches: Ints, owner: Ints, others: Ints, count: int) -> Floats:
    """V - E + F of the patch of triangles of each owner 0 .. count-1 in a closed surface, (count,).

    patches: (P, 3) triangles of the patches; owner: (P,) whose they are; others: (Q, 3) all other triangles;
    patches share no vertices. A through-hole's wall is a ring, 0; a blind hole's with its floor a disc, 1.
    Every inner edge has two faces and every rim vertex one rim edge, so E = (3 F + rim vertices) / 2; where a
    patch's rim touches itself that is wrong, and so is the shape.
    """
    number = int(max(patches.max(initial=-1), others.max(initial=-1))) + 1
    holder, rim = np.full(number, count), np.zeros(number, dtype=bool)
    for corner in patches.T:
        holder[corner] = owner
    rim[others] = True
    # what belongs to nobody is counted under the owner past the last
    inner = np.bincount(holder, minlength=count + 1)[:count]
    edge = np.bincount(holder[rim], minlength=count + 1)[:count]
    return inner - (np.bincount(owner, minlength=count) + edge) / 2


def fans(triangles: Ints, opposite: Ints) -> Ints:
    """Which fan of faces round a vertex each corner belongs to, (T, 3), numbered from 0, for a closed surface
    and its `opposites`.

    Where a surface touches itself in a vertex, that vertex has several fans; everywhere else it has one.
    """
    size, count = triangles.size, len(triangles)
    # back along an edge and on to the next one of that triangle: the next edge from the same vertex
    turned = (opposite + count) % size
    lowest, reach = np.arange(size), 1
    most = int(np.bincount(triangles.ravel()).max())
    # the lowest of one, two, four ... corners round the vertex, until that is all of them
    while reach < most:
        lowest = np.minimum(lowest, lowest[turned])
        turned, reach = turned[turned], 2 * reach
    number = np.cumsum(lowest == np.arange(size)) - 1
    return number[lowest].reshape(3, count).T


def signed_volumes(mesh: Mesh) -> Floats:
    """Volume between each triangle and the plane z = middle, seen from the middle of the mesh, (T,); their
    sum is the volume.
    """
    # a column per coordinate: several times faster than rows of three
    columns = np.ascontiguousarray(mesh.vertices.T)
    x, y, z = columns - (columns.min(axis=1, keepdims=True) + columns.max(axis=1, keepdims=True)) / 2
    volume = np.empty(len(mesh.triangles))
    for start in range(0, len(volume), BLOCK):
        corners = np.ascontiguousarray(mesh.triangles[start : start + BLOCK].T)
        (ax, bx, cx), (ay, by, cy), (az, bz, cz) = x[corners], y[corners], z[corners]
        area = (bx - ax) * (cy - ay) - (cx - ax) * (by - ay)
        volume[start : start + BLOCK] = area * (az + bz + cz)
    return volume / 6
