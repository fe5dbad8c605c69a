# mypy: disable-error-code="valid-type"
"""A field of the recipe as properties: what the sidebar shows of it."""

from __future__ import annotations

import math
from typing import Any

import bpy
from bpy.props import (
    BoolProperty,
    EnumProperty,
    FloatProperty,
    FloatVectorProperty,
    PointerProperty,
    StringProperty,
)

from ..core.toml_values import Point

# Where on the way the curve of one's own has its heights.
QUARTERS = (0.0, 0.25, 0.5, 0.75, 1.0)
# What a kind starts with, relative to what the constant was: the second value, and how far it is to it.
SECOND, WAY = {"pitch_field": 2.0, "diameter_field": 0.5, "depth_field": 2.0, "aspect_field": 0.5}, 5.0
# An angle is not multiplied, for it may be 0: so much is added to it.
MORE = {"draft_field": math.radians(3.0), "angle_field": math.radians(90.0)}


def length_property(name: str, description: str, default: float = 0.0, **options: Any) -> Any:
    """A length in the scene's unit, fine enough for fractions of a millimeter."""
    return FloatProperty(
        name=name,
        description=description,
        subtype='DISTANCE',
        default=default,
        step=0.01,  # in hundredths of a meter: a tenth of a millimeter; the mouse drags finer, too
        precision=4,
        **options,
    )


def angle_property(name: str, description: str, **options: Any) -> Any:
    """An angle, shown in degrees."""
    return FloatProperty(name=name, description=description, subtype='ANGLE', precision=2, **options)


# A length that something stands for cannot be nothing.
SIZE = {"min": 1e-6, "soft_max": 10.0}


def typed(value: float) -> float:
    """The number that was typed, of the 32 bits that Blender keeps of it: 0.0018, not 0.00179999996."""
    return float(f"{value:.7g}")


def point_of(vector: Any) -> Point:
    """A vector property as the recipe's point."""
    x, y, z = (typed(value) for value in vector)
    return x, y, z


def changed(field: Any, context: bpy.types.Context) -> None:
    """A value of the field changed: the bubbles move where it is the pitch, else only sizes change."""
    from . import generation

    repack = field.path_from_id().endswith("pitch_field")
    generation.react(field.id_data.bubble_pattern, context, repack)


def kind_changed(field: Any, context: bpy.types.Context) -> None:
    """Another kind was chosen: let it start from values that suit the constant it replaces."""
    settings = field.id_data.bubble_pattern
    which = field.path_from_id().rpartition(".")[2]
    if field.kind not in {'CONSTANT', 'RECIPE'} and not field.begun and settings.live:
        settings.live = False
        if which in MORE:
            angle = getattr(settings, which.removesuffix("_field"))
            field.start_angle, field.end_angle = angle, angle + MORE[which]
        else:
            begin_sizes(field, settings, which)
        field.distance = WAY * settings.pitch
        field.begun = True
        settings.live = True
    changed(field, context)


def begin_sizes(field: Any, settings: Any, which: str) -> None:
    """Let the values of the field `which`, a size or a share, start from the constant."""
    sizes = {"pitch_field": settings.pitch, "depth_field": settings.diameter / 4}
    size = sizes.get(which, settings.diameter)
    share = settings.aspect if which == "aspect_field" else settings.fill
    field.start_size, field.end_size = size, SECOND[which] * size
    field.start_share, field.end_share = share, SECOND[which] * share


def attribute_names(field: Any, _context: bpy.types.Context, _text: str) -> list[str]:
    """Attributes and vertex groups of the base that a field can follow."""
    from .surroundings import paintable

    base = field.id_data.bubble_pattern.base
    if base is None:
        return []
    names = [entry.name for entry in base.data.attributes if paintable(entry)]
    return [*(group.name for group in base.vertex_groups), *names]


def uv_names(field: Any, _context: bpy.types.Context, _text: str) -> list[str]:
    """UV maps of the base."""
    base = field.id_data.bubble_pattern.base
    return [] if base is None else [layer.name for layer in base.data.uv_layers]


