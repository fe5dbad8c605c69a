"""The limits hold whatever the fields ask for: webs, margins, least diameters, and nothing overlaps."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bubble_pattern_addon.core import pipeline
from bubble_pattern_addon.core.blending import Blend, Fill, Most, Product
from bubble_pattern_addon.core.distance import boundary_distance
from bubble_pattern_addon.core.errors import FieldError, RecipeError, RegionError
from bubble_pattern_addon.core.fields import Distance, Edge, Linear, Radial
from bubble_pattern_addon.core.limits import LEAST_WEB, limited, within_limits
from bubble_pattern_addon.core.mesh import Floats
from bubble_pattern_addon.core.metric import Bound, Constant, Described, Places
from bubble_pattern_addon.core.nominal import SAME
from bubble_pattern_addon.core.packing.pack import pack_steps
from bubble_pattern_addon.core.painted import Attribute
from bubble_pattern_addon.core.pattern import Pattern, all_bubbles
from bubble_pattern_addon.core.pipeline import pattern_steps
from bubble_pattern_addon.core.progress import drive
from bubble_pattern_addon.core.quality import min_margin, min_web
from bubble_pattern_addon.core.recipe import Limits, Packing, Recipe, Seed, Shaping
from bubble_pattern_addon.core.recipe_checks import check_recipe
from bubble_pattern_addon.core.region import Region, make_region
from bubble_pattern_addon.core.shaping import reshaped
from bubble_pattern_addon.core.surroundings import NOTHING
from scripts import shapes
from scripts.shapes import SHAPES

NO_LIMITS = Limits()


def region_of(name: str) -> Region:
    shape = SHAPES[name]()
    return make_region(shape.mesh, shape.selected)


TRAPEZOID = region_of("trapezoid")
FIELD = make_region(shapes.coarse_sheet(shapes.rectangle_outline(100, 100)), np.ones(2, bool))


def laid_by_hand(points: list[tuple[float, float]], diameters: list[float], pitch: float = 3.0) -> Pattern:
    """Features on the square of 100 x 100 about the origin."""
    n = len(points)
    position = np.concatenate([np.array(points, dtype=float).reshape(n, 2), np.zeros((n, 1))], axis=1)
    up = np.tile([0.0, 0, 1], (n, 1))
    places = Places(position, np.zeros(n, np.int64), np.full((n, 3), 1 / 3))
    along = np.tile([1.0, 0, 0], (n, 1))
    return Pattern(
        places, up, along, np.full(n, pitch), np.array(diameters, dtype=float), np.zeros(n, np.int64)
    )


def sizes(points: list[tuple[float, float]], diameters: list[float], limits: Limits = NO_LIMITS) -> Floats:
    """Diameters within the limits; 0 for features that are left out."""
    diameter, kept = within_limits(laid_by_hand(points, diameters), FIELD, limits)
    return np.where(kept, diameter, 0.0)


# -- the rule ------------------------------------------------------------------------------------------------


def test_two_features_with_too_narrow_a_web_shrink_in_proportion() -> None:
    found = sizes([(0, 0), (3, 0)], [4.0, 2.0], Limits(min_web=0.6))
    assert np.allclose(found, np.array([4.0, 2.0]) * (2 * 2.4 / 6))


def test_a_feature_between_two_shrinks_by_the_tighter_web() -> None:
    found = sizes([(0, 0), (3, 0), (5, 0)], [3.0, 3.0, 3.0], Limits(min_web=0.5))
    assert np.allclose(found, [2.5, 1.5, 1.5])


def test_webs_wide_enough_change_nothing() -> None:
    assert sizes([(0, 0), (3, 0)], [2.0, 2.0], Limits(min_web=0.999)).tolist() == [2.0, 2.0]


def test_where_nothing_is_asked_features_still_do_not_touch() -> None:
    found = sizes([(0, 0), (3, 0)], [4.0, 4.0])
    assert np.allclose(found, 3 - LEAST_WEB * 3)


def test_a_feature_at_the_boundary_keeps_its_margin() -> None:
    assert np.allclose(sizes([(48, 0)], [3.0], Limits(min_margin=1.2)), 1.6)
    assert np.allclose(sizes([(48, 0)], [9.0]), 2 * (2 - LEAST_WEB / 2 * 3))


def test_what_would_be_too_small_is_left_out_and_its_neighbour_stays_as_it_is() -> None:
    limits = Limits(min_web=0.5, min_diameter=1.0)
    assert sizes([(0, 0), (2, 0)], [4.0, 1.1], limits).tolist() == [4.0, 0.0]
    assert sizes([(0, 0), (48, 0)], [0.9, 2.0], limits).tolist() == [0.0, 2.0]
    assert sizes([(49.9, 0)], [2.0], limits).tolist() == [0.0]


def test_of_two_that_are_too_small_together_the_smaller_or_the_later_goes() -> None:
    limits = Limits(min_web=0.5, min_diameter=2.0)
    assert sizes([(0, 0), (2, 0)], [2.2, 2.1], limits).tolist() == [2.2, 0.0]
    assert sizes([(0, 0), (2, 0)], [2.1, 2.2], limits).tolist() == [0.0, 2.2]
    assert sizes([(0, 0), (2, 0)], [2.1, 2.1], limits).tolist() == [2.1, 0.0]


def test_every_other_one_of_a_row_that_is_too_tight_goes() -> None:
    row = [(2.0 * number, 0.0) for number in range(-20, 21)]
    found = sizes(row, [2.1] * 41, Limits(min_web=0.5, min_diameter=2.0))
    assert found.tolist() == [2.1, 0.0] * 20 + [2.1]


def test_two_features_in_one_place_become_one() -> None:
    assert sizes([(0, 0), (0, 0), (5, 0)], [1.0, 1.0, 1.0]).tolist() == [1.0, 0.0, 1.0]


def test_the_larger_finds_small_ones_far_off() -> None:
    """A feature as wide as ten pitches reaches those that look no farther than their own size."""
    found = sizes([(0, 0), (10.0, 0), (0, 9.9), (30.0, 0)], [19.0, 2.0, 2.0, 2.0])
    assert found[0] < 19
    assert found[3] == 2
    assert (np.hypot([10.0, 0], [0, 9.9]) - (found[0] + found[1:3]) / 2 >= 0.06 - 1e-9).all()


def test_both_sides_of_a_wall_do_not_feel_each_other_both_sides_of_an_edge_do() -> None:
    wall = laid_by_hand([(0, 0), (0.5, 0)], [2.0, 2.0])
    wall.normal[1] = (0, 0, -1)
    wall.position[1, 2] = -0.3
    box = make_region(SHAPES["capsule"]().mesh, SHAPES["capsule"]().selected)
    assert not box.single_sheet
    assert within_limits(wall, replace(box, rim=box.rim[:0]), NO_LIMITS)[0].tolist() == [2.0, 2.0]
    wall.normal[1] = (1, 0, 0)
    assert (within_limits(wall, replace(box, rim=box.rim[:0]), NO_LIMITS)[0] < 1).all()


# -- in patterns ---------------------------------------------------------------------------------------------


def check_limits(region: Region, pattern: Pattern, limits: Limits) -> None:
    """All pairs, not neighbours alone; the region is flat."""
    n = len(pattern)
    gap = np.linalg.norm(pattern.position[:, None] - pattern.position[None], axis=2)
    web = gap - (pattern.diameter[:, None] + pattern.diameter[None]) / 2
    least = np.maximum(limits.min_web, LEAST_WEB * (pattern.pitch[:, None] + pattern.pitch[None]) / 2)
    assert (web + np.eye(n) * 1e9 >= least).all()
    margin = boundary_distance(pattern.position, region.boundary_segments) - pattern.diameter / 2
    assert (margin >= np.maximum(limits.min_margin, LEAST_WEB / 2 * pattern.pitch)).all()
    # a field that ends at the least diameter may come out a last bit below it
    assert (pattern.diameter >= limits.min_diameter * (1 - SAME)).all()
    assert (pattern.diameter > 0).all()
    assert (pattern.diameter <= pattern.wished).all()
    if n > 1:
        assert min_web(pattern) >= limits.min_web
    assert min_margin(pattern, region) >= limits.min_margin


def everything(pattern: Pattern) -> list[bytes]:
    columns = (pattern.position, pattern.diameter, pattern.pitch, pattern.row, pattern.ids, pattern.normal)
    return [np.ascontiguousarray(column).tobytes() for column in columns]


coordinates = st.tuples(st.floats(-60, 60), st.floats(-40, 40), st.just(0.0))


@st.composite
def random_fields(draw: st.DrawFn, low: float, high: float) -> Described:
    way = {"from_": draw(st.floats(low, high)), "to": draw(st.floats(low, high))}
    way["falloff"] = draw(st.sampled_from(["linear", "smooth", "sphere", "root", "sharp"]))
    way["invert"] = draw(st.booleans())
    kind = draw(st.integers(0, 3))
    if kind == 0:
        return Linear(**way, direction=draw(st.sampled_from([(1, 0, 0), (0, 1, 0), (1, -2, 0)])))
    if kind == 1:
        return Radial(**way, centre=draw(coordinates), radius=draw(st.floats(5, 60)))
    if kind == 2:
        return Edge(**way, distance=draw(st.floats(3, 30)))
    points = draw(st.lists(coordinates, min_size=1, max_size=4))
    return Distance(**way, distance=draw(st.floats(3, 40)), points=tuple(points))


@st.composite
def shapings(draw: st.DrawFn) -> Shaping:
    one, other = draw(random_fields(0.3, 8.0)), draw(random_fields(0.3, 8.0))
    mask = draw(random_fields(0.0, 1.0))
    size = draw(
        st.sampled_from([one, Most(of=(one, other)), Blend(first=one, second=other, mask=mask)])
        | st.just(Fill(Product(of=(mask, Constant(0.5)))))
    )
    if isinstance(size, Fill):
        size = Fill(Most(of=(size.share, Constant(0.1))))
    seeds = draw(st.lists(st.floats(0.5, 7), max_size=3))
    at = [(-40.0, -20.0, 0.0), (-10.0, 30.0, 0.0), (38.0, -30.0, 0.0)]
    return Shaping(size, tuple(Seed(p, d) for p, d in zip(at, seeds, strict=False)))


PACKING = Packing(pitch=Constant(5.0), iterations=30)
BUBBLES = drive(pattern_steps(TRAPEZOID, Recipe(packing=PACKING)))
limits = st.builds(Limits, st.floats(0, 2), st.floats(0, 3), st.floats(0, 1.5))


@given(shapings(), limits)
@settings(max_examples=40, deadline=None, derandomize=True)
def test_the_limits_hold_for_any_fields(shaping: Shaping, limits: Limits) -> None:
    recipe = Recipe(packing=PACKING, shaping=shaping, limits=limits)
    try:
        pattern = reshaped(BUBBLES, TRAPEZOID, recipe, NOTHING)
    except RecipeError as error:
        assert "No feature is left" in str(error)  # noqa: PT017
        return
    check_limits(TRAPEZOID, pattern, limits)
    assert everything(reshaped(pattern, TRAPEZOID, recipe, NOTHING)) == everything(pattern)


@given(random_fields(3.0, 9.0), shapings(), limits)
@settings(max_examples=6, deadline=None, derandomize=True)
def test_the_limits_hold_on_graded_packings_too(pitch: Described, shaping: Shaping, limits: Limits) -> None:
    shaping = replace(shaping, seeds=())
    recipe = Recipe(packing=replace(PACKING, pitch=pitch), shaping=shaping, limits=limits)
    try:
        pattern = drive(pattern_steps(TRAPEZOID, recipe))
    except RecipeError as error:
        assert "No feature is left" in str(error)  # noqa: PT017
        return
    check_limits(TRAPEZOID, pattern, limits)
    assert (boundary_distance(pattern.position, TRAPEZOID.boundary_segments) > 0).all()
    assert everything(drive(pattern_steps(TRAPEZOID, recipe))) == everything(pattern)


STEEP = Shaping(Linear(from_=0.5, to=8.0, direction=(1, 0, 0)))


def test_a_feature_keeps_its_id_whoever_else_is_left_out() -> None:
    recipe = Recipe(packing=PACKING, shaping=STEEP)
    strict = replace(recipe, limits=Limits(min_web=1.0, min_margin=2.0, min_diameter=2.0))
    pattern = drive(pattern_steps(TRAPEZOID, strict))
    assert pattern.dropped is not None
    assert 0 < len(pattern.dropped) < len(BUBBLES)
    assert len(pattern) + len(pattern.dropped) == len(BUBBLES)
    assert np.array_equal(pattern.position, BUBBLES.position[pattern.ids])
    assert np.array_equal(pattern.dropped.position, BUBBLES.position[pattern.dropped.ids])
    assert (np.diff(pattern.ids) > 0).all()
    whole = all_bubbles(pattern)
    assert np.array_equal(whole.position, BUBBLES.position)
    assert np.array_equal(whole.ids, np.arange(len(BUBBLES)))
    # shaped anew without the limits, all of them are back
    again = reshaped(pattern, TRAPEZOID, recipe, NOTHING)
    assert everything(again) == everything(drive(pattern_steps(TRAPEZOID, recipe)))
    assert len(again) > len(pattern)


def test_shrunk_features_are_those_that_are_smaller_than_they_should_be() -> None:
    limits = Limits(min_web=1.0)
    pattern = drive(pattern_steps(TRAPEZOID, Recipe(packing=PACKING, shaping=STEEP, limits=limits)))
    x = TRAPEZOID.corners[..., 0]
    wished = 0.5 + 7.5 * (pattern.position[:, 0] - x.min()) / np.ptp(x)
    assert np.allclose(pattern.wished, wished)
    assert np.array_equal(pattern.shrunk, np.flatnonzero(pattern.diameter < 0.999999 * pattern.wished))
    assert 0 < len(pattern.shrunk) < len(pattern)
    rest = np.setdiff1d(np.arange(len(pattern)), pattern.shrunk)
    assert np.array_equal(pattern.diameter[rest], pattern.wished[rest])


@pytest.mark.parametrize("name", ["panel", "capsule", "thin-wall", "parts"])
def test_the_limits_hold_on_curved_and_facing_surfaces(name: str) -> None:
    shape = SHAPES[name]()
    region, pitch = region_of(name), 2 * shape.pitch
    size = Linear(from_=0.3 * pitch, to=1.6 * pitch, direction=(1.0, 2.0, 0.5))
    limits = Limits(min_web=0.3 * pitch, min_margin=0.2 * pitch, min_diameter=0.4 * pitch)
    packing = Packing(pitch=Constant(pitch), iterations=20)
    pattern = drive(pattern_steps(region, Recipe(packing=packing, shaping=Shaping(size), limits=limits)))
    assert min_web(pattern) >= limits.min_web
    assert min_margin(pattern, region) >= limits.min_margin
    assert pattern.diameter.min() >= limits.min_diameter
    assert len(pattern.shrunk) > 0
    assert pattern.dropped is not None
    assert (pattern.dropped.diameter == 0).all()


def test_seeds_give_way_to_the_limits_too() -> None:
    seeds = (Seed((-40.0, -20.0, 0.0), 20.0), Seed((38.0, -30.0, 0.0), 2.0))
    pattern = drive(pattern_steps(TRAPEZOID, Recipe(packing=PACKING, shaping=Shaping(seeds=seeds))))
    assert pattern.wished.max() == 20.0
    check_limits(TRAPEZOID, pattern, NO_LIMITS)


def test_limits_that_leave_nothing_are_told_with_their_values() -> None:
    recipe = Recipe(packing=PACKING, limits=Limits(min_margin=60.0))
    with pytest.raises(RecipeError, match=r"No feature is left: .*min_margin = 60"):
        drive(pattern_steps(TRAPEZOID, recipe))


def test_nothing_to_limit() -> None:
    assert len(limited(laid_by_hand([], []), FIELD, NO_LIMITS)) == 0


def test_a_field_that_is_no_length_after_all_is_refused() -> None:
    """One without bounds gets past the door; here it is met."""
    way = {"start": (-100.0, 0.0, 0.0), "end": (-99.0, 0.0, 0.0), "clamp": False}
    field = Linear(from_=3.0, to=2.9, **way)
    check_recipe(Recipe(packing=Packing(pitch=field)))
    with pytest.raises(RegionError, match=r"pitch is .* at .* it must be a positive length"):
        drive(pattern_steps(TRAPEZOID, Recipe(packing=Packing(pitch=field))))
    with pytest.raises(RecipeError, match="diameter must be a positive length"):
        drive(pattern_steps(TRAPEZOID, Recipe(packing=PACKING, shaping=Shaping(diameter=field))))


def test_what_a_field_lacks_is_told_with_the_recipe_s_key() -> None:
    field = Attribute(from_=1.0, to=2.0, name="Weight")
    with pytest.raises(FieldError, match=r"^\[packing\] pitch: name = "):
        drive(pattern_steps(TRAPEZOID, Recipe(packing=Packing(pitch=field))))
    with pytest.raises(FieldError, match=r"^\[shaping\] diameter: name = "):
        drive(pattern_steps(TRAPEZOID, Recipe(packing=PACKING, shaping=Shaping(diameter=field))))


def test_a_number_reaches_the_packing_as_one_a_field_bound(monkeypatch: pytest.MonkeyPatch) -> None:
    seen = []

    def watch(region: Region, packing: Packing):
        seen.append(packing.pitch)
        return pack_steps(region, packing)

    monkeypatch.setattr(pipeline, "pack_steps", watch)
    drive(pattern_steps(TRAPEZOID, Recipe(packing=PACKING)))
    # a product of numbers is packed as any other field, to the same end
    pitch = Product(of=(Constant(2.5), Constant(2.0)))
    drive(pattern_steps(TRAPEZOID, Recipe(packing=replace(PACKING, pitch=pitch))))
    assert seen[0] is PACKING.pitch
    assert isinstance(seen[1], Bound)
    assert (seen[1](BUBBLES.places) == 5.0).all()
