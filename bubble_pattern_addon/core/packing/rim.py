"""The first row: bubbles evenly on lines one bubble radius inside the boundary (paper, requirement 3)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from ..mesh import Bools, Floats, Ints
from ..surface import Charts, Spots, positions, to_frame, walk
from ..vectors import dots

# A turn of the inset line by more than this within 0.7 pitch is a sharp corner and gets a bubble of its own.
SHARP = np.radians(40.0)
CORNER_SCALE = 0.35
# Corners nearer to each other than this, in pitches, share one bubble: two rows do not fit between them.
ONE_CORNER = 0.85
# Bubbles of the first row are never spaced closer than this share of the pitch.
CLOSEST = 0.92
# A stretch of the first row is straight when it turns by less than this in all.
STRAIGHT = np.radians(2.0)

Lengths = Callable[[Spots], Floats]


@dataclass(frozen=True)
class Track:
    """Inset lines as polylines on the surface, one after the other in one array of knots.

    spots, points: the K knots on the surface; sheet: (K,); arc: (K,) length travelled, measured in local
    pitches, growing over all lines; chain: (K,) the line a knot belongs to; sharp: (K,) knots that are sharp
    corners;
    closed: (C,) whether a line runs back to its start (its first knot then stands again as its last)
    """

    spots: Spots
    points: Floats
    arc: Floats
    chain: Ints
    sharp: Bools
    closed: Bools


class Starts(NamedTuple):
    """Where bubbles round smooth closed lines begin: arc (C,) of the first, and of what their count is a
    multiple, (C,).
    """

    arc: Floats
    multiple: Ints


@dataclass(frozen=True)
class FirstRow:
    """Bubbles on the track: arc (n,) where they are; corner (n,) whether one stands at a sharp corner; around
    (n,): the length of its line where that closes on itself, 0 for an open one.
    """

    arc: Floats
    corner: Bools
    around: Floats

    def take(self, which: Bools) -> FirstRow:
        """The bubbles `which`."""
        return FirstRow(self.arc[which], self.corner[which], self.around[which])


def track_of(charts: Charts, parts: list[tuple[Spots, bool]], pitch: Lengths) -> Track:
    """The track of lines, each its knots and whether it runs back to its start."""
    if not parts:
        empty = Spots(np.empty(0, dtype=np.int64), np.empty((0, 3)))
        return Track(
            empty, np.empty((0, 3)), np.empty(0), empty.row, empty.row.astype(bool), np.empty(0, dtype=bool)
        )
    sizes = [len(knots.row) for knots, _ in parts]
    spots = Spots(
        np.concatenate([knots.row for knots, _ in parts]),
        np.concatenate([knots.barycentric for knots, _ in parts]),
    )
    chain = np.repeat(np.arange(len(parts)), sizes)
    points = positions(charts, spots)
    local = pitch(spots)
    length = np.linalg.norm(np.diff(points, axis=0), axis=1) * 2 / (local[:-1] + local[1:])
    # A pitch of nothing between two lines keeps them apart in the common measure.
    length[np.diff(chain) > 0] = 1.0
    arc = np.concatenate([[0.0], np.cumsum(length)])
    closed = np.array([closed for _, closed in parts])
    return Track(spots, points, arc, chain, _sharp_knots(points, arc, chain, closed), closed)


def _sharp_knots(points: Floats, arc: Floats, chain: Ints, closed: Bools) -> Bools:
    """Knots at which the line turns sharply, seen at the scale of the pitch; the ends of open lines count as
    sharp.
    """
    first = np.searchsorted(chain, np.arange(len(closed)))
    last = np.searchsorted(chain, np.arange(len(closed)), side="right") - 1
    low, high = arc[first][chain], arc[last][chain]
    ahead, back = arc + CORNER_SCALE, arc - CORNER_SCALE
    around = np.where(closed[chain], high - low, 0.0)
    ahead = np.minimum(np.where(ahead > high, ahead - around, ahead), high)
    back = np.maximum(np.where(back < low, back + around, back), low)
    forward, backward = (
        np.stack([np.interp(at, arc, axis) for axis in points.T], axis=1) for at in (ahead, back)
    )
    forward, backward = forward - points, points - backward
    cosine = dots(forward, backward)
    cosine /= np.maximum(np.linalg.norm(forward, axis=1) * np.linalg.norm(backward, axis=1), 1e-300)
    turn = np.where(high - low > 4 * CORNER_SCALE, np.arccos(np.clip(cosine, -1, 1)), 0.0)
    is_end = np.zeros(len(arc), dtype=bool)
    is_end[first[~closed]] = is_end[last[~closed]] = True
    turn[is_end] = np.pi
    # A closed line's first knot stands again as its last: the first speaks for both.
    turn[last[closed]] = 0.0
    sharp = np.zeros(len(arc), dtype=bool)
    for line in range(len(closed)):
        knots = np.arange(first[line], last[line] + 1)
        length = arc[last[line]] - arc[first[line]] if closed[line] else np.inf
        sharp[knots[_corners(arc[knots] - arc[first[line]], turn[knots], length)]] = True
    return sharp


def _corners(arc: Floats, turn: Floats, around: float) -> Ints:
    """Which knots of a line, at `arc` (k,), are its corners, from how far it turns there, (k,).

    A corner is where the line turns most. Corners so near one another that one bubble stands for them, as at
    the end of a strip, are one in their middle. around: the line's length if it is closed, else infinite
    """

    def apart(one: Floats | float, other: Floats | float) -> Floats:
        return np.minimum(np.abs(one - other), np.abs(around - np.abs(one - other)))

    peaks: list[int] = []
    candidates = np.flatnonzero(turn > SHARP)
    for knot in candidates[np.argsort(-turn[candidates], kind="stable")]:
        if not peaks or apart(arc[peaks], arc[knot]).min() > CORNER_SCALE:
            peaks.append(int(knot))
    found: list[int] = []
    groups = _groups(np.sort(peaks), arc, around)
    for group in groups:
        low, high = arc[group[0]], arc[group[-1]]
        middle = (low + high + (around if high < low else 0.0)) / 2
        middle -= around if middle >= around else 0.0
        found.append(int(np.abs(arc - middle).argmin()))
    return np.array(found, dtype=np.int64)


def _groups(peaks: Ints, arc: Floats, around: float) -> list[Ints]:
    """Peaks in the order of the line, in groups of those nearer to the next than two corners' bubbles fit."""
    if len(peaks) < 2:
        return [peaks] if len(peaks) else []
    groups = np.split(peaks, np.flatnonzero(np.diff(arc[peaks]) > ONE_CORNER) + 1)
    if len(groups) > 1 and around - arc[peaks[-1]] + arc[peaks[0]] <= ONE_CORNER:
        groups = [np.concatenate([groups[-1], groups[0]]), *groups[1:-1]]
    return groups


