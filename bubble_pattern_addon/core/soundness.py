"""Is this base geometry fit for a solid? Packing never asks: a preview works on any surface.

Tolerated without a word: vertices written once per face (STL), which are welded where exactly equal, and
faces with two equal corners, which are left out. Faces without area whose corners differ are kept as long as
the surface stays closed.
"""

from __future__ import annotations

import hashlib
from dataclasses import dataclass

import numpy as np

from .boxtree import BoxTree, build_tree
from .closed import Measures, edge_keys, fans, linked, opposites, signed_volumes
from .crossings import crossing_triangles
from .errors import BaseError
from .mesh import Floats, Ints, Mesh, area_columns
from .sheets import sheets


@dataclass(frozen=True)
class SoundBase:
    """A closed, consistently wound mesh, and where it comes from.

    mesh: what the boolean gets; triangle: (T,) the caller's triangle each of its triangles is; vertex: (V,)
        likewise; tree: of the mesh's triangles; measures: of the mesh
    """

    mesh: Mesh
    triangle: Ints
    vertex: Ints
    tree: BoxTree
    measures: Measures


BLOCK = 1 << 16
"""Faces looked at together for one that has an area."""

_known: dict[bytes, SoundBase] = {}
"""The base found sound last, by the digest of its arrays: a designer tries many patterns on one part."""


def sound_base(base: Mesh) -> SoundBase:
    """`base` made ready for a boolean; its arrays cannot be written to.

    The answer for the last base is kept, so that the same mesh is not looked through again.

    Raises BaseError, one sentence that says what is wrong, where, and what to do: no faces, coordinates that
    are no numbers, no area, open or non-manifold edges, inconsistent winding, inside out, one body inside
    another, faces that reach through one another.
    """
    digest = hashlib.blake2b(np.ascontiguousarray(base.vertices))
    digest.update(np.ascontiguousarray(base.triangles))
    digest.update(repr([(side.shape, side.dtype) for side in (base.vertices, base.triangles)]).encode())
    key = digest.digest()
    if key not in _known:
        sound = _examined(base)
        for array in (sound.mesh.vertices, sound.mesh.triangles, sound.triangle, sound.vertex):
            array.flags.writeable = False
        _known.clear()
        _known[key] = sound
    return _known[key]


def forget_base() -> None:
    """Let the next base be looked through anew, for whoever measures what that costs."""
    _known.clear()


def _examined(base: Mesh) -> SoundBase:
    """`sound_base` of a base not seen before."""
    _check_numbers(base)
    # bodies that touch along an edge are closed as indexed, and would not be after welding
    mesh, triangle, vertex = _without_collapsed(base)
    opposite = opposites(mesh.triangles)
    if opposite is None:
        mesh, triangle, vertex = _without_collapsed(Mesh(base.vertices, weld(base.vertices)[base.triangles]))
        opposite = opposites(mesh.triangles)
    if opposite is None:
        raise BaseError(_open_edges(mesh))
    mesh, vertex = _without_pinches(mesh, vertex, opposite)
    neighbour = (opposite % len(triangle)).reshape(3, -1)
    columns = mesh.columns
    tree = build_tree(columns)
    crossing = crossing_triangles(mesh, columns, tree, sheets(mesh, neighbour))
    if len(crossing):
        faces = np.unique(crossing)
        place = _where(mesh.corners[crossing[:, 0]].mean(axis=1))
        raise BaseError(
            f"The base passes through itself: {len(faces):,} faces reach through one another, {place}. "
            "Unite the overlapping parts first."
        )
    shell = linked(neighbour, np.ones(neighbour.shape, dtype=bool))
    volumes = np.bincount(shell, weights=signed_volumes(mesh))
    _check_orientation(mesh, shell, volumes, np.sqrt((area_columns(columns) ** 2).sum(axis=0)))
    euler = len(mesh.vertices) - len(mesh.triangles) // 2
    return SoundBase(mesh, triangle, vertex, tree, Measures(True, euler, volumes))


def _without_pinches(mesh: Mesh, vertex: Ints, opposite: Ints) -> tuple[Mesh, Ints]:
    """Where the surface touches itself in a vertex, a vertex for each side: handles and bodies count right
    then.
    """
    fan = fans(mesh.triangles, opposite)
    if fan.max() + 1 == len(mesh.vertices):
        return mesh, vertex
    row = np.empty(fan.max() + 1, dtype=np.int64)
    row[fan] = mesh.triangles
    return Mesh(mesh.vertices[row], np.ascontiguousarray(fan)), vertex[row]


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


def _without_collapsed(base: Mesh) -> tuple[Mesh, Ints, Ints]:
    """`base` less the faces that collapse and the vertices nobody uses, and which triangles and vertices are
    left.
    """
    a, b, c = base.triangles.T
    kept = np.flatnonzero((a != b) & (b != c) & (c != a))
    triangles = base.triangles[kept]
    named = np.zeros(len(base.vertices), dtype=bool)
    named[triangles] = True
    used = np.flatnonzero(named)
    if len(used) < len(named):
        triangles = (np.cumsum(named) - 1)[triangles]
    return Mesh(base.vertices[used], triangles), kept, used


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
    blocks = (base.triangles[start : start + BLOCK] for start in range(0, len(base.triangles), BLOCK))
    if not any(np.any(np.abs(Mesh(base.vertices, block).area_vectors) > 0) for block in blocks):
        raise BaseError("Every face of the base has zero area: choose a mesh that encloses a volume.")


