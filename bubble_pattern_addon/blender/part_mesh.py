"""The finished part as a Blender mesh that looks like its base: faces, materials, UV maps, sharpness and
shading.

Faces of the base that the features left alone stay as they were, quads and n-gons included. Where a face was
cut, the values at the new corners are taken from the source triangle by their barycentric coordinates, the
corner normals too: so a smooth panel shades as if nothing had happened. Walls are smooth round the hole and
sharp at the rim.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import bpy
import numpy as np

from ..core.mesh import Bools, Floats, Ints
from ..core.metric import Places
from .attributes import Array, Layer, read_layers, read_values, write_layer, write_values
from .reading import Base, transformed

if TYPE_CHECKING:
    from ..core.solid import Part

# Facets of a wall that meet at a larger angle are sharp: a floor, a chamfer, a profile's corner. In degrees.
CREASE = 40.0


@dataclass(frozen=True)
class Original:
    """What a part inherits from the evaluated mesh of its base.

    position (V, 3), loop_start and loop_total (P,), loop_vertex and loop_edge (L,), corner_normal (L, 3) or
    None where the base is flat throughout; layers: its attributes; materials by index; active: names of the
    active UV map and colour, and of those for rendering
    """

    position: Array
    loop_start: Ints
    loop_total: Ints
    loop_vertex: Ints
    loop_edge: Ints
    corner_normal: Array | None
    layers: tuple[Layer, ...]
    materials: tuple[bpy.types.Material | None, ...]
    active: tuple[str, str, str, str]


def read_original(obj: bpy.types.Object, mesh: bpy.types.Mesh) -> Original:
    """Read what a part inherits from `mesh`, the evaluated mesh of `obj`."""
    smooth = mesh.has_custom_normals or read_values(mesh.polygons, "use_smooth", np.bool_).any()
    slots = [slot.material for slot in obj.material_slots]
    own = [material.original if material else None for material in mesh.materials]
    materials = slots + own[len(slots) :]
    uv = [layer.name for layer in mesh.uv_layers if layer.active]
    uv_render = [layer.name for layer in mesh.uv_layers if layer.active_render]
    colors = mesh.color_attributes
    return Original(
        position=read_values(mesh.attributes["position"].data, "vector", np.float32, 3),
        loop_start=read_values(mesh.polygons, "loop_start", np.int32).astype(np.int64),
        loop_total=read_values(mesh.polygons, "loop_total", np.int32).astype(np.int64),
        loop_vertex=read_values(mesh.loops, "vertex_index", np.int32).astype(np.int64),
        loop_edge=read_values(mesh.loops, "edge_index", np.int32).astype(np.int64),
        corner_normal=read_values(mesh.corner_normals, "vector", np.float32, 3) if smooth else None,
        layers=tuple(read_layers(mesh)),
        materials=tuple(materials),
        active=(
            (uv or [""])[0],
            (uv_render or [""])[0],
            colors.active_color.name if colors.active_color else "",
            colors[colors.render_color_index].name if 0 <= colors.render_color_index < len(colors) else "",
        ),
    )


@dataclass(frozen=True)
class Origin:
    """Where the faces, corners and vertices of a part come from; everything in the winding of the object's
    coordinates.

    kept: (K,) faces of the base that are whole; kept_loops, kept_vertices: the base's loops and the part's
    vertices
        at their corners, one face after the other
    faces: (M, 3) triangles beside these, as vertices of the part; feature: (M,) feature whose wall it is, or
    -1 triangle: (M, 3), barycentric: (M, 3, 3) place on the base that each of their corners takes its values
    from vertex: (N,) base vertex that is at the same place, or -1
    """

    kept: Ints
    kept_loops: Ints
    kept_vertices: Ints
    faces: Ints
    feature: Ints
    triangle: Ints
    barycentric: Array
    vertex: Ints

    @property
    def wall(self) -> Bools:
        """(M,) whether the triangle is one of a wall."""
        return self.feature >= 0


def trace(part: Part, places: Places, base: Base, original: Original) -> Origin:
    """Find out where everything of `part` comes from; `places` are those of its features."""
    faces = part.mesh.triangles[:, ::-1] if base.mirrored else part.mesh.triangles
    whole, loop_vertex = whole_triangles(part, base, len(original.loop_vertex))
    cut_polygon = np.bincount(base.polygon, weights=~whole, minlength=len(original.loop_start)) > 0
    kept = np.flatnonzero(~cut_polygon)
    loops = ranges(original.loop_start[kept], original.loop_total[kept])

    wall = part.source < 0
    others = np.flatnonzero(wall | cut_polygon[base.polygon[np.maximum(part.source, 0)]])
    faces, source = faces[others], part.source[others]
    feature = np.where(source < 0, -1 - source, -1)
    triangle = np.repeat(np.maximum(source, 0)[:, None], 3, axis=1)
    barycentric = np.zeros((len(others), 3, 3))
    rows = np.flatnonzero(feature < 0)
    barycentric[rows] = barycentric_coordinates(
        part.mesh.vertices[faces[rows]], base.mesh.corners[source[rows]]
    )
    carry_to_walls(faces, feature, triangle, barycentric, places, len(part.mesh.vertices))
    return Origin(
        kept, loops, loop_vertex[loops], faces, feature, triangle, barycentric.astype(np.float32), part.vertex
    )


def whole_triangles(part: Part, base: Base, loops: int) -> tuple[Bools, Ints]:
    """Which triangles of the base are in the part as they were (T,), and the part's vertices at their loops
    (L,).

    Several vertices of a base may be at one place, and one vertex of the part: so corners are told by place.
    """
    rows = np.flatnonzero(part.untouched)
    ours, theirs = part.mesh.triangles[rows], base.mesh.triangles[part.source[rows]]
    same = (base.mesh.vertices[theirs] == part.mesh.vertices[ours[:, :1]]).all(axis=2)
    turn = (same.argmax(axis=1)[:, None] + np.arange(3)) % 3
    loop_vertex = np.full(loops, -1)
    loop_vertex[np.take_along_axis(base.corners[part.source[rows]], turn, axis=1)] = ours
    whole = np.zeros(len(base.polygon), dtype=bool)
    whole[part.source[rows]] = True
    return whole, loop_vertex


def carry_to_walls(
    faces: Ints, feature: Ints, triangle: Ints, barycentric: Floats, places: Places, vertices: int
) -> None:
    """Let corners of walls take their values from a cut face at the rim, or else from the feature's place."""
    surface, wall = np.flatnonzero(feature < 0), np.flatnonzero(feature >= 0)
    carrier = np.full(vertices, -1)
    carrier[faces[surface]] = (surface[:, None] * 3) + np.arange(3)
    found = carrier[faces[wall]]
    inner = found < 0
    triangle[wall] = np.where(inner, places.triangle[feature[wall]][:, None], triangle.reshape(-1)[found])
    barycentric[wall] = np.where(
        inner[:, :, None], places.barycentric[feature[wall]][:, None, :], barycentric.reshape(-1, 3)[found]
    )


