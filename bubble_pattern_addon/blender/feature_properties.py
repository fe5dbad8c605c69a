# mypy: disable-error-code="valid-type"
"""The settings of what one feature is."""

from __future__ import annotations

from typing import Any

import bpy
from bpy.props import (
    BoolProperty,
    EnumProperty,
    FloatProperty,
    FloatVectorProperty,
    IntProperty,
    PointerProperty,
    StringProperty,
)

from ..core.feature_recipe import BUMP_HEIGHT, DIMPLE_DEPTH, RIM_SIZE
from ..core.recipe import neat
from .field_properties import SIZE, BubblePatternField, angle_property, length_property
from .packing_properties import stands_beside
from .reacting import reshape_feature


def outline_changed(settings: bpy.types.PropertyGroup, context: bpy.types.Context) -> None:
    """Another curve was chosen."""
    from .feature_objects import take_outline

    take_outline(settings, context)
    reshape_feature(settings, context)


def choice_changed(settings: bpy.types.PropertyGroup, context: bpy.types.Context) -> None:
    """Another kind or rim was chosen: let its size start from one that suits the diameter."""
    start = {"height": BUMP_HEIGHT, "dimple_depth": DIMPLE_DEPTH, "rim_size": RIM_SIZE}
    used = {'BUMP': "height", 'DIMPLE': "dimple_depth"}.get(settings.kind)
    for name in (used, "rim_size" if settings.rim != 'SHARP' else None):
        if name is not None and settings.live and settings.made_with and not getattr(settings, name):
            settings.live = False
            setattr(settings, name, neat(start[name] * settings.diameter))
            settings.live = True
    reshape_feature(settings, context)


def is_curve(settings: bpy.types.PropertyGroup, obj: bpy.types.Object) -> bool:
    """Whether an outline can be taken from `obj`."""
    return obj.type in {'CURVE', 'FONT', 'MESH'} and stands_beside(settings, obj)


def is_solid(settings: bpy.types.PropertyGroup, obj: bpy.types.Object) -> bool:
    """Whether `obj` can be a feature."""
    return obj.type == 'MESH' and stands_beside(settings, obj)


def vector_names(settings: Any, _context: bpy.types.Context, _text: str) -> list[str]:
    """Attributes of the base that are vectors."""
    base = settings.base
    if base is None:
        return []
    return [entry.name for entry in base.data.attributes if entry.data_type == 'FLOAT_VECTOR']


