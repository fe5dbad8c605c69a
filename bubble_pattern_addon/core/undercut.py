"""Which features cannot be drawn off along the pull direction of a mould."""

from __future__ import annotations

import numpy as np

from .feature_recipe import Feature
from .feature_sizes import FeatureSizes
from .mesh import Bools, Floats
from .pattern import Pattern
from .section import Extent, opening, rise_of

EVEN = 1e-6
"""Radians by which a wall may lean over and still count as along the pull."""


def undercuts(
    feature: Feature, sizes: FeatureSizes, extent: Extent, pattern: Pattern, normal: Floats
) -> Bools:
    """Which features are undercut, (n,): their steepest wall leans over as seen along the pull direction, or
    the surface faces away from it. None where no pull direction is given.

    pattern: aimed, see pattern.aimed; normal: (n, 3) of the surface. A mesh counts as having upright walls.
    """
    if feature.pull is None:
        return np.zeros(len(pattern), dtype=bool)
    pull = np.array(feature.pull) / np.linalg.norm(feature.pull)
    tilt = np.arccos(np.clip(pattern.normal @ pull, -1, 1))
    return (tilt > wall_draft(feature, sizes, extent, pattern.diameter / 2) + EVEN) | (normal @ pull < -EVEN)


def wall_draft(feature: Feature, sizes: FeatureSizes, extent: Extent, radius: Floats) -> Floats:
    """Angle of the steepest wall to the axis, (n,), radians."""
    if feature.profile == "mesh":
        return np.zeros(len(radius))
    if feature.kind == "hole" or (feature.adds and feature.form == "boss"):
        return np.arctan(sizes.draft)
    rise = rise_of(feature, extent)
    if feature.adds and feature.form == "cone":
        return np.arctan2(radius, rise)
    return np.pi / 2 - opening(radius, rise)
