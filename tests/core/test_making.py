"""Makeable: rules of processes, nominal sizes, and the figures that say what a pattern comes to."""

from __future__ import annotations

import tomllib
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bubble_pattern_addon.core.density import mass
from bubble_pattern_addon.core.distance import boundary_distance
from bubble_pattern_addon.core.errors import RecipeError
from bubble_pattern_addon.core.feature_sizes import narrowness
from bubble_pattern_addon.core.fields import Linear
from bubble_pattern_addon.core.floors import Floors, broken_rules, floors_of
from bubble_pattern_addon.core.limits import limited_by
from bubble_pattern_addon.core.metric import Constant
from bubble_pattern_addon.core.nominal import SERIES, next_above, nominal_sizes, snapped
from bubble_pattern_addon.core.pattern import Pattern
from bubble_pattern_addon.core.pipeline import pattern_steps
from bubble_pattern_addon.core.processes import PROCESSES
from bubble_pattern_addon.core.progress import drive
from bubble_pattern_addon.core.quality import Quality, min_web
from bubble_pattern_addon.core.recipe import Feature, Limits, Output, Packing, Recipe, Shaping
from bubble_pattern_addon.core.recipe_checks import check_recipe
from bubble_pattern_addon.core.recipe_file import recipe_from_dict, recipe_to_toml
from bubble_pattern_addon.core.region import Region, make_region
from bubble_pattern_addon.core.results import UNKNOWN, offenders, results_of, words_of
from bubble_pattern_addon.core.thickness import near_thickness
from bubble_pattern_addon.core.units import UNITS, Unit
from scripts import shapes
from tests.core.bases import box, laid

PITCH = 6.0
PLATE = box((-40.0, -30.0, -1.5), (40.0, 30.0, 0.0))
TOP = PLATE.area_vectors[:, 2] > 0
SHEET = make_region(shapes.coarse_sheet(shapes.rectangle_outline(100, 100)), np.ones(2, bool))
GRADED = Linear(from_=1.0, to=5.5, direction=(1.0, 0.0, 0.0))


@pytest.fixture(scope="module")
def plate() -> Region:
    """The top of a plate 1.5 thick."""
    return make_region(PLATE, TOP)


def millimetre(unit: Unit | None) -> float:
    return Recipe(output=Output(unit=unit)).millimetre


def packed(region: Region, **recipe: object) -> Pattern:
    whole = Recipe(packing=Packing(pitch=Constant(PITCH)), shaping=Shaping(GRADED))
    return drive(pattern_steps(region, replace(whole, **recipe)))  # type: ignore[arg-type]


@cache
def graded() -> Pattern:
    return packed(SHEET)


def in_plane(points: list[tuple[float, float]], diameters: list[float]) -> Pattern:
    at = np.column_stack([np.array(points, dtype=float).reshape(-1, 2), np.zeros(len(points))])
    return laid(at, np.array([0.0, 0, 1]), 3.0, np.array(diameters))


# -- the wall ------------------------------------------------------------------------------------------------


def test_the_near_wall_is_measured_under_every_feature(plate: Region) -> None:
    assert near_thickness(packed(plate), plate) == pytest.approx(1.5)


def test_an_open_surface_has_no_thickness() -> None:
    pattern = in_plane([(0, 0), (5, 5)], [1.0, 1.0])
    assert np.isnan(near_thickness(pattern, SHEET)).all()
    assert len(near_thickness(in_plane([], []), SHEET)) == 0


def test_without_a_thickness_the_rules_that_need_none_hold_and_it_is_told(plate: Region) -> None:
    pattern = in_plane([(0, 0), (5, 5)], [1.0, 1.0])
    floors = floors_of(pattern, SHEET, Limits(process="punched sheet"))
    assert floors.hole.tolist() == [1.0, 1.0]  # the millimetre
    assert floors.web.tolist() == floors.slender.tolist() == [0.0, 0.0]
    assert floors.unknown == 2
    assert "No far side was found of the wall under 2 features" in floors.notes[0]
    recipe = {"shaping": Shaping(Constant(2.0)), "limits": Limits(process="cnc")}
    assert any("thickness" in note for note in packed(SHEET, **recipe).notes)
    assert packed(plate, **recipe).notes == ()