def barycentric_coordinates(points: Floats, corners: Floats) -> Floats:
    """(m, 3, 3) coordinates of three points (m, 3, 3) each in its triangle (m, 3, 3); rows sum to 1.

    Where the triangle has no area, the first corner stands for all.
    """
    u, v = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    w = points - corners[:, :1]
    uu, uv, vv = (u * u).sum(axis=1), (u * v).sum(axis=1), (v * v).sum(axis=1)
    wu, wv = np.einsum('mkc,mc->mk', w, u), np.einsum('mkc,mc->mk', w, v)
    area = uu * vv - uv * uv
    scale = np.divide(1.0, area, out=np.zeros_like(area), where=area > 0)[:, None]
    second = (vv[:, None] * wu - uv[:, None] * wv) * scale
    third = (uu[:, None] * wv - uv[:, None] * wu) * scale
    return np.clip(np.stack([1 - second - third, second, third], axis=2), 0.0, 1.0)


def ranges(start: Ints, total: Ints) -> Ints:
    """start[0], start[0] + 1, ..., start[1], start[1] + 1, ...: `total` numbers from each start."""
    ends = np.cumsum(total)
    return np.repeat(start - ends + total, total) + np.arange(ends[-1] if len(ends) else 0)


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
        lay_geometry(mesh, part, base, original, origin)
        edge_source = trace_edges(mesh, base, original, origin)
        for layer in original.layers:
            write_layer(mesh, inherited_layer(layer, original, origin, base, edge_source, len(mesh.vertices)))
        lay_materials(mesh, original, origin, base, places, wall_material)
        shade(mesh, original, origin, base)
        activate(mesh, original)
        mesh.update()
    except BaseException:
        bpy.data.meshes.remove(mesh)  # nothing half-made is left, whatever went wrong
        raise
    return mesh


