# mypy: disable-error-code="valid-type"
"""The pattern's settings: a property here for every field of the recipe that the sidebar shows."""

from __future__ import annotations

import bpy
from bpy.props import (
    BoolProperty,
    CollectionProperty,
    EnumProperty,
    FloatProperty,
    FloatVectorProperty,
    IntProperty,
    PointerProperty,
    StringProperty,
)

from ..core.isometries import MOST_FOLD
from ..core.recipe import FILL, Packing, Shaping
from .field_properties import SIZE, BubblePatternField, length_property

# Raised when a property changes its meaning; see upgrade.
SETTINGS_VERSION = 2


def reshape(settings: bpy.types.PropertyGroup, context: bpy.types.Context) -> None:
    """A size changed: the bubbles stay where they are."""
    from . import generation  # here, because Blender's start need not wait for scipy

    generation.react(settings, context, repack=False)


def repack(settings: bpy.types.PropertyGroup, context: bpy.types.Context) -> None:
    """A setting of the packing changed: the bubbles move."""
    from . import generation

    generation.react(settings, context, repack=True)


def redraw_preview(settings: bpy.types.PropertyGroup, _context: bpy.types.Context) -> None:
    """A setting of the preview alone changed."""
    from .preview_nodes import show_preview

    if settings.base is not None:
        show_preview(settings.id_data, settings.show_bubbles)


def is_on(settings: bpy.types.PropertyGroup, obj: bpy.types.Object) -> bool:
    """Whether `obj` is a pattern on the object that has these settings."""
    return obj.bubble_pattern.base == settings.id_data and in_scene(obj)


def is_mesh(_settings: bpy.types.PropertyGroup, obj: bpy.types.Object) -> bool:
    """Whether `obj` can be a base."""
    return obj.type == 'MESH'


class BubblePatternSeed(bpy.types.PropertyGroup):
    """A feature whose diameter the user has fixed, by its place in the frame of the base."""

    at: FloatVectorProperty(
        name="Place", description="Where the feature is", size=3, subtype='TRANSLATION', precision=6
    )
    diameter: length_property("Diameter", "Diameter that the feature keeps", 0.001, **SIZE)


