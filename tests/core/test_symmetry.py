"""Symmetry: what is found, what is refused, and that a symmetric pattern is so exactly."""

from __future__ import annotations

import csv
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import cKDTree

from bubble_pattern_addon.core.errors import RecipeError
from bubble_pattern_addon.core.export import PARTNER, write_features
from bubble_pattern_addon.core.fields import Linear
from bubble_pattern_addon.core.isometries import depth, first_alike, images, isometries, settled
from bubble_pattern_addon.core.limits import _alike
from bubble_pattern_addon.core.mesh import Floats
from bubble_pattern_addon.core.metric import Constant, Described
from bubble_pattern_addon.core.packing.pack import pack_steps
from bubble_pattern_addon.core.pattern import Pattern, all_bubbles
from bubble_pattern_addon.core.pattern import joined as end_to_end
from bubble_pattern_addon.core.pipeline import pattern_steps
from bubble_pattern_addon.core.progress import drive
from bubble_pattern_addon.core.quality import measure, neighbours
from bubble_pattern_addon.core.recipe import Limits, Packing, Recipe, Shaping
from bubble_pattern_addon.core.recipe_checks import check_recipe
from bubble_pattern_addon.core.recipe_file import recipe_from_dict, recipe_to_toml
from bubble_pattern_addon.core.region import Region, make_region
from scripts.shapes import SHAPES, Shape, circle, coarse_sheet, joined, panel_sheet, rectangle_outline

EXACT = 1e-6


def sheet(*loops: Floats) -> Shape:
    mesh = coarse_sheet(list(loops))
    return Shape(mesh, np.ones(len(mesh.triangles), dtype=bool), 3.0)


def island() -> Shape:
    """A rectangle with a round island in its middle."""
    return sheet(*rectangle_outline(80, 50), circle(9.0)[::-1])


def two_islands() -> Shape:
    """A rectangle with an island on either side."""
    return sheet(*rectangle_outline(80, 50), circle(7.0, (20, 0))[::-1], circle(7.0, (-20, 0))[::-1])


def annulus() -> Shape:
    """A ring: its axis is outside the region."""
    return sheet(circle(30.0), circle(10.0)[::-1])


def two_parts() -> Shape:
    """Two plates that are each other's image, and no part of the region on the plane."""
    meshes = [coarse_sheet(rectangle_outline(20, 30, (side * 15.0, 0.0))) for side in (-1, 1)]
    mesh = joined(*meshes)
    return Shape(mesh, np.ones(len(mesh.triangles), dtype=bool), 3.0)


def packed(
    shape: Shape, word: str, pitch: Described | None = None, **choices: object
) -> tuple[Region, Pattern]:
    region = make_region(shape.mesh, shape.selected)
    pitch = pitch or Constant(shape.pitch)
    low = pitch.bounds()[0]
    packing = replace(Packing(pitch=pitch, symmetry=word), **choices)
    recipe = Recipe(packing=packing, shaping=Shaping(diameter=Constant(0.5 * low)))
    return region, drive(pattern_steps(region, recipe))


def error(pattern: Pattern, centre: Floats | None = None) -> float:
    """The farthest, in pitches, that the image of a feature is from the feature that is its partner."""
    assert pattern.symmetry is not None
    assert pattern.partners is not None
    group = isometries(pattern.symmetry, np.zeros(3) if centre is None else centre)
    away = images(group, pattern.position) - pattern.position[pattern.partners.T]
    return float((np.linalg.norm(away, axis=2) / pattern.pitch).max())


CASES: list[tuple[Callable[[], Shape], str]] = [
    (SHAPES["square"], "x"),
    (SHAPES["square"], "xy"),
    (SHAPES["square"], "rotate 4"),
    (island, "y"),
    (island, "xy"),
    (two_islands, "xy"),
    (two_islands, "rotate 2"),
    (two_parts, "x"),
    (annulus, "rotate 5"),
    (annulus, "xy"),
    (SHAPES["disc"], "x"),
    (SHAPES["disc"], "rotate 6"),
    (SHAPES["tube"], "xy"),
    (SHAPES["tube"], "rotate 6 z"),
    (SHAPES["sphere"], "x"),
]


