"""Numpy arrays ⇄ Blender's attributes, through buffers of Blender's own types (others are far slower)."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import bpy
import numpy as np
from numpy.typing import NDArray

Array = NDArray[Any]


class Kind(NamedTuple):
    """How values of one data type are reached: property, numpy type, width; and whether they blend."""

    prop: str
    dtype: type
    width: int
    blends: bool


KINDS = {
    'FLOAT': Kind("value", np.float32, 1, True),
    'FLOAT2': Kind("vector", np.float32, 2, True),
    'FLOAT_VECTOR': Kind("vector", np.float32, 3, True),
    'FLOAT_COLOR': Kind("color", np.float32, 4, True),
    'BYTE_COLOR': Kind("color", np.float32, 4, True),
    'QUATERNION': Kind("value", np.float32, 4, False),
    'INT': Kind("value", np.int32, 1, False),
    'INT8': Kind("value", np.int32, 1, False),
    'INT32_2D': Kind("value", np.int32, 2, False),
    'BOOLEAN': Kind("value", np.bool_, 1, False),
}

# Made by Blender with the geometry itself, or written separately.
BUILT_IN = ("position", "custom_normal")


@dataclass(frozen=True)
class Layer:
    """One attribute of a mesh: values (n, width) for the n elements of its domain."""

    name: str
    domain: str
    data_type: str
    values: Array

    @property
    def blends(self) -> bool:
        """Whether values in between make sense."""
        return KINDS[self.data_type].blends


def read_values(collection: Any, prop: str, dtype: type, width: int = 1) -> Array:
    """Property `prop` of every item of a Blender collection, (n, width), or (n,) where width is 1."""
    buffer: Array = np.empty(len(collection) * width, dtype=dtype)
    collection.foreach_get(prop, buffer)
    return buffer if width == 1 else buffer.reshape(-1, width)


# Topology and flags by the names of their attributes. As properties of loops, edges and faces the same values
# take a hundred times as long to read.
CORNER_VERTEX, CORNER_EDGE, EDGE_VERTICES, SHARP_EDGE, SHARP_FACE, MATERIAL = (
    ".corner_vert",
    ".corner_edge",
    ".edge_verts",
    "sharp_edge",
    "sharp_face",
    "material_index",
)


def read_named(mesh: bpy.types.Mesh, name: str, count: int) -> Array:
    """The `count` values of attribute `name`; zeros where the mesh lacks it, which means the same."""
    attribute = mesh.attributes.get(name)
    if attribute is None:
        return np.zeros(count, dtype=np.int32)
    kind = KINDS[attribute.data_type]
    return read_values(attribute.data, kind.prop, kind.dtype, kind.width)


def read_layers(mesh: bpy.types.Mesh) -> Iterator[Layer]:
    """What a part inherits of the attributes of `mesh`: UV maps, colours, sharpness, the user's own."""
    for attribute in mesh.attributes:
        name, data_type = attribute.name, attribute.data_type
        if name.startswith(".") or name in BUILT_IN or data_type not in KINDS:
            continue
        kind = KINDS[data_type]
        values = read_values(attribute.data, kind.prop, kind.dtype, kind.width)
        yield Layer(name, attribute.domain, data_type, values)


def write_values(mesh: bpy.types.Mesh, name: str, domain: str, data_type: str, values: Array) -> None:
    """Set attribute `name` of `mesh`, made anew where its type or domain is another."""
    kind = KINDS.get(data_type) or Kind("vector", np.float32, 3, True)
    attribute = mesh.attributes.get(name)
    if attribute is not None and (attribute.domain, attribute.data_type) != (domain, data_type):
        mesh.attributes.remove(attribute)
        attribute = None
    if attribute is None:
        attribute = mesh.attributes.new(name, data_type, domain)
    attribute.data.foreach_set(kind.prop, np.ascontiguousarray(values, dtype=kind.dtype).ravel())


def write_layer(mesh: bpy.types.Mesh, layer: Layer) -> None:
    """Set the attribute that `layer` describes."""
    write_values(mesh, layer.name, layer.domain, layer.data_type, layer.values)


def face_masks(mesh: bpy.types.Mesh, polygon: Array) -> Mapping[str, Array]:
    """Boolean face attributes by name, for the triangles that lie in the faces `polygon` (T,)."""
    masks = {}
    for attribute in mesh.attributes:
        if (
            attribute.domain == 'FACE'
            and attribute.data_type == 'BOOLEAN'
            and not attribute.name.startswith(".")
        ):
            masks[attribute.name] = read_values(attribute.data, "value", np.bool_)[polygon]
    return masks
