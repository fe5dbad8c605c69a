"""Base geometries and target regions to test and measure on: those with known figures, and awkward ones."""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import manifold3d
import numpy as np
from scipy.spatial import Delaunay, cKDTree

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

from bubble_pattern_addon.core.mesh import Bools, Floats, Ints, Mesh

PANEL_SIZE = 200.0
TRAPEZOID = np.array([[-60.0, -40.0], [60.0, -40.0], [45.0, 40.0], [-45.0, 40.0]])
TRAPEZOID_RADIUS = 12.0
ISLAND = (20.0, 5.0, 15.0)
"""Centre and radius of the trapezoid's island."""


JAGGED_RADIUS = 40.0
"""Of the discs with a jagged boundary, whose faces are about one long."""


@dataclass(frozen=True)
class Shape:
    """A base geometry, the (T,) mask of its target region and a pitch that suits it."""

    mesh: Mesh
    selected: Bools
    pitch: float


# --- outlines: lists of loops (k, 2), the outer one counter-clockwise, islands clockwise


def circle(radius: float, centre: tuple[float, float] = (0.0, 0.0), sides: int = 360) -> Floats:
    """Points of a circle, counter-clockwise, (sides, 2)."""
    angle = np.arange(sides) * (2 * np.pi / sides)
    return np.array(centre) + radius * np.stack([np.cos(angle), np.sin(angle)], axis=1)


def rounded(corners: Floats, radius: float, sides: int = 60) -> Floats:
    """A convex counter-clockwise polygon (k, 2) with every corner rounded by an arc of `sides` segments."""
    before = corners - np.roll(corners, 1, axis=0)
    before /= np.linalg.norm(before, axis=1, keepdims=True)
    after = np.roll(before, -1, axis=0)
    arcs = []
    for corner, ahead, behind in zip(corners, after, -before, strict=True):
        inward = ahead + behind
        half = np.arccos(np.clip(ahead @ behind, -1, 1)) / 2
        centre = corner + inward / np.linalg.norm(inward) * radius / np.sin(half)
        first = np.arctan2(behind[0], -behind[1])  # the arc starts square to the side that comes in
        turn = np.pi - 2 * half
        angle = first + np.linspace(0, turn, sides + 1)
        arcs.append(centre + radius * np.stack([np.cos(angle), np.sin(angle)], axis=1))
    return np.concatenate(arcs)


def trapezoid_outline() -> list[Floats]:
    """The rounded trapezoid with an island on which the figures to beat were measured."""
    x, y, radius = ISLAND
    return [rounded(TRAPEZOID, TRAPEZOID_RADIUS), circle(radius, (x, y))[::-1]]


def rectangle_outline(width: float, height: float, centre: tuple[float, float] = (0.0, 0.0)) -> list[Floats]:
    """One rectangle about `centre`."""
    half = np.array([width, height]) / 2
    return [np.array(centre) + half * np.array([[-1.0, -1], [1, -1], [1, 1], [-1, 1]])]


def l_outline() -> list[Floats]:
    """An L with five sharp outer corners and one inner one."""
    return [np.array([[0.0, 0], [80, 0], [80, 30], [30, 30], [30, 70], [0, 70]])]


def outline_segments(outline: list[Floats]) -> Floats:
    """Edges of an outline's loops in the plane z = 0, (S, 2, 3)."""
    flat = np.concatenate([np.stack([loop, np.roll(loop, -1, axis=0)], axis=1) for loop in outline])
    return np.concatenate([flat, np.zeros((*flat.shape[:2], 1))], axis=2)


def inside_outline(points: Floats, outline: list[Floats]) -> Bools:
    """Which of the points (n, 2) an odd number of the outline's edges lie to the right of."""
    odd = np.zeros(len(points), bool)
    for loop in outline:
        for a, b in zip(loop, np.roll(loop, -1, axis=0), strict=True):
            spans = (a[1] > points[:, 1]) != (b[1] > points[:, 1])
            with np.errstate(divide="ignore", invalid="ignore"):
                x = a[0] + (points[:, 1] - a[1]) / (b[1] - a[1]) * (b[0] - a[0])
            odd ^= spans & (points[:, 0] < x)
    return odd