def test_a_rib_asks_for_more_than_the_sheet_beside_it() -> None:
    """Every feature goes by the wall under it: left of x = 0 it is 1 thick, right of it 3."""
    step = np.array([[-20, -9], [20, -9], [20, 9], [-20, 9]], dtype=float)
    thin = box((-20.0, -9.0, -1.0), (0.0, 9.0, 0.0))
    thick = box((0.0, -9.0, -3.0), (20.0, 9.0, 0.0))
    from tests.core.bases import together

    base = together(thin, thick)
    region = make_region(base, base.area_vectors[:, 2] > 0)
    assert region.area == pytest.approx(np.ptp(step, axis=0).prod())
    pattern = laid(np.array([[-8.0, 0, 0], [8.0, 0, 0]]), np.array([0, 0, 1.0]), 3.0, 2.0)
    floors = floors_of(pattern, region, Limits(process="punched sheet", min_web=2.0))
    assert floors.hole == pytest.approx([1.0, 3.0])
    assert floors.web == pytest.approx([2.0, 3.0])
    assert floors.margin == pytest.approx([1.5, 4.5])


# -- rules of processes --------------------------------------------------------------------------------------


@pytest.mark.parametrize("process", PROCESSES)
@settings(max_examples=3, deadline=None, derandomize=True)
@given(thickness=st.floats(0.3, 2.0), unit=st.sampled_from(["mm", "cm", 2.0]))
def test_a_process_sets_the_limits(process: str, thickness: float, unit: str | float) -> None:
    """Hole, web and margin of every feature are at least what the process asks for; nothing is broken."""
    rules, mm = PROCESSES[process], millimetre(unit)
    asked = [
        max(rule.times * thickness, rule.millimetres * mm) for rule in (rules.hole, rules.web, rules.margin)
    ]
    limits = Limits(process=process, thickness=thickness)
    pattern = packed(SHEET, limits=limits, output=Output(unit=unit))
    assert (pattern.diameter >= max(asked[0], thickness / rules.through) * (1 - 1e-6)).all()
    assert min_web(pattern) >= asked[1] * (1 - 1e-9)
    margin = boundary_distance(pattern.position, SHEET.boundary_segments) - pattern.diameter / 2
    assert margin.min() >= asked[2] * (1 - 1e-9)
    assert not broken_rules(pattern, SHEET, floors_of(pattern, SHEET, limits, None, mm))


@pytest.mark.parametrize("process", PROCESSES)
def test_limits_that_ask_for_more_than_the_process_count(process: str) -> None:
    pattern = in_plane([(0, 0), (5, 5)], [1.0, 1.0])
    limits = Limits(min_web=50.0, min_margin=60.0, min_diameter=70.0, process=process, thickness=1.0)
    floors = floors_of(pattern, SHEET, limits)
    assert (floors.web.tolist(), floors.margin.tolist(), floors.hole.tolist()) == (
        [50] * 2,
        [60] * 2,
        [70] * 2,
    )


@settings(max_examples=10, deadline=None, derandomize=True)
@given(seed=st.integers(0, 10_000), most=st.floats(0.5, 4.0))
def test_floors_hold_at_every_feature_of_its_own(seed: int, most: float) -> None:
    """As on a wall of varying thickness: of two neighbours the one that asks for more decides."""
    bubbles, chance = graded(), np.random.default_rng(seed)
    n = len(bubbles)
    bubbles = replace(bubbles, diameter=chance.uniform(1.0, 7.0, n))
    floors = Floors(*(chance.uniform(0.0, most, n) for _ in range(4)))
    pattern = limited_by(bubbles, SHEET, floors)
    kept = floors.take(np.searchsorted(bubbles.ids, pattern.ids))
    gap = np.linalg.norm(pattern.position[:, None] - pattern.position[None], axis=2)
    web = gap - (pattern.diameter[:, None] + pattern.diameter[None]) / 2 + 1e9 * np.eye(len(pattern))
    assert (web >= np.maximum(kept.web[:, None], kept.web[None]) * (1 - 1e-9)).all()
    margin = boundary_distance(pattern.position, SHEET.boundary_segments) - pattern.diameter / 2
    assert (margin >= kept.margin * (1 - 1e-9)).all()
    assert (pattern.diameter >= kept.diameter * (1 - 1e-6)).all()
    assert not broken_rules(pattern, SHEET, kept)


