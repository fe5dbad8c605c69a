"""Solve for: the target is met by the lengths in the recipe that comes out, or it is said that it can't."""

from __future__ import annotations

import json
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bubble_pattern_addon import batch
from bubble_pattern_addon.core import solving
from bubble_pattern_addon.core.blending import Blend, Fill, Least, Most, Product, SubRegions
from bubble_pattern_addon.core.errors import RecipeError, RegionError
from bubble_pattern_addon.core.fields import Linear, Radial
from bubble_pattern_addon.core.files import write_mesh
from bubble_pattern_addon.core.floors import broken_rules, floors_of
from bubble_pattern_addon.core.metric import Bound, Constant, Described, Places
from bubble_pattern_addon.core.pipeline import pattern_steps
from bubble_pattern_addon.core.progress import Progress, drive
from bubble_pattern_addon.core.quality import open_area
from bubble_pattern_addon.core.recipe import Feature, Limits, Packing, Recipe, Seed, Shaping, Solve
from bubble_pattern_addon.core.region import Region, make_region
from bubble_pattern_addon.core.scaling import scaled
from bubble_pattern_addon.core.solving import MOST_PACKINGS, TOLERANCE, Solved, solving_steps
from scripts.shapes import SHAPES
from tests.core.bases import box

PITCH = 6.0
LINEAR = Linear(from_=2.0, to=4.5, direction=(1.0, 0.0, 0.0))
GRADED_FILL = Fill(scaled(LINEAR, 0.15))


def region_of(name: str) -> Region:
    shape = SHAPES[name]()
    return make_region(shape.mesh, shape.selected)


TRAPEZOID = region_of("trapezoid")


def recipe(diameter: Described = LINEAR, pitch: Described | None = None, **more: object) -> Recipe:
    return replace(
        Recipe(packing=Packing(pitch=pitch or Constant(PITCH)), shaping=Shaping(diameter)),
        **more,  # type: ignore[arg-type]
    )


def solved(region: Region, asked: Recipe) -> Solved:
    return drive(solving_steps(region, asked))


def check(region: Region, asked: Recipe, found: Solved) -> None:
    """What came out is what its own recipe gives, within the limits, and as near to the target as is said."""
    again = drive(pattern_steps(region, found.recipe))
    assert np.array_equal(again.diameter, found.pattern.diameter)
    assert np.array_equal(again.position, found.pattern.position)
    assert not found.recipe.solve
    value = len(again) if asked.solve.count is not None else open_area(again, region)
    assert found.reached == pytest.approx(value, rel=1e-12)
    one = 1.0 if asked.solve.count is not None else value / len(again)
    near = abs(found.reached - found.wanted) <= max(TOLERANCE * found.wanted, one) * (1 + 1e-9)
    assert found.met == near
    assert found.met != any("can't be met exactly" in note for note in found.pattern.notes)
    assert not broken_rules(again, region, floors_of(again, region, asked.limits))


# -- by the diameter -----------------------------------------------------------------------------------------


@settings(max_examples=8, deadline=None, derandomize=True)
@given(
    target=st.floats(0.02, 0.45),
    diameter=st.sampled_from([Constant(3.0), LINEAR, Fill(Constant(0.5)), GRADED_FILL]),
    web=st.floats(0.0, 1.2),
    least=st.floats(0.0, 0.4),
)
def test_the_diameter_meets_the_open_area_within_the_limits(
    target: float, diameter: Described, web: float, least: float
) -> None:
    asked = recipe(diameter, limits=Limits(min_web=web, min_diameter=least), solve=Solve(open_area=target))
    if diameter == GRADED_FILL and target > 0.36:
        # the largest feature leaves its least web, and the others are far smaller
        with suppress(RecipeError):
            assert solved(TRAPEZOID, asked).met
        return
    found = solved(TRAPEZOID, asked)
    check(TRAPEZOID, asked, found)
    assert found.reached == pytest.approx(target, rel=TOLERANCE)
    assert found.packings == 1


