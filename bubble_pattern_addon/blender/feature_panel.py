"""The sub-panel of what one feature is."""

from __future__ import annotations

import bpy

from .sidebar import SettingsPanel, columns, shown_settings


class BUBBLE_PATTERN_PT_feature(SettingsPanel, bpy.types.Panel):
    """What one feature is."""

    bl_label = "Feature"
    bl_order = 4

    def draw(self, context: bpy.types.Context) -> None:
        settings = shown_settings(context)
        column = columns(self.layout)
        column.row().prop(settings, "depth_mode", expand=True)
        if settings.depth_mode == 'BLIND':
            column.prop(settings, "depth", text=" ")
        column.prop(settings, "sides", text="Sides (0 = Auto)")
        column.prop(settings, "facet_tolerance")
        column.prop(settings, "wall_material")


CLASSES = (BUBBLE_PATTERN_PT_feature,)
