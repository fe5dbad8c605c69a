"""The pattern's object: a mesh of points that carry the features' attributes, and the way back."""

from __future__ import annotations

from typing import Any

import bpy
import numpy as np
from mathutils import Matrix

from ..core.feature_recipe import SIZES
from ..core.isometries import Isometries, isometries
from ..core.mesh import Floats, Ints, Mesh
from ..core.metric import Places
from ..core.partners import found_partners
from ..core.pattern import Pattern, aimed, all_bubbles, split, take
from .attributes import read_values, write_values
from .point_marks import mark_pins, remember
from .preview_nodes import show_shape
from .reading import Base

# The custom property of a pattern's mesh that says which symmetry it has.
SYMMETRY = "bubble_pattern_symmetry"


def new_pattern_object(base: bpy.types.Object) -> bpy.types.Object:
    """An empty pattern object for `base`, in the base's collections and following it."""
    mesh = bpy.data.meshes.new(f"{base.name} Pattern")
    obj = bpy.data.objects.new(f"{base.name} Pattern", mesh)
    for collection in base.users_collection:
        collection.objects.link(obj)
    obj.parent = base
    return obj


def write_pattern(obj: bpy.types.Object, pattern: Pattern, base_object: bpy.types.Object, base: Base) -> None:
    """Fill the pattern object with all bubbles of `pattern`, and set it in its frame on the base.

    A bubble whose feature was left out is a point with the diameter 0: a later shaping may bring it back.
    """
    bubbles = all_bubbles(pattern)
    mesh = fresh_mesh(obj)
    mesh.vertices.add(len(bubbles))
    write_values(mesh, "position", 'POINT', 'FLOAT_VECTOR', bubbles.position)
    write_values(mesh, "id", 'POINT', 'INT', bubbles.ids)
    write_values(mesh, "pitch", 'POINT', 'FLOAT', bubbles.pitch)
    write_values(mesh, "row", 'POINT', 'INT', bubbles.row)
    write_values(mesh, "normal", 'POINT', 'FLOAT_VECTOR', bubbles.normal)
    write_values(mesh, "tangent", 'POINT', 'FLOAT_VECTOR', bubbles.tangent)
    write_values(mesh, "triangle", 'POINT', 'INT', bubbles.places.triangle)
    write_values(mesh, "barycentric", 'POINT', 'FLOAT_VECTOR', bubbles.places.barycentric)
    write_symmetry(mesh, bubbles.isometries)
    write_sizes(obj, pattern)
    mark_pins(obj, bubbles.position, bubbles.pitch)
    remember(obj, bubbles.position, bubbles.ids)
    mesh.update()
    obj.matrix_parent_inverse = base_object.matrix_world.inverted_safe()
    obj.matrix_basis = Matrix(base.frame.tolist())


def write_symmetry(mesh: bpy.types.Mesh, group: Isometries | None) -> None:
    """Note on the points which symmetry they have, for a later shaping to keep it."""
    if group is not None:
        mesh[SYMMETRY] = {
            "word": group.word,
            "centre": group.centre.tolist(),
            "axes": group.axes.ravel().tolist(),
        }


def read_symmetry(mesh: bpy.types.Mesh, position: Floats, pitch: Floats) -> dict[str, Any]:
    """What the pattern of points at `position` (n, 3) says of its symmetry; nothing where it has none, or has
    lost it to work by hand.
    """
    if SYMMETRY not in mesh:
        return {}
    noted = mesh[SYMMETRY]
    group = isometries(noted["word"], np.array(noted["centre"]), np.array(noted["axes"]).reshape(3, 3))
    partners = found_partners(group, position, pitch)
    return {} if partners is None else {"symmetry": group.word, "isometries": group, "partners": partners}


def fresh_mesh(obj: bpy.types.Object) -> bpy.types.Mesh:
    """An empty mesh in the place of that of `obj`, under its name.

    Blender's undo takes a mesh that is the same before and after a step for unchanged since, and would keep
    what was written to it in between; and a linked duplicate of the pattern keeps its own points.
    """
    old = obj.data
    mesh = bpy.data.meshes.new(old.name)
    obj.data = mesh
    if not old.users:
        name = old.name
        bpy.data.meshes.remove(old)
        mesh.name = name
    return mesh


def own_mesh(obj: bpy.types.Object) -> bpy.types.Mesh:
    """The mesh of `obj`, which no other object shows: a linked duplicate keeps its own sizes."""
    if obj.data.users > 1:
        obj.data = obj.data.copy()
    return obj.data


def write_sizes(obj: bpy.types.Object, pattern: Pattern) -> None:
    """Give the points of a pattern object the diameters in `pattern`, which has all their ids."""
    bubbles = all_bubbles(pattern)
    row = np.searchsorted(bubbles.ids, point_ids(obj))
    wished = bubbles.diameter if bubbles.wished is None else bubbles.wished
    own_mesh(obj)
    write_values(obj.data, "diameter", 'POINT', 'FLOAT', bubbles.diameter[row])
    write_values(obj.data, "wished", 'POINT', 'FLOAT', wished[row])
    write_form(obj.data, take(bubbles, row))
    show_shape(obj)
    obj.data.update_tag()
    obj.update_tag()


