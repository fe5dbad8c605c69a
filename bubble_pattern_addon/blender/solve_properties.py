# mypy: disable-error-code="valid-type"
"""The settings of a target that pitch or diameter are found for."""

from __future__ import annotations

from bpy.props import EnumProperty, FloatProperty, IntProperty


class SolveSettings:
    """What the pattern shall come to, as the recipe's [solve]."""

    solve_for: EnumProperty(
        name="Solve For",
        description="What the pattern shall come to",
        items=(
            ('OPEN_AREA', "Open Area", "The share of the region that the features take"),
            ('COUNT', "Count", "The number of features"),
        ),
        default='OPEN_AREA',
    )
    solve_by: EnumProperty(
        name="By",
        description="What is changed to reach the open area",
        items=(
            ('DIAMETER', "Diameter", "Features become larger or smaller where they are"),
            ('PITCH', "Pitch", "Features keep their size and move closer or apart"),
        ),
        default='DIAMETER',
    )
    solve_open_area: FloatProperty(
        name="Open Area",
        description="Share of the region that the features shall take",
        subtype='PERCENTAGE',
        default=35.0,
        min=0.1,
        max=90.0,
        precision=1,
    )
    solve_count: IntProperty(
        name="Count",
        description="Number of features that there shall be",
        default=500,
        min=1,
        soft_max=10_000,
        max=1_000_000,
    )
