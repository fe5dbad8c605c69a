# mypy: disable-error-code="valid-type"
"""The settings of what must remain of the part."""

from __future__ import annotations

from bpy.props import BoolProperty, EnumProperty

from .field_properties import length_property
from .reacting import reshape


class LimitSettings:
    """What must remain between features, as the recipe's [limits]."""

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
    process: EnumProperty(
        name="Process",
        description="How the part will be made: its rules for holes, webs and margins hold too",
        items=(
            ('NONE', "None", "No rules but the limits below"),
            (
                'PUNCHED_SHEET',
                "Punched Sheet",
                "Holes and webs from the sheet's thickness, margins from 1.5 of it",
            ),
            (
                'INJECTION_MOULDING',
                "Injection Molding",
                "Webs and margins from 1.5 of the wall's thickness, holes no deeper than 4 diameters, draft",
            ),
            ('FDM_PRINT', "FDM Print", "Holes from 2 mm, webs and margins of two lines of a 0.4 mm nozzle"),
            ('CNC', "CNC", "Holes from 1 mm and no deeper than 10 diameters, webs and margins from 0.8 mm"),
            ('LASER', "Laser", "Holes and webs from 0.7 of the sheet's thickness, margins from all of it"),
        ),
        default='NONE',
        update=reshape,
    )
    thickness: length_property(
        name="Thickness",
        description="Thickness of the wall that the rules go by, or 0 to measure it under each feature",
        default=0.0,
        min=0.0,
        update=reshape,
    )
    check_only: BoolProperty(
        name="Only Check",
        description="Leave the features as they are, and only tell which of them break a rule of the process",
        default=False,
        update=reshape,
    )
