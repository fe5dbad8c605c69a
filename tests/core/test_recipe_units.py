"""The unit of a recipe: what is a length is converted, what is none stays, and patterns stay the same."""

from __future__ import annotations

import tomllib
from dataclasses import fields, replace

import numpy as np
import pytest

from bubble_pattern_addon.core import recipe_units
from bubble_pattern_addon.core.errors import RecipeError
from bubble_pattern_addon.core.mesh import Mesh
from bubble_pattern_addon.core.pipeline import pattern_steps
from bubble_pattern_addon.core.progress import drive
from bubble_pattern_addon.core.recipe import Recipe, default_recipe
from bubble_pattern_addon.core.recipe_checks import check_recipe
from bubble_pattern_addon.core.recipe_file import recipe_from_dict, recipe_to_toml
from bubble_pattern_addon.core.recipe_units import fitted_recipe, recipe_in, scaled_recipe
from bubble_pattern_addon.core.region import make_region
from bubble_pattern_addon.core.units import UNITS, millimetres_in, unit_of

from .bases import slab

# Keys that hold numbers, points or fields but no length.
PURE = {
    "region": {"max_angle"},
    "packing": {"orientation", "tolerance", "symmetry_axes"},
    "shaping": {"tolerance"},
    "feature": {
        *("draft", "rim_angle", "aspect", "rounding", "points", "axis", "pull", "turn_direction", "angle"),
    },
    "limits": set(),
    "solve": {"open_area"},
    "output": {"projection", "unit", "density"},
}
NUMBERS = ("float", "Point", "Described", "Size", "Seed", "KeepOut")

GRADED = """
[region]
all = true
keep_out = [{ cylinder = [40, 0, 0], diameter = 6, axis = [0, 0, 1], reach = 2, margin = 0.5 }]
[packing]
pitch = { kind = "linear", from = 1.6, to = 2.4, start = [-12, 0, 0], end = [12, 0, 0] }
edge_offset = 0.1
symmetry_centre = [1, 2, 3]
[shaping.diameter]
kind = "min"
of = [{ kind = "multiply", of = [{ kind = "constant", value = 1.4 }, RADIAL] }, BLEND]
[feature]
depth = 0.5
[limits]
min_web = 0.2
min_margin = 0.3
min_diameter = 0.1
"""
RADIAL = '{ kind = "radial", from = 1, to = 0.5, centre = [0, 0, 4], inner = 2, radius = 14 }'
BLEND = (
    '{ kind = "blend", first = { kind = "fill", share = 0.7 }, second = { kind = "constant", value = 1.1 }, '
    'mask = { kind = "boundary", from = 0, to = 1, distance = 6 } }'
)


def graded() -> Recipe:
    return recipe_from_dict(tomllib.loads(GRADED.replace("RADIAL", RADIAL).replace("BLEND", BLEND)))


def test_of_every_number_it_is_known_whether_it_is_a_length() -> None:
    for section in fields(Recipe):
        table = getattr(Recipe(), section.name)
        numbers = {entry.name for entry in fields(table) if any(word in str(entry.type) for word in NUMBERS)}
        known = {*recipe_units.LENGTHS[section.name]} | PURE[section.name]
        assert numbers <= known, (
            f"[{section.name}] {numbers - known}: length or not? See recipe_units.LENGTHS"
        )
        assert set(recipe_units.LENGTHS[section.name]) <= {entry.name for entry in fields(table)}


@pytest.mark.parametrize("factor", [0.001, 25.4])
def test_a_scaled_recipe_makes_the_same_pattern_on_a_scaled_base(factor: float) -> None:
    mesh = slab()
    top = np.arange(len(mesh.triangles)) < 288
    recipe = graded()
    small = drive(pattern_steps(make_region(mesh, top), recipe))
    large_region = make_region(Mesh(mesh.vertices * factor, mesh.triangles), top)
    scaled = scaled_recipe(recipe, factor)
    check_recipe(scaled)
    large = drive(pattern_steps(large_region, scaled))
    assert len(small) == len(large)
    assert large.diameter == pytest.approx(small.diameter * factor, rel=1e-3)
    assert large.position == pytest.approx(small.position * factor, abs=2e-3 * factor)
    limits, was = scaled.limits, recipe.limits
    assert (limits.min_web, limits.min_margin) == pytest.approx(
        (was.min_web * factor, was.min_margin * factor)
    )
    assert scaled.feature.depth == pytest.approx(0.5 * factor)
    assert scaled.packing.symmetry_centre == pytest.approx(np.array([1, 2, 3]) * factor)
    (around,) = scaled.region.keep_out
    assert around.cylinder == pytest.approx((40 * factor, 0, 0))
    assert (around.diameter, around.reach, around.margin) == pytest.approx(np.array([6, 2, 0.5]) * factor)
    assert around.axis == (0, 0, 1)


