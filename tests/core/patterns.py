"""Patterns strewn over a region by hand, for tests that do not depend on the packing."""

from __future__ import annotations

import numpy as np

from bubble_pattern_addon.core.metric import Places
from bubble_pattern_addon.core.pattern import Pattern
from bubble_pattern_addon.core.region import Region


def spread(region: Region, count: int, size: float = 0.01, seed: int = 0) -> Pattern:
    """Features of the same size at random places, evenly by area; they may touch one another."""
    random = np.random.default_rng(seed)
    area = np.linalg.norm(region.area_vectors, axis=1)
    row = np.sort(random.choice(len(area), count, p=area / area.sum()))
    barycentric = random.dirichlet([1, 1, 1], count)
    position = np.einsum("nk,nkc->nc", barycentric, region.corners[row])
    normal = region.normals[row]
    edge = region.corners[row, 1] - region.corners[row, 0]
    return Pattern(
        places=Places(position, region.triangles[row], barycentric),
        normal=normal,
        tangent=edge / np.linalg.norm(edge, axis=1, keepdims=True),
        pitch=np.full(count, 2 * size),
        diameter=np.full(count, size),
        row=np.zeros(count, dtype=np.int64),
    )
