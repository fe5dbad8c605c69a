# mypy: disable-error-code="valid-type"
"""Hand work on the points of a pattern in Edit Mode: pins, and settling after points were moved, added or
deleted.

Docstrings of operators are their tooltips.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import bpy
import numpy as np
from bpy.props import BoolProperty

from ..core.errors import PatternError
from ..core.mesh import Bools
from ..core.progress import drive
from .attributes import read_values, write_values
from .edit_undo import take_all_back
from .hand_state import MOVED, by_hand_now
from .operators import current_pattern, poll_pattern, refused
from .point_marks import PINNED, keep_pins, laid_places, pinned_points
from .properties import is_pattern
from .settings_recipe import is_outdated, recipe_of, recipe_text, spoken

if TYPE_CHECKING:
    from ..core.pattern import Pattern
    from ..core.settling import HandWork


def read_hand_work(obj: bpy.types.Object, before: Pattern) -> HandWork:
    """What has become of the bubbles `before`, all that are on the mesh, by hand; in Object Mode.

    Of points with the same id, as copies have, the one that is nearest to where it was laid is the bubble.
    """
    from ..core.settling import HandWork

    position = read_values(obj.data.vertices, "co", np.float32, 3).astype(np.float64)
    points = obj.data.attributes
    ids = read_values(points["id"].data, "value", np.int32).astype(np.int64)
    pitch = read_values(points["pitch"].data, "value", np.float32)
    row = np.minimum(np.searchsorted(before.ids, ids), len(before) - 1)
    away = np.linalg.norm(position - before.position[row], axis=1) / before.pitch[row]
    # points made from nothing have no pitch
    away[(pitch <= 0) | (before.ids[row] != ids)] = np.inf
    order = np.lexsort((away, ids))
    first = np.concatenate([[True], np.diff(ids[order]) != 0])
    bubble = np.full(len(ids), -1)
    own = order[first & np.isfinite(away[order])]
    bubble[own] = ids[own]
    laid_ids, laid_at = laid_places(obj)
    gone = laid_at[~np.isin(laid_ids, bubble)]
    return HandWork(position, bubble, away > MOVED, pinned_points(obj), gone)


# -- operators -----------------------------------------------------------------------------------------------


class OnPoints:
    """Mixin for an operator on the points of a pattern in Edit Mode."""

    bl_options = {'REGISTER', 'UNDO'}
    needs_selection = True
    # Whether it works in Object Mode as well, on what was done in Edit Mode before.
    works_outside = False

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if not poll_pattern(cls, context):
            return False
        if cls.works_outside and context.mode == 'OBJECT':
            found = by_hand_now(current_pattern(context))
            return any(found) or refused(cls, "Go to Edit Mode of the pattern and move features first")
        if context.mode != 'EDIT_MESH' or not is_pattern(context.active_object):
            return refused(cls, "Go to Edit Mode of the pattern first")
        if cls.needs_selection and not context.active_object.data.total_vert_sel:
            return refused(cls, "Select features first")
        return True

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Do the work in Object Mode; an error leaves everything as it was."""
        obj = current_pattern(context)
        editing = obj.mode == 'EDIT'
        if editing:
            bpy.ops.object.mode_set(mode='OBJECT')
        try:
            self.work(obj, context)
        except PatternError as error:
            self.report({'ERROR'}, spoken(error, context))  # type: ignore[attr-defined]
            return {'CANCELLED'}
        finally:
            if editing:
                bpy.ops.object.mode_set(mode='EDIT')
        if editing:
            take_all_back()
        return {'FINISHED'}

    def work(self, obj: bpy.types.Object, context: bpy.types.Context) -> None:
        """The work, in Object Mode."""
        raise NotImplementedError


def set_pinned(obj: bpy.types.Object, pinned: Bools) -> None:
    """Let the points `pinned` (V,) be those that stay; the pattern is as up to date as it was."""
    settings = obj.bubble_pattern
    fresh = not is_outdated(settings)
    write_values(obj.data, PINNED, 'POINT', 'BOOLEAN', pinned)
    keep_pins(settings, read_values(obj.data.vertices, "co", np.float32, 3)[pinned])
    if fresh:
        settings.made_with = recipe_text(recipe_of(settings))


