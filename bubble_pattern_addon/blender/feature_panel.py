"""The sub-panels of what one feature is: only what goes with its kind."""

from __future__ import annotations

from typing import Any

import bpy

from ..core.feature_recipe import ASPECTS, ROUNDED
from .field_panels import draw_field
from .sidebar import SettingsPanel, columns, shown_settings


class BUBBLE_PATTERN_PT_feature(SettingsPanel, bpy.types.Panel):
    """What one feature is."""

    bl_label = "Feature"
    bl_order = 4

    def draw(self, context: bpy.types.Context) -> None:
        settings = shown_settings(context)
        self.layout.row().prop(settings, "kind", expand=True)  # all of a narrow sidebar's width
        column = columns(self.layout)
        draw_profile(column, settings)
        column.separator()
        if settings.kind == 'HOLE':
            draw_hole(column, settings)
        elif settings.kind == 'DIMPLE':
            draw_field(column, settings, "dimple_depth", "depth_field", "size", "Depth")
        else:
            draw_bump(column, settings)


def draw_profile(column: bpy.types.UILayout, settings: Any) -> None:
    """Draw the outline and what goes with it."""
    column.prop(settings, "profile")
    profile = settings.profile.lower()
    if profile in ASPECTS:
        draw_field(column, settings, "aspect", "aspect_field", "share", "Aspect")
    if profile == "polygon":
        column.prop(settings, "corners")
    if profile in ROUNDED:
        column.prop(settings, "rounding")
    if profile == "curve":
        column.prop(settings, "profile_curve")
        if settings.profile_curve is None and settings.profile_points:
            column.label(text="Outline from a recipe", icon='TEXT')
    if profile == "mesh":
        column.prop(settings, "profile_mesh")


def draw_hole(column: bpy.types.UILayout, settings: Any) -> None:
    """Draw what goes with holes."""
    column.row().prop(settings, "depth_mode", expand=True)
    if settings.depth_mode == 'BLIND':
        draw_field(column, settings, "depth", "depth_field", "size", " ")
    if settings.profile != 'MESH':
        draw_walls(column, settings)


def draw_bump(column: bpy.types.UILayout, settings: Any) -> None:
    """Draw what goes with bumps."""
    if settings.profile != 'MESH':
        column.row().prop(settings, "form", expand=True)
    draw_field(column, settings, "height", "depth_field", "size", "Height")
    if settings.form == 'BOSS' and settings.profile != 'MESH':
        draw_walls(column, settings)


def draw_walls(column: bpy.types.UILayout, settings: Any) -> None:
    """Draw rim and draft."""
    column.prop(settings, "rim")
    if settings.rim != 'SHARP':
        column.prop(settings, "rim_size", text="Size")
    if settings.rim == 'CHAMFER':
        column.prop(settings, "rim_angle", text="Angle")
    draw_field(column, settings, "draft", "draft_field", "angle", "Draft")


def draw_turn(column: bpy.types.UILayout, settings: Any) -> None:
    """Draw where the features head."""
    column.prop(settings, "turn", text="Along")
    if settings.turn == 'FIXED':
        column.prop(settings, "turn_direction")
    elif settings.turn in {'TOWARDS', 'AROUND'}:
        column.prop(settings, "turn_object")
        if settings.turn_object is None:
            column.prop(settings, "turn_point")
    elif settings.turn == 'ATTRIBUTE':
        column.prop(settings, "turn_attribute")
    elif settings.turn == 'RANDOM':
        column.prop(settings, "turn_seed")
    draw_field(column, settings, "angle", "angle_field", "angle", "Angle")


class FeaturePart(SettingsPanel):
    """A part of the feature's settings that is folded away."""

    bl_parent_id = "BUBBLE_PATTERN_PT_feature"
    bl_options = {'DEFAULT_CLOSED'}


class BUBBLE_PATTERN_PT_feature_turn(FeaturePart, bpy.types.Panel):
    """Where the features head."""

    bl_label = "Turn"
    bl_order = 1
    bl_options = set()  # what is not round is turned more often than not

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return super().poll(context) and shown_settings(context).profile != 'CIRCLE'

    def draw(self, context: bpy.types.Context) -> None:
        settings = shown_settings(context)
        draw_turn(columns(self.layout), settings)


class BUBBLE_PATTERN_PT_feature_pull(FeaturePart, bpy.types.Panel):
    """How the features are drawn off a mold."""

    bl_label = "Pull Direction"
    bl_order = 2

    def draw_header(self, context: bpy.types.Context) -> None:
        self.layout.prop(shown_settings(context), "use_pull", text="")

    def draw(self, context: bpy.types.Context) -> None:
        settings = shown_settings(context)
        column = columns(self.layout)
        column.active = settings.use_pull
        column.prop(settings, "pull", text="Direction")
        column.prop(settings, "axis")


class BUBBLE_PATTERN_PT_feature_facets(FeaturePart, bpy.types.Panel):
    """How finely the features are made, and of what."""

    bl_label = "Facets and Material"
    bl_order = 3

    def draw(self, context: bpy.types.Context) -> None:
        settings = shown_settings(context)
        column = columns(self.layout)
        if settings.profile != 'MESH':
            column.prop(settings, "sides", text="Sides")
            column.prop(settings, "facet_tolerance", text="Tolerance")
        if settings.profile == 'CIRCLE':
            column.row().prop(settings, "across", expand=True)
        column.prop(settings, "wall_material")


CLASSES = (
    BUBBLE_PATTERN_PT_feature,
    BUBBLE_PATTERN_PT_feature_turn,
    BUBBLE_PATTERN_PT_feature_pull,
    BUBBLE_PATTERN_PT_feature_facets,
)
