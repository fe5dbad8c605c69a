"""Population control between rounds of relaxation: bubbles that are too crowded go, voids are filled."""

from __future__ import annotations

import numpy as np
from scipy.sparse import csr_array
from scipy.spatial import cKDTree

from ..boundary import nearest_boundary, signature
from ..cycles import members
from ..mesh import Bools, Floats, Ints
from ..surface import Charts, Spots, positions, to_frame, walk
from ..vectors import dots
from .bubbles import Bubbles, Ground, joined
from .crowding import close_pairs, uncrowded
from .domain import led_here
from .force import Pairs, find_pairs, within_reach
from .orbits import HALO, SEEN, followers_of, leaders_of, on_their_planes, ranked, settled_leaders

# A circle through three bubbles with no other inside is a void when its radius is above this share of the
# pitch (it is 0.577 in the hexagonal arrangement, 0.707 in the square one).
VOID = 0.8
# Larger voids than WIDE take more than one bubble: they are filled from their edges inward, in so many rows
# at most, with bubbles that stand beside two neighbours no farther apart than BESIDE, in stable distances,
# where nobody is nearer than FREE. Three bubbles on a larger circle than WIDEST are rather in a row.
WIDE, WIDEST = 1.3, 6.0
MOST_ROWS, BESIDE, FREE = 12, 1.4, 0.88
# Free bubbles nearer to the boundary than this many radii have been pressed through the first row.
PRESSED_OUT = 2.2
# A bubble whose overlap ratio is above this is too crowded; it is 6 in the hexagonal arrangement.
# Where the pitch is graded, rows of fewer bubbles follow rows of more: whoever is left over goes earlier.
CROWDED, CROWDED_GRADED = 6.8, 6.4
# Only bubbles with less overlap than this can stand at a void.
LONELY = 5.6
# At the end voids of a radius above this share of the pitch are filled.
LAST_VOID = 0.9


def overlap_ratio(pairs: Pairs, distance: Floats, pitch: Floats) -> Floats:
    """Overlap ratio of every bubble, (n,): (2/D_i) sum_j (D_i + D_j/2 - d_ij) over the bubbles j in reach.

    (Shimada and Gossard, "Bubble Mesh", 1995.) 6 in the interior of a hexagonal arrangement.
    """
    ratio = np.zeros(len(pitch))
    for own, other in ((pairs.first, pairs.second), (pairs.second, pairs.first)):
        overlap = np.maximum(pitch[own] + pitch[other] / 2 - distance, 0) * 2 / pitch[own]
        ratio += np.bincount(own, overlap, len(pitch))
    return ratio


def control(
    ground: Ground,
    bubbles: Bubbles,
    pitch: Floats,
    last: bool = False,
    filling: bool = True,
    among: Bools | None = None,
    near: Pairs | None = None,
) -> tuple[Bubbles, int]:
    """Bubbles without the too crowded ones and with new ones in the voids; and how many came or went.

    In a symmetric pattern these are the leaders, and whoever comes or goes does so with its followers. At
    the `last` only those that are pressed out go, and only voids that another bubble fits into are filled,
    if there is to be any `filling`; only between bubbles `among` (n,) of these, if that is given.
    The pairs that are close enough are among those `near`, if these are known.
    """
    spots, n, m = bubbles.spots, len(bubbles), bubbles.fixed
    points, row, owner = positions(ground.charts, spots), spots.row, np.arange(n)
    if ground.symmetry is not None:
        followers = followers_of(ground, spots, pitch, HALO)
        points, row = np.concatenate([points, followers.points]), np.concatenate([row, followers.row])
        owner = np.concatenate([owner, followers.leader])
    everywhere = pitch[owner]
    if near is None:
        pairs = find_pairs(ground.charts, points, row, everywhere, 0.0)
    else:
        pairs = within_reach(near, points, 0.0)
    distance = np.linalg.norm(points[pairs.first] - points[pairs.second], axis=1)
    ratio = overlap_ratio(pairs, distance, everywhere)
    gone = _pressed_out(ground, bubbles, pitch, pairs)
    if not last:
        most = CROWDED if ground.uniform is not None else CROWDED_GRADED
        gone[m:] |= _too_crowded(pairs, distance / pairs.stable, ratio[:n], owner, m, most)
    lonely, least = np.flatnonzero(ratio < LONELY), LAST_VOID if last else VOID
    lonely = lonely[led_here(ground, points[lonely], everywhere[lonely], SEEN)] if filling else lonely[:0]
    lonely = lonely if among is None else lonely[among[owner[lonely]]]
    added = _voids(ground, points, row, everywhere, lonely, pairs, least)
    if not gone.any() and not len(added.row):
        return bubbles, 0
    if ground.symmetry is None:
        return Bubbles(joined(bubbles.spots.take(~gone), added), m), int(gone.sum()) + len(added.row)
    added = _leading(ground, added, points, row)
    grown = Bubbles(joined(bubbles.spots.take(~gone), added), m)
    return settled_leaders(ground, grown), int(gone.sum()) + len(added.row)


