"""Polygons with holes opened to polygons without, by cuts from hole to hole.

A triangulator that finds its own cuts tries every hole against every polygon. Here the holes are joined to
each other and to the polygon round them along a minimum spanning tree of the shortest cuts: as these are the
shortest, hardly one can run into a third hole. Where one does nevertheless, what comes out does not cover the
polygon.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import minimum_spanning_tree
from scipy.spatial import Delaunay, cKDTree

from .cycles import next_round, ranges, unrolled
from .mesh import Floats, Ints


class Contours(NamedTuple):
    """Closed contours one after the other, interior to the left: `vertex` (P,) rows of points, `total` (p,)
    of each.
    """

    vertex: Ints
    total: Ints


def opened(points: Floats, contours: Contours, cell: Ints, outer: int) -> Contours:
    """A contour for each of the cells, which have one contour round the outside and holes in it.

    points: (N, 2), those of different cells far apart; cell: (p,) of each contour, numbered from 0; outer:
    the first so many contours are the outer ones, that of cell 0 first
    """
    start = np.cumsum(contours.total) - contours.total
    at = points[contours.vertex]
    cuts = _cuts(at, start, contours.total, cell, outer)
    onward = _onward(at, contours.total, cuts)
    # there are as many cuts as holes
    holes = np.bincount(cell[outer:], minlength=outer)
    total = np.bincount(cell, contours.total, outer).astype(np.int64) + 2 * holes
    rows = unrolled(onward, start[:outer], total)
    return Contours(contours.vertex[np.concatenate([np.arange(len(at)), cuts.ravel()])[rows]], total)


def _cuts(at: Floats, start: Ints, total: Ints, cell: Ints, outer: int) -> Ints:
    """The cuts of all cells, rows of `at` (P, 2) at their ends: one for every hole, (holes, 2)."""
    middle = np.add.reduceat(at, start)[outer:] / total[outer:, None]
    of_hole = start[outer:], total[outer:]
    one, other = _neighbours(middle, cell[outer:]).T
    way = middle[other] - middle[one]
    between = np.stack([_farthest(at, *of_hole, one, way), _farthest(at, *of_hole, other, -way)], axis=1)
    near = cKDTree(at[: start[outer]]).query(middle)[1]
    every = np.arange(len(middle))
    outward = np.stack([_farthest(at, *of_hole, every, at[near] - middle), near], axis=1)
    cuts = np.concatenate([between, outward])
    length = np.linalg.norm(at[cuts[:, 1]] - at[cuts[:, 0]], axis=1)
    # the outer contours come after the holes
    nodes = len(middle) + outer
    ends = np.concatenate([one, every]), np.concatenate([other, len(middle) + cell[outer:]])
    tree = minimum_spanning_tree(coo_array((length, ends), shape=(nodes, nodes))).tocoo()
    key = ends[0] * nodes + ends[1]
    order = np.argsort(key)
    first, second = (side.astype(np.int64) for side in tree.coords)
    return cuts[order[np.searchsorted(key[order], first * nodes + second)]]


def _neighbours(middle: Floats, cell: Ints) -> Ints:
    """Pairs of neighbouring places of the same cell, (k, 2), the lower number first."""
    # three points far away, so that there are triangles whatever places there are
    centre, size = middle.mean(axis=0), 1 + np.ptp(middle)
    beyond = centre + 8 * size * np.array([[-2.0, -1.1], [2.0, -1.0], [0.1, 2.0]])
    corners = Delaunay(np.concatenate([middle, beyond])).simplices.astype(np.int64)
    pairs = np.sort(corners[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    pairs = pairs[pairs[:, 1] < len(middle)]
    return np.unique(pairs[cell[pairs[:, 0]] == cell[pairs[:, 1]]], axis=0)


def _farthest(at: Floats, start: Ints, total: Ints, hole: Ints, way: Floats) -> Ints:
    """The row of each `hole`, (k,), that lies farthest along `way`, (k, 2)."""
    number = total[hole]
    row = ranges(start[hole], number)
    owner = np.repeat(np.arange(len(hole)), number)
    along = (at[row] * way[owner]).sum(axis=1)
    most = np.maximum.reduceat(along, np.cumsum(number) - number) if len(hole) else along
    found = np.flatnonzero(along == most[owner])
    first = np.empty(len(hole), dtype=np.int64)
    first[owner[found][::-1]] = row[found][::-1]
    return first


def _onward(at: Floats, total: Ints, cuts: Ints) -> Ints:
    """What comes after each row of `at` (P, 2), and after these each way along a cut: from its first end to
    its second, then back; (P + 2 k,).
    """
    following = next_round(total)
    before = np.empty(len(at), dtype=np.int64)
    before[following] = np.arange(len(at))
    end, there = cuts.ravel(), cuts[:, ::-1].ravel()
    away, ahead = at[there] - at[end], at[following[end]] - at[end]
    # of the ways that start at one place those come first that turn least to the left of the contour
    turn = np.arctan2(away[:, 1], away[:, 0]) - np.arctan2(ahead[:, 1], ahead[:, 0])
    order = np.lexsort((np.mod(turn, 2 * np.pi), end))
    ways, end = len(at) + order, end[order]
    first = np.diff(end, prepend=-1) != 0
    onward = np.concatenate([following, np.empty(len(end), dtype=np.int64)])
    # who comes along the contour takes the last of them, who comes back on one the one before
    last = np.roll(first, -1)
    onward[before[end[last]]] = ways[last]
    onward[len(at) + (order ^ 1)] = np.where(first, end, np.roll(ways, 1))
    return onward
