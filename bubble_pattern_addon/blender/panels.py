"""The sidebar, in the order of work; the large button is the next step."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import bpy

from .field_panels import draw_field
from .properties import in_scene, is_pattern, pattern_objects, pattern_of
from .settings_recipe import is_outdated, length_text


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


class BUBBLE_PATTERN_PT_main(SidebarPanel, bpy.types.Panel):
    """Region, and the buttons."""

    bl_label = "Bubble Pattern"

    def draw(self, context: bpy.types.Context) -> None:
        layout, active = self.layout, context.active_object
        obj = pattern_of(active)
        if obj is None:
            self.draw_start(context, layout)
        elif not in_scene(obj.bubble_pattern.base):
            sentences(layout, "The base of this pattern has been deleted", context.region.width, 'ERROR')
            layout.operator("bubble_pattern.remove", icon='TRASH')
        elif is_applied(obj):
            self.draw_applied(context, layout, obj)
        else:
            self.draw_pattern(context, layout, obj)

    def draw_start(self, context: bpy.types.Context, layout: bpy.types.UILayout) -> None:
        """Nothing is there yet: what to select, and the button."""
        active = context.active_object
        if active is None or active.type != 'MESH':
            layout.label(text="Select a mesh object", icon='INFO')
        elif context.mode == 'EDIT_MESH':
            count = active.data.total_face_sel
            text = (
                f"{count:,} face{'s' if count != 1 else ''} selected" if count else "Select the faces to fill"
            )
            layout.label(text=text, icon='FACESEL')
        else:
            marked = "bubble_region" in active.data.attributes
            layout.label(text="Region as marked" if marked else "Whole object", icon='OBJECT_DATA')
        large(layout).operator("bubble_pattern.add", icon='ADD')

    def draw_pattern(
        self, context: bpy.types.Context, layout: bpy.types.UILayout, obj: bpy.types.Object
    ) -> None:
        """The pattern as it stands; its settings are in the panels below."""
        settings = obj.bubble_pattern
        base = settings.base
        if context.active_object == base and len(pattern_objects(base)) > 1:
            layout.prop(base.bubble_pattern, "pattern", text="")
        else:
            layout.label(text=obj.name, icon='MOD_PARTICLE_INSTANCE')
        outdated = bool(settings.trouble) or is_outdated(settings)
        if is_pattern(context.active_object) and context.mode == 'EDIT_MESH':
            self.draw_points(layout, settings)
            return
        editing = context.mode == 'EDIT_MESH'
        row = (large(layout) if editing else layout).row(align=True)
        if editing:
            row.operator("bubble_pattern.region_assign", text="Assign Region", icon='CHECKMARK')
            if not is_pattern(context.active_object):
                row.operator("bubble_pattern.add", text="", icon='ADD')
        else:
            row.operator("bubble_pattern.region_edit", icon='FACESEL')
            if not outdated:
                row.operator("bubble_pattern.update", icon='FILE_REFRESH')
        if settings.trouble:
            sentences(layout, settings.trouble, context.region.width, 'ERROR')
        if outdated:
            large(layout).operator("bubble_pattern.update", icon='FILE_REFRESH', depress=True)
        (layout.row() if outdated or editing else large(layout)).operator(
            "bubble_pattern.apply", icon='CHECKMARK'
        )
        layout.operator("bubble_pattern.remove", icon='TRASH')

    def draw_points(self, layout: bpy.types.UILayout, settings: Any) -> None:
        """The points of the pattern are being edited: sizes can be fixed."""
        count = settings.id_data.data.total_vert_sel
        text = f"{count:,} feature{'s' if count != 1 else ''} selected" if count else "Select features"
        layout.label(text=text, icon='VERTEXSEL')
        large(layout).operator("bubble_pattern.fix_sizes", icon='PINNED')
        layout.operator("bubble_pattern.free_sizes", icon='UNPINNED')

    def draw_applied(
        self, context: bpy.types.Context, layout: bpy.types.UILayout, obj: bpy.types.Object
    ) -> None:
        """The part as it stands."""
        settings = obj.bubble_pattern
        layout.label(text=settings.part.name, icon='MESH_DATA')
        if settings.verdict:
            sentences(layout, settings.verdict, context.region.width, 'ERROR')
        else:
            layout.label(text=f"{settings.count:,} holes, watertight", icon='CHECKMARK')
        large(layout).operator("bubble_pattern.edit", icon='GREASEPENCIL')
        layout.operator("bubble_pattern.remove", icon='TRASH')


class BUBBLE_PATTERN_PT_packing(SettingsPanel, bpy.types.Panel):
    """Step 1: where the features are."""

    bl_label = "Packing"
    bl_order = 1

    def draw(self, context: bpy.types.Context) -> None:
        settings = shown_settings(context)
        column = columns(self.layout)
        draw_field(column, settings, "pitch", "pitch_field", False, "Pitch")
        column.prop(settings, "edge_offset")
        column.prop(settings, "orientation")
        if settings.orientation == 'GIVEN':
            column.prop(settings, "rows_along", text=" ")
        draw_symmetry(column, settings)
        column.prop(settings, "seed")
        column.prop(settings, "parts")
        if settings.parts:
            column.prop(settings, "gap")


def draw_symmetry(column: bpy.types.UILayout, settings: bpy.types.PropertyGroup) -> None:
    """The symmetry, and what is known only of some."""
    column.prop(settings, "symmetry")
    if settings.symmetry == 'ROTATE':
        column.prop(settings, "symmetry_fold")
        column.prop(settings, "symmetry_axis")
    if settings.symmetry != 'OFF':
        column.prop(settings, "use_symmetry_centre")
    if settings.symmetry != 'OFF' and settings.use_symmetry_centre:
        column.prop(settings, "symmetry_centre", text=" ")


class BUBBLE_PATTERN_PT_solver(SettingsPanel, bpy.types.Panel):
    """How step 1 is solved."""

    bl_label = "Solver"
    bl_parent_id = "BUBBLE_PATTERN_PT_packing"
    bl_options = {'DEFAULT_CLOSED'}
    fields = ("integrator", "iterations", "tolerance")


class BUBBLE_PATTERN_PT_holes(SettingsPanel, bpy.types.Panel):
    """Step 2: what the features are like."""

    bl_label = "Holes"
    bl_order = 2

    def draw(self, context: bpy.types.Context) -> None:
        settings = shown_settings(context)
        column = columns(self.layout)
        share = settings.diameter_mode == 'SHARE'
        draw_field(column, settings, "fill" if share else "diameter", "diameter_field", share, "Diameter")
        column.row().prop(settings, "diameter_mode", text=" ", expand=True)
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
        column.row().prop(settings, "depth_mode", expand=True)
        if settings.depth_mode == 'BLIND':
            column.prop(settings, "depth", text=" ")
        column.prop(settings, "sides", text="Sides (0 = Auto)")
        column.prop(settings, "facet_tolerance")
        column.prop(settings, "wall_material")


class BUBBLE_PATTERN_PT_limits(SettingsPanel, bpy.types.Panel):
    """What must remain of the part."""

    bl_label = "Limits"
    bl_order = 3
    bl_options = {'DEFAULT_CLOSED'}
    fields = ("min_web", "min_margin", "min_diameter")


class BUBBLE_PATTERN_PT_preview(SettingsPanel, bpy.types.Panel):
    """How the pattern is shown."""

    bl_label = "Preview"
    bl_order = 4
    bl_options = {'DEFAULT_CLOSED'}
    fields = ("live", "show_bubbles")


class BUBBLE_PATTERN_PT_result(SettingsPanel, bpy.types.Panel):
    """What came out."""

    bl_label = "Result"
    bl_order = 5

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


CLASSES: tuple[Any, ...] = (
    BUBBLE_PATTERN_PT_main,
    BUBBLE_PATTERN_PT_packing,
    BUBBLE_PATTERN_PT_solver,
    BUBBLE_PATTERN_PT_holes,
    BUBBLE_PATTERN_PT_limits,
    BUBBLE_PATTERN_PT_preview,
    BUBBLE_PATTERN_PT_result,
)


register, unregister = bpy.utils.register_classes_factory(CLASSES)
