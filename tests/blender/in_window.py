"""Run by a real Blender with a window (see test_window.py): add, cancel, apply; then say what was found."""

from __future__ import annotations

import json
import sys
import traceback
from collections.abc import Iterator
from contextlib import AbstractContextManager
from pathlib import Path

import bpy

sys.path.append(str(Path(__file__).parent))

from parts import euler, is_closed, sheet

bpy.context.preferences.view.show_splash = False
picture, answer = sys.argv[sys.argv.index("--") + 1 :]
found: dict[str, object] = {"drawn": 0}


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
    """A smooth, gently domed plate with a target region marked on its front."""
    for old in list(bpy.data.objects):
        bpy.data.objects.remove(old)
    base = sheet(cells=40)
    base.data.shade_smooth()
    base.modifiers.new("Wall", 'SOLIDIFY').thickness = 0.003
    bpy.ops.object.modifier_apply(modifier="Wall")
    marked = base.data.attributes.new("bubble_region", 'BOOLEAN', 'FACE')
    front = [face.normal.z > 0.5 and face.center.xy.length < 0.08 for face in base.data.polygons]
    marked.data.foreach_set("value", front)
    return base


def looked_at(base: bpy.types.Object) -> None:
    """Turn the view to the base, with the sidebar open."""
    view().spaces.active.show_region_ui = True
    bpy.context.scene.unit_settings.length_unit = 'MILLIMETERS'
    with inside('WINDOW'):
        bpy.context.view_layer.objects.active = base
        base.select_set(True)
        bpy.ops.view3d.view_selected()


def tab() -> Iterator[float]:
    """Turn the sidebar to our tab, and give Blender the time to draw before and after."""
    yield 0.5
    region('UI').active_panel_category = "Bubble Pattern"
    view().tag_redraw()
    yield 0.5


def until(condition: object, seconds: float = 60.0) -> Iterator[float]:
    """Wait until `condition()` holds."""
    for _ in range(int(seconds / 0.1)):
        if condition():
            return
        yield 0.1
    raise AssertionError(f"waited in vain for {condition.__name__}")


def story() -> Iterator[float]:
    """What a designer does; yields the seconds to wait."""
    base = dome()
    looked_at(base)
    bpy.types.BUBBLE_PATTERN_PT_main.append(drawn)
    yield from tab()

    pressed("add")

    def pattern_there() -> bool:
        return base.name + " Pattern" in bpy.data.objects

    yield from until(pattern_there)
    pattern = bpy.data.objects[base.name + " Pattern"]
    found["features"] = pattern.bubble_pattern.count
    yield from tab()

    fine = base.modifiers.new("Fine", 'SUBSURF')
    fine.levels = 2
    found["long apply"] = sorted(pressed("apply"))
    (window,) = bpy.context.window_manager.windows
    for value in ('PRESS', 'RELEASE'):
        window.event_simulate(type='ESC', value=value)
    yield 3.0
    found["objects after Esc"] = sorted(obj.name for obj in bpy.data.objects)
    found["base after Esc"] = base.visible_get()
    base.modifiers.remove(fine)
    yield 0.2

    pressed("apply")

    def part_there() -> bool:
        return base.name + " Part" in bpy.data.objects

    yield from until(part_there)
    part = bpy.data.objects[base.name + " Part"]
    found["euler"] = euler(part.data)
    found["closed"] = is_closed(part.data)
    found["holes"] = pattern.bubble_pattern.count
    found["verdict"] = pattern.bubble_pattern.verdict
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
