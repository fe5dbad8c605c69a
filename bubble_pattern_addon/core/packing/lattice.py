"""A hexagonal lattice grown over the surface: where the bubbles start.

From random points the force law makes grains; the look of the paper, one crystal in the core and all defects
in the rim, needs a crystal to start from. On a surface without a plane it grows outward: every bubble of the
front sends a step of one pitch into each of six directions, the directions are carried along straight walks,
and what several bubbles propose for one place is averaged.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from ..boundary import signature
from ..mesh import Bools, Floats
from ..progress import Progress, Snapshot, Steps, drive
from ..surface import Charts, Complex, Spots, positions, product, to_frame, to_space, walk
from .bubbles import joined
from .crowding import close_pairs, uncrowded

Lengths = Callable[[Spots], Floats]

SIX = np.exp(1j * np.pi / 3 * np.arange(6))
# Proposals closer together than this share of the pitch mean the same place; bubbles are born no closer than
# CROWDED, or CROWDED_CLOSED where no boundary gives way and gaps between what has grown apart would stay.
SAME = 0.5
CROWDED, CROWDED_CLOSED = 0.8, 0.7
# Rows bend by this share of what the grading of the pitch asks for: the rest is left to a few dislocations,
# and rows that begin along a boundary stay with it longer (best for order, by a family of linear and radial
# gradings; 0.65 and 0.9 are nearly as good).
BENT = 0.8
# No row bends as if the pitch grew faster than by this per length.
STEEPEST = 0.5
# Bubbles of so many generations are searched anew for each generation; older ones only when they have become
# many.
RECENT = 4


def grow(
    charts: Charts, pitch: Lengths, seeds: Spots, directions: Complex, most: int, field: Complex | None = None
) -> tuple[Spots, Complex]:
    """Lattice grown from `seeds` with a row along each seed's direction, until the region is full.

    Returns the bubbles' places and row directions (unit, in their triangles' frames), seeds first, generation
    after generation. Ends early when there are more than `most`. With a `field` of sixth powers of directions
    in the triangles' frames, (R,), the rows follow it wherever it is not 0.
    """
    return drive(growing_steps(charts, pitch, seeds, directions, most, field))


def growing_steps(
    charts: Charts,
    pitch: Lengths,
    seeds: Spots,
    directions: Complex,
    most: int,
    field: Complex | None = None,
    wanted: Callable[[Spots], Bools] | None = None,
    bending: bool = False,
) -> Steps[tuple[Spots, Complex]]:
    """Like grow, with a pause after every few generations, in which the bubbles can be looked at; over the
    places that are `wanted`, or everywhere; `bending` the rows as a graded pitch wants them.
    """
    crowded = CROWDED if field is None else CROWDED_CLOSED
    crowd = _Crowd(charts, float(pitch(seeds).max()), crowded)
    spots, heading = seeds, directions
    crowd.add(seeds)
    front, front_heading = seeds, directions
    generations = [(seeds, directions)]
    total = len(seeds.row)
    full = charts.region.area / float(pitch(seeds).mean()) ** 2
    while len(front.row) and total <= most:
        if len(generations) % RECENT == 0:
            born = [spots for spots, _ in generations]
            yield Progress(
                "Growing the lattice", total / (total + full), partial(_grown, charts, pitch, born)
            )
        proposals, turned, beyond = _proposals(charts, pitch, crowd, front, front_heading, bending)
        front, front_heading = _agreed(charts, pitch, crowd, proposals, turned, beyond)
        if wanted is not None:
            here = wanted(front)
            front, front_heading = front.take(here), front_heading[here]
        if field is not None:
            front_heading = _following(front_heading, field[front.row])
        crowd.add(front)
        generations.append((front, front_heading))
        total += len(front.row)
    spots = Spots(
        *(np.concatenate(parts) for parts in zip(*(spots for spots, _ in generations), strict=True))
    )
    heading = np.concatenate([heading for _, heading in generations])
    return spots, heading


def _grown(charts: Charts, pitch: Lengths, generations: list[Spots]) -> Snapshot:
    """The bubbles born so far."""
    spots = joined(*generations)
    return Snapshot(positions(charts, spots), charts.region.normals[spots.row], pitch(spots))


def _following(heading: Complex, six: Complex) -> Complex:
    """The headings turned, by less than a twelfth, to where the sixth power is `six`; left where it is 0."""
    return product(heading, np.exp(1j * np.where(six != 0, np.angle(six / heading**6), 0.0) / 6))


class _Crowd:
    """Bubbles born so far, to be asked who is near: it keeps search trees from one question to the next."""

    def __init__(self, charts: Charts, reach: float, crowded: float) -> None:
        self.charts, self.reach, self.crowded = charts, reach, crowded
        self.old: list[Floats] = []
        self.old_tree: cKDTree | None = None
        self.recent: list[Floats] = []
        self.recent_tree: cKDTree | None = None

    def where(self, spots: Spots) -> Floats:
        """Coordinates in which bubbles on facing sheets are far apart, the points first."""
        return signature(self.charts.region, positions(self.charts, spots), spots.row, self.reach)

    def add(self, spots: Spots) -> None:
        """Count the bubbles at `spots` among those born."""
        if not len(spots.row):
            return
        self.recent.append(self.where(spots))
        if len(self.recent) > RECENT and sum(map(len, self.recent)) > 0.3 * sum(map(len, self.old)):
            self.old = [np.concatenate([*self.old, *self.recent[:-RECENT]])]
            self.old_tree = cKDTree(self.old[0], balanced_tree=False, compact_nodes=False)
            self.recent = self.recent[-RECENT:]
        self.recent_tree = cKDTree(np.concatenate(self.recent), balanced_tree=False, compact_nodes=False)

    def distance(self, at: Floats, within: float) -> Floats:
        """Distance from each of `at`, as of `where`, to the nearest bubble; infinite beyond `within`."""
        trees = [tree for tree in (self.old_tree, self.recent_tree) if tree is not None]
        found = [tree.query(at, distance_upper_bound=within)[0] for tree in trees]
        return np.min(found, axis=0)


def _proposals(
    charts: Charts, pitch: Lengths, crowd: _Crowd, front: Spots, heading: Complex, bending: bool
) -> tuple[Spots, Complex, Complex]:
    """Places one pitch from the front's bubbles where no bubble is yet, with the row directions carried
    there, and the steps from there, each in its triangle's frame, to what the stable distance is.
    """
    parent = np.repeat(np.arange(len(front.row)), 6)
    start = front.take(parent)
    way = product(heading[parent], np.tile(SIX, len(front.row)))
    local = pitch(front)
    length = local[parent]
    bend = np.ones(len(way), dtype=np.complex128)
    if bending:
        bend = half_bend(way, _slope(charts, pitch, front, local)[parent])
        way = product(way, bend)
    # A straight look ahead spares walking to places that are taken.
    ahead = crowd.where(start)
    ahead[:, :3] += to_space(charts, start.row, way * length)
    free = crowd.distance(ahead, 0.6 * length.max()) > 0.6 * length
    start, way, length, bend = start.take(free), way[free], length[free], bend[free]
    walked = walk(charts, start, way * length, carried=way, stopping=False)
    inside = walked.left == 0
    arrived, carried, bend = walked.arrived.take(inside), walked.carried[inside], bend[inside]
    # The stable distance is the mean of both pitches: on, or back, by half of what they differ.
    lacking = carried * (pitch(arrived) - length[inside]) / 2
    if charts.region.flat or np.all(np.abs(lacking) < 1e-9 * length.max(initial=1.0)):
        return arrived, product(carried, bend), lacking
    again = walk(charts, arrived, lacking, carried=carried, stopping=False)
    inside = again.left == 0
    return (
        again.arrived.take(inside),
        product(again.carried, bend)[inside],
        np.zeros(int(inside.sum()), np.complex128),
    )


def half_bend(way: Complex, slope: Complex) -> Complex:
    """Half the unit turns (n,) of a row of the lattice over steps of one pitch along `way` (n,), where the
    pitch has the `slope` (n,), as far as the lattice follows that.

    A row is straight where lengths are counted in pitches h: a geodesic of the metric 1/h^2, which turns by
    -(dh/dn)/h per length away from the side n where the pitch is larger. Rows that were straight in space
    would have to end one after the other: a dislocation for every unit that the pitch grows by per bubble.
    """
    across = way.real * slope.imag - way.imag * slope.real
    return np.exp(-0.5j * BENT * np.clip(across, -STEEPEST, STEEPEST))


def _slope(charts: Charts, pitch: Lengths, spots: Spots, local: Floats) -> Complex:
    """Slope (n,) of the pitch at the places, where it is `local` (n,), in their triangles' frames."""
    step = 1e-4 * local
    gradients = charts.gradients[spots.row] * step[:, None]
    slope = np.empty(len(local), dtype=np.complex128)
    slope.real = (pitch(Spots(spots.row, spots.barycentric + gradients.real)) - local) / step
    slope.imag = (pitch(Spots(spots.row, spots.barycentric + gradients.imag)) - local) / step
    return slope