def test_shares_of_the_pitch_are_not_taken_to_where_no_web_is_left() -> None:
    with pytest.raises(RecipeError, match=r"45\.0% can't be reached by the diameter: .* to 43\.\d% at most"):
        solved(TRAPEZOID, recipe(GRADED_FILL, solve=Solve(open_area=0.45)))
    assert solved(TRAPEZOID, recipe(GRADED_FILL, solve=Solve(open_area=0.43))).met


def test_without_limits_the_second_shaping_is_the_pattern() -> None:
    found = solved(TRAPEZOID, recipe(Constant(3.0), solve=Solve(open_area=0.3)))
    assert found.shapings == 2
    assert found.reached == pytest.approx(0.3, rel=1e-5)


@pytest.mark.parametrize("by", ["diameter", "pitch"])
def test_slots_open_as_much_as_asked(by: str) -> None:
    """Their own area counts, not that of the circles round them."""
    asked = recipe(feature=Feature(profile="slot", aspect=0.5), solve=Solve(open_area=0.12, by=by))
    found = solved(TRAPEZOID, asked)
    again = drive(pattern_steps(TRAPEZOID, found.recipe))
    assert again.share is not None
    assert found.met
    assert found.reached == pytest.approx(open_area(again, TRAPEZOID))
    assert found.reached == pytest.approx(0.12, rel=1e-4 if by == "diameter" else 0.03)


def test_seeds_grow_with_the_rest() -> None:
    seeds = (Seed((-40.0, -20.0, 0.0), 2.0), Seed((38.0, -30.0, 0.0), 4.0))
    asked = recipe(solve=Solve(open_area=0.25))
    asked = replace(asked, shaping=replace(asked.shaping, seeds=seeds))
    found = solved(TRAPEZOID, asked)
    check(TRAPEZOID, asked, found)
    assert found.met
    sizes = [seed.diameter for seed in found.recipe.shaping.seeds]
    assert sizes == pytest.approx([2.0 * found.factor, 4.0 * found.factor], rel=1e-5)


def test_limits_that_make_it_impossible_are_told_with_what_can_be_reached() -> None:
    limits = Limits(min_web=3.0)
    with pytest.raises(RecipeError, match=r"60\.0% can't be reached by the diameter: .* to 1\d\.\d% at most"):
        solved(TRAPEZOID, recipe(Constant(2.0), limits=limits, solve=Solve(open_area=0.6)))
    with pytest.raises(RecipeError, match="can't be reached by the diameter"):
        solved(TRAPEZOID, recipe(limits=limits, solve=Solve(open_area=0.6)))


def test_nominal_sizes_come_as_near_as_they_can() -> None:
    asked = recipe(Constant(3.0), solve=Solve(open_area=0.3))
    asked = replace(asked, shaping=replace(asked.shaping, sizes=(1.0, 2.0, 3.0, 4.0)))
    found = solved(TRAPEZOID, asked)
    check(TRAPEZOID, asked, found)
    assert not found.met
    assert set(found.pattern.diameter) <= {3.0, 4.0}
    graded = replace(asked, shaping=replace(asked.shaping, diameter=LINEAR))
    found = solved(TRAPEZOID, graded)
    check(TRAPEZOID, graded, found)
    assert found.reached == pytest.approx(0.3, rel=0.02)


# -- by the pitch --------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["trapezoid", "panel"])
@pytest.mark.parametrize("count", [40, 150])
def test_the_pitch_meets_the_count_within_one_feature(name: str, count: int) -> None:
    region = region_of(name)
    asked = recipe(Fill(Constant(0.6)), Constant(np.sqrt(region.area) / 12), solve=Solve(count=count))
    found = solved(region, asked)
    check(region, asked, found)
    assert abs(len(found.pattern) - count) <= 1
    assert found.packings <= MOST_PACKINGS


def test_the_pitch_meets_the_count_on_a_closed_surface() -> None:
    region = region_of("sphere")
    asked = recipe(Fill(Constant(0.6)), Constant(np.sqrt(region.area) / 12), solve=Solve(count=60))
    found = solved(region, asked)
    assert abs(len(found.pattern) - 60) <= 1