def test_a_deep_blind_feature_must_be_wide() -> None:
    pattern = in_plane([(0, 0)], [1.0])
    through = floors_of(pattern, SHEET, Limits(process="injection moulding", thickness=4.0))
    blind = floors_of(pattern, SHEET, Limits(process="injection moulding", thickness=4.0), depth=4.0)
    assert through.diameter.tolist() == [1.0]
    assert blind.diameter.tolist() == [2.0]


@pytest.mark.parametrize(
    ("profile", "narrow"),
    [
        (Feature(), 1.0),
        (Feature(profile="slot", aspect=0.5), 0.5),
        (Feature(profile="rectangle", aspect=0.75), 0.75 / 1.25),
        (Feature(profile="cross", aspect=0.3), 0.3 / np.hypot(1.0, 0.3)),
        (Feature(profile="polygon", corners=6), np.cos(np.pi / 6)),
        (Feature(profile="slot", aspect=Linear(from_=0.25, to=0.25, direction=(1.0, 0.0, 0.0))), 0.25),
    ],
)
def test_the_narrow_side_of_a_profile_goes_by_the_rule_for_holes(profile: Feature, narrow: float) -> None:
    limits = Limits(process="punched sheet", thickness=1.15)
    found = packed(SHEET, feature=profile, limits=limits)
    assert narrowness(profile, found) == pytest.approx(narrow, rel=1e-3)
    assert found.diameter.min() * narrow >= 1.15 * (1 - 1e-3)
    assert not results_of(found, SHEET, Recipe(feature=profile, limits=limits)).broken
    free = packed(SHEET, feature=profile)
    assert free.diameter.min() * narrow < 1.15
    assert "hole" in {b.rule for b in results_of(free, SHEET, Recipe(feature=profile, limits=limits)).broken}


def test_enough_draft_keeps_the_rule(plate: Region) -> None:
    for draft, broken in ((0.5, {"draft"}), (1.0, set())):
        recipe = Recipe(
            packing=Packing(pitch=Constant(PITCH)),
            shaping=Shaping(Constant(3.0)),
            feature=Feature(draft=draft),
            limits=Limits(process="injection moulding"),
        )
        pattern = drive(pattern_steps(plate, recipe))
        assert {one.rule for one in results_of(pattern, plate, recipe).broken} == broken


def test_every_rule_tells_who_breaks_it_and_by_how_much() -> None:
    points = [(0, 0), (3, 0), (20, 20), (49, 0), (-20, 20)]
    pattern = in_plane(points, [2.0, 1.6, 0.8, 1.4, 3.0])
    pattern = replace(pattern, bubble=np.array([3, 5, 8, 13, 21]))
    floors = floors_of(pattern, SHEET, Limits(process="punched sheet", thickness=1.3))
    found = {broken.rule: broken for broken in broken_rules(pattern, SHEET, floors)}
    assert set(found) == {"hole", "web", "margin"}
    assert found["hole"].ids.tolist() == [8]
    assert (found["hole"].worst, found["hole"].least) == (0.8, 1.3)
    assert found["web"].ids.tolist() == [3, 5]
    assert found["web"].rows.tolist() == [0, 1]
    assert (found["web"].worst, found["web"].least) == pytest.approx((1.2, 1.3))
    assert found["margin"].ids.tolist() == [13]
    assert (found["margin"].worst, found["margin"].least) == pytest.approx((0.3, 1.95))
    assert offenders(tuple(found.values())).tolist() == [0, 1, 2, 3]


