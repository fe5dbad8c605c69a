"""Run by a real Blender with a window (see test_window.py): add, cancel, apply; then say what was found."""

from __future__ import annotations

import json
import sys
import traceback
from collections.abc import Iterator
from pathlib import Path

import bpy
import numpy as np

bpy.context.preferences.view.show_splash = False
picture, answer = sys.argv[sys.argv.index("--") + 1 :]
found: dict[str, object] = {"drawn": 0}


def drawn(_panel: bpy.types.Panel, _context: bpy.types.Context) -> None:
    found["drawn"] += 1


def window() -> tuple[bpy.types.Window, bpy.types.Area]:
    first = bpy.context.window_manager.windows[0]
    return first, next(area for area in first.screen.areas if area.type == 'VIEW_3D')


def pressed(name: str) -> set[str]:
    """Press a button of the sidebar, as its click does."""
    main, area = window()
    region = next(region for region in area.regions if region.type == 'UI')
    with bpy.context.temp_override(window=main, area=area, region=region):
        return getattr(bpy.ops.bubble_pattern, name)('INVOKE_DEFAULT')


def dome() -> bpy.types.Object:
    """A smooth, gently domed plate."""
    for old in list(bpy.data.objects):
        bpy.data.objects.remove(old)
    bpy.ops.mesh.primitive_grid_add(size=0.2, x_subdivisions=40, y_subdivisions=40)
    base = bpy.context.object
    for vertex in base.data.vertices:
        vertex.co.z = 0.02 * np.cos(vertex.co.x * 10) * np.cos(vertex.co.y * 10)
    base.data.shade_smooth()
    base.modifiers.new("Wall", 'SOLIDIFY').thickness = 0.003
    bpy.ops.object.modifier_apply(modifier="Wall")
    marked = base.data.attributes.new("bubble_region", 'BOOLEAN', 'FACE')
    front = [face.normal.z > 0.5 and face.center.xy.length < 0.08 for face in base.data.polygons]
    marked.data.foreach_set("value", front)
    return base


def looked_at(base: bpy.types.Object) -> None:
    """Turn the view to the base, with our tab of the sidebar open."""
    main, area = window()
    area.spaces.active.show_region_ui = True
    bpy.context.scene.unit_settings.length_unit = 'MILLIMETERS'
    region = next(region for region in area.regions if region.type == 'WINDOW')
    with bpy.context.temp_override(window=main, area=area, region=region):
        bpy.context.view_layer.objects.active = base
        base.select_set(True)
        bpy.ops.view3d.view_selected()


def tab() -> None:
    _main, area = window()
    region = next(region for region in area.regions if region.type == 'UI')
    region.active_panel_category = "Bubble Pattern"
    area.tag_redraw()


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
    yield 0.5
    tab()
    yield 0.5

    pressed("add")

    def pattern_there() -> bool:
        return base.name + " Pattern" in bpy.data.objects

    yield from until(pattern_there)
    pattern = bpy.data.objects[base.name + " Pattern"]
    found["features"] = pattern.bubble_pattern.count
    yield 0.5
    tab()
    yield 0.5

    fine = base.modifiers.new("Fine", 'SUBSURF')
    fine.levels = 2
    found["long apply"] = sorted(pressed("apply"))
    main, _area = window()
    main.event_simulate(type='ESC', value='PRESS')
    main.event_simulate(type='ESC', value='RELEASE')
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
    mesh = part.data
    found["euler"] = len(mesh.vertices) - len(mesh.edges) + len(mesh.polygons)
    edges = np.empty(len(mesh.loops), dtype=np.int32)
    mesh.attributes[".corner_edge"].data.foreach_get("value", edges)
    found["closed"] = bool((np.bincount(edges) == 2).all())
    found["holes"] = pattern.bubble_pattern.count
    found["verdict"] = pattern.bubble_pattern.verdict
    yield 0.5
    tab()
    yield 1.0


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
