"""When the pattern follows its settings, and how it learns that its base has changed.

A change that is answered quickly is answered within the change, so that one undo takes back both. While a
slider is dragged only the first change is; what follows waits until the mouse rests, and what takes long goes
on as a run with progress. What was laid after the change was put down for undo is laid again when redo comes
back to it. Without a window there is nobody to wait for: all is answered at once.

Timers know objects by their session's number only.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import AbstractContextManager
from typing import Any, NamedTuple

import bpy

from ..core.errors import PatternError
from ..core.progress import Steps
from . import runs, watching
from .cut_preview import cut_modifiers
from .hand_state import is_kept
from .keep_out_properties import keep_out_objects
from .properties import in_scene, is_pattern, pattern_of
from .settings_recipe import is_outdated, recipe_of, spoken
from .stepping import PATIENCE, REST

# Changes nearer to each other than this are of one drag of the mouse.
BURST = 0.5
# A base that has changed is looked at when it has been left alone for so long.
QUIET = 0.3


class Verdict(NamedTuple):
    """What is known of a pattern's base, by its stamp: what is wrong with it, or nothing."""

    stamp: watching.Stamp
    trouble: str


class Live:
    """What is known and planned: numbers and texts, no pointers into Blender's data."""

    def __init__(self) -> None:
        self.verdicts: dict[int, Verdict] = {}
        self.changed_at = -BURST
        self.waiting: set[int] = set()


_live = Live()


def has_window() -> bool:
    """Whether somebody may be dragging a slider."""
    return not bpy.app.background and bool(bpy.context.window_manager.windows)


# -- changes of settings -------------------------------------------------------------------------------------


def is_taken_up(obj: bpy.types.Object) -> bool:
    """Whether a run under way lays the pattern `obj`: it will begin again with the change, at its time."""
    run = runs.under_way()
    if run is None or run.about != obj.session_uid:
        return False
    run.changed_at = time.perf_counter()
    return True


def lay(obj: bpy.types.Object, context: bpy.types.Context, steps: Steps[None], seconds: float) -> None:
    """Let `steps`, which are expected to take `seconds`, lay the pattern `obj`: now, or when the mouse rests.

    Raises PatternError from the steps that are taken now.
    """
    now = time.perf_counter()
    alone, _live.changed_at = now - _live.changed_at > BURST, now
    if alone and seconds <= PATIENCE:
        run = runs.begin(steps)
        try:
            run.advance(PATIENCE)
        finally:
            run.stop()
        _live.changed_at = time.perf_counter()
        if run.ended:
            return
    steps.close()
    lay_soon(obj)


def lay_soon(obj: bpy.types.Object) -> None:
    """Lay the pattern when no setting has changed for a while."""
    _live.waiting.add(obj.session_uid)
    again(lay_waiting, REST)


def again(action: Any, seconds: float) -> None:
    """Have Blender call `action` after so many seconds from now on, not before."""
    if not has_window():
        return
    if bpy.app.timers.is_registered(action):
        bpy.app.timers.unregister(action)
    bpy.app.timers.register(action, first_interval=seconds)


def lay_waiting() -> None:
    """Lay the patterns whose settings have changed. One that is not shown waits for the Update button."""
    waiting, _live.waiting = _live.waiting, set()
    context = bpy.context
    for window in context.window_manager.windows:
        active = window.view_layer.objects.active
        obj = pattern_of(active)
        if obj is None or obj.session_uid not in waiting or 'EDIT' in active.mode:
            continue
        with inside(window):
            if bpy.ops.bubble_pattern.follow.poll() and not is_kept(obj):
                bpy.ops.bubble_pattern.follow('INVOKE_DEFAULT')
        return


def inside(window: bpy.types.Window) -> AbstractContextManager[None]:
    """The context of a 3D View of the window, or of the window where it has none."""
    for area in window.screen.areas:
        if area.type == 'VIEW_3D':
            region = next(region for region in area.regions if region.type == 'WINDOW')
            return bpy.context.temp_override(window=window, area=area, region=region)
    return bpy.context.temp_override(window=window)


