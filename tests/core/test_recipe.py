"""Recipes: what is read is what was written, and everything that makes no sense is refused in plain words."""

import math
import tomllib

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bubble_pattern_addon.core.errors import RecipeError
from bubble_pattern_addon.core.metric import Constant
from bubble_pattern_addon.core.recipe import (
    FORMATS,
    Feature,
    Limits,
    Output,
    Packing,
    Recipe,
    RegionChoice,
    Shaping,
    default_recipe,
    neat,
)
from bubble_pattern_addon.core.recipe_checks import check_recipe
from bubble_pattern_addon.core.recipe_file import load_recipe, recipe_from_dict, recipe_to_toml

coordinates = st.floats(-1e6, 1e6)
lengths = st.floats(1e-6, 1e6)
names = st.text(st.characters(exclude_categories=["Cs"]), min_size=1, max_size=20)
choices = st.one_of(
    st.builds(
        RegionChoice, near=st.tuples(coordinates, coordinates, coordinates), max_angle=st.floats(0, 180)
    ),
    st.builds(RegionChoice, attribute=names),
    st.builds(RegionChoice, material=names),
    st.just(RegionChoice(all=True)),
)


@st.composite
def recipes(draw: st.DrawFn) -> Recipe:
    pitch = draw(lengths)
    diameter = pitch * draw(st.floats(0.05, 0.95))
    return Recipe(
        region=draw(choices),
        packing=Packing(
            pitch=Constant(pitch),
            edge_offset=draw(st.floats(0, 10)),
            orientation=draw(st.sampled_from(["edge", "best", (1.0, 0.0, -0.5)])),
            integrator=draw(st.sampled_from(["fire", "rk4"])),
            seed=draw(st.integers(0, 2**40)),
            iterations=draw(st.integers(1, 10**6)),
            tolerance=draw(st.floats(1e-9, 1)),
        ),
        shaping=Shaping(diameter=Constant(diameter)),
        feature=Feature(
            depth=draw(st.none() | lengths),
            sides=draw(st.none() | st.integers(3, 256)),
            tolerance=draw(st.none() | lengths),
        ),
        limits=Limits(
            min_web=(pitch - diameter) * draw(st.floats(0, 0.99)), min_margin=draw(st.floats(0, 10))
        ),
        output=Output(
            blend=draw(st.booleans()),
            picture=draw(st.booleans()),
            formats=tuple(draw(st.lists(st.sampled_from(FORMATS), max_size=3))),
        ),
    )


@given(recipes())
def test_a_recipe_written_and_read_is_the_same_recipe(recipe: Recipe) -> None:
    assert recipe_from_dict(tomllib.loads(recipe_to_toml(recipe))) == recipe


def test_an_error_tells_its_lengths_as_asked() -> None:
    error = RecipeError("A web of {web} at {pitch}", web=0.5, pitch=2.0)
    assert str(error) == "A web of 0.5 at 2"
    assert error.told(lambda value: f"{1000 * value:g} mm") == "A web of 500 mm at 2000 mm"
    assert str(RecipeError("a {name} in braces")) == "a {name} in braces"


@given(st.floats(1e-9, 1e9))
def test_neat_lengths_are_close_and_short(length: float) -> None:
    assert abs(math.log(neat(length) / length)) < math.log(1.11)
    assert len(f"{neat(length):e}".split("e")[0].rstrip("0")) <= 3  # two digits and a point


@given(st.floats(1e-8, 1e8))
def test_the_default_aims_at_about_500_features(area: float) -> None:
    recipe = default_recipe(area, choice=RegionChoice(all=True))
    pitch = recipe.packing.pitch
    assert isinstance(pitch, Constant)
    assert 400 < area / (math.sqrt(3) / 2 * pitch.value**2) < 625
    assert recipe.shaping.diameter.value == pytest.approx(0.6 * pitch.value)
    check_recipe(recipe)


@given(st.floats(1e-3, 1e3), st.floats(10, 1e4))
def test_a_narrow_strip_gets_three_rows_by_default(width: float, ratio: float) -> None:
    length = ratio * width
    recipe = default_recipe(width * length, 2 * (width + length))
    pitch = recipe.packing.pitch
    assert isinstance(pitch, Constant)
    assert (1 + math.sqrt(3)) * pitch.value < 1.11 * width


ALL = {"region": {"all": True}}


def test_silent_keys_are_filled_from_the_defaults() -> None:
    recipe = recipe_from_dict(ALL, default_recipe(4000.0))
    assert recipe == default_recipe(4000.0, choice=RegionChoice(all=True))


def test_a_lone_pitch_or_diameter_keeps_the_proportion() -> None:
    defaults = default_recipe(4000.0)
    wide = recipe_from_dict({**ALL, "packing": {"pitch": 10}}, defaults)
    assert wide.shaping.diameter == Constant(6.0)
    fine = recipe_from_dict({**ALL, "shaping": {"diameter": 0.3}}, defaults)
    assert fine.packing.pitch == Constant(0.5)