def test_too_deep_and_too_straight_features_break_rules_of_their_own() -> None:
    pattern = in_plane([(0, 0), (20, 0)], [1.0, 3.0])
    floors = floors_of(pattern, SHEET, Limits(process="injection moulding", thickness=6.0))
    found = {b.rule: b for b in broken_rules(pattern, SHEET, floors, draft=0.5, least_draft=1.0)}
    assert set(found) == {"slender", "draft"}
    assert found["slender"].ids.tolist() == [0]
    assert found["slender"].least == 1.5
    assert found["draft"].ids.tolist() == [0, 1]


def test_the_worst_web_of_a_feature_between_two_is_told() -> None:
    pattern = in_plane([(0, 0), (3, 0), (5.5, 0)], [2.0, 2.0, 2.0])
    (web,) = broken_rules(pattern, SHEET, floors_of(pattern, SHEET, Limits(min_web=1.2)))
    assert web.ids.tolist() == [0, 1, 2]
    assert web.worst == pytest.approx(0.5)


def test_what_is_kept_to_single_precision_is_kept() -> None:
    pattern = packed(SHEET, limits=Limits(min_web=1.0, min_margin=1.1, min_diameter=1.2))
    rounded = replace(pattern, diameter=pattern.diameter.astype(np.float32).astype(np.float64))
    limits = Limits(min_web=1.0, min_margin=1.1, min_diameter=1.2)
    assert not broken_rules(rounded, SHEET, floors_of(rounded, SHEET, limits))
    wider = replace(limits, min_web=1.001)
    assert broken_rules(rounded, SHEET, floors_of(rounded, SHEET, wider))


def test_results_say_what_a_finished_pattern_breaks_of_a_process(plate: Region) -> None:
    """The pattern was shaped without it."""
    pattern = packed(plate, limits=Limits(min_diameter=1.1))
    assert results_of(pattern, plate, Recipe(limits=Limits(min_diameter=1.1))).broken == ()
    asked = Recipe(limits=Limits(process="injection moulding", thickness=4.0))
    found = {broken.rule for broken in results_of(pattern, plate, asked).broken}
    assert found == {"web", "margin", "draft"}
    checked = packed(plate, limits=Limits(min_diameter=1.1, check_only=True, **vars_of(asked)))
    assert np.array_equal(checked.diameter, pattern.diameter)
    only = Recipe(limits=Limits(check_only=True, **vars_of(asked)))
    assert {broken.rule for broken in results_of(checked, plate, only).broken} == found
    kept = packed(plate, limits=Limits(process="cnc"))
    assert results_of(kept, plate, Recipe(limits=Limits(process="cnc"))).broken == ()


def vars_of(recipe: Recipe) -> dict[str, Any]:
    return {"process": recipe.limits.process, "thickness": recipe.limits.thickness}


def test_a_process_that_leaves_nothing_is_told_with_its_lengths() -> None:
    with pytest.raises(
        RecipeError, match=r'No feature is left: "fdm print" asks for diameters from 2,.* 0\.5;'
    ):
        packed(SHEET, shaping=Shaping(Constant(0.5)), limits=Limits(process="fdm print", thickness=1.0))


# -- nominal sizes -------------------------------------------------------------------------------------------