# --- surfaces


def coarse_sheet(outline: list[Floats]) -> Mesh:
    """An outline triangulated without inner vertices, as an n-gon face of a modeller is."""
    points = np.concatenate(outline)
    triangles = manifold3d.triangulate([np.ascontiguousarray(loop) for loop in outline])
    return Mesh(np.column_stack([points, np.zeros(len(points))]), np.asarray(triangles, np.int64))


def fine_sheet(outline: list[Floats], spacing: float) -> Mesh:
    """An outline filled with triangles of about `spacing`, as a scan or a subdivided face is."""
    rim = np.concatenate([_resampled(loop, spacing) for loop in outline])
    low, high = rim.min(axis=0), rim.max(axis=0)
    across, up = np.arange(low[0], high[0], spacing), np.arange(low[1], high[1], spacing * 0.75**0.5)
    x, y = np.meshgrid(across, up)
    x[1::2] += spacing / 2
    inner = np.stack([x.ravel(), y.ravel()], axis=1)
    inner = inner[inside_outline(inner, outline)]
    inner = inner[cKDTree(rim).query(inner)[0] > 0.7 * spacing]
    points = np.concatenate([rim, inner])
    triangles = Delaunay(points).simplices.astype(np.int64)
    triangles = triangles[inside_outline(points[triangles].mean(axis=1), outline)]
    turn = doubled_areas(points, triangles)
    triangles[turn < 0] = triangles[turn < 0][:, ::-1]
    triangles = triangles[np.abs(turn) > 1e-9 * spacing**2]
    return Mesh(np.column_stack([points, np.zeros(len(points))]), triangles)


def doubled_areas(points: Floats, triangles: Ints) -> Floats:
    """Twice the area of triangles (T, 3) on points (n, 2), (T,): below 0 where they run clockwise."""
    a, b, c = points[triangles].swapaxes(0, 1)
    return (b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]


def _resampled(loop: Floats, spacing: float) -> Floats:
    """A loop with every edge cut into pieces no longer than `spacing`."""
    pieces = []
    for a, b in zip(loop, np.roll(loop, -1, axis=0), strict=True):
        count = int(np.ceil(np.linalg.norm(b - a) / spacing))
        pieces.append(a + (b - a) * (np.arange(count) / count)[:, None])
    return np.concatenate(pieces)


def grid_sheet(u: Floats, v: Floats, surface: Callable[[Floats, Floats], Floats]) -> Mesh:
    """A surface over a grid of quads, two triangles each. u, v: (m,) and (n,); surface(u, v): (m * n, 3)."""
    columns, rows = np.meshgrid(u, v)
    vertices = surface(columns.ravel(), rows.ravel())
    corner = (np.arange(len(v) - 1)[:, None] * len(u) + np.arange(len(u) - 1)).ravel()
    first = np.stack([corner, corner + 1, corner + len(u) + 1], axis=1)
    second = np.stack([corner, corner + len(u) + 1, corner + len(u)], axis=1)
    return Mesh(vertices, np.stack([first, second], axis=1).reshape(-1, 3))


def panel_height(x: Floats, y: Floats) -> Floats:
    """The curved panel of the figures to beat."""
    return 20 * np.cos(x / 100) * np.cos(y / 100)


def panel_sheet(quads: int) -> Mesh:
    """The curved panel as a grid of quads x quads."""
    line = np.linspace(-PANEL_SIZE / 2, PANEL_SIZE / 2, quads + 1)
    return grid_sheet(line, line, lambda x, y: np.stack([x, y, panel_height(x, y)], axis=1))


