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

from .distance import boundary_distance
from .floors import Floors, floors_of
from .mesh import Bools, Floats, Ints
from .nominal import SAME, next_above, snapped
from .packing.crowding import uncrowded
from .pattern import Pattern, split
from .recipe import Limits
from .region import Region
from .webs import LEAST_WEB, ROUNDING, narrow_pairs

# Partners of a symmetric pattern whose wished diameters differ by no larger share ask for the same.
SAME_WISH = 1e-6


def limited(bubbles: Pattern, region: Region, limits: Limits) -> Pattern:
    """The pattern within its limits alone; see limited_by."""
    return limited_by(bubbles, region, floors_of(bubbles, region, limits))


def limited_by(bubbles: Pattern, region: Region, floors: Floors, sizes: Floats | None = None) -> Pattern:
    """The pattern with its diameters cut down to the floors, its too small features left out.

    bubbles: with the diameters that the shaping metric asks for, which stay in `wished`, snapped to the
    sizes where these are given
    sizes: (k,) rising, the only diameters there are: every feature gets the nearest smaller one, and one that
    would have to be smaller than all that its floors allow is left out
    """
    wished = bubbles.diameter
    if sizes is not None:
        floors = replace(floors, hole=next_above(floors.diameter, sizes))
    diameter, kept = within_floors(bubbles, region, floors)
    if bubbles.partners is not None:
        order = np.argsort(bubbles.ids)
        partners = order[np.searchsorted(bubbles.ids, bubbles.partners, sorter=order)]
        diameter, kept = _alike(partners, wished, diameter, kept)
    if sizes is not None:
        diameter, nominal = snapped(diameter, sizes), snapped(wished, sizes)
        wished = np.where(nominal > 0, nominal, wished)
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
    """See within_floors."""
    return within_floors(bubbles, region, floors_of(bubbles, region, limits))


def within_floors(bubbles: Pattern, region: Region, floors: Floors) -> tuple[Floats, Bools]:
    """The largest diameters (n,) that the rule above allows, and which features are kept, (n,)."""
    margin = np.maximum(floors.margin, LEAST_WEB / 2 * bubbles.pitch)
    # whoever is farther from the boundary than this keeps every margin
    clear = 1.01 * float((bubbles.diameter / 2 + margin).max(initial=0.0))
    edge = boundary_distance(bubbles.position, region.boundary_segments, clear)
    most = np.minimum(bubbles.diameter, 2 * (edge - margin) * (1 - ROUNDING))
    smallest = floors.diameter * (1 - SAME)
    kept = (most >= smallest) & (most > 0)
    pairs, room = narrow_pairs(bubbles, region, most, kept, floors.web)
    while True:
        diameter = most * _factors(pairs, room, most)
        small = kept & ((diameter < smallest) | (diameter <= 0))
        if not small.any():
            return diameter, kept
        kept &= ~_giving_way(pairs[small[pairs].all(axis=1)], small, most)
        both = kept[pairs].all(axis=1)
        pairs, room = pairs[both], room[both]


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
