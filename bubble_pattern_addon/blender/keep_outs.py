# mypy: disable-error-code="valid-type"
"""Keep-outs in Blender: their bodies read from objects, and what the buttons of their list do.

Docstrings of operators are their tooltips.
"""

from __future__ import annotations

import hashlib
from collections import OrderedDict
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import bpy
import numpy as np
from bpy.props import EnumProperty

from ..core.mesh import Bools, Floats, Ints, Mesh
from ..core.recipe import KeepOut, RegionChoice
from ..core.surroundings import Solid, Solids
from .attributes import read_values
from .keep_out_properties import ICONS, KINDS, SEEN_ALONG, SHAPES, is_given
from .operators import current_pattern, poll_pattern, refused
from .properties import is_pattern
from .reading import Base, evaluated_mesh, shown, transformed
from .sidebar import SettingsPanel, columns, sentences, shown_settings
from .surroundings import SOLID_TYPES
from .target_region import selected_faces, store, stored
from .watching import stamp_of

if TYPE_CHECKING:
    from ..core.region import Region

# Face attribute that the button marks kept out faces with.
ATTRIBUTE = "bubble_keep_out"
# The regions cut last, by what they were cut from: most changes of settings leave them as they are.
_cut: OrderedDict[str, Region] = OrderedDict()
KEPT = 3


# -- read ----------------------------------------------------------------------------------------------------


def read_solids(keep_outs: Sequence[KeepOut], frame: Floats, context: bpy.types.Context) -> Solids:
    """The bodies that `keep_outs` name and that are there, seen from the frame (4, 4)."""
    to_frame = np.linalg.inv(frame)
    found: dict[tuple[str, str], list[Solid]] = {}
    for keep_out in keep_outs:
        if keep_out.object is not None and keep_out.object in context.view_layer.objects:
            objects = [context.view_layer.objects[keep_out.object]]
            found["object", keep_out.object] = [solid_of(obj, to_frame, context) for obj in objects]
        elif keep_out.collection is not None and keep_out.collection in bpy.data.collections:
            members = bpy.data.collections[keep_out.collection].all_objects
            found["collection", keep_out.collection] = [
                solid_of(obj, to_frame, context)
                for obj in sorted(members, key=lambda member: member.name)
                if obj.type in SOLID_TYPES and not is_base_or_pattern(obj)
            ]
        elif keep_out.file is not None:
            from ..core.files import load_solids

            path = bpy.path.abspath(keep_out.file)
            found["file", keep_out.file] = [*load_solids([path], Path())["file", path]]
    return found


def is_base_or_pattern(obj: bpy.types.Object) -> bool:
    """Whether `obj` is a pattern or carries one: no keep-out is meant, whatever collection it is in."""
    return is_pattern(obj) or any(is_pattern(child) for child in obj.children)


def solid_of(obj: bpy.types.Object, to_frame: Floats, context: bpy.types.Context) -> Solid:
    """The faces of an object with its modifiers, in the frame that `to_frame` (4, 4) leads to from the
    world.
    """
    stamp_of(obj)  # from now on its changes are heard of
    matrix = to_frame @ np.array(obj.matrix_world, dtype=np.float64)
    axis = matrix[:3, 2]
    if not np.linalg.norm(axis) > 0 or obj.type not in SOLID_TYPES:
        return Solid(Mesh(np.empty((0, 3)), np.empty((0, 3), dtype=np.int64)), np.array([0.0, 0.0, 1.0]))
    with shown(obj, context), evaluated_mesh(obj, context.evaluated_depsgraph_get()) as mesh:
        mesh.calc_loop_triangles()
        local = read_values(mesh.vertices, "co", np.float32, 3).astype(np.float64)
        triangles = read_values(mesh.loop_triangles, "vertices", np.int32, 3).astype(np.int64)
    return Solid(Mesh(transformed(local.reshape(-1, 3), matrix), triangles.reshape(-1, 3)), axis)


