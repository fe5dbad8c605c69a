# mypy: disable-error-code="valid-type"
"""The button that takes the user to the features that break a rule, or to the smallest web."""

from __future__ import annotations

import bpy
import numpy as np
from bpy.props import EnumProperty

from .operators import OnPattern, current_pattern


class BUBBLE_PATTERN_OT_select_offending(OnPattern, bpy.types.Operator):
    """Select these features among the points of the pattern, in Edit Mode, and turn the view to them"""

    bl_idname = "bubble_pattern.select_offending"
    bl_label = "Select Features"
    bl_options = {'REGISTER', 'UNDO'}

    rule: EnumProperty(
        name="Rule",
        description="Which features to select",
        items=(
            ('ANY', "Any Rule", "Features that break any rule"),
            ('HOLE', "Too Small", "Features smaller than the limits or the process allow"),
            ('SLENDER', "Too Deep", "Features too deep for their diameter"),
            ('WEB', "Web", "Features with too narrow a web"),
            ('MARGIN', "Margin", "Features too close to the boundary of the region"),
            ('DRAFT', "Draft", "Features with too little draft"),
            ('SMALLEST_WEB', "Smallest Web", "The two features with the smallest web"),
        ),
        default='ANY',
        options={'SKIP_SAVE'},
    )

    def execute(self, context: bpy.types.Context) -> set[str]:
        from . import generation, noting

        obj = current_pattern(context)
        rows = noting.rows_of_rule(obj, self.rule)
        if not len(rows):
            self.report({'WARNING'}, "There are no such features")
            return {'CANCELLED'}
        generation.make_active(obj, context)
        chosen = np.zeros(len(obj.data.vertices), dtype=bool)
        chosen[rows] = True
        bpy.ops.object.mode_set(mode='EDIT')
        context.tool_settings.mesh_select_mode = (True, False, False)
        bpy.ops.mesh.select_all(action='DESELECT')
        bpy.ops.object.mode_set(mode='OBJECT')
        obj.data.vertices.foreach_set("select", chosen)
        bpy.ops.object.mode_set(mode='EDIT')
        turn_view(context)
        self.report({'INFO'}, f"{len(rows):,} feature{'s' if len(rows) > 1 else ''} selected")
        return {'FINISHED'}


def turn_view(context: bpy.types.Context) -> None:
    """Turn the 3D View, where there is one, to what is selected."""
    area = context.area
    if area is None or area.type != 'VIEW_3D':
        return
    region = next((region for region in area.regions if region.type == 'WINDOW'), None)
    if region is not None:
        with context.temp_override(region=region):
            if bpy.ops.view3d.view_selected.poll():
                bpy.ops.view3d.view_selected()


CLASSES = (BUBBLE_PATTERN_OT_select_offending,)

register, unregister = bpy.utils.register_classes_factory(CLASSES)
