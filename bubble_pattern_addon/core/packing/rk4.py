"""The paper's integrator: damped motion of every bubble by the fourth-order Runge-Kutta method (Eq. 2)."""

from __future__ import annotations

from functools import partial

import numpy as np

from ..mesh import Floats
from ..progress import Progress, Steps, drive
from ..vectors import dots
from .bubbles import Bubbles, Ground
from .force import Law, force_law
from .relax import BLOCK, LONGEST_STEP, USUAL
from .swarm import SKIN, Work, bubbles_of, land, links_of, list_anew, move, pull_on, snapshot, swarm_of, twin

# Time step in units of sqrt(m/k0): the lattice swings with at most sqrt(6), RK4 is stable up to 2.8.
STEP = 0.5
# Damping ratio 0.7: c = 0.7 * 2 * sqrt(m * k0).
DAMPING = 1.4


def integrate(
    ground: Ground, bubbles: Bubbles, pitch: Floats, iterations: int, tolerance: float, law: Law = force_law
) -> tuple[Bubbles, Work]:
    """Bubbles after m x'' + c x' = f, until a step moves none by more than `tolerance` pitches.

    At most `iterations` steps. pitch: (n,) the bubbles' local pitch. Positions and forces are projected onto
    the surface at every stage.
    """
    return drive(integration_steps(ground, bubbles, pitch, iterations, tolerance, law))


def integration_steps(
    ground: Ground, bubbles: Bubbles, pitch: Floats, iterations: int, tolerance: float, law: Law = force_law
) -> Steps[tuple[Bubbles, Work]]:
    """Like integrate, with a pause after every few steps, in which the bubbles can be looked at."""
    swarm = swarm_of(ground, bubbles, pitch)
    everyone = np.flatnonzero(swarm.movable)
    links = links_of(swarm, everyone)
    velocity = np.zeros((len(everyone), 3))
    for done in range(iterations):
        if done % BLOCK == BLOCK - 1:
            yield Progress("Packing the bubbles", done / (done + USUAL), partial(snapshot, swarm))
        if list_anew(swarm, everyone, SKIN / 2):
            links = links_of(swarm, everyone)
        slopes: list[tuple[Floats, Floats]] = []
        for share in (0.0, 0.5, 0.5, 1.0):
            stage = twin(swarm)
            moving, speeding = slopes[-1] if slopes else (velocity, np.zeros_like(velocity))
            if share:
                move(stage, links, share * STEP * moving, 0.0)
                land(stage, everyone)
            speed = velocity + share * STEP * speeding
            slopes.append((speed, pull_on(stage, links, law) - DAMPING * speed))
        weights = (1 / 6, 1 / 3, 1 / 3, 1 / 6)
        step = np.zeros_like(velocity)
        for weight, (moving, _) in zip(weights, slopes, strict=True):
            step += STEP * weight * moving
        longest = float(np.sqrt(dots(step, step).max(initial=0.0)))
        if longest > LONGEST_STEP:
            step *= LONGEST_STEP / longest
        velocity = velocity + STEP * sum(
            weight * gain for weight, (_, gain) in zip(weights, slopes, strict=True)
        )
        move(swarm, links, step, longest)
        land(swarm, everyone)
        if longest < tolerance and float(np.abs(slopes[0][1]).max(initial=0.0)) < tolerance / STEP:
            break
    return bubbles_of(swarm), swarm.work
