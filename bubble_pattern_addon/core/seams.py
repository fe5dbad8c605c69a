"""Where a region must be cut open before it can be laid flat.

A region that is a disc, with islands or without, needs no cut. A tube is slit from end to end, a handle
across and along, a closed surface from one end to the other; where that is not enough, every loop is joined
and every sharp corner is reached. The cuts run along edges of the base, on shortest paths: a tree of
shortest paths and a spanning tree of the dual graph that does not cross it, Erickson and Whittlesey, "Greedy
optimal homotopy and homology generators", 2005.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components, dijkstra, minimum_spanning_tree

from .mesh import Bools, Floats, Ints
from .region import Region
from .vectors import dots

# A loop whose turning is farther from an island's than this is an end of a tube.
TUBE_END = np.pi / 2
# Where faces bend by more than this, a cut is seen least: along there it counts as CREASED times as long.
CREASE = np.radians(20.0)
CREASED = 0.5
# A corner with more angle missing (or too much) than this is reached by a cut, where corners are.
SHARP = 0.2


@dataclass(frozen=True)
class Edges:
    """Edges of a region between its vertices; edge e lies opposite to the corner `corner` of triangle `row`.

    vertex: (R, 3) numbers of the corners' vertices, as the region is connected: a place where two parts of it
    only touch is two vertices
    of: (R, 3) number of the edge opposite to each corner
    ends: (E, 2) vertices; length: (E,); row, corner: (E,); rim: (E,) whether it is on the boundary
    """

    vertex: Ints
    of: Ints
    ends: Ints
    length: Floats
    row: Ints
    corner: Ints
    rim: Bools


def corner_vertices(region: Region, joined: Bools) -> Ints:
    """Numbers of the vertices at the corners, (R, 3), when triangles hang together across `joined` (R, 3)."""
    row, corner = np.nonzero(joined)
    there, facing = region.neighbours[row, corner], region.opposite[row, corner]
    own = np.concatenate([3 * row + (corner + 1) % 3, 3 * row + (corner + 2) % 3])
    other = np.concatenate([3 * there + (facing + 2) % 3, 3 * there + (facing + 1) % 3])
    links = coo_array((np.ones(len(own)), (own, other)), shape=(joined.size,) * 2)
    return connected_components(links, directed=False)[1].astype(np.int64).reshape(-1, 3)


def find_edges(region: Region) -> Edges:
    """The edges of a region, each once."""
    neighbours = region.neighbours
    vertex = corner_vertices(region, neighbours >= 0)
    rows = np.arange(len(neighbours))[:, None]
    row, corner = np.nonzero((neighbours < 0) | (rows < neighbours))
    of = np.full(neighbours.shape, -1)
    of[row, corner] = np.arange(len(row))
    inner = np.flatnonzero(neighbours[row, corner] >= 0)
    r, c = row[inner], corner[inner]
    of[neighbours[r, c], region.opposite[r, c]] = inner
    first, second = (corner + 1) % 3, (corner + 2) % 3
    length = np.linalg.norm(region.corners[row, first] - region.corners[row, second], axis=1)
    ends = np.stack([vertex[row, first], vertex[row, second]], axis=1)
    return Edges(vertex, of, ends, length, row, corner, neighbours[row, corner] < 0)


def find_cuts(region: Region, all_the_way: bool = False) -> Bools:
    """Edges to cut, (R, 3) by the corner opposite to them and from both sides, so that each part of the
    region can be laid flat.

    all_the_way: join every loop and reach every sharp corner, as unfolds a cone's frustum or a box
    """
    edges = _along_creases(region, find_edges(region))
    angle = corner_angles(region)
    count = int(edges.vertex.max()) + 1
    around = np.bincount(edges.vertex.ravel(), angle.ravel(), count)
    on_rim = np.zeros(count, dtype=bool)
    on_rim[edges.ends[edges.rim].ravel()] = True
    islands, outer = _loops(region, edges, around, all_the_way)
    defect = np.where(on_rim, 0.0, np.abs(2 * np.pi - around))
    sharp = np.flatnonzero(defect > SHARP) if all_the_way else np.empty(0, dtype=np.int64)
    sheet = np.zeros(count, dtype=np.int64)
    sheet[edges.vertex.ravel()] = np.repeat(region.sheet, 3)

    # Whoever has reached an end of a tube is everywhere on its rim: that counts as one vertex.
    free = edges.rim & (islands < 0)
    merged = _merged(edges.ends[free], count)
    edges = replace(edges, ends=merged[edges.ends])
    roots, farthest = _roots(edges, sheet, merged[outer], defect, count)
    before, distance = _tree(edges, roots, count)
    in_tree = np.zeros(len(edges.ends), dtype=bool)
    in_tree[before[before >= 0]] = True
    left = _left_over(region, edges, islands, in_tree, free, distance)
    targets = [edges.ends[left].ravel(), sharp, edges.ends[free, 0]]
    closed_smooth = [
        v for v in farthest.tolist() if not np.isin(sharp, np.flatnonzero(sheet == sheet[v])).any()
    ]
    targets.append(np.array(closed_smooth, dtype=np.int64))
    cut = left.copy()
    cut[_paths(np.concatenate(targets), edges, before)] = True
    for v in closed_smooth:
        if cut[np.isin(edges.ends[:, 0], np.flatnonzero(sheet == sheet[v]))].sum() < 2:
            # one edge alone can't be opened; so few vertices can all be reached
            cut[_paths(np.flatnonzero(sheet == sheet[v]), edges, before)] = True
    result: Bools = (cut & ~edges.rim)[edges.of]
    return result


def _along_creases(region: Region, edges: Edges) -> Edges:
    """The edges with those shorter along which the region bends."""
    beside = region.neighbours[edges.row, edges.corner]
    cosine = dots(region.normals[edges.row], region.normals[beside])
    creased = ~edges.rim & (cosine < np.cos(CREASE))
    return replace(edges, length=np.where(creased, CREASED * edges.length, edges.length))


def _merged(pairs: Ints, count: int) -> Ints:
    """One number, that of its first, for each group of vertices that these pairs join, (count,)."""
    links = coo_array((np.ones(len(pairs)), tuple(pairs.T)), shape=(count, count))
    label = connected_components(links, directed=False)[1]
    _, first = np.unique(label, return_index=True)
    return first[label].astype(np.int64)


def corner_angles(region: Region) -> Floats:
    """Angles of the triangles at their corners, (R, 3)."""
    after = np.roll(region.corners, -1, axis=1) - region.corners
    before = np.roll(region.corners, 1, axis=1) - region.corners
    sine = np.linalg.norm(np.cross(after, before), axis=2)
    return np.arctan2(sine, np.einsum("rkc,rkc->rk", after, before))


def _loops(region: Region, edges: Edges, around: Floats, all_the_way: bool) -> tuple[Ints, Ints]:
    """Number of the island that an edge borders on, -1 for none, (E,), and a vertex on the outer loop of
    every sheet that has one.

    What the boundary turns through tells them apart (Gauss and Bonnet): 2 pi round a flat region, -2 pi round
    an island in it, nothing at the end of a tube.
    """
    islands = np.full(len(edges.ends), -1)
    if not len(region.rim):
        return islands, np.empty(0, dtype=np.int64)
    row, corner = region.rim.T
    loop = np.repeat(np.arange(len(region.loops)), [len(vertices) for vertices in region.loops])
    start = edges.vertex[row, (corner + 1) % 3]
    turning = np.bincount(loop, np.pi - around[start])
    first = np.searchsorted(loop, np.arange(len(region.loops)))
    sheet = region.sheet[row[first]]
    order = np.lexsort((np.arange(len(turning)), -np.round(turning, 6), sheet))
    outer = order[np.diff(sheet[order], prepend=-1) != 0]
    is_island = (np.abs(turning + 2 * np.pi) < TUBE_END) & (not all_the_way)
    is_island[outer] = False
    islands[edges.of[row, corner]] = np.where(is_island[loop], loop, -1)
    return islands, start[first[outer]]


def _roots(edges: Edges, sheet: Ints, outer: Ints, defect: Floats, count: int) -> tuple[Ints, Ints]:
    """A vertex of every sheet to start from, a sharp one where there are, and of every closed sheet the one
    farthest from there."""
    closed = np.setdiff1d(np.arange(sheet.max() + 1), sheet[outer])
    order = np.lexsort((np.arange(count), -np.round(defect, 9), sheet))
    sharpest = order[np.diff(sheet[order], prepend=-1) != 0][closed]
    if not len(closed):
        return outer, closed
    ends = _farthest(edges, sharpest, sheet, closed, count)
    ends = np.where(defect[sharpest] > SHARP, sharpest, ends)
    return np.concatenate([outer, ends]), _farthest(edges, ends, sheet, closed, count)


def _farthest(edges: Edges, roots: Ints, sheet: Ints, closed: Ints, count: int) -> Ints:
    _, distance = _tree(edges, roots, count)
    order = np.lexsort((np.arange(count), -np.where(np.isfinite(distance), distance, -1.0), sheet))
    return order[np.diff(sheet[order], prepend=-1) != 0][closed]


def _tree(edges: Edges, roots: Ints, count: int) -> tuple[Ints, Floats]:
    """Shortest paths from the roots: the edge by which each vertex is reached, -1 for none, and how far."""
    low, high = np.sort(edges.ends, axis=1).T
    order = np.lexsort((edges.length, high, low))
    unique = (np.diff(low[order], prepend=-1) != 0) | (np.diff(high[order], prepend=-1) != 0)
    best = order[unique & (low[order] != high[order])]
    graph = coo_array((edges.length[best], (low[best], high[best])), shape=(count, count)).tocsr()
    distance, previous, _ = dijkstra(
        graph, directed=False, indices=roots, return_predecessors=True, min_only=True
    )
    reached = np.flatnonzero(previous >= 0)
    key = np.minimum(reached, previous[reached]) * count + np.maximum(reached, previous[reached])
    before = np.full(count, -1)
    before[reached] = best[np.searchsorted(low[best] * count + high[best], key)]
    return before, np.where(np.isfinite(distance), distance, 0.0)


def _left_over(
    region: Region, edges: Edges, islands: Ints, in_tree: Bools, free: Bools, distance: Floats
) -> Bools:
    """Edges, (E,), that are neither on a shortest path nor crossed by a spanning tree of the triangles and
    the islands: two for each handle.
    """
    crossed = np.flatnonzero(~in_tree & ~free)
    row, corner = edges.row[crossed], edges.corner[crossed]
    over = np.where(
        islands[crossed] >= 0, len(region.triangles) + islands[crossed], region.neighbours[row, corner]
    )
    total = len(region.triangles) + len(region.loops)
    # the shortest loops are to be left over
    worth = distance[edges.ends[crossed]].sum(axis=1) + edges.length[crossed]
    cost = 2 * worth.max(initial=1.0) - worth
    low, high = np.minimum(row, over), np.maximum(row, over)
    order = np.lexsort((cost, high, low))
    unique = (np.diff(low[order], prepend=-1) != 0) | (np.diff(high[order], prepend=-1) != 0)
    best = order[unique & (low[order] != high[order])]
    graph = coo_array((cost[best], (low[best], high[best])), shape=(total, total)).tocsr()
    tree = minimum_spanning_tree(graph).tocoo()
    found = np.searchsorted(low[best] * total + high[best], tree.row.astype(np.int64) * total + tree.col)
    left = np.zeros(len(edges.ends), dtype=bool)
    left[crossed] = True
    left[crossed[best[found]]] = False
    return left


def _paths(targets: Ints, edges: Edges, before: Ints) -> Ints:
    """The edges on the ways from these vertices to their roots."""
    found: list[Ints] = [np.empty(0, dtype=np.int64)]
    seen = np.zeros(len(before), dtype=bool)
    at = np.unique(targets)
    while len(at := at[~seen[at] & (before[at] >= 0)]):
        seen[at] = True
        edge = before[at]
        found.append(edge)
        at = np.unique(edges.ends[edge].sum(axis=1) - at)
    return np.concatenate(found)