# -- changes of the base -------------------------------------------------------------------------------------


def trouble_of(obj: bpy.types.Object) -> str:
    """What is wrong with the base of the pattern `obj` since the pattern was laid; empty where nothing is
    known of it.
    """
    base = obj.bubble_pattern.base
    verdict = _live.verdicts.get(obj.session_uid)
    stamp = watching.stamp_of(base)
    return verdict.trouble if verdict is not None and verdict.stamp == stamp else ""


def note_base(obj: bpy.types.Object) -> None:
    """The pattern has just been laid on its base as it is."""
    _live.verdicts.pop(obj.session_uid, None)


def base_has_changed() -> None:
    """Look at the bases when they are left alone."""
    again(look, QUIET)


def look() -> None:
    """See whether the patterns on bases that have changed still fit, and lay those that undo left behind."""
    numbers = watching.take_unseen()
    later: set[int] = set()
    for obj, context in patterns_shown():
        base = obj.bubble_pattern.base
        stands_on = {base, *keep_out_objects(obj.bubble_pattern)}
        if not numbers & {other.session_uid for other in stands_on}:
            continue
        if not can_be_looked_at(base):
            later.add(base.session_uid)
            continue
        judge(obj, context)
        if has_window() and obj.bubble_pattern.live and is_behind(obj):
            lay_soon(obj)
    watching.put_back(later)


def can_be_looked_at(base: bpy.types.Object) -> bool:
    """Whether the base is as it will stay, and reading it disturbs nobody: no preview is switched off."""
    at_rest = 'EDIT' not in base.mode and base.visible_get() and runs.under_way() is None
    return at_rest and not cut_modifiers(base)


def is_behind(obj: bpy.types.Object) -> bool:
    """Whether the settings want another pattern than stands there, one that would not take long."""
    settings = obj.bubble_pattern
    quick = settings.seconds <= PATIENCE and not is_kept(obj)
    return is_outdated(settings) and not settings.trouble and quick


def patterns_shown() -> Iterator[tuple[bpy.types.Object, bpy.types.Context]]:
    """All patterns that can be worked on, each in the context of a window that shows it."""
    windows = list(bpy.context.window_manager.windows) if has_window() else []
    seen: set[int] = set()
    for window in windows or [None]:
        with inside(window) if window is not None else bpy.context.temp_override():
            context = bpy.context
            for obj in list(context.view_layer.objects):
                if is_pattern(obj) and obj.session_uid not in seen and can_follow(obj, context):
                    seen.add(obj.session_uid)
                    yield obj, context


def can_follow(obj: bpy.types.Object, context: bpy.types.Context) -> bool:
    """Whether the pattern and its base are there, and may be changed."""
    base = obj.bubble_pattern.base
    return in_scene(base) and obj.is_editable and base.name in context.view_layer.objects


def judge(obj: bpy.types.Object, context: bpy.types.Context) -> None:
    """Find out whether the base has changed since the pattern was laid, and keep what there is to say."""
    from .sources import read_source

    settings = obj.bubble_pattern
    try:
        source = read_source(settings.base, settings.region, context, recipe_of(settings))
    except PatternError as error:
        trouble = spoken(error, context)
    else:
        now = (source.fingerprint, source.size_trace)
        changed = now != (settings.fingerprint, settings.size_trace)
        trouble = "The base has changed, or a keep-out: Update lays the pattern anew" if changed else ""
    stamp = watching.stamp_of(settings.base)
    if stamp is not None:
        _live.verdicts[obj.session_uid] = Verdict(stamp, trouble)
    for window in context.window_manager.windows:
        for area in window.screen.areas:
            area.tag_redraw()


def forget() -> None:
    """Plan nothing more, and know nothing."""
    for action in (lay_waiting, look):
        if bpy.app.timers.is_registered(action):
            bpy.app.timers.unregister(action)
    _live.verdicts.clear()
    _live.waiting.clear()


def register() -> None:
    """Hear of changes of bases."""
    watching.listeners.append(base_has_changed)


def unregister() -> None:
    """Hear of no more."""
    watching.listeners.remove(base_has_changed)
    forget()
