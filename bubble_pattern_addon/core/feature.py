"""What one feature is, as geometry: a round hole's profile swept along its normal, for all features at
once.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .errors import RecipeError
from .mesh import Floats, Ints, Mesh
from .pattern import Pattern
from .recipe import Feature

FEWEST_SIDES = 12
DEFAULT_SIDES = 32
MOST_SIDES = 256


@dataclass(frozen=True)
class Cutters:
    """Closed prisms composed into one mesh, disjoint from each other: what the boolean takes away.

    mesh: all prisms, wound outward
    facet: (T,) flat facet every triangle belongs to, numbered through all prisms
    feature: (facets,) feature the facet belongs to
    cap: (facets,) 0 for a facet of the wall, 1 for the top above the surface, -1 for the bottom
    """

    mesh: Mesh
    facet: Ints
    feature: Ints
    cap: Ints


def sides(feature: Feature, diameter: Floats) -> Ints:
    """Number of facets round each hole, (n,), for diameters (n,).

    `feature.sides` is taken as it is. Otherwise the chord height e of a facet decides, with n = pi / acos(1
    - e/r), rounded up to a multiple of four: e is `feature.tolerance`, or, if that is not given, the one
    that gives the widest hole of the pattern 32 facets. Never fewer than 12 nor more than 256.
    """
    if feature.sides is not None:
        if feature.sides < 3:
            raise RecipeError(f"A hole cannot have {feature.sides} sides: give feature.sides 3 or more.")
        return np.full(len(diameter), feature.sides, dtype=np.int64)
    if len(diameter) == 0:
        return np.zeros(0, dtype=np.int64)
    height = feature.tolerance
    if height is None:
        height = diameter.max() / 2 * (1 - np.cos(np.pi / DEFAULT_SIDES))
    elif not height > 0:
        raise RecipeError("feature.tolerance must be above zero: it is the chord height of a hole's facets.")
    turn = np.arccos(np.clip(1 - 2 * height / diameter, -1, 1))
    # the slack keeps a chord height that gives a whole number from being rounded up by its last bit
    count = 4 * np.ceil(np.pi / np.maximum(turn, 1e-9) / 4 - 1e-6)
    return np.clip(count, FEWEST_SIDES, MOST_SIDES).astype(np.int64)


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
    corners, triangles, facets, owners, caps = [], [], [], [], []
    corner_count = facet_count = 0
    for number in np.unique(count):
        mine = np.flatnonzero(count == number)
        prism = _prism(int(number))
        ring = radius[mine, None, None] * (
            prism.circle[:, 0, None] * tangent[mine, None] + prism.circle[:, 1, None] * across[mine, None]
        )
        ring += centre[mine, None]
        up = (top[mine, None] * normal[mine])[:, None]
        down = (bottom[mine, None] * normal[mine])[:, None]
        corners.append(np.concatenate([ring + up, ring - down], axis=1).reshape(-1, 3))
        index = np.arange(len(mine))[:, None]
        triangles.append((prism.triangles + (corner_count + 2 * number * index)[..., None]).reshape(-1, 3))
        facets.append((prism.facet + facet_count + len(prism.cap) * index).ravel())
        owners.append(np.repeat(chosen[mine], len(prism.cap)))
        caps.append(np.tile(prism.cap, len(mine)))
        corner_count += 2 * number * len(mine)
        facet_count += len(prism.cap) * len(mine)
    return Cutters(
        Mesh(_joined(corners, (0, 3), float), _joined(triangles, (0, 3), np.int64)),
        _joined(facets, (0,), np.int64),
        _joined(owners, (0,), np.int64),
        _joined(caps, (0,), np.int64),
    )


def _joined(parts: list[np.ndarray], shape: tuple[int, ...], kind: type) -> np.ndarray:
    if len(parts) == 1:
        return parts[0]
    return np.concatenate(parts) if parts else np.zeros(shape, dtype=kind)


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
    disc = _disc(number)
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


def _disc(number: int) -> Ints:
    """Triangles over the corners 0 .. number-1 of a convex polygon, (number - 2, 3), by cutting off every
    second one.

    A fan would make slivers of a blind hole's floor.
    """
    left = np.arange(number)
    rounds = []
    while len(left) > 2:
        half = len(left) // 2
        after = left[np.arange(2, 2 * half + 1, 2) % len(left)]
        rounds.append(np.stack([left[0 : 2 * half : 2], left[1 : 2 * half : 2], after], axis=1))
        left = left[::2]
    return np.concatenate(rounds)
