"""A recipe and a pattern seen from another frame: their points and directions after a rigid motion."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import fields, replace
from typing import Any

import numpy as np

from .blending import FaceSet
from .feature_recipe import Feature
from .isometries import OFF, Isometries, isometries
from .keep_out import frame_along
from .mesh import Floats
from .metric import Described, Places
from .painted import Image, mean_normal, upward
from .pattern import Pattern
from .recipe import KeepOut, Recipe
from .region import Region
from .toml_values import Point

# Vectors nearer to an axis than this are the axis: moved there and back, they are again.
AXIS = 1e-6
POINTS = {"start", "end", "centre", "near", "points", "lines"}
DIRECTIONS = {"direction", "axis", "project", "up"}


def moved_recipe(recipe: Recipe, matrix: Floats, region: Region) -> Recipe:
    """The recipe that makes, on everything moved by `matrix` (4, 4), a rotation and a translation, what
    `recipe` makes on `region`.
    """
    if np.array_equal(matrix, np.eye(4)):
        return recipe
    packing, shaping, choice = recipe.packing, recipe.shaping, recipe.region
    orientation, projection = packing.orientation, recipe.output.projection
    if not isinstance(orientation, str):
        orientation = _turned(orientation, matrix)
    if not isinstance(projection, str):
        projection = _turned(projection, matrix)
    centre = packing.symmetry_centre
    keep_outs = tuple(_moved_keep_out(keep_out, matrix) for keep_out in choice.keep_out)
    near = None if choice.near is None else _moved_point(choice.near, matrix)
    seeds = tuple(replace(seed, at=_moved_point(seed.at, matrix)) for seed in shaping.seeds)
    return replace(
        recipe,
        region=replace(choice, near=near, keep_out=keep_outs),
        packing=replace(
            packing,
            pitch=moved(packing.pitch, matrix, region),
            orientation=orientation,
            symmetry_centre=None if centre is None else _moved_point(centre, matrix),
            symmetry_axes=_moved_axes(packing.symmetry_axes, matrix) if packing.symmetry != OFF else (),
            pins=tuple(_moved_point(pin, matrix) for pin in packing.pins),
        ),
        shaping=replace(shaping, diameter=moved(shaping.diameter, matrix, region), seeds=seeds),
        feature=moved_feature(recipe.feature, matrix, region),
        output=replace(recipe.output, projection=projection),
    )


def _moved_axes(axes: tuple[Point, ...], matrix: Floats) -> tuple[Point, ...]:
    """What a symmetry calls x, y and z after the motion; none where these are the axes themselves."""
    turned = (np.array(axes) if axes else np.eye(3)) @ matrix[:3, :3].T
    if np.abs(turned - np.eye(3)).max() < AXIS:
        return ()
    return tuple((x, y, z) for x, y, z in turned.tolist())


def moved_pattern(pattern: Pattern, matrix: Floats, factor: float = 1.0) -> Pattern:
    """`pattern` after the rigid motion `matrix` (4, 4), and then `factor` times as large."""
    turn = matrix[:3, :3].T
    places = pattern.places
    position = (places.position @ turn + matrix[:3, 3]) * factor
    return replace(
        pattern,
        places=Places(position, places.triangle, places.barycentric),
        normal=pattern.normal @ turn,
        tangent=pattern.tangent @ turn,
        pitch=pattern.pitch * factor,
        diameter=pattern.diameter * factor,
        wished=None if pattern.wished is None else pattern.wished * factor,
        axis=None if pattern.axis is None else pattern.axis @ turn,
        heading=None if pattern.heading is None else pattern.heading @ turn,
        isometries=None if pattern.isometries is None else _moved_group(pattern.isometries, matrix, factor),
        sizes={
            name: values * factor if name in ("depth", "height") else values
            for name, values in pattern.sizes.items()
        },
        dropped=None if pattern.dropped is None else moved_pattern(pattern.dropped, matrix, factor),
    )


def _moved_group(group: Isometries, matrix: Floats, factor: float) -> Isometries:
    """The isometries that move what has been moved as these moved it before."""
    turn = matrix[:3, :3]
    centre = (turn @ group.centre + matrix[:3, 3]) * factor
    return isometries(group.word, centre, group.axes @ turn.T)


def moved_feature(feature: Feature, matrix: Floats, region: Region) -> Feature:
    """The feature after the motion of everything."""
    pull, heads, point = feature.pull, feature.turn_direction, feature.turn_point
    return replace(
        feature.with_fields(lambda field: moved(field, matrix, region)),
        pull=None if pull is None else _turned(pull, matrix),
        turn_direction=None if heads is None else _turned(heads, matrix),
        turn_point=None if point is None else _moved_point(point, matrix),
    )


def _moved_keep_out(keep_out: KeepOut, matrix: Floats) -> KeepOut:
    """A keep-out after the motion; what the recipe leaves to its default is written out where that turns."""
    found: dict[str, Point] = {}
    for key in ("sphere", "cylinder", "box"):
        at = getattr(keep_out, key)
        if at is not None:
            found[key] = _moved_point(at, matrix)
    axis = keep_out.axis
    if axis is None and (keep_out.cylinder or keep_out.box or keep_out.file):
        axis = 0.0, 0.0, 1.0
    if axis is not None:
        found["axis"] = _turned(axis, matrix)
    if keep_out.box is not None and axis is not None:
        along = None if keep_out.along is None else np.array(keep_out.along)
        found["along"] = _turned(_point(frame_along(np.array(axis), along)[0]), matrix)
    return replace(keep_out, **found)  # type: ignore[arg-type]


def moved(described: Described, matrix: Floats, region: Region) -> Described:
    """The field after the motion `matrix` (4, 4) of everything; `region`: where it is before."""
    result = _moved(described, matrix, region)
    assert isinstance(result, Described)
    return result


def _moved(value: Any, matrix: Floats, region: Region) -> Any:
    if isinstance(value, tuple):
        return tuple(_moved(entry, matrix, region) for entry in value)
    if not isinstance(value, (Described, FaceSet)):
        return value
    if isinstance(value, Image) and value.uv is None and value.up is None:
        # upright is by an axis of the frame, which stays behind
        sight = mean_normal(region) if value.project is None else np.array(value.project)
        x, y, z = upward(sight / np.linalg.norm(sight)).tolist()
        value = replace(value, up=(x, y, z))
    parts = {}
    for entry in fields(value):  # type: ignore[arg-type]
        content = getattr(value, entry.name)
        if entry.name in POINTS:
            parts[entry.name] = _each(content, lambda point: _moved_point(point, matrix))
        elif entry.name in DIRECTIONS:
            parts[entry.name] = _each(content, lambda vector: _turned(vector, matrix))
        else:
            parts[entry.name] = _moved(content, matrix, region)
    return replace(value, **parts)


def _each(value: Any, change: Callable[[Point], Point]) -> Any:
    """A point, or nested tuples of them, changed one by one; None and the name of an axis as they are."""
    if not isinstance(value, tuple) or not value:
        return value
    if isinstance(value[0], tuple):
        return tuple(_each(entry, change) for entry in value)
    return change(value)  # type: ignore[arg-type]


def _moved_point(point: Point, matrix: Floats) -> Point:
    return _point(matrix[:3, :3] @ np.array(point) + matrix[:3, 3])


def _turned(vector: Point, matrix: Floats) -> Point:
    return _point(matrix[:3, :3] @ np.array(vector))


def _point(values: Floats) -> Point:
    x, y, z = values.tolist()
    return x, y, z
