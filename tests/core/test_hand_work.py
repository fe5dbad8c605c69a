"""Hand work: pins in a packing, and bubbles moved, added and deleted by hand with the others settled."""

from __future__ import annotations

import tomllib
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import cKDTree

from bubble_pattern_addon.core.errors import RegionError
from bubble_pattern_addon.core.mesh import Floats, Ints
from bubble_pattern_addon.core.metric import Constant
from bubble_pattern_addon.core.pattern import Pattern, all_bubbles
from bubble_pattern_addon.core.pipeline import pattern_steps
from bubble_pattern_addon.core.progress import drive
from bubble_pattern_addon.core.quality import measure, min_margin, min_web
from bubble_pattern_addon.core.recipe import Limits, Packing, Recipe, Shaping
from bubble_pattern_addon.core.recipe_file import recipe_from_dict, recipe_to_toml
from bubble_pattern_addon.core.region import make_region
from bubble_pattern_addon.core.settling import HandWork, settle_steps
from bubble_pattern_addon.core.snapping import snapped
from bubble_pattern_addon.core.surface import make_charts, positions
from scripts.shapes import coarse_sheet, panel_sheet, rectangle_outline, sphere_sheet

SHEET = coarse_sheet(rectangle_outline(60, 42))
PLATE = make_region(SHEET, np.ones(len(SHEET.triangles), bool))
CURVED = panel_sheet(24)
PANEL = make_region(CURVED, np.ones(len(CURVED.triangles), bool))
BALL = sphere_sheet(20.0, 3)
SPHERE = make_region(BALL, np.ones(len(BALL.triangles), bool))


def recipe_of(pitch: float, limits: Limits | None = None, **packing: object) -> Recipe:
    return Recipe(
        packing=Packing(pitch=Constant(pitch), **packing),  # type: ignore[arg-type]
        shaping=Shaping(diameter=Constant(0.6 * pitch)),
        limits=limits or Limits(min_web=0.05 * pitch, min_margin=0.05 * pitch),
    )


RECIPE = recipe_of(3.0)
PATTERN = drive(pattern_steps(PLATE, RECIPE))


def untouched(pattern: Pattern) -> HandWork:
    n = len(pattern)
    nothing = np.zeros(n, bool)
    return HandWork(pattern.position.copy(), pattern.ids.copy(), nothing, nothing, np.empty((0, 3)))


def without(hand: HandWork, rows: Ints) -> HandWork:
    kept = np.ones(len(hand.bubble), bool)
    kept[rows] = False
    return HandWork(
        hand.position[kept], hand.bubble[kept], hand.moved[kept], hand.pinned[kept], hand.position[rows]
    )


def moved(hand: HandWork, row: int, to: Floats, pinned: bool = True) -> HandWork:
    position, touched, pins = hand.position.copy(), hand.moved.copy(), hand.pinned.copy()
    position[row], touched[row], pins[row] = to, True, pinned
    return HandWork(position, hand.bubble, touched, pins, hand.gone)


def added(hand: HandWork, at: Floats, pinned: bool = False) -> HandWork:
    return HandWork(
        np.vstack([hand.position, at]),
        np.append(hand.bubble, -1),
        np.append(hand.moved, False),
        np.append(hand.pinned, pinned),
        hand.gone,
    )


def settled(hand: HandWork, pattern: Pattern = PATTERN, recipe: Recipe = RECIPE, **how: bool) -> Pattern:
    return all_bubbles(drive(settle_steps(pattern, hand, PLATE, recipe, **how))[0])


def gaps(pattern: Pattern) -> Floats:
    return cKDTree(pattern.position).query(pattern.position, k=2)[0][:, 1] / pattern.pitch


def middle() -> int:
    """Row of a bubble in the interior."""
    inner = np.flatnonzero(PATTERN.row > 2)
    return int(inner[np.linalg.norm(PATTERN.position[inner] - [4, 2, 0], axis=1).argmin()])


def test_nothing_touched_stays() -> None:
    after = settled(untouched(PATTERN))
    assert np.array_equal(after.ids, PATTERN.ids)
    assert np.linalg.norm(after.position - PATTERN.position, axis=1).max() < 0.1 * 3.0
    first = PATTERN.row == 0
    assert np.array_equal(after.position[first], PATTERN.position[first])
    assert (after.row == PATTERN.row).mean() > 0.98


@settings(max_examples=6, deadline=None, derandomize=True)
@given(x=st.floats(-1.4, 1.4), y=st.floats(-1.4, 1.4))
def test_pinned_bubble_stays_and_the_others_make_room(x: float, y: float) -> None:
    row = middle()
    target = PATTERN.position[row] + [x, y, 0]
    after = settled(moved(untouched(PATTERN), row, target))
    assert np.array_equal(after.ids, PATTERN.ids)
    assert np.linalg.norm(after.position[row] - target) < 1e-9
    assert gaps(after).min() > 0.8
    first = PATTERN.row == 0
    assert np.array_equal(after.position[first], PATTERN.position[first])
    features = replace(after, diameter=after.diameter)
    assert min_web(features) >= 0.15 - 1e-9
    assert min_margin(features, PLATE) >= 0.15 - 1e-9