def voids_among(ground: Ground, spots: Spots, pitch: Floats) -> Spots:
    """Places for new bubbles in the voids among those at `spots`, of no symmetric pattern."""
    points, row = positions(ground.charts, spots), spots.row
    pairs = find_pairs(ground.charts, points, row, pitch, 0.0)
    distance = np.linalg.norm(points[pairs.first] - points[pairs.second], axis=1)
    ratio = overlap_ratio(pairs, distance, pitch)
    return _voids(ground, points, row, pitch, np.flatnonzero(ratio < LONELY), pairs, VOID)


def _leading(ground: Ground, added: Spots, points: Floats, row: Ints) -> Spots:
    """Of places for new bubbles in a symmetric pattern those of leaders, moved onto the planes they are
    close to.
    """
    if not len(added.row):
        return added
    before = positions(ground.charts, added)
    added, off = on_their_planes(ground, added, ground.pitch(added))
    at, pitch = positions(ground.charts, added), ground.pitch(added)
    moved = np.linalg.norm(at - before, axis=1) > 1e-9 * pitch
    free = _empty(ground, added, at, points, row, np.where(moved, 0.75, 0.0) * pitch) & (off < 1e-3)
    added = added.take(free)
    return added.take(leaders_of(ground, added, ranked(ground, added, 0)))


def _pressed_out(ground: Ground, bubbles: Bubbles, pitch: Floats, pairs: Pairs) -> Bools:
    """Which bubbles, (n,), are between the first row and the boundary, where some of that row feel them."""
    fixed, n = bubbles.fixed, len(bubbles)
    out = np.zeros(n, dtype=bool)
    if ground.boundary is None:
        return out
    beside = np.concatenate([pairs.first[pairs.second < fixed], pairs.second[pairs.first < fixed]])
    asked = np.unique(beside[(beside >= fixed) & (beside < n)])
    spots = bubbles.spots.take(asked)
    distance, _ = nearest_boundary(ground.boundary, positions(ground.charts, spots), spots.row)
    out[asked] = distance < PRESSED_OUT * pitch[asked] / 2 + ground.edge_offset
    return out


def _too_crowded(pairs: Pairs, relative: Floats, ratio: Floats, owner: Ints, m: int, most: float) -> Bools:
    """Which of the n - m free bubbles have an overlap ratio above `most` while no neighbour has more.

    relative: (p,) the pairs' distances in stable distances; ratio: (n,) overlap of the bubbles; owner: which
    of these each one in the pairs is, or is an image of
    """
    first, second = owner[pairs.first], owner[pairs.second]
    closest = np.full(len(ratio), np.inf)
    np.minimum.at(closest, first, relative)
    np.minimum.at(closest, second, relative)
    crowded = (ratio > most) | (closest < 0.6)
    crowded[:m] = False
    rivals = crowded[first] & crowded[second] & (first != second)
    order = np.lexsort((np.arange(len(ratio)), -ratio)).argsort()
    kept = uncrowded(np.stack([first[rivals], second[rivals]], axis=1), order)
    # Of neighbours that are both crowded only the worst goes: its going relieves the other.
    return (crowded & kept)[m:]


def _voids(
    ground: Ground, points: Floats, row: Ints, pitch: Floats, lonely: Ints, pairs: Pairs, least: float
) -> Spots:
    """Places for new bubbles in the voids round which the `lonely` of the bubbles stand, where the circle
    that fits in has a radius above `least`.
    """
    added, wide = _in_circles(ground, points, row, pitch, lonely, pairs, least)
    return joined(added, _fillings(ground, points, row, pitch, lonely, added)) if wide else added


