"""The finished part as a Blender mesh that looks like its base: faces, materials, UV maps, vertex groups,
sharpness, shading.

Faces of the base that the features left alone stay as they were, quads and n-gons included. Where a face was
cut, the values at the new corners are taken from the source triangle by their barycentric coordinates, the
corner normals too: so a smooth panel shades as if nothing had happened. Walls are smooth round the hole and
sharp at the rim.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import bpy
import numpy as np

from ..core.mesh import Bools, Ints
from ..core.metric import Places
from .attributes import (
    CORNER_EDGE,
    CORNER_VERTEX,
    EDGE_VERTICES,
    MATERIAL,
    SHARP_EDGE,
    Array,
    Layer,
    read_named,
    read_values,
    write_layer,
    write_values,
)
from .part_edges import Edges, find_edges
from .provenance import Origin, Original, trace, trace_edges
from .reading import Base, transformed
from .vertex_groups import write_groups

if TYPE_CHECKING:
    from ..core.part import Part

# Facets of a wall that meet at a larger angle are sharp: a floor, a chamfer, a profile's corner. In degrees.
CREASE = 40.0


def build_part_mesh(
    name: str,
    part: Part,
    places: Places,
    base: Base,
    original: Original,
    wall_material: bpy.types.Material | None = None,
) -> bpy.types.Mesh:
    """The part as a mesh in the coordinates of the base's object, with all that it inherits."""
    origin = trace(part, places, base, original)
    mesh = bpy.data.meshes.new(name)
    try:
        edges = lay_geometry(mesh, original, origin)
        carry_layers(mesh, original, origin, edges)
        carry_groups(mesh, original, origin)
        lay_materials(mesh, original, origin, wall_material)
        lay_sharp_edges(mesh, origin, edges)
        if original.corner_normal is not None:
            lay_normals(mesh, original.corner_normal, origin)
        activate(mesh, original)
    except BaseException:
        bpy.data.meshes.remove(mesh)  # nothing half-made is left, whatever went wrong
        raise
    return mesh


def lay_geometry(mesh: bpy.types.Mesh, original: Original, origin: Origin) -> Edges:
    """Vertices, edges and faces, in the order of `origin`; returns the edges."""
    positions = transformed(origin.positions, origin.base.to_local).astype(np.float32)
    known = np.flatnonzero(origin.vertex >= 0)
    positions[known] = original.position[origin.vertex[known]]
    surface, walls = origin.surface, origin.walls
    corner_vertex = np.concatenate([origin.kept_vertices, surface.ravel(), walls.corner])
    sizes = np.concatenate([original.loop_total[origin.kept], np.full(len(surface), 3), walls.total])
    starts = np.cumsum(sizes) - sizes
    edges = find_edges(corner_vertex, starts, sizes)
    mesh.vertices.add(len(positions))
    mesh.edges.add(len(edges.ends))
    mesh.loops.add(len(corner_vertex))
    mesh.polygons.add(len(sizes))
    write_values(mesh, "position", 'POINT', 'FLOAT_VECTOR', positions)
    write_values(mesh, CORNER_VERTEX, 'CORNER', 'INT', corner_vertex)
    write_values(mesh, EDGE_VERTICES, 'EDGE', 'INT32_2D', edges.ends)
    write_values(mesh, CORNER_EDGE, 'CORNER', 'INT', edges.of_corner)
    mesh.polygons.foreach_set("loop_start", starts.astype(np.int32))
    mesh.update()
    return edges


def carry_layers(mesh: bpy.types.Mesh, original: Original, origin: Origin, edges: Edges) -> None:
    """Give the part the attributes of its base."""
    edge_source = None
    for layer in original.layers:
        if layer.domain == 'EDGE':
            if edge_source is None:
                edge_source = trace_edges(original, origin, edges)
            values = layer.values[edge_source]
            values[edge_source < 0] = 0
        elif layer.domain == 'FACE':
            values = face_values(layer, origin)
        elif layer.domain == 'CORNER':
            cut = cut_values(layer, origin, origin.base.corners)
            values = np.concatenate([layer.values[origin.kept_loops], *cut])
        else:
            values = point_values(layer, origin)
        write_layer(mesh, replace(layer, values=values))


def carry_groups(mesh: bpy.types.Mesh, original: Original, origin: Origin) -> None:
    """Give the part the vertex groups of its base, with weights in between where it was cut.

    The base's own vertices are in the same groups as before; a new one is in those that weigh something
    there.
    """
    carried = []
    for group in original.groups:
        weight = np.zeros(len(original.position), dtype=np.float32)
        member = np.zeros(len(weight), dtype=bool)
        weight[group.members], member[group.members] = group.weights, True
        values = point_values(Layer(group.name, 'POINT', 'FLOAT', weight), origin)
        inside = np.where(origin.vertex >= 0, member[origin.vertex], values > 0)
        rows = np.flatnonzero(inside)
        carried.append(replace(group, members=rows, weights=values[rows]))
    if carried:
        write_groups(mesh, carried)


def face_values(layer: Layer, origin: Origin) -> Array:
    """Values of a face attribute; on walls they are zero."""
    walls = np.zeros((len(origin.walls.total), *layer.values.shape[1:]), dtype=layer.values.dtype)
    on_base = np.concatenate([origin.kept, origin.base.polygon[origin.source]])
    return np.concatenate([layer.values[on_base], walls])


