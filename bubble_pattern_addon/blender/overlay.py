"""Marks in the viewport: the smallest web with its length, and a ring round every feature that breaks a rule.

Blender draws nothing of ours unless some pattern of the file wishes it: the two handlers come with the first
wish and go with the last, with another file and with the add-on. They only read; whatever is missing, as
after an undo, is skipped. Without a window there are none.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import bpy
import numpy as np
from bpy.app.handlers import persistent
from mathutils import Vector

from ..core.mesh import Floats
from . import handling

CORNERS = 32
# How far marks stand over the surface, and how long the ticks at the web's ends are, relative to a diameter.
LIFT, TICK = 0.04, 0.35
GOOD, BAD, DARK = (1.0, 0.75, 0.1, 1.0), (1.0, 0.15, 0.1, 1.0), (0.0, 0.0, 0.0, 0.7)

_handles: list[Any] = []
_rings: dict[tuple[int, int], tuple[str, Any]] = {}


def wishing(context: bpy.types.Context) -> Iterator[bpy.types.Object]:
    """The patterns whose marks are wished for and that are to be seen."""
    layer = context.view_layer
    for obj in layer.objects if layer is not None else ():
        settings = obj.bubble_pattern
        if settings.base is not None and settings.show_marks and settings.count and obj.visible_get():
            yield obj


def wished_in_file() -> bool:
    """Whether any pattern of the file wishes marks."""
    objects = bpy.data.objects
    return any(obj.bubble_pattern.base is not None and obj.bubble_pattern.show_marks for obj in objects)


def in_background() -> bool:
    """Whether Blender has no window to draw in."""
    return bool(bpy.app.background)


def drawing_space() -> Any:
    """The kind of space that we draw in."""
    return bpy.types.SpaceView3D


def refresh(context: bpy.types.Context | None = None) -> None:
    """Let the handlers be there where marks are wished for, and only there; draw anew."""
    wished = not in_background() and wished_in_file()
    if wished and not _handles:
        add = drawing_space().draw_handler_add
        _handles.append(add(draw_lines, (), 'WINDOW', 'POST_VIEW'))
        _handles.append(add(draw_labels, (), 'WINDOW', 'POST_PIXEL'))
    elif not wished:
        remove()
    for window in bpy.context.window_manager.windows if bpy.context.window_manager else ():
        for area in window.screen.areas:
            if area.type == 'VIEW_3D':
                area.tag_redraw()


def remove() -> None:
    """Take the handlers away."""
    while _handles:
        drawing_space().draw_handler_remove(_handles.pop(), 'WINDOW')
    _rings.clear()


# -- what is drawn -------------------------------------------------------------------------------------------


def web_lines(obj: bpy.types.Object) -> Floats | None:
    """The smallest web as lines in the pattern's frame, (m, 3), two ends each: from edge to edge, and a tick
    across at both; None where there is none.
    """
    settings = obj.bubble_pattern
    if settings.web_ids[0] < 0:
        return None
    ends = np.array(settings.web_between, dtype=np.float64).reshape(2, 3)
    along = ends[1] - ends[0]
    normal = np.array(settings.web_normal, dtype=np.float64)
    across = np.cross(normal, along)
    length = np.linalg.norm(across)
    size = settings.smallest if settings.smallest > 0 else abs(settings.web)
    across = across / length * size * TICK if length > 0 else np.zeros(3)
    ends = ends + normal * size * LIFT
    ticks = [end + side * across for end in ends for side in (-1, 1)]
    return np.array([ends[0], ends[1], *ticks])


def broken_rings(obj: bpy.types.Object) -> Floats:
    """Rings round the features that break a rule, as lines in the pattern's frame, (m, 3), two ends each."""
    from .attributes import read_values
    from .noting import rows_of_rule

    rows = rows_of_rule(obj, 'ANY')
    points = obj.data.attributes
    if not len(rows) or any(name not in points for name in ("diameter", "normal", "tangent")):
        return np.empty((0, 3))

    def values(name: str, prop: str, width: int) -> Floats:
        return read_values(points[name].data, prop, np.float32, width)[rows].astype(np.float64)

    centre = read_values(obj.data.vertices, "co", np.float32, 3)[rows].astype(np.float64)
    normal, tangent = values("normal", "vector", 3), values("tangent", "vector", 3)
    diameter = values("diameter", "value", 1)
    angle = np.arange(CORNERS) * (2 * np.pi / CORNERS)
    across = np.cross(normal, tangent)
    circle = np.cos(angle)[:, None] * tangent[:, None] + np.sin(angle)[:, None] * across[:, None]
    ring = centre[:, None] + diameter[:, None, None] * (circle / 2 + LIFT * normal[:, None])
    return np.stack([ring, np.roll(ring, -1, axis=1)], axis=2).reshape(-1, 3)


