"""Do the features' cutters run into one another inside the part?"""

from __future__ import annotations

import numpy as np

from .boxtree import build_tree, close_pairs
from .mesh import Floats, Ints
from .pattern import Pattern


def colliding(pattern: Pattern, chosen: Ints, top: Floats, bottom: Floats) -> Ints:
    """Those of the features `chosen`, (m,), whose cutters run into one another, as on a strongly curved,
    thick wall, (k,).

    top, bottom: (n,) for all features, how far each cutter reaches above and below its centre

    Two cylinders are apart if some direction separates them; the ones tried are both axes and the shortest
    line between the axes.
    """
    if len(chosen) == 0:
        return chosen
    axis, radius = pattern.normal[chosen], pattern.diameter[chosen] / 2
    start = pattern.position[chosen] + top[chosen, None] * axis
    end = pattern.position[chosen] - bottom[chosen, None] * axis
    reach = radius[:, None] * np.sqrt(np.clip(1 - axis**2, 0, 1))
    boxes = np.stack([np.minimum(start, end) - reach, np.maximum(start, end) + reach, start]).transpose(
        2, 0, 1
    )
    met = np.zeros(len(chosen), dtype=bool)
    for one, other in close_pairs(build_tree(boxes)):
        shortest = _shortest(start[one], end[one], start[other], end[other])
        apart = np.zeros(len(one), dtype=bool)
        for way in (axis[one], axis[other], shortest):
            span = [_extent(way, start[k], end[k], axis[k], radius[k]) for k in (one, other)]
            apart |= (span[0][1] < span[1][0]) | (span[1][1] < span[0][0])
        met[one[~apart]] = True
        met[other[~apart]] = True
    return chosen[met]


def _extent(way: Floats, start: Floats, end: Floats, axis: Floats, radius: Floats) -> tuple[Floats, Floats]:
    """From where to where cylinders reach along the unit directions `way`, (m, 3)."""
    aside = radius * np.sqrt(np.clip(1 - np.einsum("ij,ij->i", way, axis) ** 2, 0, 1))
    first, last = np.einsum("ij,ij->i", way, start), np.einsum("ij,ij->i", way, end)
    return np.minimum(first, last) - aside, np.maximum(first, last) + aside


def _shortest(a: Floats, b: Floats, c: Floats, d: Floats) -> Floats:
    """Unit vectors along the shortest line between the segments a-b and c-d, all (m, 3); 0 where they meet.

    The closest points after C. Ericson, Real-Time Collision Detection, section 5.1.9.
    """
    u, v, w = b - a, d - c, a - c
    uu, uv, vv = (np.einsum("ij,ij->i", *both) for both in ((u, u), (u, v), (v, v)))
    uw, vw = np.einsum("ij,ij->i", u, w), np.einsum("ij,ij->i", v, w)
    bent = uu * vv - uv**2
    parallel = bent <= 1e-12 * uu * vv
    s = np.where(parallel, 0, np.clip((uv * vw - uw * vv) / np.where(parallel, 1, bent), 0, 1))
    t = np.clip((uv * s + vw) / vv, 0, 1)
    s = np.clip((uv * t - uw) / uu, 0, 1)
    line = w + s[:, None] * u - t[:, None] * v
    length = np.linalg.norm(line, axis=1)[:, None]
    return line / np.where(length > 0, length, 1)
