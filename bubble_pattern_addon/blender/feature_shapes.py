"""Objects that stand for the features in the preview: one for each look, in no collection, made by core."""

from __future__ import annotations

import hashlib
from dataclasses import replace
from typing import Any

import bpy
import numpy as np

from ..core.errors import PatternError
from ..core.feature_recipe import Feature
from ..core.feature_sizes import FeatureSizes, feature_sizes
from ..core.mesh import Floats, Ints, Mesh
from ..core.metric import Described, Places
from ..core.pattern import Pattern
from ..core.preview_shape import preview_shape
from .attributes import MATERIAL as MATERIAL_INDEX
from .attributes import read_values, write_values
from .feature_objects import stamp_of
from .feature_settings import feature_of
from .preview_nodes import preview_material

SHAPE = "Bubble Pattern Feature"
KEY = "bubble_pattern_shape"
RIM_MATERIAL = "Bubble Pattern Rim"
RIM = (0.32, 0.33, 0.35, 1.0)
SMOOTH = 40.0
"""Degrees up to which the shape's facets are shaded as one."""


def shape_object(pattern: bpy.types.Object) -> bpy.types.Object | None:
    """The object that stands for the features of `pattern`; None for a plain disc, or where the settings make
    no sense.

    A shape is found by what it looks like, and never changed: patterns may share it. Where sizes vary, it is
    that of the middle one.
    """
    try:
        feature = feature_of(pattern.bubble_pattern)
        if feature.plain and feature.sides is None:
            return None
        shape, shown = preview_shape(*_middle(feature, pattern), stamp_of(feature, bpy.context))
    except PatternError:
        return None
    return _object_of(shape, shown)


def _middle(feature: Feature, pattern: bpy.types.Object) -> tuple[Feature, FeatureSizes]:
    """The feature and its sizes in the middle of their range, relative to the diameter."""
    attributes = pattern.data.attributes
    diameters = read_values(attributes["diameter"].data, "value", np.float32).astype(np.float64)
    diameter = float(np.median(diameters[diameters > 0])) if (diameters > 0).any() else 1.0
    varying: dict[str, Any] = {}
    for name in ("depth", "height", "draft", "aspect"):
        if isinstance(getattr(feature, name), Described) and name in attributes:
            varying[name] = float(np.median(read_values(attributes[name].data, "value", np.float32)))
        elif isinstance(getattr(feature, name), Described):
            varying[name] = 0.5
    feature = replace(feature, **varying)
    sizes = feature_sizes(feature, _single(diameter))
    relative: dict[str, Any] = {name: getattr(sizes, name) / diameter for name in ("depth", "height", "rim")}
    return feature, replace(sizes, **relative)


def _single(diameter: float) -> Pattern:
    """A pattern of one feature."""
    zero, up = np.zeros((1, 3)), np.array([[0.0, 0.0, 1.0]])
    place = Places(zero, np.zeros(1, dtype=np.int64), zero)
    size = np.full(1, diameter)
    return Pattern(place, up, np.array([[1.0, 0.0, 0.0]]), size, size, np.zeros(1, dtype=np.int64))


def _object_of(shape: Mesh, shown: Ints) -> bpy.types.Object:
    key = _key(shape.vertices, shape.triangles, shown)
    for obj in bpy.data.objects:
        if obj.get(KEY) == key and obj.library is None:
            return obj
    mesh = bpy.data.meshes.new(SHAPE)
    mesh.from_pydata(shape.vertices.tolist(), [], shape.triangles.tolist())
    mesh.shade_smooth()
    mesh.set_sharp_from_angle(angle=np.radians(SMOOTH))
    mesh.materials.append(preview_material())
    mesh.materials.append(preview_material(RIM_MATERIAL, RIM))
    write_values(mesh, MATERIAL_INDEX, 'FACE', 'INT', shown)
    obj = bpy.data.objects.new(SHAPE, mesh)
    obj[KEY] = key
    return obj


def _key(vertices: Floats, triangles: Ints, shown: Ints) -> str:
    digest = hashlib.blake2b(digest_size=12)
    for array in (vertices.astype(np.float32), triangles, shown):
        digest.update(np.ascontiguousarray(array).tobytes())
    return digest.hexdigest()


def drop_unused() -> None:
    """Remove the shapes that no pattern shows any more."""
    for obj in [obj for obj in bpy.data.objects if KEY in obj and not obj.users]:
        mesh = obj.data
        bpy.data.objects.remove(obj)
        if not mesh.users:
            bpy.data.meshes.remove(mesh)
