"""The target region on a base whose modifiers give a surface its thickness: on the side that was marked."""

from __future__ import annotations

import bpy

from ..core.mesh import Bools, Mesh
from ..core.sides import faced_side
from .reading import Base, read_base

# Modifiers that make a second side of a surface, and copy the marks on its faces there.
THICKENING = {'SOLIDIFY', 'NODES'}


def on_marked_side(obj: bpy.types.Object, base: Base, name: str, selected: Bools) -> Bools:
    """The triangles `selected` (T,) of `base`, those of the attribute `name`, less the copies that a Solidify
    modifier has put on the other side of the wall it made.
    """
    if not any(m.type in THICKENING and m.show_viewport for m in obj.modifiers):
        return selected
    own = read_base(obj, obj.data, base.frame)
    marked = own.attributes.get(name)
    if marked is None:
        return selected
    return faced_side(base.mesh, selected, Mesh(own.mesh.vertices, own.mesh.triangles[marked]))
