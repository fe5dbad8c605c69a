"""How a field is drawn: its kind, its two values and the way between them, in a narrow sidebar."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import bpy

# properties below the two values, by kind; a choice decides which of the others are shown
SHOWN: Mapping[str, tuple[str, ...]] = {
    'LINEAR': ("along",),
    'RADIAL': ("about", "axis", "inner", "radius"),
    'EDGE': ("distance", "loops"),
    'DISTANCE': ("object", "objects", "distance"),
    'ATTRIBUTE': ("attribute", "low", "high"),
    'IMAGE': ("channel", "mapping"),
}


def draw_field(
    column: bpy.types.UILayout, settings: Any, constant: str, group: str, unit: str, label: str
) -> None:
    """Draw the number `constant` of the settings, or where it varies, the field `group`, whose values are in
    `unit`: "size", "share" or "angle".
    """
    field = getattr(settings, group)
    row = column.row(align=True)
    if field.kind == 'CONSTANT':
        row.prop(settings, constant, text=label)
        row.prop(field, "kind", text="", icon_only=True)
        return
    row.prop(field, "kind", text=label)
    below = column.column(align=True)
    if field.kind == 'RECIPE':
        below.prop(field, "text", text=" ")
        return
    below.prop(field, f"start_{unit}")
    below.prop(field, f"end_{unit}")
    below = column.column()
    if field.kind == 'IMAGE':
        below.template_ID(field, "image", open="image.open")
    for name in SHOWN[field.kind]:
        below.prop(field, name)
        draw_choice(below, field, name)
    row = column.row(align=True)
    row.prop(field, "falloff")
    row.prop(field, "invert", text="", icon='ARROW_LEFTRIGHT', toggle=True)
    if field.falloff == 'CURVE':
        column.column(align=True).prop(field, "heights", slider=True)
    if field.falloff == 'LINEAR' and field.kind in {'LINEAR', 'ATTRIBUTE'}:
        column.prop(field, "clamp")


def draw_choice(column: bpy.types.UILayout, field: Any, name: str) -> None:
    """Draw what goes with the choice `name`."""
    if name == "along" and field.along == 'DIRECTION':
        column.prop(field, "direction")
    elif name == "along":
        for end in ("start", "end"):
            column.prop(field, f"{end}_object", text=end.title())
            if getattr(field, f"{end}_object") is None:
                column.prop(field, end, text=" ")
    elif name == "about" and field.about != 'MIDDLE':
        column.prop(field, "object" if field.about == 'OBJECT' else "centre")
    elif name == "mapping":
        column.prop(field, "width" if field.mapping == 'FLAT' else "uv")
    elif name == "attribute" and is_colour(field):
        column.prop(field, "channel")


def is_colour(field: Any) -> bool:
    """Whether the attribute that the field follows is a color."""
    base = field.id_data.bubble_pattern.base
    known = None if base is None else base.data.attributes.get(field.attribute)
    return known is not None and known.data_type.endswith('COLOR')
