"""How thick the near wall is under every feature, before anything is cut."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from .mesh import Floats, digest
from .pattern import Pattern
from .region import Region
from .wall import DEEPEST, near_wall

# A probe this wide, in pitches, finds the wall under a feature's middle, whatever size the feature gets.
PROBE = 0.02

_known: dict[bytes, Floats] = {}
"""The walls measured last, by the digest of places and base: a designer tries many sizes on one packing."""


def near_thickness(pattern: Pattern, region: Region) -> Floats:
    """Thickness of the base's near wall along every feature's axis, (n,); nan where there is no far side
    within DEEPEST pitches, as under an open surface.
    """
    if not len(pattern):
        return np.zeros(0)
    key = digest(pattern.position, pattern.normal, pattern.pitch, region.base.vertices, region.base.triangles)
    if key not in _known:
        probe = replace(pattern, diameter=PROBE * pattern.pitch)
        thickness = near_wall(region.base, region.tree, probe, DEEPEST * pattern.pitch).thickness
        thickness.flags.writeable = False
        _known.clear()
        _known[key] = thickness
    return _known[key]
