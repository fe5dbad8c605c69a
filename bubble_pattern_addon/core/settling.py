"""Hand work: bubbles that the designer has moved, added or deleted, and the others settled round them.

Pinned bubbles stay exactly where they are, and so does the first row along the boundary, but for those of it
that were moved by hand. All others relax as in packing. None is removed; new ones come into voids only on
demand, so that a deleted feature stays deleted and its neighbours close the gap.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial import cKDTree

from .boundary import nearest_boundary, signature
from .isometries import OFF
from .mesh import Bools, Floats, Ints
from .packing.bubbles import Bubbles, Ground, joined
from .packing.crowding import close_pairs, uncrowded
from .packing.force import STIFFNESS, stiff_law
from .packing.pack import NOT_SYMMETRIC, ROUNDS, STIFF_STEPS, filling, ground_of
from .packing.pins import check_apart, on_surface
from .packing.population import voids_among
from .packing.relax import relax
from .pattern import Pattern, all_bubbles
from .pipeline import bound_packing, laid
from .progress import Progress, Steps
from .recipe import Recipe
from .region import Region
from .surface import Spots, on_region, positions, to_frame, walk
from .surroundings import NOTHING, Surroundings

# Bubbles whose distance to the boundary is at most so many of the first row's are of it.
FIRST_ROW = 1.15
# Those that stand nearer to the boundary than that are moved back to it, in so many rounds, to within this
# share.
INWARD, CLOSE_ENOUGH = 6, 1e-4
# Bubbles nearer than this, in pitches, stand on one another: one goes aside by so much, each in a direction
# of its own.
ON_TOP, ASIDE, GOLDEN = 0.05, 0.1, 2.399963
# A deleted bubble's room goes to those round it, most of it within so many pitches; a lattice that closes a
# gap has to be pushed this much harder than the room alone would.
AROUND, PUSH = 2.5, 2.0
# No bubble becomes larger than so many pitches, however many are deleted.
MOST_STRETCH = 1.15
# Gaps are evened out in so many rounds at most, until no bubble moves by more pitches in one. A crowd that
# moves no more from the outset is in balance already: who settles twice must not see the pattern wander.
EVENING, AT_REST = 12, 0.02
# Where no bubble is within so many pitches of the first row's track, it lacks one.
LACKING = 0.8


@dataclass(frozen=True)
class HandWork:
    """The bubbles of a pattern after hand work, n of them.

    position: (n, 3) where they are; bubble: (n,) which of the pattern's each is, by id, or -1 for those that
    were added; moved: (n,) which have been moved, whatever their position says; pinned: (n,) which stay;
    gone: (m, 3) where those were that have been deleted
    """

    position: Floats
    bubble: Ints
    moved: Bools
    pinned: Bools
    gone: Floats


def settle_steps(
    before: Pattern,
    hand: HandWork,
    region: Region,
    recipe: Recipe,
    surroundings: Surroundings = NOTHING,
    fill_voids: bool = False,
) -> Steps[tuple[Pattern, Floats]]:
    """The pattern `before` with its bubbles as `hand` has them, settled and shaped as `recipe` says;
    and where the pinned ones are now, (p, 3).

    Bubbles keep their ids, also the pattern's that are there no longer keep theirs; added ones get new ones.

    Raises RegionError where bubbles are off the region or two pinned ones too near to one another, and what
    shaping raises.
    """
    yield Progress("Reading the region", 0.0)
    ground = ground_of(region, bound_packing(region, recipe, surroundings))
    notes = () if recipe.packing.symmetry == OFF else (NOT_SYMMETRIC,)
    ground = replace(ground, notes=notes)
    whole = all_bubbles(before)
    crowd = _taken_up(ground, whole, hand)
    check_apart(ground.charts, crowd.spots.take(hand.pinned), ground.pitch(crowd.spots)[hand.pinned])
    stay, gaps = positions(ground.charts, crowd.spots.take(hand.pinned)), hand.gone
    if fill_voids:
        crowd, gaps = _with_whole_row(ground, crowd), gaps[:0]
    crowd = replace(crowd, spots=_inside(ground, _parted(ground, crowd), crowd.free))
    crowd = yield from _relaxed(ground, crowd, recipe, gaps, fill_voids)
    crowd = _taken(crowd, np.argsort(crowd.ids))
    yield Progress("Shaping the features", 0.95)
    bubbles, first = Bubbles(crowd.spots), crowd.first | _beside_boundary(ground, crowd.spots)
    pattern = laid(ground, bubbles, first, recipe, surroundings, crowd.ids, crowd.stretch)
    return pattern, stay


@dataclass(frozen=True)
class _Crowd:
    """Bubbles that are being settled: ids (n,), places; which are of the first row and stay there, and which
    may move, both (n,); stretch: (n,) how much larger they are than the packing metric, for room that others
    have left
    """

    ids: Ints
    spots: Spots
    first: Bools
    free: Bools
    stretch: Floats


def _taken(crowd: _Crowd, which: Ints) -> _Crowd:
    """The bubbles in the order `which` (n,)."""
    return _Crowd(
        crowd.ids[which],
        crowd.spots.take(which),
        crowd.first[which],
        crowd.free[which],
        crowd.stretch[which],
    )


def _grown(crowd: _Crowd, spots: Spots, first: bool) -> _Crowd:
    """The crowd with new bubbles at these places, of the first row or free."""
    k = len(spots.row)
    return _Crowd(
        np.concatenate([crowd.ids, 1 + crowd.ids.max(initial=-1) + np.arange(k, dtype=np.int64)]),
        joined(crowd.spots, spots),
        np.concatenate([crowd.first, np.full(k, first)]),
        np.concatenate([crowd.free, np.full(k, not first)]),
        np.concatenate([crowd.stretch, np.ones(k)]),
    )


def _taken_up(ground: Ground, whole: Pattern, hand: HandWork) -> _Crowd:
    """The bubbles as hand work has left them. RegionError where some are off the region."""
    known, n = hand.bubble >= 0, len(hand.bubble)
    row = np.zeros(n, dtype=np.int64)
    row[known] = np.searchsorted(whole.ids, hand.bubble[known])
    still = known & ~hand.moved
    before = on_region(ground.charts.region, whole.places)
    spots = Spots(np.zeros(n, dtype=np.int64), np.zeros((n, 3)))
    spots.row[still], spots.barycentric[still] = before.take(row[still])
    put = on_surface(ground.charts, hand.position[~still], ground.pitch, "feature")
    spots.row[~still], spots.barycentric[~still] = put
    start = 1 + int(whole.ids.max(initial=-1))
    ids = np.where(known, hand.bubble, start + np.cumsum(~known) - 1)
    first = still.copy()
    first[still] = whole.row[row[still]] == 0
    larger = np.clip(whole.pitch / ground.pitch(before), 1.0, MOST_STRETCH)
    stretch = np.ones(n)
    stretch[known] = larger[row[known]]
    return _Crowd(ids, spots, first, ~(first | hand.pinned), stretch)


def _parted(ground: Ground, crowd: _Crowd) -> Spots:
    """The places, where a free bubble that stands on another, as copies do, has gone a step aside."""
    charts, spots, free = ground.charts, crowd.spots, crowd.free
    local, points = ground.pitch(spots), positions(charts, spots)
    pairs = close_pairs(
        signature(charts.region, points, spots.row, float(local.max(initial=0.0))), ON_TOP * local
    )
    # of two that may move the later one, else the one that may
    one, other = np.sort(pairs, axis=1).T
    aside = np.unique(np.where(free[other], other, one))
    aside = aside[free[aside]]
    if not len(aside):
        return spots
    step = ASIDE * local[aside] * np.exp(1j * GOLDEN * np.arange(len(aside)))
    return _moved(spots, aside, walk(charts, spots.take(aside), step).arrived)


def _moved(spots: Spots, which: Ints, there: Spots) -> Spots:
    row, bary = spots.row.copy(), spots.barycentric.copy()
    row[which], bary[which] = there
    return Spots(row, bary)


def _inside(ground: Ground, spots: Spots, free: Bools) -> Spots:
    """The places, where the `free` (n,) bubbles that are nearer to the boundary than the first row have gone
    back to it.
    """
    if ground.boundary is None:
        return spots
    charts = ground.charts
    for _ in range(INWARD):
        points = positions(charts, spots)
        distance, foot = nearest_boundary(ground.boundary, points, spots.row)
        radius = ground.pitch(spots) / 2 + ground.edge_offset
        near = np.flatnonzero(free & (distance < radius * (1 - CLOSE_ENOUGH)))
        if not len(near):
            break
        here = spots.take(near)
        away = to_frame(charts, here.row, points[near] - foot[near])
        # on the boundary itself, into the triangle
        middle = to_frame(charts, here.row, charts.region.corners[here.row].mean(axis=1) - points[near])
        away = np.where(np.abs(away) > 1e-9 * radius[near], away, middle)
        step = away / np.abs(away) * (radius - distance)[near]
        spots = _moved(spots, near, walk(charts, here, step).arrived)
    return spots


def _with_whole_row(ground: Ground, crowd: _Crowd) -> _Crowd:
    """The crowd at its natural size, with new bubbles on the first row's track where that has a gap."""
    crowd = replace(crowd, stretch=np.ones(len(crowd.ids)))
    charts, track, spots = ground.charts, ground.track, crowd.spots
    if not len(track.arc) or not len(spots.row):
        return crowd
    local = ground.pitch(track.spots)
    reach = float(local.max())
    where = signature(charts.region, track.points, track.spots.row, reach)
    tree = cKDTree(signature(charts.region, positions(charts, spots), spots.row, reach))
    distance = tree.query(where)[0] / local
    wide = np.flatnonzero(distance > LACKING)
    if not len(wide):
        return crowd
    rank = np.lexsort((wide, -distance[wide])).argsort()
    chosen = uncrowded(close_pairs(where[wide], LACKING * local[wide]), rank)
    return _grown(crowd, track.spots.take(wide[chosen]), True)


