"""A feature from bottom to top: outlines at heights, moved inward by draft and rim, or shrunk to a tip.

Heights are along the axis, 0 on the surface at the centre. The rim of a hole, the foot of a bump and the edge
of a dimple lie at the level where the surface is under the feature's edge: on a curved surface below or above
the centre. Beyond the level an outline goes on straight: nothing of a feature is wider than its diameter.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .feature_recipe import Feature
from .feature_sizes import FeatureSizes, rings
from .mesh import Floats, Ints


@dataclass(frozen=True)
class Extent:
    """From where to where features reach, all (n,): `top` above their centres, `bottom` below, and the level
    of the surface under their edges, above the centre.
    """

    top: Floats
    bottom: Floats
    level: Floats

    def take(self, which: Ints) -> Extent:
        """Those of the features `which`, (m,)."""
        return Extent(self.top[which], self.bottom[which], self.level[which])


@dataclass(frozen=True)
class Sections:
    """Outlines of n features from bottom to top, s of them: height, inset and scale are (n, s).

    low_tip, high_tip: the first, the last one is a single point on the axis
    """

    height: Floats
    inset: Floats
    scale: Floats
    low_tip: bool = False
    high_tip: bool = False


def capped(feature: Feature) -> bool:
    """Does the feature end in a spherical cap?"""
    return feature.kind == "dimple" or (feature.kind == "bump" and feature.form == "dome")


def ring_counts(feature: Feature, sizes: FeatureSizes, extent: Extent, radius: Floats, chord: Floats) -> Ints:
    """Facets from the rim to the end of every feature's rounding, (n,), for the chord heights `chord`, (n,);
    0 where there is no rounding.
    """
    if capped(feature):
        rise = rise_of(feature, extent)
        ball = np.maximum((radius**2 + rise**2) / (2 * rise), rise)
        return rings(ball, opening(radius, rise), chord)
    if feature.rim == "fillet":
        return rings(sizes.rim, np.pi / 2 - np.arctan(sizes.draft), chord)
    return np.zeros(len(radius), dtype=np.int64)


def sections(feature: Feature, sizes: FeatureSizes, extent: Extent, radius: Floats, count: int) -> Sections:
    """Sections of features with `count` facets along their roundings, see `ring_counts`; radius: (n,)."""
    if feature.kind == "hole":
        return _hole(feature, sizes, extent, count)
    if feature.kind == "bump" and feature.form == "boss":
        return _boss(feature, sizes, extent, count)
    if feature.kind == "bump" and feature.form == "cone":
        return _ended(extent, [extent.top], [0 * radius], True)
    rise = rise_of(feature, extent)
    heights, scales = _cap(radius, rise, count)
    up = feature.kind == "bump"
    return _ended(extent, [extent.level + height * (1 if up else -1) for height in heights], scales, up)


def rim_inset(feature: Feature, sizes: FeatureSizes) -> Floats:
    """How far a hole's rim reaches inward, (n,)."""
    if feature.rim == "fillet":
        return sizes.rim * np.cos(np.arctan(sizes.draft))
    return sizes.rim


def rim_depth(feature: Feature, sizes: FeatureSizes) -> Floats:
    """How far a rim reaches from the surface, or from a boss's top, along the axis, (n,)."""
    if feature.rim == "chamfer":
        return sizes.rim / np.tan(np.radians(feature.rim_angle / 2))
    if feature.rim == "fillet":
        slope = np.arctan(sizes.draft)
        if feature.kind == "hole":
            return sizes.rim * (1 - np.sin(slope))
        return _tangent(sizes) * np.cos(slope)
    return sizes.rim


def largest_inset_of(feature: Feature, sizes: FeatureSizes, extent: Extent) -> Floats:
    """How far the outline moves inward over the whole feature, (n,)."""
    if feature.kind == "hole":
        straight = extent.level + extent.bottom - rim_depth(feature, sizes)
        return rim_inset(feature, sizes) + sizes.draft * straight
    rise = extent.top - extent.level
    if feature.rim == "fillet":
        return sizes.draft * rise + _tangent(sizes)
    return sizes.draft * (rise - rim_depth(feature, sizes)) + sizes.rim