@settings(max_examples=12, deadline=None, derandomize=True)
@given(
    sizes=st.lists(st.floats(0.5, 5.0), min_size=1, max_size=6),
    limits=st.builds(
        Limits, min_web=st.floats(0, 2.5), min_margin=st.floats(0, 2), min_diameter=st.floats(0, 1.5)
    ),
)
def test_every_feature_is_the_nearest_smaller_nominal_size(sizes: list[float], limits: Limits) -> None:
    bubbles = graded()
    wished = replace(bubbles, diameter=bubbles.wished)
    floors, allowed = floors_of(wished, SHEET, limits), np.unique(sizes)
    pattern = limited_by(wished, SHEET, floors, allowed)
    assert np.isin(pattern.diameter, allowed).all()
    assert (pattern.diameter <= pattern.wished * (1 + 1e-6)).all()
    assert (pattern.diameter >= limits.min_diameter * (1 - 1e-6)).all()
    assert not broken_rules(pattern, SHEET, floors_of(pattern, SHEET, limits))
    left_out = 0 if pattern.dropped is None else len(pattern.dropped)
    assert len(pattern) + left_out == len(bubbles)
    kept = np.isin(bubbles.ids, pattern.ids)
    next_size = next_above(np.nextafter(pattern.diameter, 9.0) * 1.000001, allowed)
    plain = limited_by(wished, SHEET, floors)
    alike = np.isin(plain.ids, pattern.ids)
    if alike.sum() == kept.sum() and len(plain) == len(pattern):
        assert (next_size > plain.diameter).all()


def test_what_is_only_snapped_was_not_made_smaller_by_limits() -> None:
    free = packed(SHEET, shaping=Shaping(GRADED, sizes="drills 1"))
    assert not len(free.shrunk)
    tight = packed(SHEET, shaping=Shaping(GRADED, sizes="drills 1"), limits=Limits(min_web=1.5))
    assert 0 < len(tight.shrunk) < len(tight)
    assert tight.diameter.max() == 4.0


def test_snapping_forgives_rounding_and_drops_what_is_too_small() -> None:
    sizes = np.array([1.0, 1.5, 2.0])
    found = snapped(np.array([0.99, 1.0 - 1e-9, 1.49, 1.5, 7.0]), sizes)
    assert found.tolist() == [0.0, 1.0, 1.0, 1.5, 2.0]
    assert next_above(np.array([0.0, 1.0, 1.01, 2.0, 2.1]), sizes).tolist() == [1.0, 1.0, 1.5, 2.0, np.inf]


def test_a_size_below_the_least_diameter_is_none() -> None:
    pattern = packed(SHEET, shaping=Shaping(GRADED, sizes=(1.0, 1.5, 2.0)), limits=Limits(min_diameter=1.2))
    assert set(pattern.diameter) == {1.5, 2.0}
    assert pattern.dropped is not None


def test_sizes_that_leave_nothing_are_told() -> None:
    with pytest.raises(RecipeError, match=r"none of \[shaping\] sizes"):
        packed(SHEET, shaping=Shaping(Constant(2.0), sizes=(3.0, 4.0)))


def test_a_symmetric_pattern_stays_so_in_nominal_sizes() -> None:
    pattern = packed(
        SHEET,
        packing=Packing(pitch=Constant(PITCH), symmetry="xy"),
        shaping=Shaping(Constant(4.4), sizes=(2.0, 4.0)),
    )
    assert pattern.partners is not None
    row = np.searchsorted(pattern.ids, pattern.partners)
    assert (np.ptp(pattern.diameter[row], axis=1) == 0).all()


@pytest.mark.parametrize("name", SERIES)
def test_series_rise_and_go_with_the_unit(name: str) -> None:
    sizes = nominal_sizes(name, 1.0)
    assert sizes is not None
    assert (np.diff(sizes) > 0).all()
    assert sizes[0] > 0
    metres = nominal_sizes(name, millimetre("m"))
    assert metres == pytest.approx(sizes / 1000)
    assert nominal_sizes(None, 1.0) is None
    assert nominal_sizes((2.0, 1.0, 2.0), 7.0).tolist() == [1.0, 2.0]  # type: ignore[union-attr]


def test_known_drills_are_there() -> None:
    assert {0.2, 3.3, 10.2} <= set(SERIES["drills 0.1"])
    assert {2.5, 3.3, 4.2, 5.0, 6.8, 8.5, 10.2} <= set(SERIES["tap drills"])  # M3 to M12
    assert {1.6, 2.5, 31.5} <= set(SERIES["R10"])


# -- figures -------------------------------------------------------------------------------------------------


