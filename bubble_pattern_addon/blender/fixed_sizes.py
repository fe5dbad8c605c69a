# mypy: disable-error-code="valid-type"
"""Sizes that the user fixes: seeds of the shaping, chosen among the pattern's points in Edit Mode.

Docstrings of operators are their tooltips.
"""

from __future__ import annotations

from typing import Any

import bpy
import numpy as np

from ..core.errors import PatternError
from ..core.mesh import Floats, Ints
from ..core.pattern import all_bubbles
from ..core.progress import drive
from .attributes import read_values
from .edit_undo import take_all_back
from .field_properties import length_property, point_of, typed
from .hand_state import check_settled
from .operators import OnPattern, current_pattern, poll_pattern, refused
from .properties import is_pattern
from .settings_recipe import spoken


class SizesOperator:
    """Mixin for an operator on the sizes of some features, which the pattern is shaped by at once."""

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Change the seeds and shape the pattern; an error leaves both as they were."""
        obj = current_pattern(context)
        editing = obj.mode == 'EDIT'
        if editing:
            bpy.ops.object.mode_set(mode='OBJECT')
        before = [(point_of(seed.at), seed.diameter) for seed in obj.bubble_pattern.seeds]
        try:
            check_settled(obj)
            self.change(obj, context, editing)
            shape(obj, context)
        except PatternError as error:
            keep(obj.bubble_pattern, before)
            self.report({'ERROR'}, spoken(error, context))  # type: ignore[attr-defined]
            return {'CANCELLED'}
        finally:
            if editing:
                bpy.ops.object.mode_set(mode='EDIT')
        if editing:
            take_all_back()
        return {'FINISHED'}

    def change(self, obj: bpy.types.Object, context: bpy.types.Context, editing: bool) -> None:
        """Change the seeds of the pattern, in Object Mode; `editing`: its points may be selected."""
        raise NotImplementedError


def shape(obj: bpy.types.Object, context: bpy.types.Context) -> None:
    """Give the features of the pattern the sizes that its settings want."""
    from . import generation

    if generation.is_only_shape(obj.bubble_pattern):
        generation.reshape(obj, context)
    else:
        drive(generation.renewing_steps(obj, context))


def keep(settings: Any, seeds: list[tuple[Any, float]]) -> None:
    """Let these places with their diameters be the seeds of the pattern."""
    settings.seeds.clear()
    for at, diameter in seeds:
        entry = settings.seeds.add()
        entry.at, entry.diameter = at, diameter


def bubbles_of(obj: bpy.types.Object, context: bpy.types.Context) -> tuple[Floats, Floats, Ints]:
    """Places (n, 3) of the pattern's bubbles, their diameters (n,), and the rows of the selected ones."""
    from .pattern_object import point_ids, read_pattern
    from .sources import read_source

    settings = obj.bubble_pattern
    source = read_source(settings.base, settings.region, context)
    bubbles = all_bubbles(read_pattern(obj, source.base.mesh))
    chosen = point_ids(obj)[read_values(obj.data.vertices, "select", np.bool_)]
    return bubbles.position, bubbles.diameter, np.flatnonzero(np.isin(bubbles.ids, chosen))


def fixed_rows(settings: Any, position: Floats) -> Ints:
    """Row of the bubble that each seed of the pattern fixes, the nearest one."""
    from scipy.spatial import cKDTree

    if not settings.seeds:
        return np.empty(0, dtype=np.int64)
    at = np.array([seed.at[:] for seed in settings.seeds])
    return np.asarray(cKDTree(position).query(at)[1], dtype=np.int64)


class BUBBLE_PATTERN_OT_edit_sizes(OnPattern, bpy.types.Operator):
    """Go to Edit Mode of the pattern, where features can be selected to fix their sizes"""

    bl_idname = "bubble_pattern.edit_sizes"
    bl_label = "Edit Sizes"
    bl_options = {'REGISTER', 'UNDO'}

    def execute(self, context: bpy.types.Context) -> set[str]:
        from . import generation

        obj = current_pattern(context)
        generation.show_part(obj, context, False)
        generation.make_active(obj, context)
        bpy.ops.object.mode_set(mode='EDIT')
        context.tool_settings.mesh_select_mode = (True, False, False)
        return {'FINISHED'}


class BUBBLE_PATTERN_OT_fix_sizes(SizesOperator, bpy.types.Operator):
    """Let the selected features keep their size; all others level out between those that are fixed"""

    bl_idname = "bubble_pattern.fix_sizes"
    bl_label = "Fix Sizes"
    bl_options = {'REGISTER', 'UNDO'}

    diameter: length_property(
        "Diameter",
        "Diameter that the selected features get, or 0 to keep that of each",
        min=0.0,
        soft_max=10.0,
        options={'SKIP_SAVE'},
    )

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if not poll_pattern(cls, context):
            return False
        if context.mode != 'EDIT_MESH' or not is_pattern(context.active_object):
            return refused(cls, "Select features in Edit Mode of the pattern first")
        return context.active_object.data.total_vert_sel > 0 or refused(
            cls, "Select the features whose size shall stay"
        )

    def change(self, obj: bpy.types.Object, context: bpy.types.Context, editing: bool) -> None:
        """Add seeds at the selected features, in place of those that they had."""
        settings = obj.bubble_pattern
        position, diameter, chosen = bubbles_of(obj, context)
        if self.diameter:
            diameter = np.full(len(diameter), typed(self.diameter))
        left = chosen[diameter[chosen] <= 0]
        if len(left):
            raise PatternError(
                f"{len(left):,} of the selected features are left out as too small: give a diameter for them"
            )
        rows = fixed_rows(settings, position)
        seeds = [
            (point_of(seed.at), seed.diameter)
            for seed, row in zip(settings.seeds, rows.tolist(), strict=True)
            if row not in set(chosen.tolist())
        ]
        keep(settings, seeds + [(position[row], diameter[row]) for row in chosen])


class BUBBLE_PATTERN_OT_free_sizes(SizesOperator, bpy.types.Operator):
    """Let the selected features have any size again; in Object Mode all that are fixed"""

    bl_idname = "bubble_pattern.free_sizes"
    bl_label = "Free Sizes"
    bl_options = {'REGISTER', 'UNDO'}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if not poll_pattern(cls, context):
            return False
        if not current_pattern(context).bubble_pattern.seeds:
            return refused(cls, "No size is fixed")
        if context.mode == 'OBJECT':
            return True
        if context.mode != 'EDIT_MESH' or not is_pattern(context.active_object):
            return refused(cls, "Switch to Object Mode, or to Edit Mode of the pattern")
        return context.active_object.data.total_vert_sel > 0 or refused(
            cls, "Select the features whose size shall be free"
        )

    def change(self, obj: bpy.types.Object, context: bpy.types.Context, editing: bool) -> None:
        """Take the seeds of the selected features away, or all."""
        settings = obj.bubble_pattern
        if not editing:
            settings.seeds.clear()
            return
        position, _, chosen = bubbles_of(obj, context)
        rows = fixed_rows(settings, position)
        kept = np.flatnonzero(~np.isin(rows, chosen)).tolist()
        keep(settings, [(point_of(settings.seeds[n].at), settings.seeds[n].diameter) for n in kept])


CLASSES = (BUBBLE_PATTERN_OT_edit_sizes, BUBBLE_PATTERN_OT_fix_sizes, BUBBLE_PATTERN_OT_free_sizes)

register, unregister = bpy.utils.register_classes_factory(CLASSES)
