"""A region less what lies below zero of a function on it: its triangles cut along the zero line.

The triangles near the line are bisected at their longest edges (M.-C. Rivara, Algorithms for refinement of
triangular grids suitable for adaptive and multigrid techniques, 1984: their angles stay bounded) until the
function is as good as linear on them; then each that the line crosses is cut at the roots on its edges. The
base geometry stays as it is: the pieces know where in it they lie.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from .errors import RegionError
from .mesh import Bools, Floats, Ints, Mesh
from .region import Region, region_of

# So often the place of a root is narrowed down: on outlines smooth at the scale of an edge to its last bit.
ROUNDS = 12
# Of the tolerance of chords, what vertices may be off the line.
SNAP = 0.1
# A function whose line would need more triangles than this is no outline.
MOST_TRIANGLES = 2_000_000


class Level(NamedTuple):
    """A function at n places: value (n,); and how fine its zero line is wanted there, as lengths (n,):
    tolerance, of chords; coarsest and finest, of the edges across it.
    """

    value: Floats
    tolerance: Floats
    coarsest: Floats
    finest: Floats


# Of points (n, 3) on the region's triangles (n,); it changes by no more than the way between two places.
Function = Callable[[Floats, Ints], Level]


@dataclass(frozen=True)
class _Pieces:
    """Triangles that the region is cut to.

    vertices (V, 3); triangles (M, 3); parent: (M,) the region's triangle that each lies in, ascending;
    inside: (M, 3, 3) barycentric coordinates of the corners in it
    """

    vertices: Floats
    triangles: Ints
    parent: Ints
    inside: Floats


def cut_region(region: Region, function: Function) -> Region:
    """The part of an uncut `region` in which `function` is above zero, with the zero line as boundary.

    Raises RegionError where nothing is left.
    """
    whole = len(region.triangles)
    pieces = _Pieces(
        region.mesh.vertices, region.mesh.triangles, np.arange(whole), np.tile(np.eye(3), (whole, 1, 1))
    )
    while True:
        coarse = _coarse(pieces, function)
        if not coarse.any():
            break
        pieces = _refined(pieces, coarse)
        if len(pieces.triangles) > whole + MOST_TRIANGLES:
            raise RegionError("The outline of a keep-out is too intricate: use a simpler object for it.")
    cut = _above_zero(pieces, function)
    if cut is None:
        return region
    if not len(cut.triangles):
        raise RegionError(
            "The keep-outs leave nothing of the target region: make them smaller, or choose a larger region."
        )
    return region_of(
        region.base,
        Mesh(cut.vertices, cut.triangles),
        region.triangles[cut.parent],
        None if region.part is None else region.part[cut.parent],
        region.gap,
        cut.inside,
    )


def _coarse(pieces: _Pieces, function: Function) -> Bools:
    """Which pieces, (M,), the zero line may cross while the function is not yet linear on them."""
    corners = pieces.vertices[pieces.triangles]
    middle = corners.mean(axis=1)
    reach = np.linalg.norm(corners - middle[:, None], axis=2).max(axis=1)
    level = function(middle, pieces.parent)
    near = np.flatnonzero(np.abs(level.value) <= reach)
    coarse = np.zeros(len(middle), dtype=bool)
    if not len(near):
        return coarse
    longest = np.linalg.norm(corners[near] - np.roll(corners[near], 1, axis=1), axis=2).max(axis=1)
    at = corners[near]
    places = np.concatenate([at, (np.roll(at, -1, axis=1) + np.roll(at, -2, axis=1)) / 2], axis=1)
    values = function(places.reshape(-1, 3), np.repeat(pieces.parent[near], 6)).value.reshape(-1, 6)
    ends, between = values[:, :3], values[:, 3:]
    bent = np.abs(between - (np.roll(ends, -1, axis=1) + np.roll(ends, -2, axis=1)) / 2).max(axis=1)
    wanted = (bent > level.tolerance[near]) & (longest > level.finest[near])
    coarse[near] = wanted | (longest > level.coarsest[near])
    return coarse


def _refined(pieces: _Pieces, chosen: Bools) -> _Pieces:
    """The `chosen` (M,) pieces quartered, and as many others cut as it takes for edges to fit."""
    edge, ends = _edges(pieces.triangles)
    length = np.linalg.norm(pieces.vertices[ends[:, 1]] - pieces.vertices[ends[:, 0]], axis=1)
    # the first of equally long ones, so that both triangles at an edge agree
    longest = np.take_along_axis(edge, length[edge].argmax(axis=1)[:, None], axis=1)[:, 0]
    marked = np.zeros(len(ends), dtype=bool)
    marked[edge[chosen]] = True
    while True:
        lacking = marked[edge].any(axis=1) & ~marked[longest]
        if not lacking.any():
            break
        marked[longest[lacking]] = True
    middle = np.full(len(ends), -1)
    middle[marked] = len(pieces.vertices) + np.arange(marked.sum())
    vertices = np.concatenate([pieces.vertices, pieces.vertices[ends[marked]].mean(axis=1)])
    # every piece with its longest edge opposite to corner 0
    turn = (length[edge].argmax(axis=1)[:, None] + np.arange(3)) % 3
    triangles = np.take_along_axis(pieces.triangles, turn, axis=1)
    middles = middle[np.take_along_axis(edge, turn, axis=1)]
    inside = np.take_along_axis(pieces.inside, turn[:, :, None], axis=1)
    corner = np.concatenate([triangles, middles], axis=1)
    place = np.concatenate([inside, (np.roll(inside, -1, axis=1) + np.roll(inside, -2, axis=1)) / 2], axis=1)
    return _assembled(vertices, corner, place, pieces.parent, _halves(middles >= 0))


def _halves(cut: Bools) -> list[tuple[Bools, tuple[int, int, int]]]:
    """Which triangles stand for the pieces whose edges `cut` (M, 3) are halved: (M,) where, and of which of
    its corners 0 to 2 and middles 3 to 5 of the edges opposite to them. Edge 0 is the longest.
    """
    a, b, c = cut.T
    return [
        (~a, (0, 1, 2)),
        (a & ~c, (0, 1, 3)),
        (a & c, (0, 5, 3)),
        (a & c, (5, 1, 3)),
        (a & ~b, (0, 3, 2)),
        (a & b, (0, 3, 4)),
        (a & b, (4, 3, 2)),
    ]


def _assembled(
    vertices: Floats,
    corner: Ints,
    place: Floats,
    parent: Ints,
    parts: list[tuple[Bools, tuple[int, int, int]]],
) -> _Pieces:
    """Pieces from `parts`: for which triangles (M,), and which of their candidates, vertices `corner` (M, k)
    at `place` (M, k, 3), are their corners.
    """
    owner = np.concatenate([np.flatnonzero(where) for where, _ in parts])
    triangles = np.concatenate([corner[where][:, list(of)] for where, of in parts])
    inside = np.concatenate([place[where][:, list(of)] for where, of in parts])
    order = np.argsort(owner, kind="stable")
    return _Pieces(vertices, triangles[order], parent[owner[order]], inside[order])


def _edges(triangles: Ints) -> tuple[Ints, Ints]:
    """The edge opposite to each corner as a number, (M, 3), and the edges' vertices, the lower one first,
    (E, 2).
    """
    pairs = np.stack([np.roll(triangles, -1, axis=1), np.roll(triangles, -2, axis=1)], axis=2).reshape(-1, 2)
    low, high = np.sort(pairs, axis=1).T
    count = int(triangles.max(initial=0)) + 1
    code, number = np.unique(low * count + high, return_inverse=True)
    return number.reshape(-1, 3), np.stack([code // count, code % count], axis=1)


def _above_zero(pieces: _Pieces, function: Function) -> _Pieces | None:
    """What of the pieces is above zero; None where all is."""
    used, first = np.unique(pieces.triangles, return_index=True)
    level = function(pieces.vertices[used], pieces.parent[first // 3])
    value = np.full(len(pieces.vertices), np.inf)
    # a vertex so near to the line that a sliver would be left is on it
    value[used] = np.where(np.abs(level.value) <= SNAP * level.tolerance, 0.0, level.value)
    if (value[used] > 0).all():
        return None
    edge, ends = _edges(pieces.triangles)
    crossed = value[ends].min(axis=1) * value[ends].max(axis=1) < 0
    crossed &= np.isfinite(value[ends]).all(axis=1)
    of_edge = np.empty(len(ends), dtype=np.int64)
    of_edge[edge.ravel()] = np.repeat(pieces.parent, 3)
    share = np.zeros(len(ends))
    at = pieces.vertices[ends[crossed]]
    share[crossed] = _roots(at, value[ends[crossed, 0]] > 0, of_edge[crossed], function)
    root = np.full(len(ends), -1)
    root[crossed] = len(pieces.vertices) + np.arange(crossed.sum())
    new = at[:, 0] + share[crossed][:, None] * (at[:, 1] - at[:, 0])
    vertices = np.concatenate([pieces.vertices, new])
    return _cut(pieces, value, edge, ends, root, share, vertices)


def _roots(ends: Floats, falls: Bools, row: Ints, function: Function) -> Floats:
    """Where on edges (m, 2, 3) the function is zero, as shares (m,) of the way; falls: (m,) where it is above
    zero at the start.
    """
    low, high = np.zeros(len(ends)), np.ones(len(ends))
    way = ends[:, 1] - ends[:, 0]
    at_low, at_high = (function(ends[:, side], row).value for side in (0, 1))
    at_low, at_high = np.where(falls, at_low, -at_low), np.where(falls, at_high, -at_high)
    for number in range(ROUNDS):
        # false position, with a halving now and then for where it creeps
        share = at_low / np.where(at_low > at_high, at_low - at_high, np.inf)
        middle = low + (high - low) * (np.clip(share, 0.0, 1.0) if number % 3 < 2 else 0.5)
        value = function(ends[:, 0] + middle[:, None] * way, row).value
        value = np.where(falls, value, -value)
        before = value > 0
        low, at_low = np.where(before, middle, low), np.where(before, value, at_low)
        high, at_high = np.where(before, high, middle), np.where(before, at_high, value)
    return np.where(at_low < -at_high, low, high)


def _cut(
    pieces: _Pieces, value: Floats, edge: Ints, ends: Ints, root: Ints, share: Floats, vertices: Floats
) -> _Pieces:
    """The pieces cut at the `root` (E,) vertices of their edges, `share` (E,) of the way along `ends`, and of
    these only what is above zero.
    """
    sign = np.sign(value[pieces.triangles]).astype(np.int64)
    # turned so that the corner that differs from the other two in sign comes first
    alone = np.where((sign > 0).sum(axis=1) == 1, (sign > 0).argmax(axis=1), (sign < 0).argmax(axis=1))
    turn = (alone[:, None] + np.arange(3)) % 3
    triangles = np.take_along_axis(pieces.triangles, turn, axis=1)
    inside = np.take_along_axis(pieces.inside, turn[:, :, None], axis=1)
    edge = np.take_along_axis(edge, turn, axis=1)
    sign = np.take_along_axis(sign, turn, axis=1)
    corner = np.concatenate([triangles, root[edge]], axis=1)
    start = np.roll(triangles, -1, axis=1)
    way = np.where(start == ends[edge, 0], share[edge], 1 - share[edge])[:, :, None]
    between = np.roll(inside, -1, axis=1) * (1 - way) + np.roll(inside, -2, axis=1) * way
    place = np.concatenate([inside, between], axis=1)
    above, below = (sign > 0).sum(axis=1), (sign < 0).sum(axis=1)
    parts = [
        (below == 0, (0, 1, 2)),
        # one above, two below; the third may lie on the line
        ((above == 1) & (below == 2), (0, 5, 4)),
        ((above == 1) & (below == 1) & (sign[:, 1] < 0), (0, 5, 2)),
        ((above == 1) & (below == 1) & (sign[:, 2] < 0), (0, 1, 4)),
        # two above, one below
        ((above == 2) & (below == 1), (5, 1, 2)),
        ((above == 2) & (below == 1), (5, 2, 4)),
    ]
    parts[0] = (parts[0][0] & (above > 0), parts[0][1])
    cut = _assembled(vertices, corner, place, pieces.parent, parts)
    used, number = np.unique(cut.triangles, return_inverse=True)
    return replace(cut, vertices=vertices[used], triangles=number.reshape(-1, 3))