class BubblePatternSettings(bpy.types.PropertyGroup):
    """Settings and results of one pattern, kept on its object. An object without a base is no pattern."""

    # Named as the recipe's sections and fields are.
    base: PointerProperty(
        name="Base",
        description="Object whose faces carry the pattern",
        type=bpy.types.Object,
        poll=is_mesh,
    )
    part: PointerProperty(
        name="Part", description="Finished part made of this pattern", type=bpy.types.Object
    )
    pattern: PointerProperty(
        name="Pattern",
        description="Pattern on this base that the sidebar shows; for a part, the one it was made of",
        type=bpy.types.Object,
        poll=is_on,
    )
    region: StringProperty(
        name="Region",
        description="Face attribute of the base that marks the target region",
    )
    parts: StringProperty(
        name="Sub-Regions",
        description="Face attributes or materials, separated by commas, whose faces get their own first row",
        update=repack,
    )
    gap: length_property(
        name="Gap",
        description="What stays free between neighboring sub-regions",
        default=0.0,
        min=0.0,
        update=repack,
    )
    pitch: length_property(
        name="Pitch",
        description="Distance between the centers of neighboring features",
        default=0.003,
        **SIZE,
        update=repack,
    )
    pitch_field: PointerProperty(
        name="Pitch Field", description="How the pitch varies over the region", type=BubblePatternField
    )
    edge_offset: length_property(
        name="Edge Offset",
        description="Extra distance between the first row of features and the boundary of the region",
        default=0.0,
        update=repack,
    )
    orientation: EnumProperty(
        name="Rows",
        description="Where the rows of the arrangement run",
        items=(
            ('EDGE', "Along Edge", "Along the longest straight edge of the region"),
            ('BEST', "Best of Four", "In the best of four directions, which takes four times as long"),
            ('GIVEN', "Direction", "Along a direction"),
        ),
        default='EDGE',
        update=repack,
    )
    rows_along: FloatVectorProperty(
        name="Row Direction",
        description="Direction of the rows in the coordinates of the base",
        size=3,
        subtype='XYZ',
        default=(1.0, 0.0, 0.0),
        update=repack,
    )
    symmetry: EnumProperty(
        name="Symmetry",
        description="Make the arrangement symmetric where the region is, in the axes of the base",
        items=(
            ('OFF', "Off", "No symmetry but what comes by itself"),
            ('AUTO', "Auto", "Whichever symmetry the region has"),
            ('X', "Mirror X", "One half the mirror image of the other, left and right"),
            ('Y', "Mirror Y", "One half the mirror image of the other, front and back"),
            ('Z', "Mirror Z", "One half the mirror image of the other, top and bottom"),
            ('XY', "Mirror X and Y", "Every quarter the mirror image of its neighbors"),
            ('XZ', "Mirror X and Z", "Every quarter the mirror image of its neighbors"),
            ('YZ', "Mirror Y and Z", "Every quarter the mirror image of its neighbors"),
            ('ROTATE', "Rotate", "The same again after a part of a turn"),
        ),
        default='OFF',
        update=repack,
    )
    symmetry_fold: IntProperty(
        name="Fold",
        description="How many times the arrangement repeats in one turn",
        default=3,
        min=2,
        max=MOST_FOLD,
        update=repack,
    )
    symmetry_axis: EnumProperty(
        name="Axis",
        description="What the arrangement turns about",
        items=(
            ('REGION', "Region", "The way the region faces"),
            ('X', "X", "The X axis of the base"),
            ('Y', "Y", "The Y axis of the base"),
            ('Z', "Z", "The Z axis of the base"),
        ),
        default='REGION',
        update=repack,
    )
    use_symmetry_centre: BoolProperty(
        name="Own Center",
        description="Mirror or turn about a point of your choice, not the middle of the region",
        default=False,
        update=repack,
    )
    symmetry_centre: FloatVectorProperty(
        name="Center",
        description="Point of the mirror planes or of the axis, in the coordinates of the base",
        size=3,
        subtype='TRANSLATION',
        update=repack,
    )
    integrator: EnumProperty(
        name="Integrator",
        description="How the bubbles find their equilibrium",
        items=(
            ('FIRE', "Fast", "Fast inertial relaxation, to the same equilibrium in fewer steps"),
            ('RK4', "Runge-Kutta", "Equation of motion, integrated by the fourth-order Runge-Kutta method"),
        ),
        default='FIRE',
        update=repack,
    )
    seed: IntProperty(
        name="Seed",
        description="Choose another arrangement of the same quality",
        default=0,
        min=0,
        update=repack,
    )
    iterations: IntProperty(
        name="Iterations",
        description="Most steps the bubbles may take to their equilibrium",
        default=Packing().iterations,
        min=1,
        soft_max=2000,
        update=repack,
    )
    tolerance: FloatProperty(
        name="Tolerance",
        description="Stop when no bubble moves farther than this share of its pitch in one step",
        default=Packing().tolerance,
        min=1e-9,
        max=1.0,
        precision=5,
        update=repack,
    )
    diameter: length_property(
        name="Diameter",
        description="Diameter of the features",
        default=0.0018,
        **SIZE,
        update=reshape,
    )
    diameter_mode: EnumProperty(
        name="Diameter As",
        description="How the size of the features is given",
        items=(
            ('SIZE', "Size", "As a diameter"),
            ('SHARE', "Share", "Relative to the pitch there: large features where it is wide"),
        ),
        default='SIZE',
        update=reshape,
    )
    fill: FloatProperty(
        name="Diameter / Pitch",
        description="Diameter of the features relative to the pitch where they are",
        subtype='FACTOR',
        default=FILL,
        min=0.01,
        max=0.99,
        update=reshape,
    )
    diameter_field: PointerProperty(
        name="Diameter Field",
        description="How the diameter varies over the region",
        type=BubblePatternField,
    )
    seeds: CollectionProperty(
        name="Fixed Sizes",
        description="Features that keep the size they were given, while the others level out between them",
        type=BubblePatternSeed,
    )
    solver: EnumProperty(
        name="Averages",
        description="How the sizes between fixed ones are found",
        items=(
            ('DIRECT', "Direct", "Solved at once"),
            ('ITERATE', "Iterate", "Averaged again and again, until sizes no longer change"),
        ),
        default='DIRECT',
        update=reshape,
    )
    shaping_tolerance: FloatProperty(
        name="Size Tolerance",
        description="Stop averaging when no size changes by more than this share",
        default=Shaping().tolerance,
        min=1e-12,
        max=1.0,
        precision=6,
        update=reshape,
    )
    shaping_iterations: IntProperty(
        name="Size Iterations",
        description="Most times that sizes are averaged",
        default=Shaping().iterations,
        min=1,
        update=reshape,
    )
    depth_mode: EnumProperty(
        name="Depth",
        description="How deep the holes go",
        items=(
            ('THROUGH', "Through", "Through the near wall, however thick it is there"),
            ('BLIND', "Blind", "To a given depth below the surface"),
        ),
        default='THROUGH',
    )
    depth: length_property(
        name="Depth",
        description="Depth of the holes below the surface",
        default=0.001,
        **SIZE,
    )
    sides: IntProperty(
        name="Sides",
        description="Corners of a hole's profile, or 0 to choose them by the hole's size",
        default=0,
        min=0,
        soft_max=128,
        max=1024,
    )
    facet_tolerance: length_property(
        name="Facet Tolerance",
        description="Most that the facets of a hole may stray from its circle, or 0 to choose it by the size",
        min=0.0,
    )
    min_web: length_property(
        name="Min Web",
        description="Material that must remain between two features",
        default=0.0,
        min=0.0,
        update=reshape,
    )
    min_margin: length_property(
        name="Min Margin",
        description="Material that must remain between a feature and the boundary of the region",
        default=0.0,
        min=0.0,
        update=reshape,
    )
    min_diameter: length_property(
        name="Min Diameter",
        description="Leave out features that would have to be smaller than this",
        default=0.0,
        min=0.0,
        update=reshape,
    )
    wall_material: PointerProperty(
        name="Wall Material",
        description="Material of the walls of the holes, or that of the base where none is chosen",
        type=bpy.types.Material,
    )
    live: BoolProperty(
        name="Live Update",
        description="Lay the pattern anew with every change, as long as that takes less than half a second",
        default=True,
    )
    show_bubbles: BoolProperty(
        name="Show Bubbles",
        description="Draw the territory of every feature as a ring",
        default=False,
        update=redraw_preview,
    )

    # What came out of the last generation. -1 where nothing could be measured.
    made_with: StringProperty(options={'HIDDEN'})
    fingerprint: StringProperty(options={'HIDDEN'})
    size_trace: StringProperty(options={'HIDDEN'})
    trouble: StringProperty(options={'HIDDEN'})
    version: IntProperty(options={'HIDDEN'})
    seconds: FloatProperty(options={'HIDDEN'})
    count: IntProperty(name="Features", description="Number of features", options={'HIDDEN'})
    shrunk: IntProperty(options={'HIDDEN'})
    dropped: IntProperty(options={'HIDDEN'})
    notes: StringProperty(options={'HIDDEN'})
    six: FloatProperty(name="Order", subtype='FACTOR', min=-1.0, max=1.0, options={'HIDDEN'})
    gap_min: FloatProperty(name="Smallest Gap", options={'HIDDEN'})
    web: FloatProperty(name="Smallest Web", subtype='DISTANCE', options={'HIDDEN'})
    margin: FloatProperty(name="Smallest Margin", subtype='DISTANCE', options={'HIDDEN'})
    open_area: FloatProperty(name="Open Area", options={'HIDDEN'})
    verdict: StringProperty(options={'HIDDEN'})


