"""Laws of walking on a region, and of the region itself."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bubble_pattern_addon.core.errors import RegionError
from bubble_pattern_addon.core.mesh import Mesh
from bubble_pattern_addon.core.region import Region, make_region, weld
from bubble_pattern_addon.core.surface import (
    Spots,
    make_charts,
    positions,
    smooth_normals,
    to_frame,
    to_space,
    walk,
)
from scripts.shapes import SHAPES


@cache
def region_of(name: str) -> Region:
    shape = SHAPES[name]()
    return make_region(shape.mesh, shape.selected)


def scattered(region, n: int, seed: int) -> Spots:
    chance = np.random.default_rng(seed)
    return Spots(chance.integers(0, len(region.triangles), n), chance.dirichlet([1, 1, 1], n))


@settings(max_examples=20)
@given(st.integers(0, 10**6), st.floats(0.01, 30))
def test_in_the_plane_a_walk_is_straight(seed, length):
    region = region_of("trapezoid-fine")
    charts = make_charts(region)
    start = scattered(region, 50, seed)
    angle = np.random.default_rng(seed + 1).uniform(0, 2 * np.pi, 50)
    step = length * np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    walked = walk(charts, start, to_frame(charts, start.row, step))
    left = to_space(charts, walked.arrived.row, walked.left)
    gone = positions(charts, walked.arrived) - positions(charts, start)
    assert np.abs(gone + left - step).max() < 1e-9
    assert walked.arrived.barycentric.min() > -1e-11
    assert walked.arrived.barycentric.sum(axis=1) == pytest.approx(1)


@pytest.mark.parametrize("name", ["sphere", "torus", "tube", "panel"])
def test_walking_there_and_back_leads_home(name):
    region = region_of(name)
    charts = make_charts(region)
    start = scattered(region, 400, 3)
    step = 7.0 * np.exp(1j * np.random.default_rng(4).uniform(0, 2 * np.pi, 400))
    there = walk(charts, start, step)
    whole = there.left == 0
    home = walk(charts, there.arrived, -there.carried)
    away = np.linalg.norm(positions(charts, home.arrived) - positions(charts, start), axis=1)
    assert whole.mean() > 0.8
    assert away[whole].max() < 1e-8


def test_a_walk_stops_at_the_boundary_and_says_what_is_left():
    region = region_of("disc")
    charts = make_charts(region)
    start = scattered(region, 200, 1)
    walked = walk(charts, start, np.full(200, 100.0 + 0j))
    radius = np.linalg.norm(positions(charts, walked.arrived)[:, :2], axis=1)
    assert (np.abs(walked.left) > 90).all()
    assert radius == pytest.approx(4.147, rel=1e-3)


def test_a_walk_round_a_tube_closes():
    region = region_of("tube")
    charts = make_charts(region)
    start = scattered(region, 100, 8)
    points = positions(charts, start)
    axis = np.eye(3)[int(np.argmax(np.ptp(region.corners.reshape(-1, 3), axis=0)))]
    around = np.cross(region.normals[start.row], axis)
    ring = region.base.vertices[region.loops[0]]
    circumference = np.linalg.norm(np.roll(ring, -1, 0) - ring, axis=1).sum()
    walked = walk(charts, start, to_frame(charts, start.row, around * circumference))
    assert np.linalg.norm(positions(charts, walked.arrived) - points, axis=1).max() < 1e-6 * circumference


def test_loops_have_the_region_on_their_left():
    region = region_of("trapezoid")
    assert len(region.loops) == 2
    areas = []
    for loop in region.loops:
        x, y = region.base.vertices[loop][:, :2].T
        areas.append(0.5 * float((x * np.roll(y, -1) - np.roll(x, -1) * y).sum()))
    assert sum(areas) == pytest.approx(region.area)
    assert sorted(np.sign(areas)) == [-1, 1]


def test_welding_joins_equal_vertices_and_keeps_the_triangles():
    shape = SHAPES["sphere"]()
    soup = Mesh(shape.mesh.corners.reshape(-1, 3), np.arange(3 * len(shape.mesh.triangles)).reshape(-1, 3))
    welded = weld(soup)
    assert len(welded.vertices) == len(shape.mesh.vertices)
    assert np.array_equal(welded.corners, shape.mesh.corners)
    assert not make_region(soup, np.ones(len(soup.triangles), bool)).loops


def test_smooth_normals_of_a_sphere_point_outward_and_a_cube_keeps_its_edges():
    region = region_of("sphere")
    charts = make_charts(region)
    spots = scattered(region, 300, 2)
    points = positions(charts, spots)
    outward = points / np.linalg.norm(points, axis=1, keepdims=True)
    assert (smooth_normals(region, spots) * outward).sum(1).min() > 0.9999
    corners = np.array([[x, y, z] for x in (0.0, 1) for y in (0.0, 1) for z in (0.0, 1)])
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    triangles = np.array([t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))])
    cube = make_region(Mesh(corners, triangles), np.ones(12, bool))
    spots = scattered(cube, 300, 2)
    assert np.allclose(smooth_normals(cube, spots), cube.normals[spots.row])


def test_bad_regions_are_refused():
    shape = SHAPES["square"]()
    with pytest.raises(RegionError, match="empty"):
        make_region(shape.mesh, np.zeros(len(shape.mesh.triangles), bool))
    broken = shape.mesh.vertices.copy()
    broken[0, 0] = np.nan
    with pytest.raises(RegionError, match="not a number"):
        make_region(Mesh(broken, shape.mesh.triangles), shape.selected)
    flat = np.concatenate([shape.mesh.triangles, [[0, 1, 1]]])
    with pytest.raises(RegionError, match="no area"):
        make_region(Mesh(shape.mesh.vertices, flat), np.ones(len(flat), bool))


def test_the_frames_do_not_hang_on_where_in_memory_they_are_made():
    """With numpy 1 a product of complex columns does."""
    shape = SHAPES["panel"]()
    region = make_region(shape.mesh, np.arange(len(shape.mesh.triangles)) < 100)
    chance = np.random.default_rng(0)
    alive: list[object] = []
    found = set()
    for _ in range(300):
        alive.append(np.empty(chance.integers(1, 800), dtype=np.complex128))
        alive.append(make_charts(region))
        found.add(alive[-1].gradients.tobytes())
        alive = alive[-40:]
    assert len(found) == 1