def test_deleted_bubbles_stay_deleted_unless_voids_are_filled() -> None:
    hole = PATTERN.position[middle()]
    gone = np.flatnonzero(np.linalg.norm(PATTERN.position - hole, axis=1) < 3.3)
    assert len(gone) == 7
    hand = without(untouched(PATTERN), gone)
    closed, refilled = settled(hand), settled(hand, fill_voids=True)
    assert len(closed) == len(PATTERN) - 7
    assert set(closed.ids) == set(np.delete(PATTERN.ids, gone))
    before = np.linalg.norm(hand.position - hole, axis=1).min()
    assert np.linalg.norm(closed.position - hole, axis=1).min() < before
    assert len(PATTERN) - 2 <= len(refilled) <= len(PATTERN)
    assert refilled.ids.min() >= 0
    assert (refilled.ids > PATTERN.ids.max()).sum() == len(refilled) - len(closed)
    assert gaps(refilled).min() > 0.8


def test_settling_twice_changes_no_more() -> None:
    hole = PATTERN.position[middle()]
    gone = np.flatnonzero(np.linalg.norm(PATTERN.position - hole, axis=1) < 3.3)[:3]
    once = settled(without(untouched(PATTERN), gone))
    assert once.pitch.max() > 3.05
    twice = settled(untouched(once), once)
    assert np.linalg.norm(once.position - twice.position, axis=1).max() < 0.1 * 3
    full = settled(untouched(twice), twice, fill_voids=True)
    assert full.pitch.max() == 3.0


def test_deleted_bubble_of_the_first_row_comes_back_only_on_demand() -> None:
    row = np.flatnonzero((PATTERN.row == 0) & (PATTERN.position[:, 1] > 19))[5:6]
    hand = without(untouched(PATTERN), row)
    assert len(settled(hand)) == len(PATTERN) - 1
    full = settled(hand, fill_voids=True)
    assert len(full) == len(PATTERN)
    assert np.linalg.norm(full.position - PATTERN.position[row], axis=1).min() < 0.1 * 3


def test_copies_are_new_bubbles_that_find_a_place() -> None:
    row = middle()
    after = settled(added(added(untouched(PATTERN), PATTERN.position[row]), PATTERN.position[row]))
    assert len(after) == len(PATTERN) + 2
    assert np.array_equal(after.ids[: len(PATTERN)], PATTERN.ids)
    assert list(after.ids[-2:]) == [PATTERN.ids.max() + 1, PATTERN.ids.max() + 2]
    assert gaps(after).min() > 0.6


def test_bubble_moved_onto_the_boundary_comes_back_inside() -> None:
    for point in ([5.0, 21.0, 0.0], [5.0, 21.9, 1.0]):
        after = settled(added(untouched(PATTERN), np.array(point)))
        assert len(after) == len(PATTERN) + 1
        assert (21 - np.abs(after.position[:, 1])).min() > 1.5 * 0.999


def test_first_row_moves_only_where_it_is_moved() -> None:
    row = int(np.flatnonzero((PATTERN.row == 0) & (PATTERN.position[:, 1] > 19))[7])
    after = settled(moved(untouched(PATTERN), row, PATTERN.position[row] + [0.4, -0.3, 0], pinned=False))
    others = (PATTERN.row == 0) & (np.arange(len(PATTERN)) != row)
    assert np.array_equal(after.position[others], PATTERN.position[others])
    assert not np.array_equal(after.position[row], PATTERN.position[row])


def test_hand_work_off_the_region_is_told() -> None:
    hand = moved(untouched(PATTERN), middle(), np.array([200.0, 0.0, 0.0]))
    with pytest.raises(RegionError, match="One feature is off the target region"):
        settled(hand)
    with pytest.raises(RegionError, match="2 features are off"):
        settled(added(hand, np.array([0.0, 0.0, 9.0])))


def test_pins_without_room_are_told() -> None:
    row = middle()
    hand = moved(untouched(PATTERN), row, PATTERN.position[row])
    with pytest.raises(RegionError, match=r"Two pinned features near .* are 1 apart"):
        settled(added(hand, PATTERN.position[row] + [1.0, 0, 0], pinned=True))
    at = tuple(PATTERN.position[row])
    with pytest.raises(RegionError, match="Two pinned features"):
        drive(pattern_steps(PLATE, recipe_of(3.0, pins=(at, (at[0] + 1, at[1], 0.0)))))
    with pytest.raises(RegionError, match="2 pinned features are off"):
        drive(pattern_steps(PLATE, recipe_of(3.0, pins=(at, (0.0, 0.0, 7.0), (0.0, 70.0, 0.0)))))


def test_left_out_features_keep_their_bubbles() -> None:
    limits = Limits(min_margin=0.9, min_diameter=1.5)
    recipe = recipe_of(3.0, limits)
    pattern = drive(pattern_steps(PLATE, recipe))
    assert pattern.dropped is not None
    after, _ = drive(settle_steps(pattern, untouched(all_bubbles(pattern)), PLATE, recipe))
    assert after.dropped is not None
    assert len(all_bubbles(after)) == len(all_bubbles(pattern))
    assert min_margin(after, PLATE) >= 0.9 - 1e-9


