"""A pattern and its part as files for other programs, in millimetres by the scene's unit."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import bpy
import numpy as np

from ..core.drawing import make_drawing
from ..core.drawing_files import write_drawing
from ..core.drawn_shapes import drawn_shapes
from ..core.errors import OutputError
from ..core.export import write_features
from ..core.files import METRE, output_file, write_mesh
from ..core.mesh import Mesh
from ..core.moving import moved_pattern
from ..core.pattern import Pattern
from ..core.recipe import DRAWINGS, FORMATS
from ..core.region import Region
from ..core.toml_values import Point
from .hand_state import check_settled
from .pattern_object import read_pattern
from .properties import in_scene
from .reading import evaluated_mesh, read_base, shown, transformed
from .recipe_exchange import recipe_to_share
from .settings_recipe import is_outdated, recipe_of
from .sources import read_source
from .units import scene_millimetres

# glTF is upright along y.
Y_UP = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])


def export(
    obj: bpy.types.Object,
    context: bpy.types.Context,
    path: Path,
    projection: str | Point = "flat",
    align: str = "base",
) -> str:
    """Write the pattern `obj`, or its part, to a file in the format of its suffix; what was written, in
    words.

    The hole table, meshes and drawings are in millimetres and in the coordinates of the world; a GLB is in
    metres, with y up, as its format wants. projection, align: of drawings, see core.drawing

    Raises OutputError for a format that is not known, a pattern that is not up to date, a part that is not
    there, or a file that can't be written; RegionError for a region that can't be drawn so.
    """
    suffix = path.suffix.lower()[1:]
    write: Callable[[Path], str]
    if suffix == "toml":
        text = recipe_to_share(obj, context)

        def write(work: Path) -> str:
            work.write_text(text, encoding="utf-8")
            return "recipe"

    elif suffix in FORMATS:
        mesh = part_mesh(obj, context, suffix)

        def write(work: Path) -> str:
            write_mesh(work, mesh)
            return f"part of {len(mesh.triangles):,} triangles"

    elif suffix == "csv" or suffix in DRAWINGS:
        region, pattern, millimetres = laid(obj, context)
        if suffix == "csv":

            def write(work: Path) -> str:
                write_features(work, moved_pattern(pattern, np.eye(4), millimetres))
                return f"table of {len(pattern):,} features"

        else:
            shapes = drawn_shapes(pattern, recipe_of(obj.bubble_pattern).feature)
            drawing = make_drawing(region, pattern, projection, align, millimetres, shapes)

            def write(work: Path) -> str:
                write_drawing(work, drawing)
                return told(drawing.hidden, drawing.across, drawing.stretch, len(drawing.ids))

    else:
        known = ", ".join(("csv", *FORMATS, *DRAWINGS, "toml"))
        raise OutputError(f'"{path.name}" has no suffix that is known: use one of {known}')
    with output_file(path) as work:
        return write(work)


def told(hidden: int, across: int, stretch: float, count: int) -> str:
    """What there is to know of a drawing."""
    said = f"drawing of {count:,} features"
    if hidden:
        said += f"; {hidden:,} that face away are left out"
    if across:
        said += f"; {across:,} reach over the line where the region is cut open"
    if stretch > 1.0005:
        said += f"; laid flat, lengths differ by up to {stretch - 1:.1%}"
    return said


def laid(obj: bpy.types.Object, context: bpy.types.Context) -> tuple[Region, Pattern, float]:
    """Region and features of a pattern that is up to date, in coordinates of the world, and how many
    millimetres one of its units is.
    """
    check_settled(obj)
    settings = obj.bubble_pattern
    source = read_source(settings.base, settings.region, context, recipe_of(settings))
    now = (source.fingerprint, source.size_trace)
    if now != (settings.fingerprint, settings.size_trace) or is_outdated(settings):
        raise OutputError(f'"{obj.name}" is out of date: press Update first')
    region, frame = source.region, source.base.frame
    base, own = (
        Mesh(transformed(mesh.vertices, frame), mesh.triangles) for mesh in (region.base, region.mesh)
    )
    region = replace(region, base=base, mesh=own)
    pattern = moved_pattern(read_pattern(obj, source.base.mesh), frame)
    return region, pattern, scene_millimetres(context.scene) or 1.0


def part_mesh(obj: bpy.types.Object, context: bpy.types.Context, suffix: str) -> Mesh:
    """The finished part in the unit and axes of the format. OutputError where there is none yet."""
    part = obj.bubble_pattern.part
    if not in_scene(part):
        raise OutputError(f'"{obj.name}" has no part yet: press Apply first')
    with shown(part, context), evaluated_mesh(part, context.evaluated_depsgraph_get()) as mesh:
        read = read_base(part, mesh, np.eye(4)).mesh
    millimetres = scene_millimetres(context.scene) or 1.0
    if suffix == "glb":
        return Mesh(read.vertices @ Y_UP.T * (millimetres / METRE), read.triangles)
    return Mesh(read.vertices * millimetres, read.triangles)