def lay_geometry(mesh: bpy.types.Mesh, part: Part, base: Base, original: Original, origin: Origin) -> None:
    """Vertices and faces: first the whole faces of the base, then the triangles."""
    positions = transformed(part.mesh.vertices, base.to_local).astype(np.float32)
    known = np.flatnonzero(origin.vertex >= 0)
    positions[known] = original.position[origin.vertex[known]]
    corner_vertex = np.concatenate([origin.kept_vertices, origin.faces.ravel()])
    sizes = np.concatenate([original.loop_total[origin.kept], np.full(len(origin.faces), 3)])
    mesh.vertices.add(len(positions))
    mesh.loops.add(len(corner_vertex))
    mesh.polygons.add(len(sizes))
    mesh.attributes["position"].data.foreach_set("vector", positions.ravel())
    mesh.loops.foreach_set("vertex_index", corner_vertex.astype(np.int32))
    mesh.polygons.foreach_set("loop_start", (np.cumsum(sizes) - sizes).astype(np.int32))
    mesh.update(calc_edges=True)


def trace_edges(mesh: bpy.types.Mesh, base: Base, original: Original, origin: Origin) -> Ints:
    """The edge of the base that each edge of `mesh` lies on, or -1."""
    loops = np.arange(len(original.loop_vertex))
    following = loops + 1
    following[original.loop_start + original.loop_total - 1] = original.loop_start
    one, two = (
        np.roll(base.corners, -1, axis=1),
        np.roll(base.corners, -2, axis=1),
    )  # the side opposite to a corner
    side = np.where(following[one] == two, original.loop_edge[one], -1)
    side = np.where(following[two] == one, original.loop_edge[two], side)
    away = origin.barycentric <= 1e-6
    along = away & np.roll(
        away, -1, axis=1
    )  # (M, 3, 3): the side from corner to corner lies on that of the base
    source = np.where(
        along.any(axis=2), np.take_along_axis(side[origin.triangle[:, 0]], along.argmax(axis=2), 1), -1
    )
    source[origin.wall] = -1
    corner_source = np.concatenate([original.loop_edge[origin.kept_loops], source.ravel()])
    corner_edge = read_values(mesh.loops, "edge_index", np.int32)
    edge_source = np.full(len(mesh.edges), -1)
    has = corner_source >= 0
    edge_source[corner_edge[has]] = corner_source[has]
    return edge_source


def inherited_layer(
    layer: Layer, original: Original, origin: Origin, base: Base, edge_source: Ints, vertices: int
) -> Layer:
    """The values that the part takes over from the base's attribute `layer`."""
    if layer.domain == 'FACE':
        source = np.concatenate([origin.kept, base.polygon[origin.triangle[:, 0]]])
        values = layer.values[source]
        values[len(origin.kept) :][origin.wall] = 0
    elif layer.domain == 'EDGE':
        values = layer.values[edge_source]
        values[edge_source < 0] = 0
    elif layer.domain == 'CORNER':
        cut = blended(layer, base.corners[origin.triangle], origin.barycentric)
        values = np.concatenate([layer.values[origin.kept_loops], cut])
    else:
        values = np.zeros((vertices, *layer.values.shape[1:]), dtype=layer.values.dtype)
        cut = blended(layer, base.mesh.triangles[origin.triangle], origin.barycentric)
        values[origin.faces.ravel()] = cut
        known = origin.vertex >= 0
        values[known] = layer.values[origin.vertex[known]]
    return replace(layer, values=values)


def blended(layer: Layer, elements: Ints, weights: Array) -> Array:
    """Values of `layer` at corners (M, 3) between three `elements` (M, 3, 3) each, one row per corner."""
    elements, weights = elements.reshape(-1, 3), weights.reshape(-1, 3)
    if not layer.blends:
        nearest = weights.argmax(axis=1)
        return layer.values[elements[np.arange(len(elements)), nearest]]
    if layer.values.ndim == 1:
        return (layer.values[elements] * weights).sum(axis=1)
    return blend_vectors(layer.values, elements, weights)