def test_settling_on_a_curved_and_on_a_closed_surface() -> None:
    for region, pitch in ((PANEL, 8.0), (SPHERE, 3.0)):
        recipe = recipe_of(pitch)
        pattern = drive(pattern_steps(region, recipe))
        row = int(np.linalg.norm(pattern.position - [3, 2, 40], axis=1).argmin())
        hand = moved(untouched(pattern), row, pattern.position[row] + [0.4 * pitch, 0, 0.1 * pitch])
        after, stay = drive(settle_steps(pattern, hand, region, recipe))
        on_surface, _ = snapped(region, hand.position[row][None])
        there = positions(make_charts(region), on_surface)[0]
        assert np.linalg.norm(after.position[row] - there) < 1e-9
        assert np.abs(stay - there).max() < 1e-9
        assert gaps(after).min() > 0.7
        assert snapped(region, after.position)[1].max() < 1e-9


# -- pins ----------------------------------------------------------------------------------------------------


@settings(max_examples=6, deadline=None, derandomize=True)
@given(seed=st.integers(0, 1000))
def test_packing_goes_round_pins(seed: int) -> None:
    rng = np.random.default_rng(seed)
    pins = np.column_stack([rng.uniform(-26, 26, 4), rng.uniform(-17, 17, 4), np.zeros(4)])
    if cKDTree(pins).query(pins, k=2)[0][:, 1].min() < 3.5:
        pins = pins[:1]
    pattern = drive(pattern_steps(PLATE, recipe_of(3.0, pins=tuple(map(tuple, pins)))))
    distance, row = cKDTree(pattern.position).query(pins)
    assert distance.max() < 1e-9
    inner = (21 - np.abs(pins[:, 1]) > 4) & (30 - np.abs(pins[:, 0]) > 4)
    assert (pattern.row[row][inner] > 0).all()
    assert gaps(pattern).min() > 0.7
    assert abs(len(pattern) - len(PATTERN)) < 0.04 * len(PATTERN)
    assert measure(pattern, PLATE).rim_cv < 0.02 or not inner.all()


def test_pin_in_the_first_row_shifts_the_row() -> None:
    row = np.flatnonzero((PATTERN.row == 0) & (PATTERN.position[:, 1] > 19))
    pin = PATTERN.position[row].mean(axis=0) + [0.37 * 3, 0, 0]
    pin[1] = 19.5
    pattern = drive(pattern_steps(PLATE, recipe_of(3.0, pins=(tuple(pin),))))
    top = np.sort(pattern.position[(pattern.row == 0) & (pattern.position[:, 1] > 19), 0])
    assert np.abs(top - pin[0]).min() < 1e-9
    spacing = np.diff(top) / 3
    assert spacing.min() > 0.9
    assert spacing.max() < 1.1


def test_pins_keep_a_settled_feature_in_a_new_packing() -> None:
    row = middle()
    target = PATTERN.position[row] + [1.0, 0.5, 0]
    after = settled(moved(untouched(PATTERN), row, target))
    pins = (tuple(after.position[row]),)
    again = drive(pattern_steps(PLATE, recipe_of(3.0, pins=pins)))
    assert np.linalg.norm(again.position - target, axis=1).min() < 1e-9


def test_pins_on_a_closed_surface_and_with_symmetry_asked_for() -> None:
    pattern = drive(pattern_steps(SPHERE, recipe_of(3.0, pins=((0.0, 0.0, 20.0), (20.0, 0.0, 0.0)))))
    assert np.linalg.norm(pattern.position - [0, 0, 20], axis=1).min() < 0.05
    assert gaps(pattern).min() > 0.7
    symmetric = drive(pattern_steps(PLATE, recipe_of(3.0, pins=((7.0, 5.0, 0.0),), symmetry="auto")))
    assert symmetric.symmetry is None
    assert "placed by hand" in " ".join(symmetric.notes)


def test_pins_go_to_toml_and_back() -> None:
    recipe = replace(RECIPE, packing=Packing(pins=((1.0, 2.0, 3.0), (4.5, 5.0, 6.0))))
    data = tomllib.loads(recipe_to_toml(recipe))
    del data["region"]
    assert recipe_from_dict({**data, "region": {"all": True}}).packing == recipe.packing


def test_nearest_place_is_the_nearest() -> None:
    mixed = make_region(CURVED, np.ones(len(CURVED.triangles), bool))
    points = np.random.default_rng(3).uniform([-120, -120, -40], [120, 120, 60], (60, 3))
    spots, distance = snapped(mixed, points)
    there = np.einsum("nk,nkc->nc", spots.barycentric, mixed.corners[spots.row])
    assert np.abs(np.linalg.norm(points - there, axis=1) - distance).max() < 1e-9
    import trimesh

    every = [
        np.linalg.norm(
            trimesh.triangles.closest_point(mixed.corners, np.tile(p, (len(mixed.corners), 1))) - p, axis=1
        ).min()
        for p in points
    ]
    assert np.abs(distance - every).max() < 1e-9
