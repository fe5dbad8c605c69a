# mypy: disable-error-code="valid-type"
"""A keep-out as properties, and its way to the recipe and back."""

from __future__ import annotations

from typing import Any

import bpy
from bpy.props import BoolProperty, EnumProperty, FloatVectorProperty, PointerProperty, StringProperty

from ..core.recipe import KeepOut
from .field_properties import SIZE, beside, length_property, point_of, typed

KINDS = (
    ('FACES', "Faces", "Faces of the base with a face attribute or a material", 'FACESEL', 0),
    ('OBJECT', "Object", "What an object covers, seen along its Z axis", 'OBJECT_DATA', 1),
    ('COLLECTION', "Collection", "What every object of a collection covers", 'OUTLINER_COLLECTION', 2),
    ('SPHERE', "Sphere", "A ball", 'MESH_UVSPHERE', 3),
    ('CYLINDER', "Cylinder", "A disc along an axis", 'MESH_CYLINDER', 4),
    ('BOX', "Box", "A rectangle along an axis", 'MESH_CUBE', 5),
    ('FILE', "File", "What a mesh in a file covers", 'FILE_3D', 6),
)
ICONS = {kind: icon for kind, _, _, icon, _ in KINDS}
SHAPES = {'SPHERE', 'CYLINDER', 'BOX'}
SEEN_ALONG = {'OBJECT', 'COLLECTION', 'FILE', 'CYLINDER', 'BOX'}


def changed(entry: Any, context: bpy.types.Context) -> None:
    """A keep-out changed: the bubbles move."""
    from . import generation

    generation.react(entry.id_data.bubble_pattern, context, repack=True)


def face_names(entry: Any, _context: bpy.types.Context, _text: str) -> list[str]:
    """Face attributes and materials of the base."""
    base = entry.id_data.bubble_pattern.base
    if base is None:
        return []
    names = [
        layer.name
        for layer in base.data.attributes
        if (layer.domain, layer.data_type) == ('FACE', 'BOOLEAN') and not layer.name.startswith(".")
    ]
    return [*names, *(slot.material.name for slot in base.material_slots if slot.material)]


class BubblePatternKeepOut(bpy.types.PropertyGroup):
    """Something that the pattern goes round."""

    kind: EnumProperty(
        name="Kind", description="What is kept out", items=KINDS, default='OBJECT', update=changed
    )
    faces: StringProperty(
        name="Faces",
        description="Face attribute or material of the base whose faces are kept out",
        search=face_names,
        update=changed,
    )
    object: PointerProperty(
        name="Object",
        description="Object whose outline, seen along its Z axis, is kept out",
        type=bpy.types.Object,
        poll=beside,
        update=changed,
    )
    collection: PointerProperty(
        name="Collection",
        description="Collection whose objects are kept out",
        type=bpy.types.Collection,
        update=changed,
    )
    file: StringProperty(
        name="File",
        description="STL, OBJ, PLY, 3MF or GLB file in the coordinates of the base",
        subtype='FILE_PATH',
        update=changed,
    )
    centre: FloatVectorProperty(
        name="Center",
        description="Middle of the shape, in the coordinates of the base",
        size=3,
        subtype='TRANSLATION',
        precision=4,
        update=changed,
    )
    diameter: length_property("Diameter", "Diameter of the shape", 0.01, **SIZE, update=changed)
    size: FloatVectorProperty(
        name="Size",
        description="Lengths of the box along its three axes",
        size=3,
        subtype='XYZ_LENGTH',
        default=(0.01, 0.01, 0.01),
        min=1e-6,
        precision=4,
        update=changed,
    )
    use_axis: BoolProperty(
        name="Custom Axis",
        description="Look along another axis than Z, for objects their own",
        default=False,
        update=changed,
    )
    axis: FloatVectorProperty(
        name="Axis",
        description="Direction along which the outline is seen, in the coordinates of the base",
        size=3,
        default=(0.0, 0.0, 1.0),
        update=changed,
    )
    use_along: BoolProperty(
        name="Turned",
        description="Let the first side of the box run along another direction than X",
        default=False,
        update=changed,
    )
    along: FloatVectorProperty(
        name="Along",
        description="Direction of the first side of the box, in the coordinates of the base",
        size=3,
        default=(1.0, 0.0, 0.0),
        update=changed,
    )
    use_reach: BoolProperty(
        name="Limit Reach",
        description="Keep out only what is near the object along its axis, not all in its shadow",
        default=False,
        update=changed,
    )
    reach: length_property(
        "Reach",
        "How far beyond the object's ends its shadow falls",
        0.005,
        min=0.0,
        soft_max=1.0,
        update=changed,
    )
    margin: length_property("Margin", "What stays free around it", 0.0, min=0.0, soft_max=0.1, update=changed)


def is_given(entry: Any) -> bool:
    """Whether it is said what is kept out; an object that has been deleted is not."""
    if entry.kind == 'OBJECT':
        return entry.object is not None and bool(entry.object.users_collection)
    return entry.kind in SHAPES or bool(getattr(entry, entry.kind.lower()))


def keep_out_objects(settings: Any) -> list[bpy.types.Object]:
    """The objects that are kept out, those of collections among them."""
    entries = [entry for entry in settings.keep_out if is_given(entry)]
    objects = [entry.object for entry in entries if entry.kind == 'OBJECT']
    for entry in entries:
        if entry.kind == 'COLLECTION':
            objects += entry.collection.all_objects
    return objects


def keep_out_of(entry: Any) -> KeepOut:
    """The recipe's entry."""
    key = entry.kind.lower()
    values: dict[str, Any] = {"margin": typed(entry.margin)}
    if entry.kind in SHAPES:
        values[key] = point_of(entry.centre)
    elif entry.kind in {'OBJECT', 'COLLECTION'}:
        values[key] = getattr(entry, key).name
    else:
        values[key] = getattr(entry, key)
    if entry.kind in {'SPHERE', 'CYLINDER'}:
        values["diameter"] = typed(entry.diameter)
    if entry.kind == 'BOX':
        values["size"] = point_of(entry.size)
        values["along"] = point_of(entry.along) if entry.use_along else None
    if entry.kind in SEEN_ALONG:
        values["axis"] = point_of(entry.axis) if entry.use_axis else None
        values["reach"] = typed(entry.reach) if entry.use_reach else None
    return KeepOut(**values)


def take_keep_out(entry: Any, keep_out: KeepOut) -> None:
    """Set the properties to what the recipe's entry says; objects that are not there stay unset."""
    entry.kind = next(kind for kind in ICONS if getattr(keep_out, kind.lower()) is not None)
    given = getattr(keep_out, entry.kind.lower())
    if entry.kind in SHAPES:
        entry.centre = given
    elif entry.kind == 'OBJECT':
        entry.object = bpy.data.objects.get(given)
    elif entry.kind == 'COLLECTION':
        entry.collection = bpy.data.collections.get(given)
    else:
        setattr(entry, entry.kind.lower(), given)
    for key in ("diameter", "size"):
        if getattr(keep_out, key) is not None:
            setattr(entry, key, getattr(keep_out, key))
    for key in ("axis", "along", "reach"):
        value = getattr(keep_out, key)
        setattr(entry, f"use_{key}", value is not None)
        if value is not None:
            setattr(entry, key, value)
    entry.margin = keep_out.margin


CLASSES = (BubblePatternKeepOut,)