class FeatureSettings:
    """What one feature is, as the recipe's [feature]."""

    kind: EnumProperty(
        name="Kind",
        description="What stands in every bubble",
        items=(
            ('HOLE', "Hole", "Through the wall, or to a depth"),
            ('DIMPLE', "Dimple", "A spherical cap taken out of the surface"),
            ('BUMP', "Bump", "Something that stands on the surface, as for a grip"),
        ),
        default='HOLE',
        update=choice_changed,
    )
    form: EnumProperty(
        name="Form",
        description="What a bump looks like from the side",
        items=(
            ('DOME', "Dome", "A spherical cap"),
            ('BOSS', "Boss", "A flat top, with draft and a rounded edge on wish"),
            ('CONE', "Cone", "A tip"),
        ),
        default='DOME',
        update=reshape_feature,
    )
    depth_mode: EnumProperty(
        name="Depth",
        description="How deep the holes go",
        items=(
            ('THROUGH', "Through", "Through the near wall, however thick it is there"),
            ('BLIND', "Blind", "To a given depth below the surface"),
        ),
        default='THROUGH',
        update=reshape_feature,
    )
    depth: length_property(
        name="Depth",
        description="Depth of the holes below the surface",
        default=0.001,
        **SIZE,
        update=reshape_feature,
    )
    dimple_depth: length_property(
        name="Dimple Depth",
        description="Depth of the dimples in their middle, or 0 for 0.15 of their diameter",
        min=0.0,
        update=reshape_feature,
    )
    height: length_property(
        name="Height",
        description="Height of the bumps above the surface, or 0 for a quarter of their diameter",
        min=0.0,
        update=reshape_feature,
    )
    depth_field: PointerProperty(
        name="Depth Field", description="How depth or height vary over the region", type=BubblePatternField
    )
    draft: angle_property(
        "Draft",
        "Angle of the walls to the axis: holes widen outward, bosses narrow",
        min=0.0,
        max=1.308996,
        update=reshape_feature,
    )
    draft_field: PointerProperty(
        name="Draft Field", description="How the draft varies over the region", type=BubblePatternField
    )
    rim: EnumProperty(
        name="Rim",
        description="Edge of the holes at the surface, or of the bosses at their top",
        items=(
            ('SHARP', "Sharp", "No rim"),
            ('CHAMFER', "Chamfer", "A straight bevel: a countersink"),
            ('FILLET', "Fillet", "A rounding"),
        ),
        default='SHARP',
        update=choice_changed,
    )
    rim_size: length_property(
        name="Rim Size",
        description="Width of the chamfer or radius of the fillet, or 0 for a tenth of the diameter; "
        "the diameter is measured outside the rim",
        min=0.0,
        update=reshape_feature,
    )
    rim_angle: angle_property(
        "Rim Angle",
        "Angle between opposite sides of the chamfer, as countersinks are named",
        default=1.5707963,
        min=0.1745330,
        max=2.9670597,
        update=reshape_feature,
    )
    profile: EnumProperty(
        name="Profile",
        description="Outline of the features; the diameter is that of the circle round it",
        items=(
            ('CIRCLE', "Circle", "", 'MESH_CIRCLE', 0),
            ('ELLIPSE', "Ellipse", "", 'PROP_ON', 1),
            ('SLOT', "Slot", "Half circles joined by straight sides", 'REMOVE', 2),
            ('RECTANGLE', "Rectangle", "With rounded corners on wish", 'MESH_PLANE', 3),
            ('POLYGON', "Polygon", "Regular, with rounded corners on wish", 'SEQ_CHROMA_SCOPE', 4),
            ('DROP', "Drop", "Round at one end, with a tip at the other", 'MATFLUID', 5),
            ('CROSS', "Cross", "Two bars", 'ADD', 6),
            ('CURVE', "Curve", "The outline of a closed curve", 'OUTLINER_OB_CURVE', 7),
            ('MESH', "Mesh", "A mesh object in place of a profile", 'OUTLINER_OB_MESH', 8),
        ),
        default='CIRCLE',
        update=reshape_feature,
    )
    across: EnumProperty(
        name="Measured",
        description="Where the diameter of a circle, which is made of flat facets, is measured",
        items=(
            ('CORNERS', "Corners", "Across the corners: nothing is wider"),
            ('FLATS', "Flats", "Across the flats: a shaft of the diameter goes through"),
        ),
        default='CORNERS',
    )
    aspect: FloatProperty(
        name="Aspect",
        description="Short side of the profile relative to the long one",
        subtype='FACTOR',
        default=0.5,
        min=0.01,
        max=1.0,
        update=reshape_feature,
    )
    aspect_field: PointerProperty(
        name="Aspect Field", description="How the aspect varies over the region", type=BubblePatternField
    )
    corners: IntProperty(
        name="Corners",
        description="Number of corners of the polygon",
        default=6,
        min=3,
        soft_max=12,
        max=64,
        update=reshape_feature,
    )
    rounding: FloatProperty(
        name="Rounding",
        description="How round the corners of the profile are",
        subtype='FACTOR',
        default=0.0,
        min=0.0,
        max=1.0,
        update=reshape_feature,
    )
    profile_curve: PointerProperty(
        name="Curve",
        description="Closed curve seen along its own Z axis; its origin is the middle of the feature",
        type=bpy.types.Object,
        poll=is_curve,
        update=outline_changed,
    )
    profile_points: StringProperty(options={'HIDDEN'})
    profile_mesh: PointerProperty(
        name="Mesh",
        description="Closed mesh whose own plane Z = 0 comes to lie on the surface: a bump is what it has "
        "above, a hole what it has below",
        type=bpy.types.Object,
        poll=is_solid,
        update=reshape_feature,
    )
    axis: FloatProperty(
        name="Along Pull",
        description="Direction of the features: 0 along the normal of the surface, 1 along the pull",
        subtype='FACTOR',
        default=0.0,
        min=0.0,
        max=1.0,
        update=reshape_feature,
    )
    use_pull: BoolProperty(
        name="Pull Direction",
        description="Tell features that cannot be drawn off in this direction, and let the axis follow it",
        default=False,
        update=reshape_feature,
    )
    pull: FloatVectorProperty(
        name="Pull",
        description="Direction in which a tool is drawn off the part, in the coordinates of the base",
        subtype='XYZ',
        size=3,
        default=(0.0, 0.0, 1.0),
        update=reshape_feature,
    )
    turn: EnumProperty(
        name="Turn",
        description="Where the X axis of the profiles heads",
        items=(
            ('ROW', "Row", "Along the rows of the arrangement"),
            ('FIXED', "Direction", "The same direction for all"),
            ('TOWARDS', "Towards", "Towards a point or an object"),
            ('AROUND', "Around", "Around a point or an object"),
            ('BOUNDARY', "Boundary", "Along the nearest boundary"),
            ('ATTRIBUTE', "Attribute", "Along the vectors of an attribute"),
            ('CURVATURE', "Curvature", "Where the surface bends least, such as along a tube"),
            ('RANDOM', "Random", "Each another way"),
        ),
        default='ROW',
        update=reshape_feature,
    )
    turn_direction: FloatVectorProperty(
        name="Direction",
        description="Where the profiles head, in the coordinates of the base",
        subtype='XYZ',
        size=3,
        default=(1.0, 0.0, 0.0),
        update=reshape_feature,
    )
    turn_point: FloatVectorProperty(
        name="Point",
        description="Point that the profiles face or go round, in the coordinates of the base",
        subtype='TRANSLATION',
        size=3,
        precision=4,
        update=reshape_feature,
    )
    turn_object: PointerProperty(
        name="Object",
        description="Object that the profiles face or go round, in place of the point",
        type=bpy.types.Object,
        poll=stands_beside,
        update=reshape_feature,
    )
    turn_attribute: StringProperty(
        name="Attribute",
        description="Attribute of vectors on the base that the profiles follow",
        search=vector_names,
        update=reshape_feature,
    )
    turn_seed: IntProperty(
        name="Seed",
        description="Another number turns them otherwise",
        default=0,
        min=0,
        update=reshape_feature,
    )
    angle: angle_property(
        "Angle", "Turn added to that, counter-clockwise seen from outside", update=reshape_feature
    )
    angle_field: PointerProperty(
        name="Angle Field", description="How the angle varies over the region", type=BubblePatternField
    )
    sides: IntProperty(
        name="Sides",
        description="Facets of a full turn, or 0 to choose them by the size of the features",
        default=0,
        min=0,
        soft_max=128,
        max=1024,
    )
    facet_tolerance: length_property(
        name="Facet Tolerance",
        description="Most that facets may stray from arcs and domes, or 0 to choose it by the size",
        min=0.0,
    )
    wall_material: PointerProperty(
        name="Wall Material",
        description="Material of the walls of the features, or that of the base where none is chosen",
        type=bpy.types.Material,
    )
