"""Features composed into one mesh, ready for one boolean."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .mesh import Floats, Ints, Mesh


@dataclass(frozen=True)
class Cutters:
    """Closed solids composed into one mesh, disjoint from each other: what the boolean takes away or adds.

    mesh: all solids, wound outward
    facet: (T,) flat facet every triangle belongs to, numbered through all solids
    feature: (facets,) feature the facet belongs to
    cap: (facets,) 0 for a facet of the wall, 1 for the top, -1 for the bottom
    """

    mesh: Mesh
    facet: Ints
    feature: Ints
    cap: Ints


Group = tuple[Floats, Ints, Ints, Ints, Ints]
"""Solids alike in their facets: corners (m, v, 3), triangles (t, 3) or (m, t, 3), the facet of each triangle
(t,), the cap of each facet (f,), and the features (m,).
"""


def composed(groups: list[Group]) -> Cutters:
    """All solids of the groups in one mesh."""
    corners, triangles, facets, owners, caps = [], [], [], [], []
    corner_count = facet_count = 0
    for places, shape, facet, cap, features in groups:
        number, each = places.shape[:2]
        index = np.arange(number)[:, None]
        corners.append(places.reshape(-1, 3))
        triangles.append((shape + (corner_count + each * index)[..., None]).reshape(-1, 3))
        facets.append((facet + facet_count + len(cap) * index).ravel())
        owners.append(np.repeat(features, len(cap)))
        caps.append(np.tile(cap, number))
        corner_count += number * each
        facet_count += number * len(cap)
    return Cutters(
        Mesh(joined(corners, (0, 3), float), joined(triangles, (0, 3), np.int64)),
        joined(facets, (0,), np.int64),
        joined(owners, (0,), np.int64),
        joined(caps, (0,), np.int64),
    )


def joined(parts: list[np.ndarray], shape: tuple[int, ...], kind: type) -> np.ndarray:
    """Arrays end to end; of no array one of this shape and kind."""
    if len(parts) == 1:
        return parts[0]
    return np.concatenate(parts) if parts else np.zeros(shape, dtype=kind)


def alternating(number: int) -> Ints:
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
