# mypy: disable-error-code="valid-type"
"""What the buttons do. Docstrings of operators are their tooltips.

The work itself is in generation, which is imported on first use: Blender starts without waiting for scipy.
"""

from __future__ import annotations

from typing import Any

import bpy
from bpy.props import BoolProperty, FloatProperty

from ..core.feature_recipe import nouns
from ..core.progress import Progress, Steps
from .cut_preview import hide_cut
from .field_properties import length_property, typed
from .hand_state import by_hand_now
from .laying import AnewOperator, LayingOperator
from .properties import in_scene, is_pattern, pattern_objects, pattern_of
from .settings_recipe import recipe_of
from .stepping import SteppedOperator
from .target_region import free_name, selected_faces, store, stored, trying_region, wanted_faces


def refused(cls: Any, reason: str) -> bool:
    """Let poll answer no, with the reason in the button's tooltip."""
    cls.poll_message_set(reason)
    return False


def current_pattern(context: bpy.types.Context) -> bpy.types.Object:
    """The pattern to work on, which poll has made sure of."""
    obj = pattern_of(context.active_object)
    assert obj is not None
    return obj


def poll_pattern(cls: Any, context: bpy.types.Context) -> bool:
    """Whether there is a pattern to work on, with its base."""
    obj = pattern_of(context.active_object)
    if obj is None:
        return refused(cls, "Select a pattern, its base or its part first")
    base = obj.bubble_pattern.base
    if not in_scene(base):
        return refused(cls, "The base of this pattern has been deleted")
    if not obj.is_editable or not base.is_editable:
        return refused(cls, "The pattern is linked from another file: make it local first")
    return True


def poll_object_mode(cls: Any, context: bpy.types.Context) -> bool:
    """Whether Blender is in Object Mode."""
    return context.mode == 'OBJECT' or refused(cls, "Switch to Object Mode first")


SIZE_OR_NONE = {"min": 0.0, "soft_max": 10.0, "options": {'SKIP_SAVE'}}


class OnPattern:
    """Mixin for an operator on a pattern, in Object Mode."""

    def stands(self, context: bpy.types.Context) -> bool:
        """Whether the pattern is still there with its base."""
        obj = pattern_of(context.active_object)
        return obj is not None and in_scene(obj) and in_scene(obj.bubble_pattern.base)

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return poll_pattern(cls, context) and poll_object_mode(cls, context)


class BUBBLE_PATTERN_OT_add(LayingOperator, bpy.types.Operator):
    """Fill the selected faces with a tight pattern of features; in Object Mode all faces or those marked"""

    bl_idname = "bubble_pattern.add"
    bl_label = "Add Pattern"
    bl_options = {'REGISTER', 'UNDO'}

    # SKIP_SAVE: the next region has a size of its own.
    pitch: length_property(
        "Pitch",
        "Distance between the centers of neighboring features, or 0 to choose it by the region's size",
        **SIZE_OR_NONE,
    )
    diameter: length_property(
        "Diameter", "Diameter of the features, or 0 to let it follow the pitch", **SIZE_OR_NONE
    )
    chosen_diameter: FloatProperty(options={'HIDDEN', 'SKIP_SAVE'})

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        base = context.active_object
        if base is None or base.type != 'MESH':
            return refused(cls, "Select a mesh object first")
        if is_pattern(base):
            return refused(cls, "This is a pattern already: select the part it is on")
        if not base.is_editable or not base.data.is_editable:
            return refused(cls, "The mesh is linked from another file: make it local first")
        if context.mode == 'EDIT_MESH':
            return base.data.total_face_sel > 0 or refused(
                cls, "Select the faces that the pattern shall fill"
            )
        if context.mode != 'OBJECT':
            return refused(cls, "Switch to Object Mode or Edit Mode first")
        if not base.data.polygons:
            return refused(cls, "The object has no faces")
        if pattern_objects(base):
            return refused(cls, "There is a pattern on it: select faces in Edit Mode to add another one")
        return True

    def steps(self, context: bpy.types.Context) -> Steps[bpy.types.Object]:
        from . import generation
        from .pattern_object import new_pattern_object
        from .sources import read_source

        yield Progress("Reading the base", 0.0)
        base = context.active_object
        editing = base.mode == 'EDIT'
        name = free_name(base)
        with trying_region(base, name):
            store(base, name, wanted_faces(base, name, editing))
            source = read_source(base, name, context)
            recipe = generation.fitting_recipe(source.region, name, *self.wanted_lengths())
            laid = yield from generation.laying_steps(source, recipe)
            obj = new_pattern_object(base)
            try:
                generation.fill_settings(obj, base, name, recipe)
                generation.put(obj, source, recipe_of(obj.bubble_pattern), laid)
            except BaseException:
                remove_object(obj)
                raise
        generation.show_part(obj, context, False)
        return obj

    def wanted_lengths(self) -> tuple[float | None, float | None]:
        """Pitch and diameter as the user wants them; None for what is left to us.

        A diameter that we chose and the user left alone follows another pitch.
        """
        own = self.diameter not in (0.0, self.chosen_diameter)
        return typed(self.pitch) or None, typed(self.diameter) if own else None

    def done(self, context: bpy.types.Context, result: bpy.types.Object) -> None:
        """Show what was chosen in Adjust Last Operation, to start from."""
        super().done(context, result)
        settings = result.bubble_pattern
        if self.wanted_lengths()[1] is None:
            self.diameter = self.chosen_diameter = settings.diameter
        self.pitch = settings.pitch


