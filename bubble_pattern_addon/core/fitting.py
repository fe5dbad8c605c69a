"""How far every feature reaches above and into the wall under it, and which cannot be made there."""

from __future__ import annotations

import numpy as np

from .feature_recipe import Feature
from .feature_sizes import FeatureSizes
from .mesh import Bools, Floats, Ints
from .pattern import Pattern
from .profile import outlines
from .section import Extent, capped, largest_inset_of, rim_depth
from .wall import CLEARANCE, DEEPEST, Fault, NearWall

CLOSEST = 1e-6
"""Share of its size by which a feature must keep clear of closing up."""
AVERTED = 0.05
"""Cosine of the angle between a surface and an axis that no feature can be made along."""


def looked_for(feature: Feature, sizes: FeatureSizes, pattern: Pattern) -> tuple[Floats, Floats]:
    """How far below and above the centres the wall must be known, both (n,)."""
    deepest = DEEPEST * pattern.diameter
    if feature.kind != "bump" and not feature.through:
        deepest = np.maximum(deepest, 2 * np.nan_to_num(sizes.depth))
    return deepest, sizes.height if feature.adds else np.zeros(len(pattern))


def fitted(
    feature: Feature, sizes: FeatureSizes, pattern: Pattern, wall: NearWall, normal: Floats
) -> tuple[Extent, Ints]:
    """Extents of all features and the Fault of each, (n,).

    pattern: aimed, see pattern.aimed; normal: (n, 3) of the surface
    """
    fault = wall.fault.copy()
    level = wall.surface_low + wall.surface_high
    if feature.adds:
        extent = Extent(sizes.height, _foot(pattern, wall), level)
        _bump_faults(feature, sizes, wall, extent, fault)
    elif feature.through:
        extent = Extent(wall.top, -wall.bottom, level)
    else:
        extent = Extent(wall.top, sizes.depth, level)
        fault[(fault == Fault.THICK) | (fault == Fault.CROWDED)] = Fault.NONE
        if feature.profile != "mesh":
            _mark(fault, wall.far_high >= -sizes.depth * (1 + 1e-9), Fault.BREAKS)
    if not feature.plain and feature.profile != "mesh":
        _shape_faults(feature, sizes, pattern, wall, extent, fault)
    if pattern.normal is not normal:
        fault[np.einsum("ij,ij->i", pattern.normal, normal) < AVERTED] = Fault.AVERTED
    return extent, fault


def _foot(pattern: Pattern, wall: NearWall) -> Floats:
    """How far below its centre a bump starts: inside the wall, below the surface everywhere, (n,)."""
    room = (wall.surface_low - wall.far_high) / 2
    clear = CLEARANCE * pattern.diameter / 2
    return np.where(np.isfinite(room), np.minimum(clear, room), clear) - wall.surface_low


def _bump_faults(feature: Feature, sizes: FeatureSizes, wall: NearWall, extent: Extent, fault: Ints) -> None:
    fault[(fault == Fault.THICK) | (fault == Fault.CROWDED) | (fault == Fault.COVERED)] = Fault.NONE
    _mark(fault, wall.over <= sizes.height * (1 + 1e-9), Fault.COVERED)
    _mark(fault, wall.far_high >= wall.surface_low, Fault.THIN)


def _shape_faults(
    feature: Feature, sizes: FeatureSizes, pattern: Pattern, wall: NearWall, extent: Extent, fault: Ints
) -> None:
    """Mark those whose own sizes, or the bend of the surface, leave no room for their shape."""
    radius = pattern.diameter / 2
    if feature.adds or feature.kind == "dimple":
        rise = extent.top - extent.level if feature.adds else extent.bottom + extent.level
        _mark(fault, rise <= CLOSEST * radius, Fault.FLAT)
    if feature.kind == "dimple":
        _mark(fault, sizes.depth > radius * (1 + CLOSEST), Fault.STEEP_CAP)
    if capped(feature) or (feature.adds and feature.form == "cone"):
        return
    deep = rim_depth(feature, sizes)
    if feature.adds:
        least = extent.top - extent.level
    elif feature.through:
        least = extent.level - np.nan_to_num(wall.far_high, nan=-np.inf)
    else:
        least = extent.level + extent.bottom
    if feature.rim != "sharp":
        _mark(fault, deep >= least * (1 - CLOSEST), Fault.RIM)
    if feature.rim == "sharp" and not sizes.draft.any():
        return
    room = outlines(feature, pattern.diameter, sizes.aspect, 12).room
    _mark(fault, largest_inset_of(feature, sizes, extent) >= room * (1 - CLOSEST), Fault.CLOSED)


def _mark(fault: Ints, found: Bools, name: Fault) -> None:
    """Give the fault to those that have none yet."""
    fault[found & (fault == Fault.NONE)] = name
