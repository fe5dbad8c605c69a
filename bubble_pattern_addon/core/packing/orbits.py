"""Bubbles of a symmetric pattern: leaders, and followers that are where the isometries take these.

Only leaders are packed. A leader on a plane or an axis stays there; partners across a plane feel each other
as any neighbours do, through the followers that stand round the leaders.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from ..boundary import signature
from ..isometries import Isometries, depth, first_alike, image_of, images, settled
from ..mesh import Floats, Ints
from ..surface import Spots, positions
from ..symmetry import Symmetry, places_near, rows_near
from .bubbles import Bubbles, Ground, joined
from .crowding import close_pairs, uncrowded
from .domain import led_here

# A bubble nearer to its own image than this, in pitches, stands on the plane or axis instead.
ON_IT = 0.6
# A bubble and an image of another's closer than this, in pitches, do not both fit; nor do two bubbles closer
# than CROWDED, what is between is left to population control.
APART, CROWDED = 0.74, 0.45
# Who is moved onto a plane may crowd those nearer than this, in pitches.
BESIDE = 1.5
# Followers this near to a leader, in pitches, are felt by it or may come to be.
HALO = 3.2
# Beyond this, in pitches, a void is another domain's to fill.
SEEN = 1.7
# A place this near to an image, in pitches, is the one: walks from other places would end there too.
FOUND = 0.01
# An image farther than this from the region, in pitches, has no place there.
LOST = 0.1


@dataclass(frozen=True)
class Followers:
    """Images of leaders. leader: (h,) whose image each is; number: (h,) under which isometry; points: (h, 3)
    where; row: (h,) of triangles near there, which tell sheets apart
    """

    leader: Ints
    number: Ints
    points: Floats
    row: Ints


def on_their_planes(ground: Ground, spots: Spots, pitch: Floats) -> tuple[Spots, Floats]:
    """The places, those close to a plane or an axis moved onto it along the surface; and how far from there,
    in pitches (n,), the region let them.
    """
    symmetry = _symmetry(ground)
    points = positions(ground.charts, spots)
    there = settled(symmetry.group, points, ON_IT * pitch)
    moved = np.flatnonzero(np.linalg.norm(there - points, axis=1) > 1e-12 * pitch)
    row, bary, off = spots.row.copy(), spots.barycentric.copy(), np.zeros(len(pitch))
    if not len(moved):
        return spots, off
    normals = ground.charts.region.normals[row[moved]]
    # On a curved surface, the nearest place to a point of the plane need not be on the plane.
    for _ in range(8):
        found, _ = places_near(symmetry.finder, there[moved], normals, FOUND * pitch[moved])
        at = positions(ground.charts, found)
        there[moved] = settled(symmetry.group, at, ON_IT * pitch[moved])
        off[moved] = np.linalg.norm(there[moved] - at, axis=1) / pitch[moved]
        if off.max() < 1e-9:
            break
    row[moved], bary[moved] = found
    return Spots(row, bary), off


def leaders_of(ground: Ground, candidates: Spots, rank: Ints) -> Ints:
    """Numbers, ascending, of the `candidates` that lead orbits which do not crowd one another.

    rank: (n,) of two orbits in each other's way the one with the higher rank gives way
    """
    symmetry, charts = _symmetry(ground), ground.charts
    points, pitch = positions(charts, candidates), ground.pitch(candidates)
    inside = np.flatnonzero(led_here(ground, points, pitch))
    everyone = followers_of(ground, candidates.take(inside), pitch[inside])
    lost = np.zeros(len(inside), dtype=bool)
    followers = _located(ground, candidates.take(inside), pitch[inside], everyone)
    away = np.linalg.norm(positions(charts, followers) - everyone.points, axis=1)
    lost[everyone.leader[away > LOST * pitch[inside][everyone.leader]]] = True
    spots = joined(candidates.take(inside), followers)
    owner = np.concatenate([np.arange(len(inside)), everyone.leader])
    local = pitch[inside][owner]
    where = signature(charts.region, positions(charts, spots), spots.row, float(local.max(initial=0.0)))
    pairs = np.empty((0, 2), dtype=np.int64)
    if len(local):
        pairs = close_pairs(where, APART * local)
        across = (pairs >= len(inside)).sum(axis=1) == 1
        pairs = owner[np.concatenate([pairs[across], close_pairs(where, CROWDED * local)])]
    pairs = pairs[(pairs[:, 0] != pairs[:, 1]) & ~lost[pairs].any(axis=1)]
    kept = uncrowded(pairs, np.argsort(np.argsort(rank[inside], kind="stable"))) & ~lost
    return inside[kept]


def ranked(ground: Ground, spots: Spots, first: int) -> Ints:
    """Who gives way, (n,): the first before all others, and those deep inside the part that is packed before
    those at its border.
    """
    pitch = ground.pitch(spots)
    inner = np.minimum(depth(_symmetry(ground).group, positions(ground.charts, spots)) / pitch, 1.0)
    order = np.lexsort((np.arange(len(pitch)), -np.round(inner, 6), np.arange(len(pitch)) >= first))
    return order.argsort()


def symmetric_start(ground: Ground, bubbles: Bubbles) -> Bubbles:
    """The leaders of a start that is symmetric as well as may be."""
    spots, off = on_their_planes(ground, bubbles.spots, ground.pitch(bubbles.spots))
    held = off < LOST
    fixed = int(held[: bubbles.fixed].sum())
    spots = spots.take(held)
    chosen = leaders_of(ground, spots, ranked(ground, spots, fixed))
    return Bubbles(spots.take(chosen), int((chosen < fixed).sum()))


def settled_leaders(ground: Ground, bubbles: Bubbles) -> Bubbles:
    """The leaders, those that have come too near to an image of theirs moved to where it is themselves, and
    those left out that have no place then.
    """
    spots, off = on_their_planes(ground, bubbles.spots, ground.pitch(bubbles.spots))
    moved = (spots.row != bubbles.spots.row) | (spots.barycentric != bubbles.spots.barycentric).any(axis=1)
    if not moved.any():
        return bubbles
    # Whoever is on a plane stays in any case; one that has just been moved there may crowd others near it.
    points = positions(ground.charts, spots)
    beside = cKDTree(points[moved]).query(points)[0] < BESIDE * ground.pitch(spots)
    some = np.flatnonzero(beside)
    rank = np.lexsort((some, moved[some], some >= bubbles.fixed)).argsort()
    kept = ~moved
    kept[some[leaders_of(ground, spots.take(some), rank)]] = True
    kept &= off < LOST
    return Bubbles(spots.take(kept), int(kept[: bubbles.fixed].sum()))


def orbit_sizes(ground: Ground, bubbles: Bubbles, pitch: Floats) -> Ints:
    """How many bubbles of the whole pattern each leader stands for, itself among them, (n,)."""
    if ground.symmetry is None:
        return np.ones(len(bubbles), dtype=np.int64)
    group = ground.symmetry.group
    first = first_alike(group, positions(ground.charts, bubbles.spots), pitch)
    return (first == np.arange(len(group))).sum(axis=1)


def followers_of(ground: Ground, spots: Spots, pitch: Floats, reach: float | None = None) -> Followers:
    """Followers of the leaders at `spots`: all, or those within `reach` pitches of a leader.

    A leader that is its own image has that follower not, nor the same one twice.
    """
    symmetry = _symmetry(ground)
    group, points = symmetry.group, positions(ground.charts, spots)
    first = first_alike(group, points, pitch)
    leader, number = np.nonzero(first == np.arange(len(group)))
    leader, number = leader[number > 0], number[number > 0]
    at = image_of(group, number, points[leader])
    if reach is not None and len(points):
        widest = reach * float(pitch.max())
        near = cKDTree(points).query(at, distance_upper_bound=widest)[0] < widest
        leader, number, at = leader[near], number[near], at[near]
    normals = _turned_normals(ground, spots, leader, number)
    return Followers(leader, number, at, rows_near(symmetry.finder, at, normals))


def _turned_normals(ground: Ground, spots: Spots, leader: Ints, number: Ints) -> Floats:
    """Which way the surface faces, (h, 3), at the images of `leader` (h,) under the isometries `number` (h,)."""
    region = ground.charts.region
    return np.einsum("nab,nb->na", _symmetry(ground).group.turns[number], region.normals[spots.row[leader]])


def _located(ground: Ground, spots: Spots, pitch: Floats, followers: Followers) -> Spots:
    """Places of the followers on the surface."""
    normals = _turned_normals(ground, spots, followers.leader, followers.number)
    within = FOUND * pitch[followers.leader]
    return places_near(_symmetry(ground).finder, followers.points, normals, within)[0]


def with_followers(ground: Ground, bubbles: Bubbles) -> Bubbles:
    """The whole pattern: every leader with all its followers, and who is whose partner.

    Orbit by orbit in the order of the leaders, so that the fixed ones are still the first.
    """
    group, n = _symmetry(ground).group, len(bubbles)
    pitch = ground.pitch(bubbles.spots)
    everyone = followers_of(ground, bubbles.spots, pitch)
    owner = np.concatenate([np.arange(n), everyone.leader])
    number = np.concatenate([np.zeros(n, dtype=np.int64), everyone.number])
    order = np.lexsort((number, owner))
    spots = joined(bubbles.spots, _located(ground, bubbles.spots, pitch, everyone)).take(order)
    owner, number = owner[order], number[order]
    table = np.full((n, len(group)), -1)
    table[owner, number] = np.arange(len(owner))
    # An image that is another's too has that one's number.
    table = np.take_along_axis(
        table, first_alike(group, positions(ground.charts, bubbles.spots), pitch), axis=1
    )
    partners = table[owner[:, None], _composed(group)[:, number].T]
    return Bubbles(spots, int((owner < bubbles.fixed).sum()), partners, owner)


def _composed(group: Isometries) -> Ints:
    """Number (k, k) of the isometry that does the second after the first: [i, j] is i after j."""
    turns = group.turns
    after = np.einsum("iab,jbc->ijac", turns, turns)
    apart = np.abs(after[:, :, None] - turns[None, None]).max(axis=(3, 4))
    return apart.argmin(axis=2)


def held(group: Isometries, points: Floats, pitch: Floats) -> Floats:
    """Projectors (n, 3, 3), round the centre, onto where each of the points (n, 3) is its own image as it is
    now.
    """
    alike = np.linalg.norm(images(group, points) - points, axis=2) < 1e-6 * pitch
    return np.einsum("kn,kab->nab", alike, group.turns) / alike.sum(axis=0)[:, None, None]


def _symmetry(ground: Ground) -> Symmetry:
    assert ground.symmetry is not None
    return ground.symmetry
