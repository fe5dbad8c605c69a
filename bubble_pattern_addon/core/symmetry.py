"""Whether a target region is symmetric, and its packing metric with it; and how far off they are."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from .boundary import Boundary, nearest_boundary
from .cycles import members
from .isometries import AUTO, OFF, Isometries, image_of, isometries, words_of
from .mesh import Floats, Ints
from .region import Region
from .surface import Charts, Spots, positions, to_frame, walk
from .vectors import dots

Lengths = Callable[[Spots], Floats]

# A region is symmetric when no mirrored place of it is farther from the region than this, in pitches.
TOLERANCE = 0.02
# A metric is symmetric when its values at mirrored places differ by less than this share.
METRIC_TOLERANCE = 0.01
# A place that is this share of it from a point is near enough to tell.
NEAR_ENOUGH = 0.1
# About so many places of the region are mirrored to find out.
SAMPLES = 3000
# So few show that most other symmetries are out of the question.
FEW = 40
# Triangles that face away from each other by more than this cosine are not each other's images.
SAME_FACING = 0.5
# A place is sought from so many samples, and from each in so many walks.
STARTS, WALKS = 4, 8


@dataclass(frozen=True)
class Finder:
    """Samples all over a region, from which the place nearest to a point is found.

    spots: the samples; tree: of their positions and, over the length `reach`, their normals
    """

    charts: Charts
    spots: Spots
    tree: cKDTree
    reach: float


@dataclass(frozen=True)
class Symmetry:
    """A symmetry that a region has.

    group: its isometries; finder: for places on the region; off: the farthest that a mirrored place of the
    region is from the region, a length
    """

    group: Isometries
    finder: Finder
    off: float


@dataclass(frozen=True)
class Finding:
    """What a search for symmetry has found: the symmetry, or None, and what a designer should know of it."""

    symmetry: Symmetry | None = None
    notes: tuple[str, ...] = ()


def make_finder(charts: Charts, reach: float) -> Finder:
    """Samples of a region; sheets that face each other nearer than `reach` are told apart."""
    corners = charts.region.corners
    sides = np.linalg.norm(np.roll(corners, -2, axis=1) - np.roll(corners, -1, axis=1), axis=2)
    spacing = np.sqrt(charts.region.area / SAMPLES)
    number = np.clip(np.ceil(sides.max(axis=1) / spacing), 1, 100).astype(np.int64)
    owner, place = members(number)
    share = (place + 0.5) / number[owner]
    # Along the line from the middle of the shortest side to the corner opposite to it.
    bary = np.repeat((1 - share)[:, None] / 2, 3, axis=1)
    bary[np.arange(len(owner)), sides.argmin(axis=1)[owner]] = share
    spots = Spots(owner, bary)
    where = np.concatenate([positions(charts, spots), reach * charts.region.normals[owner]], axis=1)
    return Finder(charts, spots, cKDTree(where, balanced_tree=False, compact_nodes=False), reach)


def places_near(finder: Finder, points: Floats, normals: Floats, within: Floats) -> tuple[Spots, Floats]:
    """Places on the region nearest to `points` (n, 3) where it faces as `normals` (n, 3) do, and how far they
    are from the points, (n,).

    Points nearer to a place than `within` (n,) are sought no further.
    """
    charts = finder.charts
    row, bary = np.zeros(len(points), dtype=np.int64), np.tile([1.0, 0.0, 0.0], (len(points), 1))
    off = np.full(len(points), np.inf)
    count = min(STARTS, len(finder.spots.row))
    for start in range(count):
        lost = np.flatnonzero(off > within)
        if not len(lost):
            break
        where = np.concatenate([points[lost], finder.reach * normals[lost]], axis=1)
        # Few need more than the nearest sample.
        near = finder.tree.query(where, k=[start + 1])[1][:, 0]
        spots = _walked_to(charts, finder.spots.take(near), points[lost])
        away = np.linalg.norm(positions(charts, spots) - points[lost], axis=1)
        better = away < off[lost]
        found = lost[better]
        row[found], bary[found], off[found] = spots.row[better], spots.barycentric[better], away[better]
    return Spots(row, bary), off


def rows_near(finder: Finder, points: Floats, normals: Floats) -> Ints:
    """Triangles (n,) near to `points` (n, 3) that face as `normals` (n, 3) do, to tell sheets apart."""
    if finder.charts.region.single_sheet:
        return np.zeros(len(points), dtype=np.int64)
    return finder.spots.row[finder.tree.query(np.concatenate([points, finder.reach * normals], axis=1))[1]]


def _walked_to(charts: Charts, spots: Spots, points: Floats) -> Spots:
    """Where walks towards `points` (n, 3), each in the plane of the triangle it stands on, come to rest."""
    least = 1e-15 * charts.region.extent
    going = np.arange(len(points))
    row, bary = spots.row.copy(), spots.barycentric.copy()
    for _ in range(WALKS):
        here = Spots(row[going], bary[going])
        steps = to_frame(charts, here.row, points[going] - positions(charts, here))
        far = np.abs(steps) > least
        going = going[far]
        if not len(going):
            break
        row[going], bary[going] = walk(charts, here.take(far), steps[far]).arrived
    return Spots(row, bary)


def find_symmetry(
    charts: Charts,
    boundary: Boundary | None,
    pitch: Lengths,
    word: str,
    centre: Sequence[float] | None,
    axes: Sequence[Sequence[float]] = (),
) -> Finding:
    """The symmetry that a recipe's `word` asks for, where region and metric have it.

    centre: a point of all planes or of the axis; None for the middle of the region's area; axes: (3, 3) what
    the word calls x, y and z, none for the axes themselves
    """
    if word == OFF:
        return Finding()
    region = charts.region
    rows = np.arange(len(region.triangles))
    local = float(pitch(Spots(rows, np.full((len(rows), 3), 1 / 3))).mean())
    finder = make_finder(charts, local)
    middle = _middle(charts, TOLERANCE * local) if centre is None else np.array(centre, dtype=np.float64)
    best: tuple[float, Isometries] | None = None
    given = np.array(axes) if len(axes) else None
    groups = [isometries(spelled, middle, given) for spelled in words_of(word)]
    for group in _likely(region, groups, TOLERANCE * local):
        off = max(_off(finder, boundary, group, int(number), FEW) for number in group.generators)
        if off < TOLERANCE * local:
            off = max(_off(finder, boundary, group, int(number)) for number in group.generators)
        if off < TOLERANCE * local:
            uneven = max(_metric_off(finder, pitch, group, int(number)) for number in group.generators)
            if uneven < METRIC_TOLERANCE:
                return Finding(Symmetry(group, finder, off), _found(group, word))
            if word != AUTO:
                return Finding(None, (_uneven(group, uneven),))
        if best is None or off < best[0]:
            best = off, group
    assert best is not None
    # Where nobody has asked for this one, a few places show well enough how far off it is.
    most = FEW if word == AUTO else SAMPLES
    off = max(_off(finder, boundary, best[1], int(number), most) for number in best[1].generators)
    return Finding(None, (_none(word, best[1], off, local),))


def _likely(region: Region, groups: list[Isometries], near: float) -> list[Isometries]:
    """Those of the groups under which the region's second moments of area stay what they are, as far as they
    must where no image of a place is farther off than `near`; the nearest one where none is likely.

    It takes no time and spares a search over the surface for most symmetries that are out of the question.
    """
    corners, area = region.corners, np.linalg.norm(region.area_vectors, axis=1) / 2
    changed, most = np.empty(len(groups)), np.empty(len(groups))
    for number, group in enumerate(groups):
        offset = corners - group.centre
        whole = offset.sum(axis=1)
        # A triangle's second moments: area / 12 times those of its corners and of their sum.
        moments = np.einsum("r,rka,rkb->ab", area / 12, offset, offset)
        moments += np.einsum("r,ra,rb->ab", area / 12, whole, whole)
        reach = float(np.linalg.norm(offset, axis=2).max())
        most[number] = 2 * near * (region.perimeter * reach**2 + 2 * region.area * reach)
        turned = group.turns @ moments @ group.turns.swapaxes(1, 2)
        changed[number] = np.abs(turned - moments).max()
    if (changed <= most).any():
        return [group for group, is_likely in zip(groups, changed <= most, strict=True) if is_likely]
    return [groups[int((changed / most).argmin())]]


def _middle(charts: Charts, near: float) -> Floats:
    """Middle of the region's area, (3,), on the base's own planes where it is that `near` to them."""
    area = np.linalg.norm(charts.region.area_vectors, axis=1)
    middle = area @ charts.region.corners.mean(axis=1) / area.sum()
    return np.where(np.abs(middle) < near, 0.0, middle)


def _off(
    finder: Finder, boundary: Boundary | None, group: Isometries, number: int, most: int = SAMPLES
) -> float:
    """The farthest, a length, that an image of a place is from the region, or one of its boundary from the
    boundary, as about `most` of either show.
    """
    region = finder.charts.region
    # A region in a plane is what its boundary says; a few places show that the plane is the right one.
    number_of_places = FEW if region.flat and boundary is not None else most
    spots = finder.spots.take(
        np.arange(0, len(finder.spots.row), len(finder.spots.row) // number_of_places + 1)
    )
    image, place, off = _mirrored(finder, group, number, positions(finder.charts, spots), spots.row)
    if boundary is not None:
        # A walk that the boundary stops need not end at the nearest place; for what is outside that is on it.
        off = np.minimum(off, nearest_boundary(boundary, image, place.row)[0])
    facing = region.normals[spots.row] @ group.turns[number].T
    facing = dots(facing, region.normals[place.row])
    worst = float(np.where(facing > SAME_FACING, off, region.extent).max())
    if boundary is None:
        return worst
    ends, row = region.boundary_segments, region.rim[:, 0]
    points, row = np.concatenate([ends[:, 0], ends.mean(axis=1)]), np.tile(row, 2)
    some = slice(None, None, len(points) // most + 1)
    image = image_of(group, np.full(len(points[some]), number), points[some])
    there = rows_near(finder, image, region.normals[row[some]] @ group.turns[number].T)
    distance, _ = nearest_boundary(boundary, image, there)
    return max(worst, float(distance.max()))


def _mirrored(
    finder: Finder, group: Isometries, number: int, points: Floats, row: Ints
) -> tuple[Floats, Spots, Floats]:
    """Images (n, 3) of points on the triangles `row` (n,), the places nearest to them, and how far these
    are, (n,).
    """
    image = image_of(group, np.full(len(points), number), points)
    normals = finder.charts.region.normals[row] @ group.turns[number].T
    within = np.full(len(points), NEAR_ENOUGH * TOLERANCE * finder.reach)
    place, off = places_near(finder, image, normals, within)
    return image, place, off


def _metric_off(finder: Finder, pitch: Lengths, group: Isometries, number: int) -> float:
    """The largest share by which the metric at a place and at its image differ."""
    spots = finder.spots
    here = pitch(spots)
    if np.ptp(here) == 0:
        return 0.0
    _, place, _ = _mirrored(finder, group, number, positions(finder.charts, spots), spots.row)
    return float(np.abs(pitch(place) / here - 1).max())


def _where(group: Isometries) -> str:
    x, y, z = group.centre
    return f'"{group.word}" about {x:.4g}, {y:.4g}, {z:.4g}'


def _found(group: Isometries, word: str) -> tuple[str, ...]:
    return (f"Symmetry found: {_where(group)}.",) if word == AUTO else ()


def _uneven(group: Isometries, share: float) -> str:
    return (
        f"The pitch is not symmetric under {_where(group)}: {group.needs}, it differs by {100 * share:.3g} "
        "%; packed without symmetry: give a pitch that is, or another symmetry."
    )


def _none(word: str, group: Isometries, off: float, pitch: float) -> str:
    far = f"{off:.4g} ({off / pitch:.2g} pitches)"
    if word == AUTO:
        return f"No symmetry found; the nearest is {_where(group)}, which is off by {far}."
    return (
        f"The target region is not symmetric under {_where(group)}: {group.needs}, it is off by {far}; "
        "packed without symmetry: mend the region, or give another symmetry or symmetry_centre."
    )
