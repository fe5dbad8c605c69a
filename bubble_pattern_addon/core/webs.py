"""The webs between features: which pairs share material, and which leave too little of it between them."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from .mesh import Bools, Floats, Ints
from .neighbours import SHEET_TURN, same_sheet
from .pattern import Pattern
from .region import Region
from .vectors import dots

# Features that touched would make a part that is no solid: this share of the pitch remains between two of
# them, and half as much to the boundary, where the limits ask for less.
LEAST_WEB = 0.02
# Normals that agree this well are of one face or of faces one above the other, not on both sides of an edge.
LEVEL = 0.7
# Webs come out wider than asked by this, so that rounding takes nothing off them.
ROUNDING = 1e-12


def narrow_pairs(
    bubbles: Pattern, region: Region, diameter: Floats, kept: Bools, web: Floats
) -> tuple[Ints, Floats]:
    """Pairs (m, 2) of `kept` (n,) features that leave less than the larger of their least webs, and their
    room, (m,): the most that the mean of their two diameters may be. web: (n,)

    Features on both sides of a thin wall are none, nor those of faces one above the other.
    """
    position, pitch = bubbles.position, bubbles.pitch
    size = diameter + np.maximum(web.max(initial=0.0), LEAST_WEB * pitch)
    pairs = _within_reach(position, size, np.flatnonzero(kept))
    offset = position[pairs[:, 1]] - position[pairs[:, 0]]
    distance = np.linalg.norm(offset, axis=1)
    least = np.maximum(web[pairs].max(axis=1), LEAST_WEB * pitch[pairs].mean(axis=1))
    room = (distance - least) * (1 - ROUNDING)
    narrow = diameter[pairs].mean(axis=1) > room
    narrow &= region.single_sheet | _feel_each_other(bubbles.normal, pairs, offset, distance)
    return pairs[narrow], room[narrow]


def _within_reach(position: Floats, size: Floats, rows: Ints) -> Ints:
    """Pairs (m, 2) of the `rows` nearer than the larger of their two sizes, among a few others.

    Octave by octave of the sizes, so that large ones among small do not list thousands.
    """
    octave = np.floor(np.log2(size[rows]))
    found = [np.empty((0, 2), dtype=np.int64)]
    for one in np.unique(octave):
        own, other = rows[octave == one], rows[octave <= one]
        near = cKDTree(position[own]).sparse_distance_matrix(
            cKDTree(position[other]), float(size[own].max()), output_type="ndarray"
        )
        pairs = np.stack([own[near["i"]], other[near["j"]]], axis=1)
        # two of the same octave find each other twice
        found.append(pairs[(size[pairs[:, 1]] < 2.0**one) | (pairs[:, 0] < pairs[:, 1])])
    return np.concatenate(found)


def _feel_each_other(normal: Floats, pairs: Ints, offset: Floats, distance: Floats) -> Bools:
    """Whether two features, (m,), share the material between them: on one sheet or on both sides of an
    edge.
    """
    one, other = normal[pairs[:, 0]], normal[pairs[:, 1]]
    cosine = dots(one, other)
    level = same_sheet(offset[:, None], one[:, None], other[:, None], distance[:, None])[:, 0]
    return np.where(cosine > LEVEL, level, cosine > SHEET_TURN)
