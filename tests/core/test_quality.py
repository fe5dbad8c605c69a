"""Laws of the figures by which packings are judged."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays
from scipy.spatial import Voronoi
from scipy.spatial.transform import Rotation

from bubble_pattern_addon.core.distance import boundary_distance
from bubble_pattern_addon.core.mesh import Floats, Mesh
from bubble_pattern_addon.core.metric import Places
from bubble_pattern_addon.core.neighbours import REACH, neighbours
from bubble_pattern_addon.core.pattern import Pattern
from bubble_pattern_addon.core.quality import (
    measure,
    measure_points,
    min_margin,
    min_web,
    open_area,
)
from bubble_pattern_addon.core.region import Region, make_region

UP = np.array([0.0, 0.0, 1.0])
NO_BOUNDARY = np.zeros((0, 2, 3))


def lattice(columns: int, rows: int, row_height: float, shift: float) -> Floats:
    i, j = np.meshgrid(np.arange(columns), np.arange(rows))
    return np.stack([i + shift * (j % 2), j * row_height, 0.0 * i], axis=-1).reshape(-1, 3)


def hexagonal(columns: int = 20, rows: int = 20) -> Floats:
    return lattice(columns, rows, np.sqrt(0.75), 0.5)


def up(points: Floats) -> Floats:
    return np.tile(UP, (len(points), 1))


def rectangle(points: Floats, margin: float) -> Floats:
    """Corners of the rectangle `margin` outside the points' bounds, counter-clockwise, (4, 3)."""
    low, high = points.min(axis=0) - margin, points.max(axis=0) + margin
    return np.array([[low[0], low[1], 0], [high[0], low[1], 0], [high[0], high[1], 0], [low[0], high[1], 0]])


def whole(corners: Floats) -> Region:
    """The region that is one quad with these corners."""
    return make_region(Mesh(corners, np.array([[0, 1, 2], [0, 2, 3]])), np.ones(2, bool))


def frame(points: Floats, margin: float) -> Floats:
    """Segments of the rectangle `margin` outside the points' bounds."""
    corners = rectangle(points, margin)
    return np.stack([corners, np.roll(corners, -1, axis=0)], axis=1)


def plain_measure(points: Floats, segments: Floats = NO_BOUNDARY, row: int = 1):
    n = len(points)
    return measure_points(points, up(points), np.ones(n), np.full(n, row), segments)


def pairs(points: Floats, normal: Floats, pitch: Floats) -> set[tuple[int, int]]:
    near = neighbours(points, normal, pitch)
    return set(zip(near.first.tolist(), near.second.tolist(), strict=True))


def test_a_hexagonal_lattice_is_perfect():
    points = hexagonal()
    quality = plain_measure(points, frame(points, 0.5))
    assert quality.six == 1.0
    assert quality.psi6 == pytest.approx(1.0, abs=1e-9)
    assert quality.gap_cv == pytest.approx(0.0, abs=1e-9)
    assert quality.gap_min == pytest.approx(1.0)


def test_a_square_lattice_has_four_neighbours_and_no_sixfold_order():
    points = lattice(20, 20, 1.0, 0.0)
    quality = plain_measure(points, frame(points, 0.5))
    assert quality.six == 0.0
    assert quality.psi6 == pytest.approx(0.0, abs=1e-9)
    near = neighbours(points, up(points), np.ones(len(points)))
    assert np.bincount(near.first).max() == 4


def test_a_missing_bubble_leaves_six_neighbours_short_and_the_others_alone():
    points = hexagonal()
    points = np.delete(points, 10 * 20 + 10, axis=0)
    segments = frame(points, 0.5)
    interior = (boundary_distance(points, segments) > 1.25).sum()
    quality = plain_measure(points, segments)
    # the six around the hole see one another across it or not, but all the others have six
    assert 1 - 6 / interior <= quality.six < 1


def test_only_interior_bubbles_count_for_the_order():
    points = hexagonal()
    assert plain_measure(points).six < 1.0, "without a boundary the outermost bubbles count as well"
    assert plain_measure(points, frame(points, 0.5)).six == 1.0


def test_the_rim_figure_is_the_variation_of_the_first_row_only():
    points = hexagonal(12, 12)
    segments = frame(points, 0.5)
    row = np.where(boundary_distance(points, segments) < 0.6, 0, 1)
    even = measure_points(points, up(points), np.ones(len(points)), row, segments)
    assert even.rim_cv == pytest.approx(0.0, abs=1e-9)
    moved = points.copy()
    first = np.flatnonzero(row == 0)
    moved[first[1], 1] += 0.25
    distance = boundary_distance(moved, segments)[first]
    uneven = measure_points(moved, up(points), np.ones(len(points)), row, segments)
    assert uneven.rim_cv == pytest.approx(distance.std() / distance.mean())


