"""The target region as a boolean face attribute: unlike face indices, it survives edits and modifiers."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import bpy
import numpy as np

from ..core.errors import RegionError
from .attributes import Array, read_values, write_values
from .properties import pattern_objects

ATTRIBUTE = "bubble_region"


def free_name(base: bpy.types.Object) -> str:
    """A name for the region of one more pattern on `base`."""
    taken = {obj.bubble_pattern.region for obj in pattern_objects(base)}
    name, number = ATTRIBUTE, 0
    while name in taken:
        number += 1
        name = f"{ATTRIBUTE}_{number}"
    return name


def stored(base: bpy.types.Object, name: str) -> Array | None:
    """Faces of the base's own mesh that the attribute marks (F,), None where there is no such attribute."""
    attribute = base.data.attributes.get(name)
    if attribute is None or (attribute.domain, attribute.data_type) != ('FACE', 'BOOLEAN'):
        return None
    return read_values(attribute.data, "value", np.bool_)


def store(base: bpy.types.Object, name: str, faces: Array | None) -> None:
    """Mark `faces` (F,) of the base's own mesh by the attribute `name`; None takes the attribute away."""
    if faces is None:
        attribute = base.data.attributes.get(name)
        if attribute is not None:
            base.data.attributes.remove(attribute)
    else:
        write_values(base.data, name, 'FACE', 'BOOLEAN', faces)
    base.data.update_tag()


def selected_faces(base: bpy.types.Object) -> Array:
    """Selected faces of the base's own mesh (F,), in Object Mode. Raises RegionError where there is none."""
    selected = read_values(base.data.polygons, "select", np.bool_)
    if not selected.any():
        raise RegionError("No face is selected: select the faces that the pattern shall fill")
    return selected


def wanted_faces(base: bpy.types.Object, name: str, only_selected: bool) -> Array:
    """The faces for a new pattern: the selected ones, or else those marked already, or else all."""
    if only_selected:
        return selected_faces(base)
    marked = stored(base, name)
    if marked is not None and marked.any():
        return marked
    return np.ones(len(base.data.polygons), dtype=bool)


@contextmanager
def trying_region(base: bpy.types.Object, name: str) -> Iterator[None]:
    """Object Mode of `base`, to mark other faces by the attribute `name` and see what comes of it.

    Where the block ends in an error or is cancelled, marks and mode are as they were before.
    """
    editing = base.mode == 'EDIT'
    if editing:
        bpy.ops.object.mode_set(mode='OBJECT')
    before = stored(base, name)
    try:
        yield
    except BaseException:
        store(base, name, before)
        if editing:
            bpy.ops.object.mode_set(mode='EDIT')
        raise
