"""The sizes of every feature of a pattern, and how many facets its roundings have."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .errors import RecipeError
from .feature_recipe import ASPECTS, BUMP_HEIGHT, DIMPLE_DEPTH, RIM_SIZE, Feature
from .mesh import Floats, Ints
from .metric import Described
from .pattern import Pattern
from .profile import outlines

FEWEST_SIDES = 12
DEFAULT_SIDES = 32
MOST_SIDES = 256
FEWEST_RINGS = 2
MOST_RINGS = 64


@dataclass(frozen=True)
class FeatureSizes:
    """Sizes of n features, all (n,).

    depth: below the surface, nan for a hole through the wall; height: above it; draft: tangent of the angle
    of the wall to the axis; aspect: narrow over long side; rim: width of the chamfer or radius of the fillet,
    0 for a sharp rim
    """

    depth: Floats
    height: Floats
    draft: Floats
    aspect: Floats
    rim: Floats

    def take(self, which: Ints) -> FeatureSizes:
        """Those of the features `which`, (m,)."""
        return FeatureSizes(
            self.depth[which], self.height[which], self.draft[which], self.aspect[which], self.rim[which]
        )


def feature_sizes(feature: Feature, pattern: Pattern) -> FeatureSizes:
    """Sizes of the pattern's features. A field has been laid over the region already (see heading.headed):
    RecipeError where the pattern knows nothing of it.
    """
    default_depth = DIMPLE_DEPTH * pattern.diameter if feature.kind == "dimple" else np.nan
    rim = RIM_SIZE * pattern.diameter if feature.rim_size is None else feature.rim_size
    return FeatureSizes(
        depth=_size(feature, pattern, "depth", default_depth),
        height=_size(feature, pattern, "height", BUMP_HEIGHT * pattern.diameter),
        draft=np.tan(np.radians(_size(feature, pattern, "draft", 0.0))),
        aspect=_size(feature, pattern, "aspect", ASPECTS.get(feature.profile, 1.0)),
        rim=np.broadcast_to(0.0 if feature.rim == "sharp" else rim, len(pattern)).astype(np.float64),
    )


def depths(feature: Feature, pattern: Pattern) -> Floats:
    """How deep the features go below the surface, (n,): nan for holes through the wall, 0 for bumps."""
    if feature.kind == "bump":
        return np.zeros(len(pattern))
    return feature_sizes(feature, pattern).depth


def narrowness(feature: Feature, pattern: Pattern) -> Floats:
    """Width of the features where they are narrowest, relative to their diameters, (n,): of a slot its width,
    of a cross that of its bars. A mesh counts as its circle.
    """
    if feature.profile in ("circle", "mesh"):
        return np.ones(len(pattern))
    aspect = feature_sizes(feature, pattern).aspect
    kinds, which = np.unique(aspect, return_inverse=True)
    room = outlines(feature, np.full(len(kinds), 2.0), kinds, DEFAULT_SIDES).room
    return np.broadcast_to(room, len(kinds))[which.reshape(-1)]


def _size(feature: Feature, pattern: Pattern, key: str, default: float | Floats) -> Floats:
    size = getattr(feature, key)
    if isinstance(size, Described):
        if key not in pattern.sizes:
            raise RecipeError(
                f"[feature] {key} is a field that has not been laid over the pattern: lay it anew"
            )
        return pattern.sizes[key]
    return np.broadcast_to(default if size is None else size, len(pattern)).astype(np.float64)


def sides(feature: Feature, diameter: Floats) -> Ints:
    """Number of facets round each feature, (n,), for diameters (n,).

    `feature.sides` is taken as it is. Otherwise the chord height e of a facet decides, with n = pi / acos(1
    - e/r), rounded up to a multiple of four: e is `feature.tolerance`, or, if that is not given, the one
    that gives the widest feature of the pattern 32 facets. Never fewer than 12 nor more than 256.
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


def chord_height(diameter: Floats, count: Ints) -> Floats:
    """Height of the arc over a facet of circles with `count` facets, (n,)."""
    return diameter / 2 * (1 - np.cos(np.pi / count))


def rings(radius: Floats, angle: Floats, chord: Floats) -> Ints:
    """Into how many facets arcs of these radii and angles are cut for this chord height, all (n,)."""
    step = 2 * np.arccos(np.clip(1 - chord / np.maximum(radius, 1e-300), -1, 1))
    return np.clip(np.ceil(angle / step - 1e-6), FEWEST_RINGS, MOST_RINGS).astype(np.int64)
