"""Other programs' arrangements of points on the benchmark's regions, timed: the peers of a packing.

gmsh and Instant Meshes are installed by the extra `benchmark`; what is not installed raises ImportError.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from bubble_pattern_addon.core.distance import boundary_distance
from bubble_pattern_addon.core.mesh import Floats, Mesh
from bubble_pattern_addon.terminal import silenced
from scripts.shapes import ISLAND, TRAPEZOID, TRAPEZOID_RADIUS, inside_outline, outline_segments

NEAR_ENOUGH = 0.02
"""A peer's count may differ from the wanted one by this share."""


@dataclass(frozen=True)
class Arrangement:
    """Points of a peer: (n, 3) positions and unit normals, the spacing asked for, and the seconds it took."""

    position: Floats
    normal: Floats
    spacing: float
    seconds: float


def at_count(arrange: Callable[[float], Arrangement], spacing: float, count: int) -> Arrangement:
    """The arrangement whose spacing gives `count` points within NEAR_ENOUGH, or the nearest of six tries."""
    best: Arrangement | None = None
    for _ in range(6):
        found = arrange(spacing)
        n = len(found.position)
        if best is None or abs(n - count) < abs(len(best.position) - count):
            best = found
        if abs(n - count) <= NEAR_ENOUGH * count:
            break
        spacing *= (n / count) ** 0.5
    assert best is not None
    return best


def gmsh_trapezoid(pitch: float, size: float) -> Arrangement:
    """gmsh's frontal-Delaunay mesh of the trapezoid less a rim of half a pitch; only the meshing is timed."""
    import gmsh

    if not gmsh.isInitialized():
        gmsh.initialize(interruptible=False)
        gmsh.option.setNumber("General.Terminal", 0)
    gmsh.clear()
    gmsh.option.setNumber("Mesh.Algorithm", 6)
    _draw_trapezoid(gmsh.model.geo, pitch / 2, size)
    start = time.perf_counter()
    gmsh.model.mesh.generate(2)
    seconds = time.perf_counter() - start
    tags, flat, _ = gmsh.model.mesh.getNodes()
    used = np.concatenate(gmsh.model.mesh.getElements(2)[2])
    position = flat.reshape(-1, 3)[np.isin(tags, used)]
    return Arrangement(position, np.tile([0.0, 0.0, 1.0], (len(position), 1)), size, seconds)


def _draw_trapezoid(geometry: Any, inset: float, size: float) -> None:
    """The trapezoid of the figures to beat with true arcs, everything `inset` inside its boundary."""
    along = np.roll(TRAPEZOID, -1, axis=0) - TRAPEZOID
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    before = np.roll(along, 1, axis=0)

    def point(place: Floats) -> int:
        return geometry.addPoint(place[0], place[1], 0.0, size)

    starts, centres, ends = [], [], []
    for corner, out, into in zip(TRAPEZOID, along, before, strict=True):
        half = np.arccos(np.clip(out @ -into, -1, 1)) / 2
        middle = (out - into) / np.linalg.norm(out - into)
        centre = corner + middle * TRAPEZOID_RADIUS / np.sin(half)
        reach = TRAPEZOID_RADIUS - inset
        starts.append(point(centre + reach * np.array([into[1], -into[0]])))
        ends.append(point(centre + reach * np.array([out[1], -out[0]])))
        centres.append(point(centre))
    outer = []
    for i in range(4):
        outer.append(geometry.addCircleArc(starts[i], centres[i], ends[i]))
        outer.append(geometry.addLine(ends[i], starts[(i + 1) % 4]))
    x, y, radius = ISLAND
    radius += inset
    middle = point(np.array([x, y]))
    round_ = [
        point(np.array([x + radius * c, y + radius * s])) for c, s in ((1, 0), (0, 1), (-1, 0), (0, -1))
    ]
    island = [geometry.addCircleArc(round_[i], middle, round_[(i + 1) % 4]) for i in range(4)]
    geometry.addPlaneSurface([geometry.addCurveLoop(outer), geometry.addCurveLoop(island)])
    geometry.synchronize()


def instant_meshes(mesh: Mesh, spacing: float, follow_boundary: bool = True) -> Arrangement:
    """Instant Meshes' triangles (6-RoSy orientation, 3-PoSy position field) on an oriented mesh."""
    from pynanoinstantmeshes import remesh

    vertices = mesh.vertices.astype(np.float32)
    faces = mesh.triangles.astype(np.uint32)
    with silenced():
        start = time.perf_counter()
        found, triangles = remesh(
            vertices,
            faces,
            -1,
            rosy=6,
            posy=3,
            scale=spacing,
            align_to_boundaries=follow_boundary,
            deterministic=True,
        )
        seconds = time.perf_counter() - start
    position, triangles = found.astype(float), triangles.astype(np.int64)
    corners = position[triangles]
    area = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normal = np.zeros_like(position)
    np.add.at(normal, triangles.ravel(), np.repeat(area, 3, axis=0))
    length = np.linalg.norm(normal, axis=1)
    used = length > 0
    return Arrangement(position[used], normal[used] / length[used, None], spacing, seconds)


def clipped_grid(outline: list[Floats], pitch: float) -> Arrangement:
    """A hexagonal grid less what is nearer than half a pitch to the outline: a CAD program's fill pattern."""
    start = time.perf_counter()
    low = np.concatenate(outline).min(axis=0)
    high = np.concatenate(outline).max(axis=0)
    middle, reach = (low + high) / 2, (high - low) / 2
    columns = np.arange(-np.ceil(reach[0] / pitch), np.ceil(reach[0] / pitch) + 1)
    rows = np.arange(-np.ceil(reach[1] / pitch / 0.75**0.5), np.ceil(reach[1] / pitch / 0.75**0.5) + 1)
    x, y = np.meshgrid(columns, rows)
    x = x + 0.5 * (y % 2)
    grid = middle + pitch * np.stack([x.ravel(), 0.75**0.5 * y.ravel()], axis=1)
    grid = grid[inside_outline(grid, outline)]
    position = np.column_stack([grid, np.zeros(len(grid))])
    position = position[boundary_distance(position, outline_segments(outline)) >= pitch / 2 * (1 - 1e-9)]
    seconds = time.perf_counter() - start
    return Arrangement(position, np.tile([0.0, 0.0, 1.0], (len(position), 1)), pitch, seconds)


def lloyd(outline: list[Floats], pitch: float, count: int, rounds: int = 100) -> Arrangement:
    """Centroidal Voronoi cells of the outline, from random points, by fine sampling."""
    random = np.random.default_rng(0)
    start = time.perf_counter()
    step = pitch / 12
    low = np.concatenate(outline).min(axis=0)
    high = np.concatenate(outline).max(axis=0)
    x, y = np.meshgrid(np.arange(low[0], high[0], step), np.arange(low[1], high[1], step))
    samples = np.stack([x.ravel(), y.ravel()], axis=1)
    samples = samples[inside_outline(samples, outline)]
    place = samples[random.choice(len(samples), count, replace=False)]
    for _ in range(rounds):
        owner = cKDTree(place).query(samples)[1]
        share = np.maximum(np.bincount(owner, minlength=count), 1)
        place = np.stack([np.bincount(owner, samples[:, axis], count) / share for axis in (0, 1)], axis=1)
    seconds = time.perf_counter() - start
    position = np.column_stack([place, np.zeros(count)])
    return Arrangement(position, np.tile([0.0, 0.0, 1.0], (count, 1)), pitch, seconds)
