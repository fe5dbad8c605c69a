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

from dataclasses import dataclass

import numpy as np

from .columns import Columns
from .mesh import Bools, Floats, Ints, Mesh
from .ranking import numbered

DOUBT = 1e-6
"""Share of its reach within which a column takes two places for the same, and a sign for doubtful."""
STEEPEST = 1e-3
"""Cosine of the angle between an axis and a face's normal below which the face stands upright."""
TOGETHER = 1 << 22
"""Signs worked out together: bounds the memory."""


@dataclass(frozen=True)
class Traces:
    """Ways of outlines over the base, two for each of m columns: 2 c where column c enters, above, and 2 c + 1
    where it leaves. A through-hole has both, others the first.

    good: (m,) the columns that could be traced; what follows is of these alone
    way: (X,) way each crossing is on, rising; at: (X,) place along the way: the number of the corner before
        and the share of the side from there, rising on each way; first: (X,) it is the first one of its way
    low, high: (X,) vertices of the edge, low < high; share: (X,) from the one to the other; leaves: (X,) going
        from low to high, the edge comes out of the column there
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
        start = np.flatnonzero(self.first)
        following = np.arange(1, len(self.way) + 1)
        following[np.append(start[1:], len(self.way))[: len(start)] - 1] = start
        return following


@dataclass(frozen=True)
class _Seen:
    """What columns see of the base: k pairs of a column and a face, q of a column and a vertex, e of a column
    and an edge.

    owner, triangle, facing: (k,); corner: (k, 3) rows of places, side: (k, 3) rows of edges, from each corner
        to the next
    vertex, place_owner: (q,), x, y, z: (q,) in the column's frame
    low, high: (e,) rows of places, forth, back: (e,) pairs whose faces run along the edge from low to high and
        from high to low, -1 where there is not just one
    """

    owner: Ints
    triangle: Ints
    facing: Ints
    corner: Ints
    vertex: Ints
    place_owner: Ints
    x: Floats
    y: Floats
    z: Floats
    low: Ints
    high: Ints
    forth: Ints
    back: Ints

    @property
    def edge_owner(self) -> Ints:
        return self.place_owner[self.low]


def traced(base: Mesh, columns: Columns, clear: Bools, owner: Ints, triangle: Ints) -> Traces:
    """The ways over `base` of those of the `columns` that are `clear`, (m,), at their ends.

    owner, triangle: (k,) every face with a part inside a column's cylinder, at its heights
    """
    seen = _seen(base, columns, owner, triangle)
    good = clear.copy()
    touching = _touching(seen, columns.reach)
    regular = (seen.forth >= 0) & (seen.back >= 0)
    regular &= (seen.facing[seen.forth] == seen.facing[seen.back]) & (seen.facing[seen.forth] != 0)
    good[seen.edge_owner[touching & ~regular]] = False
    begin = _begin(seen, columns, good)
    inside = _inside(seen, columns, good)
    edges = np.flatnonzero(touching & regular & good[seen.edge_owner])
    edge, corner = _passed(seen, columns, edges, good)
    crossings = _crossings(seen, columns, edge, corner)
    return _ordered(seen, len(base.vertices), good, begin, inside, *crossings)


def _seen(base: Mesh, columns: Columns, owner: Ints, triangle: Ints) -> _Seen:
    count = len(base.vertices)
    bits = (len(columns) * count).bit_length()
    key, corner = numbered((owner[:, None] * count + base.triangles[triangle]).ravel(), bits)
    corner = corner.reshape(-1, 3)
    place_owner, vertex = np.divmod(key, count)
    offset = (base.vertices[vertex] - columns.centre[place_owner]).T
    frame = columns.frame.transpose(1, 2, 0)
    x, y, z = (sum(row[place_owner] * way for row, way in zip(rows, offset, strict=True)) for rows in frame)
    start, end = corner.ravel(), np.roll(corner, -1, axis=1).ravel()
    bits = len(key).bit_length()
    pairs, edge = numbered((np.minimum(start, end) << bits) | np.maximum(start, end), 2 * bits)
    low, high = pairs >> bits, pairs & ((1 << bits) - 1)
    forth, back = (_only(edge, run, len(pairs)) for run in (start < end, start > end))
    a, b, c = corner.T
    ux, uy, uz = x[b] - x[a], y[b] - y[a], z[b] - z[a]
    vx, vy, vz = x[c] - x[a], y[c] - y[a], z[c] - z[a]
    up = ux * vy - uy * vx
    size = np.sqrt((uy * vz - uz * vy) ** 2 + (uz * vx - ux * vz) ** 2 + up**2)
    facing = np.where(np.abs(up) > STEEPEST * size, np.sign(up), 0).astype(np.int64)
    return _Seen(owner, triangle, facing, corner, vertex, place_owner, x, y, z, low, high, forth, back)


def _only(edge: Ints, chosen: Bools, count: int) -> Ints:
    """The pair of the one `chosen` side, (3 k,), that lies on each of `count` edges; -1 for none or several."""
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
    return near <= reach[seen.edge_owner] * (1 + DOUBT)


def _begin(seen: _Seen, columns: Columns, good: Bools) -> Ints:
    """The pair under the first corner of each way, (2 m,), -1 for none; columns with more or fewer ways than
    they should have are not `good`.
    """
    x, y = columns.outline[columns.start[:-1]].T
    x, y = x[seen.owner], y[seen.owner]
    covers = seen.facing != 0
    for one, other in ((0, 1), (1, 2), (2, 0)):
        start, end = seen.corner[:, one], seen.corner[:, other]
        # the same sign for both faces at an edge
        low, high = np.minimum(start, end), np.maximum(start, end)
        side = _side(seen.x[low], seen.y[low], seen.x[high], seen.y[high], x, y) > 0
        covers &= (side == (start < end)) == (seen.facing > 0)
    pair = np.flatnonzero(covers)
    way = 2 * seen.owner[pair] + (seen.facing[pair] < 0)
    found = np.bincount(way, minlength=2 * len(columns))
    begin = np.full(2 * len(columns), -1)
    begin[way] = pair
    good &= (found[0::2] == 1) & (found[1::2] == int(columns.through))
    return begin


def _side(ax: Floats, ay: Floats, bx: Floats, by: Floats, x: Floats, y: Floats) -> Floats:
    """Twice the area of the triangles from a to b to the points: above 0 where these lie to the left."""
    return (bx - ax) * (y - ay) - (by - ay) * (x - ax)


def _groups(columns: Columns, rows: Ints, owner: Ints) -> list[tuple[int, Ints]]:
    """`rows`, (k,), by how many corners their `owner`, (k,), has, and a bounded number together."""
    count = columns.count[owner]
    groups = []
    for number in np.unique(count):
        mine = rows[count == number]
        many = max(TOGETHER // int(number), 1)
        groups += [(int(number), mine[at : at + many]) for at in range(0, len(mine), many)]
    return groups


def _inside(seen: _Seen, columns: Columns, good: Bools) -> Ints:
    """Places inside their column's outline; columns with one on it are not `good`."""
    reach = columns.reach[seen.place_owner] * (1 + DOUBT)
    close = np.flatnonzero(np.hypot(seen.x, seen.y) <= reach)
    found = []
    for number, rows in _groups(columns, close, seen.place_owner[close]):
        owner = seen.place_owner[rows]
        corners = columns.start[owner][:, None] + np.arange(number)
        px, py = columns.outline[corners].transpose(2, 0, 1)
        qx, qy = np.roll(px, -1, axis=1), np.roll(py, -1, axis=1)
        x, y = seen.x[rows][:, None], seen.y[rows][:, None]
        side = _side(px, py, qx, qy, x, y)
        # how often the outline goes round the place
        up, down = (py <= y) & (qy > y) & (side > 0), (py > y) & (qy <= y) & (side < 0)
        found.append(rows[up.sum(axis=1) != down.sum(axis=1)])
        dx, dy = qx - px, qy - py
        square = dx * dx + dy * dy
        along = ((x - px) * dx + (y - py) * dy) / square
        doubt = DOUBT * columns.reach[owner][:, None]
        slack = doubt / np.sqrt(square)
        on = (np.abs(side) <= doubt * np.sqrt(square)) & (along >= -slack) & (along <= 1 + slack)
        good[owner[on.any(axis=1)]] = False
    return np.concatenate([*found, np.zeros(0, dtype=np.int64)])


