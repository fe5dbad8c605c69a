"""Sheets of a surface: parts that cannot pass through themselves, found without looking at pairs of faces.

Faces that hang together and all look the same way, within a right angle of one direction, are a map of what
lies under them: over each place there are as many of them as the sheet's rim winds round it. A rim that winds
once round everything it encloses, and nowhere crosses itself, shows that no two of them lie one over the
other. So of a smooth surface only the rims of its sheets are left to be compared face by face.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components

from .boxtree import build_tree, close_pairs
from .closed import linked
from .mesh import Bools, Floats, Ints, Mesh, area_columns

FRAME = np.array([[0.80, 0.36, 0.48], [-0.48, 0.864, 0.152], [-0.36, -0.352, 0.864]])
"""Unit axes, a row each, of the frame whose six directions tell faces apart. Parts are modelled along x, y
and z and at 45 degrees to them: this frame is turned away from all these, so that no flat face lies between
two directions, where rounding would scatter its triangles over both.
"""


@dataclass(frozen=True)
class _Rims:
    """Directed edges on the rims of sheets, r of them, seen along the direction of their sheet.

    sheet: (r,) whose rim the edge is on; start, end: (2, r) with the sheet on the left; following: (r,) the
    edge that goes on from its end
    """

    sheet: Ints
    start: Floats
    end: Floats
    following: Ints


def sheets(mesh: Mesh, neighbour: Ints) -> Ints:
    """The sheet that each triangle of the closed surface `mesh` belongs to, (T,), below 0 where on none.

    neighbour: (3, T) the triangle across each edge. Two triangles of one sheet may touch, but they never
    reach through each other, nor lie on each other in one plane.
    """
    turned = Mesh(mesh.vertices @ FRAME.T, mesh.triangles)
    way = _ways(area_columns(turned.columns))
    links = way == way[neighbour]
    sheet = linked(neighbour, links)
    rim, count = _rims(turned, way, sheet, ~links), int(sheet.max()) + 1
    bad = _winding(rim, count) | _crossing(rim, count)
    return np.where(bad[sheet], -1, sheet)


def _ways(area: Floats) -> Ints:
    """Which of the directions x, y, z, -x, -y, -z each of the vectors `area`, (3, T), is nearest to, (T,).

    One without length is given the first: a face without area covers nothing, whatever sheet it is on.
    """
    x, y, z = np.abs(area)
    axis = np.where(x >= y, np.where(x >= z, 0, 2), np.where(y >= z, 1, 2))
    return axis + 3 * (area[axis, np.arange(len(axis))] < 0)


def _rims(mesh: Mesh, way: Ints, sheet: Ints, border: Bools) -> _Rims:
    """The rims of the sheets; border: (3, T) whether the sheet ends at that edge."""
    corner, triangle = np.nonzero(border)
    owner = sheet[triangle]
    ends = mesh.triangles[triangle, corner], mesh.triangles[triangle, (corner + 1) % 3]
    axis, back = way[triangle] % 3, way[triangle] >= 3
    # seen from outside: to the right and up, so that faces run counter-clockwise
    right, up = (axis + 1 + back) % 3, (axis + 2 - back) % 3
    start, end = (np.stack([mesh.vertices[side, right], mesh.vertices[side, up]]) for side in ends)
    here, there = (owner * len(mesh.vertices) + side for side in ends)
    order = np.argsort(here)
    # where a rim touches itself in a vertex it has several edges to go on with: any will do, as it is bad
    return _Rims(owner, start, end, order[np.searchsorted(here[order], there)])


def _winding(rim: _Rims, count: int) -> Bools:
    """Which of the `count` sheets have another number of loops that run counter-clockwise than one, (count,).

    Where the loops do not cross, such a sheet has one outer rim, and all others are those of holes.
    """
    size = len(rim.sheet)
    graph = csr_array(
        (np.ones(size), rim.following.astype(np.int32), np.arange(size + 1)), shape=(size, size)
    )
    loops, loop = connected_components(graph, directed=False)
    area = np.bincount(loop, weights=rim.start[0] * rim.end[1] - rim.start[1] * rim.end[0], minlength=loops)
    owner = np.zeros(loops, dtype=np.int64)
    owner[loop] = rim.sheet
    return np.bincount(owner[area > 0], minlength=count) != 1


def _crossing(rim: _Rims, count: int) -> Bools:
    """Which of the `count` sheets have a rim that crosses or touches itself, (count,)."""
    bad = np.zeros(count, dtype=bool)
    # one sheet's rim above the other: only edges of the same sheet are compared
    height = np.broadcast_to(rim.sheet.astype(np.float64), (1, 3, len(rim.sheet)))
    edges = np.stack([rim.start, rim.end, rim.end], axis=1)
    for one, other in close_pairs(build_tree(np.concatenate([edges, height]))):
        a, b, c, d = rim.start[:, one], rim.end[:, one], rim.start[:, other], rim.end[:, other]
        sides = [_side(a, b, c) * _side(a, b, d), _side(c, d, a) * _side(c, d, b)]
        meet = (sides[0] <= 0) & (sides[1] <= 0)
        # an edge and the next one always meet; where they turn back on each other, others meet them there
        meet &= (rim.following[one] != other) & (rim.following[other] != one)
        bad[rim.sheet[one[meet]]] = True
    return bad


def _side(a: Floats, b: Floats, point: Floats) -> Floats:
    """Above 0 where `point` is left of the line from `a` to `b`, all (2, m)."""
    return (b[0] - a[0]) * (point[1] - a[1]) - (b[1] - a[1]) * (point[0] - a[0])
