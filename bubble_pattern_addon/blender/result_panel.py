"""The sub-panels of what came out, and of how it is shown."""

from __future__ import annotations

import bpy

from .settings_recipe import is_outdated, length_text
from .sidebar import SettingsPanel, sentences, shown_settings


class BUBBLE_PATTERN_PT_preview(SettingsPanel, bpy.types.Panel):
    """How the pattern is shown."""

    bl_label = "Preview"
    bl_order = 7
    bl_options = {'DEFAULT_CLOSED'}
    fields = ("live", "show_bubbles", "cut_preview")

    def draw(self, context: bpy.types.Context) -> None:
        super().draw(context)
        trouble = shown_settings(context).cut_trouble
        if trouble:
            sentences(self.layout, trouble, context.region.width, 'ERROR')


class BUBBLE_PATTERN_PT_result(SettingsPanel, bpy.types.Panel):
    """What came out."""

    bl_label = "Result"
    bl_order = 6

    def draw(self, context: bpy.types.Context) -> None:
        settings = shown_settings(context)
        self.layout.active = not is_outdated(settings)
        figures: list[tuple[str, str, bool]] = [("Features", f"{settings.count:,}", settings.count == 0)]
        for name, count in (("Made Smaller", settings.shrunk), ("Left Out", settings.dropped)):
            if count:
                figures.append((name, f"{count:,}", False))
        if settings.count > 1:
            figures.append(
                ("Smallest Web", length_text(context, settings.web), settings.web < settings.min_web)
            )
        if settings.margin >= 0:
            margin = settings.margin
            figures.append(("Smallest Margin", length_text(context, margin), margin < settings.min_margin))
        figures.append(("Open Area", f"{settings.open_area:.1%}", False))
        if settings.six >= 0:
            figures.append(("Six Neighbors", f"{settings.six:.1%}", False))
        if settings.gap_min >= 0:
            figures.append(("Smallest Gap", f"{settings.gap_min:.2f} pitch", False))
        table = self.layout.column(align=True)
        for name, figure, alert in figures:
            split = table.split(factor=0.5)
            left = split.row()
            left.alignment = 'RIGHT'
            left.label(text=name)
            right = split.row()
            right.alert = alert
            right.label(text=figure)
        if settings.notes:
            sentences(self.layout, settings.notes, context.region.width, 'INFO')


CLASSES = (BUBBLE_PATTERN_PT_result, BUBBLE_PATTERN_PT_preview)
