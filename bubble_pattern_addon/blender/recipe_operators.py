# mypy: disable-error-code="valid-type"
"""Recipes in and out: copy, paste, load and save. Docstrings of operators are their tooltips."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import bpy
from bpy.props import StringProperty
from bpy_extras.io_utils import ExportHelper, ImportHelper

from ..core.errors import PatternError, RecipeError
from ..core.progress import Steps
from .laying import AnewOperator, LayingOperator
from .operators import OnPattern, current_pattern
from .settings_recipe import spoken
from .sidebar import sentences

# What was copied where there is no clipboard, as in Blender without a window.
_held: list[str] = []


def to_clipboard(text: str, context: bpy.types.Context) -> bool:
    """Copy a text; whether Blender has a clipboard to keep it. Without one it is held till Blender quits."""
    _held[:] = [text]
    context.window_manager.clipboard = text
    return context.window_manager.clipboard == text


def from_clipboard(context: bpy.types.Context) -> str:
    """The text that was copied last. RecipeError where there is none."""
    text = context.window_manager.clipboard or "".join(_held)
    if not text.strip():
        raise RecipeError("The clipboard is empty: copy a recipe first")
    return text


class BUBBLE_PATTERN_OT_recipe_copy(OnPattern, bpy.types.Operator):
    """Copy all settings of the pattern as a recipe, for another part, a batch run or an e-mail"""

    bl_idname = "bubble_pattern.recipe_copy"
    bl_label = "Copy Recipe"
    bl_options = {'REGISTER'}

    def execute(self, context: bpy.types.Context) -> set[str]:
        from .recipe_exchange import recipe_to_share

        try:
            text = recipe_to_share(current_pattern(context), context)
        except PatternError as error:
            self.report({'ERROR'}, spoken(error, context))
            return {'CANCELLED'}
        if to_clipboard(text, context):
            self.report({'INFO'}, "Recipe copied")
        else:
            self.report({'INFO'}, "Recipe copied for this session: without a window there is no clipboard")
        return {'FINISHED'}


class BUBBLE_PATTERN_OT_recipe_paste(OnPattern, AnewOperator, LayingOperator, bpy.types.Operator):
    """Lay the pattern by the recipe in the clipboard, on the faces that it has"""

    bl_idname = "bubble_pattern.recipe_paste"
    bl_label = "Paste Recipe"
    bl_options = {'REGISTER', 'UNDO'}
    keeps_pins = keeps_sizes = False

    def steps(self, context: bpy.types.Context) -> Steps[bpy.types.Object]:
        from .recipe_exchange import adopt_steps, tables_of

        tables = tables_of(from_clipboard(context), "The clipboard")
        return (yield from adopt_steps(current_pattern(context), context, tables, whole=True))


class BUBBLE_PATTERN_OT_recipe_save(OnPattern, bpy.types.Operator, ExportHelper):
    """Save all settings of the pattern as a recipe file"""

    bl_idname = "bubble_pattern.recipe_save"
    bl_label = "Save Recipe"
    bl_options = {'REGISTER'}
    filename_ext = ".toml"

    filter_glob: StringProperty(default="*.toml", options={'HIDDEN'})

    def execute(self, context: bpy.types.Context) -> set[str]:
        from ..core.files import output_file
        from .recipe_exchange import recipe_to_share

        path = Path(bpy.path.abspath(self.filepath))
        try:
            text = recipe_to_share(current_pattern(context), context)
            with output_file(path) as work:
                work.write_text(text, encoding="utf-8")
        except PatternError as error:
            self.report({'ERROR'}, spoken(error, context))
            return {'CANCELLED'}
        self.report({'INFO'}, f"Recipe saved as {path.name}")
        return {'FINISHED'}


class BUBBLE_PATTERN_OT_recipe_load(
    OnPattern, AnewOperator, LayingOperator, bpy.types.Operator, ImportHelper
):
    """Lay the pattern by a recipe file, on the faces that it has"""

    bl_idname = "bubble_pattern.recipe_load"
    bl_label = "Load Recipe"
    bl_options = {'REGISTER', 'UNDO'}
    filename_ext = ".toml"
    keeps_pins = keeps_sizes = False

    filter_glob: StringProperty(default="*.toml", options={'HIDDEN'})

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        """Ask for the file."""
        self._lost = self.lost(context)
        return ImportHelper.invoke(self, context, event)

    def draw(self, context: bpy.types.Context) -> None:
        """Beside the files: what will be lost."""
        lost = getattr(self, "_lost", "")
        if lost:
            text = f"Lost will be what was done by hand: {lost}"
            sentences(self.layout, text, context.region.width, 'WARNING')

    def steps(self, context: bpy.types.Context) -> Steps[bpy.types.Object]:
        from .recipe_exchange import adopt_steps, tables_in

        tables = tables_in(Path(bpy.path.abspath(self.filepath)))
        return (yield from adopt_steps(current_pattern(context), context, tables, whole=True))


class BUBBLE_PATTERN_MT_recipe(bpy.types.Menu):
    """The recipe, in and out."""

    bl_label = "Recipe"

    def draw(self, _context: bpy.types.Context) -> None:
        layout = self.layout
        layout.operator("bubble_pattern.recipe_copy", icon='COPYDOWN')
        layout.operator("bubble_pattern.recipe_paste", icon='PASTEDOWN')
        layout.separator()
        layout.operator("bubble_pattern.recipe_load", icon='FILE_FOLDER')
        layout.operator("bubble_pattern.recipe_save", icon='FILE_TICK')


def draw_files(layout: bpy.types.UILayout) -> None:
    """What goes out to files, and the recipe in and out."""
    row = layout.row(align=True)
    row.operator("bubble_pattern.export", text="Export", icon='EXPORT')
    row.menu("BUBBLE_PATTERN_MT_recipe", icon='PRESET')


CLASSES: tuple[Any, ...] = (
    BUBBLE_PATTERN_OT_recipe_copy,
    BUBBLE_PATTERN_OT_recipe_paste,
    BUBBLE_PATTERN_OT_recipe_save,
    BUBBLE_PATTERN_OT_recipe_load,
    BUBBLE_PATTERN_MT_recipe,
)
_register, unregister = bpy.utils.register_classes_factory(CLASSES)


def register() -> None:
    """Register the operators; nothing copied by an earlier one is left."""
    _held.clear()
    _register()
