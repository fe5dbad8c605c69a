"""Bases and patterns laid by hand, for tests of step 3 that must not depend on the packing."""

from __future__ import annotations

import numpy as np
import trimesh

from bubble_pattern_addon.core.mesh import Floats, Ints, Mesh
from bubble_pattern_addon.core.metric import Places
from bubble_pattern_addon.core.pattern import Pattern

CUBE_FACES = np.array(
    [[0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1]]
    + [[2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3]]
)


def as_mesh(body: trimesh.Trimesh) -> Mesh:
    return Mesh(np.array(body.vertices, dtype=float), np.array(body.faces, dtype=np.int64))


def halves(a: Ints, b: Ints, c: Ints, d: Ints) -> Ints:
    """Two triangles for each quad with these corners, any shape: first a b c of all, then a c d of all."""
    a, b, c, d = (corner.ravel() for corner in (a, b, c, d))
    return np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])


def grid(rows: int, columns: int) -> Ints:
    """Triangles of a grid of points, row by row: two for each of its rows x columns cells, see `halves`."""
    at = np.arange((rows + 1) * (columns + 1)).reshape(rows + 1, columns + 1)
    return halves(at[:-1, :-1], at[1:, :-1], at[1:, 1:], at[:-1, 1:])


def box(low: tuple[float, ...], high: tuple[float, ...]) -> Mesh:
    corners = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], dtype=float)
    return Mesh(np.array(low) + corners * (np.array(high) - np.array(low)), CUBE_FACES.copy())


def inside_out(mesh: Mesh) -> Mesh:
    return Mesh(mesh.vertices, mesh.triangles[:, ::-1].copy())


def together(*meshes: Mesh) -> Mesh:
    starts = np.cumsum([0, *(len(mesh.vertices) for mesh in meshes)])
    return Mesh(
        np.concatenate([mesh.vertices for mesh in meshes]),
        np.concatenate([mesh.triangles + start for mesh, start in zip(meshes, starts, strict=False)]),
    )


def moved(mesh: Mesh, matrix: Floats) -> Mesh:
    """`mesh` under a linear map (3, 3), turned right side out if that mirrors."""
    triangles = mesh.triangles[:, ::-1].copy() if np.linalg.det(matrix) < 0 else mesh.triangles
    return Mesh(mesh.vertices @ matrix.T, triangles)


def soup(mesh: Mesh) -> Mesh:
    """`mesh` as an STL file has it: every face with vertices of its own."""
    return Mesh(mesh.corners.reshape(-1, 3).copy(), np.arange(mesh.triangles.size).reshape(-1, 3))


def height(x: Floats, y: Floats) -> Floats:
    return 4 * np.cos(x / 12) * np.cos(y / 12)


def slab(count: int = 12, size: float = 24.0, thickness: float = 1.5) -> Mesh:
    """Panel curved both ways, count x count squares of two triangles; the first 2 count² triangles are its
    top.
    """
    line = np.linspace(-size / 2, size / 2, count + 1)
    x, y = (side.ravel() for side in np.meshgrid(line, line, indexing="ij"))
    top = np.stack([x, y, height(x, y)], axis=1)
    number = len(top)
    at = np.arange(number).reshape(count + 1, count + 1)
    faces = grid(count, count)
    rim = np.concatenate([at[:-1, 0], at[-1, :-1], at[:0:-1, -1], at[0, :0:-1]])
    after = np.roll(rim, -1)
    side = halves(rim, rim + number, after + number, after)
    return Mesh(
        np.concatenate([top, top - [0, 0, thickness]]),
        np.concatenate([faces, faces[:, ::-1] + number, side]),
    )


def laid(position: Floats, normal: Floats, pitch: float, diameter: float | Floats) -> Pattern:
    """A pattern at given places; nobody in step 3 asks for their triangles."""
    count = len(position)
    normal = np.broadcast_to(np.asarray(normal, dtype=float), (count, 3))
    normal = normal / np.linalg.norm(normal, axis=1)[:, None]
    helper = np.where(np.abs(normal[:, :1]) < 0.9, [[1.0, 0, 0]], [[0, 1.0, 0]])
    tangent = helper - np.einsum("ij,ij->i", helper, normal)[:, None] * normal
    tangent /= np.linalg.norm(tangent, axis=1)[:, None]
    places = Places(
        np.asarray(position, dtype=float), np.zeros(count, dtype=np.int64), np.full((count, 3), 1 / 3)
    )
    return Pattern(
        places,
        normal,
        tangent,
        np.full(count, pitch),
        np.full(count, diameter),
        np.zeros(count, dtype=np.int64),
    )


def hexagons(width: float, depth: float, pitch: float) -> Floats:
    """Rows of points in the plane z = 0 round the origin, half a pitch inside a rectangle, (n, 3)."""
    rows = np.arange(-depth / 2 + pitch / 2, depth / 2 - pitch / 2 + 1e-9, pitch * np.sqrt(3) / 2)
    line = np.arange(-width / 2 + pitch / 2, width / 2 - pitch + 1e-9, pitch)
    return np.concatenate(
        [
            np.stack([line + (k % 2) * pitch / 2, np.full_like(line, y), np.zeros_like(line)], axis=1)
            for k, y in enumerate(rows)
        ]
    )


def on_slab(base: Mesh, share: float = 0.7, count: int = 12) -> Pattern:
    """A feature on the middle of each inner square of a `slab`'s top: exactly on an edge, tilted like the
    surface.
    """
    inner = np.arange(count * count).reshape(count, count)[1:-1, 1:-1].ravel()
    a, _, c = base.corners[inner].swapaxes(0, 1)
    normal = base.area_vectors[inner] + base.area_vectors[inner + count * count]
    pitch = float(np.abs(c - a)[:, 0].min())
    return laid((a + c) / 2, normal, pitch, share * pitch)


def polygon_area(diameter: float, sides: int) -> float:
    """Area of a regular polygon whose corners lie on a circle."""
    return sides / 2 * (diameter / 2) ** 2 * np.sin(2 * np.pi / sides)
