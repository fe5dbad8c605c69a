"""Files saved by older versions: previews and settings are brought up to date when a file is opened."""

from __future__ import annotations

import bpy
from bpy.app.handlers import persistent

from .preview_nodes import VERSION, VERSION_KEY, show_preview
from .properties import SETTINGS_VERSION, is_pattern


def upgrade_settings(settings: bpy.types.PropertyGroup) -> None:
    """Bring settings of an older version up to date; there has been one version so far."""
    settings.version = SETTINGS_VERSION


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