def test_nothing_to_measure_is_nan_not_a_number_that_looks_good():
    quality = plain_measure(np.zeros((1, 3)), frame(np.zeros((1, 3)), 0.5))
    assert np.isnan([quality.six, quality.psi6, quality.gap_cv, quality.gap_min, quality.rim_cv]).all()
    empty = plain_measure(np.zeros((0, 3)))
    assert np.isnan([empty.six, empty.psi6, empty.gap_cv, empty.gap_min, empty.rim_cv]).all()


def test_a_lattice_has_no_void_and_one_bubble_less_leaves_room_for_it():
    points = hexagonal()
    segments = frame(points, 0.5)
    assert plain_measure(points, segments).void == pytest.approx(1 / np.sqrt(3))
    middle = np.linalg.norm(points - points.mean(axis=0), axis=1).argmin()
    assert plain_measure(np.delete(points, middle, axis=0), segments).void == pytest.approx(1.0)
    # in the first row, and seven together
    first = np.flatnonzero(boundary_distance(points, segments) < 0.6)[7]
    assert plain_measure(np.delete(points, first, axis=0), segments).void == pytest.approx(1.0)
    seven = np.linalg.norm(points - points[middle], axis=1) < 1.1
    assert plain_measure(points[~seven], segments).void == pytest.approx(np.sqrt(3), abs=1e-6)


def test_a_hole_in_the_region_is_no_void():
    points = hexagonal()
    middle = points[np.linalg.norm(points - points.mean(axis=0), axis=1).argmin()]
    seven = np.linalg.norm(points - middle, axis=1) < 1.1
    corners = middle + 0.9 * np.exp(-1j * np.pi / 3 * np.arange(6)).view(np.float64).reshape(-1, 2).dot(
        np.eye(2, 3)
    )
    island = np.stack([corners, np.roll(corners, -1, axis=0)], axis=1)
    around = np.concatenate([frame(points, 0.5), island])
    assert plain_measure(points[~seven], around).void < 0.75


def test_a_gap_in_a_single_row_is_a_void():
    points = np.array([[0.0, 0, 0], [1, 0, 0], [2.7, 0, 0], [3.7, 0, 0]])
    assert plain_measure(points, frame(points, 0.5)).void == pytest.approx(0.85)


def test_voids_are_seen_on_each_side_of_a_wall_and_relative_to_the_pitch_there():
    points = hexagonal(14, 14)
    middle = np.linalg.norm(points - points.mean(axis=0), axis=1).argmin()
    above = np.delete(points, middle, axis=0) + [0, 0, 0.05]
    both, normal = np.concatenate([above, points]), np.concatenate([up(above), -up(points)])
    row = np.ones(len(both), dtype=np.int64)
    assert measure_points(both, normal, np.ones(len(both)), row, NO_BOUNDARY).void == pytest.approx(1.0)
    assert measure_points(3 * both, normal, np.full(len(both), 3.0), row, NO_BOUNDARY).void == pytest.approx(
        1.0
    )


def test_two_bubbles_are_each_others_neighbours():
    points = np.array([[0.0, 0, 0], [0.9, 0, 0]])
    assert pairs(points, up(points), np.ones(2)) == {(0, 1), (1, 0)}
    assert plain_measure(points).gap_min == pytest.approx(0.9)


def test_bubbles_across_a_void_are_no_neighbours():
    points = np.array([[0.0, 0, 0], [2.0, 0, 0]])
    assert pairs(points, up(points), np.ones(2)) == set()


def test_bubbles_in_one_place_have_no_gap():
    points = np.concatenate([hexagonal(5, 5)] * 2)
    assert plain_measure(points).gap_min == 0.0


@given(st.integers(0, 2**32 - 1), st.floats(0.001, 1000), st.floats(0, 0.4))
@settings(max_examples=25)
def test_figures_do_not_depend_on_unit_place_or_direction(seed: int, scale: float, jitter: float):
    rng = np.random.default_rng(seed)
    points = hexagonal(14, 14)
    points[:, :2] += rng.uniform(-jitter, jitter, (len(points), 2))
    segments = frame(points, 0.5)
    row = np.where(boundary_distance(points, segments) < 0.7, 0, 1)
    turn = Rotation.random(random_state=seed % 2**31)
    shift = rng.normal(size=3) * 10

    def moved(values: Floats) -> Floats:
        return scale * (turn.apply(values.reshape(-1, 3)).reshape(values.shape) + shift)

    here = measure_points(points, up(points), np.ones(len(points)), row, segments)
    there = measure_points(
        moved(points), turn.apply(up(points)), np.full(len(points), scale), row, moved(segments)
    )
    for name in ("six", "psi6", "gap_cv", "gap_min", "rim_cv", "void"):
        assert getattr(there, name) == pytest.approx(getattr(here, name), rel=1e-6, abs=1e-8), name


