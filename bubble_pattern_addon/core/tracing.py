"""Where the sides of columns pass through the base: along which way each outline runs over its faces.

A column's outline is followed in the column's own frame, where the surface is a map: seen along the axis, an
outline passes from face to face wherever it crosses an edge. So all that is needed is which edges it crosses,
in which order. Whether it does is told by signs alone, on which side of an edge a corner lies and on which
side of an outline a vertex; each is worked out once and holds for all who ask, so that what is found hangs
together whatever the rounding. A column with a sign in doubt is not traced: where a corner lies on an edge or
a vertex on an outline, where the surface turns away or folds under it, where there is more of it than the
wall's two sides.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from .columns import Columns
from .cycles import next_round
from .mesh import Bools, Floats, Ints, Mesh
from .ranking import numbered

DOUBT = 1e-8
"""Share of its reach within which a column takes two places for the same, and a sign for doubtful."""
STEEPEST = 1e-3
"""Cosine of the angle between an axis and a face's normal below which the face stands upright."""
TOGETHER = 1 << 22
"""Signs worked out together: bounds the memory."""


@dataclass(frozen=True)
class Traces:
    """Ways of outlines over the base, two for each of m columns: 2 c where column c enters, above, and
    2 c + 1 where it leaves. A through-hole has both, others the first.

    good: (m,) the columns that could be traced; what follows is of these alone
    way: (X,) way each crossing is on, rising; at: (X,) place along the way: the number of the corner before
        and the share of the side from there, rising on each way; first: (X,) it is the first one of its way
    low, high: (X,) vertices of the edge, low < high; share: (X,) from the one to the other; leaves: (X,)
        going from low to high, the edge comes out of the column there
    into: (X,) face of the base that the outline enters
    begin: (2 m,) face of the base under the first corner of each way, -1 where there is none
    inside: (V,) vertices of the base inside a column
    """

    good: Bools
    way: Ints
    at: Floats
    first: Bools
    low: Ints
    high: Ints
    share: Floats
    leaves: Bools
    into: Ints
    begin: Ints
    inside: Bools

    @property
    def following(self) -> Ints:
        """The next crossing of the same way, (X,)."""
        return next_round(np.diff(np.flatnonzero(self.first), append=len(self.way)))


@dataclass(frozen=True)
class _Seen:
    """What columns see of the base: k pairs of a column and a face, q of a column and a vertex, e of a column
    and an edge.

    owner, triangle: (k,); facing: (k,) see `_facing`; corner: (k, 3) rows of places
    vertex, place_owner: (q,), x, y: (q,) in the column's frame
    low, high: (e,) rows of places, forth, back: (e,) pairs whose faces run along the edge from low to high
        and from high to low, -1 where there is not just one
    deep: (q,) vertices so near to the axis that they are inside the outline for sure
    """

    owner: Ints
    triangle: Ints
    facing: Ints
    corner: Ints
    vertex: Ints
    place_owner: Ints
    x: Floats
    y: Floats
    low: Ints
    high: Ints
    forth: Ints
    back: Ints
    deep: Bools

    @property
    def edge_owner(self) -> Ints:
        """The column of each edge, (e,)."""
        return self.place_owner[self.low]

    @property
    def regular(self) -> Bools:
        """Which edges have a face on either side, both turned the same way, (e,)."""
        known = (self.forth >= 0) & (self.back >= 0)
        return known & (self.facing[self.forth] == self.facing[self.back]) & (self.facing[self.forth] != 0)


class _Crossings(NamedTuple):
    """Where outlines cross edges, all (x,): rows of edges, number of the corner before, share of the side
    from there, share of the edge from low to high, and whether that comes out of the column there.
    """

    edge: Ints
    corner: Ints
    along: Floats
    share: Floats
    leaves: Bools


