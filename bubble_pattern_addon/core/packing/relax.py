"""Relaxation of the bubbles to a static balance of forces along the surface (paper, Eq. 2).

FIRE (Bitzek, Koskinen, Gaehler, Moseler, Gumbsch, "Structural Relaxation Made Simple", 2006) reaches the
equilibrium of the paper's damped motion with far fewer force evaluations; `rk4` beside it integrates that
motion and is the reference. Most bubbles of a hexagonal start hardly move, so only those that feel a force,
and their neighbours, are worked on.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from scipy.sparse import csr_array

from ..mesh import Bools, Floats, Ints
from ..surface import Spots, positions, to_frame, walk
from .bubbles import Bubbles, Ground, can_move, points_and_rows, with_arc
from .force import Law, Pairs, find_pairs, force_law, renewed_pairs
from .rim import on_track

# Pairs are listed with this reserve, in pitches (small enough to leave a lattice's next shell out, at 1.73),
# and a bubble's are listed anew when it has moved by half of that.
SKIN = 0.16
# No bubble moves farther than this in a step, in pitches.
LONGEST_STEP = 0.12
# Steps between two looks at all bubbles, to see who feels a force.
BLOCK = 10
# FIRE's longest time step at the law's own stiffness; the lattice swings with at most sqrt(6) per unit.
QUICKEST = 0.75
# FIRE lets its mixing die away; at the longest time step the lattice's quickest swings would then never end.
LEAST_MIXING = 0.03


@dataclass
class Work:
    """What a relaxation has cost: force evaluations, and the bubbles and pairs these went over."""

    evaluations: int = 0
    bubbles: int = 0
    pairs: int = 0


@dataclass
class Swarm:
    """The bubbles as arrays that the relaxation writes to, the first row (m of them) first.

    points, row: (n, 3), (n,); bary: (n, 3), of the free ones; arc: (m,); tangent: (m, 3); velocity: (n, 3)
    per pitch; pairs are valid while no bubble is farther than half the skin from where it was listed
    """

    ground: Ground
    bubbles: Bubbles
    pitch: Floats
    points: Floats
    row: Ints
    tangent: Floats
    bary: Floats
    arc: Floats
    velocity: Floats
    pairs: Pairs
    listed_at: Floats
    work: Work = field(default_factory=Work)


def relax(
    ground: Ground,
    bubbles: Bubbles,
    pitch: Floats,
    iterations: int,
    tolerance: float,
    law: Law = force_law,
    stiffness: float = 1.0,
    moving: Bools | None = None,
) -> tuple[Bubbles, Work]:
    """Bubbles in balance: FIRE until a step would move none by more than `tolerance` pitches, or for
    `iterations` steps.

    pitch: (n,) the bubbles' local pitch, held for the time of the relaxation; stiffness: of the law's
    contact, relative to the paper's. Bubbles for which `moving` (n,) is false stay where they are.
    """
    swarm = swarm_of(ground, bubbles, pitch)
    pace, mixing, downhill = 0.5 * QUICKEST / np.sqrt(stiffness), 0.1, 0
    quickest = QUICKEST / np.sqrt(stiffness)
    # A bubble at rest that feels less than this would move by less than the tolerance in its first step.
    quiet = tolerance / pace**2
    done = 0
    everyone = can_move(bubbles) if moving is None else moving & can_move(bubbles)
    active = everyone
    while done < iterations:
        pull = pull_on(swarm, links_of(swarm, np.flatnonzero(active)), law)
        stirred = active.copy()
        stirred[active] = np.einsum("nc,nc->n", pull, pull) > quiet**2
        stirred &= everyone
        if not stirred.any():
            if active.all() or active is everyone:
                break
            active = everyone
            continue
        active = _with_neighbours(swarm, stirred, pull, quiet) & everyone
        swarm.velocity[~active] = 0
        block = min(BLOCK, iterations - done)
        pace, mixing, downhill = _block(
            swarm, np.flatnonzero(active), law, block, pace, mixing, downhill, quickest
        )
        done += block
        if done % (3 * BLOCK) == 0:
            active = everyone
    return bubbles_of(swarm), swarm.work


def twin(swarm: Swarm) -> Swarm:
    """The same bubbles once more, to be moved on trial; the list of pairs is shared."""
    places = ("points", "row", "tangent", "bary", "arc")
    return replace(swarm, **{name: getattr(swarm, name).copy() for name in places})


def bubbles_of(swarm: Swarm) -> Bubbles:
    """The bubbles where the swarm has them."""
    m = len(swarm.arc)
    row = with_arc(swarm.bubbles.first_row, swarm.arc)
    return Bubbles(row, Spots(swarm.row[m:], swarm.bary), swarm.bubbles.held)


def swarm_of(ground: Ground, bubbles: Bubbles, pitch: Floats) -> Swarm:
    """The bubbles as arrays, at rest, with their pairs listed."""
    points, row, tangent = points_and_rows(ground, bubbles)
    return Swarm(
        ground,
        bubbles,
        pitch,
        points,
        row.copy(),
        tangent,
        bubbles.free.barycentric.copy(),
        bubbles.first_row.arc.copy(),
        np.zeros((len(points), 3)),
        find_pairs(ground.charts, points, row, pitch, SKIN),
        points.copy(),
    )


@dataclass(frozen=True)
class Links:
    """The pairs that act on the bubbles `active` (a,), and the (a, p) matrix that adds up their forces."""

    active: Ints
    pairs: Pairs
    incidence: csr_array


def links_of(swarm: Swarm, active: Ints) -> Links:
    """The pairs that act on the bubbles `active` (a,)."""
    n = len(swarm.points)
    pairs = swarm.pairs
    place = np.full(n, -1)
    place[active] = np.arange(len(active))
    if len(active) < n:
        touched = (place[pairs.first] >= 0) | (place[pairs.second] >= 0)
        pairs = Pairs(pairs.first[touched], pairs.second[touched], pairs.stable[touched])
    first, second = place[pairs.first], place[pairs.second]
    order = np.arange(len(first))
    gains, loses = first >= 0, second >= 0
    incidence = csr_array(
        (
            np.concatenate([np.ones(gains.sum()), -np.ones(loses.sum())]),
            (np.concatenate([first[gains], second[loses]]), np.concatenate([order[gains], order[loses]])),
        ),
        shape=(len(active), len(first)),
    )
    return Links(active, pairs, incidence)


def pull_on(swarm: Swarm, links: Links, law: Law) -> Floats:
    """Accelerations (a, 3) of the active bubbles along the surface, in units of the local pitch.

    The contact stiffness is k0/l0^2; with masses of 1/pitch^2 bubbles of all sizes swing at the same pace,
    and the balance, where the forces vanish, is that of the law.
    """
    pairs, active = links.pairs, links.active
    swarm.work.evaluations += 1
    swarm.work.bubbles += len(active)
    swarm.work.pairs += len(pairs.first)
    away = swarm.points[pairs.first] - swarm.points[pairs.second]
    distance = np.sqrt(np.einsum("mc,mc->m", away, away))
    away *= (law(distance / pairs.stable) / (pairs.stable * np.maximum(distance, 1e-300)))[:, None]
    pull = (links.incidence @ away) * swarm.pitch[active, None]
    m = len(swarm.arc)
    rim = int(np.searchsorted(active, m))
    normal = swarm.ground.charts.region.normals[swarm.row[active[rim:]]]
    pull[rim:] -= np.einsum("nc,nc->n", pull[rim:], normal)[:, None] * normal
    if rim:
        first, tangent = swarm.bubbles.first_row, swarm.tangent[active[:rim]]
        sliding = (first.high > first.low)[active[:rim]]
        pull[:rim] = (np.einsum("nc,nc->n", pull[:rim], tangent) * sliding)[:, None] * tangent
    return pull


def _with_neighbours(swarm: Swarm, stirred: Bools, pull: Floats, quiet: float) -> Bools:
    """The stirred bubbles and those that their motion will reach within a block of steps."""
    reached = stirred.copy()
    for _ in range(2):
        wave = reached.copy()
        wave[swarm.pairs.first[reached[swarm.pairs.second]]] = True
        wave[swarm.pairs.second[reached[swarm.pairs.first]]] = True
        reached = wave
    return reached


def _block(
    swarm: Swarm,
    active: Ints,
    law: Law,
    steps: int,
    pace: float,
    mixing: float,
    downhill: int,
    quickest: float,
) -> tuple[float, float, int]:
    """Some steps of FIRE on the active bubbles; returns its time step, mixing and count of steps downhill."""
    links = links_of(swarm, active)
    for _ in range(steps):
        pull = pull_on(swarm, links, law)
        velocity = swarm.velocity[active] + pace * pull
        if _dot(pull, velocity) > 0:
            size = np.sqrt(_dot(velocity, velocity) / _dot(pull, pull))
            velocity += mixing * (size * pull - velocity)
            downhill += 1
            if downhill > 4:
                pace, mixing = min(1.1 * pace, quickest), max(0.99 * mixing, LEAST_MIXING)
        else:
            velocity = pace * pull
            pace, mixing, downhill = 0.5 * pace, 0.1, 0
        step = pace * velocity
        longest = np.sqrt(np.einsum("nc,nc->n", step, step).max(initial=0.0))
        if longest > LONGEST_STEP:
            step *= LONGEST_STEP / longest
        swarm.velocity[active] = velocity
        move(swarm, active, step * swarm.pitch[active, None])
        if list_anew(swarm, active):
            links = links_of(swarm, active)
    return pace, mixing, downhill


def _dot(a: Floats, b: Floats) -> float:
    """Inner product of two (n, 3) arrays; not by BLAS, whose threads wait for one another on a busy
    machine.
    """
    return float(np.einsum("nc,nc->", a, b))


def list_anew(swarm: Swarm, active: Ints) -> bool:
    """Find the pairs of those bubbles anew that have moved by half the skin since they were listed; whether
    any had.
    """
    away = swarm.points[active] - swarm.listed_at[active]
    shift = np.einsum("ac,ac->a", away, away) / swarm.pitch[active] ** 2
    if shift.max(initial=0.0) < (SKIN / 2) ** 2:
        return False
    # Those half-way there are listed along: they would ask for it soon.
    stale = active[shift > (SKIN / 4) ** 2]
    charts, points, row, pitch = swarm.ground.charts, swarm.points, swarm.row, swarm.pitch
    if len(stale) > 0.3 * len(points):
        swarm.pairs = find_pairs(charts, points, row, pitch, SKIN)
        swarm.listed_at = points.copy()
    else:
        swarm.pairs = renewed_pairs(swarm.pairs, stale, charts, points, row, pitch, SKIN)
        swarm.listed_at[stale] = points[stale]
    return True


def move(swarm: Swarm, active: Ints, steps: Floats) -> None:
    """Move the active bubbles by `steps` (a, 3): the first row slides along its track, the others walk on the
    surface.
    """
    m = len(swarm.arc)
    rim = int(np.searchsorted(active, m))
    sliding, free = active[:rim], active[rim:] - m
    charts, first = swarm.ground.charts, swarm.bubbles.first_row
    if rim:
        slide = np.einsum("mc,mc->m", steps[:rim], swarm.tangent[sliding]) / swarm.pitch[sliding]
        swarm.arc[sliding] = np.clip(swarm.arc[sliding] + slide, first.low[sliding], first.high[sliding])
        wrapped = with_arc(first, swarm.arc).wrapped()[sliding]
        swarm.points[sliding], swarm.tangent[sliding], knot = on_track(swarm.ground.track, wrapped)
        swarm.row[sliding] = swarm.ground.track.spots.row[knot]
    start = Spots(swarm.row[active[rim:]], swarm.bary[free])
    arrived = walk(charts, start, to_frame(charts, start.row, steps[rim:])).arrived
    swarm.row[active[rim:]], swarm.bary[free] = arrived
    swarm.points[active[rim:]] = positions(charts, arrived)
