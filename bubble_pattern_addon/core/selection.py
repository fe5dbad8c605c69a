"""From a recipe's words to faces: which triangles of the base are the target region."""

from __future__ import annotations

import difflib
from collections.abc import Mapping

import numpy as np
import trimesh
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from .errors import RegionError
from .mesh import Bools, Floats, Ints, Mesh
from .recipe import RegionChoice
from .recipe_checks import check_choice
from .region import weld

NO_NAMES: Mapping[str, Bools] = {}


def select(
    base: Mesh,
    choice: RegionChoice,
    attributes: Mapping[str, Bools] = NO_NAMES,
    materials: Mapping[str, Bools] = NO_NAMES,
) -> Bools:
    """Mask (T,) of the triangles of `base` that `choice` means.

    attributes, materials: name -> mask (T,) of the triangles that carry the face attribute or the material

    Raises RegionError where no triangle is meant or a name is not known, RecipeError where the choice itself
    is none (see check_choice).
    """
    check_choice(choice)
    if choice.all:
        selected = np.ones(len(base.triangles), dtype=bool)
        if not selected.any():
            raise RegionError("The target region is empty: the base has no faces")
        return selected
    if choice.near is not None:
        return grown(base, nearest_triangle(base, np.array(choice.near)), choice.max_angle)
    if choice.attribute is not None:
        return _named(choice.attribute, attributes, "face attribute")
    assert choice.material is not None  # check_choice has seen to it
    return _named(choice.material, materials, "material")


def sub_regions(
    choice: RegionChoice,
    attributes: Mapping[str, Bools] = NO_NAMES,
    materials: Mapping[str, Bools] = NO_NAMES,
) -> Ints | None:
    """Number of the sub-region (T,) that each triangle is in: 1 and up in the order of `choice.parts`, 0 for
    the rest; None where the choice names no parts. Where two share a triangle the first has it.

    Raises RegionError where a name is neither a face attribute nor a material.
    """
    if not choice.parts:
        return None
    known = {**materials, **attributes}
    masks = [_named(name, known, "face attribute or material") for name in choice.parts]
    return np.where(np.any(masks, axis=0), np.argmax(masks, axis=0) + 1, 0)


def face_set(name: str, known: Mapping[str, Bools]) -> Bools:
    """The triangles (T,) with the face attribute or material of that name; there may be none. RegionError
    where the name is not known.
    """
    kind = "face attribute or material"
    return np.asarray(known[name], dtype=bool) if name in known else _named(name, known, kind)


def _named(name: str, known: Mapping[str, Bools], kind: str) -> Bools:
    if name not in known:
        match = difflib.get_close_matches(name, list(known), 1, cutoff=0.5)
        if match:
            advice = f'did you mean "{match[0]}"?'
        elif known:
            advice = "it has " + ", ".join(f'"{other}"' for other in sorted(known))
        else:
            advice = "it has none, choose the region by near = [x, y, z] or all = true"
        raise RegionError(f'The base has no {kind} "{name}": {advice}')
    selected = np.asarray(known[name], dtype=bool)
    if not selected.any():
        raise RegionError(
            f'The target region is empty: no face has the {kind} "{name}", give it to some faces'
        )
    return selected


def nearest_triangle(base: Mesh, point: Floats) -> int:
    """Row of the triangle nearest to `point` (3,); the first of several at the same distance.

    Triangles without area or with coordinates that are not numbers are passed over. Raises RegionError where
    no other is left.
    """
    size = np.linalg.norm(base.area_vectors, axis=1)
    usable = np.flatnonzero(size > 0)  # NaN compares false
    if not len(usable):
        raise RegionError("The target region is empty: the base has no face with an area")
    corners = base.corners[usable]
    closest = trimesh.triangles.closest_point(corners, np.broadcast_to(point, (len(usable), 3)))
    return int(usable[np.argmin(((closest - point) ** 2).sum(axis=1))])


def grown(base: Mesh, start: int, max_angle: float) -> Bools:
    """Mask (T,) of the triangles reached from `start` across edges that bend by at most max_angle degrees.

    Triangles are neighbours where they share an edge by position; an edge of more than two triangles is
    never crossed.
    """
    pairs = neighbour_pairs(weld(base))
    with np.errstate(invalid="ignore", divide="ignore"):
        normals = base.area_vectors / np.linalg.norm(base.area_vectors, axis=1, keepdims=True)
        cosine = (normals[pairs[:, 0]] * normals[pairs[:, 1]]).sum(axis=1)
    # the slack lets max_angle = 0 reach all of a flat face, whose normals differ by rounding; a triangle
    # without area has no normal (nan) and is taken in: the region is refused for it rather than slit by it
    pairs = pairs[~(cosine < np.cos(np.radians(max_angle)) - 1e-9)]
    count = len(base.triangles)
    links = coo_matrix((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(count, count))
    label = connected_components(links, directed=False)[1]
    return np.asarray(label == label[start])


def neighbour_pairs(welded: Mesh) -> Ints:
    """Pairs of triangles that have an edge to themselves, (M, 2)."""
    edges = np.sort(welded.triangles[:, [[1, 2], [2, 0], [0, 1]]].reshape(-1, 2), axis=1)
    key = edges[:, 0] * len(welded.vertices) + edges[:, 1]
    order = np.argsort(key, kind="stable")
    _, first, count = np.unique(key[order], return_index=True, return_counts=True)
    first = first[count == 2]
    return np.asarray(np.stack([order[first], order[first + 1]], axis=1) // 3, dtype=np.int64)