def traced(base: Mesh, columns: Columns, clear: Bools, owner: Ints, triangle: Ints) -> Traces:
    """The ways over `base` of those of the `columns` that are `clear`, (m,), at their ends.

    owner, triangle: (k,) every face with a part inside a column's cylinder, at its heights
    """
    seen = _seen(base, columns, owner, triangle)
    touching, regular = _touching(seen, columns.reach), seen.regular
    good = clear.copy()
    good[seen.edge_owner[touching & ~regular]] = False
    begin, single = _begin(seen, columns)
    inside, on_outline = _inside(seen, columns)
    good &= single
    good[on_outline] = False
    # an edge with both ends deep inside never reaches the outline
    passing = touching & regular & ~(seen.deep[seen.low] & seen.deep[seen.high])
    edge, corner, on_edge = _passed(seen, columns, np.flatnonzero(passing & good[seen.edge_owner]))
    good[on_edge] = False
    crossings, way = _ordered(seen, _crossings(seen, columns, edge, corner))
    into, out_of = _either_side(seen, crossings)
    good[_apart(way, into, out_of, begin)] = False
    kept = np.flatnonzero(good[way // 2])
    edge, way = crossings.edge[kept], way[kept]
    within = np.zeros(len(base.vertices), dtype=bool)
    within[seen.vertex[inside[good[seen.place_owner[inside]]]]] = True
    return Traces(
        good=good,
        way=way,
        at=(crossings.corner + crossings.along)[kept],
        first=np.diff(way, prepend=-1) != 0,
        low=seen.vertex[seen.low[edge]],
        high=seen.vertex[seen.high[edge]],
        share=crossings.share[kept],
        leaves=crossings.leaves[kept],
        into=triangle[into[kept]],
        begin=np.where((begin >= 0) & np.repeat(good, 2), triangle[begin], -1),
        inside=within,
    )


def _seen(base: Mesh, columns: Columns, owner: Ints, triangle: Ints) -> _Seen:
    count = len(base.vertices)
    bits = (len(columns) * count).bit_length()
    key, corner = numbered((owner[:, None] * count + base.triangles[triangle]).ravel(), bits)
    corner = corner.reshape(-1, 3)
    place_owner, vertex = np.divmod(key, count)
    dx, dy, dz = (base.vertices[vertex] - columns.centre[place_owner]).T
    # a row per axis of the frame and coordinate, several times faster to pick from
    frame = np.ascontiguousarray(columns.frame.transpose(1, 2, 0))
    x, y, z = (a[place_owner] * dx + b[place_owner] * dy + c[place_owner] * dz for a, b, c in frame)
    start, end = corner.ravel(), np.roll(corner, -1, axis=1).ravel()
    bits = len(key).bit_length()
    pairs, edge = numbered((np.minimum(start, end) << bits) | np.maximum(start, end), 2 * bits)
    low, high = pairs >> bits, pairs & ((1 << bits) - 1)
    forth, back = (_only(edge, run, len(pairs)) for run in (start < end, start > end))
    facing = _facing(*(axis[corner.T] for axis in (x, y, z)))
    deep = np.hypot(x, y) < columns.core[place_owner] * (1 - DOUBT)
    return _Seen(owner, triangle, facing, corner, vertex, place_owner, x, y, low, high, forth, back, deep)


def _facing(x: Floats, y: Floats, z: Floats) -> Ints:
    """1 for faces turned up, -1 down, 0 upright, (k,); coordinates of their corners (3, k)."""
    (ux, vx), (uy, vy), (uz, vz) = (axis[1:] - axis[0] for axis in (x, y, z))
    up = ux * vy - uy * vx
    size = np.sqrt((uy * vz - uz * vy) ** 2 + (uz * vx - ux * vz) ** 2 + up**2)
    return np.where(np.abs(up) > STEEPEST * size, np.sign(up), 0).astype(np.int64)


def _only(edge: Ints, chosen: Bools, count: int) -> Ints:
    """The pair of the one `chosen` side, (3 k,), that lies on each of `count` edges; -1 where not just one
    does.
    """
    sides = np.flatnonzero(chosen)
    pair = np.full(count, -1)
    pair[edge[sides]] = sides // 3
    pair[np.bincount(edge[sides], minlength=count) != 1] = -1
    return pair


def _touching(seen: _Seen, reach: Floats) -> Bools:
    """Which edges, (e,), come within their column's reach."""
    ax, ay = seen.x[seen.low], seen.y[seen.low]
    dx, dy = seen.x[seen.high] - ax, seen.y[seen.high] - ay
    square = dx * dx + dy * dy
    share = np.clip(-(ax * dx + ay * dy) / np.where(square > 0, square, 1), 0, 1)
    near = np.hypot(ax + share * dx, ay + share * dy)
    return np.asarray(near <= reach[seen.edge_owner] * (1 + DOUBT))


def _begin(seen: _Seen, columns: Columns) -> tuple[Ints, Bools]:
    """The pair under the first corner of each way, (2 m,), -1 for none; and which columns have the ways that
    they should have, each once, (m,).
    """
    x, y = columns.outline[columns.start[:-1]].T
    x, y = x[seen.owner], y[seen.owner]
    covers = seen.facing != 0
    for one, other in ((0, 1), (1, 2), (2, 0)):
        start, end = seen.corner[:, one], seen.corner[:, other]
        # the same sign for both faces at an edge
        low, high = np.minimum(start, end), np.maximum(start, end)
        left = _side(seen.x[low], seen.y[low], seen.x[high], seen.y[high], x, y) > 0
        covers &= (left == (start < end)) == (seen.facing > 0)
    pair = np.flatnonzero(covers)
    way = 2 * seen.owner[pair] + (seen.facing[pair] < 0)
    found = np.bincount(way, minlength=2 * len(columns))
    begin = np.full(2 * len(columns), -1)
    begin[way] = pair
    return begin, (found[0::2] == 1) & (found[1::2] == int(columns.through))


def _side(ax: Floats, ay: Floats, bx: Floats, by: Floats, x: Floats, y: Floats) -> Floats:
    """Twice the area of the triangles from a to b to the points: above 0 where these lie to the left."""
    return (bx - ax) * (y - ay) - (by - ay) * (x - ax)


def _groups(columns: Columns, rows: Ints, owner: Ints) -> Iterator[tuple[Ints, Ints]]:
    """`rows`, (k,), a bounded number together, with the numbers of all corners of their columns `owner`,
    (k,): (g,) and (g, corners).
    """
    count = columns.count[owner]
    for number in np.unique(count):
        alike = np.flatnonzero(count == number)
        many = max(TOGETHER // int(number), 1)
        for at in range(0, len(alike), many):
            mine = alike[at : at + many]
            yield rows[mine], columns.start[owner[mine]][:, None] + np.arange(number)


def _inside(seen: _Seen, columns: Columns) -> tuple[Ints, Ints]:
    """Places inside their column's outline, and columns with one on it."""
    near = np.hypot(seen.x, seen.y) <= columns.reach[seen.place_owner] * (1 + DOUBT)
    close = np.flatnonzero(near & ~seen.deep)
    inside, doubtful = [np.flatnonzero(seen.deep)], [close[:0]]
    for rows, corners in _groups(columns, close, seen.place_owner[close]):
        px, py = columns.outline[corners].transpose(2, 0, 1)
        qx, qy = np.roll(px, -1, axis=1), np.roll(py, -1, axis=1)
        x, y = seen.x[rows][:, None], seen.y[rows][:, None]
        side = _side(px, py, qx, qy, x, y)
        # how often the outline goes round the place
        up, down = (py <= y) & (qy > y) & (side > 0), (py > y) & (qy <= y) & (side < 0)
        inside.append(rows[up.sum(axis=1) != down.sum(axis=1)])
        owner = seen.place_owner[rows]
        on = _on(px, py, qx, qy, x, y, side, columns.reach[owner][:, None])
        doubtful.append(owner[on.any(axis=1)])
    return np.concatenate(inside), np.concatenate(doubtful)


def _on(
    px: Floats, py: Floats, qx: Floats, qy: Floats, x: Floats, y: Floats, side: Floats, reach: Floats
) -> Bools:
    """Is a place, on the `side` of the line from p to q, as good as on the way between these?"""
    dx, dy = qx - px, qy - py
    square = dx * dx + dy * dy
    slack = DOUBT * reach * np.sqrt(square)
    along = (x - px) * dx + (y - py) * dy
    return np.asarray((np.abs(side) <= slack) & (along >= -slack) & (along <= square + slack))


def _passed(seen: _Seen, columns: Columns, edges: Ints) -> tuple[Ints, Ints, Ints]:
    """Where two neighbouring corners of an outline lie on either side of the line through an edge: rows of
    `edges` and numbers of the first of the two; and columns with a corner on an edge.
    """
    edge, first, doubtful = [edges[:0]], [edges[:0]], [edges[:0]]
    for rows, corners in _groups(columns, edges, seen.edge_owner[edges]):
        px, py = columns.outline[corners].transpose(2, 0, 1)
        low, high, owner = seen.low[rows], seen.high[rows], seen.edge_owner[rows]
        ax, ay, bx, by = seen.x[low], seen.y[low], seen.x[high], seen.y[high]
        side = _side(ax[:, None], ay[:, None], bx[:, None], by[:, None], px, py)
        reach = columns.reach[owner]
        # few are so near to the line at all
        row, at = np.nonzero(np.abs(side) <= (DOUBT * reach * np.hypot(bx - ax, by - ay))[:, None])
        ends = ax[row], ay[row], bx[row], by[row]
        on = _on(*ends, px[row, at], py[row, at], side[row, at], reach[row])
        doubtful.append(owner[row[on]])
        left = side > 0
        row, at = np.nonzero(left != np.roll(left, -1, axis=1))
        edge.append(rows[row])
        first.append(corners[row, at])
    return np.concatenate(edge), np.concatenate(first), np.concatenate(doubtful)


def _crossings(seen: _Seen, columns: Columns, edge: Ints, corner: Ints) -> _Crossings:
    """Those of the places that `_passed` found which lie on the edges themselves."""
    px, py = columns.outline[corner].T
    qx, qy = columns.outline[columns.following[corner]].T
    low, high = seen.low[edge], seen.high[edge]
    ax, ay, bx, by = seen.x[low], seen.y[low], seen.x[high], seen.y[high]
    from_low, from_high = _side(px, py, qx, qy, ax, ay), _side(px, py, qx, qy, bx, by)
    kept = np.flatnonzero((from_low > 0) != (from_high > 0))
    before, after = (_side(ax, ay, bx, by, *ends)[kept] for ends in ((px, py), (qx, qy)))
    from_low, from_high = from_low[kept], from_high[kept]
    share = from_low / (from_low - from_high)
    return _Crossings(edge[kept], corner[kept], before / (before - after), share, after > 0)


def _ordered(seen: _Seen, crossings: _Crossings) -> tuple[_Crossings, Ints]:
    """The crossings by the ways they are on and along these; and their ways, (x,)."""
    way = 2 * seen.edge_owner[crossings.edge] + (seen.facing[seen.forth[crossings.edge]] < 0)
    order = np.lexsort((crossings.along, crossings.corner, way))
    edge, corner, along, share, leaves = crossings
    return _Crossings(edge[order], corner[order], along[order], share[order], leaves[order]), way[order]


def _either_side(seen: _Seen, crossings: _Crossings) -> tuple[Ints, Ints]:
    """The pairs whose faces the outlines enter and come from, (x,) and (x,)."""
    forth, back = seen.forth[crossings.edge], seen.back[crossings.edge]
    # what an outline enters lies to the left of an edge that comes out of the column
    ahead = crossings.leaves == (seen.facing[forth] > 0)
    return np.where(ahead, forth, back), np.where(ahead, back, forth)


def _apart(way: Ints, into: Ints, out_of: Ints, begin: Ints) -> Ints:
    """Columns of which a way does not go on from the face that it has come to."""
    first = np.diff(way, prepend=-1) != 0
    together = np.where(first, begin[way], np.roll(into, 1)) == out_of
    together &= ~np.roll(first, -1) | (into == begin[way])
    return way[~together] // 2