def first_row(track: Track, starts: Starts | None = None) -> FirstRow:
    """Bubbles of the first row: one at every sharp corner, the others evenly spaced between (in local
    pitches). Round lines without a corner they begin as `starts` says, or anywhere.
    """
    parts: list[FirstRow] = []
    for number, closed in enumerate(track.closed):
        knots = np.flatnonzero(track.chain == number)
        low, high = track.arc[knots[0]], track.arc[knots[-1]]
        corners = track.arc[knots[track.sharp[knots]]]
        around = high - low if closed else 0.0
        ends = np.append(corners, corners[0] + around) if closed and len(corners) else corners
        stretches, multiple = list(pairwise(ends)), 1
        if not len(ends):
            begin, multiple = (low, 1) if starts is None else (starts.arc[number], starts.multiple[number])
            stretches = [(begin, begin + high - low)]
        for start, stop in stretches:
            count = multiple * _count((stop - start) / multiple)
            arc = start + (stop - start) * np.arange(count) / count
            corner = (np.arange(count) == 0) & bool(len(ends))
            parts.append(FirstRow(np.where(arc > high, arc - around, arc), corner, np.full(count, around)))
        if not closed:
            parts.append(FirstRow(ends[-1:], np.ones(1, dtype=bool), np.zeros(1)))
    if not parts:
        return FirstRow(np.empty(0), np.empty(0, dtype=bool), np.empty(0))
    return FirstRow(
        np.concatenate([part.arc for part in parts]),
        np.concatenate([part.corner for part in parts]),
        np.concatenate([part.around for part in parts]),
    )


def _count(length: float) -> int:
    """Bubbles along a stretch of `length` pitches: spaced by one pitch as nearly as can be, never much
    closer.
    """
    count = max(round(length), 1)
    return count - 1 if count > 1 and length / count < CLOSEST else count


def on_track(track: Track, arc: Floats) -> tuple[Floats, Floats, Ints]:
    """Points (n, 3) on the track at `arc`, unit tangents (n, 3) and the knot before each (n,)."""
    knot = np.clip(np.searchsorted(track.arc, arc, side="right") - 1, 0, len(track.arc) - 2)
    along = track.points[knot + 1] - track.points[knot]
    length = track.arc[knot + 1] - track.arc[knot]
    points = track.points[knot] + ((arc - track.arc[knot]) / np.maximum(length, 1e-300))[:, None] * along
    return points, along / np.maximum(np.linalg.norm(along, axis=1, keepdims=True), 1e-300), knot


def spots_on_track(charts: Charts, track: Track, arc: Floats) -> Spots:
    """Places on the surface at `arc`."""
    points, _, knot = on_track(track, arc)
    start = track.spots.take(knot)
    return walk(charts, start, to_frame(charts, start.row, points - track.points[knot])).arrived


def straight_stretches(charts: Charts, track: Track) -> tuple[Floats, Floats, Ints]:
    """Longest straight stretch from every knot on: arc of its middle (K,), length in pitches (K,), region
    sheet (K,).

    Straight on the surface: the turning of the line in the tangent plane adds up to less than STRAIGHT.
    """
    along = np.diff(track.points, axis=0)
    along /= np.maximum(np.linalg.norm(along, axis=1, keepdims=True), 1e-300)
    normals = charts.region.normals[track.spots.row]
    turning = dots(np.cross(along[:-1], along[1:]), normals[1:-1])
    turned = np.concatenate([[0.0], np.cumsum(np.abs(turning)), [0.0]])
    turned[-1] = turned[-2]
    # From one line to the next nothing is straight.
    turned += 10.0 * track.chain
    end = np.searchsorted(turned, turned + STRAIGHT, side="right") - 1
    end = np.minimum(end + 1, np.searchsorted(track.chain, track.chain, side="right") - 1)
    middle = (track.arc + track.arc[end]) / 2
    return middle, track.arc[end] - track.arc, charts.region.sheet[track.spots.row]