class BUBBLE_PATTERN_OT_update(OnPattern, AnewOperator, LayingOperator, bpy.types.Operator):
    """Lay the pattern anew by its settings, on the base as it is now"""

    bl_idname = "bubble_pattern.update"
    bl_label = "Update"
    bl_options = {'REGISTER', 'UNDO'}
    heeds_sidebar = True

    def about(self, context: bpy.types.Context) -> int:
        number: int = current_pattern(context).session_uid
        return number

    def steps(self, context: bpy.types.Context) -> Steps[bpy.types.Object]:
        from . import generation

        obj = current_pattern(context)
        yield from generation.update_steps(obj, context)
        return obj


class BUBBLE_PATTERN_OT_apply(OnPattern, SteppedOperator, bpy.types.Operator):
    """Make the finished part, a solid with the features, in place of the base, which is kept, hidden"""

    bl_idname = "bubble_pattern.apply"
    bl_label = "Apply"
    bl_options = {'REGISTER', 'UNDO'}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if not super().poll(context):
            return False
        placed = by_hand_now(current_pattern(context))
        return not placed.unsettled or refused(
            cls, f"Settle the features that were placed by hand first ({placed}), or press Update"
        )

    def steps(self, context: bpy.types.Context) -> Steps[Any]:
        from . import applying

        yield Progress("Reading the base", 0.0)
        result = yield from applying.apply_steps(current_pattern(context), context)
        return result

    def done(self, context: bpy.types.Context, result: Any) -> None:
        _obj, part = result
        check = part.check
        if check.problems:
            self.report({'WARNING'}, " ".join(check.problems))
        else:
            what = {"hole": "blind hole"}.get(part.kind, part.kind)
            if part.kind == "hole" and check.through:
                what = "through-hole"
            made = f"Watertight part with {nouns(what, len(part.pierced))}"
            self.report({'WARNING' if part.undercut.any() else 'INFO'}, " ".join([f"{made}.", *check.notes]))


class BUBBLE_PATTERN_OT_edit(OnPattern, bpy.types.Operator):
    """Show the base with its pattern again, and hide the part"""

    bl_idname = "bubble_pattern.edit"
    bl_label = "Edit Pattern"
    bl_options = {'REGISTER', 'UNDO'}

    def execute(self, context: bpy.types.Context) -> set[str]:
        from . import generation

        generation.show_part(current_pattern(context), context, False)
        return {'FINISHED'}


