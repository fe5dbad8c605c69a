"""The part shown before it is made: a Boolean modifier on the base, fed by the solids of step 3.

It is for the eye only. Whatever reads the base for the pattern switches it off first: it is never part of the
base.
"""

from __future__ import annotations

from typing import Any

import bpy
import numpy as np

from ..core.errors import BaseError, PatternError, RegionError
from ..core.mesh import Mesh
from ..core.progress import drive
from .attributes import CORNER_VERTEX, write_values
from .properties import is_pattern
from .settings_recipe import is_outdated, recipe_of, spoken

MODIFIER = "Bubble Pattern Cut"
# The quickest first; the second one's name is that up to Blender 4.5 or that from 5.0 on.
SOLVERS = ('MANIFOLD', 'FLOAT', 'FAST')


def cut_modifiers(base: bpy.types.Object) -> list[bpy.types.Modifier]:
    """Our modifiers on the base that show a cut."""
    return [m for m in base.modifiers if m.type == 'BOOLEAN' and m.name.startswith(MODIFIER)]


def toggle_cut(settings: Any, context: bpy.types.Context) -> None:
    """The setting was changed: show the cut, or hide it."""
    obj = settings.id_data
    if not is_pattern(obj) or not obj.is_editable:
        return
    settings.cut_trouble = ""
    is_shown = any(m.object is not None and m.object.parent == obj for m in cut_modifiers(settings.base))
    if is_shown == settings.cut_preview:
        return
    if is_shown:
        hide_cut(settings.base)
        return
    try:
        show_cut(obj, context)
    except PatternError as error:
        hide_cut(settings.base)
        settings.cut_preview = False  # which wipes the message away: it comes last
        settings.cut_trouble = spoken(error, context)


def show_cut(obj: bpy.types.Object, context: bpy.types.Context) -> None:
    """Show the base of the pattern `obj` with the features that Apply would make.

    Raises PatternError where there is nothing to cut, or Blender's modifier does not cut it.
    """
    from ..core.plan import plan_steps
    from .feature_objects import stamp_of
    from .hand_state import check_settled
    from .pattern_object import read_pattern
    from .sources import read_source

    check_settled(obj)
    settings = obj.bubble_pattern
    base, recipe = settings.base, recipe_of(settings)
    source = read_source(base, settings.region, context, recipe)
    if (source.fingerprint, source.size_trace) != (settings.fingerprint, settings.size_trace) or is_outdated(
        settings
    ):
        raise RegionError("The pattern is out of date: press Update before the cut is shown")
    pattern = read_pattern(obj, source.base.mesh)
    stamp = stamp_of(recipe.feature, context)
    plan = drive(plan_steps(source.base.mesh, pattern, recipe.feature, stamp))
    if not len(plan.cutters.mesh.triangles):
        raise RegionError("There is no feature that can be cut: Apply tells why")
    before = face_count(base, context)
    cutters = cutters_object(obj, plan.cutters.mesh)
    modifier = base.modifiers.new(MODIFIER, 'BOOLEAN')
    modifier.operation = 'UNION' if recipe.feature.adds else 'DIFFERENCE'
    modifier.object = cutters
    modifier.show_expanded = False
    obj.hide_set(True)  # its discs would fill the holes
    # On what is open the quick solver leaves the mesh as it is, and says so nowhere but in its log; some
    # builds of Blender do not have it at all.
    known = modifier.bl_rna.properties["solver"].enum_items.keys()
    for solver in (name for name in SOLVERS if name in known):
        modifier.solver = solver
        if face_count(base, context) != before:
            break
    else:
        raise BaseError(
            f'Blender\'s Boolean modifier cannot cut "{base.name}", which is open or crosses itself: the cut '
            "cannot be shown; Apply may still make it"
        )


def face_count(base: bpy.types.Object, context: bpy.types.Context) -> int:
    """Number of faces of the base with its modifiers."""
    return len(base.evaluated_get(context.evaluated_depsgraph_get()).data.polygons)


def cutters_object(obj: bpy.types.Object, mesh: Mesh) -> bpy.types.Object:
    """A hidden object with the cutters, which are in the frame of the pattern `obj`, and follow it."""
    data = bpy.data.meshes.new(f"{obj.name} Cutters")
    count = len(mesh.triangles)
    data.vertices.add(len(mesh.vertices))
    data.loops.add(3 * count)
    data.polygons.add(count)
    write_values(data, "position", 'POINT', 'FLOAT_VECTOR', mesh.vertices)
    write_values(data, CORNER_VERTEX, 'CORNER', 'INT', mesh.triangles.ravel())
    data.polygons.foreach_set("loop_start", np.arange(0, 3 * count, 3, dtype=np.int32))
    data.update(calc_edges=True)
    data.shade_flat()  # or the smooth base would be shaded round the rims
    cutters = bpy.data.objects.new(data.name, data)
    for collection in obj.users_collection:
        collection.objects.link(cutters)
    cutters.parent = obj
    cutters.display_type = 'WIRE'
    cutters.hide_render = cutters.hide_select = True
    cutters.hide_set(True)
    return cutters


def hide_cut(base: bpy.types.Object) -> None:
    """Show the base as it is: without what the previews of its patterns have put on it."""
    shown = []
    for modifier in cut_modifiers(base):
        cutters = modifier.object
        base.modifiers.remove(modifier)
        if cutters is None:
            continue
        if cutters.parent is not None and is_pattern(cutters.parent):
            shown.append(cutters.parent)
        mesh = cutters.data
        bpy.data.objects.remove(cutters)
        if not mesh.users:
            bpy.data.meshes.remove(mesh)
    # the settings last: what their change sets off finds nothing more to hide
    for obj in shown:
        obj.bubble_pattern.cut_preview = False
        obj.hide_set(False)
