"""The part of space that a symmetric pattern's leaders are packed in, and what of a region is inside it."""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from ..isometries import Isometries, depth
from ..mesh import Bools, Floats
from ..surface import Spots, positions
from .bubbles import Ground

# Bubbles this far outside the part of space that is packed, in pitches, may lead as well.
MARGIN = 0.36
# A lattice is grown so far beyond it, in pitches.
GROWN = 1.0


def led_here(ground: Ground, points: Floats, pitch: Floats | np.float64, beyond: float = MARGIN) -> Bools:
    """Which of the points (n, 3) are in the part of space that leaders are packed in, or no farther `beyond`
    it than so many pitches, (n,): all without a symmetry.
    """
    if ground.symmetry is None:
        return np.ones(len(points), dtype=bool)
    return depth(ground.symmetry.group, points) > -beyond * pitch


def grown_here(ground: Ground, spots: Spots) -> Bools:
    """Which of the places a lattice that is led is grown over, (n,)."""
    return led_here(ground, positions(ground.charts, spots), ground.pitch(spots), GROWN)


def all_reached(ground: Ground, seeds: Spots) -> bool:
    """Whether a lattice grown from the `seeds` comes to all of the region that leaders are packed in without
    leaving that.
    """
    assert ground.symmetry is not None
    region = ground.charts.region
    row, corner = np.nonzero(region.neighbours >= -1)
    start, end = (region.corners[row, (corner + turn) % 3] for turn in (1, 2))
    crossed = _crossing(ground.symmetry.group, start, end)
    n = len(region.triangles)
    led = np.zeros(n, dtype=bool)
    led[row[crossed]] = True
    beyond = region.neighbours[row, corner]
    linked = crossed & (beyond >= 0)
    links = coo_array((np.ones(int(linked.sum())), (row[linked], beyond[linked])), shape=(n, n))
    _, part = connected_components(links, directed=False)
    seeded = part[seeds.row[grown_here(ground, seeds)]]
    return bool(np.isin(part[led], seeded).all())


def _crossing(group: Isometries, start: Floats, end: Floats) -> Bools:
    """Which of the stretches from `start` to `end`, (n, 3) each, come into the part of space that leaders are
    packed in, (n,).

    That part is where all of one or two planes are: a stretch is between the last it enters and the first it
    leaves.
    """
    low, high = np.zeros(len(start)), np.ones(len(start))
    for normal in _sides(group):
        one, other = (start - group.centre) @ normal, (end - group.centre) @ normal
        change = other - one
        with np.errstate(divide="ignore", invalid="ignore"):
            at = np.where(change != 0, -one / change, np.where(one >= 0, -np.inf, np.inf))
        low = np.where(change >= 0, np.maximum(low, at), low)
        high = np.where(change < 0, np.minimum(high, at), high)
    return low <= high


def _sides(group: Isometries) -> Floats:
    """Normals (m, 3), inward, of the planes through the centre that bound the part; see isometries.depth."""
    if len(group.planes):
        return group.planes
    one, two = group.axes[(group.axis + 1) % 3], group.axes[(group.axis + 2) % 3]
    half = np.pi / len(group)
    return np.stack([np.sin(half) * one - np.cos(half) * two, np.sin(half) * one + np.cos(half) * two])
