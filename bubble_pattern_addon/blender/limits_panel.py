"""The sub-panel of what must remain of the part."""

from __future__ import annotations

import bpy

from .sidebar import SettingsPanel, columns, shown_settings


class BUBBLE_PATTERN_PT_limits(SettingsPanel, bpy.types.Panel):
    """What must remain of the part."""

    bl_label = "Limits"
    bl_order = 5
    bl_options = {'DEFAULT_CLOSED'}

    def draw(self, context: bpy.types.Context) -> None:
        settings = shown_settings(context)
        column = columns(self.layout)
        column.prop(settings, "process")
        if settings.process != 'NONE':
            column.prop(settings, "thickness")
            if settings.thickness == 0:
                column.label(text="0: measured under each feature", icon='BLANK1')
            column.prop(settings, "check_only")
        for field in ("min_web", "min_margin", "min_diameter"):
            column.prop(settings, field)


CLASSES = (BUBBLE_PATTERN_PT_limits,)
