# mypy: disable-error-code="valid-type"
"""The settings of what must remain of the part."""

from __future__ import annotations

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
