"""A modelled base as a .blend in millimetres: finishes as materials, smooth shading, faces marked."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import bpy
import numpy as np

from bubble_pattern_addon.blender.batch_base import new_file_in_millimeters
from bubble_pattern_addon.blender.picture import make_material
from bubble_pattern_addon.core.mesh import Bools, Mesh

SHARP = 50.0
"""Edges that bend by more than this many degrees are shaded sharp."""


def write_base(
    path: Path,
    name: str,
    mesh: Mesh,
    marks: Mapping[str, Bools],
    finishes: Mapping[str, tuple[Mapping[str, Any], Bools]],
) -> None:
    """Write a new file with this one object.

    marks: face attributes, name -> mask (T,)
    finishes: material's name -> arguments of make_material and mask (T,); where several lie over one another
    the last counts, and the first must be on all faces
    """
    new_file_in_millimeters()
    data = bpy.data.meshes.new(name)
    data.from_pydata(mesh.vertices.tolist(), [], mesh.triangles.tolist())
    data.shade_smooth()
    data.set_sharp_from_angle(angle=np.radians(SHARP))
    index = np.zeros(len(mesh.triangles), dtype=np.int32)
    for row, (finish, (arguments, mask)) in enumerate(finishes.items()):
        data.materials.append(make_material(finish, **arguments))
        index[mask] = row
    data.polygons.foreach_set("material_index", index)
    for mark, mask in marks.items():
        data.attributes.new(mark, 'BOOLEAN', 'FACE').data.foreach_set("value", mask)
    data.update()
    obj = bpy.data.objects.new(name, data)
    bpy.context.scene.collection.objects.link(obj)
    bpy.context.view_layer.objects.active = obj
    bpy.ops.wm.save_as_mainfile(filepath=str(path), compress=True)
