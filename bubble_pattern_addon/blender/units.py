"""What a unit of Blender is in the world outside."""

from __future__ import annotations

import bpy


def scene_millimetres(scene: bpy.types.Scene) -> float | None:
    """How many millimetres one unit of the scene is; None in a scene without units."""
    units = scene.unit_settings
    return None if units.system == 'NONE' else round(1000.0 * units.scale_length, 6)
