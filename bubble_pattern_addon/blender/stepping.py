"""Operators whose work is a generator of progress steps: run through in scripts, step by step in a window."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import bpy

from ..core.errors import PatternError
from ..core.progress import Progress, Steps, drive
from .properties import spoken

# So long Blender may stand still between two looks at the keyboard, in seconds.
SLICE = 0.08
# Work that ends within this time never becomes modal: the redo panel works, and nothing flickers.
PATIENCE = 0.4


def status_of(shown: Latest) -> Callable[[bpy.types.Header, bpy.types.Context], None]:
    """A function that draws progress in the status bar; a bound method Blender would not take."""

    def draw(header: bpy.types.Header, _context: bpy.types.Context) -> None:
        """Draw a bar with the stage's name, and the key that cancels."""
        progress = shown.latest
        row = header.layout.row(align=True)
        bar = row.row()
        bar.ui_units_x = 14
        bar.progress(factor=min(max(progress.fraction, 0.0), 1.0), text=progress.stage)
        row.separator()
        row.label(text="Cancel", icon='EVENT_ESC')

    return draw


class Latest:
    """The latest step of some work; it outlives the operator, which may be freed before the last redraw."""

    latest = Progress("Working", 0.0)


class SteppedOperator:
    """Mixin for an operator whose `steps` is a generator of Progress; `done` gets what it returns."""

    def steps(self, context: bpy.types.Context) -> Steps[Any]:
        """The work. Raises PatternError, which is reported; closed early, it leaves everything as it was."""
        raise NotImplementedError

    if TYPE_CHECKING:  # what the operator itself brings

        def report(self, kind: set[str], message: str) -> None:
            """Tell the user."""

    def done(self, context: bpy.types.Context, result: Any) -> None:
        """Tell the user what came out."""

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Work without a pause, for scripts and for the redo panel."""
        try:
            result = drive(self.steps(context))
        except PatternError as error:
            return self.refuse(error, context)
        self.done(context, result)
        return {'FINISHED'}

    def invoke(self, context: bpy.types.Context, _event: bpy.types.Event) -> set[str]:
        """Work with progress in the status bar; Esc cancels."""
        self._running = self.steps(context)
        self._shown = Latest()
        outcome = self.advance(context, PATIENCE)
        if outcome is not None:
            return outcome
        manager = context.window_manager
        self._timer = manager.event_timer_add(0.01, window=context.window)
        context.window.cursor_modal_set('WAIT')
        context.workspace.status_text_set(status_of(self._shown))
        manager.modal_handler_add(self)
        return {'RUNNING_MODAL'}

    def modal(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        """Work on at every tick of the timer; everything else waits, so nothing changes under our hands."""
        if event.type == 'ESC' and event.value == 'PRESS':
            self.cancel(context)
            self.report({'INFO'}, "Cancelled")
            return {'CANCELLED'}
        if event.type == 'TIMER':
            outcome = self.advance(context, SLICE)
            if outcome is not None:
                self.tidy(context)
                return outcome
            context.workspace.status_text_set(status_of(self._shown))
        return {'RUNNING_MODAL'}

    def cancel(self, context: bpy.types.Context) -> None:
        """Stop between two steps; closing the generator undoes what it began."""
        self._running.close()
        self.tidy(context)

    def advance(self, context: bpy.types.Context, seconds: float) -> set[str] | None:
        """Take steps for `seconds`; what the operator returns, once the work has come to an end."""
        until = time.perf_counter() + seconds
        try:
            while time.perf_counter() < until:
                self._shown.latest = next(self._running)
        except StopIteration as end:
            self.done(context, end.value)
            return {'FINISHED'}
        except PatternError as error:
            return self.refuse(error, context)
        except BaseException:
            if hasattr(self, "_timer"):
                self.tidy(context)
            raise
        return None

    def refuse(self, error: PatternError, context: bpy.types.Context) -> set[str]:
        """Report what the user can mend."""
        self.report({'ERROR'}, spoken(error, context))
        return {'CANCELLED'}

    def tidy(self, context: bpy.types.Context) -> None:
        """Take timer, cursor and status text back."""
        context.window_manager.event_timer_remove(self._timer)
        del self._timer
        context.window.cursor_modal_restore()
        context.workspace.status_text_set(None)
