"""Adding inside Blender, mesh in and out included: ours and the Boolean modifier on the same cutters.

Needs the Blender module (`bpy`).
"""

from __future__ import annotations

import os
import tempfile
from typing import Any

os.environ.setdefault("BLENDER_USER_EXTENSIONS", tempfile.mkdtemp(prefix="bubble_pattern_"))

import bpy
import numpy as np

from bubble_pattern_addon.blender.part_mesh import build_part_mesh
from bubble_pattern_addon.blender.provenance import read_original
from bubble_pattern_addon.blender.reading import Base, evaluated_mesh, read_base
from bubble_pattern_addon.core.mesh import Mesh
from bubble_pattern_addon.core.pattern import Pattern
from bubble_pattern_addon.core.progress import drive
from bubble_pattern_addon.core.recipe import Feature
from bubble_pattern_addon.core.solid import part_steps


def version() -> str:
    """Blender's version."""
    return str(bpy.app.version_string)


def place(mesh: Mesh, name: str) -> Any:
    """An object of this mesh in the scene."""
    data = bpy.data.meshes.new(name)
    data.from_pydata(mesh.vertices.tolist(), [], mesh.triangles.tolist())
    data.update()
    made = bpy.data.objects.new(name, data)
    bpy.context.scene.collection.objects.link(made)
    bpy.context.view_layer.update()
    return made


def clear() -> None:
    """Remove every object and mesh."""
    for made in list(bpy.data.objects):
        bpy.data.objects.remove(made)
    for data in list(bpy.data.meshes):
        bpy.data.meshes.remove(data)


def read(base_object: Any) -> Base:
    """The base as the add-on reads it."""
    with evaluated_mesh(base_object, bpy.context.evaluated_depsgraph_get()) as mesh:
        return read_base(base_object, mesh)


def ours(base_object: Any, pattern: Pattern, feature: Feature) -> int:
    """From the object to the part's mesh as the add-on makes it; returns the part's number of faces."""
    with evaluated_mesh(base_object, bpy.context.evaluated_depsgraph_get()) as mesh:
        base, original = read_base(base_object, mesh), read_original(base_object, mesh)
    part = drive(part_steps(base.mesh, pattern, feature))
    made = build_part_mesh("part", part, pattern.places, base, original)
    faces = len(made.polygons)
    bpy.data.meshes.remove(made)
    return faces


def modifier(base_object: Any, cutter_object: Any) -> int:
    """From the object to the mesh by a Boolean modifier, solver MANIFOLD; returns its number of faces."""
    boolean = base_object.modifiers.new("Boolean", 'BOOLEAN')
    boolean.operation = 'DIFFERENCE'
    boolean.solver = 'MANIFOLD'
    boolean.object = cutter_object
    graph = bpy.context.evaluated_depsgraph_get()
    made = bpy.data.meshes.new_from_object(base_object.evaluated_get(graph))
    faces = len(made.polygons)
    bpy.data.meshes.remove(made)
    base_object.modifiers.remove(boolean)
    bpy.context.view_layer.update()
    return faces


def unchanged(base_object: Any, mesh: Mesh) -> bool:
    """Whether the object's faces are the mesh's, row by row: a selection of one then holds for the other."""
    return np.array_equal(read(base_object).mesh.triangles, mesh.triangles)
