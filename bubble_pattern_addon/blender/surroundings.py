"""What fields may ask for, out of Blender's data: attributes, vertex groups, UV maps, images, objects.

Only what a recipe names is read. Where it names something that is not there, all names are offered, so that
the message can tell the nearest one.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import astuple, replace
from typing import Any

import bpy
import numpy as np

from ..core.field_tables import Wanted
from ..core.mesh import Floats, Ints
from ..core.surroundings import Surroundings, Thing
from .attributes import read_values
from .pixels import pixels_of
from .reading import Base, evaluated_mesh, shown, transformed
from .vertex_groups import read_groups

# name of the property, numpy type and width. Bytes of colour are taken as they are stored, as those of files.
READ = {
    'FLOAT': ("value", np.float32, 1),
    'INT': ("value", np.int32, 1),
    'INT8': ("value", np.int32, 1),
    'BOOLEAN': ("value", np.bool_, 1),
    'FLOAT_COLOR': ("color", np.float32, 4),
    'BYTE_COLOR': ("color_srgb", np.float32, 4),
}
DOMAINS = ('POINT', 'CORNER', 'FACE')
SOLID_TYPES = {'MESH', 'CURVE', 'CURVES', 'SURFACE', 'FONT', 'META'}
# Faces of an object that distances are measured to get points this far apart, relative to its extent.
SPACING = 1 / 60


def read_painted(obj: bpy.types.Object, mesh: bpy.types.Mesh, base: Base, names: Wanted) -> Surroundings:
    """What is painted on `mesh`, the evaluated mesh of `obj` that was read as `base`, and images."""
    return Surroundings(
        attributes=attributes_of(obj, mesh, base, names.attributes),
        materials=base.materials,
        uv_maps=uv_maps_of(mesh, base) if names.uv_maps else {},
        images=images_of(names.images),
        vectors=vectors_of(mesh, base, names.vectors),
    )


def with_things(
    painted: Surroundings, names: Wanted, frame: Floats, context: bpy.types.Context
) -> Surroundings:
    """The surroundings with the objects that `names` asks for, seen from the frame (4, 4)."""
    known = {obj.name: obj for obj in context.view_layer.objects}
    if not names.objects:
        return painted
    missing = not names.objects <= known.keys()
    to_frame = np.linalg.inv(frame)
    things = {name: thing_of(known[name], to_frame, context) for name in sorted(names.objects & known.keys())}
    if missing:
        things = dict.fromkeys(known, Thing(np.empty((0, 3)))) | things
    return replace(painted, objects=things)


# -- on the base ---------------------------------------------------------------------------------------------


def paintable(attribute: bpy.types.Attribute) -> bool:
    """Whether a field can follow the attribute: a number, a yes or no, or a colour, not of edges."""
    return (
        attribute.data_type in READ
        and attribute.domain in DOMAINS
        and not attribute.name.startswith(".")
    )  # fmt: skip


def attributes_of(
    obj: bpy.types.Object, mesh: bpy.types.Mesh, base: Base, names: frozenset[str]
) -> Mapping[str, Floats]:
    """Attributes and vertex groups by name: (T,) of faces, (T, 3) at corners, (T, 3, 4) colours there."""
    if not names:
        return {}
    layers = {entry.name: entry for entry in mesh.attributes if paintable(entry)}
    groups = [group.name for group in obj.vertex_groups]
    known = layers.keys() | set(groups)
    chosen = names if names <= known else known
    found: dict[str, Floats] = {}
    if any(name in chosen and name not in layers for name in groups):
        found |= {name: weights for name, weights in weights_of(obj, mesh, base).items() if name in chosen}
    for name in chosen & layers.keys():
        found[name] = at_corners(layers[name], base)
    return found


def at_corners(attribute: bpy.types.Attribute, base: Base) -> Floats:
    """Values of an attribute on the triangles of the base, as in Surroundings."""
    values = read_values(attribute.data, *READ[attribute.data_type]).astype(np.float64)
    rows: Mapping[str, Ints] = {
        'POINT': base.mesh.triangles,
        'CORNER': base.corners,
        'FACE': base.polygon,
    }
    taken: Floats = values[rows[attribute.domain]]
    if attribute.domain == 'FACE' and values.ndim == 2:
        taken = np.repeat(taken[:, None], 3, axis=1)
    return taken


def vectors_of(mesh: bpy.types.Mesh, base: Base, names: frozenset[str]) -> Mapping[str, Floats]:
    """Attributes of vectors at the triangles' corners, (T, 3, 3), turned as the base is."""
    known = {entry.name: entry for entry in mesh.attributes if entry.data_type == 'FLOAT_VECTOR'}
    found: dict[str, Floats] = {}
    for name in names if names <= known.keys() else known:
        values = read_values(known[name].data, "vector", np.float32, 3).astype(np.float64)
        rows: Mapping[str, Ints] = {
            'POINT': base.mesh.triangles,
            'CORNER': base.corners,
            'FACE': np.repeat(base.polygon[:, None], 3, axis=1),
        }
        if known[name].domain in rows:
            found[name] = values[rows[known[name].domain]] @ base.to_frame[:3, :3].T
    return found