def blend_vectors(values: Array, elements: Ints, weights: Array) -> Array:
    """Weighted sum of three rows of `values` (n, w) each, without ever holding all three at once."""
    result = values[elements[:, 0]] * weights[:, :1]
    result += values[elements[:, 1]] * weights[:, 1:2]
    result += values[elements[:, 2]] * weights[:, 2:]
    return result


def lay_materials(
    mesh: bpy.types.Mesh,
    original: Original,
    origin: Origin,
    base: Base,
    places: Places,
    wall_material: bpy.types.Material | None,
) -> None:
    """Material slots as the base has them; walls take `wall_material`, or else that of their face."""
    materials = list(original.materials)
    if wall_material is not None and wall_material not in materials:
        materials = [*(materials or [None]), wall_material]
    for material in materials:
        mesh.materials.append(material)
    if len(materials) < 2:
        return
    index = read_values(mesh.polygons, "material_index", np.int32)
    walls = len(origin.kept) + np.flatnonzero(origin.wall)
    if wall_material is not None:
        index[walls] = materials.index(wall_material)
    else:
        by_face = next((layer.values for layer in original.layers if layer.name == "material_index"), None)
        if by_face is not None:
            index[walls] = by_face[base.polygon[places.triangle[origin.feature[origin.wall]]]]
    mesh.polygons.foreach_set("material_index", index)


def shade(mesh: bpy.types.Mesh, original: Original, origin: Origin, base: Base) -> None:
    """Sharp rims and creases of the walls, and the base's own shading on everything else."""
    kept = len(origin.kept_loops)
    corner_edge = read_values(mesh.loops, "edge_index", np.int32)
    wall_edges = corner_edge[kept:].reshape(-1, 3)[origin.wall].ravel()
    on_wall = np.zeros(len(mesh.edges), dtype=bool)
    on_wall[wall_edges] = True
    on_surface = np.zeros(len(mesh.edges), dtype=bool)
    on_surface[corner_edge[:kept]] = True
    on_surface[corner_edge[kept:].reshape(-1, 3)[~origin.wall].ravel()] = True
    sharp = read_values(mesh.edges, "use_edge_sharp", np.bool_)
    sharp |= on_wall & (on_surface | creased(mesh, origin, wall_edges))
    write_values(mesh, "sharp_edge", 'EDGE', 'BOOLEAN', sharp)
    if original.corner_normal is None:
        return
    # Blender's own normals for the walls, the base's for all else. As free vectors, because the usual
    # encoding relative to the faces takes thirty times as long to write and rounds to 16 bits.
    normals = read_values(mesh.corner_normals, "vector", np.float32, 3)
    normals[:kept] = original.corner_normal[origin.kept_loops]
    surface = np.flatnonzero(~origin.wall)
    corners = base.corners[origin.triangle[surface]].reshape(-1, 3)
    carried = blend_vectors(original.corner_normal, corners, origin.barycentric[surface].reshape(-1, 3))
    carried /= np.maximum(np.linalg.norm(carried, axis=1, keepdims=True), np.float32(1e-12))
    normals[kept:].reshape(-1, 3, 3)[surface] = carried.reshape(-1, 3, 3)
    write_values(mesh, "custom_normal", 'CORNER', 'FLOAT_VECTOR', normals)


def creased(mesh: bpy.types.Mesh, origin: Origin, wall_edges: Ints) -> Bools:
    """Edges (E,) where two facets of walls meet at more than CREASE; `wall_edges` are those of all wall
    corners.

    The sum of two unit normals is 2 cos(angle / 2) long.
    """
    normals = read_values(mesh.polygon_normals, "vector", np.float32, 3)[len(origin.kept) :][origin.wall]
    weights = np.repeat(normals, 3, axis=0)
    edges = len(mesh.edges)
    squared = sum(
        np.bincount(wall_edges, weights=weights[:, axis], minlength=edges) ** 2 for axis in range(3)
    )
    facets = np.bincount(wall_edges, minlength=edges)
    return (facets == 2) & (squared < (2 * np.cos(np.radians(CREASE / 2))) ** 2)


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


def is_watertight(mesh: bpy.types.Mesh) -> bool:
    """Whether every edge of `mesh` has exactly two faces."""
    corner_edge = read_values(mesh.loops, "edge_index", np.int32)
    return bool((np.bincount(corner_edge, minlength=len(mesh.edges)) == 2).all())
