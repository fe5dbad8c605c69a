"""Who stands next to whom in a pattern."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .mesh import Floats, Ints
from .packing.force import find_pairs
from .pattern import Pattern
from .region import Region
from .surface import Charts, on_region

# Bubbles closer than this many stable distances are in neighbouring rows, or in the same.
TOUCHING = 1.35


class Links(NamedTuple):
    """Pairs of neighbouring bubbles, each pair once.

    first, second: (m,) numbers of bubbles; distance: (m,) of their centres; reach: (m,) the distance up to
    which the two count as neighbours
    """

    first: Ints
    second: Ints
    distance: Floats
    reach: Floats


def find_links(charts: Charts, points: Floats, row: Ints, pitch: Floats) -> Links:
    """Links between bubbles at `points` (n, 3) on the region's triangles `row` (n,), with these local
    pitches.
    """
    pairs = find_pairs(charts, points, row, pitch, 0.0)
    distance = np.linalg.norm(points[pairs.first] - points[pairs.second], axis=1)
    reach = TOUCHING * pairs.stable
    near = distance < reach
    return Links(pairs.first[near], pairs.second[near], distance[near], reach[near])


def links_of(pattern: Pattern, region: Region) -> Links:
    """Links between the features of a pattern on its region."""
    row = on_region(region, pattern.places).row
    return find_links(region.charts, pattern.position, row, pattern.pitch)