def test_a_graded_pitch_keeps_its_grading() -> None:
    pitch = Radial(from_=5.0, to=9.0, centre=(0.0, 0.0, 0.0))
    asked = recipe(Fill(Constant(0.6)), pitch, solve=Solve(count=90))
    found = solved(TRAPEZOID, asked)
    check(TRAPEZOID, asked, found)
    assert found.met
    assert found.recipe.packing.pitch == scaled(pitch, found.factor)


@pytest.mark.parametrize("diameter", [Constant(3.0), LINEAR])
def test_the_pitch_meets_the_open_area_with_the_diameters_as_they_are(diameter: Described) -> None:
    asked = recipe(diameter, solve=Solve(open_area=0.28, by="pitch"))
    found = solved(TRAPEZOID, asked)
    check(TRAPEZOID, asked, found)
    assert found.met
    assert found.recipe.shaping == asked.shaping


@pytest.mark.parametrize(("name", "count"), [("strip", 333), ("square", 317), ("l", 100), ("tube", 100)])
def test_a_count_between_two_jumps_is_met_by_another_start(
    name: str, count: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Along straight edges a pattern loses or wins a whole row at once."""
    region = region_of(name)
    asked = recipe(Fill(Constant(0.6)), Constant(np.sqrt(region.area) / 20), solve=Solve(count=count))
    found = solved(region, asked)
    check(region, asked, found)
    assert found.met
    assert found.recipe.packing.seed > 0
    assert any("starts elsewhere" in note for note in found.pattern.notes)

    monkeypatch.setattr(solving, "SEEDS", 1)
    found = solved(region, asked)
    check(region, asked, found)
    assert not found.met
    assert found.packings <= MOST_PACKINGS
    assert any(f"{count} features can't be met exactly by the pitch" in note for note in found.pattern.notes)


def test_features_that_would_touch_are_told() -> None:
    with pytest.raises(RecipeError, match=r"2,000 features of this diameter don't fit .*: about \d+ do"):
        solved(TRAPEZOID, recipe(Constant(5.0), solve=Solve(count=2000)))
    asked = recipe(Constant(4.0), limits=Limits(min_web=2.0), solve=Solve(open_area=0.8, by="pitch"))
    with pytest.raises(RecipeError, match=r"can't be reached by the pitch: .* take \d+\.\d% at most"):
        solved(TRAPEZOID, asked)


def test_a_pitch_too_large_for_any_bubble_is_only_a_trial() -> None:
    region = region_of("one")
    found = solved(region, recipe(Fill(Constant(0.6)), Constant(region.extent / 2), solve=Solve(count=1)))
    assert abs(len(found.pattern) - 1) <= 1
    broad = recipe(Fill(Constant(0.6)), Constant(region.extent * 9), solve=Solve(count=3))
    assert solved(region, broad).met


def test_an_error_that_is_not_the_trials_stays_one() -> None:
    field = Linear(from_=3.0, to=2.9, start=(-100.0, 0.0, 0.0), end=(-99.0, 0.0, 0.0), clamp=False)
    with pytest.raises(RegionError, match="must be a positive length"):
        solved(TRAPEZOID, recipe(Fill(Constant(0.6)), field, solve=Solve(count=100)))


def test_the_same_twice_and_progress_that_never_goes_back() -> None:
    asked = recipe(Fill(Constant(0.6)), solve=Solve(count=120))
    seen: list[Progress] = []
    one = drive(solving_steps(TRAPEZOID, asked), seen.append)
    other = solved(TRAPEZOID, asked)
    assert one.recipe == other.recipe
    assert np.array_equal(one.pattern.position, other.pattern.position)
    fractions = [progress.fraction for progress in seen]
    assert fractions == sorted(fractions)
    assert fractions[-1] <= 1.0


def test_nothing_to_solve_is_refused() -> None:
    with pytest.raises(RecipeError, match=r"\[solve\] has no target"):
        solved(TRAPEZOID, recipe())


# -- scaled fields -------------------------------------------------------------------------------------------


@settings(max_examples=20, deadline=None, derandomize=True)
@given(factor=st.floats(0.05, 20.0), x=st.floats(-50, 50))
def test_a_scaled_field_is_the_field_times_the_factor(factor: float, x: float) -> None:
    other = Radial(from_=1.0, to=3.0, centre=(0.0, 0.0, 0.0), radius=40.0)
    line = Linear(from_=2.0, to=4.5, start=(-50.0, 0.0, 0.0), end=(50.0, 0.0, 0.0), falloff="smooth")
    places = Places(np.array([[x, 1.0, 0.0]]), np.zeros(1, np.int64), np.full((1, 3), 1 / 3))
    mask = Radial(from_=0.0, to=1.0, centre=(0.0, 0.0, 0.0), radius=40.0)
    fields: list[Described] = [
        Constant(2.0),
        line,
        Product(of=(line, other)),
        Least(of=(line, other)),
        Most(of=(line, other)),
        Blend(first=line, second=other, mask=mask),
        Bound(lambda places: places.position[:, 0] + 60.0),
    ]
    for field in fields:
        assert scaled(field, factor)(places) == pytest.approx(factor * field(places), rel=1e-5)
    assert type(scaled(line, factor)) is Linear
    assert scaled(Fill(Constant(0.5)), 1.2) == Fill(Constant(0.6))
    sets = scaled(SubRegions(sets=(), otherwise=Constant(2.0)), 2.0)
    assert sets == SubRegions(sets=(), otherwise=Constant(4.0))


# -- the batch run -------------------------------------------------------------------------------------------

FILE = """\
[region]
near = [0.0, 0.0, 0.0]
[packing]
pitch = 5.0
[shaping]
diameter = 2.5
sizes = "drills 0.1"
[limits]
process = "punched sheet"
[solve]
open_area = {target}
[output]
density = 7.85
"""


def run(folder: Path, target: float) -> int:
    write_mesh(folder / "plate.stl", box((-30.0, -20.0, -1.5), (30.0, 20.0, 0.0)))
    (folder / "recipe.toml").write_text(FILE.format(target=target))
    options = [str(folder / "recipe.toml"), "--base", str(folder / "plate.stl"), "--out", str(folder / "out")]
    return batch.main([*options, "--quiet"])


def test_a_batch_run_solves_and_reports_all_of_it(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(tmp_path, 0.2) == 0
    report = json.loads((tmp_path / "out" / "report.json").read_text())
    assert report["open_area"] == pytest.approx(0.2, rel=0.05)
    assert report["solve"]["by"] == "diameter"
    assert report["solve"]["reached"] == pytest.approx(report["open_area"])
    assert report["process"] == "punched sheet"
    assert report["broken"] == []
    assert report["smallest_web"]["length"] == pytest.approx(report["min_web"])
    assert report["mean_web"] >= report["min_web"] >= 1.5
    assert report["diameter"]["min"] >= 1.5
    assert report["removed_mass"] == pytest.approx(7.85e-3 * report["removed_volume"])
    assert sum(entry["features"] for entry in report["nominal"]) == report["features"]
    assert set(report["in_words"]) == {"order", "gaps", "smallest_gap", "first_row"}
    assert "[solve]" not in (tmp_path / "out" / "recipe.toml").read_text()
    assert "holes" in capsys.readouterr().out


def test_drills_are_as_large_on_a_base_in_metres(tmp_path: Path) -> None:
    """A glTF file says that it is in metres; the recipe does not, so its lengths are metres too."""
    plate = box((-0.03, -0.02, -0.0015), (0.03, 0.02, 0.0))
    write_mesh(tmp_path / "plate.glb", plate)
    text = FILE.format(target=0.2).replace("pitch = 5.0", "pitch = 0.005").replace("2.5", "0.0025")
    (tmp_path / "recipe.toml").write_text(text)
    options = [str(tmp_path / "recipe.toml"), "--base", str(tmp_path / "plate.glb")]
    assert batch.main([*options, "--out", str(tmp_path / "out"), "--quiet"]) == 0
    report = json.loads((tmp_path / "out" / "report.json").read_text())
    sizes = [1000 * entry["diameter"] for entry in report["nominal"]]
    assert np.allclose(np.round(sizes, 1), sizes)
    assert min(sizes) >= 1.5
    assert report["removed_mass"] == pytest.approx(7.85e6 * report["removed_volume"])


def test_a_batch_run_that_can_not_solve_leaves_nothing(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(tmp_path, 0.8) == 1
    assert "can't be reached" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()
