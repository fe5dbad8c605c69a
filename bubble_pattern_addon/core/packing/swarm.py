"""The bubbles as arrays in motion: who acts on whom, the forces, and steps along the surface.

Between two landings bubbles move in the tangent planes they stand on, which is exact in the plane and off by
a share of a thousandth of the pitch elsewhere; landing walks them over the surface to where they belong.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from scipy.sparse import csc_array

from ..isometries import image_of
from ..mesh import Bools, Floats, Ints
from ..progress import Snapshot
from ..surface import Spots, positions, to_frame, walk
from ..vectors import dots
from .bubbles import Bubbles, Ground, can_move
from .force import NO_PAIRS, Law, Pairs, find_pairs, renewed_pairs, within_reach
from .orbits import HALO, Followers, followers_of, held

# Pairs are listed with this reserve, in pitches (small enough to leave a lattice's next shell out, at 1.73),
# and a bubble's are listed anew when it has moved by half of that.
SKIN = 0.16
# Pairs of bubbles of different sizes take long to find: they are listed out to this reserve as well, which
# holds for several of the shorter lists: until a bubble has moved so far, in pitches.
WIDE_SKIN, WIDE_MOVED = 0.9, 0.5
# Where a smaller share of the bubbles has moved, listing their pairs alone is quicker than all anew.
RENEWABLE = 0.3
# Where fewer bubbles are at work, telling some apart from the others costs more than it spares.
FEW = 3000
# How far bubbles may move between two landings, in pitches: AFLOAT at first, then so far that by what they
# were off the surface until now (which grows with the square of the way) none will be by more than OFF, but
# no less than NEAREST and no more than FARTHEST.
AFLOAT, NEAREST, FARTHEST = 0.1, 0.06, 0.4
OFF = 0.01


@dataclass
class Work:
    """What a relaxation has cost: force evaluations, and the bubbles and pairs these went over; and from its
    wide list, where it has one, the pairs `near` enough at its end to feel each other, among others.
    """

    evaluations: int = 0
    bubbles: int = 0
    pairs: int = 0
    near: Pairs | None = None


@dataclass
class Swarm:
    """The bubbles as arrays that the relaxation writes to.

    points: (n, 3) where they are now; landed: (n, 3) where they last were exactly on the surface, there in
    the triangles row (n,) with barycentric coordinates bary (n, 3) and normal (n, 3); drift: the farthest any
    may have moved since, in pitches, and afloat: how far they may; pairs are valid while no bubble is farther
    than half the skin from listed_at (n, 3), and none is farther from there than strayed, in pitches;
    followers: in a symmetric pattern, those that stand after the bubbles and go where these take them; still:
    rows of the bubbles that stay on a plane or an axis, and the projectors (s, 3, 3) onto it; wide: where the
    pitch is graded, the pairs out to the wide skin, and where all bubbles were when these were listed (n, 3)
    """

    ground: Ground
    bubbles: Bubbles
    pitch: Floats
    points: Floats
    landed: Floats
    row: Ints
    bary: Floats
    normal: Floats
    pairs: Pairs
    listed_at: Floats
    drift: float = 0.0
    afloat: float = AFLOAT
    strayed: float = 0.0
    followers: Followers | None = None
    still: tuple[Ints, Floats] | None = None
    wide: tuple[Pairs, Floats] | None = None
    work: Work = field(default_factory=Work)

    @property
    def movable(self) -> Bools:
        """Which may move by themselves, (n,)."""
        return np.concatenate([can_move(self.bubbles), np.zeros(len(self.points) - len(self.bubbles), bool)])


def swarm_of(ground: Ground, bubbles: Bubbles, pitch: Floats) -> Swarm:
    """The bubbles as arrays, with their pairs listed."""
    charts, spots = ground.charts, bubbles.spots
    points, row, bary = positions(charts, spots), spots.row.copy(), spots.barycentric.copy()
    followers = still = None
    if ground.symmetry is not None:
        followers = followers_of(ground, spots, pitch, HALO)
        projectors = held(ground.symmetry.group, points, pitch)
        special = np.flatnonzero(np.abs(projectors - np.eye(3)).max(axis=(1, 2)) > 1e-9)
        still = special, projectors[special]
        points = np.concatenate([points, followers.points])
        row = np.concatenate([row, followers.row])
        # Followers never walk: where in their triangles they are is not asked.
        bary = np.concatenate([bary, np.full((len(followers.row), 3), 1 / 3)])
        pitch = np.concatenate([pitch, pitch[followers.leader]])
    swarm = Swarm(
        ground=ground,
        bubbles=bubbles,
        pitch=pitch,
        points=points,
        landed=points.copy(),
        row=row,
        bary=bary,
        normal=charts.region.normals[row],
        pairs=NO_PAIRS,
        listed_at=points.copy(),
        followers=followers,
        still=still,
    )
    swarm.pairs = _pairs_now(swarm)
    return swarm


def snapshot(swarm: Swarm) -> Snapshot:
    """The bubbles as they are now."""
    n = len(swarm.bubbles)
    return Snapshot(swarm.points[:n].copy(), swarm.normal[:n].copy(), swarm.pitch[:n].copy())


def _pairs_now(swarm: Swarm) -> Pairs:
    """All pairs within the skin, of bubbles of different sizes from the wide list as long as that holds."""
    charts, points, row, pitch = swarm.ground.charts, swarm.points, swarm.row, swarm.pitch
    if swarm.ground.uniform is not None:
        return find_pairs(charts, points, row, pitch, SKIN)
    if swarm.wide is not None:
        _renew_wide(swarm)
    if swarm.wide is None:
        swarm.wide = find_pairs(charts, points, row, pitch, WIDE_SKIN), points.copy()
    return within_reach(swarm.wide[0], points, SKIN)


def _renew_wide(swarm: Swarm) -> None:
    """Bring the wide list up to date, or drop it, where bubbles have moved farther than it allows for."""
    assert swarm.wide is not None
    pairs, listed_at = swarm.wide
    charts, points, pitch = swarm.ground.charts, swarm.points, swarm.pitch
    away = points - listed_at
    shift = dots(away, away) / pitch**2
    if shift.max(initial=0.0) <= WIDE_MOVED**2:
        return
    stale = np.flatnonzero(shift > (WIDE_MOVED / 2) ** 2)
    if len(stale) > RENEWABLE * len(points):
        swarm.wide = None
        return
    listed_at[stale] = points[stale]
    swarm.wide = renewed_pairs(pairs, stale, charts, points, swarm.row, pitch, WIDE_SKIN), listed_at


def follow(swarm: Swarm) -> None:
    """Bring the followers to where their leaders' images are, and who stays on a plane back onto it."""
    symmetry = swarm.ground.symmetry
    if symmetry is None or swarm.followers is None or swarm.still is None:
        return
    (rows, projectors), centre = swarm.still, symmetry.group.centre
    offset = swarm.points[rows] - centre
    swarm.points[rows] = centre + np.einsum("nab,nb->na", projectors, offset)
    leading = swarm.points[swarm.followers.leader]
    swarm.points[len(swarm.bubbles) :] = image_of(symmetry.group, swarm.followers.number, leading)