def _open_edges(mesh: Mesh) -> str:
    """Say where the surface is not closed and consistently wound."""
    keys, bits = edge_keys(mesh.triangles)
    edges, inverse = np.unique(keys >> 1, return_inverse=True)
    faces = np.bincount(inverse, minlength=len(edges))
    backward = np.bincount(inverse, weights=keys & 1, minlength=len(edges))
    middle = mesh.vertices[np.stack([edges >> bits, edges & ((1 << bits) - 1)], axis=1)].mean(axis=1)
    found = [
        f"{_count(int(wrong.sum()), 'edge', 'edges')} {text}, {_where(middle[wrong])}"
        for wrong, text in (
            (faces == 1, "with a face on one side only"),
            (faces > 2, "shared by more than two faces"),
            ((faces == 2) & (backward != 1), "between a face turned outward and one turned inward"),
        )
        if wrong.any()
    ]
    remedy = "close the holes" if (faces == 1).any() else "separate or remove the extra faces"
    if not (faces != 2).any():
        remedy = "recalculate the normals"
    return f"The base is not a closed solid: {'; '.join(found)}. To make a part, {remedy} first."


def _check_orientation(mesh: Mesh, shell: Ints, volume: Floats, areas: Floats) -> None:
    """Raise BaseError for shells that enclose nothing, are inside out, or lie inside another body's material.

    shell: (T,) the triangles' shells; volume: of each, (shells,); areas: twice the triangles', (T,). A shell
    round material must lie outside every other body (or in a hollow), a hollow's shell inside one.
    """
    area = np.bincount(shell, weights=areas)
    empty = np.flatnonzero(np.abs(volume) <= 1e-12 * area**1.5)
    probe = _probes(mesh, shell)
    depth = _depth(mesh, shell, probe)
    # where bodies touch, a probe on the other's surface may count either way: all of a shell's must agree
    outside, inside = np.all(depth < 1, axis=1), np.all(depth > 0, axis=1)
    for wrong, text in (
        (empty, "encloses no volume, {}: choose a closed part with some thickness"),
        (
            np.flatnonzero((volume < 0) & outside),
            "is inside out (its faces point inward), {}: flip its normals",
        ),
        (
            np.flatnonzero((volume > 0) & inside),
            "has a body inside another body, {}: unite or remove it",
        ),
    ):
        if len(wrong):
            raise BaseError(f"The base {text.format(_where(probe[wrong, 0]))}.")


def _probes(mesh: Mesh, shell: Ints) -> Floats:
    """Corners of each shell that lie farthest out along x, y and z, both ways, (shells, 6, 3)."""
    count = int(shell.max()) + 1
    owner = np.zeros(len(mesh.vertices), dtype=np.int64)
    owner[mesh.triangles] = shell[:, None]
    probes = []
    for height in np.ascontiguousarray(mesh.vertices.T):
        for way in (-height, height):
            farthest = np.full(count, -np.inf)
            if count == 1:
                farthest[0] = way.max()
            else:
                np.maximum.at(farthest, owner, way)
            found = np.flatnonzero(way == farthest[owner])[::-1]
            # of several the first, which is written last
            probe = np.empty(len(farthest), dtype=np.int64)
            probe[owner[found]] = found
            probes.append(mesh.vertices[probe])
    return np.stack(probes, axis=1)


def _depth(mesh: Mesh, shell: Ints, probe: Floats) -> Ints:
    """How many times the other shells wind round each shell's points `probe`, (shells, 6, 3): (shells, 6).

    The solid angle of a triangle after A. van Oosterom and J. Strackee, The solid angle of a plane triangle,
    1983.
    """
    depth = np.zeros(probe.shape[:2], dtype=np.int64)
    low, high = probe.min(axis=1), probe.max(axis=1)
    # shells within another's box are few, and only for them there is something to find out
    for which in range(len(probe)):
        around = np.all((low <= low[which]) & (high >= high[which]), axis=1)
        around[which] = False
        if not around.any():
            continue
        faces = mesh.corners[around[shell]]
        for number, point in enumerate(probe[which]):
            a, b, c = (faces - point).swapaxes(0, 1)
            la, lb, lc = (np.linalg.norm(side, axis=1) for side in (a, b, c))
            above = _dot(a, np.cross(b, c))
            below = la * lb * lc + _dot(a, b) * lc + _dot(b, c) * la + _dot(c, a) * lb
            depth[which, number] = round(float(np.arctan2(above, below).sum()) / (2 * np.pi))
    return depth


def _dot(a: Floats, b: Floats) -> Floats:
    return np.einsum("ij,ij->i", a, b)


def _count(number: int, one: str, many: str) -> str:
    return f"{number:,} {one if number == 1 else many}"


def _where(points: Floats) -> str:
    """Where `points`, (n, 3), are, in words."""
    first = points[np.lexsort(points.T)[0]]
    place = "({:.4g}, {:.4g}, {:.4g})".format(*first)
    return f"at {place}" if len(points) == 1 else f"the first near {place}"
