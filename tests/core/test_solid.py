"""Laws of step 3: what a part is, whatever the base and the pattern."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from bubble_pattern_addon.core import plan, solid, splitting
from bubble_pattern_addon.core.errors import BaseError, RecipeError
from bubble_pattern_addon.core.mesh import Mesh
from bubble_pattern_addon.core.part import Cut, Part
from bubble_pattern_addon.core.pattern import Pattern
from bubble_pattern_addon.core.progress import drive
from bubble_pattern_addon.core.recipe import Feature
from bubble_pattern_addon.core.solid import carry_corners, part_steps
from tests.core.bases import (
    box,
    hexagons,
    inside_out,
    laid,
    moved,
    on_slab,
    polygon_area,
    slab,
    soup,
    together,
)

SHARED = Path(__file__).resolve().parents[3] / "shared" / "data"
HOLE = Feature(sides=16)
UP = (0, 0, 1)


def make(base: Mesh, pattern: Pattern, feature: Feature = HOLE) -> Part:
    return drive(part_steps(base, pattern, feature))


def plate(thickness: float = 2.0) -> Mesh:
    return box((-15, -10, -thickness), (15, 10, 0))


def grid(pitch: float = 3.0, diameter: float = 1.8) -> Pattern:
    return laid(hexagons(28, 18, pitch), UP, pitch, diameter)


def assert_good(part: Part, base: Mesh, through: int) -> None:
    assert part.check.problems == ()
    assert part.check.good
    assert part.check.watertight
    assert part.check.unchanged
    assert part.check.through == through == part.pierced.sum()
    assert part.check.base_euler - part.check.euler == 2 * through
    assert part.check.bodies == part.check.base_bodies
    assert_sources(part, base)


def assert_sources(part: Part, base: Mesh) -> None:
    """Every face lies in the plane of its source and inside it; whole faces are the base's, corner for
    corner.
    """
    size = np.ptp(base.vertices, axis=0).max()
    from_base = part.source >= 0
    # a face without area has no plane: it stays as it is, or is gone
    from_base[from_base] = np.linalg.norm(base.area_vectors[part.source[from_base]], axis=1) > 0
    face, corners = base.corners[part.source[from_base]], part.mesh.corners[from_base]
    normal = base.area_vectors[part.source[from_base]]
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    for corner in range(3):
        inward = np.cross(normal, face[:, (corner + 1) % 3] - face[:, corner])
        inward /= np.linalg.norm(inward, axis=1)[:, None]
        offset = corners - face[:, corner, None]
        assert np.abs(np.einsum("mck,mk->mc", offset, normal)).max() < 1e-9 * size
        assert np.einsum("mck,mk->mc", offset, inward).min() > -1e-9 * size
    assert np.einsum("ij,ij->i", part.mesh.area_vectors[from_base], normal).min() > -1e-9 * size**2
    whole = part.untouched
    assert np.array_equal(part.mesh.corners[whole], base.corners[part.source[whole]])
    known = part.vertex >= 0
    assert np.array_equal(part.mesh.vertices[known], base.vertices[part.vertex[known]])


def test_a_through_hole_takes_two_from_euler_and_its_prism_from_the_volume():
    base, pattern = plate(), grid()
    part = make(base, pattern)
    assert_good(part, base, len(pattern))
    assert part.check.genus == len(pattern)
    assert part.check.removed_volume == pytest.approx(len(pattern) * polygon_area(1.8, 16) * 2, rel=1e-9)
    assert np.allclose(part.thickness, 2)
    assert part.failures == ()


def test_a_hole_measures_its_diameter_across_corners():
    part = make(plate(), laid([[0, 0, 0]], UP, 3, 1.8), Feature(sides=12))
    wall = part.mesh.corners[part.source == -1].reshape(-1, 3)
    reach = np.hypot(wall[:, 0], wall[:, 1])
    assert reach.max() == pytest.approx(0.9, rel=1e-12)
    assert reach.min() >= 0.9 * np.cos(np.pi / 12) - 1e-12


def test_every_wall_face_names_its_feature():
    pattern = grid()
    part = make(plate(), pattern)
    for feature in (0, 7, len(pattern) - 1):
        wall = part.mesh.corners[part.source == -1 - feature].reshape(-1, 3)
        reach = np.hypot(*(wall - pattern.position[feature])[:, :2].T)
        assert reach.min() > 0.88
        assert reach.max() == pytest.approx(0.9)
    assert set(np.unique(part.source[part.source < 0])) == set(range(-len(pattern), 0))


def test_through_holes_leave_the_far_wall_of_a_housing_alone():
    outer, inner = box((-15, -10, -20), (15, 10, 0)), box((-14, -9, -19), (14, 9, -1.5))
    base = together(outer, inside_out(inner))
    part = make(base, laid(hexagons(26, 16, 3), UP, 3, 1.8))
    assert_good(part, base, len(part.pierced))
    assert np.allclose(part.thickness, 1.5)
    assert (part.check.bodies, part.check.cavities) == (1, 0)
    low = np.flatnonzero(base.corners[..., 2].max(axis=1) <= -19)
    assert len(low) == 4
    assert np.isin(low, part.source[part.untouched]).all()


@pytest.mark.parametrize("gap", [5.0, 0.2, 1e-3])
def test_however_close_the_next_wall_is_it_stays_whole(gap):
    base = together(plate(1.0), box((-15, -10, -9), (15, 10, -1 - gap)))
    pattern = grid()
    part = make(base, pattern)
    assert_good(part, base, len(pattern))
    assert np.isin(np.arange(12, 24), part.source[part.untouched]).all()


def test_what_hangs_close_above_stays_whole():
    base = together(plate(1.0), box((-15, -10, 0.01), (15, 10, 2)))
    part = make(base, grid())
    assert_good(part, base, len(part.pierced))
    assert np.isin(np.arange(12, 24), part.source[part.untouched]).all()


def test_a_wall_that_grows_thicker_is_pierced_everywhere_to_its_own_depth():
    base = plate(1.0)
    lower = base.vertices[:, 2] < 0
    base.vertices[lower, 2] -= (base.vertices[lower, 0] + 15) / 30 * 8
    pattern = grid()
    part = make(base, pattern)
    assert_good(part, base, len(pattern))
    depth = 1 + (pattern.position[:, 0] + 15) / 30 * 8
    assert np.allclose(part.thickness, depth)
    assert part.check.removed_volume == pytest.approx(polygon_area(1.8, 16) * depth.sum(), rel=1e-9)


def test_a_next_wall_steeper_than_its_distance_is_reported_not_cut():
    near, far = plate(1.0), box((-15, -10, -30), (15, 10, -1))
    for mesh, low in ((near, -1.0), (far, -1.05)):
        back = mesh.vertices[:, 2] == (-1)
        mesh.vertices[back, 2] = low - (mesh.vertices[back, 0] + 15) * 0.9
    base = together(near, far)
    part = make(base, laid([[0, 0, 0]], UP, 3, 1.8))
    assert not part.pierced.any()
    assert "wall behind" in part.failures[0][1]
    assert part.check.euler == part.check.base_euler


def test_a_wall_too_thick_is_reported_for_each_hole_and_nothing_is_cut():
    base, pattern = plate(40.0), grid(diameter=1.0)
    part = make(base, pattern)
    assert not part.pierced.any()
    assert [feature for feature, _ in part.failures] == list(range(len(pattern)))
    assert "far side" in part.failures[0][1]
    (told,) = part.check.problems  # one reason, however many holes
    assert told.startswith(f"{len(pattern)} holes could not be added: hole 0 at ")
    assert "the first of them, finds no far side" in told
    assert part.untouched.all()
    assert np.array_equal(part.mesh.corners, base.corners)


def test_only_the_holes_that_cannot_be_are_left_out():
    step = together(box((-15, -10, -50), (0, 10, 0)), box((0, -10, -2), (15, 10, 0)))
    pattern = laid([[-7, 0, 0], [7, 0, 0]], UP, 3, 1.8)
    part = make(step, pattern)
    assert part.pierced.tolist() == [False, True]
    assert [feature for feature, _ in part.failures] == [0]


def test_blind_holes_keep_the_topology_and_take_depth_times_area():
    base, pattern = plate(), grid()
    part = make(base, pattern, Feature(depth=0.7, sides=16))
    assert_good(part, base, 0)
    assert part.check.removed_volume == pytest.approx(len(pattern) * polygon_area(1.8, 16) * 0.7, rel=1e-9)
    floor = part.mesh.corners[(part.source < 0)][..., 2].min()
    assert floor == pytest.approx(-0.7, abs=1e-12)
    assert np.allclose(part.thickness, 2)


def test_a_blind_hole_deeper_than_the_wall_is_reported():
    part = make(plate(), grid(), Feature(depth=2.0))
    assert len(part.failures) == len(part.pierced)
    assert "break through" in part.check.problems[0]
    assert part.untouched.all()


def test_holes_that_would_meet_inside_a_thick_curved_wall_are_reported():
    post = trimesh.creation.cylinder(radius=5, height=4, sections=12)
    base = Mesh(np.asarray(post.vertices, dtype=float), np.asarray(post.faces, dtype=np.int64))
    turn = (np.arange(12) + 0.5) * np.pi / 6
    outward = np.stack([np.cos(turn), np.sin(turn), np.zeros(12)], axis=1)
    pattern = laid(outward * 5 * np.cos(np.pi / 12), outward, 2.6, 1.6)
    part = make(base, pattern)
    assert len(part.failures) == 12
    assert all("another hole" in text for _, text in part.failures)
    # blind ones that end before they meet are fine
    assert_good(make(base, pattern, Feature(depth=1.0, sides=16)), base, 0)


def test_overlapping_holes_are_reported():
    part = make(plate(), laid([[0, 0, 0], [1.0, 0, 0], [6, 0, 0]], UP, 3, 1.8))
    assert [feature for feature, _ in part.failures] == [0, 1]
    assert part.pierced.tolist() == [False, False, True]


def test_holes_close_to_each_other_round_an_edge_do_not_count_as_meeting():
    outer, inner = box((-10, -10, -10), (10, 10, 10)), box((-9, -9, -9), (9, 9, 9))
    base = together(outer, inside_out(inner))
    pattern = laid([[7.2, 0, 10], [10, 0, 7.2]], [[0, 0, 1], [1, 0, 0]], 3, 2.0)
    part = make(base, pattern)
    assert_good(part, base, 2)


@pytest.mark.parametrize("position", [[14.9, 0, 0], [15, 10, 0]])
def test_a_hole_over_an_edge_where_the_surface_folds_is_reported(position):
    part = make(plate(6.0), laid([position], UP, 3, 1.8))
    assert len(part.failures) == 1
    assert "folds" in part.failures[0][1]
    assert part.untouched.all()


def test_a_hole_at_the_foot_of_a_wall_is_reported():
    foot = np.array([[0, 0], [10, 0], [10, 1], [1, 1], [1, 8], [0, 8]], dtype=float)
    front = np.column_stack([foot[:, 0], np.zeros(6), foot[:, 1]])
    back = front + [0, 10, 0]
    cap = np.array([[0, 1, 2], [0, 2, 3], [0, 3, 5], [3, 4, 5]])
    here = np.arange(6)
    there = np.roll(here, -1)
    side = np.concatenate([np.stack([here, here + 6, there + 6], 1), np.stack([here, there + 6, there], 1)])
    base = Mesh(np.concatenate([front, back]), np.concatenate([cap, cap[:, ::-1] + 6, side]))
    part = make(base, laid([[1.5, 5, 1], [5, 5, 1]], UP, 3, 1.8))
    assert [feature for feature, _ in part.failures] == [0]
    assert part.pierced.tolist() == [False, True]


def test_a_feature_off_the_surface_is_reported():
    part = make(plate(), laid([[0, 0, 0.5]], UP, 3, 1.8))
    assert "does not lie on" in part.failures[0][1]


def roof() -> Mesh:
    return Mesh(
        np.array(
            [
                [x, y, z]
                for y in (-5.0, 5.0)
                for x, z in ((-8, -4), (0, 0), (8, -4), (8, -6), (0, -2), (-8, -6))
            ]
        ),
        np.concatenate(
            [
                [[0, 4, 1], [0, 5, 4], [1, 4, 3], [1, 3, 2]],
                [[6, 7, 10], [6, 10, 11], [7, 9, 10], [7, 8, 9]],
                [[i, (i + 1) % 6, (i + 1) % 6 + 6] for i in range(6)],
                [[i, (i + 1) % 6 + 6, i + 6] for i in range(6)],
            ]
        ),
    )


def test_what_lies_over_a_roof_closer_than_the_roof_falls_is_reported_not_cut():
    lid = roof()
    lid.vertices[:, 2] += 2.05
    part = make(together(roof(), lid), laid([[0, 0, 0], [4, 0, -2]], [[0, 0, 1], [1, 0, 2]], 3, 2.0))
    assert [feature for feature, _ in part.failures] == [0]
    assert "over the surface" in part.failures[0][1]
    assert part.pierced.tolist() == [False, True]


@pytest.mark.parametrize("scale", [1e-3, 1e3])
def test_the_unit_of_length_does_not_matter(scale):
    base = moved(slab(), np.eye(3) * scale)
    pattern = on_slab(slab())
    part = make(base, laid(pattern.position * scale, pattern.normal, 2 * scale, pattern.diameter * scale))
    assert_good(part, base, len(pattern))


def test_a_gentle_crease_is_cut_like_any_other_place():
    ridge = roof()
    part = make(ridge, laid([[0, 0, 0], [0, 3, 0], [0, -3, 0]], UP, 3, 2.0))
    assert_good(part, ridge, 3)


def test_curved_slab_all_laws():
    base = slab()
    pattern = on_slab(base)
    part = make(base, pattern)
    assert_good(part, base, len(pattern))


def test_values_on_corners_come_along_linearly_and_whole_faces_exactly():
    base = slab()
    part = make(base, on_slab(base))
    rng = np.random.default_rng(5)
    matrix, shift = rng.normal(size=(3, 4)), rng.normal(size=4)
    values = base.corners @ matrix + shift
    carried = carry_corners(base, part, values)
    assert carried.shape == (len(part.source), 3, 4)
    from_base = part.source >= 0
    assert np.allclose(carried[from_base], part.mesh.corners[from_base] @ matrix + shift, atol=1e-9)
    assert np.all(carried[~from_base] == 0)
    loose = rng.normal(size=(len(base.triangles), 3, 2))
    assert np.array_equal(
        carry_corners(base, part, loose)[part.untouched], loose[part.source[part.untouched]]
    )


def test_base_faces_far_from_any_feature_come_out_identical():
    base = slab()
    pattern = on_slab(base)
    few = laid(pattern.position[[0, 44]], pattern.normal[[0, 44]], 2, 1.0)
    part = make(base, few)
    middle = base.corners.mean(axis=1)
    near = np.linalg.norm(middle[:, None] - few.position, axis=2).min(axis=1) < 4
    assert 0 < near.sum() < len(near) / 2
    kept = np.zeros(len(near), dtype=bool)
    kept[part.source[part.untouched]] = True
    assert kept[~near].all()


def test_the_flat_face_stays_flat_and_its_neighbours_whole_however_many_holes():
    base = plate()
    pattern = laid(hexagons(28, 18, 1.0), UP, 1.0, 0.5)
    assert len(pattern) > 2 * splitting.MANY  # so that both of the face's triangles are split
    part = make(base, pattern)
    assert_good(part, base, len(pattern))
    assert part.check.removed_volume == pytest.approx(len(pattern) * polygon_area(0.5, 16) * 2, rel=1e-9)
    flat = np.isin(part.source, [i for i in range(12) if np.ptp(base.corners[i, :, 2]) == 0])
    assert set(np.unique(part.mesh.corners[flat][..., 2])) == {-2.0, 0.0}
    upright = [i for i in range(12) if np.ptp(base.corners[i, :, 2]) > 0]
    assert np.isin(upright, part.source[part.untouched]).all()
    # nothing remains of the points at which the faces were split: all but the base's corners lies on the
    # holes' rims
    made = part.mesh.vertices[part.vertex < 0]
    reach = np.linalg.norm(made[:, None, :2] - pattern.position[:, :2], axis=2).min(axis=1)
    assert reach.min() > 0.25 * np.cos(np.pi / 16) - 1e-9
    assert reach.max() < 0.25 + 1e-9


def folded(depth: float) -> Mesh:
    """A plate whose upper face has a sliver folded back over its diagonal, `depth` high at its middle."""
    base = plate()
    one, other = (int(k) for k in np.flatnonzero((base.vertices[base.triangles][..., 2] == 0).all(axis=1)))
    first, second = base.triangles[one], base.triangles[other]
    shared = [corner for corner in first if corner in second]
    a, b = shared if list(first).index(shared[1]) == (list(first).index(shared[0]) + 1) % 3 else shared[::-1]
    c, d = (int(np.setdiff1d(face, shared)[0]) for face in (first, second))
    corners = base.vertices
    middle = 0.55 * corners[a] + 0.45 * corners[b]
    middle += depth * (corners[c] - middle) / np.linalg.norm(corners[c] - middle)
    new = len(corners)
    faces = [[a, b, c], [b, a, new], [b, new, d], [new, a, d]]
    return Mesh(
        np.concatenate([corners, middle[None]]),
        np.concatenate([np.delete(base.triangles, [one, other], axis=0), faces]),
    )


@pytest.mark.parametrize("depth", [1e-9, 1e-7, 1e-5])
def test_a_folded_sliver_dissolves_in_the_boolean_without_harm_and_is_told(monkeypatch, depth):
    monkeypatch.setattr(plan, "straight", lambda feature: False)
    base = folded(depth)
    sliver = len(base.triangles) - 3
    part = make(base, laid([[12, 2, 0]], UP, 3, 1.8))
    assert_good(part, base, 1)
    assert sliver not in part.source
    assert part.check.notes[0].startswith("1 face of the base narrower than")


@pytest.mark.parametrize("depth", [1e-9, 1e-7, 1e-5])
def test_drilling_leaves_a_folded_sliver_as_it_is(depth):
    base = folded(depth)
    part = make(base, laid([[12, 2, 0]], UP, 3, 1.8))
    assert_good(part, base, 1)
    assert part.untouched[part.source == len(base.triangles) - 3].tolist() == [True]
    assert part.check.notes == ()


@pytest.mark.parametrize("harm", ["swap", "move", "dent"])
def test_a_change_where_no_hole_is_is_a_problem(monkeypatch, harm):
    base = slab(12)
    whole = solid.combine
    monkeypatch.setattr(plan, "straight", lambda feature: False)

    def harmed(*given):
        left = whole(*given)
        vertices, triangles, face = left.mesh.vertices.copy(), left.surface.copy(), left.face
        one, other = (int(np.flatnonzero(face == k)[0]) for k in (0, 144))
        if harm == "swap":
            # the other diagonal of a square that is not flat
            a, b, c, d = base_square
            names = [int(np.flatnonzero((vertices == base.vertices[k]).all(axis=1))[0]) for k in (a, b, c, d)]
            triangles[one], triangles[other] = np.array(names)[[0, 1, 3]], np.array(names)[[1, 2, 3]]
        elif harm == "move":
            vertices[triangles[one, 0]] += 1e-3
        else:
            middle = len(vertices)
            vertices = np.concatenate([vertices, [vertices[triangles[one]].mean(axis=0) - [0, 0, 1e-3]]])
            a, b, c = triangles[one]
            triangles = np.concatenate([triangles, [[b, c, middle], [c, a, middle]]])
            triangles[one] = [a, b, middle]
            face = np.concatenate([face, [face[one]] * 2])
        return Cut(Mesh(vertices, np.concatenate([triangles, left.walls])), face, left.facet, left.feature)

    base_square = [*base.triangles[0], base.triangles[144, 2]]
    monkeypatch.setattr(solid, "combine", harmed)
    part = make(base, laid([[0, 0, 4.0]], UP, 3, 0.5))
    assert part.check.watertight
    assert not part.check.unchanged
    assert "no hole touches were changed" in " ".join(part.check.problems)


def test_vertices_written_once_per_face_make_no_difference():
    base, pattern = slab(), on_slab(slab())
    welded, loose = make(base, pattern), make(soup(base), pattern)
    assert_good(loose, soup(base), len(pattern))
    assert np.array_equal(welded.source, loose.source)
    assert np.array_equal(welded.mesh.corners, loose.mesh.corners)


def test_bodies_that_touch_in_a_corner_stay_two():
    base = together(box((0, 0, 0), (5, 5, 2)), box((5, 5, 2), (9, 9, 4)))
    part = make(soup(base), laid([[2.5, 2.5, 2]], UP, 3, 1.8))
    assert part.check.problems == ()
    assert part.check.bodies == 2


def test_a_mirrored_base_gives_the_mirrored_part():
    base = slab()
    pattern = on_slab(base)
    mirror = np.diag([-1.0, 1, 1])
    other = make(
        moved(base, mirror), laid(pattern.position @ mirror, pattern.normal @ mirror, 2, pattern.diameter)
    )
    part = make(base, laid(pattern.position, pattern.normal, 2, pattern.diameter))
    assert other.check.good
    assert other.check.volume == pytest.approx(part.check.volume, rel=1e-12)
    assert len(other.mesh.triangles) == len(part.mesh.triangles)


def test_the_same_input_gives_the_same_part_bit_for_bit():
    base = slab()
    one, two = make(base, on_slab(base)), make(base, on_slab(base))
    for first, second in (
        (one.mesh.vertices, two.mesh.vertices),
        (one.mesh.triangles, two.mesh.triangles),
        (one.source, two.source),
    ):
        assert np.array_equal(first, second)


def test_an_empty_pattern_gives_the_base_back():
    base = plate()
    part = make(base, laid(np.zeros((0, 3)), UP, 3, 1.8))
    assert_good(part, base, 0)
    assert np.array_equal(part.mesh.triangles, base.triangles)


def test_progress_rises_and_the_work_can_be_given_up_between_steps():
    steps = part_steps(plate(), grid(), HOLE)
    shares = [next(steps).fraction, next(steps).fraction]
    steps.close()
    assert shares == sorted(shares)
    with pytest.raises(StopIteration):
        next(steps)


@pytest.mark.parametrize(
    "feature", [Feature(kind="star"), Feature(depth=-1.0), Feature(depth=0.0), Feature(sides=2)]
)
def test_nonsense_features_are_refused(feature):
    with pytest.raises(RecipeError):
        make(plate(), grid(), feature)


def test_an_open_base_is_refused():
    with pytest.raises(BaseError, match="not a closed solid"):
        make(Mesh(plate().vertices, plate().triangles[:-1]), grid())


@pytest.mark.skipif(not SHARED.exists(), reason="the parts to try it on are not there")
def test_vents_in_a_real_housing_go_through_its_near_wall_only():
    part = trimesh.load(SHARED / "LCD-cover-ORIGINAL-MK3.stl", process=False)
    base = Mesh(np.asarray(part.vertices, dtype=float), np.asarray(part.faces, dtype=np.int64))
    area = np.linalg.norm(base.area_vectors, axis=1)
    face = int(area.argmax())
    normal = base.area_vectors[face] / area[face]
    a, b, c = base.corners[face]
    share = np.array([(u, v) for u in (0.2, 0.4, 0.6) for v in np.linspace(0.05, 0.9 - u, 20)])
    place = a + share[:, :1] * (b - a) + share[:, 1:] * (c - a)
    made = make(base, laid(place, normal, 3, 1.5))
    assert made.check.watertight
    assert made.check.unchanged
    assert made.pierced.sum() + len(made.failures) == len(place)
    # behind some of the places a screw post or a rib leaves no gap to end in
    assert made.pierced.mean() > 0.8
    assert all("wall behind" in text for _, text in made.failures)
    assert made.check.base_euler - made.check.euler == 2 * made.pierced.sum()
    assert np.nanmax(made.thickness[made.pierced]) < 10
    assert_sources(made, base)


@settings(max_examples=25)
@given(
    width=st.floats(9, 26),
    depth=st.floats(7, 26),
    thickness=st.floats(0.05, 6),
    share=st.floats(0.15, 0.95),
    pitch=st.floats(0.9, 6),
    sides=st.integers(3, 40),
    turn=st.tuples(st.floats(0, 6.3), st.floats(0, 6.3), st.floats(0, 6.3)),
    blind=st.booleans(),
)
def test_any_plate_however_it_lies(width, depth, thickness, share, pitch, sides, turn, blind):
    diameter = share * pitch
    matrix = Rotation.from_euler("xyz", turn).as_matrix()
    base = moved(box((-width / 2, -depth / 2, -thickness), (width / 2, depth / 2, 0)), matrix)
    pattern = laid(hexagons(width, depth, pitch) @ matrix.T, matrix[:, 2], pitch, diameter)
    feature = Feature(sides=sides, depth=thickness / 2 if blind else None)
    part = make(base, pattern, feature)
    if not blind and thickness > 20 * diameter:
        assert len(part.failures) == len(pattern)
        return
    assert_good(part, base, 0 if blind else len(pattern))
    taken = len(pattern) * polygon_area(diameter, sides) * thickness * (0.5 if blind else 1)
    assert part.check.removed_volume == pytest.approx(taken, rel=1e-6)


def test_a_base_that_is_cut_away_altogether_leaves_nothing(monkeypatch):
    base, pattern = plate(), laid([[0, 0, 0]], UP, 3, 1.8)
    whole = solid.combine
    monkeypatch.setattr(plan, "straight", lambda feature: False)

    def all_of_it(mesh, face, cutters, adds):
        lid = box((-99, -99, -99), (99, 99, 99))
        return whole(mesh, face, replace(cutters, mesh=lid, facet=np.zeros(12, dtype=np.int64)), adds)

    monkeypatch.setattr(solid, "combine", all_of_it)
    part = make(base, pattern)
    assert len(part.mesh.triangles) == 0
    assert not part.check.watertight
    assert not part.check.unchanged
