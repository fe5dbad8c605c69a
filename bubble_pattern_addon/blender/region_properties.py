# mypy: disable-error-code="valid-type"
"""The settings of the target region."""

from __future__ import annotations

from bpy.props import CollectionProperty, IntProperty, StringProperty

from .field_properties import length_property
from .keep_out_properties import BubblePatternKeepOut
from .reacting import repack


class RegionSettings:
    """Which faces the pattern fills, as the recipe's [region]."""

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
    keep_out: CollectionProperty(
        name="Keep-Outs",
        description="What the pattern goes round: screw bosses, a logo",
        type=BubblePatternKeepOut,
    )
    active_keep_out: IntProperty(
        name="Active Keep-Out", description="The keep-out whose settings are shown", min=0
    )