def _relaxed(ground: Ground, crowd: _Crowd, recipe: Recipe, gaps: Floats, fill_voids: bool) -> Steps[_Crowd]:
    """The crowd in balance, spread over the `gaps` (m, 3), or with new bubbles in the voids if these shall be
    filled.
    """
    packing = recipe.packing
    crowd = _taken(crowd, np.argsort(crowd.free, kind="stable"))
    fixed = int((~crowd.free).sum())
    if not fill_voids and not len(gaps):
        evened, moved = _evened(ground, crowd, fixed, gaps, packing.tolerance)
        if moved <= AT_REST:
            return evened
    for number in range(len(ROUNDS)):
        yield Progress("Settling the bubbles", 0.2 + 0.2 * number)
        size, _ = _sizes(ground, crowd, gaps)
        bubbles, _ = relax(ground, Bubbles(crowd.spots, fixed), size, packing.iterations, packing.tolerance)
        crowd = replace(crowd, spots=_inside(ground, bubbles.spots, crowd.free))
        if fill_voids:
            voids = voids_among(ground, crowd.spots, ground.pitch(crowd.spots))
            crowd = _grown(crowd, voids, False)
    for number in range(EVENING):
        yield Progress("Evening out the gaps", 0.8 + 0.15 * number / EVENING)
        crowd, moved = _evened(ground, crowd, fixed, gaps, packing.tolerance)
        if moved <= AT_REST:
            break
    _, room = _sizes(ground, crowd, gaps)
    return replace(crowd, stretch=np.minimum(crowd.stretch * room, MOST_STRETCH))


