"""The sub-panel of what must remain of the part."""

from __future__ import annotations

import bpy

from .sidebar import SettingsPanel


class BUBBLE_PATTERN_PT_limits(SettingsPanel, bpy.types.Panel):
    """What must remain of the part."""

    bl_label = "Limits"
    bl_order = 5
    bl_options = {'DEFAULT_CLOSED'}
    fields = ("min_web", "min_margin", "min_diameter")


CLASSES = (BUBBLE_PATTERN_PT_limits,)