def point_values(layer: Layer, origin: Origin) -> Array:
    """Values of a vertex attribute: the base's own at its vertices, in between at the others."""
    values = np.zeros((len(origin.positions), *layer.values.shape[1:]), dtype=layer.values.dtype)
    surface, walls = cut_values(layer, origin, origin.base.mesh.triangles)
    values[origin.walls.corner] = walls
    values[origin.surface.ravel()] = surface
    known = origin.vertex >= 0
    values[known] = layer.values[origin.vertex[known]]
    return values


def cut_values(layer: Layer, origin: Origin, elements: Ints) -> tuple[Array, Array]:
    """Values at the corners of surface and walls, from those of the `elements` (T, 3) at base corners."""
    surface = np.repeat(elements[origin.source], 3, axis=0)
    wall_triangle, wall_barycentric = origin.wall_spots
    return (
        blended(layer, surface, origin.barycentric.reshape(-1, 3)),
        blended(layer, elements[wall_triangle], wall_barycentric),
    )


def blended(layer: Layer, elements: Ints, weights: Array) -> Array:
    """Values of `layer` between three `elements` (m, 3) each, by `weights` (m, 3)."""
    if not layer.blends:
        return layer.values[elements[np.arange(len(elements)), weights.argmax(axis=1)]]
    if layer.values.ndim == 1:
        return blend_vectors(layer.values[:, None], elements, weights)[:, 0]
    return blend_vectors(layer.values, elements, weights)


def blend_vectors(values: Array, elements: Ints, weights: Array) -> Array:
    """Weighted sum of three rows of `values` (n, w) each, without ever holding all three at once."""
    result = values[elements[:, 0]] * weights[:, :1]
    result += values[elements[:, 1]] * weights[:, 1:2]
    result += values[elements[:, 2]] * weights[:, 2:]
    return result


def lay_materials(
    mesh: bpy.types.Mesh, original: Original, origin: Origin, wall_material: bpy.types.Material | None
) -> None:
    """Material slots as the base has them; walls take `wall_material`, or else that of their face."""
    materials = list(original.materials)
    if wall_material is not None and wall_material not in materials:
        materials = [*(materials or [None]), wall_material]
    for material in materials:
        mesh.materials.append(material)
    if len(materials) < 2:
        return
    index = read_named(mesh, MATERIAL, len(mesh.polygons))
    first_wall = len(index) - len(origin.walls.total)
    if wall_material is not None:
        index[first_wall:] = materials.index(wall_material)
    else:
        by_face = next((layer.values for layer in original.layers if layer.name == MATERIAL), None)
        if by_face is not None:
            index[first_wall:] = by_face[origin.base.polygon[origin.wall_triangle]]
    write_values(mesh, MATERIAL, 'FACE', 'INT', index)


def lay_sharp_edges(mesh: bpy.types.Mesh, origin: Origin, edges: Edges) -> None:
    """Let rims and the creases of walls be sharp, beside what is sharp in the base."""
    first_wall = len(edges.of_corner) - len(origin.walls.corner)
    sharp = read_named(mesh, SHARP_EDGE, len(edges.ends)).astype(np.bool_)
    sharp |= (edges.first < first_wall) & (edges.last >= first_wall)
    within = np.flatnonzero((edges.first >= first_wall) & (edges.first != edges.last))
    owner = np.repeat(np.arange(len(origin.walls.total)), origin.walls.total)
    one, other = (owner[side[within] - first_wall] for side in (edges.first, edges.last))
    sharp[within] |= creased(mesh, len(origin.walls.total), one, other)
    write_values(mesh, SHARP_EDGE, 'EDGE', 'BOOLEAN', sharp)


def creased(mesh: bpy.types.Mesh, walls: int, one: Ints, other: Ints) -> Bools:
    """Which pairs of facets, (m,) and (m,), of the last `walls` faces meet at more than CREASE, (m,)."""
    normals = read_values(mesh.polygon_normals, "vector", np.float32, 3)[-walls:]
    cosine = np.zeros(len(one), dtype=np.float32)
    for along in np.ascontiguousarray(normals.T):
        cosine += along[one] * along[other]
    return cosine < np.cos(np.radians(CREASE))


def lay_normals(mesh: bpy.types.Mesh, corner_normal: Array, origin: Origin) -> None:
    """Blender's own normals for the walls, those of the base (L, 3) for all else.

    They are free vectors, because the usual encoding relative to the faces takes thirty times as long to
    write and rounds to 16 bits.
    """
    normals = read_values(mesh.corner_normals, "vector", np.float32, 3)
    kept, cut = len(origin.kept_loops), origin.surface.size
    normals[:kept] = corner_normal[origin.kept_loops]
    corners = np.repeat(origin.base.corners[origin.source], 3, axis=0)
    carried = blend_vectors(corner_normal, corners, origin.barycentric.reshape(-1, 3))
    carried /= np.maximum(np.linalg.norm(carried, axis=1, keepdims=True), np.float32(1e-12))
    normals[kept : kept + cut] = carried
    write_values(mesh, "custom_normal", 'CORNER', 'FLOAT_VECTOR', normals)
    mesh.update()  # or Blender goes on with the normals it has worked out above


def activate(mesh: bpy.types.Mesh, original: Original) -> None:
    """Make the same UV map and colours active as in the base."""
    uv, uv_render, color, color_render = original.active
    if uv in mesh.uv_layers:
        mesh.uv_layers.active = mesh.uv_layers[uv]
    if uv_render in mesh.uv_layers:
        mesh.uv_layers[uv_render].active_render = True
    if color in mesh.color_attributes:
        mesh.color_attributes.active_color = mesh.color_attributes[color]
    if color_render in mesh.color_attributes:
        mesh.color_attributes.render_color_index = list(mesh.color_attributes.keys()).index(color_render)
