# mypy: disable-error-code="valid-type"
"""The settings of what one feature is."""

from __future__ import annotations

import bpy
from bpy.props import EnumProperty, IntProperty, PointerProperty

from .field_properties import SIZE, length_property


class FeatureSettings:
    """What one feature is, as the recipe's [feature]."""

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
    wall_material: PointerProperty(
        name="Wall Material",
        description="Material of the walls of the holes, or that of the base where none is chosen",
        type=bpy.types.Material,
    )
