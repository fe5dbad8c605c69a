# mypy: disable-error-code="valid-type"
"""Presets in Blender's own menu: recipes in millimeters, those that come along and those that users save.

A preset that names its lengths means them; one that leaves the pitch out fits itself to the region.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import bpy
from bl_operators.presets import AddPresetBase
from bl_ui.utils import PresetPanel
from bpy.props import StringProperty

from ..core.errors import PatternError
from ..core.progress import Steps
from .laying import AnewOperator, LayingOperator
from .operators import OnPattern, current_pattern
from .settings_recipe import spoken

SUBDIR = "bubble_pattern"
SUFFIX = ".toml"
SHIPPED = Path(__file__).parent.parent
_registered: list[str] = []


def own_folder() -> Path | None:
    """Where the user's presets are, which goes with the extension; None where this is no installed extension,
    which keeps them where Blender keeps its own.
    """
    package = __package__.rpartition(".")[0]
    if not package.startswith("bl_ext."):
        return None
    return Path(bpy.utils.extension_path_user(package))


def folder_to_save_in() -> Path:
    """The folder for a new preset, made where it is not there. OSError where it can't be made."""
    own = own_folder()
    root = own / "presets" if own else Path(bpy.utils.user_resource('SCRIPTS', path="presets"))
    (root / SUBDIR).mkdir(parents=True, exist_ok=True)
    return root / SUBDIR


def is_shipped(path: str) -> bool:
    """Whether a preset came with the extension."""
    return Path(path).is_relative_to(SHIPPED)


class BUBBLE_PATTERN_OT_preset_load(OnPattern, AnewOperator, LayingOperator, bpy.types.Operator):
    """Lay the pattern by this preset"""

    bl_idname = "bubble_pattern.preset_load"
    bl_label = "Load Preset"
    bl_options = {'REGISTER', 'UNDO'}
    keeps_sizes = False

    filepath: StringProperty(subtype='FILE_PATH', options={'SKIP_SAVE'})

    def steps(self, context: bpy.types.Context) -> Steps[bpy.types.Object]:
        from .recipe_exchange import adopt_steps, tables_in

        tables = tables_in(Path(self.filepath))
        obj = yield from adopt_steps(current_pattern(context), context, tables, whole=False)
        BUBBLE_PATTERN_PT_presets.bl_label = bpy.path.display_name(self.filepath, title_case=False)
        return obj


class BUBBLE_PATTERN_OT_preset_add(OnPattern, AddPresetBase, bpy.types.Operator):
    """Keep the settings as a preset, or remove one that was kept"""

    bl_idname = "bubble_pattern.preset_add"
    bl_label = "Add Preset"
    bl_options = {'REGISTER', 'INTERNAL'}

    preset_menu = "BUBBLE_PATTERN_PT_presets"
    preset_subdir = SUBDIR

    def execute(self, context: bpy.types.Context) -> set[str]:
        return self.take_away() if self.remove_name or self.remove_active else self.keep(context)

    def keep(self, context: bpy.types.Context) -> set[str]:
        """Write the preset."""
        from ..core.files import output_file
        from .recipe_exchange import preset_text

        filename = self.as_filename(self.name)
        if not filename:
            return {'FINISHED'}
        if bpy.utils.preset_find(filename, SUBDIR, ext=SUFFIX):
            self.report({'WARNING'}, f'There is a preset "{self.name.strip()}" already: give another name')
            return {'CANCELLED'}
        try:
            text = preset_text(current_pattern(context), context)
            with output_file(folder_to_save_in() / f"{filename}{SUFFIX}") as work:
                work.write_text(text, encoding="utf-8")
        except PatternError as error:
            self.report({'ERROR'}, spoken(error, context))
            return {'CANCELLED'}
        except OSError as error:
            self.report({'ERROR'}, f"The preset can't be kept: {error.strerror}")
            return {'CANCELLED'}
        manager = context.window_manager
        if self.name == manager.preset_name:
            manager.property_unset("preset_name")
        BUBBLE_PATTERN_PT_presets.bl_label = bpy.path.display_name(filename, title_case=False)
        return {'FINISHED'}

    def take_away(self) -> set[str]:
        """Delete the preset of this name."""
        name = BUBBLE_PATTERN_PT_presets.bl_label if self.remove_active else self.name
        path = bpy.utils.preset_find(name, SUBDIR, ext=SUFFIX) or bpy.utils.preset_find(
            name, SUBDIR, display_name=True, ext=SUFFIX
        )
        if not path:
            self.report({'WARNING'}, f'There is no preset "{name}"')
            return {'CANCELLED'}
        if is_shipped(path):
            self.report({'WARNING'}, "Presets that came with the extension can't be removed")
            return {'CANCELLED'}
        try:
            Path(path).unlink()
        except OSError as error:
            self.report({'ERROR'}, f"The preset can't be removed: {error.strerror}")
            return {'CANCELLED'}
        BUBBLE_PATTERN_PT_presets.bl_label = "Presets"
        return {'FINISHED'}


class BUBBLE_PATTERN_PT_presets(PresetPanel, bpy.types.Panel):
    """The presets, in the header of the main panel."""

    bl_label = "Presets"
    preset_subdir = SUBDIR
    preset_operator = "bubble_pattern.preset_load"
    preset_add_operator = "bubble_pattern.preset_add"
    preset_extensions = {SUFFIX}


CLASSES: tuple[Any, ...] = (
    BUBBLE_PATTERN_OT_preset_load,
    BUBBLE_PATTERN_OT_preset_add,
    BUBBLE_PATTERN_PT_presets,
)
_register, _unregister = bpy.utils.register_classes_factory(CLASSES)


def register() -> None:
    """Register the menu, and tell Blender where presets are."""
    _register()
    own = own_folder()
    for folder in [SHIPPED] + ([own] if own else []):
        if bpy.utils.register_preset_path(str(folder)):
            _registered.append(str(folder))


def unregister() -> None:
    """Take all of it back."""
    while _registered:
        bpy.utils.unregister_preset_path(_registered.pop())
    _unregister()