def write_form(mesh: bpy.types.Mesh, bubbles: Pattern) -> None:
    """How the features stand, and their sizes that vary over the region; what all have alike is taken off."""
    stands = aimed(bubbles)
    write_values(mesh, "rotation", 'POINT', 'QUATERNION', rotations(stands.normal, stands.tangent))
    for name in ("axis", "heading"):
        values = getattr(bubbles, name)
        if values is not None:
            write_values(mesh, name, 'POINT', 'FLOAT_VECTOR', values)
        elif name in mesh.attributes:
            mesh.attributes.remove(mesh.attributes[name])
    for name in SIZES:
        if name in bubbles.sizes:
            write_values(mesh, name, 'POINT', 'FLOAT', bubbles.sizes[name])
        elif name in mesh.attributes:
            mesh.attributes.remove(mesh.attributes[name])


def point_ids(obj: bpy.types.Object) -> Ints:
    """Ids of the object's points, in the points' order."""
    return read_values(obj.data.attributes["id"].data, "value", np.int32).astype(np.int64)


def read_pattern(obj: bpy.types.Object, mesh: Mesh) -> Pattern:
    """The pattern that the object's points carry, for the base geometry `mesh` it was made on.

    Points that the user has deleted by hand are left out, and those made by hand. Positions are taken from
    the places on the base, which holds them on the surface to the last bit.
    """
    points = obj.data.attributes
    ids = point_ids(obj)
    made = np.flatnonzero(read_values(points["pitch"].data, "value", np.float32) > 0)
    ids, chosen = np.unique(ids[made], return_index=True)
    chosen = made[chosen]

    def values(name: str, prop: str, dtype: type, width: int = 1) -> Floats:
        """Attribute `name` of the points in the order of ids, (n,), or (n, width) where that is above 1."""
        return read_values(points[name].data, prop, dtype, width)[chosen]

    triangle = values("triangle", "value", np.int32).astype(np.int64)
    barycentric = values("barycentric", "vector", np.float32, 3).astype(np.float64)
    barycentric /= barycentric.sum(axis=1, keepdims=True)
    position = (mesh.vertices[mesh.triangles[triangle]] * barycentric[:, :, None]).sum(axis=1)
    known = "wished" in points  # files of 0.1 have none
    ways: dict[str, Any] = {
        name: unit(values(name, "vector", np.float32, 3).astype(np.float64)) if name in points else None
        for name in ("axis", "heading")
    }
    sizes = {name: values(name, "value", np.float32).astype(np.float64) for name in SIZES if name in points}
    pitch = values("pitch", "value", np.float32).astype(np.float64)
    symmetry = read_symmetry(obj.data, position, pitch)
    if symmetry:
        symmetry["partners"] = ids[symmetry["partners"]]
    bubbles = Pattern(
        places=Places(position, triangle, barycentric),
        normal=unit(values("normal", "vector", np.float32, 3).astype(np.float64)),
        tangent=unit(values("tangent", "vector", np.float32, 3).astype(np.float64)),
        pitch=pitch,
        diameter=values("diameter", "value", np.float32).astype(np.float64),
        row=values("row", "value", np.int32).astype(np.int64),
        wished=values("wished", "value", np.float32).astype(np.float64) if known else None,
        bubble=None if np.array_equal(ids, np.arange(len(ids))) else ids,
        **ways,
        **symmetry,
        sizes=sizes,
    )
    return split(bubbles, bubbles.diameter > 0)


def unit(vectors: Floats) -> Floats:
    """(n, 3) vectors of length 1."""
    return vectors / np.linalg.norm(vectors, axis=1, keepdims=True)


def rotations(normal: Floats, tangent: Floats) -> Floats:
    """(n, 4) quaternions w, x, y, z that turn Z to the normal and X to the tangent.

    The four ways to take a quaternion out of a rotation matrix differ in which component they divide by; per
    feature the largest one is used (S. W. Shepperd, Quaternion from rotation matrix, 1978).
    """
    x = tangent - normal * (tangent * normal).sum(axis=1, keepdims=True)
    x = unit(x)
    y = np.cross(normal, x)
    m = np.stack([x, y, normal], axis=2)  # columns are the turned axes
    xx, yy, zz = m[:, 0, 0], m[:, 1, 1], m[:, 2, 2]
    a, b, c = m[:, 2, 1] - m[:, 1, 2], m[:, 0, 2] - m[:, 2, 0], m[:, 1, 0] - m[:, 0, 1]
    d, e, f = m[:, 0, 1] + m[:, 1, 0], m[:, 0, 2] + m[:, 2, 0], m[:, 1, 2] + m[:, 2, 1]
    ways = np.stack(
        [
            np.stack([1 + xx + yy + zz, a, b, c], axis=1),
            np.stack([a, 1 + xx - yy - zz, d, e], axis=1),
            np.stack([b, d, 1 - xx + yy - zz, f], axis=1),
            np.stack([c, e, f, 1 - xx - yy + zz], axis=1),
        ],
        axis=1,
    )
    best = np.argmax(np.stack([xx + yy + zz, xx, yy, zz], axis=1), axis=1)
    chosen = ways[np.arange(len(ways)), best]
    return chosen / np.linalg.norm(chosen, axis=1, keepdims=True)
