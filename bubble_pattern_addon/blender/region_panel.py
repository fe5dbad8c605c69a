"""The sub-panel of the target region."""

from __future__ import annotations

import bpy

from .keep_outs import BUBBLE_PATTERN_PT_keep_out
from .sidebar import SettingsPanel, columns, shown_settings


class BUBBLE_PATTERN_PT_region(SettingsPanel, bpy.types.Panel):
    """Which faces the pattern fills."""

    bl_label = "Region"
    bl_order = 1
    bl_options = {'DEFAULT_CLOSED'}

    def draw(self, context: bpy.types.Context) -> None:
        settings = shown_settings(context)
        column = columns(self.layout)
        column.prop(settings, "parts")
        if settings.parts:
            column.prop(settings, "gap")


CLASSES = (BUBBLE_PATTERN_PT_region, BUBBLE_PATTERN_PT_keep_out)
