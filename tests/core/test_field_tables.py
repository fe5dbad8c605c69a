"""Fields in recipe files: what is read is what was written, and nonsense is refused by the key's name."""

from __future__ import annotations

import subprocess
import sys
import tomllib
from dataclasses import fields
from pathlib import Path

import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from bubble_pattern_addon.core.blending import Blend, FaceSet, Fill, Least, Most, Product, SubRegions
from bubble_pattern_addon.core.errors import RecipeError
from bubble_pattern_addon.core.field_tables import (
    KINDS,
    READERS,
    field_from_toml,
    field_to_toml,
    wanted,
    with_images,
)
from bubble_pattern_addon.core.fields import Distance, Edge, Linear, Radial
from bubble_pattern_addon.core.metric import Constant, Described
from bubble_pattern_addon.core.painted import CHANNELS, Attribute, Image
from bubble_pattern_addon.core.recipe import Packing, Recipe, RegionChoice, Seed, Shaping
from bubble_pattern_addon.core.recipe_checks import check_recipe
from bubble_pattern_addon.core.recipe_file import recipe_from_dict, recipe_to_toml

ROOT = Path(__file__).resolve().parents[2]
lengths = st.floats(1e-3, 1e3)
numbers = st.floats(-1e6, 1e6)
points = st.tuples(numbers, numbers, numbers)
names = st.text(st.characters(exclude_categories=["Cs"]), min_size=1, max_size=12)
vectors = points.filter(any)


@st.composite
def ways(draw: st.DrawFn) -> dict[str, object]:
    """from, to, falloff, curve, invert and clamp."""
    falloff = draw(st.sampled_from(["linear", "smooth", "sphere", "root", "sharp", "curve"]))
    way: dict[str, object] = {"from_": draw(lengths), "to": draw(lengths), "falloff": falloff}
    way["invert"] = draw(st.booleans())
    if falloff == "curve":
        at = draw(st.lists(st.floats(0, 1), min_size=2, max_size=5, unique=True))
        way["curve"] = tuple((t, draw(st.floats(0, 1))) for t in sorted(at))
    if falloff == "linear":
        way["clamp"] = draw(st.booleans())
    return way


@st.composite
def graded(draw: st.DrawFn) -> Described:
    way = draw(ways())
    kind = draw(st.sampled_from(["linear", "radial", "boundary", "distance", "attribute", "image"]))
    if kind == "linear":
        if draw(st.booleans()):
            return Linear(**way, direction=draw(vectors))
        start = draw(points)
        return Linear(**way, start=start, end=draw(points.filter(lambda end: end != start)))
    if kind == "radial":
        inner = draw(st.floats(0, 10))
        radius = draw(st.none() | st.floats(0.1, 10).map(lambda more: inner + more))
        if draw(st.booleans()):
            axis = draw(st.none() | vectors | st.sampled_from("xyz"))
            return Radial(**way, object=draw(names), axis=axis, inner=inner, radius=radius)
        centre, axis = draw(st.none() | points), draw(st.none() | vectors)
        return Radial(**way, centre=centre, axis=axis, inner=inner, radius=radius)
    if kind == "boundary":
        if draw(st.booleans()):
            return Edge(**way, distance=draw(lengths), near=tuple(draw(st.lists(points, max_size=2))))
        return Edge(**way, distance=draw(lengths), loops=draw(st.sampled_from(["all", "outer", "islands"])))
    if kind == "distance":
        lines = tuple(
            tuple(line) for line in draw(st.lists(st.lists(points, min_size=2, max_size=3), max_size=2))
        )
        objects, at = (
            tuple(draw(st.lists(names, max_size=2))),
            tuple(draw(st.lists(points, min_size=1, max_size=2))),
        )
        return Distance(**way, distance=draw(lengths), points=at, lines=lines, objects=objects)
    channel = draw(st.sampled_from(CHANNELS))
    if kind == "attribute":
        low = draw(st.floats(-10, 10))
        return Attribute(**way, name=draw(names), channel=channel, low=low, high=low + draw(lengths))
    if draw(st.booleans()):
        return Image(**way, image=draw(names), uv=draw(names), channel=channel)
    project, centre, width = (draw(st.none() | some) for some in (vectors, points, lengths))
    return Image(**way, image=draw(names), project=project, centre=centre, width=width, channel=channel)


