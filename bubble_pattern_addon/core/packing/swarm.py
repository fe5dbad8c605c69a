"""The bubbles as arrays in motion: who acts on whom, the forces, and steps along the surface.

Between two landings bubbles move in the tangent planes they stand on, which is exact in the plane and off by
a share of a thousandth of the pitch elsewhere; landing walks them over the surface to where they belong.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from scipy.sparse import csc_array

from ..mesh import Floats, Ints
from ..surface import Spots, positions, to_frame, walk
from .bubbles import Bubbles, Ground, points_and_rows, with_arc
from .force import Law, Pairs, find_pairs, renewed_pairs
from .rim import on_track

# Pairs are listed with this reserve, in pitches (small enough to leave a lattice's next shell out, at 1.73),
# and a bubble's are listed anew when it has moved by half of that.
SKIN = 0.16
# Where fewer bubbles are at work, telling some apart from the others costs more than it spares.
FEW = 3000
# How far bubbles may move between two landings, in pitches: from AFLOAT at first, less where a landing shifts
# one by more than OFF, more (but never over FARTHEST) where it shifts all by less than a quarter of that.
AFLOAT, FARTHEST = 0.1, 0.4
OFF = 0.01


@dataclass
class Work:
    """What a relaxation has cost: force evaluations, and the bubbles and pairs these went over."""

    evaluations: int = 0
    bubbles: int = 0
    pairs: int = 0


@dataclass
class Swarm:
    """The bubbles as arrays that the relaxation writes to, the first row (m of them) first.

    points: (n, 3) where they are now; landed: (n, 3) where they last were exactly on the surface, there in
    the triangles row (n,), with barycentric coordinates bary (n - m, 3) of the free ones and unit tangents
    (m, 3) of the first row; arc: (m,) along the track; normal: (n, 3); drift: the farthest any may have moved
    since, in pitches, and afloat: how far they may; pairs are valid while no bubble is farther than half the
    skin from listed_at (n, 3), and none is farther from there than strayed, in pitches
    """

    ground: Ground
    bubbles: Bubbles
    pitch: Floats
    points: Floats
    landed: Floats
    row: Ints
    normal: Floats
    tangent: Floats
    bary: Floats
    arc: Floats
    pairs: Pairs
    listed_at: Floats
    drift: float = 0.0
    afloat: float = AFLOAT
    strayed: float = 0.0
    work: Work = field(default_factory=Work)


def swarm_of(ground: Ground, bubbles: Bubbles, pitch: Floats) -> Swarm:
    """The bubbles as arrays, with their pairs listed."""
    points, row, tangent = points_and_rows(ground, bubbles)
    return Swarm(
        ground=ground,
        bubbles=bubbles,
        pitch=pitch,
        points=points,
        landed=points.copy(),
        row=row.copy(),
        normal=ground.charts.region.normals[row],
        tangent=tangent,
        bary=bubbles.free.barycentric.copy(),
        arc=bubbles.first_row.arc.copy(),
        pairs=find_pairs(ground.charts, points, row, pitch, SKIN),
        listed_at=points.copy(),
    )


def twin(swarm: Swarm) -> Swarm:
    """The same bubbles once more, to be moved on trial; the list of pairs is shared."""
    places = ("points", "landed", "row", "normal", "tangent", "bary", "arc")
    return replace(swarm, **{name: getattr(swarm, name).copy() for name in places})


def bubbles_of(swarm: Swarm) -> Bubbles:
    """The bubbles where the swarm has them."""
    m = len(swarm.arc)
    _land_free(swarm, np.flatnonzero((swarm.points[m:] != swarm.landed[m:]).any(axis=1)))
    row = with_arc(swarm.bubbles.first_row, swarm.arc)
    return Bubbles(row, Spots(swarm.row[m:], swarm.bary), swarm.bubbles.held)


@dataclass(frozen=True)
class Links:
    """The pairs that act on the bubbles `active` (a,), and the (a + 1, p) matrix that adds up their forces;
    its last row takes those on all others.

    rim: how many of them belong to the first row, and slides (rim, 1): 1 for those that may slide, else 0;
    pitch: (a, 1); softness: (p,) one over the stable distance
    """

    active: Ints
    pairs: Pairs
    incidence: csc_array
    rim: int
    slides: Floats
    pitch: Floats
    softness: Floats


def links_of(swarm: Swarm, active: Ints) -> Links:
    """The pairs that act on the bubbles `active` (a,)."""
    n = len(swarm.points)
    pairs = swarm.pairs
    # Bubbles that are not active share one place after the last, which nobody reads.
    place = np.full(n, len(active))
    place[active] = np.arange(len(active))
    if len(active) < n:
        touched = (place[pairs.first] < len(active)) | (place[pairs.second] < len(active))
        pairs = Pairs(pairs.first[touched], pairs.second[touched], pairs.stable[touched])
    number = len(pairs.first)
    rows = np.stack([place[pairs.first], place[pairs.second]], axis=1).ravel()
    signs = np.tile([1.0, -1.0], number)
    incidence = csc_array((signs, rows, 2 * np.arange(number + 1)), shape=(len(active) + 1, number))
    rim = int(np.searchsorted(active, len(swarm.arc)))
    first = swarm.bubbles.first_row
    slides = (first.high > first.low)[active[:rim], None].astype(np.float64)
    return Links(active, pairs, incidence, rim, slides, swarm.pitch[active, None], 1 / pairs.stable)


def pull_on(swarm: Swarm, links: Links, law: Law) -> Floats:
    """Accelerations (a, 3) of the active bubbles along the surface, in units of the local pitch.

    The contact stiffness is k0/l0^2; with masses of 1/pitch^2 bubbles of all sizes swing at the same pace,
    and the balance, where the forces vanish, is that of the law.
    """
    pairs, active, rim = links.pairs, links.active, links.rim
    swarm.work.evaluations += 1
    swarm.work.bubbles += len(active)
    swarm.work.pairs += len(pairs.first)
    away = swarm.points.take(pairs.first, axis=0)
    away -= swarm.points.take(pairs.second, axis=0)
    distance = np.sqrt(np.einsum("mc,mc->m", away, away))
    away *= (law(distance * links.softness) * links.softness / np.maximum(distance, 1e-300))[:, None]
    pull = (links.incidence @ away)[:-1]
    pull *= links.pitch
    if not swarm.ground.charts.region.flat:
        normal = swarm.normal[active[rim:]]
        pull[rim:] -= np.einsum("nc,nc->n", pull[rim:], normal)[:, None] * normal
    if rim:
        tangent = swarm.tangent[active[:rim]]
        pull[:rim] = np.einsum("nc,nc->n", pull[:rim], tangent)[:, None] * links.slides * tangent
    return pull


def move(swarm: Swarm, links: Links, steps: Floats, longest: float) -> None:
    """Move the active bubbles by `steps` (a, 3) in their pitches, none longer than `longest`: the first row
    slides along its track, the others step on the surface.
    """
    active, rim = links.active, links.rim
    if swarm.drift + longest > swarm.afloat:
        land(swarm, active)
    swarm.drift += longest
    swarm.strayed += longest
    way = steps * links.pitch
    if rim:
        sliding, first, tangent = active[:rim], swarm.bubbles.first_row, swarm.tangent[active[:rim]]
        slide = np.einsum("mc,mc->m", steps[:rim], tangent)
        arc = np.clip(swarm.arc[sliding] + slide, first.low[sliding], first.high[sliding])
        way[:rim] = ((arc - swarm.arc[sliding])[:, None] * links.pitch[:rim]) * tangent
        swarm.arc[sliding] = arc
    if len(active) == len(swarm.points):
        swarm.points += way
    else:
        swarm.points[active] += way


def land(swarm: Swarm, active: Ints) -> None:
    """Bring the active bubbles, who alone have moved, back onto the surface and the track."""
    m = len(swarm.arc)
    rim = int(np.searchsorted(active, m))
    before = swarm.points[active]
    if rim:
        sliding = active[:rim]
        wrapped = with_arc(swarm.bubbles.first_row, swarm.arc).wrapped()[sliding]
        swarm.points[sliding], swarm.tangent[sliding], knot = on_track(swarm.ground.track, wrapped)
        swarm.row[sliding] = swarm.ground.track.spots.row[knot]
    # In a plane the way does not matter, only where it ends.
    if not swarm.ground.charts.region.flat:
        _land_free(swarm, active[rim:] - m)
    swarm.drift = 0.0
    shift = swarm.points[active] - before
    off = np.sqrt((np.einsum("ac,ac->a", shift, shift) / swarm.pitch[active] ** 2).max(initial=0.0))
    if off > OFF:
        swarm.afloat *= 0.5
    elif off < OFF / 4:
        swarm.afloat = min(1.5 * swarm.afloat, FARTHEST)


def _land_free(swarm: Swarm, free: Ints) -> None:
    """Walk the free bubbles numbered `free` over the surface to where they are."""
    charts, at = swarm.ground.charts, free + len(swarm.arc)
    start = Spots(swarm.row[at], swarm.bary[free])
    steps = to_frame(charts, start.row, swarm.points[at] - swarm.landed[at])
    arrived = walk(charts, start, steps).arrived
    swarm.row[at], swarm.bary[free] = arrived
    swarm.normal[at] = charts.region.normals[arrived.row]
    swarm.points[at] = swarm.landed[at] = positions(charts, arrived)


def list_anew(swarm: Swarm, active: Ints, beyond: float) -> bool:
    """Find the pairs of those bubbles anew that have moved by more than `beyond` pitches since they were
    listed; whether any had.
    """
    if swarm.strayed < beyond:
        return False
    away = swarm.points[active] - swarm.listed_at[active]
    shift = np.einsum("ac,ac->a", away, away) / swarm.pitch[active] ** 2
    swarm.strayed = float(np.sqrt(shift.max(initial=0.0)))
    if swarm.strayed < beyond:
        return False
    # Those half-way there are listed along: they would ask for it soon.
    stale = active[shift > (beyond / 2) ** 2]
    charts, points, row, pitch = swarm.ground.charts, swarm.points, swarm.row, swarm.pitch
    if len(stale) > 0.3 * len(points) or len(points) < FEW:
        swarm.pairs = find_pairs(charts, points, row, pitch, SKIN)
        swarm.listed_at, swarm.strayed = points.copy(), 0.0
    else:
        swarm.pairs = renewed_pairs(swarm.pairs, stale, charts, points, row, pitch, SKIN)
        swarm.listed_at[stale], swarm.strayed = points[stale], beyond / 2
    return True
