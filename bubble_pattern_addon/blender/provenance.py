"""Where everything of a part comes from: which face, corner, edge and vertex of its base."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import bpy
import numpy as np

from ..core.facets import Faces, joined_faces
from ..core.mesh import Bools, Floats, Ints
from ..core.metric import Places
from .attributes import (
    CORNER_EDGE,
    CORNER_VERTEX,
    SHARP_FACE,
    Array,
    Layer,
    read_layers,
    read_named,
    read_values,
)
from .part_edges import Edges
from .reading import Base
from .vertex_groups import VertexGroup, read_groups

if TYPE_CHECKING:
    from ..core.part import Part

# A corner this near to a side of its source triangle, as a barycentric coordinate, lies on it.
ON_SIDE = 1e-6


@dataclass(frozen=True)
class Original:
    """What a part inherits from the evaluated mesh of its base.

    position (V, 3), loop_start and loop_total (P,), loop_vertex and loop_edge (L,), corner_normal (L, 3) or
    None where the base is flat throughout; layers: its attributes; groups: its vertex groups; materials by
    index; active: names of the active UV map and colour, and of those for rendering
    """

    position: Array
    loop_start: Ints
    loop_total: Ints
    loop_vertex: Ints
    loop_edge: Ints
    corner_normal: Array | None
    layers: tuple[Layer, ...]
    groups: tuple[VertexGroup, ...]
    materials: tuple[bpy.types.Material | None, ...]
    active: tuple[str, str, str, str]


def read_original(obj: bpy.types.Object, mesh: bpy.types.Mesh) -> Original:
    """Read what a part inherits from `mesh`, the evaluated mesh of `obj`."""
    smooth = mesh.has_custom_normals or not read_named(mesh, SHARP_FACE, len(mesh.polygons)).all()
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
        loop_vertex=read_named(mesh, CORNER_VERTEX, len(mesh.loops)).astype(np.int64),
        loop_edge=read_named(mesh, CORNER_EDGE, len(mesh.loops)).astype(np.int64),
        corner_normal=read_values(mesh.corner_normals, "vector", np.float32, 3) if smooth else None,
        layers=tuple(read_layers(mesh)),
        groups=read_groups(obj, mesh),
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
    """Where the faces of a part come from, in the winding of the object's coordinates: whole faces of the
    base, then what is left of cut ones, in triangles, then walls, a face for each of their facets.

    kept: (K,) faces of the base that are whole; kept_loops, kept_vertices: the base's loops and the part's
        vertices at their corners, one face after the other
    surface: (S, 3) triangles on the base; source: (S,) triangle of the base each lies on
    walls: W faces of walls; feature: (W,) whose wall it is
    vertex: (N,) base vertex that is at the same place, or -1
    positions: (N, 3) vertices of the part in the base's frame; places: those of its features
    """

    kept: Ints
    kept_loops: Ints
    kept_vertices: Ints
    surface: Ints
    source: Ints
    walls: Faces
    feature: Ints
    vertex: Ints
    positions: Floats
    places: Places
    base: Base

    @property
    def wall_triangle(self) -> Ints:
        """(W,) triangle of the base that the feature of each face of a wall stands on."""
        return self.places.triangle[self.feature]

    @cached_property
    def barycentric(self) -> Array:
        """(S, 3, 3) place of each corner of `surface` in its triangle of the base."""
        corners = self.base.mesh.corners[self.source]
        return barycentric_coordinates(self.positions[self.surface], corners).astype(np.float32)

    @cached_property
    def wall_spots(self) -> tuple[Ints, Array]:
        """Triangle (C,) and barycentric coordinates (C, 3) that the corners of walls take their values from.

        Those of a cut face at the same vertex of the rim, or else the place of the feature.
        """
        carrier = np.full(len(self.positions), -1)
        carrier[self.surface] = np.arange(self.surface.size).reshape(-1, 3)
        found = carrier[self.walls.corner]
        rim = found >= 0
        feature = np.repeat(self.feature, self.walls.total)
        triangle = np.where(rim, self.source[found // 3], self.places.triangle[feature])
        own = self.places.barycentric[feature].astype(np.float32)
        barycentric = np.where(rim[:, None], self.barycentric.reshape(-1, 3)[found], own)
        return triangle, barycentric


def trace(part: Part, places: Places, base: Base, original: Original) -> Origin:
    """Find out where everything of `part` comes from; `places` are those of its features."""
    faces = part.mesh.triangles[:, ::-1] if base.mirrored else part.mesh.triangles
    whole, loop_vertex = whole_triangles(part, base, len(original.loop_vertex))
    is_whole = np.zeros(len(original.loop_start), dtype=bool)
    is_whole[base.polygon] = True
    is_whole[base.polygon[~whole]] = False
    kept = np.flatnonzero(is_whole)
    loops = ranges(original.loop_start[kept], original.loop_total[kept])
    rows = np.flatnonzero(part.source < 0)
    walls = joined_faces(faces[rows], part.facet[rows])
    surface = np.flatnonzero((part.source >= 0) & ~is_whole[base.polygon[np.maximum(part.source, 0)]])
    return Origin(
        kept,
        loops,
        loop_vertex[loops],
        faces[surface],
        part.source[surface],
        walls,
        -1 - part.source[rows[walls.triangle]],
        part.vertex,
        part.mesh.vertices,
        places,
        base,
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


def trace_edges(original: Original, origin: Origin, edges: Edges) -> Ints:
    """The edge of the base that each of the `edges` of the part lies on, or -1, (E,)."""
    loops = np.arange(len(original.loop_vertex))
    following = loops + 1
    following[original.loop_start + original.loop_total - 1] = original.loop_start
    corners = origin.base.corners
    one, two = np.roll(corners, -1, axis=1), np.roll(corners, -2, axis=1)  # the side opposite to each corner
    side = np.where(following[one] == two, original.loop_edge[one], -1)
    side = np.where(following[two] == one, original.loop_edge[two], side)
    away = origin.barycentric <= ON_SIDE
    along = away & np.roll(away, -1, axis=1)  # (S, 3, 3): corner to next corner lies on a side of the base's
    on_side, corner = np.nonzero(along.any(axis=2))
    edge = side[origin.source[on_side], along[on_side, corner].argmax(axis=1)]
    edge_source = np.full(len(edges.ends), -1)
    kept = len(origin.kept_loops)
    edge_source[edges.of_corner[kept + 3 * on_side + corner]] = edge
    edge_source[edges.of_corner[:kept]] = original.loop_edge[origin.kept_loops]
    return edge_source
