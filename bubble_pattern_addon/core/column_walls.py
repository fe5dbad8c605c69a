"""Walls of columns between the ways their outlines take over the base, and their floors."""

from __future__ import annotations

import numpy as np

from .columns import Columns
from .mesh import Bools, Ints
from .remainders import Points
from .tracing import Traces


def walls(columns: Columns, traces: Traces, points: Points) -> tuple[Ints, Ints]:
    """Triangles of `points`, (W, 3), that face the axes of the `good` columns, and their facets, (W,)."""
    row = np.flatnonzero(traces.good[columns.owner])
    facet = columns.side_facet
    side = np.floor(traces.at).astype(np.int64)
    bent = np.zeros(len(columns.outline), dtype=bool)
    bent[side] = True
    straight = ~bent[row]
    plain = _straight(row[straight], columns.following, points)
    triangles, of = _bent(row[~straight], columns.following, traces, side, points)
    faces, facets = [plain, triangles], [np.repeat(facet[row[straight]], 2), facet[of]]
    if not columns.through:
        closed = np.flatnonzero(traces.good[columns.lid_owner])
        faces.append(points.lower + columns.lid[closed])
        facets.append(columns.floor_facet[columns.lid_owner[closed]])
    return np.concatenate(faces), np.concatenate(facets)


def _straight(row: Ints, following: Ints, points: Points) -> Ints:
    """Triangles of the sides, (k,), that no edge of the base crosses, two each one after the other."""
    top, after = points.corners + row, points.corners + following[row]
    low, low_after = points.lower + row, points.lower + following[row]
    return np.stack([top, after, low, after, low_after, low], axis=1).reshape(-1, 3)


def _bent(row: Ints, following: Ints, traces: Traces, side: Ints, points: Points) -> tuple[Ints, Ints]:
    """Triangles of the other sides, and the side of each.

    Vertices above and below are taken by rising share of the side; each makes a triangle with the last one
    above and the last one below. As the one way lies above the other everywhere, no two triangles overlap.
    """
    crossing = np.arange(len(traces.way))
    none = np.zeros(len(row))
    of = np.concatenate([row, row, side, row, row])
    share = np.concatenate([none - 2, none - 1, traces.at - side, none + 2, none + 3])
    beginning, ending = points.corners + row, points.corners + following[row]
    below = points.lower - points.corners
    name = np.concatenate([beginning, beginning + below, points.crossings + crossing, ending, ending + below])
    yes, no = np.ones(len(row), dtype=bool), np.zeros(len(row), dtype=bool)
    above = np.concatenate([yes, no, traces.way % 2 == 0, yes, no])
    order = np.lexsort((share, of))
    of, share, name, above = of[order], share[order], name[order], above[order]
    last_above, last_below = _last(above), _last(~above)
    new = np.flatnonzero(share > -1)
    triangles = np.stack([name[last_above[new - 1]], name[new], name[last_below[new - 1]]], axis=1)
    return triangles, of[new]


def _last(chosen: Bools) -> Ints:
    """The last chosen row up to each, (n,)."""
    return np.maximum.accumulate(np.where(chosen, np.arange(len(chosen)), 0))
