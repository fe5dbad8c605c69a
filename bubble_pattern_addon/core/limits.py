"""Limits that hold: smallest web, margin and diameter, whatever the shaping metric asks for.

Features only ever shrink. The margin comes first: a feature is made as small as its distance to the region's
boundary demands. Then the webs: where two features leave too little between them, both are scaled by the same
factor, the one that makes their web fit; a feature with several such neighbours is scaled by the smallest of
its factors. So the result does not hang on any order, sizes keep their proportion where they meet, and no web
can be too narrow in the end: the scaled diameters of every pair are at most those its own factor gives.

What would come out smaller than the least diameter is left out. Where two such features are in each other's
way the smaller one goes (of equals the later one), and the other is measured anew.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.spatial import cKDTree

from .distance import boundary_distance
from .mesh import Bools, Floats, Ints
from .neighbours import SHEET_TURN, same_sheet
from .packing.crowding import uncrowded
from .pattern import Pattern, split
from .recipe import Limits
from .region import Region

# Features that touched would make a part that is no solid: this share of the pitch remains between two of
# them, and half as much to the boundary, where the limits ask for less.
LEAST_WEB = 0.02
# Normals that agree this well are of one face or of faces one above the other, not on both sides of an edge.
LEVEL = 0.7
# Partners of a symmetric pattern whose wished diameters differ by no larger share ask for the same.
SAME_WISH = 1e-6
# Webs come out wider than asked by this, so that rounding takes nothing off them.
ROUNDING = 1e-12


def limited(bubbles: Pattern, region: Region, limits: Limits) -> Pattern:
    """The pattern with its diameters cut down to the limits, its too small features left out.

    bubbles: with the diameters that the shaping metric asks for, which stay in `wished`
    """
    wished = bubbles.diameter
    diameter, kept = within_limits(bubbles, region, limits)
    if bubbles.partners is not None:
        order = np.argsort(bubbles.ids)
        partners = order[np.searchsorted(bubbles.ids, bubbles.partners, sorter=order)]
        diameter, kept = _alike(partners, wished, diameter, kept)
    return split(replace(bubbles, diameter=np.where(kept, diameter, 0.0), wished=wished), kept)


def _alike(partners: Ints, wished: Floats, diameter: Floats, kept: Bools) -> tuple[Floats, Bools]:
    """Diameters and who is kept, (n,), the same for partners (n, k) that ask for the same.

    What is limited has no reason to be left out on one side only; smaller features keep every limit.
    """
    asked = wished[partners]
    alike = np.ptp(asked, axis=1) <= SAME_WISH * asked.max(axis=1)
    both = np.where(alike, kept[partners].all(axis=1), kept)
    return np.where(alike, diameter[partners].min(axis=1), diameter), both


def within_limits(bubbles: Pattern, region: Region, limits: Limits) -> tuple[Floats, Bools]:
    """The largest diameters (n,) that the rule above allows, and which features are kept, (n,)."""
    margin = np.maximum(limits.min_margin, LEAST_WEB / 2 * bubbles.pitch)
    # whoever is farther from the boundary than this keeps every margin
    clear = 1.01 * float((bubbles.diameter / 2 + margin).max(initial=0.0))
    edge = boundary_distance(bubbles.position, region.boundary_segments, clear)
    most = np.minimum(bubbles.diameter, 2 * (edge - margin) * (1 - ROUNDING))
    smallest = max(limits.min_diameter, 0.0)
    kept = (most >= smallest) & (most > 0)
    pairs, room = narrow_pairs(bubbles, region, most, kept, limits.min_web)
    while True:
        diameter = most * _factors(pairs, room, most)
        small = kept & ((diameter < smallest) | (diameter <= 0))
        if not small.any():
            return diameter, kept
        kept &= ~_giving_way(pairs[small[pairs].all(axis=1)], small, most)
        both = kept[pairs].all(axis=1)
        pairs, room = pairs[both], room[both]


def narrow_pairs(
    bubbles: Pattern, region: Region, diameter: Floats, kept: Bools, min_web: float
) -> tuple[Ints, Floats]:
    """Pairs (m, 2) of `kept` (n,) features that leave less than the least web, and their room, (m,): the most
    that the mean of their two diameters may be.

    Features on both sides of a thin wall are none, nor those of faces one above the other.
    """
    position, pitch = bubbles.position, bubbles.pitch
    size = diameter + np.maximum(min_web, LEAST_WEB * pitch)
    pairs = _within_reach(position, size, np.flatnonzero(kept))
    offset = position[pairs[:, 1]] - position[pairs[:, 0]]
    distance = np.linalg.norm(offset, axis=1)
    least = np.maximum(min_web, LEAST_WEB * pitch[pairs].mean(axis=1))
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
    cosine = np.einsum("mc,mc->m", one, other)
    level = same_sheet(offset[:, None], one[:, None], other[:, None], distance[:, None])[:, 0]
    return np.where(cosine > LEVEL, level, cosine > SHEET_TURN)


def _factors(pairs: Ints, room: Floats, diameter: Floats) -> Floats:
    """By what every feature is scaled, (n,)."""
    factor = np.ones(len(diameter))
    share = np.maximum(room, 0.0) / diameter[pairs].mean(axis=1)
    np.minimum.at(factor, pairs[:, 0], share)
    np.minimum.at(factor, pairs[:, 1], share)
    return factor


def _giving_way(rivals: Ints, small: Bools, diameter: Floats) -> Bools:
    """Which of the too `small` (n,) features are left out now, (n,).

    rivals: (k, 2) pairs of them in each other's way; diameter: (n,) what they would be without
    """
    rank = np.lexsort((np.arange(len(diameter)), -diameter)).argsort()
    contested = np.zeros(len(diameter), dtype=bool)
    contested[rivals] = True
    return small & (~contested | ~uncrowded(rivals, rank))
