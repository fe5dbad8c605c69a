"""Run by a real Blender with a window (see test_window.py): a designer selects faces, adds a pattern, edits
it twice, takes one edit back, cancels, applies and exports; then say what was found.
"""

from __future__ import annotations

import importlib
import json
import os
import sys
import traceback
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager
from math import hypot
from pathlib import Path
from types import ModuleType

import bmesh
import bpy
from mathutils import Euler, Vector

sys.path.append(str(Path(__file__).parent))

from parts import euler, height, is_closed, sheet

bpy.context.preferences.view.show_splash = False
picture, answer = sys.argv[sys.argv.index("--") + 1 :]
found: dict[str, object] = {"drawn": 0}
ROUND = 0.08
"""Radius of the region, in metres."""


def drawn(_panel: bpy.types.Panel, _context: bpy.types.Context) -> None:
    found["drawn"] += 1


def view() -> bpy.types.Area:
    """The 3D View of the only window."""
    (window,) = bpy.context.window_manager.windows
    return next(area for area in window.screen.areas if area.type == 'VIEW_3D')


def region(kind: str) -> bpy.types.Region:
    """A region of the 3D View: its sidebar, UI, or what it is round, WINDOW."""
    return next(region for region in view().regions if region.type == kind)


def inside(kind: str) -> AbstractContextManager[None]:
    """The context of a region of the 3D View, as when the mouse is there."""
    (window,) = bpy.context.window_manager.windows
    return bpy.context.temp_override(window=window, area=view(), region=region(kind))


def pressed(name: str) -> set[str]:
    """Press a button of the sidebar, as its click does."""
    with inside('UI'):
        return getattr(bpy.ops.bubble_pattern, name)('INVOKE_DEFAULT')


def dome() -> bpy.types.Object:
    """A smooth, gently domed plate."""
    for old in list(bpy.data.objects):
        bpy.data.objects.remove(old)
    base = sheet(cells=40)
    for vertex in base.data.vertices:
        vertex.co.xy = rounded(*vertex.co.xy)
        vertex.co.z = height(vertex.co.x, vertex.co.y, 0.2)
    base.data.shade_smooth()
    base.modifiers.new("Wall", 'SOLIDIFY').thickness = 0.003
    bpy.ops.object.modifier_apply(modifier="Wall")
    return base


def rounded(x: float, y: float) -> tuple[float, float]:
    """Where a vertex of a square grid, 0.2 across, goes so that the rings of its faces up to ROUND are round
    and those beyond become square again.
    """
    ring, away = max(abs(x), abs(y)), hypot(x, y)
    round_as = min(1.0, (0.1 - ring) / (0.1 - ROUND))
    share = round_as * ring / away + 1 - round_as if away else 1.0
    return share * x, share * y


def front_selected(base: bpy.types.Object) -> None:
    """Go into Edit Mode and select a round region on the front of the plate."""
    with inside('WINDOW'):
        bpy.ops.object.mode_set(mode='EDIT')
        bpy.ops.mesh.select_mode(type='FACE')
    mesh = bmesh.from_edit_mesh(base.data)
    for face in mesh.faces:
        face.select_set(face.normal.z > 0.5 and face.calc_center_median().xy.length < ROUND)
    bmesh.update_edit_mesh(base.data)


def looked_at(base: bpy.types.Object) -> None:
    """Turn the view to the base, with the sidebar open."""
    view().spaces.active.show_region_ui = True
    bpy.context.scene.unit_settings.length_unit = 'MILLIMETERS'
    with inside('WINDOW'):
        bpy.context.view_layer.objects.active = base
        base.select_set(True)
        bpy.ops.view3d.view_selected()
    shown = view().spaces.active.region_3d
    shown.view_rotation = Euler((0.75, 0.0, 0.45)).to_quaternion()
    # what the sidebar covers is no room for the part
    shown.view_location = shown.view_rotation @ Vector((0.03, 0.0, 0.0))
    shown.view_distance *= 0.9


def tab() -> Iterator[float]:
    """Turn the sidebar to our tab, and give Blender the time to draw before and after."""
    yield 0.5
    region('UI').active_panel_category = "Bubble Pattern"
    view().tag_redraw()
    yield 0.5


def until(condition: Callable[[], bool], seconds: float = 60.0) -> Iterator[float]:
    """Wait until `condition()` holds."""
    for _ in range(int(seconds / 0.1)):
        if condition():
            return
        yield 0.1
    raise AssertionError(f"waited in vain, as line {condition.__code__.co_firstlineno} asks for")


def photo(name: str) -> Iterator[float]:
    """Ask the test for a picture of the screen, and wait until it has been taken."""
    yield from tab()
    wanted = Path(answer).with_name(f"{name}.wanted")
    wanted.write_text(os.environ["DISPLAY"], encoding="utf-8")
    yield from until(lambda: not wanted.exists())