def closed_sheet(mesh: Mesh) -> Mesh:
    """The mesh with vertices that coincide merged and collapsed triangles dropped: seams and poles vanish."""
    scale = np.ptp(mesh.vertices, axis=0).max()
    _, first, inverse = np.unique(
        np.round(mesh.vertices / scale, 9), axis=0, return_index=True, return_inverse=True
    )
    triangles = inverse.reshape(-1)[mesh.triangles]
    whole = (triangles != np.roll(triangles, 1, axis=1)).all(axis=1)
    return Mesh(mesh.vertices[first], triangles[whole].astype(np.int64))


def sphere_sheet(radius: float, level: int = 5) -> Mesh:
    """An icosahedron subdivided `level` times, on the sphere."""
    from trimesh.creation import icosphere

    ball = icosphere(subdivisions=level, radius=radius)
    return Mesh(np.asarray(ball.vertices, float), np.asarray(ball.faces, np.int64))


def torus_sheet(major: float, minor: float, around: int = 160, across: int = 64) -> Mesh:
    """A torus about the z axis."""

    def surface(u: Floats, v: Floats) -> Floats:
        reach = major + minor * np.cos(v)
        return np.stack([reach * np.cos(u), reach * np.sin(u), minor * np.sin(v)], axis=1)

    return closed_sheet(grid_sheet(_full_turn(around), _full_turn(across), surface))


def tube_sheet(radius: float, length: float, around: int = 96, along: int = 40) -> Mesh:
    """An open cylinder about the z axis, facing outward."""

    def surface(u: Floats, v: Floats) -> Floats:
        return np.stack([radius * np.cos(u), radius * np.sin(u), v], axis=1)

    return closed_sheet(grid_sheet(_full_turn(around), np.linspace(0, length, along + 1), surface))


