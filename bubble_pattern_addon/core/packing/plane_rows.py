"""Rows of a lattice along the planes of a mirror symmetry, for the lattice to grow from.

Where a mirror's plane cuts a surface, a lattice that is its own image has a row along the cut, or rows square
to it, of which every second one has a bubble on the plane. Grown from one seed, a lattice comes back to the
plane with rows that stand anywhere; grown from all along the cut it fits there, and the misfits are where the
symmetry does not multiply them.
"""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_array, csr_array
from scipy.sparse.csgraph import connected_components, depth_first_order

from ..mesh import Floats, Ints
from ..surface import Complex, Spots, positions, to_frame, to_space, walk
from .bubbles import Ground, joined
from .crowding import close_pairs, uncrowded
from .domain import grown_here

# The cut is made so far from the plane, as a share of the region's extent: edges that lie in it are no cut.
ASIDE = 1e-7
# A row is begun at a seed that is nearer to the cut than this, in pitches.
AT_SEED = 0.1
# Bubbles on the plane of rows square to it are so far apart, in pitches.
SECOND = np.sqrt(3.0)
# Where two cuts cross, bubbles nearer than this, in pitches, are one.
SAME = 0.8


def with_plane_rows(
    ground: Ground, seeds: Spots, directions: Complex, field: Complex | None
) -> tuple[Spots, Complex]:
    """The seeds of a lattice and their row directions, and further ones all along the planes of a mirror
    symmetry where leaders are packed.

    field: sixth powers of directions in the triangles' frames, (R,), 0 where there are none; rows run as it
    says, or else as from a seed on the cut
    """
    symmetry = ground.symmetry
    if symmetry is None or not len(symmetry.group.planes):
        return seeds, directions
    found, headings = [seeds], [directions]
    for normal in symmetry.group.planes:
        for cut in _cuts(ground, normal):
            row = _row_along(ground, *cut, seeds, directions, field)
            if row is not None:
                found.append(row[0])
                headings.append(row[1])
    spots, heading = joined(*found), np.concatenate(headings)
    here = grown_here(ground, spots)
    here[: len(seeds.row)] = True
    spots, heading = spots.take(here), heading[here]
    pairs = close_pairs(positions(ground.charts, spots), SAME * ground.pitch(spots))
    kept = uncrowded(pairs, np.arange(len(heading)))
    return spots.take(kept), heading[kept]


def rather_along(ground: Ground, field: Complex) -> Complex:
    """The field, sixth powers of directions in the triangles' frames (R,), or if rows as it says run square
    to most of the planes' cuts its opposite: rows that are a twelfth of a turn from there.

    Both are symmetric and as smooth, but a whole row on the plane has half as many ways to be at odds.
    """
    symmetry = ground.symmetry
    if symmetry is None or not len(symmetry.group.planes):
        return field
    along = 0.0
    for normal in symmetry.group.planes:
        for cut, closed in _cuts(ground, normal):
            if len(cut.row) > 2:
                step, six = _course(ground, cut, closed)
                along += float(np.linalg.norm(step, axis=1) @ np.sign(np.real(field[cut.row] * six.conj())))
    return field if along >= 0 else -field


def _course(ground: Ground, cut: Spots, closed: bool) -> tuple[Floats, Complex]:
    """Steps (n, 3) from each place of a cut to the next, and the sixth powers (n,) of their directions."""
    points = positions(ground.charts, cut)
    ahead = np.roll(points, -1, axis=0) - points
    if not closed:
        ahead[-1] = ahead[-2]
    along = to_frame(ground.charts, cut.row, ahead)
    return ahead, (along / np.maximum(np.abs(along), 1e-300)) ** 6


