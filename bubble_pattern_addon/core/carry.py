"""What of the base is found again in the part, and how values on the base's corners come along."""

from __future__ import annotations

import numpy as np

from .mesh import Bools, Floats, Ints, Mesh


def same_places(known: Floats, points: Floats) -> tuple[Ints, Ints]:
    """Row of `known`, (m, 3), at exactly each of its own places, (m,), and of `points`, (n, 3): (n,), -1
    where there is none.

    Of several known rows at one place always the same one is taken.
    """
    keys = _place_keys(known)
    order = np.argsort(keys, kind="stable")
    ranked = keys[order]

    def find(places: Floats, asked: np.ndarray) -> Ints:
        """Row of `known` at each of `places`, (n, 3), whose keys are `asked`, (n,): (n,), -1 for none."""
        rank = np.minimum(np.searchsorted(ranked, asked), len(known) - 1)
        found = np.flatnonzero(ranked[rank] == asked)
        row = order[rank[found]]
        same = (known[row] == places[found]).all(axis=1)
        rows = np.full(len(places), -1)
        rows[found[same]] = row[same]
        return rows

    return find(known, keys), find(points, _place_keys(points))


def _place_keys(points: Floats) -> np.ndarray:
    """A number per place, equal for equal places, (n,) uint64; adding 0 makes -0 and 0 the same place."""
    bits = (points + 0.0).view(np.uint64)
    return (
        bits[:, 0] * np.uint64(0x9E3779B97F4A7C15)
        + (bits[:, 1] ^ (bits[:, 1] >> np.uint64(29))) * np.uint64(0xBF58476D1CE4E5B9)
        + (bits[:, 2] ^ (bits[:, 2] >> np.uint64(31))) * np.uint64(0x94D049BB133111EB)
    )


def whole_faces(triangles: Ints, name: Ints, face: Ints, base: Ints) -> tuple[Bools, Ints]:
    """Which `triangles` of a part, (F, 3), are whole triangles of `base`, (T, 3), and by how many places
    those must be turned to have their corners in the base's order, (F,), 0 for the others.

    name: (V',) what each vertex of the part is called in `base`, below 0 for new ones; face: (F,) triangle of
    the base each of the triangles lies on
    """
    alone = np.flatnonzero(np.bincount(face, minlength=len(base))[face] == 1)
    a, b, c = name[triangles[alone]].T
    first, second, third = base[face[alone]].T
    whole, turn = np.zeros(len(face), dtype=bool), np.zeros(len(face), dtype=np.int64)
    for places, (one, two, three) in enumerate(((a, b, c), (b, c, a), (c, a, b))):
        match = alone[(one == first) & (two == second) & (three == third)]
        whole[match], turn[match] = True, places
    return whole, turn


def turned(triangles: Ints, turn: Ints) -> Ints:
    """`triangles`, (T, 3), with the corners of the first moved up by `turn` places, (F,) with F up to T."""
    moved = triangles.copy()
    for places in (1, 2):
        some = np.flatnonzero(turn == places)
        moved[some] = np.roll(triangles[some], -places, axis=1)
    return moved


def drift(part: Mesh, face: Ints, named: Ints, changed: Ints, base: Mesh) -> float:
    """How far the surface may have moved where the part has the faces `changed` of `base`, (k,), in other
    pieces than the base has.

    face: (F,) triangle of the base each of the first triangles of the part lies on; named: (V',) vertex of
    the base at each of the part's, below 0 for new ones. The largest of: how far the pieces' corners lie off
    the face's plane, the width of what they miss of its area or add to it, the width of a face without any
    piece, and how far a corner that is not the base's is from the face's own: where a rim goes right through
    a corner of the base, the boolean may put the rim's corner in its place, a last bit beside it.
    """
    asked = np.full(len(base.triangles), -1)
    asked[changed] = np.arange(len(changed))
    piece = np.flatnonzero(asked[face] >= 0)
    owner = asked[face[piece]]
    pieces, faces = Mesh(part.vertices, part.triangles[piece]), Mesh(base.vertices, base.triangles[changed])
    plane, corners = faces.area_vectors, faces.corners
    area = np.linalg.norm(plane, axis=1)
    longest = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)
    made = np.linalg.norm(pieces.area_vectors, axis=1)
    covered = np.bincount(owner, weights=made, minlength=len(area))
    width = np.abs(covered - area) / np.where(longest > 0, longest, 1)
    normal = plane / np.where(area > 0, area, 1)[:, None]
    offset = pieces.corners - corners[owner, :1]
    off = np.abs(np.einsum("mck,mk->mc", offset, normal[owner]))
    away = np.linalg.norm(pieces.corners[:, :, None] - corners[owner][:, None], axis=3).min(axis=2)
    new = away[named[pieces.triangles] < 0]
    return float(max(width.max(initial=0), off.max(initial=0), new.max(initial=0)))


def carry_corners(base: Mesh, part: Mesh, source: Ints, values: Floats) -> Floats:
    """Values on the corners of the base carried to the part: (T, 3, k) -> (T', 3, k), linear on each base
    triangle.

    source: (T',) triangle of the base that each triangle of the part lies on, below 0 for none: there the
    values are 0, as on the walls of features. A corner at exactly the place of a corner of its base triangle
    keeps its value bit for bit. On a base triangle without area the nearest corner's value is taken.
    """
    carried = np.zeros((len(source), 3, values.shape[2]), dtype=values.dtype)
    on_base = np.flatnonzero(source >= 0)
    share = _shares(base.corners[source[on_base]], part.corners[on_base])
    carried[on_base] = np.einsum("tij,tjk->tik", share, values[source[on_base]])
    return carried


def _shares(face: Floats, points: Floats) -> Floats:
    """Barycentric coordinates of `points`, (m, 3, 3), in the triangles `face`, (m, 3 corners, 3): (m, 3
    points, 3).
    """
    a, b, c = face.swapaxes(0, 1)
    plane = np.cross(b - a, c - a)
    size = np.einsum("ij,ij->i", plane, plane)
    flat = size <= np.finfo(float).tiny
    size = np.where(flat, 1, size)[:, None]
    offset = points - a[:, None]
    share = np.empty((len(face), 3, 3))
    share[..., 1] = np.einsum("mpk,mk->mp", offset, np.cross(c - a, plane)) / size
    share[..., 2] = np.einsum("mpk,mk->mp", offset, np.cross(plane, b - a)) / size
    share[..., 0] = 1 - share[..., 1] - share[..., 2]
    if flat.any():
        reach = np.linalg.norm(points[flat][:, :, None] - face[flat][:, None], axis=3)
        share[flat] = np.eye(3)[reach.argmin(axis=2)]
    for corner in range(3):
        same = points == face[:, corner, None]
        share[same[..., 0] & same[..., 1] & same[..., 2]] = np.eye(3)[corner]
    return share
