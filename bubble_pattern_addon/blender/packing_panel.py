"""The sub-panel of step 1."""

from __future__ import annotations

import bpy

from .field_panels import draw_field
from .sidebar import SettingsPanel, columns, sentences, shown_settings


class BUBBLE_PATTERN_PT_packing(SettingsPanel, bpy.types.Panel):
    """Step 1: where the features are."""

    bl_label = "Packing"
    bl_order = 2

    def draw(self, context: bpy.types.Context) -> None:
        settings = shown_settings(context)
        column = columns(self.layout)
        draw_field(column, settings, "pitch", "pitch_field", "size", "Pitch")
        column.prop(settings, "edge_offset")
        column.prop(settings, "orientation")
        if settings.orientation == 'GIVEN':
            column.prop(settings, "rows_along", text=" ")
        draw_symmetry(column, settings)
        column.prop(settings, "seed")
        if context.mode == 'OBJECT':
            column.operator("bubble_pattern.edit_sizes", text="Edit Points", icon='EDITMODE_HLT')
        draw_hand_work(self.layout, settings, context)


def draw_hand_work(
    layout: bpy.types.UILayout, settings: bpy.types.PropertyGroup, context: bpy.types.Context
) -> None:
    """How many features are pinned, and that others were placed by hand."""
    if settings.pins:
        layout.label(text=f"{len(settings.pins):,} pinned", icon='PINNED')
    if settings.hand_made:
        words = "Settled by hand: Update would keep only pinned features"
        sentences(layout, words, context.region.width, 'INFO')


def draw_symmetry(column: bpy.types.UILayout, settings: bpy.types.PropertyGroup) -> None:
    """The symmetry, and what is known only of some."""
    column.prop(settings, "symmetry")
    if settings.symmetry == 'ROTATE':
        column.prop(settings, "symmetry_fold")
        column.prop(settings, "symmetry_axis")
    if settings.symmetry == 'OFF':
        return
    column.prop(settings, "use_symmetry_centre")
    if settings.use_symmetry_centre:
        column.prop(settings, "symmetry_centre", text=" ")
    column.prop(settings, "use_symmetry_axes")
    if settings.use_symmetry_axes:
        column.prop(settings, "symmetry_object")
        if settings.symmetry_object is None:
            column.prop(settings, "symmetry_rotation")


class BUBBLE_PATTERN_PT_solver(SettingsPanel, bpy.types.Panel):
    """How step 1 is solved."""

    bl_label = "Solver"
    bl_parent_id = "BUBBLE_PATTERN_PT_packing"
    bl_options = {'DEFAULT_CLOSED'}
    fields = ("integrator", "iterations", "tolerance")


CLASSES = (BUBBLE_PATTERN_PT_packing, BUBBLE_PATTERN_PT_solver)