def _in_circles(
    ground: Ground, points: Floats, row: Ints, pitch: Floats, lonely: Ints, pairs: Pairs, least: float
) -> tuple[Spots, bool]:
    """Places for new bubbles: centres of empty circles of a radius above `least` through three of the
    `lonely` bubbles, as local Delaunay has them; and whether there are circles too large for one bubble.
    `pairs` are those of all bubbles.
    """
    region, charts = ground.charts.region, ground.charts
    nothing = Spots(np.empty(0, dtype=np.int64), np.empty((0, 3)))
    if len(lonely) < 3:
        return nothing, False
    at, local = points[lonely], pitch[lonely]
    reach = float(local.max())
    where = signature(region, at, row[lonely], reach)
    triple = _triples(close_pairs(where, 2.4 * local), len(lonely))
    if not len(triple):
        return nothing, False
    centre, radius = _circumcircles(at[triple])
    mean = local[triple].mean(axis=1)
    empty = (radius > least * mean) & (radius < WIDEST * mean) & led_here(ground, centre, mean)
    empty[empty] = ~_taken(points, pairs, lonely[triple[empty]], centre[empty], 0.7 * radius[empty])
    wide = bool((empty & (radius > WIDE * mean)).any())
    empty &= radius < WIDE * mean
    triple, centre, radius, mean = triple[empty], centre[empty], radius[empty], mean[empty]
    corner = lonely[triple[:, 0]]
    start = _spots_of(charts, points[corner], row[corner])
    arrived = walk(charts, start, to_frame(charts, start.row, centre - points[corner])).arrived
    reached = positions(charts, arrived)
    kept = np.linalg.norm(reached - centre, axis=1) < 0.2 * mean
    kept &= _empty(ground, arrived, reached, points, row, 0.95 * radius)
    if ground.boundary is not None:
        distance, _ = nearest_boundary(ground.boundary, reached, arrived.row)
        kept &= distance > PRESSED_OUT * mean / 2 + ground.edge_offset
    arrived, radius, mean = arrived.take(kept), radius[kept], mean[kept]
    if not len(mean):
        return nothing, wide
    where = signature(region, positions(charts, arrived), arrived.row, reach)
    rank = np.lexsort((np.arange(len(mean)), -radius / mean)).argsort()
    return arrived.take(uncrowded(close_pairs(where, 0.9 * mean), rank)), wide


def _fillings(ground: Ground, points: Floats, row: Ints, pitch: Floats, lonely: Ints, added: Spots) -> Spots:
    """Places for new bubbles in wide voids, row after row from the edge inward: beside two of the `lonely`
    bubbles or of those that were `added`, at the stable distance from both.
    """
    charts = ground.charts
    at = np.concatenate([points, positions(charts, added)])
    rows, local = np.concatenate([row, added.row]), np.concatenate([pitch, ground.pitch(added)])
    front = np.concatenate([lonely, np.arange(len(points), len(at))])
    found: list[Spots] = []
    for _ in range(MOST_ROWS):
        spots = _beside_two(ground, at, rows, local, front)
        if not len(spots.row):
            break
        found.append(spots)
        front = np.concatenate([front, np.arange(len(at), len(at) + len(spots.row))])
        at, rows = np.concatenate([at, positions(charts, spots)]), np.concatenate([rows, spots.row])
        local = np.concatenate([local, ground.pitch(spots)])
    return joined(*found) if found else added.take(np.zeros(0, dtype=np.int64))


def _beside_two(ground: Ground, points: Floats, row: Ints, pitch: Floats, front: Ints) -> Spots:
    """Free places at the stable distance from two neighbours among the bubbles `front`."""
    charts, region = ground.charts, ground.charts.region
    one, two = front[close_pairs(points[front], BESIDE * pitch[front])].T
    same = region.same_side(row[one], row[two])
    one, two = np.concatenate([one[same], two[same]]), np.concatenate([two[same], one[same]])
    between = points[two] - points[one]
    length = np.linalg.norm(between, axis=1)
    new = (pitch[one] + pitch[two]) / 2
    to_one, to_two = (pitch[one] + new) / 2, (pitch[two] + new) / 2
    along = (length**2 + to_one**2 - to_two**2) / (2 * np.maximum(length, 1e-300))
    across = np.sqrt(np.maximum(to_one**2 - along**2, 0.0))
    # Each pair is there in both directions, the other side on its left.
    ahead = between / np.maximum(length, 1e-300)[:, None]
    left = np.cross(region.normals[row[one]], ahead)
    target = points[one] + along[:, None] * ahead + across[:, None] * left
    free = (cKDTree(points).query(target)[0] > 0.8 * FREE * new) & led_here(ground, target, new)
    one, target = one[free], target[free]
    if ground.boundary is not None:
        distance, _ = nearest_boundary(ground.boundary, target, row[one])
        inside = distance > PRESSED_OUT * new[free] / 2 + ground.edge_offset
        one, target = one[inside], target[inside]
    start = _spots_of(charts, points[one], row[one])
    arrived = walk(charts, start, to_frame(charts, start.row, target - points[one])).arrived
    reached, local = positions(charts, arrived), ground.pitch(arrived)
    kept = np.linalg.norm(reached - target, axis=1) < 0.2 * local
    kept &= _empty(ground, arrived, reached, points, row, FREE * local)
    arrived, reached, local = arrived.take(kept), reached[kept], local[kept]
    where = signature(region, reached, arrived.row, float(local.max(initial=0.0)))
    return arrived.take(uncrowded(close_pairs(where, FREE * local), np.arange(len(local))))