def _agreed(
    charts: Charts, pitch: Lengths, crowd: _Crowd, proposals: Spots, heading: Complex, beyond: Complex
) -> tuple[Spots, Complex]:
    """One bubble for each group of proposals that mean the same place, where it crowds nobody.

    beyond: (n,) steps from the proposals to the places that they mean
    """
    if not len(proposals.row):
        return proposals, heading
    local = pitch(proposals)
    at = crowd.where(proposals)
    from_here = at[:, :3].copy()
    at[:, :3] += to_space(charts, proposals.row, beyond)
    free = crowd.distance(at, crowd.crowded * local.max()) > crowd.crowded * local
    proposals, heading, local, at = proposals.take(free), heading[free], local[free], at[free]
    from_here = from_here[free]
    if not len(local):
        return proposals, heading
    pairs = close_pairs(at, SAME * local)
    links = coo_matrix((np.ones(len(pairs)), pairs.T), shape=(len(local),) * 2)
    groups, group = connected_components(links, directed=False)
    first = np.full(groups, len(local))
    np.minimum.at(first, group, np.arange(len(local)))
    votes = np.bincount(group, minlength=groups)
    mean = np.stack([np.bincount(group, at[:, axis], groups) for axis in range(3)], axis=1) / votes[:, None]
    leader = proposals.take(first)
    steps = to_frame(charts, leader.row, mean - from_here[first])
    moved = walk(charts, leader, steps, carried=heading[first], stopping=False)
    turned = to_frame(charts, leader.row[group], to_space(charts, proposals.row, heading))
    # Directions a sixth of a turn apart mean the same lattice.
    six = (turned / np.maximum(np.abs(turned), 1e-300)) ** 6
    mean_six = np.bincount(group, six.real, groups) + 1j * np.bincount(group, six.imag, groups)
    own = heading[first] ** 6
    correction = np.exp(1j * np.angle(mean_six / own) / 6)
    pairs = close_pairs(crowd.where(moved.arrived), crowd.crowded * local[first])
    kept = uncrowded(pairs, np.lexsort((np.arange(groups), -votes)).argsort()) & (moved.left == 0)
    return moved.arrived.take(kept), product(moved.carried, correction)[kept]
