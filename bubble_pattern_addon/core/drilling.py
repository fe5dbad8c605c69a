"""Straight holes cut without a general boolean.

Of a base that is known to be sound and holes that are known to keep apart and to pierce one wall, most of
what a boolean finds out is known before. What is left is to follow each outline over the base (tracing),
to triangulate the faces it passes again (remainders) and to put walls in. That takes a third of the boolean's
time. It leaves to the boolean what needs exact decisions: the columns whose traces are in doubt.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .column_walls import walls
from .columns import Columns
from .mesh import Floats, Ints, Mesh
from .part import Cut
from .remainders import Points, remainder
from .tracing import Traces, traced


class Spans(NamedTuple):
    """What columns see of a base: every face with a part inside a column's cylinder at its heights, and the
    lowest and highest place of that part above the column's centre; all (k,).
    """

    owner: Ints
    triangle: Ints
    low: Floats
    high: Floats


def drilled(base: Mesh, columns: Columns, spans: Spans) -> tuple[Cut, Ints]:
    """`base` less those of its `columns` whose outlines can be traced without doubt; and which these are,
    rows of columns, (d,).
    """
    nothing = np.zeros(0, dtype=np.int64)
    none = Cut(base, np.arange(len(base.triangles)), nothing, columns.facet_feature), nothing
    if not len(columns):
        return none
    clear = np.ones(len(columns), dtype=bool)
    past = (spans.high > columns.top[spans.owner]) | (spans.low < -columns.bottom[spans.owner])
    clear[spans.owner[past]] = False
    traces = traced(base, columns, clear, spans.owner, spans.triangle)
    points = _points(base, columns, traces)
    left = remainder(base, columns, traces, points)
    if left is None:
        return none
    surface, face = left
    wall, facet = walls(columns, traces, points)
    triangles = np.concatenate([surface, wall])
    used = np.zeros(len(points.place), dtype=bool)
    used[triangles] = True
    number = np.cumsum(used) - 1
    cut = Cut(Mesh(points.place[used], number[triangles]), face, facet, columns.facet_feature)
    return cut, np.flatnonzero(traces.good)


def _points(base: Mesh, columns: Columns, traces: Traces) -> Points:
    """All vertices that the part may have."""
    count, corners = len(base.vertices), len(columns.outline)
    above, below = _heights(base, columns, traces)
    everything = np.arange(corners)
    low, high = base.vertices[traces.low], base.vertices[traces.high]
    place = [
        base.vertices,
        columns.raised(everything, above),
        columns.raised(everything, below),
        low + traces.share[:, None] * (high - low),
    ]
    return Points(np.concatenate(place), count, count + corners, count + 2 * corners)


def _heights(base: Mesh, columns: Columns, traces: Traces) -> tuple[Floats, Floats]:
    """Heights of the corners above, (K,), and below, (K,): on the base, or on the floor."""
    corner, owner = np.arange(len(columns.outline)), columns.owner
    below = -columns.bottom[owner]
    found = []
    for side in (0, 1):
        way = 2 * owner + side
        mine = np.flatnonzero(traces.way % 2 == side)
        # the last crossing before each corner; where there is none, the one that is added at the end
        before = np.searchsorted(traces.at[mine], corner) - 1
        ways, into = np.append(traces.way[mine], -1), np.append(traces.into[mine], -1)
        face = np.where(ways[before] == way, into[before], traces.begin[way])
        on = np.flatnonzero(face >= 0)
        height = below.copy()
        height[on] = _height(base, columns, on, owner[on], face[on])
        found.append(height)
    return found[0], found[1]


def _height(base: Mesh, columns: Columns, corner: Ints, owner: Ints, face: Ints) -> Floats:
    """Heights of the planes of faces, (k,), over corners, (k,)."""
    a, b, c = base.corners[face].swapaxes(0, 1)
    normal = np.cross(b - a, c - a)
    x, y, z = columns.frame[owner].swapaxes(0, 1)
    flat = columns.centre[owner] + columns.outline[corner, :1] * x + columns.outline[corner, 1:] * y
    return np.einsum("ki,ki->k", a - flat, normal) / np.einsum("ki,ki->k", z, normal)
