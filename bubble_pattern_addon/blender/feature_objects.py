"""Objects of the scene as features: the outline of a curve, the body of a mesh."""

from __future__ import annotations

import json
from typing import Any

import bpy
import numpy as np

from ..core.errors import PatternError, RecipeError
from ..core.feature_recipe import Feature
from ..core.mesh import Floats, Ints, Mesh
from .attributes import read_values
from .reading import evaluated_mesh, read_base, shown


def take_outline(settings: Any, context: bpy.types.Context) -> None:
    """Write down the outline of the chosen curve as it is now; what is wrong with it is told as trouble."""
    curve = settings.profile_curve
    if curve is None:
        return
    try:
        settings.profile_points = json.dumps(outline_of(curve, context).round(9).tolist())
        settings.trouble = ""
    except PatternError as error:
        settings.profile_points = ""
        settings.trouble = str(error)


def outline_of(obj: bpy.types.Object, context: bpy.types.Context) -> Floats:
    """The outline of a closed curve, or of a flat mesh, seen along its own z axis, (k, 2).

    Raises RecipeError where it is not one closed loop.
    """
    with shown(obj, context), evaluated_mesh(obj, context.evaluated_depsgraph_get()) as mesh:
        points = read_values(mesh.vertices, "co", np.float32, 3).astype(np.float64).reshape(-1, 3)
        edges = read_values(mesh.edges, "vertices", np.int32, 2).reshape(-1, 2).astype(np.int64)
        used = np.array([len(polygon.vertices) for polygon in mesh.polygons])
        if len(used):
            corner = read_values(mesh.loops, "edge_index", np.int32)
            edges = edges[np.bincount(corner, minlength=len(edges)) == 1]
    loop = _loop(edges)
    if loop is None:
        raise RecipeError(
            f'[feature] profile: "{obj.name}" is not one closed loop: close the curve, or use one with a '
            "single outline"
        )
    scale = np.array(obj.matrix_world.to_scale(), dtype=np.float64)
    outline = (points[loop] * scale)[:, :2]
    # points on top of each other, as where a curve closes, are one
    apart = np.linalg.norm(outline - np.roll(outline, 1, axis=0), axis=1)
    return outline[apart > 1e-7 * np.abs(outline).max()]


def _loop(edges: Ints) -> Ints | None:
    """Vertices round the one closed loop that the edges, (m, 2), make; None where they make another thing."""
    if len(edges) < 3 or (np.bincount(edges.ravel())[np.unique(edges)] != 2).any():
        return None
    order = np.argsort(edges.ravel(), kind="stable")
    at: dict[int, list[int]] = {}
    for place in order.tolist():
        at.setdefault(int(edges.ravel()[place]), []).append(place // 2)
    start = int(edges[0, 0])
    loop, edge, here = [start], 0, int(edges[0, 1])
    while here != start:
        loop.append(here)
        edge = next(other for other in at[here] if other != edge)
        here = int(edges[edge, 0] + edges[edge, 1] - here)
    return np.array(loop) if len(loop) == len(edges) else None


def stamp_of(feature: Feature, context: bpy.types.Context) -> Mesh | None:
    """The mesh object that the feature names, in its own coordinates; None where it names none.

    Raises RecipeError where there is no such object, BaseError where it has no usable mesh.
    """
    if feature.mesh is None:
        return None
    return read_stamp(feature.mesh, context)


def read_stamp(name: str, context: bpy.types.Context) -> Mesh:
    """The mesh of the object `name`, with its modifiers and its scale."""
    obj = bpy.data.objects.get(name)
    if obj is None or obj.type != 'MESH':
        raise RecipeError(f'[feature] mesh: there is no mesh object "{name}": choose another')
    with shown(obj, context), evaluated_mesh(obj, context.evaluated_depsgraph_get()) as mesh:
        # lengths of the world, in the object's own axes
        return read_base(obj, mesh).mesh
