"""From a pattern's settings to the recipe's feature, and back."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from typing import Any

import bpy
import numpy as np

from ..core.errors import RecipeError
from ..core.feature_recipe import ASPECTS, ROUNDED, SIZES, Feature, Size
from ..core.metric import Constant, Described
from ..core.toml_values import Point
from .field_properties import point_of, typed
from .field_recipe import described, in_degrees, take
from .reading import transformed, world_frame

# Keys that change the pattern's points, whatever their values.
PLACING = (
    *("profile", "corners", "rounding", "points", "aspect", "axis", "angle"),
    *("turn", "turn_direction", "turn_point", "turn_attribute", "turn_seed"),
)


def feature_of(settings: Any) -> Feature:
    """The feature that `settings` stand for: what goes with its kind, whatever else was set before.

    Raises RecipeError where an object is not chosen yet.
    """
    kind, profile = settings.kind.lower(), settings.profile.lower()
    mesh = profile == "mesh"
    boss = kind == "bump" and settings.form == 'BOSS'
    walled = not mesh and (kind == "hole" or boss)
    rim = settings.rim.lower() if walled else "sharp"
    feature = Feature(
        kind=kind,
        depth=_depth(settings) if kind != "bump" else None,
        height=_height(settings) if kind == "bump" else None,
        draft=_angle(settings, "draft") if walled else 0.0,
        rim=rim,
        rim_size=typed(settings.rim_size) or None if rim != "sharp" else None,
        rim_angle=in_degrees(settings.rim_angle) if rim == "chamfer" else 90.0,
        profile=profile,
        across=settings.across.lower() if profile == "circle" else "corners",
        aspect=_aspect(settings) if profile in ASPECTS else None,
        corners=settings.corners if profile == "polygon" else 6,
        rounding=typed(settings.rounding) if profile in ROUNDED else 0.0,
        sides=None if mesh else settings.sides or None,
        tolerance=None if mesh else typed(settings.facet_tolerance) or None,
        angle=_angle(settings, "angle"),
    )
    if kind == "bump" and not mesh:
        feature = replace(feature, form=settings.form.lower())
    return _standing(settings, _named(settings, feature))


def _named(settings: Any, feature: Feature) -> Feature:
    """The feature with the objects that its profile names."""
    if feature.profile == "curve":
        points = json.loads(settings.profile_points or "[]")
        if not points and settings.profile_curve is not None:
            raise RecipeError(
                f'[feature] profile: "{settings.profile_curve.name}" is not one closed loop: close the '
                "curve, or use one with a single outline"
            )
        if not points:
            raise RecipeError("[feature] profile follows a closed curve: choose one")
        return replace(feature, points=tuple((x, y) for x, y in points))
    if feature.profile == "mesh":
        if settings.profile_mesh is None:
            raise RecipeError("[feature] profile is a mesh object: choose one")
        return replace(feature, mesh=settings.profile_mesh.name)
    return feature


def _standing(settings: Any, feature: Feature) -> Feature:
    """The feature with its axis and where it heads."""
    turn = settings.turn.lower()
    facing = turn in ("towards", "around")
    if turn == "attribute" and not settings.turn_attribute:
        raise RecipeError("[feature] turn follows an attribute of vectors: choose it")
    return replace(
        feature,
        axis=typed(settings.axis) if settings.use_pull else 0.0,
        pull=point_of(settings.pull) if settings.use_pull else None,
        turn=turn,
        turn_direction=point_of(settings.turn_direction) if turn == "fixed" else None,
        turn_point=_turn_point(settings) if facing else None,
        turn_attribute=settings.turn_attribute if turn == "attribute" else None,
        turn_seed=settings.turn_seed if turn == "random" else 0,
    )


def _turn_point(settings: Any) -> Point:
    if settings.turn_object is None:
        return point_of(settings.turn_point)
    at = np.array(settings.turn_object.matrix_world.translation, dtype=np.float64)
    return point_of(transformed(at[None], np.linalg.inv(world_frame(settings.base)))[0])


def _plain(size: Described) -> Size:
    return size.value if isinstance(size, Constant) else size


def _depth(settings: Any) -> Size | None:
    if settings.kind == 'HOLE' and settings.depth_mode == 'THROUGH':
        return None
    constant = settings.depth if settings.kind == 'HOLE' else settings.dimple_depth
    return _plain(described(settings.depth_field, constant, "size", "[feature] depth")) or None


def _height(settings: Any) -> Size | None:
    return _plain(described(settings.depth_field, settings.height, "size", "[feature] height")) or None


def _aspect(settings: Any) -> Size:
    return _plain(described(settings.aspect_field, settings.aspect, "share", "[feature] aspect"))


def _angle(settings: Any, key: str) -> Size:
    field, constant = getattr(settings, f"{key}_field"), getattr(settings, key)
    return _plain(described(field, constant, "angle", f"[feature] {key}"))


def take_feature(settings: Any, feature: Feature) -> None:
    """Set the settings to what `feature` says."""
    for name in ("kind", "form", "rim", "profile", "across", "turn"):
        setattr(settings, name, getattr(feature, name).upper())
    _take_depth(settings, feature)
    for name in ("draft", "angle"):
        _take_size(settings, name, getattr(settings, f"{name}_field"), getattr(feature, name), "angle")
    _take_size(settings, "aspect", settings.aspect_field, feature.aspect, "share")
    if feature.aspect is None:
        settings.aspect = ASPECTS.get(feature.profile, 0.5)
    settings.rim_size = feature.rim_size or 0.0
    settings.rim_angle = math.radians(feature.rim_angle)
    settings.corners, settings.rounding = feature.corners, feature.rounding
    settings.profile_points = json.dumps(feature.points) if feature.points else ""
    if feature.mesh is not None:
        settings.profile_mesh = bpy.data.objects.get(feature.mesh)
    settings.use_pull, settings.axis = feature.pull is not None, feature.axis
    for name in ("pull", "turn_direction", "turn_point"):
        if getattr(feature, name) is not None:
            setattr(settings, name, getattr(feature, name))
    settings.turn_object = None
    settings.turn_attribute = feature.turn_attribute or ""
    settings.turn_seed = feature.turn_seed
    settings.sides = feature.sides or 0
    settings.facet_tolerance = feature.tolerance or 0.0


def _take_depth(settings: Any, feature: Feature) -> None:
    settings.depth_mode = 'BLIND' if feature.kind == "hole" and feature.depth is not None else 'THROUGH'
    constants = {"hole": "depth", "dimple": "dimple_depth", "bump": "height"}
    size = feature.height if feature.kind == "bump" else feature.depth
    if size is None and feature.kind != "hole":
        size = 0.0
    _take_size(settings, constants[feature.kind], settings.depth_field, size, "size")


def _take_size(settings: Any, constant: str, field: Any, size: Size | None, unit: str) -> None:
    if isinstance(size, Described):
        take(field, size, unit)
        return
    field.kind = 'CONSTANT'
    if size is not None:
        setattr(settings, constant, math.radians(size) if unit == "angle" else size)


def placing(feature: Feature) -> Feature:
    """What the pattern's points depend on: where features head, their varying sizes, and what they cover."""
    kept: dict[str, Any] = {name: getattr(feature, name) for name in PLACING}
    kept |= {name: getattr(feature, name) for name in SIZES if isinstance(getattr(feature, name), Described)}
    if feature.axis:
        kept["pull"] = feature.pull
    return replace(Feature(), **kept)
