"""Where the region is too narrow for two rows: one row in the middle."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from ..boundary import nearest_boundary, signature
from ..mesh import Bools, Floats, Ints
from ..surface import Spots, positions, to_frame, walk
from ..vectors import dots
from .bubbles import Ground, joined
from .crowding import close_pairs, uncrowded
from .rim import CLOSEST, FirstRow, on_track

# Two rows of a hexagonal arrangement are this far apart, in pitches; nearer lines have room for one row.
ROW_DISTANCE = 0.85
# Cosine between the directions of two sides that run against each other; in a corner wider than 47 degrees
# the second bubbles of both sides have room beside each other.
OPPOSITE = -0.68
# Knots within this stretch of the line belong to a bubble's own side.
OWN_SIDE = 0.45
# How many knots round a bubble are searched for one of the other side.
KNOTS = 48
# A run whose neighbours are farther apart than this, in pitches, is no single row.
FARTHEST = 1.9
# Single rows that meet, as at a crossing of narrow places, keep this far apart, in pitches; and as far from
# the first row of wider places.
TOO_CLOSE = 0.8
# A closed line of fewer pitches has no room for two bubbles across.
SMALL_LOOP = 2.6


def in_the_narrows(ground: Ground, row: FirstRow, spots: Spots) -> tuple[Spots, Spots]:
    """Of the first row, at `spots`, those that are not in narrow places, and places in the middle for these.

    A place is narrow where the inset line comes back, in the other direction, nearer than two rows are apart.
    A single row runs along the middle there; a bubble alone in its part of the region stands in that middle.
    """
    nobody = Spots(np.empty(0, dtype=np.int64), np.empty((0, 3)))
    if not len(row.arc):
        return spots, nobody
    aside = _to_the_middle(ground, row, spots)
    narrow = ~np.isnan(aside[:, 0])
    if not narrow.any():
        return spots, nobody
    start = spots.take(narrow)
    middle = walk(ground.charts, start, to_frame(ground.charts, start.row, aside[narrow])).arrived
    clear = _keeps_clear(ground, middle)
    if not clear.any():
        return spots, nobody
    narrow[narrow] = clear
    middles = _evened(ground, row, _moved(spots, narrow, middle.take(clear)), narrow)
    return spots.take(~narrow), middles


def _moved(spots: Spots, which: Bools, there: Spots) -> Spots:
    """The places with those of `which` (n,) exchanged for `there`."""
    row, bary = spots.row.copy(), spots.barycentric.copy()
    row[which], bary[which] = there
    return Spots(row, bary)


def _evened(ground: Ground, row: FirstRow, spots: Spots, narrow: Bools) -> Spots:
    """Places for the single rows: the `narrow` bubbles of the first row, at `spots` in the middle, where both
    sides have brought one once only, and evenly spaced from one end of their run to the other.
    """
    points = positions(ground.charts, spots)
    pitch = ground.pitch(spots)
    where = signature(ground.charts.region, points, spots.row, float(pitch.max()))
    rank = np.lexsort((np.arange(len(pitch)), narrow)).argsort()
    alone = uncrowded(close_pairs(where, CLOSEST * pitch), rank)
    knot = on_track(ground.track, row.arc)[2]
    line = ground.track.chain[knot]
    placed: list[Spots] = []
    for number in np.unique(line[narrow]):
        members = np.flatnonzero((line == number) & (alone | ~narrow))
        for run, closed in _runs(members, narrow, bool(ground.track.closed[number])):
            placed += [
                _spread(ground, spots, points, pitch, piece, narrow[piece], closed)
                for piece in np.split(run, _breaks(points[run], pitch[run]))
                if narrow[piece].any()
            ]
    found = joined(*placed) if placed else spots.take(np.zeros(0, dtype=np.int64))
    found = found.take(_keeps_clear(ground, found))
    wide = spots.take(~narrow)
    both = joined(wide, found)
    pitch = ground.pitch(both)
    reach = float(pitch.max(initial=0.0))
    where = signature(ground.charts.region, positions(ground.charts, both), both.row, reach)
    kept = uncrowded(close_pairs(where, TOO_CLOSE * pitch), np.arange(len(pitch)))
    return found.take(kept[len(wide.row) :])


def _runs(members: Ints, narrow: Bools, closed: bool) -> list[tuple[Ints, bool]]:
    """Runs of narrow bubbles along a line, each with the wide bubbles at its ends; and whether a run is the
    whole of a closed line.
    """
    inside = narrow[members]
    if inside.all():
        return [(members, closed)]
    if closed:
        # Begin and end at the same wide bubble, so that no run is cut in two.
        start = int(np.flatnonzero(~inside)[0])
        members = np.append(np.roll(members, -start), members[start])
        inside = narrow[members]
    edge = np.flatnonzero(np.diff(np.concatenate([[False], inside, [False]]).astype(np.int8)))
    return [
        (members[max(low - 1, 0) : high + 1], False) for low, high in zip(edge[::2], edge[1::2], strict=True)
    ]


def _breaks(points: Floats, pitch: Floats) -> Ints:
    """Where a run goes on too far away to be one row."""
    gap = np.linalg.norm(np.diff(points, axis=0), axis=1) * 2 / (pitch[1:] + pitch[:-1])
    return np.flatnonzero(gap > FARTHEST) + 1


def _spread(
    ground: Ground, spots: Spots, points: Floats, pitch: Floats, run: Ints, narrow: Bools, closed: bool
) -> Spots:
    """The narrow bubbles of a `run` (k,) at even distances along it, between the wide ones at its ends."""
    line = np.append(run, run[0]) if closed else run
    way = np.linalg.norm(np.diff(points[line], axis=0), axis=1) * 2 / (pitch[line][1:] + pitch[line][:-1])
    length = np.concatenate([[0.0], np.cumsum(way)])
    if len(run) < 3:
        return spots.take(run[narrow])
    count = max(round(length[-1]), 1)
    count -= int(count > 1 and length[-1] / count < CLOSEST)
    at = np.linspace(0.0, length[-1], count + 1)
    at = at[:-1] if closed else at[int(not narrow[0]) : len(at) - int(not narrow[-1])]
    before = np.clip(np.searchsorted(length, at, side="right") - 1, 0, len(way) - 1)
    share = (at - length[before]) / np.maximum(way[before], 1e-300)
    start = spots.take(line[before])
    step = share[:, None] * (points[line[before + 1]] - points[line[before]])
    return walk(ground.charts, start, to_frame(ground.charts, start.row, step)).arrived


def _keeps_clear(ground: Ground, spots: Spots) -> Bools:
    """Whether bubbles at these places would stay inside the boundary: beside an acute corner they may not."""
    if ground.boundary is None:
        return np.ones(len(spots.row), dtype=bool)
    distance, _ = nearest_boundary(ground.boundary, positions(ground.charts, spots), spots.row)
    return distance > 0.499 * ground.pitch(spots) + ground.edge_offset


def _to_the_middle(ground: Ground, row: FirstRow, spots: Spots) -> Floats:
    """Way (n, 3) from each bubble to the middle between both sides, nan where the place is not narrow."""
    track, charts = ground.track, ground.charts
    points, _, knot = on_track(track, row.arc)
    pitch = ground.pitch(spots)
    reach = float(pitch.max())
    tree = cKDTree(signature(charts.region, track.points, track.spots.row, reach))
    count = min(KNOTS, len(track.arc))
    at = signature(charts.region, points, spots.row, reach)
    distance, near = tree.query(at, k=count, distance_upper_bound=ROW_DISTANCE * reach)
    near = near.reshape(len(points), count)
    found = (near < len(track.arc)) & (distance.reshape(near.shape) < ROW_DISTANCE * pitch[:, None])
    near = np.minimum(near, len(track.arc) - 1)
    along = _directions(ground)
    before = np.where(track.chain[np.maximum(knot - 1, 0)] == track.chain[knot], knot - 1, knot)
    # A corner's bubble stands at the end of one direction and at the start of the next.
    against = np.minimum(
        np.einsum("nc,nkc->nk", along[knot], along[near]),
        np.einsum("nc,nkc->nk", along[np.maximum(before, 0)], along[near]),
    )
    found &= (against < OPPOSITE) & (_apart(ground, row, knot, near) > OWN_SIDE)
    first = found.argmax(axis=1)
    pick = np.arange(len(points))
    other = near[pick, first]
    across = track.points[other] - points
    across -= dots(across, along[other])[:, None] * along[other]
    way = np.where(found[pick, first][:, None], across / 2, np.nan)
    return _alone(ground, knot, points, way)


def _directions(ground: Ground) -> Floats:
    """Unit direction (K, 3) of the track from every knot; a line's last knot has that of the one before."""
    track = ground.track
    along = np.diff(track.points, axis=0, append=track.points[-1:])
    last = np.flatnonzero(np.append(np.diff(track.chain) > 0, True))
    along[last] = along[last - 1]
    return along / np.maximum(np.linalg.norm(along, axis=1, keepdims=True), 1e-300)