class BUBBLE_PATTERN_OT_pin(OnPoints, bpy.types.Operator):
    """Keep the selected features where they are, whatever happens to the others"""

    bl_idname = "bubble_pattern.pin"
    bl_label = "Pin"

    def work(self, obj: bpy.types.Object, context: bpy.types.Context) -> None:
        """Pin the selected points besides those that are."""
        set_pinned(obj, pinned_points(obj) | read_values(obj.data.vertices, "select", np.bool_))


class BUBBLE_PATTERN_OT_unpin(OnPoints, bpy.types.Operator):
    """Let the selected features move again"""

    bl_idname = "bubble_pattern.unpin"
    bl_label = "Unpin"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if not super().poll(context):
            return False
        return len(current_pattern(context).bubble_pattern.pins) > 0 or refused(cls, "No feature is pinned")

    def work(self, obj: bpy.types.Object, context: bpy.types.Context) -> None:
        """Unpin the selected points."""
        set_pinned(obj, pinned_points(obj) & ~read_values(obj.data.vertices, "select", np.bool_))


class BUBBLE_PATTERN_OT_settle(OnPoints, bpy.types.Operator):
    """Even out the features round those that were moved, added, deleted or pinned"""

    bl_idname = "bubble_pattern.settle"
    bl_label = "Settle"
    needs_selection = False
    works_outside = True

    fill_voids: BoolProperty(
        name="Fill Voids",
        description="Put new features where there is room, instead of closing the gaps",
        default=False,
    )
    pin_moved: BoolProperty(
        name="Pin Moved",
        description="Keep what was moved or added by hand exactly where it is",
        default=False,
    )

    def work(self, obj: bpy.types.Object, context: bpy.types.Context) -> None:
        """Settle the points and shape their features."""
        count = settle(obj, context, self.fill_voids, self.pin_moved)
        self.report({'INFO'}, f"{count:,} feature{'s' if count != 1 else ''}")


def settle(obj: bpy.types.Object, context: bpy.types.Context, fill_voids: bool, pin_moved: bool) -> int:
    """Settle the points of the pattern after hand work, in Object Mode; the number of features then.

    Raises PatternError where base or packing have changed since the points were laid, and what settling
    raises; nothing is changed then.
    """
    from dataclasses import replace

    from ..core.pattern import all_bubbles
    from ..core.quality import measure
    from ..core.settling import settle_steps
    from . import generation
    from .pattern_object import point_ids, read_pattern
    from .sources import read_source

    settings = obj.bubble_pattern
    recipe = recipe_of(settings)
    source = read_source(settings.base, settings.region, context, recipe)
    if source.fingerprint != settings.fingerprint or not generation.is_only_shape(settings):
        raise PatternError(
            "The base or the packing has changed since the features were laid: update the pattern, then "
            "settle it"
        )
    before = all_bubbles(read_pattern(obj, source.base.mesh))
    if not len(before):
        raise PatternError("No point of the pattern is left: update it to lay it anew")
    hand = read_hand_work(obj, before)
    touched = bool(len(hand.gone) or (hand.bubble < 0).any() or hand.moved.any() or fill_voids)
    if pin_moved:
        hand = replace(hand, pinned=hand.pinned | hand.moved | (hand.bubble < 0))
    chosen = point_ids(obj)[read_values(obj.data.vertices, "select", np.bool_)]
    steps = settle_steps(before, hand, source.region, recipe, source.surroundings, fill_voids)
    pattern, stay = drive(steps)
    keep_pins(settings, stay)
    recipe = recipe_of(settings)
    quality = measure(pattern, source.region)
    by_hand = settings.hand_made or touched
    laid = replace(generation.measured(pattern, source.region, recipe, quality), seconds=settings.seconds)
    generation.put(obj, source, recipe, laid)
    settings.hand_made = by_hand
    obj.data.vertices.foreach_set("select", np.isin(point_ids(obj), chosen))
    return len(pattern)


CLASSES = (BUBBLE_PATTERN_OT_pin, BUBBLE_PATTERN_OT_unpin, BUBBLE_PATTERN_OT_settle)

register, unregister = bpy.utils.register_classes_factory(CLASSES)
