"""The main panel: what is there, and the large button that is the next step. Settings are in sub-panels."""

from __future__ import annotations

from typing import Any

import bpy

from ..core.feature_recipe import nouns
from . import (
    feature_panel,
    limits_panel,
    live,
    packing_panel,
    region_panel,
    result_panel,
    runs,
    shaping_panel,
)
from .hand_state import ByHand, by_hand_now
from .presets import BUBBLE_PATTERN_PT_presets
from .properties import in_scene, is_pattern, pattern_objects, pattern_of
from .recipe_operators import draw_files
from .settings_recipe import contradict, is_outdated
from .sidebar import SidebarPanel, is_applied, large, sentences
from .stepping import draw_progress


class BUBBLE_PATTERN_PT_main(SidebarPanel, bpy.types.Panel):
    """Region, and the buttons."""

    bl_label = "Bubble Pattern"

    def draw_header_preset(self, context: bpy.types.Context) -> None:
        """Blender's menu of presets, where there is a pattern to lay by one."""
        if pattern_of(context.active_object) is not None:
            BUBBLE_PATTERN_PT_presets.draw_panel_header(self.layout)

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
            draw_selected_faces(layout, active)
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
        trouble = settings.trouble or live.trouble_of(obj)
        outdated = bool(trouble) or is_outdated(settings)
        # where settings contradict one another, no button helps before one of them is changed
        mendable = outdated and not contradict(settings)
        run = runs.under_way()
        if run is not None and not run.ended:
            draw_progress(layout, run)
        if is_pattern(context.active_object) and context.mode == 'EDIT_MESH':
            self.draw_points(layout, settings)
            return
        editing = context.mode == 'EDIT_MESH'
        if editing:
            draw_selected_faces(layout, context.active_object)
        placed = by_hand_now(obj)
        if placed.unsettled:
            self.draw_placed(context, layout, settings, placed)
            return
        row = (large(layout) if editing else layout).row(align=True)
        if editing:
            row.operator("bubble_pattern.region_assign", text="Assign Region", icon='CHECKMARK')
            if not is_pattern(context.active_object):
                row.operator("bubble_pattern.add", text="", icon='ADD')
        else:
            row.operator("bubble_pattern.region_edit", icon='FACESEL')
            if not mendable:
                row.operator("bubble_pattern.update", icon='FILE_REFRESH')
        if trouble:
            sentences(layout, trouble, context.region.width, 'ERROR')
        if outdated and (settings.hand_made or any(placed)):
            sentences(layout, paused(settings, placed), context.region.width, 'PAUSE')
        if mendable:
            large(layout).operator("bubble_pattern.update", icon='FILE_REFRESH', depress=True)
        (layout.row() if outdated or editing else large(layout)).operator(
            "bubble_pattern.apply", icon='CHECKMARK'
        )
        layout.operator("bubble_pattern.remove", icon='TRASH')

    def draw_placed(
        self, context: bpy.types.Context, layout: bpy.types.UILayout, settings: Any, placed: ByHand
    ) -> None:
        """Features were moved or added by hand: they are settled next, or laid anew."""
        text = f"Placed by hand: {placed}. Settle takes the features as they are; till then live update waits"
        sentences(layout, text, context.region.width, 'PAUSE')
        large(layout).operator("bubble_pattern.settle", icon='MOD_SMOOTH')
        layout.operator("bubble_pattern.edit_sizes", text="Edit Points", icon='EDITMODE_HLT')
        row = layout.row(align=True)
        row.operator("bubble_pattern.update", icon='FILE_REFRESH')
        row.operator("bubble_pattern.apply", icon='CHECKMARK')
        layout.operator("bubble_pattern.remove", icon='TRASH')

    def draw_points(self, layout: bpy.types.UILayout, settings: Any) -> None:
        """The points of the pattern are being edited: moved, pinned and settled, their sizes fixed."""
        count = settings.id_data.data.total_vert_sel
        text = f"{count:,} feature{'s' if count != 1 else ''} selected" if count else "Select features"
        layout.label(text=text, icon='VERTEXSEL')
        large(layout).operator("bubble_pattern.settle", icon='MOD_SMOOTH')
        row = layout.row(align=True)
        row.operator("bubble_pattern.pin", icon='PINNED')
        row.operator("bubble_pattern.unpin", icon='UNPINNED')
        row = layout.row(align=True)
        row.operator("bubble_pattern.fix_sizes", icon='LOCKED')
        row.operator("bubble_pattern.free_sizes", icon='UNLOCKED')

    def draw_applied(
        self, context: bpy.types.Context, layout: bpy.types.UILayout, obj: bpy.types.Object
    ) -> None:
        """The part as it stands."""
        settings = obj.bubble_pattern
        layout.label(text=settings.part.name, icon='MESH_DATA')
        if settings.verdict:
            sentences(layout, settings.verdict, context.region.width, 'ERROR')
        else:
            layout.label(text=f"{nouns(settings.kind.lower(), settings.count)}, watertight", icon='CHECKMARK')
        result_panel.draw_table(layout, result_panel.removed_figures(context, settings))
        large(layout).operator("bubble_pattern.edit", icon='GREASEPENCIL')
        draw_files(layout)
        layout.operator("bubble_pattern.remove", icon='TRASH')


def draw_selected_faces(layout: bpy.types.UILayout, base: bpy.types.Object) -> None:
    """How many faces are selected, or that they are to be selected next."""
    count = base.data.total_face_sel
    text = f"{count:,} face{'s' if count != 1 else ''} selected" if count else "Select the faces to fill"
    layout.label(text=text, icon='FACESEL')


def paused(settings: Any, placed: ByHand) -> str:
    """Why the pattern does not follow its settings: what was done by hand is not thrown away unasked."""
    what = "settled by hand" if settings.hand_made else f"changed by hand ({placed})"
    waits = "Live update waits: the" if settings.live else "The"
    return f"{waits} features were {what}. Update lays them anew; only pinned ones stay"


# in the order of work, which is also the order in which they are drawn
CLASSES: tuple[Any, ...] = (
    BUBBLE_PATTERN_PT_main,
    *region_panel.CLASSES,
    *packing_panel.CLASSES,
    *shaping_panel.CLASSES,
    *feature_panel.CLASSES,
    *limits_panel.CLASSES,
    *result_panel.CLASSES,
)


register, unregister = bpy.utils.register_classes_factory(CLASSES)