@given(st.integers(0, 2**32 - 1), st.floats(0.05, 0.6))
@settings(max_examples=25)
def test_planar_neighbours_are_the_delaunay_edges(seed: int, jitter: float):
    rng = np.random.default_rng(seed)
    points = hexagonal(24, 24)
    points[:, :2] += rng.normal(0, jitter, (len(points), 2))
    cells = Voronoi(points[:, :2])
    # cells at the rim reach beyond any horizon; of four bubbles on one circle, either diagonal is right
    core = boundary_distance(points, frame(points, 0.0)) > 4
    ends = points[cells.ridge_points]
    short = np.linalg.norm(ends[:, 0] - ends[:, 1], axis=1) < REACH
    keep = short & core[cells.ridge_points].all(axis=1)
    start, end = np.array(cells.ridge_vertices)[keep].T
    clear = np.linalg.norm(cells.vertices[start] - cells.vertices[end], axis=1) > 1e-5
    edges = np.sort(cells.ridge_points[keep], axis=1)
    found = {(i, j) for i, j in pairs(points, up(points), np.ones(len(points))) if core[i] and core[j]}
    assert all((j, i) in found for i, j in found)
    ascending = {(i, j) for i, j in found if i < j}
    assert {tuple(edge) for edge in edges[clear].tolist()} <= ascending
    assert ascending <= {tuple(edge) for edge in edges.tolist()}


def test_neighbours_on_a_sphere_obey_euler():
    """A triangulated sphere has 6 n - 12 directed edges, if every bubble's star agrees with the others'."""
    n = 1000
    k = np.arange(n) + 0.5
    z, turn = 1 - 2 * k / n, np.pi * (1 + 5**0.5) * k
    ball = np.stack([np.sqrt(1 - z * z) * np.cos(turn), np.sqrt(1 - z * z) * np.sin(turn), z], axis=1)
    pitch = np.full(n, np.sqrt(4 * np.pi / n / np.sqrt(0.75)))
    near = pairs(ball, ball, pitch)
    assert len(near) == pytest.approx(6 * n - 12, abs=4)
    both_ways = sum((j, i) in near for i, j in near)
    assert both_ways >= len(near) - 4


def test_rolling_a_plane_into_a_tube_keeps_the_neighbours():
    points = hexagonal(30, 30)
    points[:, :2] += np.random.default_rng(1).normal(0, 0.08, (len(points), 2))
    radius = 8.0
    angle = points[:, 0] / radius
    rolled = np.stack([radius * np.sin(angle), points[:, 1], radius * np.cos(angle)], axis=1)
    outward = np.stack([np.sin(angle), 0 * angle, np.cos(angle)], axis=1)
    flat, curved = pairs(points, up(points), np.ones(900)), pairs(rolled, outward, np.ones(900))
    # Delaunay edges of nearly equal diagonals may flip; nothing else
    assert len(flat ^ curved) < 0.01 * len(flat)


@pytest.mark.parametrize("wall", [0.01, 0.3, 0.9])
def test_bubbles_on_the_other_side_of_a_thin_wall_are_no_neighbours(wall: float):
    front = hexagonal(10, 10)
    back = front - wall * UP + [0.3, 0.2, 0.0]
    points = np.concatenate([front, back])
    normal = np.concatenate([up(front), -up(back)])
    near = neighbours(points, normal, np.ones(200))
    assert ((near.first < 100) == (near.second < 100)).all()
    assert measure_points(
        points, normal, np.ones(200), np.ones(200, int), NO_BOUNDARY
    ).gap_min == pytest.approx(1)


def test_bubbles_on_fins_that_face_the_same_way_are_no_neighbours():
    lower = hexagonal(8, 8)
    points = np.concatenate([lower, lower + 0.8 * UP])
    near = neighbours(points, up(points), np.ones(128))
    assert ((near.first < 64) == (near.second < 64)).all()


def test_bubbles_on_either_side_of_a_box_edge_are_neighbours():
    points = np.array([[0.0, 0, -0.5], [-0.5, 0, 0]])
    assert pairs(points, np.array([[1.0, 0, 0], [0, 0, 1.0]]), np.ones(2)) == {(0, 1), (1, 0)}


def segment_distance(point: Floats, a: Floats, b: Floats) -> float:
    along = b - a
    length = along @ along
    share = 0.0 if length == 0 else float(np.clip((point - a) @ along / length, 0, 1))
    return float(np.linalg.norm(point - a - share * along))


