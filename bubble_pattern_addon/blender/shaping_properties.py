# mypy: disable-error-code="valid-type"
"""The settings of step 2."""

from __future__ import annotations

import bpy
from bpy.props import (
    CollectionProperty,
    EnumProperty,
    FloatProperty,
    FloatVectorProperty,
    IntProperty,
    PointerProperty,
    StringProperty,
)

from ..core.recipe import FILL, Shaping
from .field_properties import SIZE, BubblePatternField, length_property
from .reacting import reshape


class BubblePatternSeed(bpy.types.PropertyGroup):
    """A feature whose diameter the user has fixed, by its place in the frame of the base."""

    at: FloatVectorProperty(
        name="Place", description="Where the feature is", size=3, subtype='TRANSLATION', precision=6
    )
    diameter: length_property("Diameter", "Diameter that the feature keeps", 0.001, **SIZE)


class ShapingSettings:
    """How large the features are, as the recipe's [shaping]."""

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
    sizes: EnumProperty(
        name="Sizes",
        description="Which diameters there are: every feature gets the nearest smaller one",
        items=(
            ('ANY', "Any", "Every diameter"),
            ('DRILLS_01', "Drills by 0.1 mm", "Twist drills in steps of 0.1 mm, from 0.2 to 14 mm"),
            ('DRILLS_05', "Drills by 0.5 mm", "Twist drills in steps of 0.5 mm, from 0.5 to 25 mm"),
            ('DRILLS_1', "Drills by 1 mm", "Twist drills in steps of 1 mm, from 1 to 50 mm"),
            ('TAP_DRILLS', "Tap Drills", "Holes for metric coarse threads, M1 to M24, after ISO 2306"),
            ('R10', "R10", "Ten preferred numbers to a decade, after ISO 3, in millimeters"),
            ('R20', "R20", "Twenty preferred numbers to a decade, after ISO 3, in millimeters"),
            ('LIST', "List", "Those of a list"),
        ),
        default='ANY',
        update=reshape,
    )
    size_list: StringProperty(
        name="Size List",
        description="Diameters, separated by commas, in the unit of the scene or with another unit behind",
        default="",
        update=reshape,
    )
