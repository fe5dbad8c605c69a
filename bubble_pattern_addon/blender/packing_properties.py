# mypy: disable-error-code="valid-type"
"""The settings of step 1."""

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
)

from ..core.isometries import MOST_FOLD
from ..core.recipe import Packing
from .field_properties import SIZE, BubblePatternField, length_property
from .reacting import repack


class BubblePatternPin(bpy.types.PropertyGroup):
    """A feature that stays where it is, by its place in the frame of the base."""

    at: FloatVectorProperty(
        name="Place", description="Where the feature is", size=3, subtype='TRANSLATION', precision=6
    )


def stands_beside(settings: bpy.types.PropertyGroup, obj: bpy.types.Object) -> bool:
    """Whether `obj` is no pattern, and neither the base nor the part of this one."""
    return obj.bubble_pattern.base is None and obj not in (settings.base, settings.part)


class PackingSettings:
    """Where the features are, as the recipe's [packing]."""

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
    use_symmetry_axes: BoolProperty(
        name="Own Axes",
        description="Let the symmetry go by other axes than those of the base, as where it stands askew",
        default=False,
        update=repack,
    )
    symmetry_object: PointerProperty(
        name="Axes Of",
        description="Object, such as an empty, whose axes the symmetry goes by",
        type=bpy.types.Object,
        poll=stands_beside,
        update=repack,
    )
    symmetry_rotation: FloatVectorProperty(
        name="Rotation",
        description="How the axes of the symmetry are turned against those of the base",
        size=3,
        subtype='EULER',
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
    pins: CollectionProperty(
        name="Pinned Features",
        description="Features that stay where they are, whatever happens to the others",
        type=BubblePatternPin,
    )