@settings(max_examples=20, deadline=None, derandomize=True)
@given(
    data=st.lists(
        st.tuples(st.integers(-8, 8), st.integers(-8, 8), st.floats(0.3, 4.0)),
        min_size=2,
        max_size=25,
        unique_by=lambda entry: entry[:2],
    )
)
def test_the_smallest_web_lies_between_its_two_points(data: list[tuple[int, int, float]]) -> None:
    pattern = in_plane([(2.0 * x, 2.0 * y) for x, y, _ in data], [size for _, _, size in data])
    results = results_of(pattern, SHEET, Recipe())
    web = results.smallest_web
    if web is None:
        assert min_web(pattern) == np.inf
        return
    assert web.length == pytest.approx(min_web(pattern))
    assert results.mean_web >= web.length - 1e-12
    at = pattern.position[list(web.rows)]
    assert np.linalg.norm(web.between - at, axis=1) == pytest.approx(pattern.diameter[list(web.rows)] / 2)
    along = (at[1] - at[0]) / np.linalg.norm(at[1] - at[0])
    assert (web.between[1] - web.between[0]) @ along == pytest.approx(web.length)
    assert pattern.ids[list(web.rows)].tolist() == list(web.ids)


def test_figures_of_three_features() -> None:
    pattern = in_plane([(0, 0), (3, 0), (7, 0)], [1.0, 2.0, 1.0])
    results = results_of(pattern, SHEET, Recipe(shaping=Shaping(sizes=(1.0, 2.0))))
    assert results.smallest_web is not None
    assert results.smallest_web.ids == (0, 1)
    assert results.mean_web == pytest.approx((1.5 + 1.5 + 2.5) / 3)
    assert (results.smallest, results.largest, results.count) == (1.0, 2.0, 3)
    assert results.sizes == ((1.0, 2), (2.0, 1))
    assert results.open_area == pytest.approx(np.pi / 4 * 6 / 1e4)


def test_nothing_has_no_figures() -> None:
    results = results_of(in_plane([], []), SHEET, Recipe())
    assert results.count == 0
    assert results.smallest_web is None
    assert np.isnan([results.smallest, results.largest, results.mean_web]).all()
    assert not offenders(results.broken).size


def test_two_features_in_one_place_overlap_by_their_size() -> None:
    web = results_of(in_plane([(0, 0), (0, 0)], [1.0, 2.0]), SHEET, Recipe()).smallest_web
    assert web is not None
    assert web.length == -1.5
    assert np.isfinite(web.between).all()


def test_what_is_removed_and_what_it_weighs(plate: Region) -> None:
    pattern = packed(plate)
    area = np.pi / 4 * (pattern.diameter**2).sum()
    assert results_of(pattern, plate, Recipe()).removed == pytest.approx(1.5 * area)
    assert results_of(pattern, plate, Recipe(feature=Feature(depth=0.4))).removed == pytest.approx(0.4 * area)
    assert results_of(pattern, plate, Recipe(), 7.0).removed == 7.0
    assert np.isnan(results_of(in_plane([(0, 0)], [1.0]), SHEET, Recipe()).removed)
    assert mass(1000.0, 2.7, millimetre(None)) == pytest.approx(2.7)  # one cubic centimetre
    assert mass(1e-6, 2.7, millimetre("m")) == pytest.approx(2.7)


@pytest.mark.parametrize(
    ("quality", "words"),
    [
        (Quality(0.98, 0.97, 0.02, 0.91, 0.001), ["excellent"] * 4),
        (Quality(0.919, 0.918, 0.047, 0.771, 0.02), ["excellent", "good", "good", "good"]),  # the paper's
        (Quality(0.832, 0.835, 0.099, 0.635, 0.001), ["good", "fair", "fair", "excellent"]),  # gmsh
        (Quality(0.965, 0.998, 0.0, 1.0, 0.182), ["excellent", "excellent", "excellent", "poor"]),  # a grid
        (Quality(0.523, 0.428, 0.065, 0.86, 0.251), ["poor", "fair", "excellent", "poor"]),  # Poisson disk
        (Quality(np.nan, np.nan, np.nan, np.nan, np.nan), [UNKNOWN] * 4),
    ],
)
def test_words_tell_arrangements_apart(quality: Quality, words: list[str]) -> None:
    assert list(words_of(quality).values()) == words


