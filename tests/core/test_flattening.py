"""Regions laid flat: true to length where they can be, cut open only where they must be."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from bubble_pattern_addon.core import flattening
from bubble_pattern_addon.core.drawing import make_drawing
from bubble_pattern_addon.core.errors import RegionError
from bubble_pattern_addon.core.flattening import Flat, flatten
from bubble_pattern_addon.core.mesh import Bools, Mesh
from bubble_pattern_addon.core.region import Region, make_region
from bubble_pattern_addon.core.seams import corner_vertices

from .bases import as_mesh, grid, height
from .patterns import spread


def region_of(body: trimesh.Trimesh, chosen: Bools | None = None) -> Region:
    mesh = as_mesh(body)
    return make_region(mesh, np.ones(len(mesh.triangles), dtype=bool) if chosen is None else chosen)


def turned(body: trimesh.Trimesh, seed: int) -> trimesh.Trimesh:
    body.apply_transform(
        trimesh.transformations.random_rotation_matrix(np.random.default_rng(seed).random(3))
    )
    return body


def tube(radius: float, length: float, sides: int, fine: int = 0, seed: int | None = None) -> Region:
    body = trimesh.creation.cylinder(radius, length, sections=sides)
    wall = np.abs(body.face_normals[:, 2]) < 0.5
    body.update_faces(wall)
    for _ in range(fine):
        body = body.subdivide()
    return region_of(body if seed is None else turned(body, seed))


def frustum(slope: float, sides: int = 36) -> Region:
    """The wall of a cone of 2 units' base radius, cut off halfway up; slope: height over radius."""
    angle = 2 * np.pi / sides * np.arange(sides)
    ring = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    points = np.concatenate([2 * ring, ring + [0, 0, slope]])
    at, after = np.arange(sides), (np.arange(sides) + 1) % sides
    faces = [np.stack([at, after, after + sides], axis=1), np.stack([at, after + sides, at + sides], axis=1)]
    return region_of(trimesh.Trimesh(points, np.concatenate(faces), process=False))


def panel(island: bool = False, count: int = 24) -> Region:
    line = np.linspace(-12, 12, count + 1)
    x, y = (side.ravel() for side in np.meshgrid(line, line, indexing="ij"))
    body = trimesh.Trimesh(np.stack([x, y, height(x, y)], axis=1), grid(count, count), process=False)
    chosen = np.linalg.norm(body.triangles_center[:, :2] - [3, 2], axis=1) > (3 if island else 0)
    return region_of(body, chosen)


def area_of(flat: Flat) -> float:
    a, b, c = flat.corners.T
    return float(((b - a).conj() * (c - a)).imag.sum() / 2)