def twin(swarm: Swarm) -> Swarm:
    """The same bubbles once more, to be moved on trial; the list of pairs is shared."""
    places = ("points", "landed", "row", "bary", "normal")
    return replace(swarm, **{name: getattr(swarm, name).copy() for name in places})


def bubbles_of(swarm: Swarm) -> Bubbles:
    """The bubbles where the swarm has them."""
    n = len(swarm.bubbles)
    _walk_there(swarm, np.flatnonzero((swarm.points[:n] != swarm.landed[:n]).any(axis=1)))
    if swarm.wide is not None and swarm.followers is None:
        _renew_wide(swarm)
        swarm.work.near = None if swarm.wide is None else swarm.wide[0]
    return Bubbles(Spots(swarm.row[:n], swarm.bary[:n]), swarm.bubbles.fixed)


@dataclass(frozen=True)
class Links:
    """The pairs that act on the bubbles `active` (a,), and the (a + 1, p) matrix that adds up their forces;
    its last row takes those on all others.

    rows: the active bubbles as an index, a slice where none is missing among them, which is quicker;
    pitch: (a, 1); softness: (p,) one over the stable distance
    """

    active: Ints
    rows: Ints | slice
    pairs: Pairs
    incidence: csc_array
    pitch: Floats
    softness: Floats


def links_of(swarm: Swarm, active: Ints) -> Links:
    """The pairs that act on the bubbles `active` (a,)."""
    n = len(swarm.points)
    pairs = swarm.pairs
    # Bubbles that are not active share one place after the last, which nobody reads. Numbers of 32 bits are
    # what the matrix would make of longer ones.
    place = np.full(n, len(active), dtype=np.int32)
    place[active] = np.arange(len(active))
    if len(active) < n:
        touched = (place[pairs.first] < len(active)) | (place[pairs.second] < len(active))
        pairs = Pairs(pairs.first[touched], pairs.second[touched], pairs.stable[touched])
    number = len(pairs.first)
    rows, signs = np.empty((number, 2), dtype=np.int32), np.empty((number, 2))
    rows[:, 0], rows[:, 1] = place[pairs.first], place[pairs.second]
    signs[:] = 1.0, -1.0
    starts = np.arange(0, 2 * number + 1, 2, dtype=np.int32)
    incidence = csc_array((signs.ravel(), rows.ravel(), starts), shape=(len(active) + 1, number))
    return Links(active, _as_slice(active), pairs, incidence, swarm.pitch[active, None], 1 / pairs.stable)


def _as_slice(ascending: Ints) -> Ints | slice:
    """The same rows as a slice, if none is missing between the first and the last."""
    if len(ascending) and ascending[-1] - ascending[0] + 1 == len(ascending):
        return slice(int(ascending[0]), int(ascending[-1]) + 1)
    return ascending


