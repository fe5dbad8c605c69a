"""Relaxation of the bubbles to a static balance of forces along the surface (paper, Eq. 2).

`rk4` integrates m x'' + c x' = f as the paper does and is the reference. `fire` reaches the same equilibrium with far fewer
force evaluations (Bitzek, Koskinen, Gaehler, Moseler, Gumbsch, "Structural Relaxation Made Simple", 2006).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_array

from ..mesh import Floats
from .bubbles import Bubbles, Ground, moved, points_and_rows
from .force import Pairs, find_pairs, force_law

# Pairs are listed with this reserve, in pitches, and listed anew when a bubble has moved by half of it.
SKIN = 0.25
# No bubble moves farther than this in a step, in pitches.
LONGEST_STEP = 0.12

Law = Callable[[Floats], Floats]


@dataclass
class Field:
    """Forces on a set of bubbles, with the list of pairs kept until it is stale.

    pairs and points belong together: the list was made at these points; evaluations counts the work done.
    """

    ground: Ground
    pitch: Floats
    law: Law
    pairs: Pairs | None = None
    incidence: csr_array | None = None
    listed_at: Floats | None = None
    evaluations: int = 0


def relax(
    ground: Ground, bubbles: Bubbles, pitch: Floats, iterations: int, tolerance: float, law: Law = force_law, quickest: float = 0.75
) -> tuple[Bubbles, int]:
    """Bubbles in balance: FIRE until none would move more than `tolerance` pitches, or for `iterations` steps.

    pitch: (n,) the bubbles' local pitch, held for the time of the relaxation. Returns the number of force evaluations too.
    """
    field = Field(ground, pitch, law)
    velocity = np.zeros((len(bubbles), 3))
    pace, mixing, downhill = quickest / 2, 0.1, 0
    for _ in range(iterations):
        pull, tangent = forces(field, bubbles)
        if float(np.sqrt((pull**2).sum(axis=1).max(initial=0.0))) < tolerance:
            break
        velocity += pace * pull
        power = float(np.vdot(pull, velocity))
        if power > 0:
            size = np.sqrt(np.vdot(velocity, velocity) / np.vdot(pull, pull))
            velocity += mixing * (size * pull - velocity)
            downhill += 1
            if downhill > 4:
                pace, mixing = min(1.1 * pace, quickest), 0.99 * mixing
        else:
            velocity[:] = 0
            velocity += pace * pull
            pace, mixing, downhill = 0.5 * pace, 0.1, 0
        step = pace * velocity
        longest = np.sqrt((step**2).sum(axis=1).max())
        if longest > LONGEST_STEP:
            step *= LONGEST_STEP / longest
        bubbles = moved(ground, bubbles, step * pitch[:, None], tangent, pitch)
    return bubbles, field.evaluations


def forces(field: Field, bubbles: Bubbles) -> tuple[Floats, Floats]:
    """Accelerations (n, 3) along the surface in units of the local pitch, and the first row's tangents.

    The contact stiffness is k0/l0^2; with masses of 1/pitch^2 bubbles of all sizes swing at the same pace, and the
    balance, where the forces vanish, is that of the law.
    """
    field.evaluations += 1
    points, row, tangent = points_and_rows(field.ground, bubbles)
    if field.listed_at is not None:
        shift = ((points - field.listed_at) ** 2).sum(axis=1) / field.pitch**2
    if field.listed_at is None or shift.max() > (SKIN / 2) ** 2:
        field.pairs = find_pairs(field.ground.charts, points, row, field.pitch, SKIN)
        field.incidence = _incidence(field.pairs, len(points))
        field.listed_at = points
    pairs = field.pairs
    away = points[pairs.first] - points[pairs.second]
    distance = np.sqrt(np.einsum("mc,mc->m", away, away))
    strength = field.law(distance / pairs.stable) / (pairs.stable * np.maximum(distance, 1e-300))
    pull = (field.incidence @ (strength[:, None] * away)) * field.pitch[:, None]
    m = len(tangent)
    normal = field.ground.charts.region.normals[row[m:]]
    pull[m:] -= np.einsum("nc,nc->n", pull[m:], normal)[:, None] * normal
    first = bubbles.first_row
    sliding = first.high > first.low
    pull[:m] = (np.einsum("nc,nc->n", pull[:m], tangent) * sliding)[:, None] * tangent
    return pull, tangent


def _incidence(pairs: Pairs, n: int) -> csr_array:
    """(n, m) matrix that adds every pair's force to its first bubble and takes it from its second."""
    m = len(pairs.first)
    order = np.arange(m)
    return csr_array(
        (
            np.concatenate([np.ones(m), -np.ones(m)]),
            (np.concatenate([pairs.first, pairs.second]), np.concatenate([order, order])),
        ),
        shape=(n, m),
    )