@pytest.mark.parametrize(("make", "word"), CASES)
def test_the_image_of_a_pattern_is_the_pattern(make, word):
    _, pattern = packed(make(), word)
    centre = np.array([0.0, 0.0, 40.0]) if make is SHAPES["tube"] else None
    assert error(pattern, centre) < EXACT
    assert len(cKDTree(pattern.position).query_pairs(0.5 * float(pattern.pitch.min()))) == 0
    # every isometry is a renumbering of all features
    assert (np.sort(pattern.partners, axis=0) == np.arange(len(pattern))[:, None]).all()
    assert np.array_equal(pattern.partners[:, 0], np.arange(len(pattern)))
    assert np.array_equal(pattern.row[pattern.partners].min(axis=1), pattern.row[pattern.partners].max(1))


def test_a_curved_panel_whose_triangles_are_not_symmetric_is_so_up_to_its_triangles():
    shape = SHAPES["panel"]()
    _, pattern = packed(shape, "xy")
    assert error(pattern) < 1e-3
    # seen from above, where the triangles do not matter, hardly anything is off
    group = isometries("xy", np.zeros(3))
    away = images(group, pattern.position) - pattern.position[pattern.partners.T]
    assert np.linalg.norm(away[..., :2], axis=2).max() < 2e-4 * shape.pitch


def test_a_curved_panel_with_symmetric_triangles_is_exact():
    half = panel_sheet(20)
    right = half.vertices[half.triangles].mean(axis=1)[:, 0] > 0
    keep = half.triangles[right]
    mirror = replace(half, vertices=half.vertices * [-1.0, 1, 1], triangles=keep[:, ::-1].copy())
    mesh = joined(replace(half, triangles=keep), mirror)
    _, pattern = packed(Shape(mesh, np.ones(len(mesh.triangles), dtype=bool), 8.0), "x")
    assert error(pattern) < EXACT


@pytest.mark.parametrize(("make", "word"), CASES[:9])
def test_bubbles_stand_on_the_plane_or_keep_half_a_pitch_from_it(make, word):
    _, pattern = packed(make(), word)
    group = isometries(pattern.symmetry, np.zeros(3))
    to_plane = np.abs(pattern.position @ group.planes.T) / pattern.pitch[:, None]
    assert ((to_plane < EXACT) | (to_plane > 0.42)).all()


@pytest.mark.parametrize(
    ("make", "word"),
    [
        (SHAPES["square"], "x"),
        (SHAPES["square"], "xy"),
        (SHAPES["panel"], "x"),
        (SHAPES["panel"], "xy"),
        (SHAPES["tube"], "xy"),
        (SHAPES["tube"], "rotate 6"),
        (island, "xy"),
    ],
)
def test_symmetry_costs_no_order(make, word):
    shape = make()
    region, plain = packed(shape, "off")
    _, pattern = packed(shape, word)
    before, after = measure(plain, region), measure(pattern, region)
    assert after.six > before.six - 0.01
    assert after.gap_min > before.gap_min - 0.03
    assert len(pattern) > 0.97 * len(plain)


def test_leaders_alone_are_relaxed():
    """Half of the bubbles, and the pairs that act on them, are what the forces are worked out for."""
    from bubble_pattern_addon.core.packing.bubbles import Bubbles
    from bubble_pattern_addon.core.packing.orbits import with_followers
    from bubble_pattern_addon.core.packing.pack import local_pitch
    from bubble_pattern_addon.core.packing.relax import relax

    shape = SHAPES["square"]()
    region = make_region(shape.mesh, shape.selected)
    ground, whole = drive(pack_steps(region, Packing(pitch=Constant(0.294), symmetry="xy")))
    chosen = np.unique(whole.orbit, return_index=True)[1]
    leaders = Bubbles(whole.spots.take(chosen), int((chosen < whole.fixed).sum()))
    again = with_followers(ground, leaders)
    assert len(again) == len(whole)
    _, work = relax(ground, leaders, local_pitch(ground, leaders), 20, 1e-9)
    plain = replace(ground, symmetry=None)
    _, reference = relax(plain, whole, local_pitch(plain, whole), 20, 1e-9)
    assert work.pairs / work.evaluations < 0.35 * reference.pairs / reference.evaluations


def test_a_graded_metric_is_mirrored_too():
    graded = Linear(from_=0.3, to=0.6, direction=(0.0, 1.0, 0.0))
    _, pattern = packed(SHAPES["square"](), "x", graded)
    assert error(pattern) < EXACT
    assert np.ptp(pattern.pitch[pattern.partners], axis=1).max() == 0


