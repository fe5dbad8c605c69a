"""Is this base geometry fit for a solid? Packing never asks: a preview works on any surface.

Tolerated without a word: vertices written once per face (STL), which are welded where exactly equal, and
faces with two equal corners, which are left out. Faces without area whose corners differ are kept as long as
the surface stays closed.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .errors import BaseError
from .mesh import Floats, Ints, Mesh


@dataclass(frozen=True)
class SoundBase:
    """A closed, consistently wound mesh, and where it comes from.

    mesh: what the boolean gets; triangle: (T,) the caller's triangle each of its triangles is; vertex: (V,)
        likewise
    """

    mesh: Mesh
    triangle: Ints
    vertex: Ints


def sound_base(base: Mesh) -> SoundBase:
    """`base` made ready for a boolean.

    Raises BaseError, one sentence that says what is wrong, where, and what to do: no faces, coordinates that
    are no numbers, no area, open or non-manifold edges, inconsistent winding, inside out.
    """
    _check_numbers(base)
    # bodies that touch along an edge are closed as indexed, and would not be after welding
    sound = _without_collapsed(base, np.arange(len(base.vertices)))
    if not _is_closed(sound.mesh.triangles):
        sound = _without_collapsed(base, weld(base.vertices))
        _check_edges(sound.mesh)
    _check_volume(sound.mesh)
    return sound


def weld(vertices: Floats) -> Ints:
    """For every vertex, (V, 3), the first one at exactly its place, (V,)."""
    if len(vertices) == 0:
        return np.zeros(0, dtype=np.int64)
    order = np.lexsort(vertices.T)
    ahead = vertices[order]
    new = np.concatenate([[True], np.any(ahead[1:] != ahead[:-1], axis=1)])
    # lexsort is stable, so the first of a run is the first in the file
    target = np.empty(len(vertices), dtype=np.int64)
    target[order] = order[new][np.cumsum(new) - 1]
    return target


def _without_collapsed(base: Mesh, target: Ints) -> SoundBase:
    """`base` with its vertices renamed to `target`, less the faces that collapse and the vertices nobody
    uses.
    """
    triangles = target[base.triangles]
    a, b, c = triangles.T
    kept = np.flatnonzero((a != b) & (b != c) & (c != a))
    used, index = np.unique(triangles[kept], return_inverse=True)
    mesh = Mesh(base.vertices[used], index.reshape(-1, 3).astype(np.int64))
    return SoundBase(mesh, kept, used)


def _check_numbers(base: Mesh) -> None:
    if len(base.triangles) == 0:
        raise BaseError("The base has no faces: choose a mesh with faces.")
    if base.triangles.min() < 0 or base.triangles.max() >= len(base.vertices):
        raise BaseError("The base's faces name vertices that do not exist: export the mesh again.")
    bad = np.flatnonzero(~np.isfinite(base.vertices).all(axis=1))
    if len(bad):
        raise BaseError(
            f"The base has {_count(len(bad), 'vertex', 'vertices')} whose coordinates are not numbers "
            f"(NaN or infinite), the first is vertex {bad[0]}: delete or repair it."
        )
    if not np.any(np.abs(base.area_vectors) > 0):
        raise BaseError("Every face of the base has zero area: choose a mesh that encloses a volume.")


def edge_keys(triangles: Ints) -> tuple[Ints, Ints]:
    """Directed edges of `triangles`, (T, 3), each as one number: 2 * (edge) + direction, and the vertex
    count V.

    The edge between vertices i < j is i * V + j; direction 1 runs from j to i. (3 T,), and V as a 0-d array.
    """
    start, end = triangles.ravel(), np.roll(triangles, -1, axis=1).ravel()
    number = np.asarray(triangles.max() + 1 if len(triangles) else 0)
    return (np.minimum(start, end) * number + np.maximum(start, end)) * 2 + (start > end), number


def _is_closed(triangles: Ints) -> bool:
    """Is every edge shared by exactly two triangles that run along it in opposite directions?"""
    if len(triangles) == 0 or len(triangles) % 2:
        return False
    keys = np.sort(edge_keys(triangles)[0])
    first, second = keys[::2], keys[1::2]
    return bool(np.all(second == first + 1) and np.all(first % 2 == 0) and np.all(second[:-1] < first[1:]))


def _check_edges(mesh: Mesh) -> None:
    """Raise BaseError where the surface is not closed and consistently wound."""
    if _is_closed(mesh.triangles):
        return
    keys, number = edge_keys(mesh.triangles)
    edges, inverse = np.unique(keys // 2, return_inverse=True)
    faces = np.bincount(inverse, minlength=len(edges))
    backward = np.bincount(inverse, weights=keys % 2, minlength=len(edges))
    ends = np.stack(np.divmod(edges, number), axis=1)
    for wrong, text in (
        (
            faces > 2,
            "The base is not manifold: {} shared by more than two faces, {}. "
            "Separate the parts there or remove inner faces.",
        ),
        (
            faces == 1,
            "The base is open: {} with a face on one side only, {}. "
            "Close the holes first; a preview works without.",
        ),
        (
            (faces == 2) & (backward != 1),
            "The base's faces point different ways: {} between a face turned outward and one turned inward, "
            "{}. Recalculate the normals.",
        ),
    ):
        where = np.flatnonzero(wrong)
        if len(where):
            middle = mesh.vertices[ends[where]].mean(axis=1)
            raise BaseError(text.format(_count(len(where), "edge", "edges"), _spread_text(middle)))
    raise BaseError("The base's surface is not closed: repair the mesh first.")


def _check_volume(mesh: Mesh) -> None:
    volume = signed_volumes(mesh).sum()
    if volume < 0:
        raise BaseError("The base is inside out (its faces point inward): flip its normals.")
    if volume == 0:
        raise BaseError("The base encloses no volume: choose a closed part with some thickness.")


def signed_volumes(mesh: Mesh) -> Floats:
    """Volume of the tetrahedron under each triangle, seen from the middle of the mesh, (T,); their sum is
    the volume.
    """
    middle = (mesh.vertices.min(axis=0) + mesh.vertices.max(axis=0)) / 2
    a, b, c = (mesh.vertices - middle)[mesh.triangles].swapaxes(0, 1)
    return np.einsum("ij,ij->i", a, np.cross(b, c)) / 6


def _count(number: int, one: str, many: str) -> str:
    return f"{number:,} {one if number == 1 else many}"


def _spread_text(points: Floats) -> str:
    """Where `points`, (n, 3), are, in words."""
    first = points[np.lexsort(points.T)[0]]
    place = "({:.4g}, {:.4g}, {:.4g})".format(*first)
    return f"at {place}" if len(points) == 1 else f"the first near {place}"