def weights_of(obj: bpy.types.Object, mesh: bpy.types.Mesh, base: Base) -> Mapping[str, Floats]:
    """Weights of the vertex groups at the triangles' corners, (T, 3); 0 where a vertex is in none."""
    found: dict[str, Floats] = {}
    for group in read_groups(obj, mesh):
        weights = np.zeros(len(mesh.vertices))
        weights[group.members] = group.weights
        found[group.name] = weights[base.mesh.triangles]
    return found


def uv_maps_of(mesh: bpy.types.Mesh, base: Base) -> Mapping[str, Floats]:
    """UV maps by name at the triangles' corners, (T, 3, 2)."""
    return {
        layer.name: read_values(layer.uv, "vector", np.float32, 2).astype(np.float64)[base.corners]
        for layer in mesh.uv_layers
    }


def images_of(names: frozenset[str]) -> Mapping[str, Floats]:
    """Images of the open file by name, as in Surroundings."""
    known = bpy.data.images
    found = {name: pixels_of(known[name]) for name in sorted(names) if name in known}
    if len(found) < len(names):
        return dict.fromkeys(known.keys(), np.empty((0, 0, 1))) | found
    return found


# -- beside the base -----------------------------------------------------------------------------------------


def thing_of(obj: bpy.types.Object, to_frame: Floats, context: bpy.types.Context) -> Thing:
    """An object in the frame that `to_frame` (4, 4) leads to from the world.

    A mesh gives its vertices, edges and points spread over its faces, a curve its line, all else its origin.
    """
    matrix = to_frame @ np.array(obj.matrix_world, dtype=np.float64)
    if obj.type not in SOLID_TYPES:
        return Thing(matrix[None, :3, 3], frame=matrix)
    with shown(obj, context), evaluated_mesh(obj, context.evaluated_depsgraph_get()) as mesh:
        local = read_values(mesh.vertices, "co", np.float32, 3).astype(np.float64)
        edges = read_values(mesh.edges, "vertices", np.int32, 2).reshape(-1, 2)
        mesh.calc_loop_triangles()
        triangles = read_values(mesh.loop_triangles, "vertices", np.int32, 3).reshape(-1, 3)
    vertices = transformed(local.reshape(-1, 3), matrix)
    return Thing(np.concatenate([vertices, spread(vertices[triangles])]), vertices[edges], matrix)


def spread(corners: Floats) -> Floats:
    """Points (n, 3) on the triangles (m, 3, 3), no farther apart than SPACING of their extent, without the
    corners.
    """
    if not len(corners):
        return np.empty((0, 3))
    flat = corners.reshape(-1, 3)
    spacing = SPACING * float(np.linalg.norm(flat.max(axis=0) - flat.min(axis=0)))
    longest = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)
    cuts = np.ceil(longest / max(spacing, 1e-300)).astype(np.int64)
    found = [np.empty((0, 3))]
    for count in np.unique(cuts[cuts > 1]):
        i, j = np.meshgrid(np.arange(count + 1), np.arange(count + 1), indexing="ij")
        inside = (i + j <= count) & (np.maximum(np.maximum(i, j), count - i - j) < count)
        weights = np.stack([i, j, count - i - j], axis=2)[inside] / count
        found.append(np.einsum("wk,mkc->mwc", weights, corners[cuts == count]).reshape(-1, 3))
    return np.concatenate(found)


# -- whether anything has changed ----------------------------------------------------------------------------


def trace(surroundings: Surroundings, names: Wanted) -> str:
    """A short name for what these names stand for; empty where nothing is asked for."""
    if not any(astuple(names)):
        return ""
    digest = hashlib.blake2b(digest_size=16)
    tables: tuple[tuple[frozenset[str], Mapping[str, Any]], ...] = (
        (names.attributes, surroundings.attributes),
        (names.materials, surroundings.materials),
        (names.uv_maps, surroundings.uv_maps),
        (names.images, surroundings.images),
        (names.vectors, surroundings.vectors),
    )
    for chosen, table in tables:
        for name in sorted(chosen & table.keys()):
            digest.update(name.encode() + np.ascontiguousarray(table[name]).tobytes())
    for name in sorted(names.objects & surroundings.objects.keys()):
        thing = surroundings.objects[name]
        for array in (thing.points, thing.segments, thing.frame):
            digest.update(name.encode() + np.ascontiguousarray(array).tobytes())
    return digest.hexdigest()