def capsule_sheet(radius: float, length: float, around: int = 96, along: int = 48) -> Mesh:
    """A tube closed by half spheres."""
    polar = np.linspace(0, np.pi / 2, along // 3)
    profile = np.concatenate(
        [
            np.stack([radius * np.sin(polar), -radius * np.cos(polar)], axis=1),
            np.stack([radius * np.cos(polar), length + radius * np.sin(polar)], axis=1),
        ]
    )
    profile[[0, -1], 0] = 0.0

    def surface(u: Floats, v: Floats) -> Floats:
        reach, height = profile[v.astype(int)].T
        return np.stack([reach * np.cos(u), reach * np.sin(u), height], axis=1)

    rows = np.arange(len(profile), dtype=float)
    return closed_sheet(grid_sheet(_full_turn(around), rows, surface))


def fold_sheet(gap: float = 1.0, depth: float = 40.0, width: float = 60.0) -> Mesh:
    """A sheet folded like a hairpin, facing outward: two flat halves `gap` apart and a half round."""
    bend = np.linspace(-np.pi / 2, np.pi / 2, 13)
    profile = np.concatenate(
        [
            [[0.0, -gap / 2]],
            np.stack([depth + gap / 2 * np.cos(bend), gap / 2 * np.sin(bend)], axis=1),
            [[0.0, gap / 2]],
        ]
    )

    def surface(u: Floats, v: Floats) -> Floats:
        return np.stack([profile[v.astype(int), 0], u, profile[v.astype(int), 1]], axis=1)

    rows = np.arange(len(profile), dtype=float)
    return flipped(grid_sheet(np.linspace(0, width, 31), rows, surface))


def mixed_sheet() -> Mesh:
    """A rectangle of which one half is two large triangles' worth of n-gon and the other scan-fine."""
    fine = fine_sheet(rectangle_outline(40, 60, (20.0, 0.0)), 0.8)
    seam = np.unique(fine.vertices[np.isclose(fine.vertices[:, 0], 0.0), 1])
    left = np.concatenate([[[-40.0, 30], [-40, -30]], np.column_stack([np.zeros(len(seam)), seam])])
    coarse = coarse_sheet([left])
    return closed_sheet(joined(fine, coarse))


def pixel_disc(curved: bool, shift: float = 0.0, pitch: float = 6.0) -> Shape:
    """A disc of the squares of a grid, flat or on a cap; its middle is off a corner of them by `shift`."""
    grid = np.arange(-45.0, 46.0)
    plane = grid_sheet(grid, grid, lambda u, v: np.stack([u, v, 0 * u], axis=1))
    square = np.floor(plane.corners.mean(axis=1)[:, :2]) + 0.5
    mesh = Mesh(_raised(plane.vertices[:, :2], curved), plane.triangles)
    return Shape(mesh, np.linalg.norm(square + shift, axis=1) < JAGGED_RADIUS, pitch)


def splinter_disc(curved: bool, seed: int = 0, pitch: float = 6.0) -> Shape:
    """A disc of triangles between places at random, flat or on a cap."""
    flat = np.random.default_rng(seed).uniform(-45, 45, (9000, 2))
    triangles = Delaunay(flat).simplices.astype(np.int64)
    clockwise = doubled_areas(flat, triangles) < 0
    triangles[clockwise] = triangles[clockwise, ::-1]
    middle = flat[triangles].mean(axis=1)
    return Shape(
        Mesh(_raised(flat, curved), triangles), np.linalg.norm(middle, axis=1) < JAGGED_RADIUS, pitch
    )


def _raised(flat: Floats, curved: bool) -> Floats:
    """Places in plan on a plane or on a cap."""
    return np.column_stack([flat, -curved * (flat**2).sum(axis=1) / 180])


def joined(*meshes: Mesh) -> Mesh:
    """Several meshes as one, their vertices kept apart."""
    start = np.cumsum([0] + [len(mesh.vertices) for mesh in meshes])
    triangles = [mesh.triangles + first for mesh, first in zip(meshes, start, strict=False)]
    return Mesh(np.concatenate([mesh.vertices for mesh in meshes]), np.concatenate(triangles))


def flipped(mesh: Mesh) -> Mesh:
    """The mesh facing the other way."""
    return Mesh(mesh.vertices, mesh.triangles[:, ::-1].copy())


def _full_turn(count: int) -> Floats:
    return np.linspace(0, 2 * np.pi, count + 1)


# --- solids


def slab(sheet: Mesh, thickness: float) -> Mesh:
    """A watertight slab below an open sheet. Its first triangles are the sheet's, so they can be selected."""
    lower = flipped(sheet)
    lower = Mesh(lower.vertices - [0.0, 0.0, thickness], lower.triangles)
    start, end = boundary_edges(sheet).T
    top_start, top_end = sheet.vertices[start], sheet.vertices[end]
    drop = np.array([0.0, 0.0, -thickness])
    quads = np.stack([top_start, top_start + drop, top_end + drop, top_end], axis=1)
    wall = np.arange(4 * len(start)).reshape(-1, 4)[:, [[0, 1, 2], [0, 2, 3]]].reshape(-1, 3)
    solid = joined(sheet, lower, Mesh(quads.reshape(-1, 3), wall))
    return closed_sheet(solid)


def boundary_edges(mesh: Mesh) -> Ints:
    """Directed edges without a partner in the other direction, (E, 2)."""
    edges = mesh.triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
    size = len(mesh.vertices)
    forward, backward = edges[:, 0] * size + edges[:, 1], edges[:, 1] * size + edges[:, 0]
    return edges[~np.isin(forward, backward)]


def curved_slab(quads: int = 60, thickness: float = 3.0) -> Shape:
    """The curved panel as a slab, its upper face selected; the base of the figures for adding."""
    sheet = panel_sheet(quads)
    return _upper(slab(sheet, thickness), sheet, 6.5)


def plate(width: float, height: float, thickness: float, pitch: float) -> Shape:
    """A box of twelve triangles, its upper face (two triangles) selected."""
    sheet = coarse_sheet(rectangle_outline(width, height))
    return _upper(slab(sheet, thickness), sheet, pitch)


def thin_wall() -> Shape:
    """A plate far thinner than the pitch, both of its faces selected."""
    sheet = coarse_sheet(rectangle_outline(60, 40))
    mesh = slab(sheet, 0.6)
    return Shape(mesh, np.arange(len(mesh.triangles)) < 2 * len(sheet.triangles), 3.0)


def trapezoid_slab(pitch: float = 3.0) -> Shape:
    """The trapezoid with its island as a solid of thickness 3."""
    sheet = coarse_sheet(trapezoid_outline())
    return _upper(slab(sheet, 3.0), sheet, pitch)


def _upper(solid: Mesh, sheet: Mesh, pitch: float) -> Shape:
    return Shape(solid, np.arange(len(solid.triangles)) < len(sheet.triangles), pitch)


def _whole(mesh: Mesh, pitch: float) -> Shape:
    return Shape(mesh, np.ones(len(mesh.triangles), bool), pitch)


def parts() -> Shape:
    """Three parts in one region: a disc, a rectangle near it, and a square with room for one bubble."""
    pieces = [
        coarse_sheet([circle(20.0)]),
        coarse_sheet(rectangle_outline(30, 20, (36.0, 0.0))),
        coarse_sheet(rectangle_outline(4, 4, (0.0, 25.0))),
    ]
    return _whole(joined(*pieces), 3.0)


SHAPES: dict[str, Callable[[], Shape]] = {
    "trapezoid": lambda: _whole(coarse_sheet(trapezoid_outline()), 3.0),
    "trapezoid-fine": lambda: _whole(fine_sheet(trapezoid_outline(), 1.2), 3.0),
    "trapezoid-slab": trapezoid_slab,
    "disc": lambda: _whole(coarse_sheet([circle(4.147)]), 0.294),
    "square": lambda: _whole(coarse_sheet(rectangle_outline(8.294, 8.294)), 0.294),
    "panel": lambda: _whole(panel_sheet(100), 6.5),
    "panel-coarse": lambda: _whole(panel_sheet(16), 6.5),
    "panel-slab": curved_slab,
    "sphere": lambda: _whole(sphere_sheet(50.0), 6.0),
    "torus": lambda: _whole(torus_sheet(40.0, 15.0), 4.0),
    "tube": lambda: _whole(tube_sheet(20.0, 80.0), 3.0),
    "capsule": lambda: _whole(capsule_sheet(20.0, 60.0), 3.0),
    "l": lambda: _whole(coarse_sheet(l_outline()), 3.0),
    "strip": lambda: _whole(coarse_sheet(rectangle_outline(120, 4.5)), 3.0),
    "thin-wall": thin_wall,
    "fold": lambda: _whole(fold_sheet(), 3.0),
    "mixed": lambda: _whole(mixed_sheet(), 3.0),
    "parts": parts,
    "one": lambda: _whole(coarse_sheet(rectangle_outline(4, 4)), 3.0),
    "plate": partial(plate, 300.0, 300.0, 3.0, 2.9),
}


def main() -> None:
    """List the shapes with their sizes."""
    for name, make in SHAPES.items():
        shape = make()
        area = np.linalg.norm(shape.mesh.area_vectors[shape.selected], axis=1).sum() / 2
        chosen = Mesh(shape.mesh.vertices, shape.mesh.triangles[shape.selected])
        print(
            f"{name:15} {len(shape.mesh.triangles):6} triangles, {shape.selected.sum():6} selected, "
            f"area {area:10.3f}, open edges {len(boundary_edges(shape.mesh)):4}, "
            f"region's {len(boundary_edges(chosen)):4}, pitch {shape.pitch:g}"
        )


if __name__ == "__main__":
    main()
