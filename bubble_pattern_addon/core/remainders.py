"""What is left of the base's faces round columns, as triangles.

What is left of a face is bounded by pieces of its sides, out of the columns, and by the ways of the outlines
over it, against their direction. Each begins where another ends, so they link up to polygons; an outline that
lies in one face all round is a hole in that face's polygon.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from .columns import Columns
from .cycles import followed, ranges
from .mesh import Floats, Ints, Mesh
from .ranking import numbered, ranked
from .tracing import Traces
from .triangulating import triangulated


@dataclass(frozen=True)
class Points:
    """Names of the part's vertices: those of the base come first, then the corners of the outlines above,
    then those below, then the crossings.

    place: (N, 3); corners: number of the first corner above; lower: of the first corner below; crossings: of
    the first crossing
    """

    place: Floats
    corners: int
    lower: int
    crossings: int


class _Runs(NamedTuple):
    """Directed pieces of boundaries, h of them: from a vertex to another on a face, with the corners between.

    face, start, end: (h,); corner: (h,) name of the first corner after the start, one of `number`, (h,), that
    run up or down by `step` (h,) round an outline, whose names are `ring` and the `size` - 1 that follow
    """

    face: Ints
    start: Ints
    end: Ints
    corner: Ints
    number: Ints
    step: Ints
    ring: Ints
    size: Ints


class _Polygons(NamedTuple):
    """Polygons: `vertex` (P,) one after the other, `total` (p,) of each, on the faces `face` (p,), with their
    interior to the left.
    """

    vertex: Ints
    total: Ints
    face: Ints


def remainder(base: Mesh, columns: Columns, traces: Traces, points: Points) -> tuple[Ints, Ints] | None:
    """What is left of the base: triangles of `points`, (F, 3), and the face of the base each lies on, (F,).

    None where columns are so close together that their outlines touch.
    """
    touched = np.zeros(len(base.triangles), dtype=bool)
    touched[traces.into] = True
    touched[traces.begin[traces.begin >= 0]] = True
    touched |= traces.inside[base.triangles].any(axis=1)
    sides = _sides(base, traces, points, np.flatnonzero(touched))
    if sides is None:
        return None
    arcs = _arcs(columns, traces, points)
    runs = _Runs(*(np.concatenate(both) for both in zip(sides, arcs, strict=True)))
    polygons = _linked(runs, len(points.place))
    if polygons is None:
        return None
    holes = _holes(columns, traces, points)
    contours = _Polygons(*(np.concatenate(both) for both in zip(polygons, holes, strict=True)))
    flat, cell = _flattened(base, points, contours)
    pieces = triangulated(flat, contours.total, cell, len(polygons.total))
    if pieces is None:
        return None
    face = np.repeat(contours.face, contours.total)[pieces[:, 0]]
    whole = np.flatnonzero(~touched)
    return np.concatenate([base.triangles[whole], contours.vertex[pieces]]), np.concatenate([whole, face])


def _sides(base: Mesh, traces: Traces, points: Points, faces: Ints) -> _Runs | None:
    """The pieces of the sides of `faces`, (t,), that are out of the columns; None where columns overlap."""
    start, end = base.triangles[faces].ravel(), np.roll(base.triangles[faces], -1, axis=1).ravel()
    owner = np.repeat(faces, 3)
    count = len(base.vertices)
    keys, edge = numbered(traces.low * count + traces.high, (count * count).bit_length())
    found = _outside(traces, points, edge, len(keys))
    if found is None:
        return None
    pieces, first = found
    wanted = np.minimum(start, end) * count + np.maximum(start, end)
    row = np.searchsorted(keys, wanted)
    cut = np.append(keys, -1)[row] == wanted
    whole = np.flatnonzero(~cut & ~traces.inside[start])
    side, row = np.flatnonzero(cut), row[cut]
    number = first[row + 1] - first[row]
    piece, side = pieces[ranges(first[row], number)], np.repeat(side, number)
    turned = start[side] > end[side]
    piece[turned] = piece[turned][:, ::-1]
    none = np.zeros(len(whole) + len(side), dtype=np.int64)
    return _Runs(
        np.concatenate([owner[whole], owner[side]]),
        np.concatenate([start[whole], piece[:, 0]]),
        np.concatenate([end[whole], piece[:, 1]]),
        *(none,) * 5,
    )


def _outside(traces: Traces, points: Points, edge: Ints, count: int) -> tuple[Ints, Ints] | None:
    """Pieces of `count` crossed edges that are out of the columns, from low to high, (n, 2), and where those
    of each edge begin, (count + 1,); None where columns overlap. edge: (X,) which one each crossing is on
    """
    crossing = np.lexsort((traces.share, edge))
    edge, leaves = edge[crossing], traces.leaves[crossing]
    first, last = (np.searchsorted(edge, np.arange(count), side) for side in ("left", "right"))
    # an edge that does not begin in a column does as if it came out of one, and likewise at its end
    from_low = np.flatnonzero(~leaves[first])
    to_high = np.flatnonzero(leaves[last - 1])
    name = np.concatenate(
        [
            traces.low[crossing[first[from_low]]],
            points.crossings + crossing,
            traces.high[crossing[first[to_high]]],
        ]
    )
    out = np.concatenate([np.ones(len(from_low), dtype=bool), leaves, np.zeros(len(to_high), dtype=bool)])
    owner = np.concatenate([from_low, edge, to_high])
    order = np.argsort(owner, kind="stable")
    name, out, owner = name[order], out[order], owner[order]
    if len(out) % 2 or not out[0::2].all() or out[1::2].any() or (owner[0::2] != owner[1::2]).any():
        return None
    return name.reshape(-1, 2), np.searchsorted(owner[0::2], np.arange(count + 1))


def _arcs(columns: Columns, traces: Traces, points: Points) -> _Runs:
    """The ways of the outlines from crossing to crossing, so directed that the face is on their left."""
    column, below = np.divmod(traces.way, 2)
    here, there = np.floor(traces.at).astype(np.int64), traces.following
    size = columns.count[column]
    wraps = traces.first[there]
    count = here[there] - here + np.where(wraps, size, 0)
    ring = np.where(below, points.lower, points.corners) + columns.start[column]
    offset = here - columns.start[column]
    # seen from above an outline goes round with the column on its left: over the far side, which is seen from
    # behind, as it is, over the near side the other way round
    start = points.crossings + np.where(below, np.arange(len(there)), there)
    end = points.crossings + np.where(below, there, np.arange(len(there)))
    corner = ring + np.mod(np.where(below, offset + 1, offset + count), size)
    return _Runs(traces.into, start, end, corner, count, np.where(below, 1, -1), ring, size)


def _linked(runs: _Runs, names: int) -> _Polygons | None:
    """The runs linked up to polygons; None where they do not."""
    number = len(runs.face)
    bits = (int(runs.face.max(initial=0)) * names + names).bit_length()
    start, from_start = ranked(runs.face * names + runs.start, bits)
    end, from_end = ranked(runs.face * names + runs.end, bits)
    if (start != end).any() or (start[1:] == start[:-1]).any():
        return None
    following = np.empty(number, dtype=np.int64)
    following[from_end] = from_start
    graph = coo_array(
        (np.ones(number, dtype=np.int8), (np.arange(number), following)), shape=(number, number)
    )
    parts, label = connected_components(graph, directed=False)
    total = np.bincount(label, minlength=parts)
    first = np.empty(parts, dtype=np.int64)
    first[label[::-1]] = np.arange(number)[::-1]
    order = followed(following, first, total)
    # a run is its start and then its corners
    count = runs.number[order] + 1
    run = np.repeat(order, count)
    place = ranges(np.zeros(len(order), dtype=np.int64), count)
    around = runs.corner[run] - runs.ring[run] + runs.step[run] * (place - 1)
    vertex = np.where(place == 0, runs.start[run], runs.ring[run] + around % np.maximum(runs.size[run], 1))
    corners = np.add.reduceat(count, np.cumsum(total) - total) if number else total
    return _Polygons(vertex, corners, runs.face[first])


def _holes(columns: Columns, traces: Traces, points: Points) -> _Polygons:
    """The outlines that lie in one face all round."""
    free = traces.begin >= 0
    free[traces.way] = False
    way = np.flatnonzero(free)
    column, below = np.divmod(way, 2)
    size = columns.count[column]
    ring = np.where(below, points.lower, points.corners) + columns.start[column]
    forward = np.repeat(below == 1, size)
    place = ranges(np.zeros(len(way), dtype=np.int64), size)
    place = np.where(forward, place, np.repeat(size, size) - 1 - place)
    return _Polygons(np.repeat(ring, size) + place, size, traces.begin[way])


def _flattened(base: Mesh, points: Points, polygons: _Polygons) -> tuple[Floats, Ints]:
    """The polygons' vertices in the planes of their faces, (P, 2), in units of these; and the number of the
    face of each polygon among those that have any, (p,).
    """
    faces, cell = numbered(polygons.face.copy(), int(polygons.face.max(initial=0)).bit_length())
    origin, second, third = base.corners[faces].swapaxes(0, 1)
    along, across = second - origin, third - origin
    size = np.sqrt(np.maximum((along**2).sum(axis=1), (across**2).sum(axis=1)))[:, None]
    x = along / np.linalg.norm(along, axis=1)[:, None]
    normal = np.cross(along, across)
    y = np.cross(normal / np.linalg.norm(normal, axis=1)[:, None], x)
    which = np.repeat(cell, polygons.total)
    offset = points.place[polygons.vertex] - origin[which]
    flat = [(offset * (way / size)[which]).sum(axis=1) for way in (x, y)]
    return np.stack(flat, axis=1), cell
