"""Files saved by older versions: previews and settings are brought up to date when a file is opened."""

from __future__ import annotations

import tomllib

import bpy
from bpy.app.handlers import persistent

from ..core.errors import PatternError
from ..core.recipe_file import recipe_from_dict
from .preview_nodes import VERSION, VERSION_KEY, show_preview
from .properties import SETTINGS_VERSION, is_pattern
from .settings_recipe import recipe_of, recipe_text


def upgrade_settings(settings: bpy.types.PropertyGroup) -> None:
    """Bring settings of an older version up to date.

    Version 1 did not write limits down with what the points were made with, nor what came later: a pattern
    that was up to date stays so.
    """
    settings.version = SETTINGS_VERSION
    try:
        recipe = recipe_of(settings)
        made = recipe_from_dict(tomllib.loads(settings.made_with))
    except (PatternError, tomllib.TOMLDecodeError):
        return  # outdated it was, and remains
    if (made.region, made.packing, made.shaping) == (recipe.region, recipe.packing, recipe.shaping):
        settings.made_with = recipe_text(recipe)


@persistent
def upgrade_file(_path: str) -> None:
    """Bring the patterns of the opened file up to date. Those of a newer version are left as they are."""
    old_groups = any(group.get(VERSION_KEY, VERSION) < VERSION for group in bpy.data.node_groups)
    for obj in bpy.data.objects:
        if not is_pattern(obj) or not obj.is_editable:
            continue
        if obj.bubble_pattern.version < SETTINGS_VERSION:
            upgrade_settings(obj.bubble_pattern)
        if old_groups:
            show_preview(obj, obj.bubble_pattern.show_bubbles)


def register() -> None:
    """Look at every file that is opened from now on."""
    bpy.app.handlers.load_post.append(upgrade_file)


def unregister() -> None:
    """Look at no more files."""
    bpy.app.handlers.load_post.remove(upgrade_file)
