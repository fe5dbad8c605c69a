"""The first row: lines one bubble radius inside the boundary, and bubbles on them (paper, requirement 3)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from ..boundary import Boundary, nearest_boundary
from ..mesh import Bools, Floats, Ints
from ..surface import Charts, Spots, positions, to_frame, walk

# Samples of the inset line per bubble radius.
FINENESS = 5
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


def inset_track(charts: Charts, boundary: Boundary, pitch: Lengths, edge_offset: float) -> Track:
    """Lines where the distance to the boundary is the local bubble's radius, half a `pitch`, plus
    `edge_offset`.

    Every boundary edge is sampled, each sample walks inward by the radius, and those that came nearer to
    another part of the boundary are dropped: what remains is the line, in runs that are joined at the inner
    corners.
    """

    def radius(at: Spots) -> Floats:
        return pitch(at) / 2 + edge_offset

    spots, loop, position, sizes = _walked_inward(charts, boundary, radius)
    chains = _joined(positions(charts, spots), loop, position, sizes, radius(spots))
    parts = [_knots(charts, boundary, radius, spots, chain, closed) for chain, closed in chains]
    parts = [part for part in parts if len(part[0].row) > 1]
    return _track(charts, parts, pitch)


def _walked_inward(charts: Charts, boundary: Boundary, radius: Lengths) -> tuple[Spots, Ints, Ints, Ints]:
    """Samples of the inset line: spots (m,), loop (m,), number among all samples (m,); and samples per loop
    (L,).
    """
    region = charts.region
    row, corner = region.rim.T
    number = _samples_per_edge(charts, radius)
    owner = np.repeat(np.arange(len(row)), number)
    share = (np.arange(len(owner)) - np.repeat(np.cumsum(number) - number, number) + 0.5) / number[owner]
    at, opposite = row[owner], corner[owner]
    start = _on_edges(at, opposite, share)
    inward = 1j * (charts.corners[at, (opposite + 2) % 3] - charts.corners[at, (opposite + 1) % 3])
    size = radius(start)
    walked = walk(charts, start, inward / np.abs(inward) * (size + region.reserve[owner]))
    known = _to_boundary(charts, boundary, walked.arrived)
    kept = (walked.left == 0) & (known[0] >= size * (1 - 1e-3))
    edges = [len(loop) for loop in region.loops]
    loop = np.repeat(np.arange(len(edges)), edges)[owner]
    known = known[0][kept], known[1][kept]
    settled = _settled(charts, boundary, radius, walked.arrived.take(kept), known)
    return settled, loop[kept], np.flatnonzero(kept), np.bincount(loop, minlength=len(edges))


def _samples_per_edge(charts: Charts, radius: Lengths) -> Ints:
    region = charts.region
    row, corner = region.rim.T
    length = np.linalg.norm(region.boundary_segments[:, 1] - region.boundary_segments[:, 0], axis=1)
    local = np.min(
        [radius(_on_edges(row, corner, np.full(len(row), share))) for share in (0.0, 0.5, 1.0)], axis=0
    )
    return np.maximum(np.ceil(FINENESS * length / local).astype(np.int64), 1)


def _on_edges(row: Ints, corner: Ints, share: Floats) -> Spots:
    """Places on the edges opposite to `corner`, `share` of the way along."""
    bary = np.zeros((len(row), 3))
    pick = np.arange(len(row))
    bary[pick, (corner + 1) % 3] = 1 - share
    bary[pick, (corner + 2) % 3] = share
    return Spots(row, bary)


def _to_boundary(charts: Charts, boundary: Boundary, spots: Spots) -> tuple[Floats, Floats]:
    return nearest_boundary(boundary, positions(charts, spots), spots.row)


def _settled(
    charts: Charts,
    boundary: Boundary,
    radius: Lengths,
    spots: Spots,
    known: tuple[Floats, Floats] | None = None,
    rounds: int = 3,
) -> Spots:
    """The same places moved to where the distance to the boundary is the radius, by Newton's method; what
    `nearest_boundary` says of them may be `known`.
    """
    for _ in range(rounds):
        distance, foot = known or _to_boundary(charts, boundary, spots)
        known = None
        lacking = radius(spots) - distance
        if np.abs(lacking).max(initial=0.0) < 1e-9 * distance.max(initial=1.0):
            break
        away = to_frame(charts, spots.row, positions(charts, spots) - foot)
        spots = walk(charts, spots, away / np.maximum(np.abs(away), 1e-300) * lacking).arrived
    return spots


def _joined(
    points: Floats, loop: Ints, position: Ints, sizes: Ints, radius: Floats
) -> list[tuple[list[Ints], bool]]:
    """Runs of neighbouring samples, chained where one ends near the start of another; and whether the chain
    closes.
    """
    runs, whole = _runs(loop, position, sizes)
    chains: list[tuple[list[Ints], bool]] = [
        ([run], True) for run, alone in zip(runs, whole, strict=True) if alone
    ]
    pieces = [run for run, alone in zip(runs, whole, strict=True) if not alone]
    if not pieces:
        return chains
    starts = np.array([run[0] for run in pieces])
    ends = np.array([run[-1] for run in pieces])
    gap, following = cKDTree(points[starts]).query(points[ends])
    follows = np.where(gap < 0.8 * radius[ends], following, -1)
    follows[~_first_claim(follows, gap)] = -1
    led = np.zeros(len(pieces), dtype=bool)
    led[follows[follows >= 0]] = True
    seen = np.zeros(len(pieces), dtype=bool)
    for first in [*np.flatnonzero(~led), *np.flatnonzero(led)]:
        chain: list[Ints] = []
        at = first
        while at >= 0 and not seen[at]:
            seen[at] = True
            chain.append(pieces[at])
            at = follows[at]
        if chain:
            chains.append((chain, bool(at == first)))
    return chains


def _first_claim(follows: Ints, gap: Floats) -> Bools:
    """Of the runs that would go on into the same run, the nearest one."""
    claim = np.zeros(len(follows), dtype=bool)
    order = np.lexsort((gap, follows))
    claim[order[np.concatenate([[True], np.diff(follows[order]) != 0])]] = True
    return claim


def _runs(loop: Ints, position: Ints, sizes: Ints) -> tuple[list[Ints], list[bool]]:
    """Runs of samples that stand next to one another on their loop; True for a loop of which no sample is
    missing.

    loop, position: (m,) the loop a sample belongs to and its number among all samples; sizes: (L,) samples
    per loop
    """
    runs: list[Ints] = []
    whole: list[bool] = []
    starts = np.cumsum(sizes) - sizes
    for number in np.unique(loop):
        members = np.flatnonzero(loop == number)
        pieces = np.split(members, np.flatnonzero(np.diff(position[members]) > 1) + 1)
        touches_start = position[members[0]] == starts[number]
        touches_end = position[members[-1]] == starts[number] + sizes[number] - 1
        complete = bool(len(pieces) == 1 and touches_start and touches_end)
        if len(pieces) > 1 and touches_start and touches_end:
            pieces = [np.concatenate([pieces[-1], pieces[0]]), *pieces[1:-1]]
        runs.extend(pieces)
        whole.extend([complete] * len(pieces))
    return runs, whole


def _knots(
    charts: Charts, boundary: Boundary, radius: Lengths, spots: Spots, chain: list[Ints], closed: bool
) -> tuple[Spots, bool]:
    """Knots of one line: samples, the corners between the runs, and no gap wider than half a radius."""
    rows: list[Ints] = []
    barys: list[Floats] = []
    for number, run in enumerate(chain):
        rows.append(spots.row[run])
        barys.append(spots.barycentric[run])
        if number + 1 < len(chain) or closed:
            corner = _corner(charts, spots, run, chain[(number + 1) % len(chain)])
            if corner is not None and _keeps_radius(charts, boundary, radius, corner):
                rows.append(corner.row)
                barys.append(corner.barycentric)
    if closed:
        rows.append(rows[0][:1])
        barys.append(barys[0][:1])
    knots = Spots(np.concatenate(rows), np.concatenate(barys))
    return _filled(charts, boundary, radius, knots), closed


def _corner(charts: Charts, spots: Spots, before: Ints, after: Ints) -> Spots | None:
    """Where the line that ends a run meets the one that begins the next; None where they already touch."""
    if len(before) < 2 or len(after) < 2:
        return None
    points = positions(charts, spots.take(np.array([before[-2], before[-1], after[0], after[1]])))
    ahead, back = points[1] - points[0], points[2] - points[3]
    ahead, back = ahead / np.linalg.norm(ahead), back / np.linalg.norm(back)
    between = points[2] - points[1]
    cosine = float(ahead @ back)
    # The nearest points of two lines in space; nearly parallel ones meet in no corner.
    if 1 - cosine**2 < np.sin(np.radians(5.0)) ** 2:
        return None
    reach = (between @ ahead - cosine * (between @ back)) / (1 - cosine**2)
    if not 0 <= reach <= 4 * np.linalg.norm(between) + 1e-300:
        return None
    last = spots.take(before[-1:])
    return walk(charts, last, to_frame(charts, last.row, reach * ahead[None])).arrived


def _keeps_radius(charts: Charts, boundary: Boundary, radius: Lengths, corner: Spots) -> bool:
    """Whether a corner is on the inset line: beside a rounded one, lines meet outside it."""
    distance, _ = _to_boundary(charts, boundary, corner)
    return bool((distance > (1 - 1e-2) * radius(corner)).all())


def _filled(charts: Charts, boundary: Boundary, radius: Lengths, knots: Spots) -> Spots:
    """Knots with more between those that are far apart, as round the corner of an island."""
    points = positions(charts, knots)
    gap = np.linalg.norm(np.diff(points, axis=0), axis=1)
    number = np.ceil(gap / (0.5 * radius(knots)[:-1])).astype(np.int64)
    owner = np.repeat(np.arange(len(gap)), np.maximum(number - 1, 0))
    if not len(owner):
        return knots
    order = np.arange(len(owner)) - np.searchsorted(owner, owner) + 1
    share = order / number[owner]
    start = knots.take(owner)
    step = (points[owner + 1] - points[owner]) * share[:, None]
    added = walk(charts, start, to_frame(charts, start.row, step)).arrived
    added = _settled(charts, boundary, radius, added, rounds=5)
    place = np.argsort(np.concatenate([np.arange(len(points)), owner + share]), kind="stable")
    return Spots(
        np.concatenate([knots.row, added.row])[place],
        np.concatenate([knots.barycentric, added.barycentric])[place],
    )


def _track(charts: Charts, parts: list[tuple[Spots, bool]], pitch: Lengths) -> Track:
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
    cosine = np.einsum("nc,nc->n", forward, backward)
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
    turning = np.einsum("kc,kc->k", np.cross(along[:-1], along[1:]), normals[1:-1])
    turned = np.concatenate([[0.0], np.cumsum(np.abs(turning)), [0.0]])
    turned[-1] = turned[-2]
    # From one line to the next nothing is straight.
    turned += 10.0 * track.chain
    end = np.searchsorted(turned, turned + STRAIGHT, side="right") - 1
    end = np.minimum(end + 1, np.searchsorted(track.chain, track.chain, side="right") - 1)
    middle = (track.arc + track.arc[end]) / 2
    return middle, track.arc[end] - track.arc, charts.region.sheet[track.spots.row]
