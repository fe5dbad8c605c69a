"""Plain round holes as geometry: prisms along the normals, for all features at once, the quick way.

Every other kind of feature is lofted (see core.loft), which for a plain hole makes the same prisms.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .cutters import Cutters, alternating, composed
from .feature_recipe import Feature
from .feature_sizes import sides
from .mesh import Floats, Ints
from .pattern import Pattern


def make_cutters(pattern: Pattern, feature: Feature, chosen: Ints, top: Floats, bottom: Floats) -> Cutters:
    """Prisms for the features `chosen`, (m,), from `top` above their centres to `bottom` below, both (m,).

    The corners lie on the circle of the feature's diameter: the hole measures exactly that across corners,
    it never reaches beyond its circle, and no web or margin is thinner than measured between circles.
    (Across flats it is narrower by the factor cos(pi/sides): half a percent for 32 sides.) The first corner
    points along the tangent.
    """
    count = sides(feature, pattern.diameter)[chosen] if len(chosen) else np.zeros(0, dtype=np.int64)
    normal = pattern.normal[chosen]
    tangent = pattern.tangent[chosen]
    tangent = tangent - np.einsum("ij,ij->i", tangent, normal)[:, None] * normal
    tangent /= np.linalg.norm(tangent, axis=1)[:, None]
    across = np.cross(normal, tangent)
    centre, radius = pattern.position[chosen], pattern.diameter[chosen] / 2
    groups = []
    for number in np.unique(count):
        mine = np.flatnonzero(count == number)
        prism = _prism(int(number))
        ring = radius[mine, None, None] * (
            prism.circle[:, 0, None] * tangent[mine, None] + prism.circle[:, 1, None] * across[mine, None]
        )
        ring += centre[mine, None]
        up = (top[mine, None] * normal[mine])[:, None]
        down = (bottom[mine, None] * normal[mine])[:, None]
        corners = np.concatenate([ring + up, ring - down], axis=1)
        groups.append((corners, prism.triangles, prism.facet, prism.cap, chosen[mine]))
    return composed(groups)


@dataclass(frozen=True)
class _Prism:
    """One prism's pattern: circle (s, 2), triangles (4 s - 4, 3) over 2 s corners, facet of each, cap of
    each facet.
    """

    circle: Floats
    triangles: Ints
    facet: Ints
    cap: Ints


def _prism(number: int) -> _Prism:
    angle = np.arange(number) * (2 * np.pi / number)
    here = np.arange(number)
    there = np.roll(here, -1)
    disc = alternating(number)
    triangles = np.concatenate(
        [
            np.stack([here, here + number, there + number], axis=1),
            np.stack([here, there + number, there], axis=1),
            disc,
            disc[:, ::-1] + number,
        ]
    )
    facet = np.concatenate([here, here, np.full(number - 2, number), np.full(number - 2, number + 1)])
    cap = np.concatenate([np.zeros(number, dtype=np.int64), [1, -1]])
    return _Prism(np.stack([np.cos(angle), np.sin(angle)], axis=1), triangles, facet, cap)