def beside(field: Any, obj: bpy.types.Object) -> bool:
    """Whether `obj` is no pattern, and not the base itself."""
    return obj.bubble_pattern.base is None and obj != field.id_data.bubble_pattern.base


def object_property(name: str, description: str) -> Any:
    """An object that stands beside the base."""
    return PointerProperty(
        name=name, description=description, type=bpy.types.Object, poll=beside, update=changed
    )


def place_property(name: str, description: str, **options: Any) -> Any:
    """A place or a direction in the base's coordinates."""
    return FloatVectorProperty(
        name=name, description=description, size=3, precision=4, step=1, update=changed, **options
    )


class BubblePatternField(bpy.types.PropertyGroup):
    """How a size varies over the target region. With the kind CONSTANT it is a number beside this group."""

    kind: EnumProperty(
        name="Kind",
        description="How the value varies over the region",
        items=(
            ('CONSTANT', "Constant", "The same everywhere", 'REMOVE', 0),
            ('LINEAR', "Linear", "From one value to another along a direction", 'ARROW_LEFTRIGHT', 1),
            ('RADIAL', "Radial", "By the distance from a point or an axis", 'PROP_CON', 2),
            ('EDGE', "From Edge", "By the distance from the boundary of the region", 'MOD_OUTLINE', 3),
            ('DISTANCE', "From Objects", "By the distance from other objects", 'DRIVER_DISTANCE', 4),
            ('ATTRIBUTE', "Attribute", "By a vertex group or an attribute", 'BRUSH_DATA', 5),
            ('IMAGE', "Image", "By the brightness of an image", 'IMAGE_DATA', 6),
            ('RECIPE', "From Recipe", "As a recipe describes it", 'TEXT', 7),
        ),
        default='CONSTANT',
        update=kind_changed,
    )
    begun: BoolProperty(options={'HIDDEN'})
    start_size: length_property("From", "Value at the start", 0.003, **SIZE, update=changed)
    end_size: length_property("To", "Value at the end", 0.006, **SIZE, update=changed)
    start_share: FloatProperty(
        name="From", description="Share of the pitch at the start", subtype='FACTOR', default=0.6,
        min=0.01, max=0.99, update=changed,
    )  # fmt: skip
    end_share: FloatProperty(
        name="To", description="Share of the pitch at the end", subtype='FACTOR', default=0.3,
        min=0.01, max=0.99, update=changed,
    )  # fmt: skip
    start_angle: angle_property("From", "Angle at the start", update=changed)
    end_angle: angle_property("To", "Angle at the end", update=changed)
    falloff: EnumProperty(
        name="Falloff",
        description="How the value goes from the start to the end",
        items=(
            ('LINEAR', "Linear", "Evenly", 'LINCURVE', 0),
            ('SMOOTH', "Smooth", "Slowly at both ends", 'SMOOTHCURVE', 1),
            ('SPHERE', "Sphere", "Fast at the start, and round to the end", 'SPHERECURVE', 2),
            ('ROOT', "Root", "Fast at the start", 'ROOTCURVE', 3),
            ('SHARP', "Sharp", "Slowly at the start", 'SHARPCURVE', 4),
            ('CURVE', "Curve", "Smoothly through five heights of your own", 'FCURVE', 5),
        ),
        default='LINEAR',
        update=changed,
    )
    heights: FloatVectorProperty(
        name="Curve",
        description="How far the value has gone at the start, at every quarter of the way and at the end",
        size=len(QUARTERS), min=0.0, max=1.0, default=QUARTERS, precision=2, update=changed,
    )  # fmt: skip
    invert: BoolProperty(name="Invert", description="Swap start and end", default=False, update=changed)
    clamp: BoolProperty(
        name="Clamp",
        description="Keep the values at the ends beyond them, where a linear falloff would go on",
        default=True,
        update=changed,
    )

    along: EnumProperty(
        name="Along",
        description="Where the way leads",
        items=(
            ('DIRECTION', "Direction", "From one end of the region to the other, along a direction"),
            ('POINTS', "Points", "From one point to another"),
        ),
        default='DIRECTION',
        update=changed,
    )
    direction: place_property(
        "Direction", "Direction in the coordinates of the base", default=(1.0, 0.0, 0.0), subtype='XYZ'
    )
    start: place_property("Start", "Where the way starts", default=(0.0, 0.0, 0.0), subtype='TRANSLATION')
    end: place_property("End", "Where the way ends", default=(0.1, 0.0, 0.0), subtype='TRANSLATION')
    start_object: object_property("Start Object", "Object where the way starts, in place of the point")
    end_object: object_property("End Object", "Object where the way ends, in place of the point")

    about: EnumProperty(
        name="About",
        description="What the distance is measured from",
        items=(
            ('MIDDLE', "Middle", "The middle of the region"),
            ('POINT', "Point", "A point"),
            ('OBJECT', "Object", "The origin of an object"),
        ),
        default='MIDDLE',
        update=changed,
    )
    centre: place_property("Center", "Point in the middle", default=(0.0, 0.0, 0.0), subtype='TRANSLATION')
    object: object_property("Object", "Object that the distance is measured from")
    objects: PointerProperty(
        name="Collection",
        description="Collection of more objects that the distance is measured from",
        type=bpy.types.Collection,
        update=changed,
    )
    axis: EnumProperty(
        name="Axis",
        description="Measure from a line through the center instead of the center alone",
        items=(
            ('NONE', "None", "From the center, all round"),
            ('X', "X", "From the X axis of the object, or else of the base"),
            ('Y', "Y", "From the Y axis of the object, or else of the base"),
            ('Z', "Z", "From the Z axis of the object, or else of the base"),
        ),
        default='NONE',
        update=changed,
    )
    inner: length_property(
        "Inner", "Up to this distance the value is that at the start", min=0.0, update=changed
    )
    radius: length_property(
        "Radius", "Distance where the end is reached, or 0 for the farthest place of the region", min=0.0,
        update=changed,
    )  # fmt: skip
    distance: length_property("Distance", "Distance where the end is reached", 0.015, **SIZE, update=changed)
    loops: EnumProperty(
        name="Loops",
        description="Which part of the boundary counts",
        items=(
            ('ALL', "All", "The whole boundary"),
            ('OUTER', "Outer", "The outer boundary, islands left out"),
            ('ISLANDS', "Islands", "The boundaries of islands alone"),
        ),
        default='ALL',
        update=changed,
    )

    attribute: StringProperty(
        name="Attribute",
        description="Vertex group or attribute of the base that the value follows",
        search=attribute_names,
        update=changed,
    )
    low: FloatProperty(
        name="Low", description="Painted value where the start is", default=0.0, update=changed
    )
    high: FloatProperty(
        name="High", description="Painted value where the end is", default=1.0, update=changed
    )
    channel: EnumProperty(
        name="Channel",
        description="What counts of a color",
        items=(
            ('LIGHT', "Brightness", "How light the color is"),
            ('RED', "Red", "The red component"),
            ('GREEN', "Green", "The green component"),
            ('BLUE', "Blue", "The blue component"),
            ('ALPHA', "Alpha", "The alpha component"),
        ),
        default='LIGHT',
        update=changed,
    )

    image: PointerProperty(
        name="Image",
        description="Image that the value follows, from the start where it is black to the end where white",
        type=bpy.types.Image,
        update=changed,
    )
    mapping: EnumProperty(
        name="Mapping",
        description="How the image lies on the region",
        items=(
            ('FLAT', "Flat", "Laid on from the front of the region, upright"),
            ('UV', "UV Map", "By a UV map of the base"),
        ),
        default='FLAT',
        update=changed,
    )
    uv: StringProperty(
        name="UV Map", description="UV map of the base, or the first one where none is chosen",
        search=uv_names, update=changed,
    )  # fmt: skip
    width: length_property(
        "Width", "Width of the image on the region, or 0 to cover it", min=0.0, update=changed
    )
    text: StringProperty(
        name="Recipe", description="The field as a table in TOML, in meters and degrees", update=changed
    )
