"""Lines one bubble radius inside the boundary, on which the first row stands (paper, requirement 3)."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from ..boundary import Boundary, nearest_boundary
from ..mesh import Bools, Floats, Ints
from ..surface import Charts, Spots, positions, to_frame, walk
from .rim import Lengths, Track, track_of

# Samples of the inset line per bubble radius.
FINENESS = 5


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
    return track_of(charts, parts, pitch)


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