def in_scene(obj: bpy.types.Object | None) -> bool:
    """Whether `obj` stands in some collection; a deleted object that something points at does not."""
    return obj is not None and bool(obj.users_collection)


def is_pattern(obj: bpy.types.Object | None) -> bool:
    """Whether `obj` is the object of a pattern."""
    return obj is not None and obj.bubble_pattern.base is not None


def pattern_objects(base: bpy.types.Object) -> list[bpy.types.Object]:
    """The patterns on `base`, in the order of their names."""
    return sorted((o for o in base.children if o.bubble_pattern.base == base), key=lambda o: o.name)


def pattern_of(obj: bpy.types.Object | None) -> bpy.types.Object | None:
    """The pattern that `obj` is, or carries (of several the one it names), or was made of."""
    if obj is None or is_pattern(obj):
        return obj
    named = obj.bubble_pattern.pattern
    if in_scene(named) and obj in (named.bubble_pattern.base, named.bubble_pattern.part):
        return named
    on_base = pattern_objects(obj)
    return on_base[0] if on_base else None


CLASSES = (BubblePatternField, BubblePatternSeed, BubblePatternSettings)
_register, _unregister = bpy.utils.register_classes_factory(CLASSES)


def register() -> None:
    """Give every object its settings."""
    _register()
    bpy.types.Object.bubble_pattern = PointerProperty(type=BubblePatternSettings)


def unregister() -> None:
    """Take the settings back."""
    del bpy.types.Object.bubble_pattern
    _unregister()