coordinate = st.floats(-100, 100, allow_nan=False, width=32)


@given(
    arrays.arrays(float, st.tuples(st.integers(1, 8), st.just(3)), elements=coordinate),
    arrays.arrays(float, st.tuples(st.integers(1, 30), st.just(2), st.just(3)), elements=coordinate),
)
@settings(max_examples=100)
def test_boundary_distance_is_exact(points: Floats, segments: Floats):
    expected = [min(segment_distance(point, a, b) for a, b in segments) for point in points]
    np.testing.assert_allclose(boundary_distance(points, segments), expected, rtol=1e-9, atol=1e-9)


def test_boundary_distance_from_the_middle_of_a_fine_circle_and_far_outside_it():
    angle = np.linspace(0, 2 * np.pi, 2001)
    ring = 10 * np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    segments = np.stack([ring[:-1], ring[1:]], axis=1)
    points = np.array([[0.0, 0, 0], [1e-9, 0, 0], [1e6, 0, 0], [0, 0, 24]])
    np.testing.assert_allclose(boundary_distance(points, segments), [10, 10, 1e6 - 10, 26], rtol=2e-6)


def test_a_closed_surface_has_no_boundary_distance():
    assert np.isinf(boundary_distance(np.zeros((3, 3)), NO_BOUNDARY)).all()


@dataclass(frozen=True)
class Case:
    pattern: Pattern
    region: Region


@pytest.fixture
def case() -> Case:
    """Three bubbles in a row on a rectangle of 10 by 4."""
    region = whole(np.array([[0.0, 0, 0], [10, 0, 0], [10, 4, 0], [0, 4, 0]]))
    position = np.array([[2.0, 2, 0], [5.0, 2, 0], [8.5, 2, 0]])
    places = Places(position, np.zeros(3, np.int64), np.tile([1.0, 0, 0], (3, 1)))
    axis = np.tile([1.0, 0, 0], (3, 1))
    diameter = np.array([1.0, 2.0, 1.5])
    row = np.zeros(3, np.int64)
    return Case(Pattern(places, up(position), axis, np.full(3, 3.0), diameter, row), region)


def test_the_smallest_web_is_between_circles(case: Case):
    assert min_web(case.pattern) == pytest.approx(3 - 1.5)
    assert min_web(replace(case.pattern, diameter=np.full(3, 3.2))) == pytest.approx(-0.2)


def test_one_feature_has_no_web(case: Case):
    assert min_web(alone(case.pattern, 0)) == np.inf


def alone(pattern: Pattern, i: int) -> Pattern:
    places = Places(pattern.position[[i]], pattern.places.triangle[[i]], pattern.places.barycentric[[i]])
    fields = {name: getattr(pattern, name)[[i]] for name in ("normal", "tangent", "pitch", "diameter", "row")}
    return Pattern(places=places, **fields)


def test_the_smallest_margin_is_from_a_circle_to_the_boundary(case: Case):
    assert min_margin(case.pattern, case.region) == pytest.approx(1.5 - 0.75)


def test_without_boundary_the_margin_is_endless(case: Case):
    corners = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    tetrahedron = Mesh(corners, np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]]))
    assert min_margin(case.pattern, make_region(tetrahedron, np.ones(4, bool))) == np.inf


def test_open_area_is_the_share_of_the_circles(case: Case):
    assert open_area(case.pattern, case.region) == pytest.approx(np.pi / 4 * (1 + 4 + 2.25) / 40)


def test_measuring_a_pattern_takes_the_region_and_the_rows_from_it(case: Case):
    points = hexagonal(12, 12)
    region = whole(rectangle(points, 0.5))
    n = len(points)
    row = np.where(boundary_distance(points, region.boundary_segments) < 0.6, 0, 1)
    places = Places(points, np.zeros(n, np.int64), np.tile([1.0, 0, 0], (n, 1)))
    pattern = Pattern(places, up(points), np.tile([1.0, 0, 0], (n, 1)), np.ones(n), np.full(n, 0.6), row)
    quality = measure(pattern, region)
    assert quality.six == 1.0
    assert quality.rim_cv == pytest.approx(0.0, abs=1e-9)


def test_distances_within_a_reach_are_those_without_it():
    chance = np.random.default_rng(1)
    segments = chance.uniform(-5, 5, (40, 2, 3))
    points = chance.uniform(-6, 6, (500, 3))
    full, near = boundary_distance(points, segments), boundary_distance(points, segments, 1.0)
    assert np.array_equal(near[full <= 1.0], full[full <= 1.0])
    assert (near >= full).all()
