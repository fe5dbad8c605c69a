"""Lines one bubble radius inside the boundary, on which the first row stands (paper, requirement 3)."""

from __future__ import annotations

from itertools import pairwise
from typing import NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from ..boundary import Boundary, nearest_boundary
from ..cycles import members, next_round
from ..mesh import Bools, Floats, Ints
from ..region import Region
from ..surface import Charts, Spots, positions, to_frame, walk
from ..vectors import dots
from .bubbles import joined
from .rim import Lengths, Track, track_of

# Samples of the inset line per bubble radius.
FINENESS = 5
# Of its multiples, taken modulo 1, any few that follow one another lie evenly.
GOLDEN = (np.sqrt(5) - 1) / 2
# Starts of runs looked at for the one that goes on from the end of another.
NEAR = 6
# Samples of two sides of a corner may reach over one another by this much, in radii.
OVERLAP = 0.1
# A corner this near the inset line, as a share of the radius, is on it.
NEARLY = 1e-2

Chain = tuple[list[Ints], bool]
"""Runs of samples, rows of them, that follow one another; and whether the first follows the last."""


def inset_track(charts: Charts, boundary: Boundary, pitch: Lengths, edge_offset: float) -> Track:
    """Lines where the distance to the boundary is the local bubble's radius, half a `pitch`, plus
    `edge_offset`.

    Every boundary edge is sampled, and every vertex at which the boundary turns away from the region; each
    sample walks inward by the radius, and those that came nearer to another part of the boundary are dropped:
    what remains is the line, in runs that are joined at the inner corners. Round a jagged boundary, as that
    of faces chosen from a grid, hardly more is left than short runs about its teeth.
    """

    def radius(at: Spots) -> Floats:
        return pitch(at) / 2 + edge_offset

    walked = _walked_inward(charts, boundary, radius)
    spots = walked.spots
    chains = _joined(positions(charts, spots), walked, radius(spots))
    spots, lines = _with_corners(charts, boundary, radius, spots, chains)
    lines = [line for line in lines if len(line[0]) > 1]
    parts = [(_filled(charts, boundary, radius, spots.take(knots)), closed) for knots, closed in lines]
    return track_of(charts, parts, pitch)


class Walked(NamedTuple):
    """Samples of the inset line. spots (m,); tangent (m, 3): the line's direction there, not of unit length;
    loop (m,); position (m,): numbers among all samples; sizes (L,): samples per loop.
    """

    spots: Spots
    tangent: Floats
    loop: Ints
    position: Ints
    sizes: Ints


def _walked_inward(charts: Charts, boundary: Boundary, radius: Lengths) -> Walked:
    region = charts.region
    row, corner = region.rim.T
    owner, share, turned = _samples(charts, radius)
    at, opposite = row[owner], corner[owner]
    start = _on_edges(at, opposite, share)
    inward = 1j * (charts.corners[at, (opposite + 2) % 3] - charts.corners[at, (opposite + 1) % 3])
    inward *= np.exp(1j * turned) / np.abs(inward)
    size = radius(start)
    walked = walk(charts, start, inward * (size + region.reserve[owner]))
    distance, foot = _to_boundary(charts, boundary, walked.arrived)
    kept = (walked.left == 0) & (distance >= size * (1 - 1e-3))
    edges = [len(loop) for loop in region.loops]
    loop_of = np.repeat(np.arange(len(edges)), edges)[owner]
    arrived, loop = walked.arrived.take(kept), loop_of[kept]
    distance, foot, sizes = distance[kept], foot[kept], np.bincount(loop_of, minlength=len(edges))
    spots = _settled(charts, boundary, radius, arrived, (distance, foot))
    # the region is on the left of its boundary
    tangent = np.cross(positions(charts, arrived) - foot, region.normals[arrived.row])
    some = _in_order(positions(charts, spots), tangent, loop, OVERLAP * radius(spots))
    return Walked(spots.take(some), tangent[some], loop[some], np.flatnonzero(kept)[some], sizes)


