"""A graded lattice grown in a plane, where the bubbles start in a flat region.

As over a surface (see lattice.py) every bubble of the front sends a step into each of six directions and what
several propose for one place is averaged; but a plane needs no walks, and the packing metric is read off a
raster of it: the start needs it no better. Rows are bent as the metric wants them (see lattice.half_bend).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from ..boundary import Boundary, inside_distance
from ..mesh import Bools, Floats, Ints
from ..progress import Progress, Snapshot, Steps
from ..surface import Charts, Complex, Spots, in_plane, nearest_signpost, positions, product, search
from .crowding import uncrowded
from .lattice import CROWDED, RECENT, SAME, SIX, Lengths, half_bend
from .plane import all_found

# A raster has so many nodes for each bubble that there will be, but neither fewer than FEWEST nor more than
# MOST_NODES.
NODES, FEWEST, MOST_NODES = 0.4, 500, 30_000
# No step is made as if the pitch grew or fell faster than by this per length.
STEEP = 0.8
# From a node to the places round it the pitch does not fall below this share of itself.
LEAST = 0.3
# A place that a raster covers is no farther than this from a node, in spacings along each axis.
BESIDE = 0.501
# Where a place in the middle of the region is farther than this from all bubbles, in pitches, the lattice
# has not come there, as beyond a neck, and another is begun.
LEFT_OUT = 1.9


@dataclass(frozen=True)
class Raster:
    """What is known at the nodes of a grid over one part of a flat region, row after row.

    origin: the first node in the plane; spacing: of the nodes; columns: in a row; pitch (k,) and its slope
    (k,); inside: (k,) distance to the boundary, negative beyond it, and its slope (k,)
    """

    origin: complex
    spacing: float
    columns: int
    pitch: Floats
    slope: Complex
    inside: Floats
    inward: Complex


class Front(NamedTuple):
    """Bubbles in the plane: places, row directions, pitches and slopes of the pitch there, all (n,)."""

    at: Complex
    heading: Complex
    pitch: Floats
    slope: Complex


def grown_in_plane(
    charts: Charts,
    boundary: Boundary,
    pitch: Lengths,
    seeds: Spots,
    directions: Complex,
    clear: float,
    edge_offset: float,
) -> Steps[Spots]:
    """Places of a lattice grown from `seeds`, one or more for each part of a flat region, with a row along
    the direction that each has, as far as they are farther inside the boundary than `clear` pitches and the
    edge offset.
    """
    found: list[Spots] = []
    heading = product(directions, charts.plane.turn[seeds.row])
    for sheet in range(int(charts.region.sheet.max()) + 1):
        rows = np.flatnonzero(charts.region.sheet == sheet)
        own = np.flatnonzero(charts.region.sheet[seeds.row] == sheet)
        starts = positions(charts, seeds.take(own))
        raster = _raster(charts, boundary, pitch, rows, starts[0])
        lattice = yield from _grown(charts, raster, starts[0], in_plane(charts, starts), heading[own])
        points, enough = _in_space(charts, starts[0], lattice.at), clear * lattice.pitch + edge_offset
        # A distance changes by no more than the way: who is far inside need not be measured.
        node, off = _nodes(raster, lattice.at)
        kept = raster.inside[node] - np.abs(off) > enough
        near = np.flatnonzero(~kept)
        kept[near] = inside_distance(boundary, points[near], np.full(len(near), rows[0])) > enough[near]
        points, local = points[kept], lattice.pitch[kept]
        sought = in_plane(charts, points)
        spots, there = search(charts, nearest_signpost(charts, sought, rows[:1]), sought)
        found.append(all_found(charts, spots, there, points, float(local.max(initial=0.0))))
    return Spots(*(np.concatenate(parts) for parts in zip(*found, strict=True)))


def _in_space(charts: Charts, origin: Floats, at: Complex) -> Floats:
    """Points (n, 3) of the plane through `origin` (3,) from complex coordinates (n,)."""
    off = at - in_plane(charts, origin[None])[0]
    return origin + np.stack([off.real, off.imag], axis=1) @ charts.axes[0]


def _raster(charts: Charts, boundary: Boundary, pitch: Lengths, rows: Ints, origin: Floats) -> Raster:
    """Raster of the part of the region that has the triangles `rows`, in the plane through `origin` (3,)."""
    corners = in_plane(charts, charts.region.corners[rows].reshape(-1, 3))
    low = complex(corners.real.min(), corners.imag.min())
    wide, high = float(np.ptp(corners.real)), float(np.ptp(corners.imag))
    local = pitch(Spots(rows, np.full((len(rows), 3), 1 / 3)))
    area = np.linalg.norm(charts.region.area_vectors[rows], axis=1) / 2
    wanted = NODES * float((area / local**2).sum()) * wide * high / area.sum()
    spacing = float(np.sqrt(wide * high / np.clip(wanted, FEWEST, MOST_NODES)))
    columns, lines = int(np.ceil(wide / spacing)) + 1, int(np.ceil(high / spacing)) + 1
    nodes = _complex(np.tile(np.arange(columns), lines), np.repeat(np.arange(lines), columns))
    nodes = low + spacing * nodes
    points = _in_space(charts, origin, nodes)
    inside = inside_distance(boundary, points, np.full(len(nodes), rows[0]))
    post = nearest_signpost(charts, nodes, rows[:1])
    spots, there = search(charts, post, nodes)
    # Beyond the boundary the metric goes on as it is in the nearest triangle, within its own bounds.
    value = pitch(Spots(np.where(there, spots.row, post), _seen_from(charts, spots, post, there, nodes)))
    known = value[there] if there.any() else local
    value = np.clip(np.nan_to_num(value, nan=float(known.mean())), known.min(), known.max())
    shape = lines, columns
    return Raster(
        low, spacing, columns, value, _slope(value, shape, spacing), inside, _slope(inside, shape, spacing)
    )


def _complex(real: Floats | Ints, imaginary: Floats | Ints) -> Complex:
    """Complex numbers (n,) from their parts."""
    both = np.empty((len(real), 2))
    both[:, 0], both[:, 1] = real, imaginary
    return both.view(np.complex128)[:, 0]


def _seen_from(charts: Charts, spots: Spots, post: Ints, there: Bools, nodes: Complex) -> Floats:
    """Barycentric coordinates (k, 3) of the nodes in the triangles they are in, or in `post` (k,)."""
    plane = charts.plane
    offset = (nodes - plane.origin[post])[:, None]
    beyond = offset.real * plane.across[post] + offset.imag * plane.along[post]
    beyond[:, 0] += 1
    return np.where(there[:, None], spots.barycentric, beyond)


def _slope(value: Floats, shape: tuple[int, int], spacing: float) -> Complex:
    """Slope (k,) of values (k,) at the nodes of a grid of such a shape."""
    up, across = np.gradient(value.reshape(shape), spacing)
    return _complex(across.ravel(), up.ravel())


def _nodes(raster: Raster, at: Complex) -> tuple[Ints, Complex]:
    """The node nearest to each of `at` (n,), and the way there from it."""
    place = (at - raster.origin) / raster.spacing
    column = np.clip(np.rint(place.real), 0, raster.columns - 1)
    line = np.clip(np.rint(place.imag), 0, len(raster.pitch) // raster.columns - 1)
    node = (line * raster.columns + column).astype(np.int64)
    return node, raster.spacing * (place - (column + 1j * line))


def _covered(raster: Raster, off: Complex) -> Bools:
    """Which places the raster covers, by their ways (n,) from the nearest nodes: it reaches as far as the
    region does, and no slope says anything about what is beyond.
    """
    return np.maximum(np.abs(off.real), np.abs(off.imag)) <= BESIDE * raster.spacing


def _pitch_near(raster: Raster, node: Ints, off: Complex) -> Floats:
    """The pitch (n,) at a way `off` from the nodes."""
    there = raster.pitch[node]
    return np.maximum(there + _dot(raster.slope[node], off), LEAST * there)


def _front(raster: Raster, at: Complex, heading: Complex) -> Front:
    """Bubbles at `at` (n,) with what the raster says there."""
    node, off = _nodes(raster, at)
    return Front(at, heading, _pitch_near(raster, node, off), raster.slope[node])


def _dot(a: Complex, b: Complex) -> Floats:
    return a.real * b.real + a.imag * b.imag


class _Crowd:
    """Places of the bubbles born so far, to be asked who is near."""

    def __init__(self) -> None:
        self.old: list[Complex] = []
        self.old_tree: cKDTree | None = None
        self.recent: list[Complex] = []
        self.recent_tree: cKDTree | None = None

    def add(self, at: Complex) -> None:
        """Count the bubbles at `at` among those born."""
        self.recent.append(at)
        if len(self.recent) > RECENT and sum(map(len, self.recent)) > 0.3 * sum(map(len, self.old)):
            self.old = [np.concatenate([*self.old, *self.recent[:-RECENT]])]
            self.old_tree = _tree(self.old[0])
            self.recent = self.recent[-RECENT:]
        self.recent_tree = _tree(np.concatenate(self.recent))

    def free(self, at: Complex, distance: Floats) -> Ints:
        """Which of `at` (n,) no bubble is nearer to than its `distance` (n,)."""
        kept = np.arange(len(at))
        for tree in (self.recent_tree, self.old_tree):
            if tree is not None and len(kept):
                away = tree.query(_pairs(at[kept]), distance_upper_bound=float(distance[kept].max()))[0]
                kept = kept[away > distance[kept]]
        return kept


def _pairs(at: Complex) -> Floats:
    """Real and imaginary parts, (n, 2)."""
    return at.view(np.float64).reshape(-1, 2)


def _tree(at: Complex) -> cKDTree:
    return cKDTree(_pairs(at), balanced_tree=False, compact_nodes=False)


def _grown(charts: Charts, raster: Raster, origin: Floats, start: Complex, heading: Complex) -> Steps[Front]:
    """The lattice over one part of the region from its first bubbles on, generation after generation."""
    crowd, front = _Crowd(), _front(raster, start, heading)
    generations = [front]
    expected = float((raster.inside > 0).sum()) * raster.spacing**2 / float(np.mean(raster.pitch)) ** 2
    crowd.add(front.at)
    while len(front.at):
        if len(generations) % RECENT == 0:
            total = sum(len(born.at) for born in generations)
            looks = partial(_snapshot, charts, origin, list(generations))
            yield Progress("Growing the lattice", total / (total + expected), looks)
        front = _born(raster, crowd, front)
        if not len(front.at):
            front = _elsewhere(raster, generations)
        if len(front.at):
            crowd.add(front.at)
            generations.append(front)
    return Front(*(np.concatenate(column) for column in zip(*generations, strict=True)))


def _snapshot(charts: Charts, origin: Floats, generations: list[Front]) -> Snapshot:
    points = _in_space(charts, origin, np.concatenate([born.at for born in generations]))
    normals = np.broadcast_to(charts.region.normals[0], points.shape)
    return Snapshot(points, normals, np.concatenate([born.pitch for born in generations]))


def _elsewhere(raster: Raster, generations: list[Front]) -> Front:
    """The node that is deepest in what the lattice has left out, as a new start; none where all is filled."""
    at = np.concatenate([born.at for born in generations])
    heading = np.concatenate([born.heading for born in generations])
    deep = np.flatnonzero(raster.inside > 1.2 * raster.pitch)
    lines, columns = np.divmod(deep, raster.columns)
    places = raster.origin + raster.spacing * (columns + 1j * lines)
    distance, near = _tree(at).query(_pairs(places))
    lonely = np.flatnonzero(distance > LEFT_OUT * raster.pitch[deep])
    if len(lonely):
        lonely = lonely[[raster.inside[deep[lonely]].argmax()]]
    return _front(raster, places[lonely], heading[near[lonely]])


def _born(raster: Raster, crowd: _Crowd, front: Front) -> Front:
    """The next generation: what the front proposes, one bubble for each group that means the same place."""
    at, heading, local = _proposals(raster, crowd, front)
    if not len(at):
        return Front(at, heading, local, at)
    first, second = _tree(at).query_pairs(CROWDED * float(local.max()), output_type="ndarray").T
    same = np.abs(at[first] - at[second]) < SAME * (local[first] + local[second]) / 2
    leader = np.arange(len(at))
    np.minimum.at(leader, first[same], second[same])
    np.minimum.at(leader, second[same], first[same])
    while not np.array_equal(leader[leader], leader):
        leader = leader[leader]
    group = (np.cumsum(leader == np.arange(len(at))) - 1)[leader]
    votes = np.bincount(group)
    six = _summed(group, heading**6)
    bubbles = _front(raster, _summed(group, at) / votes, np.exp(1j * np.angle(six) / 6))
    first, second = group[first[~same]], group[second[~same]]
    reach = CROWDED * (bubbles.pitch[first] + bubbles.pitch[second]) / 2
    close = (first != second) & (np.abs(bubbles.at[first] - bubbles.at[second]) < reach)
    rank = np.lexsort((np.arange(len(votes)), -votes)).argsort()
    kept = uncrowded(np.stack([first[close], second[close]], axis=1), rank)
    return _taken(bubbles, kept)


def _taken(front: Front, which: Bools) -> Front:
    return Front(front.at[which], front.heading[which], front.pitch[which], front.slope[which])


def _summed(group: Ints, values: Complex) -> Complex:
    return _complex(np.bincount(group, values.real), np.bincount(group, values.imag))


def _proposals(raster: Raster, crowd: _Crowd, front: Front) -> tuple[Complex, Complex, Floats]:
    """Places at the stable distance from the front's bubbles where no bubble is yet, and the row directions
    and pitches there, (n,).
    """
    way = (front.heading[:, None] * SIX).ravel()
    slope = np.repeat(front.slope, 6)
    bend = half_bend(way, slope)
    way = way * bend
    # The stable distance l = (h + (h + s l)) / 2 with the slope s along the way.
    length = np.repeat(front.pitch, 6) / (1 - np.clip(_dot(way, slope), -STEEP, STEEP) / 2)
    at = np.repeat(front.at, 6) + way * length
    node, off = _nodes(raster, at)
    inside = np.flatnonzero(
        (raster.inside[node] + _dot(raster.inward[node], off) > 0) & _covered(raster, off)
    )
    at, heading = at[inside], (way * bend)[inside]
    local = _pitch_near(raster, node[inside], off[inside])
    free = crowd.free(at, CROWDED * local)
    return at[free], heading[free], local[free]