def edited(name: str) -> None:
    """End an edit as the sidebar does, which makes it one step of undo."""
    with inside('WINDOW'):
        bpy.ops.ed.undo_push(message=name)


def the_pattern() -> bpy.types.Object:
    """The pattern; after an undo it is another object in memory."""
    return next(obj for obj in bpy.data.objects if obj.bubble_pattern.base is not None)


def module(name: str) -> ModuleType:
    """A module of the extension that is installed here."""
    return importlib.import_module(f"bl_ext.user_default.bubble_pattern.blender.{name}")


def live_changes(pattern: bpy.types.Object) -> Iterator[float]:
    """A burst of changes, as of a slider that is dragged: the pattern follows when the mouse rests."""
    settings, generation = pattern.bubble_pattern, module("generation")
    settings.diameter_mode = 'SHARE'
    pitch, laid, real = settings.pitch, [], generation.put

    def counted(*arguments: object) -> None:
        laid.append(arguments)
        real(*arguments)

    generation.put = counted
    yield 1.0
    for step in range(1, 11):
        settings.pitch = pitch * (1 + 0.02 * step)
    found["laid in the burst"] = len(laid)

    def followed() -> bool:
        return not module("settings_recipe").is_outdated(settings)

    yield from until(followed)
    found["laid after the burst"] = len(laid)
    found["points after the burst"] = len(pattern.data.vertices) == settings.count
    generation.put = real
    settings.pitch = pitch
    yield from until(followed)


def long_update(pattern: bpy.types.Object) -> Iterator[float]:
    """A long packing: the view is turned meanwhile, keys that edit do nothing, a right click ends it."""
    settings, stepping, runs = pattern.bubble_pattern, module("stepping"), module("runs")
    before, pitch = settings.count, settings.pitch
    settings.live = False
    settings.pitch = pitch / 7  # far longer than any machine takes for what follows
    kept = stepping.PATIENCE, stepping.SLICE, stepping.LONGEST_SLICE
    stepping.PATIENCE = stepping.SLICE = stepping.LONGEST_SLICE = 0.0  # one step at a time
    found["long update"] = sorted(pressed("update"))

    def settling() -> bool:
        run = runs.under_way()
        return run is not None and run.latest.snapshot is not None

    yield from until(settling)
    yield from photo("3-settling")
    shown = view().spaces.active.region_3d
    distance = shown.view_distance
    place = region('WINDOW')
    (window,) = bpy.context.window_manager.windows

    def tapped(kind: str) -> None:
        for value in ('PRESS', 'RELEASE'):
            window.event_simulate(type=kind, value=value, x=place.x + 200, y=place.y + 200)

    tapped('WHEELUPMOUSE')
    yield from until(lambda: shown.view_distance != distance)
    tapped('X')
    yield 1.0
    found["still packing"] = runs.under_way() is not None
    tapped('RIGHTMOUSE')
    yield from until(lambda: runs.under_way() is None)
    found["after the right click"] = [runs.under_way() is None, settings.count == before, pattern.name]
    stepping.PATIENCE, stepping.SLICE, stepping.LONGEST_SLICE = kept
    settings.pitch = pitch
    settings.live = True


def long_change() -> Iterator[float]:
    """A change that takes long to follow, and a quick one after it: two steps of undo, and of redo."""
    stepping, live, runs = module("stepping"), module("live"), module("runs")
    kept = stepping.PATIENCE, live.PATIENCE
    stepping.PATIENCE = live.PATIENCE = 0.0  # all is long
    states = []

    def followed() -> bool:
        settings = the_pattern().bubble_pattern
        return runs.under_way() is None and not module("settings_recipe").is_outdated(settings)

    def step(action: str) -> Iterator[float]:
        with inside('WINDOW'):
            getattr(bpy.ops.ed, action)()
        yield 0.5
        yield from until(followed)
        settings = the_pattern().bubble_pattern
        states.append([settings.count, round(settings.diameter, 6)])

    edited("Before")
    settings = the_pattern().bubble_pattern
    before = settings.count
    settings.diameter_mode = 'SIZE'
    edited("Size")
    settings.diameter = 0.5 * settings.pitch
    edited("Diameter")
    yield 1.0
    start = [before, round(settings.diameter, 6)]
    settings.pitch = 0.8 * settings.pitch
    edited("Pitch")

    yield 0.5
    yield from until(followed)
    settings = the_pattern().bubble_pattern
    laid = [settings.count, round(settings.diameter, 6)]
    settings.diameter = 0.4 * settings.pitch
    edited("Smaller")
    last = [settings.count, round(settings.diameter, 6)]
    for action in ("undo", "undo", "redo", "redo", "undo", "undo"):
        yield from step(action)
    found["undo and redo of a long change"] = states == [laid, start, laid, last, laid, start]
    found["states"] = [start, laid, last, states]
    stepping.PATIENCE, live.PATIENCE = kept