BAD = {
    "nothing chosen": ("", "chooses no faces"),
    "two ways": ("[region]\nall = true\nmaterial = 'Grille'", r"2 ways \(material, all\)"),
    "angle": ("[region]\nnear = [0, 0, 0]\nmax_angle = 270", "from 0 to 180"),
    "short point": ("[region]\nnear = [0, 0]", r"\[x, y, z\]"),
    "point of words": ("[region]\nnear = ['a', 0, 0]", "must be a number"),
    "nan point": ("[region]\nnear = [nan, 0, 0]", "finite"),
    "region is a number": ("region = 3", r"write \[region\]"),
    "attribute is a number": ("[region]\nattribute = 3", "name in quotes"),
    "all is a word": ("[region]\nall = 'yes'", "true or false"),
    "unknown table": ("[pakcing]\npitch = 3", r"did you mean \[packing\]"),
    "unknown key": ("[packing]\npich = 3", "has no key \"pich\": did you mean pitch"),
    "unlike anything": ("[packing]\nzzzzzz = 3", "known are pitch, edge_offset"),
    "key at the top": ("pitch = 3", r"belongs under \[packing\]"),
    "key in the wrong table": ("[packing]\ndiameter = 3", r"belongs under \[shaping\]"),
    "pitch zero": ("[packing]\npitch = 0", "pitch = 0 must be a number above 0"),
    "pitch negative": ("[packing]\npitch = -3", "above 0"),
    "pitch nan": ("[packing]\npitch = nan", "finite"),
    "pitch infinite": ("[packing]\npitch = inf", "finite"),
    "pitch a word": ("[packing]\npitch = '3 mm'", "must be a number"),
    "pitch a flag": ("[packing]\npitch = true", "must be a number"),
    "diameter zero": ("[shaping]\ndiameter = 0", "above 0"),
    "diameter over pitch": ("[packing]\npitch = 2\n[shaping]\ndiameter = 2", "smaller than the pitch"),
    "offset outward": (
        "[packing]\npitch = 2\nedge_offset = -1\n[shaping]\ndiameter = 1",
        "over the boundary",
    ),
    "offset nan": ("[packing]\nedge_offset = nan", "finite"),
    "iterations": ("[packing]\niterations = 0", "at least 1"),
    "iterations broken": ("[packing]\niterations = 1.5", "whole number"),
    "seed": ("[packing]\nseed = -1", "at least 0"),
    "tolerance": ("[packing]\ntolerance = 0", "above 0"),
    "gap without parts": ("[region]\nall = true\ngap = 2.0", "name these too"),
    "orientation": ("[packing]\norientation = 'bets'", 'did you mean "best"'),
    "orientation that is none": ("[packing]\norientation = [0, 0, 0]", "no direction"),
    "integrator": ("[packing]\nintegrator = 'rk5'", 'did you mean "rk4"'),
    "kind": ("[feature]\nkind = 'holes'", 'did you mean "hole"'),
    "depth": ("[feature]\ndepth = 0", "above 0"),
    "sides": ("[feature]\nsides = 2", "at least 3"),
    "facet tolerance": ("[feature]\ntolerance = -1", "above 0"),
    "min_web": ("[limits]\nmin_web = -1", "at least 0"),
    "min_web too much": ("[packing]\npitch = 3\n[limits]\nmin_web = 2", "diameter at most 1"),
    "min_margin": ("[limits]\nmin_margin = -1", "at least 0"),
    "formats": ("[output]\nformats = ['step']", "formats = \"step\" is not known"),
    "formats a word": ("[output]\nformats = 'stl'", "list of names"),
}


@pytest.mark.parametrize("name", BAD)
def test_nonsense_is_refused_in_plain_words(name: str) -> None:
    text, message = BAD[name]
    data = tomllib.loads(text)
    if "region" not in data and name != "nothing chosen":
        data |= ALL
    with pytest.raises(RecipeError, match=message) as caught:
        recipe_from_dict(data)
    assert "\n" not in str(caught.value)


def test_files_that_are_no_recipe(tmp_path) -> None:
    with pytest.raises(RecipeError, match=r"missing\.toml does not exist"):
        load_recipe(tmp_path / "missing.toml")
    with pytest.raises(RecipeError, match="can't be read"):
        load_recipe(tmp_path)
    bad = tmp_path / "bad.toml"
    bad.write_text("[region]\nall = \n")
    with pytest.raises(RecipeError, match=r"not valid TOML.*line 2"):
        load_recipe(bad)
    bad.write_bytes(b"\xff\xfe")
    with pytest.raises(RecipeError, match="UTF-8"):
        load_recipe(bad)
    bad.write_text("[packing]\npitch = 0\n")
    with pytest.raises(RecipeError, match=r"^bad\.toml: "):
        load_recipe(bad)