def pull_on(swarm: Swarm, links: Links, law: Law) -> Floats:
    """Accelerations (a, 3) of the active bubbles along the surface, in units of the local pitch.

    The contact stiffness is k0/l0^2; with masses of 1/pitch^2 bubbles of all sizes swing at the same pace,
    and the balance, where the forces vanish, is that of the law.
    """
    pairs, active = links.pairs, links.active
    swarm.work.evaluations += 1
    swarm.work.bubbles += len(active)
    swarm.work.pairs += len(pairs.first)
    away = swarm.points.take(pairs.first, axis=0)
    away -= swarm.points.take(pairs.second, axis=0)
    distance = np.sqrt(dots(away, away))
    away *= (law(distance * links.softness) * links.softness / np.maximum(distance, 1e-300))[:, None]
    pull = (links.incidence @ away)[:-1]
    pull *= links.pitch
    along_surface(swarm, active, pull)
    return pull


def along_surface(swarm: Swarm, active: Ints, vectors: Floats) -> None:
    """Take from the `vectors` (a, 3) of the active bubbles what is square to the surface where they stand."""
    if not swarm.ground.charts.region.flat:
        normal = swarm.normal[active]
        vectors -= dots(vectors, normal)[:, None] * normal


def move(swarm: Swarm, links: Links, steps: Floats, longest: float) -> None:
    """Move the active bubbles by `steps` (a, 3) in their pitches, none longer than `longest`."""
    if swarm.drift + longest > swarm.afloat and not swarm.ground.charts.region.flat:
        _land_the_far(swarm, links)
    swarm.drift += longest
    swarm.strayed += longest
    swarm.points[links.rows] += steps * links.pitch
    follow(swarm)


def _land_the_far(swarm: Swarm, links: Links) -> None:
    """Bring those back onto the surface that have left it by more than half of what is allowed: most swing to
    and fro, and few are as far away as their steps add up to.
    """
    away = swarm.points[links.active] - swarm.landed[links.active]
    away /= links.pitch
    square = dots(away, away)
    far = square > (swarm.afloat / 2) ** 2
    drift = float(np.sqrt(square[~far].max(initial=0.0)))
    off = land(swarm, links.active[far]) / links.pitch[far, 0]
    swarm.drift = drift
    if len(off):
        rise = float((off / square[far]).max())
        swarm.afloat = min(max(float(np.sqrt(OFF / max(rise, 1e-300))), NEAREST), FARTHEST)


def land(swarm: Swarm, which: Ints) -> Floats:
    """Bring the bubbles `which` back onto the surface, so that none is off it; how far they were, (n,)."""
    swarm.drift = 0.0
    # In a plane the way does not matter, only where it ends.
    if swarm.ground.charts.region.flat or not len(which):
        return np.zeros(len(which))
    before = swarm.points[which]
    _walk_there(swarm, which)
    off = np.linalg.norm(swarm.points[which] - before, axis=1)
    follow(swarm)
    return off


def _walk_there(swarm: Swarm, which: Ints) -> None:
    """Walk the bubbles `which` over the surface to where they are."""
    charts, start = swarm.ground.charts, Spots(swarm.row[which], swarm.bary[which])
    steps = to_frame(charts, start.row, swarm.points[which] - swarm.landed[which])
    arrived = walk(charts, start, steps).arrived
    swarm.row[which], swarm.bary[which] = arrived
    swarm.normal[which] = charts.region.normals[arrived.row]
    swarm.points[which] = swarm.landed[which] = positions(charts, arrived)


def list_anew(swarm: Swarm, active: Ints, beyond: float) -> bool:
    """Find the pairs of those bubbles anew that have moved by more than `beyond` pitches since they were
    listed; whether any had.
    """
    if swarm.strayed < beyond:
        return False
    away = swarm.points[active] - swarm.listed_at[active]
    shift = dots(away, away) / swarm.pitch[active] ** 2
    swarm.strayed = float(np.sqrt(shift.max(initial=0.0)))
    if swarm.strayed < beyond:
        return False
    # Those half-way there are listed along: they would ask for it soon.
    moved = np.zeros(len(swarm.points), dtype=bool)
    moved[active[shift > (beyond / 2) ** 2]] = True
    if swarm.followers is not None:
        moved[len(swarm.bubbles) :] = moved[swarm.followers.leader]
    stale = np.flatnonzero(moved)
    charts, points, row, pitch = swarm.ground.charts, swarm.points, swarm.row, swarm.pitch
    if len(stale) > RENEWABLE * len(points) or len(points) < FEW:
        swarm.pairs = _pairs_now(swarm)
        swarm.listed_at, swarm.strayed = points.copy(), 0.0
    else:
        swarm.pairs = renewed_pairs(swarm.pairs, stale, charts, points, row, pitch, SKIN)
        swarm.listed_at[stale], swarm.strayed = points[stale], beyond / 2
    return True
