"""Operators whose work is a generator of progress steps: run through in scripts, step by step in a window."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import bpy

from ..core.errors import PatternError
from ..core.progress import Steps, drive
from . import runs
from .settings_recipe import spoken

# So long Blender may stand still between two looks at the mouse, in seconds.
SLICE = 0.06
# Work that ends within this time never becomes modal: the redo panel works, and nothing flickers.
PATIENCE = 0.4
# Bubbles are drawn anew no sooner than after this time, in seconds.
FRAME = 0.1
# What turns, moves and zooms the view, and what only looks.
NAVIGATION = {
    'MIDDLEMOUSE', 'WHEELUPMOUSE', 'WHEELDOWNMOUSE', 'WHEELINMOUSE', 'WHEELOUTMOUSE', 'TRACKPADPAN',
    'TRACKPADZOOM', 'MOUSEROTATE', 'MOUSESMARTZOOM', 'NDOF_MOTION', 'HOME', 'NUMPAD_PERIOD', 'NUMPAD_PLUS',
    'NUMPAD_MINUS', *(f'NUMPAD_{number}' for number in range(10)), 'MOUSEMOVE', 'INBETWEEN_MOUSEMOVE',
    'WINDOW_DEACTIVATE', 'TIMER', 'NONE',
}  # fmt: skip


def status_of(run: runs.Run) -> Callable[[bpy.types.Header, bpy.types.Context], None]:
    """A function that draws progress in the status bar; a bound method Blender would not take."""

    def draw(header: bpy.types.Header, _context: bpy.types.Context) -> None:
        """Draw a bar with the stage's name, and the key that cancels."""
        row = header.layout.row(align=True)
        bar = row.row()
        bar.ui_units_x = 14
        draw_progress(bar, run)
        row.separator()
        row.label(text="Cancel", icon='EVENT_ESC')

    return draw


def draw_progress(layout: bpy.types.UILayout, run: runs.Run) -> None:
    """A bar with what the run is at."""
    progress = run.latest
    layout.progress(factor=min(max(progress.fraction, 0.0), 1.0), text=progress.stage)


def is_over_sidebar(context: bpy.types.Context, event: bpy.types.Event) -> bool:
    """Whether the mouse is over the sidebar of a 3D View."""
    for area in context.window.screen.areas:
        if area.type != 'VIEW_3D':
            continue
        for region in area.regions:
            across, up = event.mouse_x - region.x, event.mouse_y - region.y
            if region.type == 'UI' and 0 <= across < region.width and 0 <= up < region.height:
                return True
    return False


class SteppedOperator:
    """Mixin for an operator whose `steps` is a generator of Progress; `done` gets what it returns."""

    # Whether settings may be changed meanwhile in the sidebar: that stops the run, and another one begins.
    heeds_sidebar = False

    def steps(self, context: bpy.types.Context) -> Steps[Any]:
        """The work. Raises PatternError, which is reported; closed early, it leaves everything as it was.

        Between two steps it holds no pointer into Blender's data but to objects that `stands` looks at.
        """
        raise NotImplementedError

    if TYPE_CHECKING:  # what the operator itself brings

        def report(self, kind: set[str], message: str) -> None:
            """Tell the user."""

    def done(self, context: bpy.types.Context, result: Any) -> None:
        """Tell the user what came out."""

    def stands(self, context: bpy.types.Context) -> bool:
        """Whether what the work is about is still there, as it was when the work began."""
        return True

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Work without a pause, for scripts and for the redo panel."""
        runs.stop()
        try:
            result = drive(self.steps(context))
        except PatternError as error:
            return self.refuse(error, context)
        self.done(context, result)
        return {'FINISHED'}

    def invoke(self, context: bpy.types.Context, _event: bpy.types.Event) -> set[str]:
        """Work with progress in the status bar; Esc or a right click cancels."""
        self._run = runs.begin(self.steps(context))
        outcome = self.advance(context, PATIENCE)
        if outcome is not None:
            return outcome
        manager = context.window_manager
        self._timer = manager.event_timer_add(0.01, window=context.window)
        self._drawing: Any = None
        self._drawn = 0.0
        self._mode = context.mode
        context.workspace.status_text_set(status_of(self._run))
        manager.modal_handler_add(self)
        return {'RUNNING_MODAL'}

    def modal(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        """Work on at every tick of the timer. Meanwhile the view can be turned, and nothing be edited."""
        if not self._run.open:
            return self.give_up(context, "Cancelled")
        if event.type in {'ESC', 'RIGHTMOUSE'} and event.value == 'PRESS':
            return self.give_up(context, "Cancelled")
        if event.type == 'TIMER':
            if context.mode != self._mode or not self.stands(context):
                return self.give_up(context, "Cancelled: what it was about has changed meanwhile")
            outcome = self.advance(context, SLICE)
            if outcome is not None:
                self.tidy(context)
                return outcome
            self.show(context)
        # A button let go is no edit, and the slider that is being dragged waits for it.
        if event.type in NAVIGATION or event.value == 'RELEASE':
            return {'PASS_THROUGH'}
        over_sidebar = self.heeds_sidebar and is_over_sidebar(context, event)
        return {'PASS_THROUGH'} if over_sidebar else {'RUNNING_MODAL'}

    def give_up(self, context: bpy.types.Context, why: str) -> set[str]:
        """End without a result."""
        self.cancel(context)
        self.report({'INFO'}, why)
        return {'CANCELLED'}

    def cancel(self, context: bpy.types.Context) -> None:
        """Stop between two steps; Blender asks for it when the window closes or another file is opened."""
        self._run.stop()
        self.tidy(context)

    def advance(self, context: bpy.types.Context, seconds: float) -> set[str] | None:
        """Take steps for `seconds`; what the operator returns, once the work has come to an end."""
        try:
            self._run.advance(seconds)
        except PatternError as error:
            return self.refuse(error, context)
        except BaseException:
            if hasattr(self, "_timer"):
                self.tidy(context)
            raise
        if not self._run.ended:
            return None
        self.done(context, self._run.result)
        return {'FINISHED'}

    def show(self, context: bpy.types.Context) -> None:
        """Show where the work stands: in the status bar, the sidebar, and as bubbles on the base."""
        context.workspace.status_text_set(status_of(self._run))
        snapshot, now = self._run.latest.snapshot, time.perf_counter()
        if snapshot is None or now - self._drawn < FRAME:
            return
        from .reading import world_frame
        from .settling import Drawing

        base = self.settles_on(context)
        if base is not None:
            self._drawn = now
            self._drawing = self._drawing or Drawing()
            self._drawing.show(snapshot(), world_frame(base))
        redraw(context)

    def settles_on(self, context: bpy.types.Context) -> bpy.types.Object | None:
        """The base that the bubbles of a snapshot stand on."""
        return None

    def refuse(self, error: PatternError, context: bpy.types.Context) -> set[str]:
        """Report what the user can mend."""
        self.report({'ERROR'}, spoken(error, context))
        return {'CANCELLED'}

    def tidy(self, context: bpy.types.Context) -> None:
        """Take timer, drawing and status text back; once is enough."""
        if not hasattr(self, "_timer"):
            return
        context.window_manager.event_timer_remove(self._timer)
        del self._timer
        if self._drawing is not None:
            self._drawing.remove()
        if context.workspace is not None:
            context.workspace.status_text_set(None)
        redraw(context)


def redraw(context: bpy.types.Context) -> None:
    """Have all 3D Views drawn anew."""
    for window in context.window_manager.windows:
        for area in window.screen.areas:
            if area.type == 'VIEW_3D':
                area.tag_redraw()
