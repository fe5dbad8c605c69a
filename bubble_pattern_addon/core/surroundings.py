"""What a described field is bound to: the region, and what the base and the file bring along."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, TypeVar

import numpy as np

from .errors import FieldError
from .mesh import Bools, Floats, Mesh
from .metric import Field
from .toml_values import nearest, show

if TYPE_CHECKING:
    from .region import Region

Entry = TypeVar("Entry")


@dataclass(frozen=True)
class Thing:
    """An object beside the base, such as an empty, a curve or a mesh, in the base's coordinates.

    points: (n, 3) samples of what distances are measured to: an empty's place, a mesh's vertices or points
    spread over its faces; segments: (m, 2, 3) lines, such as an evaluated curve's edges; frame: (4, 4) from
    the object's coordinates to the base's, which gives its origin and its axes
    """

    points: Floats
    segments: Floats = field(default_factory=lambda: np.empty((0, 2, 3)))
    frame: Floats = field(default_factory=lambda: np.eye(4))


@dataclass(frozen=True)
class Solid:
    """A body beside the base, in the base's coordinates; axis: (3,) its own Z axis."""

    mesh: Mesh
    axis: Floats


# Bodies that keep-outs name, by key and name: ("object", "Boss"), ("collection", "Bosses"), ("file", "a.stl")
Solids = Mapping[tuple[str, str], Sequence[Solid]]


@dataclass(frozen=True)
class Surroundings:
    """Everything by name that a field may ask for; T is the number of the base's triangles.

    region: the target region
    attributes: values on the base: (T,) of its faces, (T, 3) at the triangles' corners, or (T, 3, 3 or 4)
    colours there, red, green, blue and perhaps alpha from 0 to 1. Vertex groups count as attributes.
    materials: (T,) which triangles have the material
    uv_maps: (T, 3, 2) at the triangles' corners
    images: (height, width, 1 to 4) from 0 to 1, the bottom row first; grey, grey and alpha, or colours, as
    stored in the file: a picture's middle grey is 0.5
    objects: what stands beside the base
    vectors: (T, 3, 3) at the triangles' corners, in the base's coordinates
    meshes: those that features name, each in its own coordinates
    pitch: the packing metric, bound; for diameters that are a share of it
    """

    region: Region | None = None
    attributes: Mapping[str, Floats] = field(default_factory=dict)
    materials: Mapping[str, Bools] = field(default_factory=dict)
    uv_maps: Mapping[str, Floats] = field(default_factory=dict)
    images: Mapping[str, Floats] = field(default_factory=dict)
    objects: Mapping[str, Thing] = field(default_factory=dict)
    meshes: Mapping[str, Mesh] = field(default_factory=dict)
    pitch: Field | None = None
    vectors: Mapping[str, Floats] = field(default_factory=dict)

    def target(self) -> Region:
        """The region. FieldError where there is none."""
        if self.region is None:
            raise FieldError("The field depends on the target region: choose the region first")
        return self.region

    def attribute(self, name: str) -> Floats:
        """An attribute's values. FieldError where the base has no such one."""
        return _named(self.attributes, "name", name, "the base has no attribute of that name")

    def face_values(self, name: str) -> Floats:
        """A face attribute's values, (T,). FieldError where the base has no such one."""
        values = _named(self.attributes, "attribute", name, "the base has no attribute of that name")
        if values.ndim != 1:
            raise FieldError(f"attribute = {show(name)} is painted on vertices: give one of the faces")
        return values

    def vector(self, name: str) -> Floats:
        """Vectors at the triangles' corners, (T, 3, 3); three attributes of one number each, with _x, _y and
        _z behind the name, make one too. FieldError where the base has none of either.
        """
        keys = [f"{name}_{axis}" for axis in "xyz"]
        if name not in self.vectors and all(key in self.attributes for key in keys):
            parts = [self.attributes[key] for key in keys]
            if all(part.ndim == 2 for part in parts):
                return np.stack(parts, axis=2)
        return _named(self.vectors, "name", name, "the base has no attribute of vectors of that name")

    def material(self, name: str) -> Bools:
        """Triangles with a material, (T,). FieldError where the base has no such one."""
        return _named(self.materials, "material", name, "the base has no material of that name")

    def uv_map(self, name: str) -> Floats:
        """A UV map, (T, 3, 2). FieldError where the base has no such one."""
        return _named(self.uv_maps, "uv", name, "the base has no UV map of that name")

    def image(self, name: str) -> Floats:
        """An image's pixels. FieldError where it is not at hand."""
        return _named(self.images, "image", name, "there is no image of that name")

    def thing(self, name: str) -> Thing:
        """An object. FieldError where there is no such one."""
        return _named(self.objects, "object", name, "there is no object of that name")


NOTHING = Surroundings()


def _named(known: Mapping[str, Entry], key: str, name: str, trouble: str) -> Entry:
    if name in known:
        return known[name]
    if not known:
        raise FieldError(f"{key} = {show(name)}: {trouble}, nor any other")
    raise FieldError(f"{key} = {show(name)}: {trouble}, {nearest(name, known, [show(k) for k in known])}")