def _in_order(points: Floats, tangent: Floats, loop: Ints, reach: Floats) -> Ints:
    """Samples that stand in the order of their loops (m,), without those that are behind the one before them,
    but within its `reach` (m,): where the line turns gently outward, samples of both sides may be kept beyond
    the corner.
    """
    some = np.arange(len(points))
    while len(some):
        after = some[next_round(np.bincount(loop[some]))]
        way = points[after] - points[some]
        behind = (dots(way, tangent[some] + tangent[after]) < 0) & (dots(way, way) < reach[some] ** 2)
        if not behind.any():
            break
        some = np.setdiff1d(some, after[behind])
    return some


def _samples(charts: Charts, radius: Lengths) -> tuple[Ints, Floats, Floats]:
    """Where samples start and whereto: the boundary edge (n,) each belongs to, the share of the way along it
    (n,), and the angle from the edge's inward normal at which they walk (n,), in the order of the boundary.

    At a vertex that turns away from the region the samples fan out, half of them from the end of one edge and
    half from the start of the next. Each fan begins at another share of its first step: among teeth that are
    all alike none of whose samples is kept, all would be missed.
    """
    along = _samples_per_edge(charts, radius)
    away = np.maximum(-_turns(charts.region), 0.0)
    leaving = np.floor(FINENESS * away / 2).astype(np.int64)
    following = _next_edges(charts.region)
    arriving = leaving[following]
    number = leaving + along + arriving
    owner, place = members(number)
    # places left until those along the edge begin, and places since these have ended
    before, after = leaving[owner] - place, place - (leaving + along)[owner]
    share = np.clip((0.5 - before) / along[owner], 0, 1)
    step, phase = away / 2 / np.maximum(leaving, 1), np.arange(len(number)) * GOLDEN % 1
    turned = np.where(before > 0, (before - phase[owner]) * step[owner], 0.0)
    turned = np.where(after >= 0, -(after + phase[following[owner]]) * step[following[owner]], turned)
    return owner, share, turned


def _next_edges(region: Region) -> Ints:
    """The boundary edge (S,) that follows each one on its loop."""
    return next_round(np.array([len(loop) for loop in region.loops]))


def _turns(region: Region) -> Floats:
    """The angle (S,) by which the boundary turns towards the region where each of its edges starts."""
    ahead = region.boundary_segments[:, 1] - region.boundary_segments[:, 0]
    turn = np.empty(len(ahead))
    following = _next_edges(region)
    across = np.cross(ahead, ahead[following])
    up = region.normals[region.rim[:, 0]] + region.normals[region.rim[following, 0]]
    turn[following] = np.arctan2(
        np.copysign(np.sqrt(dots(across, across)), dots(across, up)), dots(ahead, ahead[following])
    )
    return turn


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


def _joined(points: Floats, walked: Walked, radius: Floats) -> list[Chain]:
    """Runs of neighbouring samples, chained where one ends near the start of another; and whether the chain
    closes.
    """
    runs, whole = _runs(walked.loop, walked.position, walked.sizes)
    chains: list[Chain] = [([run], True) for run, alone in zip(runs, whole, strict=True) if alone]
    pieces = [run for run, alone in zip(runs, whole, strict=True) if not alone]
    if not pieces:
        return chains
    starts, ends = np.array([[run[0], run[-1]] for run in pieces]).T
    follows, gap = _nearest_ahead(points, walked.tangent, starts, ends, 0.8 * radius[ends])
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


def _nearest_ahead(
    points: Floats, tangent: Floats, starts: Ints, ends: Ints, reach: Floats
) -> tuple[Ints, Floats]:
    """The run (r,) whose start is nearest to the end of each one, within its `reach` (r,) and ahead of it, -1
    for none; and how far away (r,).

    A short run's own start and that of the run before it may be nearer than that of the next, but both lie
    behind.
    """
    count, pick = min(NEAR, len(starts)), np.arange(len(starts))
    gap, near = cKDTree(points[starts]).query(points[ends], k=np.arange(1, count + 1))
    way = points[starts[near]] - points[ends][:, None]
    heading = tangent[ends][:, None] + tangent[starts[near]]
    fits = (np.einsum("rkc,rkc->rk", way, heading) > 0) & (gap < reach[:, None])
    # two that touch are one line, but for a run of one sample, whose start is its end
    fits |= (gap == 0) & (near != pick[:, None])
    first = fits.argmax(axis=1)
    return np.where(fits[pick, first], near[pick, first], -1), gap[pick, first]


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


