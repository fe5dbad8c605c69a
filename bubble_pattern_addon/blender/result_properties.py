# mypy: disable-error-code="valid-type"
"""What came out of the last generation."""

from __future__ import annotations

import bpy
from bpy.props import (
    BoolProperty,
    CollectionProperty,
    FloatProperty,
    FloatVectorProperty,
    IntProperty,
    IntVectorProperty,
    StringProperty,
)


def mark(settings: bpy.types.PropertyGroup, context: bpy.types.Context) -> None:
    """Marks are wished for, or no more."""
    from . import overlay

    overlay.refresh(context)


class BubblePatternBroken(bpy.types.PropertyGroup):
    """A rule that features break; see core.floors.Broken."""

    rule: StringProperty(options={'HIDDEN'})
    count: IntProperty(options={'HIDDEN'})
    worst: FloatProperty(options={'HIDDEN'})
    least: FloatProperty(options={'HIDDEN'})


class ResultSettings:
    """What came out of the last generation. -1 where nothing could be measured."""

    made_with: StringProperty(options={'HIDDEN'})
    laid: StringProperty(options={'HIDDEN'})
    fingerprint: StringProperty(options={'HIDDEN'})
    size_trace: StringProperty(options={'HIDDEN'})
    trouble: StringProperty(options={'HIDDEN'})
    cut_trouble: StringProperty(options={'HIDDEN'})
    version: IntProperty(options={'HIDDEN'})
    hand_made: BoolProperty(options={'HIDDEN'})
    seconds: FloatProperty(options={'HIDDEN'})
    count: IntProperty(name="Features", description="Number of features", options={'HIDDEN'})
    shrunk: IntProperty(options={'HIDDEN'})
    dropped: IntProperty(options={'HIDDEN'})
    notes: StringProperty(options={'HIDDEN'})
    six: FloatProperty(name="Order", subtype='FACTOR', min=-1.0, max=1.0, options={'HIDDEN'})
    psi6: FloatProperty(default=-1.0, options={'HIDDEN'})
    gap_cv: FloatProperty(default=-1.0, options={'HIDDEN'})
    gap_min: FloatProperty(name="Smallest Gap", options={'HIDDEN'})
    rim_cv: FloatProperty(default=-1.0, options={'HIDDEN'})
    void: FloatProperty(default=-1.0, options={'HIDDEN'})
    words: StringProperty(options={'HIDDEN'})
    web: FloatProperty(name="Smallest Web", subtype='DISTANCE', options={'HIDDEN'})
    web_between: FloatVectorProperty(size=6, options={'HIDDEN'})
    """The two points between which the smallest web lies, in the pattern's frame."""
    web_normal: FloatVectorProperty(size=3, default=(0.0, 0.0, 1.0), options={'HIDDEN'})
    web_ids: IntVectorProperty(size=2, default=(-1, -1), options={'HIDDEN'})
    mean_web: FloatProperty(default=-1.0, options={'HIDDEN'})
    margin: FloatProperty(name="Smallest Margin", subtype='DISTANCE', options={'HIDDEN'})
    smallest: FloatProperty(default=-1.0, options={'HIDDEN'})
    largest: FloatProperty(default=-1.0, options={'HIDDEN'})
    open_area: FloatProperty(name="Open Area", options={'HIDDEN'})
    removed: FloatProperty(default=-1.0, options={'HIDDEN'})
    """Volume as estimated; while part_made_with holds, the part itself tells it: part_removed, below 0 where
    bumps add.
    """
    part_removed: FloatProperty(options={'HIDDEN'})
    part_made_with: StringProperty(options={'HIDDEN'})
    nominal: StringProperty(options={'HIDDEN'})
    broken: CollectionProperty(type=BubblePatternBroken, options={'HIDDEN'})
    verdict: StringProperty(options={'HIDDEN'})
    density: FloatProperty(
        name="Density",
        description="Of the material in g/cm³, for the mass of what is removed, or 0 to leave it out",
        default=0.0,
        min=0.0,
        soft_max=20.0,
        precision=2,
    )
    show_marks: BoolProperty(
        name="Mark in Viewport",
        description="Show where the smallest web is, and ring the features that break a rule",
        default=False,
        update=mark,
    )