def combined(parts: st.SearchStrategy[Described]) -> st.SearchStrategy[Described]:
    several = st.lists(parts, min_size=2, max_size=3).map(tuple)
    sets = st.lists(
        st.builds(FaceSet, value=parts, attribute=names, equals=st.none() | st.integers(-5, 5))
        | st.builds(FaceSet, value=parts, material=names),
        min_size=1,
        max_size=2,
    ).map(tuple)
    return st.one_of(
        *(st.builds(cls, of=several) for cls in (Product, Least, Most)),
        st.builds(Blend, first=parts, second=parts, mask=parts),
        st.builds(SubRegions, sets=sets, otherwise=parts),
        st.builds(Fill, parts),
    )


described = st.recursive(st.builds(Constant, lengths) | graded(), combined, max_leaves=4)


@given(described)
@settings(derandomize=True, deadline=None)
def test_a_field_written_and_read_is_the_same_field(field: Described) -> None:
    field.check("here")
    text = field_to_toml(field)
    assert "\n" not in text.replace("\\n", "")
    assert field_from_toml(tomllib.loads(f"it = {text}")["it"], "here") == field


@given(
    described,
    described | st.builds(Fill, st.floats(0.1, 0.9).map(Constant)),
    st.lists(st.builds(Seed, points, lengths), max_size=3),
)
@settings(derandomize=True, deadline=None)
def test_a_recipe_of_fields_written_and_read_is_the_same_recipe(pitch, size, seeds) -> None:
    recipe = Recipe(
        RegionChoice(all=True), Packing(pitch=pitch), Shaping(size, tuple(seeds), solver="iterate")
    )
    tables = tomllib.loads(recipe_to_toml(recipe))
    assert ("fill" in tables["shaping"]) == isinstance(size, Fill)
    assume(makes_sense(recipe))
    assert recipe_from_dict(tables) == recipe


def makes_sense(recipe: Recipe) -> bool:
    try:
        check_recipe(recipe)
    except RecipeError:
        return False
    return True


def test_every_key_of_every_kind_has_a_reader() -> None:
    keys = {f.name.rstrip("_") for cls in (*KINDS.values(), FaceSet) for f in fields(cls)}
    assert keys == set(READERS)


def read(text: str) -> Described:
    return field_from_toml(tomllib.loads(f"it = {text}")["it"], "[packing] pitch")


def test_the_tables_of_the_issue() -> None:
    text = '{ kind = "linear", from = 2.0, to = 6.0, direction = [1,0,0] }'
    assert read(text) == Linear(from_=2.0, to=6.0, direction=(1.0, 0.0, 0.0))
    assert read("3") == Constant(3.0) == read('{ kind = "constant", value = 3 }')


def test_a_curve_needs_not_be_called_one() -> None:
    text = '{ kind = "boundary", from = 1, to = 2, distance = 5, curve = [[0, 0], [1, 1]] }'
    field = read(text)
    assert isinstance(field, Edge)
    assert field.falloff == "curve"


