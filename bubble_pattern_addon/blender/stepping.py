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

# So long Blender may stand still between two looks at the mouse, in seconds: where drawing takes longer than
# the first, as long as it takes, or the work would hardly go on.
SLICE, LONGEST_SLICE = 0.06, 0.3
# Work that ends within this time never becomes modal: the redo panel works, and nothing flickers.
PATIENCE = 0.4
# Work on settings that change begins again when none has changed for so long, in seconds.
REST = 0.1
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

    def about(self, context: bpy.types.Context) -> int:
        """Number of the object whose settings the work goes by."""
        return 0

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
        self._run = runs.begin(self.steps(context), self.about(context))
        outcome = self.advance(context, PATIENCE)
        if outcome is not None:
            self._run.stop()
            return outcome
        manager = context.window_manager
        self._timer = manager.event_timer_add(0.01, window=context.window)
        self._drawing: Any = None
        self._drawn = 0.0
        self._worked = time.perf_counter()
        self._mode = context.mode
        self._outcome: set[str] | None = None
        self._moved = False
        context.workspace.status_text_set(status_of(self._run))
        manager.modal_handler_add(self)
        return {'RUNNING_MODAL'}

    def modal(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        """Work on at every tick of the timer. Meanwhile the view can be turned, and nothing be edited."""
        if not self._run.open:
            return self.give_up(context, "Cancelled")
        if self._outcome is not None and self._run.changed_at is None and self.is_let_go(event):
            self.cancel(context)
            return {*self._outcome, 'PASS_THROUGH'}
        if event.type in {'ESC', 'RIGHTMOUSE'} and event.value == 'PRESS':
            return self.give_up(context, "Cancelled")
        if event.type == 'TIMER':
            if context.mode != self._mode or not self.stands(context):
                return self.give_up(context, "Cancelled: what it was about has changed meanwhile")
            self.tick(context)
        # A button let go is no edit, and the slider that is being dragged waits for it.
        if event.type in NAVIGATION or event.value == 'RELEASE':
            return {'PASS_THROUGH'}
        over_sidebar = self.heeds_sidebar and is_over_sidebar(context, event)
        return {'PASS_THROUGH'} if over_sidebar else {'RUNNING_MODAL'}

    def tick(self, context: bpy.types.Context) -> None:
        """Work on for a while; from the beginning where settings have changed and the mouse rests."""
        changed_at = self._run.changed_at
        if changed_at is not None:
            self._run.steps.close()
            if time.perf_counter() - changed_at < REST:
                return
            self._run.renew(self.steps(context))
            self._outcome = None
        if self._outcome is None:
            others = time.perf_counter() - self._worked
            self._outcome = self.advance(context, min(max(SLICE, others), LONGEST_SLICE))
            self._mode = context.mode  # the work itself may leave Edit Mode for a while
            self._moved = not self.may_be_dragged()
            self.show(context)
            self._worked = time.perf_counter()

    def is_let_go(self, event: bpy.types.Event) -> bool:
        """Whether no slider is being dragged any more, for all that the events tell.

        The end of a modal operator sets the mouse back to where the slider was grasped, and the slider with
        it. A mouse that moves and changes no setting does not drag; nor does one of which a button is let go.
        """
        if event.type in {'MOUSEMOVE', 'INBETWEEN_MOUSEMOVE'}:
            self._moved = True  # the slider hears of it next, and the setting changes before the timer's tick
            return False
        return self._moved if event.type == 'TIMER' else event.type not in NAVIGATION

    def took_long(self) -> bool:
        """Whether the work went on while Blender drew: then its end is a step of undo."""
        return hasattr(self, "_timer")

    def may_be_dragged(self) -> bool:
        """Whether the operator was set off by a slider that the mouse may still hold."""
        return False

    def give_up(self, context: bpy.types.Context, why: str) -> set[str]:
        """End without a result."""
        self.cancel(context)
        self.report({'INFO'}, why)
        return {'CANCELLED'}

    def cancel(self, context: bpy.types.Context) -> None:
        """Stop between two steps; Blender asks for it when the window closes or another file is opened, and
        when a dialog that came before the work is turned down.
        """
        if not hasattr(self, "_run"):
            return
        self._run.stop()
        self.tidy(context)

    def advance(self, context: bpy.types.Context, seconds: float) -> set[str] | None:
        """Take steps for `seconds`; what the operator returns, once the work has come to an end."""
        try:
            self._run.advance(seconds)
        except PatternError as error:
            return self.refuse(error, context)
        except BaseException:
            self.cancel(context)
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