def cut_to_choice(
    base: Base,
    selected: Bools,
    parts: Ints | None,
    choice: RegionChoice,
    fingerprint: str,
    context: bpy.types.Context,
) -> tuple[Region, str]:
    """The region of the `selected` triangles (T,) with its `parts` (T,) and without what is kept out, and a
    trace of that; all else is what `fingerprint` stands for.
    """
    from ..core.keep_out import region_with_keep_outs

    masks = {**base.materials, **base.attributes}
    solids = read_solids(choice.keep_out, base.frame, context)
    trace = trace_of(choice.keep_out, masks, solids)
    key = f"{fingerprint} {trace} {choice.gap} {choice.keep_out}"
    if key not in _cut:
        _cut[key] = region_with_keep_outs(
            base.mesh, selected, parts, choice.gap, choice.keep_out, masks, solids
        )
        while len(_cut) > KEPT:
            _cut.popitem(last=False)
    return _cut[key], trace


def trace_of(keep_outs: Sequence[KeepOut], masks: dict[str, Bools], solids: Solids) -> str:
    """A short name for the faces and bodies that are kept out, wherever they are now."""
    digest = hashlib.blake2b(digest_size=16)
    for keep_out in keep_outs:
        if keep_out.faces in masks:
            digest.update(np.ascontiguousarray(masks[keep_out.faces or ""]).tobytes())
    for key in sorted(solids):
        digest.update(" ".join(key).encode())
        for solid in solids[key]:
            for array in (solid.mesh.vertices, solid.mesh.triangles, solid.axis):
                digest.update(np.ascontiguousarray(array).tobytes())
    return digest.hexdigest()


# -- the list ------------------------------------------------------------------------------------------------


class BUBBLE_PATTERN_UL_keep_outs(bpy.types.UIList):
    """What is kept out, a line each."""

    def draw_item(
        self,
        _context: bpy.types.Context,
        layout: bpy.types.UILayout,
        _data: bpy.types.PropertyGroup,
        item: bpy.types.PropertyGroup,
        _icon: int,
        _active_data: bpy.types.PropertyGroup,
        _active_name: str,
    ) -> None:
        given = is_given(item)
        name = f"Choose {item.kind.title()}"
        if given:
            thing = item.kind.title() if item.kind in SHAPES else getattr(item, item.kind.lower())
            name = thing if isinstance(thing, str) else thing.name
        row = layout.row()
        row.active = given
        row.label(text=name, icon=ICONS[item.kind])


class BUBBLE_PATTERN_PT_keep_out(SettingsPanel, bpy.types.Panel):
    """What the pattern goes round."""

    bl_label = "Keep-Outs"
    bl_parent_id = "BUBBLE_PATTERN_PT_region"
    bl_options = {'DEFAULT_CLOSED'}

    def draw(self, context: bpy.types.Context) -> None:
        settings = shown_settings(context)
        row = self.layout.row()
        count, active = len(settings.keep_out), settings.active_keep_out
        row.template_list(
            "BUBBLE_PATTERN_UL_keep_outs", "", settings, "keep_out", settings, "active_keep_out", rows=3
        )
        side = row.column(align=True)
        side.operator_menu_enum("bubble_pattern.keep_out_add", "kind", text="", icon='ADD')
        side.operator("bubble_pattern.keep_out_remove", text="", icon='REMOVE')
        if active < count:
            draw_entry(columns(self.layout), settings.keep_out[active])
        elif not count and context.region is not None:
            sentences(self.layout, "Screw bosses, a logo: added here, avoided", context.region.width, 'INFO')


def draw_entry(column: bpy.types.UILayout, entry: bpy.types.PropertyGroup) -> None:
    """Draw the properties that an entry of its kind has."""
    column.prop(entry, "kind")
    if entry.kind in SHAPES:
        column.prop(entry, "centre")
        column.prop(entry, "size" if entry.kind == 'BOX' else "diameter")
    else:
        column.prop(entry, entry.kind.lower())
    column.prop(entry, "margin")
    if entry.kind in SEEN_ALONG:
        for key in ("axis", "along", "reach") if entry.kind == 'BOX' else ("axis", "reach"):
            column.prop(entry, f"use_{key}")
            if getattr(entry, f"use_{key}"):
                column.prop(entry, key, text=" ")