def test_there_and_back_again_is_the_same_recipe() -> None:
    recipe = replace(graded(), output=replace(Recipe().output, unit="mm"))
    metres = recipe_in(recipe, "m", "mm")
    assert metres.output.unit == "m"
    assert metres.feature.depth == 0.0005  # no 0.0005000000000000001
    assert recipe_in(metres, "mm", "m") == recipe
    assert recipe_from_dict(tomllib.loads(recipe_to_toml(metres))) == metres
    assert scaled_recipe(recipe, 1) is recipe


def test_lengths_are_converted_where_both_say_their_unit() -> None:
    data = tomllib.loads('[packing]\npitch = 2\n[shaping]\ndiameter = 1.2\n[output]\nunit = "mm"')
    fitting = default_recipe(0.01, 0.4, graded().region)  # 10 cm square, in metres
    metres = fitted_recipe(data, fitting, 1000.0)
    assert metres.packing.pitch.bounds() == (0.002, 0.002)
    assert metres.output.unit == "m"
    assert fitted_recipe(data, fitting, None).packing.pitch.bounds() == (2, 2)
    del data["output"]
    assert fitted_recipe(data, fitting, 1000.0).packing.pitch.bounds() == (2, 2)
    silent = fitted_recipe({"output": {"unit": "in"}}, fitting, 1000.0)
    assert silent.packing == fitting.packing  # what is not given fits the region, whatever the unit


def test_units_have_names() -> None:
    assert unit_of(1000.0) == "m"
    assert unit_of(25.4) == "in"
    assert unit_of(7.0) == 7.0
    assert all(millimetres_in(name) == length for name, length in UNITS.items())
    assert millimetres_in(7.0) == 7.0


@pytest.mark.parametrize(
    ("output", "words"),
    [
        ('unit = "mmm"', "is no unit"),
        ("unit = 0", "must be"),
        ("unit = true", "must be a number"),
        ('drawings = ["pdf"]', "drawings"),
        ('projection = "side"', "projection"),
        ("projection = [0, 0, 0]", "no direction"),
        ('align = "left"', "align"),
    ],
)
def test_nonsense_is_refused(output: str, words: str) -> None:
    with pytest.raises(RecipeError, match=words):
        recipe_from_dict(tomllib.loads(f"[region]\nall = true\n[output]\n{output}"))


def test_what_is_drawn_is_in_the_recipe_file() -> None:
    text = '[region]\nall = true\n[output]\ndrawings = ["dxf"]\nprojection = [0, -1, 0]\nalign = "rows"'
    text += "\nunit = 2.5"
    recipe = recipe_from_dict(tomllib.loads(text))
    assert recipe.output.projection == (0, -1, 0)
    assert recipe.output.unit == 2.5
    assert recipe_from_dict(tomllib.loads(recipe_to_toml(recipe))) == recipe


def test_sizes_and_thickness_are_lengths_and_a_series_is_none() -> None:
    text = "[region]\nall = true\n[shaping]\nsizes = {}\n[limits]\nprocess = \"cnc\"\nthickness = 2.0\n"
    listed = scaled_recipe(recipe_from_dict(tomllib.loads(text.format("[1.0, 2.5]"))), 0.001)
    assert listed.shaping.sizes == (0.001, 0.0025)
    assert listed.limits.thickness == 0.002
    named = scaled_recipe(recipe_from_dict(tomllib.loads(text.format('"R10"'))), 0.001)
    assert named.shaping.sizes == "R10"
