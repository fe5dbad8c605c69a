# mypy: disable-error-code="valid-type"
"""What came out of the last generation."""

from __future__ import annotations

from bpy.props import BoolProperty, FloatProperty, IntProperty, StringProperty


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
    gap_min: FloatProperty(name="Smallest Gap", options={'HIDDEN'})
    web: FloatProperty(name="Smallest Web", subtype='DISTANCE', options={'HIDDEN'})
    margin: FloatProperty(name="Smallest Margin", subtype='DISTANCE', options={'HIDDEN'})
    open_area: FloatProperty(name="Open Area", options={'HIDDEN'})
    verdict: StringProperty(options={'HIDDEN'})
