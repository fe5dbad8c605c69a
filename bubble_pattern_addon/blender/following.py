"""The pattern follows a change of its settings, when the mouse rests; see live.

It is no step of undo of its own: Blender puts the change of the setting down for undo before the pattern is
laid, and one undo brings back what was before both (see pattern_object.fresh_mesh). Redo comes back to the
change alone, and live.look has the pattern laid again.
"""

from __future__ import annotations

import bpy

from ..core.errors import PatternError
from ..core.progress import Steps
from .laying import LayingOperator
from .operators import OnPattern, current_pattern
from .settings_recipe import spoken


class BUBBLE_PATTERN_OT_follow(OnPattern, LayingOperator, bpy.types.Operator):
    """Lay the pattern anew after a change of a setting, which one undo takes back with it"""

    bl_idname = "bubble_pattern.follow"
    bl_label = "Follow Settings"
    bl_options = {'INTERNAL'}
    heeds_sidebar = True

    def about(self, context: bpy.types.Context) -> int:
        number: int = current_pattern(context).session_uid
        return number

    def may_be_dragged(self) -> bool:
        return True

    def refuse(self, error: PatternError, context: bpy.types.Context) -> set[str]:
        """What is wrong with a setting stands in the sidebar."""
        current_pattern(context).bubble_pattern.trouble = spoken(error, context)
        return {'CANCELLED'}

    def steps(self, context: bpy.types.Context) -> Steps[bpy.types.Object]:
        from . import generation, live

        obj = current_pattern(context)
        yield from generation.update_steps(obj, context)
        live.note_laid(obj)
        return obj


CLASSES = (BUBBLE_PATTERN_OT_follow,)

register, unregister = bpy.utils.register_classes_factory(CLASSES)
