"""Polygons with holes as triangles, many at once: by manifold3d, laid out side by side in one plane."""

from __future__ import annotations

from itertools import pairwise

import manifold3d
import numpy as np

from .cycles import next_round, ranges
from .keyholes import Contours, opened
from .mesh import Bools, Floats, Ints

APART = 4.0
"""Times a polygon's size that polygons are laid apart."""
TOGETHER = 24
"""So many contours of polygons with holes are triangulated together: the time grows with the square of their
number.
"""
COVERED = 1e-9
"""Share of its size by which the triangles of a polygon may differ from it."""


def triangulated(flat: Floats, total: Ints, cell: Ints, outer: int) -> Ints | None:
    """Triangles over the polygons in each of the cells, rows of `flat`, (n, 3); None where they do not cover
    what the contours enclose.

    flat: (P, 2) contours one after the other, interior to the left, those of a cell within a square of size 1
    round the origin or two; total: (p,) vertices of each; cell: (p,) of each, numbered from 0; outer: so many
    contours, the first ones, go round the outside, the others are holes
    """
    if not len(total):
        return np.zeros((0, 3), dtype=np.int64)
    start = np.cumsum(total) - total
    owner = np.concatenate([np.arange(outer), _around(flat, start, total, cell, outer)])
    wide = int(np.ceil(np.sqrt(outer)))
    laid = flat + APART * np.repeat(np.stack([owner % wide, owner // wide], axis=1), total, axis=0)
    pierced = np.bincount(owner[outer:], minlength=outer) > 0
    plain, rest = np.flatnonzero(~pierced), np.flatnonzero(pierced[owner])
    contours = Contours(ranges(start[plain], total[plain]), total[plain])
    if len(rest):
        with_holes = Contours(ranges(start[rest], total[rest]), total[rest])
        number = np.cumsum(pierced) - 1
        ways = opened(laid, with_holes, number[owner[rest]], int(pierced.sum()))
        contours = Contours(*(np.concatenate(both) for both in zip(contours, ways, strict=True)))
    of_row = np.repeat(owner, total)
    enclosed = _enclosed(flat, start, total, owner)
    triangles = _triangles(laid, contours)
    good = _covered(flat, triangles, of_row, enclosed)
    if not good.all():
        known = triangles[good[of_row[triangles[:, 0]]]]
        again = _with_holes(laid, start, total, owner, np.flatnonzero(~good[owner]))
        triangles = np.concatenate([known, *again])
        good = _covered(flat, triangles, of_row, enclosed)
    return triangles if good.all() else None


def _around(flat: Floats, start: Ints, total: Ints, cell: Ints, outer: int) -> Ints:
    """The outer contour of the same cell that goes round each hole, (holes,)."""
    order = np.argsort(cell[:outer], kind="stable")
    cells = np.arange(cell.max() + 1)
    first, end = (np.searchsorted(cell[order], cells, side) for side in ("left", "right"))
    around = order[first[cell[outer:]]]
    several = np.flatnonzero((end - first)[cell[outer:]] > 1)
    if not len(several):
        return around
    # how often a ray from a vertex of the hole passes each of them
    at = cell[outer:][several]
    hole = np.repeat(several, (end - first)[at])
    contour = order[ranges(first[at], (end - first)[at])]
    row = ranges(start[contour], total[contour])
    pair = np.repeat(np.arange(len(contour)), total[contour])
    following = row[next_round(total[contour])]
    (px, py), (qx, qy), (x, y) = flat[row].T, flat[following].T, flat[start[outer + hole[pair]]].T
    passes = (py > y) != (qy > y)
    beyond = px + (y - py) / np.where(passes, qy - py, 1) * (qx - px) > x
    within = np.bincount(pair[passes & beyond], minlength=len(contour)) % 2 == 1
    around[hole[within]] = contour[within]
    return around


def _triangles(laid: Floats, contours: Contours) -> Ints:
    """Triangles over contours that are apart, or holes of one another, (n, 3)."""
    if not len(contours.total):
        return np.zeros((0, 3), dtype=np.int64)
    bounds = np.concatenate([[0], np.cumsum(contours.total)])
    at = laid[contours.vertex]
    pieces = [at[begin:end] for begin, end in pairwise(bounds)]
    return contours.vertex[np.asarray(manifold3d.triangulate(pieces), dtype=np.int64).reshape(-1, 3)]


def _with_holes(laid: Floats, start: Ints, total: Ints, owner: Ints, chosen: Ints) -> list[Ints]:
    """Triangles over the contours `chosen`, outer ones and their holes, a few at a time."""
    chosen = chosen[np.argsort(owner[chosen], kind="stable")]
    begins = np.flatnonzero(np.diff(owner[chosen], prepend=-1))
    batches = np.split(chosen, begins[1:][np.diff(begins // TOGETHER) > 0])
    return [_triangles(laid, Contours(ranges(start[some], total[some]), total[some])) for some in batches]


def _enclosed(flat: Floats, start: Ints, total: Ints, owner: Ints) -> Floats:
    """Twice the area that each outer contour encloses, without its holes."""
    x, y = flat.T
    following = next_round(total)
    return np.bincount(owner, np.add.reduceat(x * y[following] - x[following] * y, start))


def _covered(flat: Floats, triangles: Ints, of_row: Ints, enclosed: Floats) -> Bools:
    """In which outer contours do the triangles lie the right way up and cover what these enclose?"""
    x, y = flat.T
    a, b, c = triangles.T
    area = (x[b] - x[a]) * (y[c] - y[a]) - (y[b] - y[a]) * (x[c] - x[a])
    owner = of_row[a]
    good = np.abs(np.bincount(owner, area, len(enclosed)) - enclosed) <= COVERED
    good[owner[area < -COVERED]] = False
    return good