BAD = {
    "word": ("'3 mm'", "pitch = \"3 mm\" must be a number, or a field's table"),
    "flag": ("true", "must be a number, or"),
    "list": ("[1, 2]", "must be a number, or"),
    "no kind": ("{ from = 1, to = 2 }", "must say its kind: constant, linear, radial"),
    "kind": ("{ kind = 'liner' }", 'kind = "liner" is not known: did you mean "linear"'),
    "kind is a number": ("{ kind = 3 }", "kind = 3 must be a name"),
    "key": (
        "{ kind = 'linear', from = 1, to = 2, dirction = [1, 0, 0] }",
        'kind = "linear" has no key "dirction": did you mean direction',
    ),
    "center": ("{ kind = 'radial', from = 1, to = 2, center = [1, 0, 0] }", "did you mean centre"),
    "key of another kind": ("{ kind = 'linear', from = 1, to = 2, loops = 'all' }", 'has no key "loops"'),
    "nothing to go to": ("{ kind = 'linear', from = 1, direction = [1, 0, 0] }", "lacks to"),
    "no distance": ("{ kind = 'boundary', from = 1, to = 2 }", 'kind = "boundary" lacks distance'),
    "word for a number": ("{ kind = 'linear', from = 'a', to = 2 }", 'pitch: from = "a" must be a number'),
    "short direction": (
        "{ kind = 'linear', from = 1, to = 2, direction = [1] }",
        r"direction = \[1\] must be a point",
    ),
    "point for points": (
        "{ kind = 'distance', from = 1, to = 2, distance = 3, points = [0, 0, 0] }",
        "points = 0 must be a point",
    ),
    "no points": ("{ kind = 'distance', from = 1, to = 2, distance = 3, points = [] }", "list of points"),
    "no lines": ("{ kind = 'distance', from = 1, to = 2, distance = 3, lines = 3 }", "list of lines"),
    "short line": (
        "{ kind = 'distance', from = 1, to = 2, distance = 3, lines = [[[0, 0, 0]]] }",
        "each of two points or more",
    ),
    "curve": ("{ kind = 'boundary', from = 1, to = 2, distance = 3, curve = [0, 1] }", "list of pairs"),
    "of is no list": ("{ kind = 'min', of = 3 }", "must be a list of fields"),
    "nested": (
        "{ kind = 'min', of = [1, { kind = 'linear' }] }",
        'pitch: of, field 2: kind = "linear" lacks from',
    ),
    "sets": ("{ kind = 'faces', sets = [3], otherwise = 2 }", "must be a list of tables"),
    "key of a set": (
        "{ kind = 'faces', sets = [{ attribut = 'a', value = 2 }], otherwise = 2 }",
        'sets, sub-region 1: a sub-region has no key "attribut": did you mean attribute',
    ),
    "set without value": (
        "{ kind = 'faces', sets = [{ attribute = 'a' }], otherwise = 2 }",
        "a sub-region lacks value",
    ),
    "equals": (
        "{ kind = 'faces', sets = [{ attribute = 'a', value = 2, equals = 1.5 }], otherwise = 2 }",
        "equals = 1.5 must be a whole number",
    ),
}


@pytest.mark.parametrize("name", BAD)
def test_a_wrong_table_is_refused_by_the_key_s_name(name: str) -> None:
    text, words = BAD[name]
    with pytest.raises(RecipeError, match=words) as caught:
        read(text)
    assert str(caught.value).startswith("[packing] pitch")
    assert "\n" not in str(caught.value)