def rings_of(obj: bpy.types.Object) -> Any:
    """The rings of a pattern as a batch, made anew only where the pattern has become another, or None."""
    from gpu_extras.batch import batch_for_shader

    settings = obj.bubble_pattern
    key = (obj.session_uid, len(obj.data.vertices))
    counts = [(one.rule, one.count) for one in settings.broken]
    state = f"{settings.made_with}{settings.fingerprint}{settings.size_trace}{counts}"
    fresh = key in _rings and _rings[key][0] == state
    if not fresh and obj.mode == 'EDIT':
        return None  # the points' attributes are out of reach
    if not fresh:
        if len(_rings) > 32:
            _rings.clear()
        lines = broken_rings(obj).astype(np.float32)
        _rings[key] = (state, batch_for_shader(shader(), 'LINES', {"pos": lines}) if len(lines) else None)
    return _rings[key][1]


def shader() -> Any:
    """Blender's shader for wide lines of one color."""
    import gpu

    return gpu.shader.from_builtin('POLYLINE_UNIFORM_COLOR')


def draw_lines() -> None:
    """Draw the webs and the rings, in the space of the scene."""
    import gpu
    from gpu_extras.batch import batch_for_shader

    context = bpy.context
    patterns = list(wishing(context))
    if not patterns:
        return
    lines = shader()
    gpu.state.blend_set('ALPHA')
    scale = context.preferences.system.ui_scale
    for obj in patterns:
        with gpu.matrix.push_pop():
            gpu.matrix.multiply_matrix(obj.matrix_world)
            lines.bind()
            lines.uniform_float("viewportSize", gpu.state.viewport_get()[2:])
            rings = rings_of(obj)
            if rings is not None:
                gpu.state.depth_test_set('LESS_EQUAL')
                lines.uniform_float("lineWidth", 3.0 * scale)
                lines.uniform_float("color", BAD)
                rings.draw(lines)
            web = web_lines(obj)
            if web is not None:
                gpu.state.depth_test_set('NONE')
                batch = batch_for_shader(lines, 'LINES', {"pos": web.astype(np.float32)})
                for width, color in ((6.0, DARK), (3.0, color_of(obj))):
                    lines.uniform_float("lineWidth", width * scale)
                    lines.uniform_float("color", color)
                    batch.draw(lines)
    gpu.state.depth_test_set('NONE')
    gpu.state.blend_set('NONE')


def color_of(obj: bpy.types.Object) -> tuple[float, float, float, float]:
    """The smallest web's color: that of a broken rule where webs are too narrow."""
    settings = obj.bubble_pattern
    return BAD if settings.web < 0 or any(one.rule == "web" for one in settings.broken) else GOOD


def draw_labels() -> None:
    """Write the length of every smallest web beside it."""
    import blf
    from bpy_extras.view3d_utils import location_3d_to_region_2d

    from .settings_recipe import length_text

    context = bpy.context
    region, view = context.region, context.region_data
    if region is None or view is None:
        return
    for obj in wishing(context):
        lines = web_lines(obj)
        if lines is None:
            continue
        place = location_3d_to_region_2d(region, view, obj.matrix_world @ Vector(lines[:2].mean(axis=0)))
        if place is None:
            continue
        scale = context.preferences.system.ui_scale
        blf.size(0, 14 * scale)
        blf.enable(0, blf.SHADOW)
        blf.shadow(0, 3, 0.0, 0.0, 0.0, 1.0)
        blf.color(0, *color_of(obj))
        blf.position(0, place.x + 12 * scale, place.y + 8 * scale, 0)
        blf.draw(0, length_text(context, obj.bubble_pattern.web))
        blf.disable(0, blf.SHADOW)


# -- files and the add-on ------------------------------------------------------------------------------------


@persistent
def leave_file(_path: str) -> None:
    """Another file is opened: what was drawn is of the old one."""
    remove()


@persistent
def enter_file(_path: str) -> None:
    """A file was opened, or a step undone: draw where its patterns wish it."""
    refresh()


HANDLERS = (
    ("load_pre", leave_file),
    ("load_post", enter_file),
    ("undo_post", enter_file),
    ("redo_post", enter_file),
)


def register() -> None:
    """Look out for other files, and for wishes that an undo takes back."""
    handling.add(HANDLERS)


def unregister() -> None:
    """Leave nothing behind."""
    handling.remove(HANDLERS)
    remove()