def test_both_integrators_keep_the_symmetry():
    _, pattern = packed(SHAPES["disc"](), "xy", Constant(0.6), integrator="rk4", iterations=20)
    assert error(pattern) < EXACT


@settings(max_examples=8)
@given(
    st.floats(20, 70), st.floats(15, 50), st.floats(0.05, 0.35), st.sampled_from(["x", "y", "xy", "rotate 2"])
)
def test_any_plate_with_a_hole_is_symmetric(width, height, hole, word):
    radius = hole * min(width, height)
    shape = sheet(*rectangle_outline(width, height, (7.0, -3.0)), circle(radius, (7.0, -3.0))[::-1])
    region, pattern = packed(shape, word)
    assert error(pattern, np.array([7.0, -3.0, 0.0])) < EXACT
    assert measure(pattern, region).gap_min > 0.6


# --- found or refused


@pytest.mark.parametrize(
    ("make", "word"),
    [
        (SHAPES["square"], "xy"),
        (SHAPES["panel"], "xy"),
        (two_parts, "xy"),
        (lambda: sheet(circle(20.0, sides=3)), "rotate 3 z"),
        (lambda: sheet(np.array([[-20.0, 0], [20, 0], [12, 30], [-12, 30]])), "x"),
    ],
)
def test_auto_finds_the_symmetry_and_tells(make, word):
    _, pattern = packed(make(), "auto")
    assert pattern.symmetry == word
    assert any("Symmetry found" in note and f'"{word}"' in note for note in pattern.notes)


def test_auto_finds_nothing_in_an_l():
    _, pattern = packed(SHAPES["l"](), "auto")
    assert pattern.symmetry is None
    assert any("No symmetry found" in note and "pitches" in note for note in pattern.notes)


@pytest.mark.parametrize("word", ["x", "xy", "rotate 2", "rotate 3 z", "z"])
def test_a_region_without_the_symmetry_is_packed_without_and_told_how_far_it_is_off(word):
    shape = SHAPES["l"]()
    _, plain = packed(shape, "off")
    _, pattern = packed(shape, word)
    assert plain.notes == ()
    assert np.array_equal(plain.position, pattern.position)
    assert pattern.partners is None
    assert any("not symmetric" in note and "off by" in note for note in pattern.notes)


def test_a_plane_elsewhere_is_none_of_the_region():
    _, pattern = packed(SHAPES["square"](), "x", symmetry_centre=(0.5, 0.0, 0.0))
    assert pattern.symmetry is None
    assert any("about 0.5, 0, 0" in note and "off by 1 (" in note for note in pattern.notes)


def test_a_given_centre_is_used():
    _, pattern = packed(SHAPES["square"](), "x", symmetry_centre=(0.0, 3.0, 1.0))
    assert error(pattern) < EXACT


def test_a_metric_without_the_symmetry_is_packed_without():
    graded = Linear(from_=0.3, to=0.6, direction=(1.0, 0.0, 0.0))
    _, pattern = packed(SHAPES["square"](), "x", graded)
    assert pattern.symmetry is None
    assert any("pitch is not symmetric" in note and "%" in note for note in pattern.notes)


# --- recipe and table


@pytest.mark.parametrize(
    ("word", "advice"),
    [
        ("X", '"x"'),
        ("yx", '"xy"'),
        ("mirror x", '"x"'),
        ("mirror xy", '"xy"'),
        ("rotate3", '"rotate 3"'),
        ("rotated 6", '"rotate 6"'),
        ("6-fold z", '"rotate 6 z"'),
        ("rotate 1", '"rotate 2"'),
        ("rotate 99", '"rotate 60"'),
        ("of", '"off"'),
        ("automatic", '"auto"'),
        ("sideways", "known are"),
    ],
)
def test_a_wrong_word_gets_the_nearest_right_one(word, advice):
    with pytest.raises(RecipeError, match="symmetry") as caught:
        recipe_from_dict({"region": {"all": True}, "packing": {"symmetry": word}})
    assert advice in str(caught.value)


def test_a_centre_that_is_no_point_is_refused():
    with pytest.raises(RecipeError, match="symmetry_centre"):
        recipe_from_dict({"region": {"all": True}, "packing": {"symmetry_centre": 3.0}})
    with pytest.raises(RecipeError, match="symmetry_centre"):
        check_recipe(Recipe(packing=Packing(symmetry_centre=(0.0, float("nan"), 0.0))))


