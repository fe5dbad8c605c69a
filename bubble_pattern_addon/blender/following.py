"""The pattern follows a change of its settings, when the mouse rests; see live.

Blender puts the change of the setting down for undo before the pattern is laid. What follows at once is no
step of undo of its own; what takes long is one, or undoing a later change would have it laid again. So that
undo does not stop half-way between the two, where the settings are new and the pattern is old, it goes on by
itself there, and so does redo.
"""

from __future__ import annotations

from typing import Any

import bpy
from bpy.app.handlers import persistent

from ..core.errors import PatternError
from ..core.progress import Steps
from . import handling, live
from .laying import LayingOperator
from .operators import OnPattern, current_pattern
from .settings_recipe import recipe_of, recipe_text, spoken

# States half-way: a pattern's number, what it was made with, and what it has been made with next.
_halfway: set[tuple[int, str, str]] = set()
# What was done last and is to be gone on with, "undo" or "redo"; GOING while that is done.
_way: list[str] = []
GOING = "going"


class BUBBLE_PATTERN_OT_follow(OnPattern, LayingOperator, bpy.types.Operator):
    """Lay the pattern anew after a change of a setting"""

    bl_idname = "bubble_pattern.follow"
    bl_label = "Follow Settings"
    bl_options = {'UNDO', 'INTERNAL'}
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
        from . import generation

        obj = current_pattern(context)
        self._passed = {*getattr(self, "_passed", ()), state_of(obj)}
        yield from generation.update_steps(obj, context)
        return obj

    def done(self, context: bpy.types.Context, result: bpy.types.Object) -> None:
        """Say how many features there are; remember where undo shall not stop."""
        super().done(context, result)
        if self.took_long():
            _halfway.update(self._passed)


def state_of(obj: bpy.types.Object) -> tuple[int, str, str]:
    """The pattern, what it was made with and what its settings say. RecipeError where they make no sense."""
    settings = obj.bubble_pattern
    return obj.session_uid, settings.made_with, recipe_text(recipe_of(settings))


def is_halfway(obj: bpy.types.Object) -> bool:
    """Whether the pattern is as it was between a change of its settings and the end of what followed."""
    try:
        return state_of(obj) in _halfway
    except PatternError:
        return False


def go_on() -> None:
    """Undo or redo on, as was done last, to a state that is not half-way."""
    window, step = next(iter(bpy.context.window_manager.windows), None), _way.pop()
    if window is None:
        return
    again = getattr(bpy.ops.ed, step)
    with live.inside(window):
        _way.append(GOING)
        try:
            while any(is_halfway(obj) for obj, _ in live.patterns_shown()) and again.poll():
                again()
        finally:
            _way.clear()


@persistent
def undone(*_: Any) -> None:
    """A step was undone."""
    go_on_soon("undo")


@persistent
def redone(*_: Any) -> None:
    """A step was redone."""
    go_on_soon("redo")


def go_on_soon(step: str) -> None:
    """Go on as soon as Blender is through with its own step, if there is anywhere not to stop."""
    if not _halfway or not live.has_window() or GOING in _way:
        return
    _way[:] = [step]
    live.again(go_on, 0.0)


@persistent
def another_file(*_: Any) -> None:
    """A file has been opened: other patterns, other numbers."""
    forget()


def forget() -> None:
    """Go nowhere, and stop anywhere."""
    if bpy.app.timers.is_registered(go_on):
        bpy.app.timers.unregister(go_on)
    _halfway.clear()
    _way.clear()


HANDLERS = (("undo_post", undone), ("redo_post", redone), ("load_post", another_file))
_register, _unregister = bpy.utils.register_classes_factory((BUBBLE_PATTERN_OT_follow,))


def register() -> None:
    """Register the operator, and hear of undo and redo."""
    _register()
    handling.add(HANDLERS)


def unregister() -> None:
    """Take all of it back."""
    handling.remove(HANDLERS)
    forget()
    _unregister()
