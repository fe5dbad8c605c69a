"""The force between two bubbles (paper, Eq. 1) and who feels whom."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from ..boundary import signature
from ..mesh import Floats, Ints
from ..surface import Charts

# Bubbles farther apart than this many stable distances do not feel each other.
REACH = 1.5
# How many times stiffer than the law's own the contact is in the last phase.
STIFFNESS = 12.0


class Pairs(NamedTuple):
    """Pairs of bubbles that may feel each other: first, second (m,); stable (m,) their stable distance l0."""

    first: Ints
    second: Ints
    stable: Floats


def force_law(w: Floats) -> Floats:
    """l0/k0 times the force at the relative distance w = d/l0, (m,): repulsive when positive.

    The bounded cubic 5/4 w^3 - 19/8 w^2 + 9/8 for 0 <= w < 1.5, else 0: the only cubic with f(1) = 0, f(1.5) = 0,
    f'(0) = 0 whose slope at contact is -1 (Shimada and Gossard, "Bubble Mesh", 1995; the paper's Eq. 1).
    """
    return np.where(w < REACH, (1.25 * w - 2.375) * w * w + 1.125, 0.0)


def stiff_law(w: Floats) -> Floats:
    """l0/k0 times a force many times as stiff below contact and the law's own beyond: it evens out the smallest gaps."""
    return np.where(w < 1.0, STIFFNESS * (1.0 - w), force_law(w))


def find_pairs(charts: Charts, points: Floats, row: Ints, pitch: Floats, skin: float) -> Pairs:
    """Pairs closer than 1.5 stable distances plus `skin` pitches, on one sheet of the region.

    points: (n, 3) positions; row: (n,) region rows; pitch: (n,)
    """
    region = charts.region
    widest = float(pitch.max())
    at = points if region.single_sheet else signature(region, points, row, widest)
    reach = REACH + skin
    tree = cKDTree(at, balanced_tree=False, compact_nodes=False)
    if widest < 1.25 * pitch.min():
        first, second = tree.query_pairs(reach * widest, output_type="ndarray").T
    else:
        first, second = _graded_pairs(tree, at, pitch, reach)
    stable = (pitch[first] + pitch[second]) / 2
    away = points[first] - points[second]
    close = np.einsum("mc,mc->m", away, away) < (reach * stable) ** 2
    return Pairs(first[close], second[close], stable[close])


def _graded_pairs(tree: cKDTree, at: Floats, pitch: Floats, reach: float) -> tuple[Ints, Ints]:
    """Candidate pairs where pitches differ much: the nearest of each bubble, so that small ones do not list hundreds."""
    count = min(20, len(at))
    distance, near = tree.query(at, k=count)
    own = np.repeat(np.arange(len(at)), count)
    near, distance = near.reshape(-1), distance.reshape(-1)
    kept = (distance < reach * (pitch[own] + pitch[near]) / 2) & (own != near)
    low, high = np.minimum(own, near)[kept], np.maximum(own, near)[kept]
    code = np.unique(low * len(at) + high)
    return code // len(at), code % len(at)
