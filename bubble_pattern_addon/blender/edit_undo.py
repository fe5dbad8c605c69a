"""Undo in Edit Mode that reaches the settings."""

from __future__ import annotations

import bpy


def take_all_back() -> None:
    """Let the undo step of the operator that calls this take back objects and settings too.

    In Edit Mode Blender remembers the edited mesh alone, unless a data-block has come or gone since it last
    remembered everything.
    """
    bpy.data.meshes.remove(bpy.data.meshes.new("Undo"))