def _taken(points: Floats, pairs: Pairs, triple: Ints, centre: Floats, radius: Floats) -> Bools:
    """Whether a neighbour of the three bubbles (m, 3) is nearer to the `centre` (m, 3) than `radius` (m,).

    A look in space that settles most cases, before the centre has been brought onto the surface.
    """
    n = len(points)
    own, other = np.concatenate([pairs[:2], pairs[1::-1]], axis=1)
    link = csr_array((np.ones(len(own), dtype=np.int8), (own, other)), shape=(n, n))
    asked = triple.ravel()
    degree = np.diff(link.indptr)[asked]
    begins = link.indptr[asked] - (np.cumsum(degree) - degree)
    neighbour = link.indices[np.arange(degree.sum()) + np.repeat(begins, degree)]
    circle = np.repeat(np.arange(len(asked)) // 3, degree)
    away = points[neighbour] - centre[circle]
    within = dots(away, away) < radius[circle] ** 2
    return np.bincount(circle[within], minlength=len(triple)) > 0


def _spots_of(charts: Charts, points: Floats, row: Ints) -> Spots:
    """Places of points known to lie on the triangles `row`."""
    corners = charts.region.corners[row]
    local = to_frame(charts, row, points - corners[:, 0])
    bary = np.real(np.conj(charts.gradients[row]) * local[:, None])
    bary[:, 0] += 1
    bary = np.maximum(bary, 0)
    return Spots(row, bary / bary.sum(axis=1, keepdims=True))


def _triples(pairs: Ints, n: int) -> Ints:
    """All (m, 3) sets of three of which every two are a pair."""
    low, high = np.sort(pairs, axis=1).T
    link = csr_array((np.ones(len(low), dtype=np.int8), (low, high)), shape=(n, n))
    degree = np.diff(link.indptr)
    # For every pair (i, j) all k linked from j: a triple where (i, k) is a pair too.
    owner, offset = members(degree[high])
    third = link.indices[link.indptr[high[owner]] + offset]
    code = np.sort(low.astype(np.int64) * n + high)
    sought = low[owner].astype(np.int64) * n + third
    found = np.searchsorted(code, sought)
    known = code[np.minimum(found, len(code) - 1)] == sought if len(code) else np.zeros(0, dtype=bool)
    return np.stack([low[owner], high[owner], third], axis=1)[known]


def _circumcircles(corners: Floats) -> tuple[Floats, Floats]:
    """Centres (m, 3) and radii (m,) of the circles through three points, (m, 3, 3)."""
    a, b = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    normal = np.cross(a, b)
    square = np.maximum(dots(normal, normal), 1e-300)
    aa, bb = dots(a, a), dots(b, b)
    offset = np.cross(aa[:, None] * b - bb[:, None] * a, normal) / (2 * square[:, None])
    return corners[:, 0] + offset, np.linalg.norm(offset, axis=1)


def _empty(ground: Ground, spots: Spots, at: Floats, points: Floats, row: Ints, radius: Floats) -> Bools:
    """Whether no bubble of the same side of the surface is within `radius` of the places."""
    reach = float(radius.max(initial=0.0))
    places, others = (cKDTree(each, balanced_tree=False, compact_nodes=False) for each in (at, points))
    near = places.sparse_distance_matrix(others, reach, output_type="ndarray")
    place, other, distance = near["i"], near["j"], near["v"]
    taken = (distance <= radius[place]) & ground.charts.region.same_side(spots.row[place], row[other])
    return np.bincount(place[taken], minlength=len(at)) == 0
