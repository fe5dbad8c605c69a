"""What the panels of the sidebar have in common: where they stand, and how they lay things out."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import bpy

from .properties import in_scene, pattern_of


class SidebarPanel:
    """Where all the panels stand."""

    bl_space_type = 'VIEW_3D'
    bl_region_type = 'UI'
    bl_category = "Bubble Pattern"


class SettingsPanel(SidebarPanel):
    """A part of the settings, shown while a pattern is there to be edited; `fields` names them."""

    bl_parent_id = "BUBBLE_PATTERN_PT_main"
    fields: tuple[str, ...] = ()
    if TYPE_CHECKING:  # what the panel itself brings
        layout: bpy.types.UILayout

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        obj = pattern_of(context.active_object)
        return obj is not None and in_scene(obj.bubble_pattern.base) and not is_applied(obj)

    def draw(self, context: bpy.types.Context) -> None:
        column = columns(self.layout)
        for field in self.fields:
            column.prop(shown_settings(context), field)


def is_applied(obj: bpy.types.Object) -> bool:
    """Whether the part of the pattern `obj` stands in the place of its base."""
    part = obj.bubble_pattern.part
    return in_scene(part) and part.visible_get() and not obj.visible_get()


def shown_settings(context: bpy.types.Context) -> Any:
    """Settings of the pattern that the panels show, which poll has made sure of."""
    obj = pattern_of(context.active_object)
    assert obj is not None
    return obj.bubble_pattern


def columns(layout: bpy.types.UILayout) -> bpy.types.UILayout:
    """A column of properties with their names on the left."""
    layout.use_property_split = True
    layout.use_property_decorate = False
    return layout.column()


def large(layout: bpy.types.UILayout) -> bpy.types.UILayout:
    """A row for the button that is the next step."""
    row = layout.row()
    row.scale_y = 1.5
    return row


def sentences(layout: bpy.types.UILayout, text: str, width: int, icon: str) -> None:
    """Text over as many lines as it needs in a sidebar `width` pixels wide."""
    per_line = max(int(width / bpy.context.preferences.system.ui_scale / 7) - 6, 16)
    lines: list[str] = [""]
    for word in text.split():
        if lines[-1] and len(lines[-1]) + len(word) >= per_line:
            lines.append("")
        lines[-1] = f"{lines[-1]} {word}".strip()
    column = layout.column(align=True)
    column.scale_y = 0.8
    for number, line in enumerate(lines):
        column.label(text=line, icon=icon if number == 0 else 'BLANK1')