def test_the_recipe_comes_back_from_toml():
    import tomllib

    table = {
        "region": {"all": True},
        "packing": {"symmetry": "rotate 3 z", "symmetry_centre": [1.0, 2.0, 3.0]},
    }
    recipe = recipe_from_dict(table)
    assert recipe.packing.symmetry == "rotate 3 z"
    assert recipe_from_dict(tomllib.loads(recipe_to_toml(recipe))) == recipe


def test_partners_stand_in_the_table_only_of_symmetric_patterns(tmp_path):
    shape = island()
    for word in ("off", "x"):
        _, pattern = packed(shape, word)
        write_features(tmp_path / "features.csv", pattern)
        with (tmp_path / "features.csv").open(encoding="utf-8") as file:
            lines = list(csv.DictReader(file))
        assert (PARTNER in lines[0]) == (word == "x")
    place = {int(line["id"]): (float(line["x"]), float(line["y"])) for line in lines}
    for line in lines:
        x, y = place[int(line[PARTNER])]
        assert (-x, y) == pytest.approx((float(line["x"]), float(line["y"])), abs=1e-6)


def test_partners_that_ask_for_the_same_are_limited_alike():
    partners = np.array([[0, 1], [1, 0], [2, 3], [3, 2]])
    wished = np.array([2.0, 2.0, 2.0, 3.0])
    diameter = np.array([1.9, 1.8, 1.5, 2.5])
    kept = np.array([True, False, True, False])
    size, stays = _alike(partners, wished, diameter, kept)
    assert size.tolist() == [1.8, 1.8, 1.5, 2.5]
    assert stays.tolist() == [False, False, True, False]


def test_patterns_end_to_end_keep_their_partners():
    _, one = packed(island(), "x")
    _, other = packed(SHAPES["disc"](), "off")
    both = end_to_end([one, one])
    assert both.symmetry == "x"
    assert np.array_equal(both.partners[: len(one)], one.partners)
    assert np.array_equal(both.partners[len(one) :], one.partners + len(one))
    mixed = end_to_end([one, other])
    assert mixed.symmetry is None
    assert mixed.partners is None


def test_what_is_left_out_is_left_out_on_both_sides_and_may_come_back():
    region, whole = packed(island(), "x")
    recipe = Recipe(
        packing=Packing(pitch=Constant(3.0), symmetry="x"),
        shaping=Shaping(diameter=Constant(2.9)),
        limits=Limits(min_web=0.05, min_diameter=2.8),
    )
    pattern = drive(pattern_steps(region, recipe))
    assert pattern.dropped is not None
    assert np.isin(pattern.partners, pattern.ids).all()
    row = np.searchsorted(pattern.ids, pattern.partners)
    assert np.ptp(pattern.diameter[row], axis=1).max() == 0
    assert np.array_equal(all_bubbles(pattern).partners, whole.partners)


# --- the groups


@pytest.mark.parametrize("word", ["x", "yz", "xy", "rotate 2 x", "rotate 5 z", "rotate 6 y"])
def test_isometries_are_a_group_with_one_image_in_each_domain(word):
    group = isometries(word, np.array([1.0, 2.0, 3.0]))
    products = np.einsum("iab,jbc->ijac", group.turns, group.turns)
    away = np.abs(products[:, :, None] - group.turns).max(axis=(3, 4)).min(axis=2)
    assert away.max() < 1e-12
    points = np.random.default_rng(1).uniform(-5, 5, (200, 3))
    inside = np.stack([depth(group, image) > 0 for image in images(group, points)])
    assert (inside.sum(axis=0) == 1).all()


def test_points_near_an_axis_settle_on_it():
    group = isometries("rotate 12 z", np.zeros(3))
    points = np.array([[0.5, 0.0, 1.0], [2.5, 0.0, 1.0]])
    there = settled(group, points, np.full(2, 0.7))
    assert there[0] == pytest.approx([0, 0, 1], abs=1e-9)
    assert np.array_equal(there[1], points[1])
    assert (first_alike(group, there, np.ones(2))[0] == 0).all()


def test_neighbours_across_the_plane_are_a_pitch_apart():
    _, pattern = packed(SHAPES["square"](), "x")
    near = neighbours(pattern.position, pattern.normal, pattern.pitch)
    across = pattern.position[near.first, 0] * pattern.position[near.second, 0] < 0
    gap = np.linalg.norm(pattern.position[near.first] - pattern.position[near.second], axis=1)[across]
    assert gap.min() > 0.9 * pattern.pitch[0]