def _passed(seen: _Seen, columns: Columns, edges: Ints, good: Bools) -> tuple[Ints, Ints]:
    """Where two neighbouring corners of an outline lie on either side of the line through an edge: rows of
    `edges` and numbers of the first of the two; columns with a corner on an edge are not `good`.
    """
    found = [(edges[:0], edges[:0])]
    for number, rows in _groups(columns, edges, seen.edge_owner[edges]):
        owner = seen.edge_owner[rows]
        start = columns.start[owner]
        px, py = columns.outline[start[:, None] + np.arange(number)].transpose(2, 0, 1)
        ax, ay, bx, by = (axis[end][:, None] for end in (seen.low[rows], seen.high[rows]) for axis in (seen.x, seen.y))
        side = _side(ax, ay, bx, by, px, py)
        length = np.hypot(bx - ax, by - ay)
        doubt = DOUBT * columns.reach[owner][:, None]
        row, corner = np.nonzero(np.abs(side) <= doubt * length)
        if len(row):
            dx, dy = (bx - ax)[row, 0], (by - ay)[row, 0]
            along = (px[row, corner] - ax[row, 0]) * dx + (py[row, corner] - ay[row, 0]) * dy
            slack = doubt[row, 0] * length[row, 0]
            on = (along >= -slack) & (along <= length[row, 0] ** 2 + slack)
            good[owner[row[on]]] = False
        left = side > 0
        row, corner = np.nonzero(left != np.roll(left, -1, axis=1))
        found.append((rows[row], start[row] + corner))
    edge, corner = (np.concatenate(parts) for parts in zip(*found, strict=True))
    return edge, corner