def _cuts(ground: Ground, normal: Floats) -> list[tuple[Spots, bool]]:
    """Places one after the other along each of the curves in which a plane cuts the region, one in every
    triangle; and whether the curve is closed.
    """
    assert ground.symmetry is not None
    region, centre = ground.charts.region, ground.symmetry.group.centre
    side = (region.corners - centre) @ normal + ASIDE * region.extent
    over = side > 0
    rows = np.flatnonzero(over.any(axis=1) & ~over.all(axis=1))
    if not len(rows):
        return []
    side, n = side[rows], len(rows)
    # Of each triangle two edges are cut: those round the corner that is alone on its side.
    alone = np.where(over[rows].sum(axis=1) == 1, over[rows].argmax(axis=1), over[rows].argmin(axis=1))
    bary, pick = np.zeros((n, 3)), np.arange(n)
    for turn in (1, 2):
        other = (alone + turn) % 3
        share = side[pick, alone] / (side[pick, alone] - side[pick, other])
        bary[pick, other] += share / 2
        bary[pick, alone] += (1 - share) / 2
    place = np.full(len(region.triangles), -1)
    place[rows] = pick
    beside = np.stack([region.neighbours[rows, (alone + turn) % 3] for turn in (1, 2)])
    linked = beside >= 0
    own = np.broadcast_to(pick, (2, n))[linked]
    graph = coo_array((np.ones(len(own)), (own, place[beside[linked]])), shape=(n, n)).tocsr()
    return [(Spots(rows[line], bary[line]), closed) for line, closed in _lines(graph)]


def _lines(graph: csr_array) -> list[tuple[Ints, bool]]:
    """The nodes of a graph of lines, each with at most two links, in the order of every line; and whether it
    is closed.
    """
    count, line = connected_components(graph, directed=False)
    ends = np.diff(graph.indptr) < 2
    found: list[tuple[Ints, bool]] = []
    for number in range(count):
        members = np.flatnonzero(line == number)
        outer = members[ends[members]]
        start = int(outer[0] if len(outer) else members[0])
        order = depth_first_order(graph, start, directed=False, return_predecessors=False)
        found.append((order.astype(np.int64), not len(outer)))
    return found


def _row_along(
    ground: Ground, cut: Spots, closed: bool, seeds: Spots, directions: Complex, field: Complex | None
) -> tuple[Spots, Complex] | None:
    """Places of bubbles along a cut and their row directions; None where nothing says how rows run there."""
    charts = ground.charts
    if len(cut.row) < 3:
        return None
    points, pitch = positions(charts, cut), ground.pitch(cut)
    ahead, six = _course(ground, cut, closed)
    at_seed = positions(charts, seeds)
    away = np.linalg.norm(points[None] - at_seed[:, None], axis=2)
    seed = int((away / ground.pitch(seeds)[:, None]).min(axis=1).argmin())
    start = int(away[seed].argmin())
    begun = _touches(points, ahead, at_seed[seed], start, float(pitch[start]))
    if field is not None and (field[cut.row] != 0).all():
        square = np.real(field[cut.row] * six.conj()) < 0
    elif begun:
        across = to_space(charts, seeds.row[[seed]], directions[[seed]])
        there = to_frame(charts, cut.row[[start]], across) ** 6
        square = np.broadcast_to(np.real(there * six[start].conj()) < 0, len(six))
    else:
        return None
    unit = pitch * np.where(square, SECOND, 1.0)
    length = np.linalg.norm(ahead, axis=1) * 2 / (unit + np.roll(unit, -1))
    arc = np.concatenate([[0.0], np.cumsum(length)])
    origin = arc[start]
    if closed:
        count = max(round(arc[-1]), 1)
        at = np.mod(origin + np.arange(count) * arc[-1] / count, arc[-1])
    else:
        at = origin % 1.0 + np.arange(int(arc[-2] - origin % 1.0) + 1)
    knot = np.clip(np.searchsorted(arc, at, side="right") - 1, 0, len(points) - 1)
    share = (at - arc[knot]) / np.maximum(length[knot], 1e-300)
    first = cut.take(knot)
    along = to_frame(charts, first.row, ahead[knot])
    walked = walk(charts, first, share * along, carried=along / np.maximum(np.abs(along), 1e-300))
    return walked.arrived, walked.carried * np.where(square[knot], 1j, 1.0)


def _touches(points: Floats, ahead: Floats, seed: Floats, start: int, pitch: float) -> bool:
    """Whether a seed is on the line, next to whose place `start` it is."""
    along = ahead[start] / max(float(np.linalg.norm(ahead[start])), 1e-300)
    offset = seed - points[start]
    return bool(np.linalg.norm(offset - (offset @ along) * along) < AT_SEED * pitch) and bool(
        np.linalg.norm(offset) < max(pitch, 2 * float(np.linalg.norm(ahead[start])))
    )