class BUBBLE_PATTERN_OT_remove(bpy.types.Operator):
    """Delete the pattern with its target region and its part, and show the base again"""

    bl_idname = "bubble_pattern.remove"
    bl_label = "Remove"
    bl_options = {'REGISTER', 'UNDO'}

    keep_part: BoolProperty(
        name="Keep Part", description="Leave the finished part as it is, and the base hidden", default=False
    )

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        obj = pattern_of(context.active_object)
        if obj is None:
            return refused(cls, "Select a pattern, its base or its part first")
        return poll_object_mode(cls, context)

    def execute(self, context: bpy.types.Context) -> set[str]:
        from . import generation
        from .feature_shapes import drop_unused

        obj = current_pattern(context)
        settings = obj.bubble_pattern
        base, part, region = settings.base, settings.part, settings.region
        keep = self.keep_part and in_scene(part)
        if base is not None:
            hide_cut(base)
        if in_scene(base) and not keep:
            generation.show_part(obj, context, False)
        remove_object(obj)
        drop_unused()
        if part is not None and not keep:
            remove_object(part)
        if not in_scene(base):
            return {'FINISHED'}
        if all(other.bubble_pattern.region != region for other in pattern_objects(base)):
            store(base, region, None)
        generation.make_active(part if keep else base, context)
        return {'FINISHED'}


def remove_object(obj: bpy.types.Object) -> None:
    """Delete an object with its mesh, where nothing else uses it."""
    mesh = obj.data
    bpy.data.objects.remove(obj)
    if mesh is not None and not mesh.users:
        bpy.data.meshes.remove(mesh)


class BUBBLE_PATTERN_OT_region_assign(AnewOperator, LayingOperator, bpy.types.Operator):
    """Let the selected faces be the target region of the pattern"""

    bl_idname = "bubble_pattern.region_assign"
    bl_label = "Assign"
    bl_options = {'REGISTER', 'UNDO'}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return poll_pattern(cls, context) and poll_edit_base(cls, context, need_faces=True)

    def steps(self, context: bpy.types.Context) -> Steps[bpy.types.Object]:
        from . import generation

        yield Progress("Reading the base", 0.0)
        base = context.active_object
        obj = current_pattern(context)
        name = obj.bubble_pattern.region
        with trying_region(base, name):
            store(base, name, selected_faces(base))
            yield from generation.update_steps(obj, context)
        generation.show_part(obj, context, False)
        return obj


def poll_edit_base(cls: Any, context: bpy.types.Context, need_faces: bool) -> bool:
    """Whether a base is being edited, with faces selected where they are needed."""
    if context.mode != 'EDIT_MESH' or is_pattern(context.active_object):
        return refused(cls, "Select the base and switch to Edit Mode first")
    if need_faces and not context.active_object.data.total_face_sel:
        return refused(cls, "Select the faces of the target region first")
    return True


class BUBBLE_PATTERN_OT_region_edit(OnPattern, bpy.types.Operator):
    """Go to Edit Mode of the base with the faces of the target region selected"""

    bl_idname = "bubble_pattern.region_edit"
    bl_label = "Edit Region"
    bl_options = {'REGISTER', 'UNDO'}

    def execute(self, context: bpy.types.Context) -> set[str]:
        from . import generation

        obj = current_pattern(context)
        base, name = obj.bubble_pattern.base, obj.bubble_pattern.region
        faces = stored(base, name)
        generation.show_part(obj, context, False)
        generation.make_active(base, context)
        bpy.ops.object.mode_set(mode='EDIT')
        context.tool_settings.mesh_select_mode = (False, False, True)
        bpy.ops.mesh.select_all(action='DESELECT')
        bpy.ops.object.mode_set(mode='OBJECT')
        if faces is not None:
            base.data.polygons.foreach_set("select", faces)
        bpy.ops.object.mode_set(mode='EDIT')
        return {'FINISHED'}


CLASSES = (
    BUBBLE_PATTERN_OT_add,
    BUBBLE_PATTERN_OT_update,
    BUBBLE_PATTERN_OT_apply,
    BUBBLE_PATTERN_OT_edit,
    BUBBLE_PATTERN_OT_remove,
    BUBBLE_PATTERN_OT_region_assign,
    BUBBLE_PATTERN_OT_region_edit,
)


register, unregister = bpy.utils.register_classes_factory(CLASSES)