def _crossings(
    seen: _Seen, columns: Columns, edge: Ints, corner: Ints
) -> tuple[Ints, Ints, Floats, Floats, Bools]:
    """Which of the places that `_passed` found lie on the edges themselves: rows of edges, corners, shares of
    the outlines' sides and of the edges, and whether the edges come out of the columns there.
    """
    px, py = columns.outline[corner].T
    qx, qy = columns.outline[columns.following[corner]].T
    low, high = seen.low[edge], seen.high[edge]
    ax, ay, bx, by = seen.x[low], seen.y[low], seen.x[high], seen.y[high]
    from_low, from_high = _side(px, py, qx, qy, ax, ay), _side(px, py, qx, qy, bx, by)
    kept = np.flatnonzero((from_low > 0) != (from_high > 0))
    before, after = (_side(ax, ay, bx, by, *ends)[kept] for ends in ((px, py), (qx, qy)))
    from_low, from_high = from_low[kept], from_high[kept]
    share = from_low / (from_low - from_high)
    return edge[kept], corner[kept], before / (before - after), share, after > 0


def _ordered(
    seen: _Seen,
    vertices: int,
    good: Bools,
    begin: Ints,
    inside: Ints,
    edge: Ints,
    corner: Ints,
    along: Floats,
    share: Floats,
    leaves: Bools,
) -> Traces:
    """The crossings by their ways and along them; columns whose ways do not hang together are not good.

    vertices: how many the base has; for the rest see above
    """
    facing = seen.facing[seen.forth[edge]]
    way = 2 * seen.edge_owner[edge] + (facing < 0)
    order = np.lexsort((along, corner, way))
    order = order[good[way[order] // 2]]
    edge, facing, way, leaves = edge[order], facing[order], way[order], leaves[order]
    # what an outline enters lies to the left of an edge that comes out of the column
    to_left = np.where(facing > 0, seen.forth[edge], seen.back[edge])
    to_right = np.where(facing > 0, seen.back[edge], seen.forth[edge])
    into, out_of = np.where(leaves, to_left, to_right), np.where(leaves, to_right, to_left)
    first = np.ones(len(way), dtype=bool)
    first[1:] = way[1:] != way[:-1]
    last = np.roll(first, -1)
    hanging = np.where(first, begin[way] == out_of, np.roll(into, 1) == out_of)
    hanging &= ~last | (into == begin[way])
    good[way[~hanging] // 2] = False
    kept = good[way // 2]
    known = np.zeros(vertices, dtype=bool)
    known[seen.vertex[inside[good[seen.place_owner[inside]]]]] = True
    return Traces(
        good=good,
        way=way[kept],
        at=(corner[order] + along[order])[kept],
        first=first[kept],
        low=seen.vertex[seen.low[edge[kept]]],
        high=seen.vertex[seen.high[edge[kept]]],
        share=share[order][kept],
        leaves=leaves[kept],
        into=seen.triangle[into[kept]],
        begin=np.where((begin >= 0) & np.repeat(good, 2), seen.triangle[begin], -1),
        inside=known,
    )