def euler(region: Region, cuts: Bools) -> int:
    """V - E + F of the region after cutting."""
    joined = (region.neighbours >= 0) & ~cuts
    vertices = int(corner_vertices(region, joined).max()) + 1
    return vertices - (joined.size - joined.sum() // 2) + len(joined)


@settings(max_examples=6, derandomize=True, deadline=None)
@given(
    radius=st.floats(0.01, 500),
    length=st.floats(0.2, 8),
    sides=st.integers(5, 60),
    fine=st.integers(0, 1),
    seed=st.integers(0, 99),
)
def test_a_tube_comes_out_true_to_length(
    radius: float, length: float, sides: int, fine: int, seed: int
) -> None:
    region = tube(radius, length * radius, sides, fine, seed)
    flat = flatten(region)
    assert flat.stretch == pytest.approx(1, abs=1e-7)
    assert area_of(flat) == pytest.approx(region.area, rel=1e-7)
    assert euler(region, flat.cuts) == 1
    # the ends are straight lines as long as the sides of the polygon together
    around = 2 * sides * radius * np.sin(np.pi / sides)
    drawing = make_drawing(region, spread(region, 5))
    assert sum(line_length(line.points) for line in drawing.boundary) == pytest.approx(2 * around, rel=1e-6)


def line_length(points: np.ndarray) -> float:
    return float(np.linalg.norm(np.diff(points, axis=0), axis=1).sum())


def test_a_tube_lies_straight_with_its_axis_upright_or_across() -> None:
    for axis, (width, tall) in enumerate([(40.0, None), (None, 40.0), (None, 40.0)]):
        region = tube(10, 40, 64, 2)
        base = Mesh(np.roll(region.base.vertices, axis + 1, axis=1), region.base.triangles)
        region = make_region(base, np.ones(len(base.triangles), dtype=bool))
        drawing = make_drawing(region, spread(region, 3, size=0.1))
        points = np.concatenate([line.points for line in drawing.boundary])
        around = 64 * 20 * np.sin(np.pi / 64)
        size = np.ptp(points, axis=0)
        assert size == pytest.approx([width or around, tall or around], rel=1e-6)


@pytest.mark.parametrize("slope", [0.3, 1.0, 3.0, 10.0])
def test_a_cone_unrolls_to_a_sector(slope: float) -> None:
    region = frustum(slope)
    flat = flatten(region)
    assert flat.stretch == pytest.approx(1, abs=1e-7)
    assert euler(region, flat.cuts) == 1


def test_a_box_unfolds_along_its_edges() -> None:
    region = region_of(trimesh.creation.box((10, 20, 30)).subdivide().subdivide())
    flat = flatten(region)
    assert flat.stretch == pytest.approx(1, abs=1e-7)
    assert area_of(flat) == pytest.approx(region.area)
    row, corner = np.nonzero(flat.cuts)
    bend = np.einsum("nc,nc->n", region.normals[row], region.normals[region.neighbours[row, corner]])
    assert bend.max() < 1e-9


def test_what_is_flat_is_not_cut() -> None:
    body = trimesh.creation.annulus(5, 20, 3, sections=48)
    region = region_of(turned(body.copy(), 4), body.face_normals[:, 2] > 0.5)
    flat = flatten(region)
    assert not flat.cuts.any()
    assert flat.stretch == pytest.approx(1, abs=1e-9)


@pytest.mark.parametrize("island", [False, True])
def test_a_panel_curved_both_ways_is_stretched_little_and_not_cut(island: bool) -> None:
    region = panel(island)
    flat = flatten(region)
    assert not flat.cuts.any()
    assert 1.001 < flat.stretch < 1.04
    assert area_of(flat) == pytest.approx(region.area, rel=5e-3)


def test_the_search_takes_stretch_away_from_the_conformal_map() -> None:
    body = trimesh.creation.icosphere(3, 10)
    region = region_of(body, body.triangles_center[:, 2] > 0)
    best = flatten(region).stretch
    rounds, flattening.ROUNDS = flattening.ROUNDS, 0
    try:
        assert flatten(region).stretch - 1 > 1.5 * (best - 1)
    finally:
        flattening.ROUNDS = rounds


@pytest.mark.parametrize(
    ("body", "largest"),
    [
        (trimesh.creation.icosphere(3, 10), 3.1),
        (trimesh.creation.torus(20, 6, major_sections=32, minor_sections=16), 1.6),
        (trimesh.creation.icosphere(0, 1), 1.0001),
        (trimesh.creation.box((1, 1, 1)), 1.0001),
    ],
)
def test_closed_surfaces_are_cut_open_to_discs(body: trimesh.Trimesh, largest: float) -> None:
    region = region_of(body)
    flat = flatten(region)
    assert euler(region, flat.cuts) == 1
    assert flat.stretch < largest
    assert np.array_equal(flat.cuts, flat.cuts & (region.neighbours >= 0))


def test_parts_are_laid_side_by_side() -> None:
    two = trimesh.util.concatenate([trimesh.creation.box((4, 4, 1)), trimesh.creation.box((6, 2, 1))])
    two.vertices[8:] += [0, 0, 5]
    region = region_of(two, two.face_normals[:, 2] > 0.5)
    drawing = make_drawing(region, spread(region, 8, size=0.05))
    first, second = sorted(drawing.boundary, key=lambda line: line.points[:, 0].min())
    assert np.ptp(first.points, axis=0) == pytest.approx([4, 4])
    assert np.ptp(second.points, axis=0) == pytest.approx([6, 2])
    assert second.points[:, 0].min() == pytest.approx(first.points[:, 0].max() + 0.05 * 6)


def test_a_ramp_that_winds_twice_is_refused() -> None:
    turn, radius = np.linspace(0, 4 * np.pi, 97), np.linspace(8, 20, 9)
    t, r = (side.ravel() for side in np.meshgrid(turn, radius, indexing="ij"))
    points = np.stack([r * np.cos(t), r * np.sin(t), 0.4 * t], axis=1)
    region = region_of(trimesh.Trimesh(points, grid(96, 8), process=False))
    pattern = spread(region, 600, size=0.8)
    with pytest.raises(RegionError, match="lie over itself"):
        make_drawing(region, pattern)


def crumpled() -> Region:
    """A sheet with deep, sharp dents."""
    line = np.linspace(-12, 12, 25)
    x, y = (side.ravel() for side in np.meshgrid(line, line, indexing="ij"))
    z = 4 * np.random.default_rng(0).standard_normal(x.size)
    return region_of(trimesh.Trimesh(np.stack([x, y, z], axis=1), grid(24, 24), process=False))


def test_a_crumpled_sheet_is_laid_flat_by_cuts_to_its_corners() -> None:
    flat = flatten(crumpled())
    assert flat.cuts.any()
    assert flat.stretch < 1.2


def test_a_fold_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(
        flattening,
        "find_cuts",
        lambda region, all_the_way=False: np.zeros_like(region.neighbours, dtype=bool),
    )
    with pytest.raises(RegionError, match="without folds"):
        flatten(crumpled())