def asking() -> Iterator[float]:
    """A feature moved by hand: Update asks, and Esc leaves it where it is."""
    settings = the_pattern().bubble_pattern
    the_pattern().data.vertices[0].co.x += 0.3 * settings.pitch
    the_pattern().data.update_tag()
    edited("Move")
    place = region('WINDOW')
    (window,) = bpy.context.window_manager.windows
    window.event_simulate(type='MOUSEMOVE', value='NOTHING', x=place.x + 200, y=place.y + 300)
    yield 0.3
    with inside('WINDOW'):
        found["asked"] = sorted(bpy.ops.bubble_pattern.update('INVOKE_DEFAULT'))
    yield from photo("3-asked")
    for value in ('PRESS', 'RELEASE'):
        window.event_simulate(type='ESC', value=value)
    yield 1.0
    found["moved after Esc"] = module("hand_state").by_hand(the_pattern()).moved
    with inside('UI'):
        bpy.ops.bubble_pattern.update()
    edited("Update")


def story() -> Iterator[float]:
    """What a designer does; yields the seconds to wait."""
    base = dome()
    looked_at(base)
    bpy.types.BUBBLE_PATTERN_PT_main.append(drawn)
    yield from tab()
    front_selected(base)
    edited("Select")
    yield from photo("1-select")
    yield from adding()
    yield from live_changes(the_pattern())
    yield from long_update(the_pattern())
    yield from long_change()
    yield from asking()
    yield from editing()
    yield from cancelling()
    yield from applying()
    yield from exporting()


def adding() -> Iterator[float]:
    """Press Add Pattern."""
    found["add"] = sorted(pressed("add"))
    yield from until(lambda: any(obj.bubble_pattern.base for obj in bpy.data.objects))
    with inside('WINDOW'):
        bpy.ops.object.mode_set(mode='OBJECT')
    edited("Add Pattern")
    found["features"] = the_pattern().bubble_pattern.count
    yield from photo("2-add")


def editing() -> Iterator[float]:
    """A larger pitch, slots instead of circles, and the slots taken back."""
    settings = the_pattern().bubble_pattern
    before, pitch = settings.count, settings.pitch
    settings.pitch = 1.5 * pitch
    yield from until(lambda: the_pattern().bubble_pattern.count < before)
    edited("Pitch")
    wide = the_pattern().bubble_pattern.count
    yield from photo("4-wider")
    settings = the_pattern().bubble_pattern
    settings.profile, settings.turn = 'SLOT', 'BOUNDARY'
    yield 0.5
    edited("Slots")
    yield from photo("5-slots")
    with inside('WINDOW'):
        bpy.ops.ed.undo()
    yield 0.5
    settings = the_pattern().bubble_pattern
    found["after undo"] = [settings.profile, settings.count == wide]


def cancelling() -> Iterator[float]:
    """Begin a long Apply and give it up."""
    base = the_pattern().bubble_pattern.base
    fine = base.modifiers.new("Fine", 'SUBSURF')
    fine.levels = 2
    stepping = module("stepping")
    kept, stepping.PATIENCE = stepping.PATIENCE, 0.0  # all is long, also on a quick machine
    found["long apply"] = sorted(pressed("apply"))
    (window,) = bpy.context.window_manager.windows
    for value in ('PRESS', 'RELEASE'):
        window.event_simulate(type='ESC', value=value)
    yield 3.0
    stepping.PATIENCE = kept
    found["objects after Esc"] = sorted(obj.name for obj in bpy.data.objects)
    found["base after Esc"] = base.visible_get()
    base.modifiers.remove(fine)
    yield from photo("6-cancelled")


def applying() -> Iterator[float]:
    """Press Apply."""
    base = the_pattern().bubble_pattern.base
    pressed("apply")
    yield from until(lambda: base.name + " Part" in bpy.data.objects)
    part = bpy.data.objects[base.name + " Part"]
    settings = the_pattern().bubble_pattern
    found["euler"] = euler(part.data)
    found["closed"] = is_closed(part.data)
    found["holes"] = settings.count
    found["verdict"] = settings.verdict
    yield from photo("7-part")


def exporting() -> Iterator[float]:
    """Write the part, the table and a drawing."""
    for suffix in ("stl", "csv", "dxf"):
        target = Path(answer).with_name(f"grille.{suffix}")
        with inside('WINDOW'):
            bpy.ops.bubble_pattern.export(filepath=str(target), format=suffix.upper())
        found[suffix] = target.stat().st_size
    yield from tab()
    yield 0.5


def finish() -> None:
    Path(answer).write_text(json.dumps(found), encoding="utf-8")
    Path(picture + ".ready").touch()


steps = story()


def tick() -> float | None:
    try:
        return next(steps)
    except StopIteration:
        finish()
    except Exception:
        found["error"] = traceback.format_exc()
        finish()
    return None


bpy.app.timers.register(tick, first_interval=2.0)
