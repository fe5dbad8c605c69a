"""The sub-panel of step 2."""

from __future__ import annotations

import bpy

from .field_panels import draw_field
from .sidebar import SettingsPanel, columns, shown_settings


class BUBBLE_PATTERN_PT_shaping(SettingsPanel, bpy.types.Panel):
    """Step 2: how large the features are."""

    bl_label = "Shaping"
    bl_order = 3

    def draw(self, context: bpy.types.Context) -> None:
        settings = shown_settings(context)
        column = columns(self.layout)
        share = settings.diameter_mode == 'SHARE'
        constant, unit = ("fill", "share") if share else ("diameter", "size")
        draw_field(column, settings, constant, "diameter_field", unit, "Diameter")
        column.row().prop(settings, "diameter_mode", text=" ", expand=True)
        column.prop(settings, "sizes")
        if settings.sizes == 'LIST':
            column.prop(settings, "size_list", text=" ")
        row = column.row(align=True)
        if context.mode == 'OBJECT':
            row.operator("bubble_pattern.edit_sizes", icon='PINNED')
        else:
            row.operator("bubble_pattern.fix_sizes", icon='PINNED')
        if settings.seeds:
            row.operator("bubble_pattern.free_sizes", text="Free", icon='UNPINNED')
        if settings.seeds:
            column.label(text=f"{len(settings.seeds):,} fixed", icon='PINNED')
            column.prop(settings, "solver")


CLASSES = (BUBBLE_PATTERN_PT_shaping,)
