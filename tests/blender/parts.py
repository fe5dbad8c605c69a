"""Bases for the tests, and what can be measured on objects."""

from __future__ import annotations

from collections.abc import Callable

import bmesh
import bpy
import numpy as np
from mathutils import Vector
from mathutils.bvhtree import BVHTree


def plate(size: float = 0.1, thickness: float = 0.01, name: str = "Plate") -> bpy.types.Object:
    """A flat plate of six quads, its top at z = thickness / 2."""
    bpy.ops.mesh.primitive_cube_add(size=1.0)
    obj = bpy.context.object
    obj.name = name
    for vertex in obj.data.vertices:
        vertex.co *= Vector((size, size, thickness))
    return obj


def height(x: float, y: float, size: float) -> float:
    """Of the surfaces curved both ways, above the plane."""
    return 0.1 * size * np.cos(x / size * 2) * np.cos(y / size * 2)


def panel(size: float = 0.2, cells: int = 24, thickness: float = 0.004) -> bpy.types.Object:
    """A smooth panel curved both ways, of quads, with sharp outer edges; its top has the material Front."""
    line = np.linspace(-size / 2, size / 2, cells + 1)
    x, y = np.meshgrid(line, line, indexing='ij')
    top = np.stack([x, y, height(x, y, size)], axis=2).reshape(-1, 3)
    bottom = top - [0, 0, thickness]
    at = np.arange((cells + 1) ** 2).reshape(cells + 1, cells + 1)
    quads = np.stack([at[:-1, :-1], at[1:, :-1], at[1:, 1:], at[:-1, 1:]], axis=2).reshape(-1, 4)
    below = quads[:, ::-1] + len(top)
    rim = np.concatenate([at[:-1, 0], at[-1, :-1], at[:0:-1, -1], at[0, :0:-1]])
    ahead = np.roll(rim, -1)
    sides = np.stack([rim, rim + len(top), ahead + len(top), ahead], axis=1)
    mesh = bpy.data.meshes.new("Panel")
    mesh.from_pydata(np.concatenate([top, bottom]), [], np.concatenate([quads, below, sides]).tolist())
    mesh.shade_smooth()
    mesh.set_sharp_from_angle(angle=np.radians(50))
    for name in ("Body", "Front"):
        mesh.materials.append(bpy.data.materials.new(name))
    uv = mesh.uv_layers.new(name="UVMap")
    for loop in mesh.loops:
        uv.data[loop.index].uv = mesh.vertices[loop.vertex_index].co.xy / size + Vector((0.5, 0.5))
    for face in mesh.polygons:
        face.material_index = int(face.index < len(quads))
    obj = bpy.data.objects.new("Panel", mesh)
    bpy.context.collection.objects.link(obj)
    activate(obj)
    return obj


def sheet(size: float = 0.2, cells: int = 24) -> bpy.types.Object:
    """A surface curved both ways that has no thickness, its faces up."""
    bpy.ops.mesh.primitive_grid_add(size=size, x_subdivisions=cells, y_subdivisions=cells)
    obj = bpy.context.object
    for vertex in obj.data.vertices:
        vertex.co.z = height(vertex.co.x, vertex.co.y, size)
    return obj


def activate(obj: bpy.types.Object) -> None:
    """Select `obj` alone and make it active."""
    bpy.context.view_layer.update()
    for other in bpy.context.view_layer.objects:
        other.select_set(other == obj)
    bpy.context.view_layer.objects.active = obj


def select_faces(obj: bpy.types.Object, chosen: Callable[[bmesh.types.BMFace], bool]) -> None:
    """Go to Edit Mode of `obj` with the faces selected that `chosen` says yes to."""
    activate(obj)
    bpy.ops.object.mode_set(mode='EDIT')
    bpy.context.tool_settings.mesh_select_mode = (False, False, True)
    edited = bmesh.from_edit_mesh(obj.data)
    bpy.ops.mesh.select_all(action='DESELECT')
    for face in edited.faces:
        face.select_set(chosen(face))
    edited.select_flush_mode()
    bmesh.update_edit_mesh(obj.data)


def on_top(face: bmesh.types.BMFace) -> bool:
    """Whether a face looks up."""
    return face.normal.z > 0.7


def add_on_top(obj: bpy.types.Object) -> bpy.types.Object:
    """A pattern on the faces of `obj` that look up, added from Edit Mode."""
    select_faces(obj, on_top)
    assert bpy.ops.bubble_pattern.add() == {'FINISHED'}
    assert bpy.context.object == obj
    from bubble_pattern_addon.blender.properties import pattern_of  # an installed extension has another name

    return pattern_of(obj)


def points(pattern: bpy.types.Object, name: str = "position") -> np.ndarray:
    """An attribute of the pattern's points, positions and directions in world space."""
    bpy.context.view_layer.update()
    data = pattern.data.attributes[name].data
    matrix = np.array(pattern.matrix_world)
    if name in {"position", "normal", "tangent", "axis", "heading"}:
        values = np.array([item.vector for item in data]).reshape(-1, 3)
        return values @ matrix[:3, :3].T + (matrix[:3, 3] if name == "position" else 0)
    return np.array([item.value for item in data])


def world_surface(obj: bpy.types.Object) -> BVHTree:
    """The surface of `obj` with its modifiers, in world space."""
    graph = bpy.context.evaluated_depsgraph_get()
    evaluated = obj.evaluated_get(graph)
    mesh = evaluated.to_mesh()
    made = bmesh.new()
    made.from_mesh(mesh)
    evaluated.to_mesh_clear()
    made.transform(obj.matrix_world)
    if obj.matrix_world.determinant() < 0:
        bmesh.ops.reverse_faces(made, faces=made.faces[:])
    made.normal_update()
    tree = BVHTree.FromBMesh(made)
    made.free()
    return tree


def off_surface(pattern: bpy.types.Object, base: bpy.types.Object) -> tuple[float, float]:
    """Largest distance of the features from the base, and smallest cosine between their and its normals."""
    tree = world_surface(base)
    distance, cosine = 0.0, 1.0
    for position, normal in zip(points(pattern), points(pattern, "normal"), strict=True):
        _place, own, _index, away = tree.find_nearest(Vector(position))
        distance = max(distance, away)
        cosine = min(cosine, own.dot(Vector(normal)))
    return distance, cosine


def closest_pair(places: np.ndarray) -> float:
    """Smallest distance between two places."""
    from scipy.spatial import cKDTree

    return float(cKDTree(places).query(places, k=2)[0][:, 1].min())


def volume(obj: bpy.types.Object) -> float:
    """Volume of a mesh object in world space, negative where it is inside out."""
    made = bmesh.new()
    made.from_mesh(obj.data)
    made.transform(obj.matrix_world)
    result = made.calc_volume(signed=True)
    made.free()
    return result * (-1 if obj.matrix_world.determinant() < 0 else 1)


def euler(mesh: bpy.types.Mesh) -> int:
    """V - E + F."""
    return len(mesh.vertices) - len(mesh.edges) + len(mesh.polygons)


def is_closed(mesh: bpy.types.Mesh) -> bool:
    """Whether every edge has two faces that agree on which side is out."""
    made = bmesh.new()
    made.from_mesh(mesh)
    closed = all(edge.is_manifold and edge.is_contiguous for edge in made.edges)
    made.free()
    return closed