def _with_corners(
    charts: Charts, boundary: Boundary, radius: Lengths, spots: Spots, chains: list[Chain]
) -> tuple[Spots, list[tuple[Ints, bool]]]:
    """The samples and, after them, the corners where runs meet; and the rows of each line's knots in order,
    the first once more at the end of one that closes, and whether it does.
    """
    followed = [
        (run, after) for chain, closed in chains for run, after in pairwise(chain + chain[:1] * closed)
    ]
    long = np.flatnonzero([len(run) > 1 and len(after) > 1 for run, after in followed])
    around = [[*followed[number][0][-2:], *followed[number][1][:2]] for number in long]
    corner, meets = _corners(charts, spots, np.array(around, dtype=np.int64).reshape(-1, 4))
    distance, foot = _to_boundary(charts, boundary, corner)
    share = distance / radius(corner)
    # beside a rounded corner of the boundary lines meet outside the inset line
    on_line = share > 1 - NEARLY
    # and where short runs about two teeth do, on its inner side
    aside = np.flatnonzero(share > 1 + NEARLY)
    known = distance[aside], foot[aside]
    corner.row[aside], corner.barycentric[aside] = _settled(
        charts, boundary, radius, corner.take(aside), known
    )
    corner = corner.take(on_line)
    between = np.full(len(followed), -1)
    between[long[meets][on_line]] = len(spots.row) + np.arange(len(corner.row))
    lines, corners = [], iter(between)
    for chain, closed in chains:
        rows = [chain[0]]
        for _, after in pairwise(chain + chain[:1] * closed):
            number = next(corners)
            rows += [np.array([number]), after] if number >= 0 else [after]
        if closed:
            rows[-1] = rows[-1][:1]
        lines.append((np.concatenate(rows), closed))
    return joined(spots, corner), lines


def _corners(charts: Charts, spots: Spots, around: Ints) -> tuple[Spots, Ints]:
    """Where the lines through the last two samples of one run and the first two of the next meet between
    them; of these samples (j, 4) which rows do. Others touch already, or go on round a bend.
    """
    points = positions(charts, spots.take(around.ravel())).reshape(-1, 4, 3)
    ahead, back = points[:, 1] - points[:, 0], points[:, 2] - points[:, 3]
    ahead, back = (way / np.maximum(np.sqrt(dots(way, way)), 1e-300)[:, None] for way in (ahead, back))
    between = points[:, 2] - points[:, 1]
    cosine = dots(ahead, back)
    # The nearest points of two lines in space; nearly parallel ones meet in no corner.
    meeting = 1 - cosine**2 >= np.sin(np.radians(5.0)) ** 2
    share = np.where(meeting, 1 - cosine**2, 1.0)
    reach = (dots(between, ahead) - cosine * dots(between, back)) / share
    meeting &= (reach >= 0) & (reach <= 4 * np.linalg.norm(between, axis=1) + 1e-300)
    meeting &= reach * cosine >= dots(between, back)
    meets = np.flatnonzero(meeting)
    last = spots.take(around[meets, 1])
    way = to_frame(charts, last.row, reach[meets, None] * ahead[meets])
    return walk(charts, last, way).arrived, meets


def _filled(charts: Charts, boundary: Boundary, radius: Lengths, knots: Spots) -> Spots:
    """Knots with more between those that are far apart, as round the corner of an island."""
    points = positions(charts, knots)
    gap = np.linalg.norm(np.diff(points, axis=0), axis=1)
    number = np.ceil(gap / (0.5 * radius(knots)[:-1])).astype(np.int64)
    owner, order = members(np.maximum(number - 1, 0))
    if not len(owner):
        return knots
    share = (order + 1) / number[owner]
    start = knots.take(owner)
    step = (points[owner + 1] - points[owner]) * share[:, None]
    added = walk(charts, start, to_frame(charts, start.row, step)).arrived
    added = _settled(charts, boundary, radius, added, rounds=5)
    place = np.argsort(np.concatenate([np.arange(len(points)), owner + share]), kind="stable")
    return joined(knots, added).take(place)