def _evened(
    ground: Ground, crowd: _Crowd, fixed: int, gaps: Floats, tolerance: float
) -> tuple[_Crowd, float]:
    """The crowd, its first `fixed` in place, after a round of the stiff law; and by how many of its pitches
    the bubble moved that moved most.
    """
    size, _ = _sizes(ground, crowd, gaps)
    bubbles, stiffness = Bubbles(crowd.spots, fixed), 1.0 + STIFFNESS
    bubbles, _ = relax(ground, bubbles, size, STIFF_STEPS, tolerance, stiff_law, stiffness)
    spots = _inside(ground, bubbles.spots, crowd.free)
    step = positions(ground.charts, spots) - positions(ground.charts, crowd.spots)
    moved = np.linalg.norm(step, axis=1) / size
    return replace(crowd, spots=spots), float(moved.max(initial=0.0))


def _sizes(ground: Ground, crowd: _Crowd, gaps: Floats) -> tuple[Floats, Floats]:
    """The bubbles' sizes, (n,), and by what these are larger for the room left at the `gaps` (m, 3)."""
    local, points = ground.pitch(crowd.spots), positions(ground.charts, crowd.spots)
    room = np.zeros(len(local))
    for gap in gaps:
        weight = np.exp(-(((points - gap) / (AROUND * local[:, None])) ** 2).sum(axis=1))
        room += weight / max(weight.sum(), 1.0)
    larger = np.sqrt(1 + PUSH * room)
    size = filling(ground, Bubbles(crowd.spots), local) * crowd.stretch * larger
    return np.minimum(size, MOST_STRETCH * local), larger


def _beside_boundary(ground: Ground, spots: Spots) -> Bools:
    """Which places, (n,), are as near to the boundary as the first row is."""
    if ground.boundary is None:
        return np.zeros(len(spots.row), dtype=bool)
    distance, _ = nearest_boundary(ground.boundary, positions(ground.charts, spots), spots.row)
    return np.asarray(distance < FIRST_ROW * (ground.pitch(spots) / 2 + ground.edge_offset))