def rise_of(feature: Feature, extent: Extent) -> Floats:
    """Height of a cap over its edge, (n,)."""
    return extent.top - extent.level if feature.kind == "bump" else extent.bottom + extent.level


def opening(radius: Floats, rise: Floats) -> Floats:
    """Angle between the axis and the edge of a cap as seen from its ball's centre, (n,): at most a right
    angle, where the cap is a half ball, or, if it rises higher, half an ellipsoid.
    """
    return 2 * np.arctan2(np.minimum(rise, radius), radius)


def _cap(radius: Floats, rise: Floats, count: int) -> tuple[list[Floats], list[Floats]]:
    """Heights over its edge and shares of the outline of a cap's `count` rings, the last one its tip."""
    whole = opening(radius, rise)
    heights, scales = [], []
    for ring in range(1, count + 1):
        angle = whole * (1 - ring / count)
        scales.append(np.sin(angle) / np.sin(whole))
        heights.append(rise * (np.cos(angle) - np.cos(whole)) / (1 - np.cos(whole)))
    return heights, scales


def _ended(extent: Extent, heights: list[Floats], scales: list[Floats], up: bool) -> Sections:
    """A straight piece up to the level and from there shrinking sections to a tip: at the top, or at the
    bottom.
    """
    start = -extent.bottom if up else extent.top
    one = np.ones_like(start)
    height = np.stack([start, extent.level, *heights], axis=1)
    scale = np.stack([one, one, *scales], axis=1)
    if not up:
        height, scale = height[:, ::-1], scale[:, ::-1]
    return Sections(height, np.zeros_like(height), scale, not up, up)


def _hole(feature: Feature, sizes: FeatureSizes, extent: Extent, count: int) -> Sections:
    none = np.zeros_like(extent.top)
    stack = [(extent.top, none)]
    slope = np.arctan(sizes.draft)
    if feature.rim == "fillet":
        for ring in range(count + 1):
            angle = (np.pi / 2 - slope) * ring / count
            stack.append((extent.level - sizes.rim * (1 - np.cos(angle)), sizes.rim * np.sin(angle)))
    elif feature.rim == "chamfer":
        stack += [(extent.level, none), (extent.level - rim_depth(feature, sizes), sizes.rim)]
    elif sizes.draft.any():
        stack.append((extent.level, none))
    stack.append((-extent.bottom, largest_inset_of(feature, sizes, extent)))
    return _straight(stack[::-1])


def _boss(feature: Feature, sizes: FeatureSizes, extent: Extent, count: int) -> Sections:
    none = np.zeros_like(extent.top)
    stack = [(-extent.bottom, none)]
    if sizes.draft.any():
        stack.append((extent.level, none))
    rise = extent.top - extent.level
    if feature.rim == "fillet":
        slope = np.arctan(sizes.draft)
        middle = sizes.draft * rise + _tangent(sizes)
        for ring in range(count + 1):
            angle = slope + (np.pi / 2 - slope) * ring / count
            height = extent.top - sizes.rim * (1 - np.sin(angle))
            stack.append((height, middle - sizes.rim * np.cos(angle)))
        return _straight(stack)
    start = rise - rim_depth(feature, sizes)
    if feature.rim == "chamfer":
        stack.append((extent.level + start, sizes.draft * start))
    stack.append((extent.top, sizes.draft * start + sizes.rim))
    return _straight(stack)


def _tangent(sizes: FeatureSizes) -> Floats:
    """Length that a boss's fillet takes off its top and off its wall, (n,)."""
    return sizes.rim * np.tan(np.pi / 4 - np.arctan(sizes.draft) / 2)


def _straight(stack: list[tuple[Floats, Floats]]) -> Sections:
    height = np.stack([at for at, _ in stack], axis=1)
    inset = np.stack([inward for _, inward in stack], axis=1)
    return Sections(height, inset, np.ones_like(height))