# -- recipes -------------------------------------------------------------------------------------------------

REGION = "[region]\nall = true\n"


def test_the_new_keys_are_written_and_read_back() -> None:
    text = REGION + (
        '[shaping]\ndiameter = 2.0\nsizes = "drills 0.5"\n'
        '[limits]\nprocess = "laser"\nthickness = 1.2\ncheck_only = true\n'
        '[solve]\nopen_area = 0.3\nby = "pitch"\n[output]\ndensity = 7.85\nunit = "cm"\n'
    )
    recipe = recipe_from_dict(tomllib.loads(text))
    assert recipe.shaping.sizes == "drills 0.5"
    assert recipe.limits == Limits(process="laser", thickness=1.2, check_only=True)
    assert recipe.output.unit == "cm"
    assert recipe_from_dict(tomllib.loads(recipe_to_toml(recipe))) == recipe
    other = recipe_from_dict(tomllib.loads(REGION + "[shaping]\nsizes = [1, 2.5]\n[output]\nunit = 0.5\n"))
    assert other.shaping.sizes == (1.0, 2.5)
    assert other.millimetre == 2.0
    assert recipe_from_dict(tomllib.loads(recipe_to_toml(other))) == other
    assert "[solve]" not in recipe_to_toml(other)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ('[limits]\nprocess = "punch"', r'process = "punch" is not known: did you mean "punched sheet"'),
        ("[limits]\nthickness = 0.0", r"thickness = 0 must be a number above 0"),
        ('[shaping]\nsizes = "drills"', r'sizes = "drills" is not known: did you mean "drills'),
        ("[shaping]\nsizes = []", r"sizes = \[\] must be a list of diameters, or the name"),
        ("[shaping]\nsizes = [1.0, -2.0]", r"sizes = -2 must be a number above 0"),
        ("[shaping]\nsizes = 3.0", r"sizes = 3.0 must be a list"),
        ("[output]\ndensity = 0.0", r"density = 0 must be a number above 0"),
        ('[output]\nunit = "mile"', r'unit = "mile" is no unit'),
        ("[output]\nunit = -1.0", r"unit = -1 must be a number above 0"),
        ("[output]\nunit = true", r"unit = true must be a number"),
        ('[solve]\nby = "pitch"', r"\[solve\] has no target"),
        ("[solve]\nopen_area = 0.3\ncount = 20", r"gives both open_area and count"),
        ('[solve]\nopen_area = 0.3\nby = "seed"', r'by = "seed" is not known'),
        ("[solve]\nopen_area = 35.0", r"open_area = 35 must be a share above 0 and below 0\.9069"),
        ("[solve]\ncount = 0", r"count = 0 must be at least 1"),
        ('[solve]\ncount = 20\nby = "diameter"', r"count does not hang on the diameter"),
        ('[solve]\nopen_area = 0.3\nby = "pitch"\n[shaping]\nfill = 0.5', r"solve by = .diameter."),
    ],
)
def test_what_makes_no_sense_is_refused(text: str, message: str) -> None:
    with pytest.raises(RecipeError, match=message):
        recipe_from_dict(tomllib.loads(REGION + text))


def test_a_count_alone_lets_the_diameter_follow_the_pitch() -> None:
    recipe = recipe_from_dict(tomllib.loads(REGION + "[packing]\npitch = 4.0\n[solve]\ncount = 20"))
    low, high = recipe.shaping.diameter.bounds()
    assert recipe.solve.count == 20
    assert low < 1e-9 < 1e9 < high
    check_recipe(recipe)


def test_every_unit_is_known_by_its_millimetres() -> None:
    assert {name: 1 / millimetre(name) for name in UNITS} == pytest.approx(UNITS)
    assert millimetre(None) == 1.0
