"""Relaxation of the bubbles to a static balance of forces along the surface (paper, Eq. 2).

FIRE (Bitzek, Koskinen, Gaehler, Moseler, Gumbsch, "Structural Relaxation Made Simple", 2006) reaches the
equilibrium of the paper's damped motion with far fewer force evaluations; `rk4` beside it integrates that
motion and is the reference. Most bubbles of a hexagonal start hardly move, so only those that feel a force,
and their neighbours, are worked on.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

import numpy as np

from ..mesh import Bools, Floats
from ..progress import Progress, Steps, drive
from ..vectors import dots
from .bubbles import Bubbles, Ground
from .force import Law, force_law
from .swarm import (
    FEW,
    SKIN,
    Links,
    Swarm,
    Work,
    along_surface,
    bubbles_of,
    land,
    links_of,
    list_anew,
    move,
    pull_on,
    snapshot,
    swarm_of,
)

# No bubble moves farther than this in a step, in pitches.
LONGEST_STEP = 0.12
# Steps between two looks at who feels a force; and looks among the active between two looks at all bubbles.
BLOCK = 10
LOOKS = 3
# Half of the relaxations end within so many steps; for what is told of their progress.
USUAL = 100
# Where more than this share of the bubbles is active, telling them apart costs more than it spares.
NEARLY_ALL = 0.7
# Within a block a pair may come this much nearer than the list reaches, in pitches: it hardly pulls yet.
UNSEEN = 0.2
# FIRE's longest time step at the law's own stiffness; the lattice swings with at most sqrt(6) per unit.
QUICKEST = 0.75
# FIRE lets its mixing die away; at the longest time step the lattice's quickest swings would then never end.
LEAST_MIXING = 0.03


@dataclass
class Fire:
    """What FIRE adapts: its time step (at most `quickest`), mixing and count of steps downhill; velocity
    (n, 3) per pitch.
    """

    velocity: Floats
    quickest: float
    pace: float
    mixing: float = 0.1
    downhill: int = 0


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
    return drive(relax_steps(ground, bubbles, pitch, iterations, tolerance, law, stiffness, moving))


def relax_steps(
    ground: Ground,
    bubbles: Bubbles,
    pitch: Floats,
    iterations: int,
    tolerance: float,
    law: Law = force_law,
    stiffness: float = 1.0,
    moving: Bools | None = None,
    stage: str = "Packing the bubbles",
) -> Steps[tuple[Bubbles, Work]]:
    """Like relax, with a pause after every few steps of all bubbles, in which they can be looked at."""
    swarm = swarm_of(ground, bubbles, pitch)
    quickest = QUICKEST / np.sqrt(stiffness)
    fire = Fire(np.zeros_like(swarm.points), quickest, 0.5 * quickest)
    # A bubble at rest that feels less than this would move by less than the tolerance in its first step.
    quiet = tolerance / fire.pace**2
    everyone = swarm.movable
    if moving is not None:
        everyone[: len(bubbles)] &= moving
    links = links_of(swarm, np.flatnonzero(everyone))
    # Listing pairs anew costs more than a step. Only round a bend it is done early: who hardly moves may come
    # much nearer there.
    bent = ground.uniform is not None and not ground.charts.region.flat
    beyond = SKIN / 2 if bent else UNSEEN
    looked_at_all, done = True, 0
    while done < iterations:
        pull = pull_on(swarm, links, law)
        stirred = np.zeros(len(everyone), dtype=bool)
        stirred[links.active] = dots(pull, pull) > quiet**2
        if not stirred.any():
            if looked_at_all:
                break
            links, looked_at_all = _links_to(swarm, everyone), True
            continue
        wave = _with_neighbours(swarm, stirred) & everyone
        if len(everyone) < FEW or wave.sum() > NEARLY_ALL * everyone.sum():
            wave = everyone
        anew = list_anew(swarm, links.active, beyond)
        if anew or not np.array_equal(np.flatnonzero(wave), links.active):
            land(swarm, links.active)
            fire.velocity[~wave] = 0
            links = _links_to(swarm, wave)
        block = min(BLOCK, iterations - done)
        links = _block(swarm, fire, links, law, block)
        done += block
        # nobody knows how many steps there will be: each brings the end nearer
        yield Progress(stage, done / (done + USUAL), partial(snapshot, swarm))
        looked_at_all = done % (LOOKS * BLOCK) == 0
        looked_at_all |= len(links.active) == everyone.sum()
        if looked_at_all and len(links.active) < everyone.sum():
            land(swarm, links.active)
            links = _links_to(swarm, everyone)
    return bubbles_of(swarm), swarm.work


def _links_to(swarm: Swarm, active: Bools) -> Links:
    return links_of(swarm, np.flatnonzero(active))


def _with_neighbours(swarm: Swarm, stirred: Bools) -> Bools:
    """The stirred bubbles and those that their motion will reach within a block of steps."""
    reached = stirred.copy()
    for _ in range(2):
        wave = reached.copy()
        wave[swarm.pairs.first[reached[swarm.pairs.second]]] = True
        wave[swarm.pairs.second[reached[swarm.pairs.first]]] = True
        if swarm.followers is not None:
            # Whom a leader's image reaches, an image of the leader's own reaches from there.
            wave[swarm.followers.leader[wave[len(swarm.bubbles) :]]] = True
            wave[len(swarm.bubbles) :] = wave[swarm.followers.leader]
        reached = wave
    return reached


def _block(swarm: Swarm, fire: Fire, links: Links, law: Law, steps: int) -> Links:
    """Some steps of FIRE on the active bubbles; returns their links as they are at the end."""
    active = links.active
    velocity = fire.velocity[active]
    for _ in range(steps):
        pull = pull_on(swarm, links, law)
        velocity += fire.pace * pull
        # The surface has turned away under those who moved on: what leads off it would carry them off it.
        along_surface(swarm, active, velocity)
        if _dot(pull, velocity) > 0:
            size = np.sqrt(_dot(velocity, velocity) / _dot(pull, pull))
            velocity += fire.mixing * (size * pull - velocity)
            fire.downhill += 1
            if fire.downhill > 4:
                fire.pace = min(1.1 * fire.pace, fire.quickest)
                fire.mixing = max(0.99 * fire.mixing, LEAST_MIXING)
        else:
            velocity = fire.pace * pull
            fire.pace, fire.mixing, fire.downhill = 0.5 * fire.pace, 0.1, 0
        step = fire.pace * velocity
        longest = float(np.sqrt(dots(step, step).max(initial=0.0)))
        if longest > LONGEST_STEP:
            step *= LONGEST_STEP / longest
            longest = LONGEST_STEP
        move(swarm, links, step, longest)
        if list_anew(swarm, active, UNSEEN):
            links = links_of(swarm, active)
    fire.velocity[active] = velocity
    return links


def _dot(a: Floats, b: Floats) -> float:
    """Inner product of two (n, 3) arrays; not by BLAS, whose threads wait for one another on a busy
    machine.
    """
    return float(np.einsum("nc,nc->", a, b))
