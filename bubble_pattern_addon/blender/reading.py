"""From a Blender object to the base geometry: the evaluated mesh as triangles in the pattern's own frame.

The frame is that of the base without its scale, shear and mirroring: lengths in it are those of the world,
and moving the base changes nothing. So unapplied scale, parents and negative scale need no further thought.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property

import bpy
import numpy as np

from ..core.errors import BaseError
from ..core.mesh import Bools, Floats, Ints, Mesh
from .attributes import MATERIAL, face_masks, read_named, read_values

# A linear map that flattens volumes by more than this has lost a direction.
SINGULAR = 1e-12
# Scales that agree in so many digits are the same.
SAME_SCALE = 5


@dataclass(frozen=True)
class Base:
    """A base geometry as it was read, and the way back to its object.

    mesh: triangles in the frame, wound counter-clockwise seen from outside
    polygon: (T,) face of the evaluated mesh each triangle lies in
    corners: (T, 3) corners (loops) of the evaluated mesh, in the triangle's order
    attributes, materials: name -> (T,) whether the triangle has the boolean face attribute or the material
    frame: (4, 4) from the frame to the world, a rotation and a translation
    to_frame: (4, 4) from the object's coordinates to the frame
    """

    mesh: Mesh
    polygon: Ints
    corners: Ints
    attributes: Mapping[str, Bools]
    materials: Mapping[str, Bools]
    frame: Floats
    to_frame: Floats

    @property
    def mirrored(self) -> bool:
        """Whether the object is turned inside out by its transform."""
        return bool(np.linalg.det(self.to_frame[:3, :3]) < 0)

    @cached_property
    def to_local(self) -> Floats:
        """(4, 4) from the frame to the object's coordinates."""
        return np.linalg.inv(self.to_frame)

    def fingerprint(self, selected: Bools, parts: Ints | None = None) -> str:
        """A short name for this very geometry with this target region and its sub-regions (T,).

        It is that of the object's own mesh and of its scale: Blender's matrices are of single precision, and
        turning the object changes the last bits of its scale.
        """
        digest = hashlib.blake2b(digest_size=16)
        linear = self.to_frame[:3, :3]
        size = np.linalg.norm(linear)
        own = transformed(self.mesh.vertices, self.to_local).astype(np.float32)
        arrays = [own + 0.0, np.round(linear / size, SAME_SCALE) + 0.0, self.mesh.triangles, selected]
        for array in arrays if parts is None else [*arrays, parts]:
            digest.update(np.ascontiguousarray(array).tobytes())
        digest.update(f"{size:.{SAME_SCALE}g}".encode())
        return digest.hexdigest()


@contextmanager
def evaluated_mesh(obj: bpy.types.Object, depsgraph: bpy.types.Depsgraph) -> Iterator[bpy.types.Mesh]:
    """The mesh of `obj` with its modifiers, for as long as the block lasts."""
    evaluated = obj.evaluated_get(depsgraph)
    mesh = evaluated.to_mesh()
    try:
        yield mesh
    finally:
        evaluated.to_mesh_clear()


@contextmanager
def shown(obj: bpy.types.Object, context: bpy.types.Context) -> Iterator[None]:
    """Let `obj` be visible for a while: Blender does not run the modifiers of hidden objects."""
    if obj.name not in context.view_layer.objects:
        raise BaseError(f'"{obj.name}" is not in this view layer: include its collection')
    was_hidden, was_disabled = obj.hide_get(), obj.hide_viewport
    if not was_hidden and not was_disabled:
        yield
        return
    obj.hide_set(False)
    obj.hide_viewport = False
    try:
        yield
    finally:
        obj.hide_set(was_hidden)
        obj.hide_viewport = was_disabled


def world_frame(obj: bpy.types.Object) -> Floats:
    """(4, 4) rigid part of the object's world matrix."""
    location, rotation, _scale = obj.matrix_world.decompose()
    w, x, y, z = np.array(rotation, dtype=np.float64) / np.linalg.norm(rotation)
    frame = np.eye(4)
    frame[:3, :3] = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]
    frame[:3, 3] = location
    return frame


def read_base(obj: bpy.types.Object, mesh: bpy.types.Mesh, frame: Floats | None = None) -> Base:
    """The base geometry in `mesh`, the evaluated mesh of `obj`.

    frame: another frame than the object's own, such as the identity for coordinates of the world.

    Raises BaseError where the mesh has no faces or the object is scaled to nothing in some direction.
    """
    frame = world_frame(obj) if frame is None else frame
    to_frame = np.linalg.inv(frame) @ np.array(obj.matrix_world, dtype=np.float64)
    linear = to_frame[:3, :3]
    determinant = np.linalg.det(linear)
    if not np.isfinite(linear).all() or abs(determinant) <= SINGULAR * np.linalg.norm(linear) ** 3:
        raise BaseError(f'"{obj.name}" is scaled to zero in some direction: give it a scale other than zero')
    if not len(mesh.polygons):
        raise BaseError(f'"{obj.name}" has no faces: model the part first')
    mesh.calc_loop_triangles()
    local = read_values(mesh.attributes["position"].data, "vector", np.float32, 3).astype(np.float64)
    triangles = read_values(mesh.loop_triangles, "vertices", np.int32, 3).astype(np.int64)
    corners = read_values(mesh.loop_triangles, "loops", np.int32, 3).astype(np.int64)
    polygon = read_values(mesh.loop_triangle_polygons, "value", np.int32).astype(np.int64)
    if determinant < 0:
        triangles, corners = triangles[:, ::-1].copy(), corners[:, ::-1].copy()
    vertices = transformed(local, to_frame)
    masks = face_masks(mesh, polygon)
    return Base(
        Mesh(vertices, triangles),
        polygon,
        corners,
        masks,
        material_masks(obj, mesh, polygon),
        frame,
        to_frame,
    )


def transformed(points: Floats, matrix: Floats) -> Floats:
    """(n, 3) points after the affine map `matrix` (4, 4)."""
    if np.array_equal(matrix, np.eye(4)):
        return points
    return points @ matrix[:3, :3].T + matrix[:3, 3]


def material_masks(obj: bpy.types.Object, mesh: bpy.types.Mesh, polygon: Ints) -> Mapping[str, Bools]:
    """Materials of the object by name, for the triangles that lie in the faces `polygon` (T,)."""
    index = read_named(mesh, MATERIAL, len(mesh.polygons))[polygon]
    index = np.minimum(index, max(len(obj.material_slots) - 1, 0))
    masks: dict[str, Bools] = {}
    for row, slot in enumerate(obj.material_slots):
        if slot.material is not None:
            name = slot.material.name
            masks[name] = masks.get(name, np.zeros(len(polygon), dtype=bool)) | (index == row)
    return masks