class BUBBLE_PATTERN_OT_keep_out_add(bpy.types.Operator):
    """Let the pattern go round something: the selected objects or faces, or a shape"""

    bl_idname = "bubble_pattern.keep_out_add"
    bl_label = "Add Keep-Out"
    bl_options = {'REGISTER', 'UNDO'}

    kind: EnumProperty(name="Kind", description="What is kept out", items=KINDS, default='OBJECT')

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if not poll_pattern(cls, context):
            return False
        return context.mode in {'OBJECT', 'EDIT_MESH'} or refused(
            cls, "Switch to Object Mode or Edit Mode first"
        )

    def execute(self, context: bpy.types.Context) -> set[str]:
        obj = current_pattern(context)
        settings = obj.bubble_pattern
        before = len(settings.keep_out)
        live, settings.live = settings.live, False
        things = selected_bodies(context, obj) if self.kind == 'OBJECT' else []
        for thing in things or [None]:
            entry = settings.keep_out.add()
            entry.kind, entry.object = self.kind, thing
            entry.diameter = settings.pitch * 3
            entry.size = [settings.pitch * 3] * 3
        if self.kind == 'FACES' and context.mode == 'EDIT_MESH' and not is_pattern(context.active_object):
            keep_out_selected(settings.base, settings.keep_out[before])
        settings.active_keep_out = len(settings.keep_out) - 1
        settings.live = live
        answer(settings, context)
        return {'FINISHED'}


def selected_bodies(context: bpy.types.Context, obj: bpy.types.Object) -> list[bpy.types.Object]:
    """Objects selected beside the pattern `obj` and its base that can be kept out and are not yet."""
    settings = obj.bubble_pattern
    there = {entry.object for entry in settings.keep_out if entry.kind == 'OBJECT'}
    return [
        other
        for other in context.selected_objects
        if other.type in SOLID_TYPES
        and other not in {obj, settings.base, settings.part}
        and other not in there
        and not is_base_or_pattern(other)
    ]


def keep_out_selected(base: bpy.types.Object, entry: bpy.types.PropertyGroup) -> None:
    """Mark the selected faces of the base, which is in Edit Mode, besides those marked already."""
    if not base.data.total_face_sel:
        return
    bpy.ops.object.mode_set(mode='OBJECT')
    try:
        before = stored(base, ATTRIBUTE)
        chosen = selected_faces(base)
        store(base, ATTRIBUTE, chosen if before is None else chosen | before)
        entry.faces = ATTRIBUTE
    finally:
        bpy.ops.object.mode_set(mode='EDIT')


def answer(settings: bpy.types.PropertyGroup, context: bpy.types.Context) -> None:
    """Lay the pattern anew where it is live."""
    from . import generation

    generation.react(settings, context, repack=True)


class BUBBLE_PATTERN_OT_keep_out_remove(bpy.types.Operator):
    """Let the pattern no longer go round this"""

    bl_idname = "bubble_pattern.keep_out_remove"
    bl_label = "Remove Keep-Out"
    bl_options = {'REGISTER', 'UNDO'}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if not poll_pattern(cls, context):
            return False
        settings = current_pattern(context).bubble_pattern
        return settings.active_keep_out < len(settings.keep_out) or refused(cls, "Nothing is kept out")

    def execute(self, context: bpy.types.Context) -> set[str]:
        settings = current_pattern(context).bubble_pattern
        settings.keep_out.remove(settings.active_keep_out)
        settings.active_keep_out = max(min(settings.active_keep_out, len(settings.keep_out) - 1), 0)
        answer(settings, context)
        return {'FINISHED'}


CLASSES = (
    BUBBLE_PATTERN_UL_keep_outs,
    BUBBLE_PATTERN_OT_keep_out_add,
    BUBBLE_PATTERN_OT_keep_out_remove,
)

register, unregister = bpy.utils.register_classes_factory(CLASSES)