TO_NOTHING = "{ kind = 'linear', from = 3, to = 0, direction = [1, 0, 0] }"
BAD_RECIPES = {
    "pitch to nothing": (f"[packing]\npitch = {TO_NOTHING}", r"\[packing\] pitch can become 0"),
    "diameter below nothing": (
        "[shaping]\ndiameter = { kind = 'multiply', of = [-1, { kind = 'boundary', from = 1, to = 2, "
        "distance = 3 }] }",
        r"\[shaping\] diameter can become -2",
    ),
    "curve below nothing": (
        "[packing]\npitch = { kind = 'boundary', from = 1, to = 3, distance = 3, curve = [[0, -1], [1, 1]] }",
        "can become -1",
    ),
    "fill to nothing": (f"[shaping]\nfill = {TO_NOTHING}", r"\[shaping\] fill can become 0"),
    "fill too much": ("[shaping]\nfill = 1.0", "fill can become 1, which leaves no web"),
    "graded fill too much": (
        "[shaping]\nfill = { kind = 'boundary', from = 0.4, to = 1.4, distance = 3 }",
        "can become 1.4, which leaves no web",
    ),
    "both": ("[shaping]\nfill = 0.5\ndiameter = 2", "both diameter and fill"),
    "a check within": (
        "[packing]\npitch = { kind = 'linear', from = 1, to = 2 }",
        r"\[packing\] pitch: give either direction",
    ),
    "a pitch of itself": (
        "[packing]\npitch = { kind = 'min', of = [3, { kind = 'fill', share = 0.5 }] }",
        "a share of itself",
    ),
    "seeds": ("[shaping]\nseeds = 3", "must be a list of tables"),
    "seed": ("[shaping]\nseeds = [{ at = [0, 0, 0], size = 3 }]", 'seed 1 has no key "size"'),
    "seed without": ("[shaping]\nseeds = [{ at = [0, 0, 0] }]", "seed 1 lacks diameter"),
    "seed of nothing": ("[shaping]\nseeds = [{ at = [0, 0, 0], diameter = 0 }]", "seed 1: diameter = 0 must"),
    "solver": ("[shaping]\nsolver = 'iterated'", 'did you mean "iterate"'),
    "tolerance": ("[shaping]\ntolerance = 0", r"\[shaping\] tolerance = 0 must be a number above 0"),
    "iterations": ("[shaping]\niterations = 0", r"\[shaping\] iterations = 0 must be at least 1"),
    "min_diameter": ("[limits]\nmin_diameter = -1", "min_diameter = -1 must be at least 0"),
    "min_diameter above all": (
        "[packing]\npitch = 3\n[limits]\nmin_diameter = 2",
        "more than the diameter 1.8",
    ),
    "share that leaves no room": (
        "[packing]\npitch = 3\n[shaping]\nfill = 0.9\n[limits]\nmin_web = 1",
        "at most 2",
    ),
}


@pytest.mark.parametrize("name", BAD_RECIPES)
def test_a_recipe_with_nonsense_is_refused(name: str) -> None:
    text, words = BAD_RECIPES[name]
    with pytest.raises(RecipeError, match=words) as caught:
        recipe_from_dict(tomllib.loads(text) | {"region": {"all": True}})
    assert "\n" not in str(caught.value)


def test_a_graded_pitch_alone_gets_diameters_in_proportion() -> None:
    table = {"kind": "radial", "from": 1.0, "to": 4.0}
    recipe = recipe_from_dict({"region": {"all": True}, "packing": {"pitch": table}})
    assert recipe.shaping.diameter == Fill(Constant(0.6))


def test_what_fields_ask_for_is_known_before_they_are_bound() -> None:
    way = {"from_": 1.0, "to": 2.0}
    field = Blend(
        first=SubRegions(
            sets=(FaceSet(attribute="zone", value=Attribute(**way, name="Weight")),),
            otherwise=Distance(**way, distance=1.0, objects=("Logo", "Curve")),
        ),
        second=Least(of=(Image(**way, image="a.png", uv="UVMap"), Radial(**way, object="Empty"))),
        mask=Product(of=(Constant(1.0), Image(**way, image="b.png"))),
    )
    found = wanted(field, SubRegions(sets=(FaceSet(material="Rim", value=Constant(1.0)),), otherwise=field))
    assert found.attributes == {"zone", "Weight"}
    assert found.materials == {"Rim"}
    assert found.images == {"a.png", "b.png"}
    assert found.uv_maps == {"UVMap"}
    assert found.objects == {"Logo", "Curve", "Empty"}
    renamed = with_images(field, {"a.png": "c.png"})
    assert wanted(renamed).images == {"b.png", "c.png"}
    assert with_images(renamed, {"c.png": "a.png"}) == field


def test_recipes_are_read_without_scipy() -> None:
    """Blender registers the panel's settings, which know recipes, at every start."""
    program = "import sys, bubble_pattern_addon.core.recipe; print('scipy' in sys.modules)"
    done = subprocess.run(
        [sys.executable, "-c", program], cwd=ROOT, capture_output=True, text=True, check=True
    )
    assert done.stdout.strip() == "False"
