"""What a base file has painted on its mesh: numbers, colours and UV maps, as trimesh hands them over.

Files do not name colours and UV maps; they get the names that Blender gives them on import.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
import trimesh

from .mesh import Floats

COLOUR, UV_MAP = "Color", "UVMap"
# properties of a PLY vertex that are told otherwise
OTHERWISE = {"x", "y", "z", "nx", "ny", "nz", "red", "green", "blue", "alpha", "s", "t", "u", "v"}


def painted(geometry: trimesh.Trimesh) -> tuple[dict[str, Floats], dict[str, Floats]]:
    """Values by name, (T,) of faces, (T, 3) or (T, 3, channels) at corners, and UV maps, (T, 3, 2).

    Numbers come from the properties of PLY vertices and faces (unless polygons were split into triangles)
    and from glTF's own attributes (their names begin with _).
    """
    faces = np.asarray(geometry.faces)
    count = len(geometry.vertices)
    values: dict[str, Floats] = {}
    for name, column in _columns(geometry, "face"):
        if column.shape == (len(faces),):
            values[name] = column
    for name, column in (*_columns(geometry, "vertex"), *_own(geometry)):
        if column.shape == (count,) and name not in OTHERWISE:
            values[name] = column[faces]
    visual: Any = geometry.visual
    if visual.kind == "vertex" and np.shape(visual.vertex_colors) == (count, 4):
        values[COLOUR] = np.asarray(visual.vertex_colors, dtype=np.float64)[faces] / 255
    uv = getattr(visual, "uv", None)
    raw = dict(_columns(geometry, "vertex"))
    for pair in (("s", "t"), ("u", "v")):
        if uv is None and all(axis in raw and raw[axis].shape == (count,) for axis in pair):
            uv = np.stack([raw[axis] for axis in pair], axis=1)
    if uv is None or np.shape(uv) != (count, 2):
        return values, {}
    return values, {UV_MAP: np.asarray(uv, dtype=np.float64)[faces]}


def _columns(geometry: trimesh.Trimesh, element: str) -> Iterator[tuple[str, Floats]]:
    """Numbers of a PLY file's vertices or faces, a column for each property."""
    table = geometry.metadata.get("_ply_raw", {}).get(element, {}).get("data")
    # text files give a dict of columns, binary ones a structured array
    names = table if isinstance(table, Mapping) else getattr(getattr(table, "dtype", None), "names", None)
    for name in names or ():
        try:
            column = np.squeeze(np.asarray(table[name]))
        except ValueError:  # polygons of several lengths
            continue
        if np.issubdtype(column.dtype, np.number):
            yield str(name), column.astype(np.float64)


def _own(geometry: trimesh.Trimesh) -> Iterator[tuple[str, Floats]]:
    for name, values in geometry.vertex_attributes.items():
        column = np.squeeze(np.asarray(values))
        if np.issubdtype(column.dtype, np.number):
            yield str(name), column.astype(np.float64)