def _apart(ground: Ground, row: FirstRow, knot: Ints, near: Ints) -> Floats:
    """Length of line (n, k), in pitches, between bubbles and knots; infinite between different lines."""
    track = ground.track
    apart = np.abs(track.arc[near] - row.arc[:, None])
    around = row.around[:, None]
    apart = np.where(around > 0, np.minimum(apart, np.abs(around - apart)), apart)
    return np.where(track.chain[near] == track.chain[knot][:, None], apart, np.inf)


def _alone(ground: Ground, knot: Ints, points: Floats, way: Floats) -> Floats:
    """The same ways, to the middle of its line for a bubble that has a small closed line to itself."""
    track = ground.track
    lines = len(track.closed)
    first = np.searchsorted(track.chain, np.arange(lines))
    last = np.searchsorted(track.chain, np.arange(lines), side="right") - 1
    small = track.closed & (track.arc[last] - track.arc[first] < SMALL_LOOP)
    small &= np.bincount(track.chain[knot], minlength=lines) == 1
    size = np.bincount(track.chain, minlength=lines)
    centre = (
        np.stack([np.bincount(track.chain, axis, lines) for axis in track.points.T], axis=1) / size[:, None]
    )
    line = track.chain[knot]
    return np.where(small[line][:, None], centre[line] - points, way)
