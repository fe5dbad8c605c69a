"""[feature] in a recipe: read as written, and what contradicts itself is refused in plain words."""

import tomllib

import pytest

from bubble_pattern_addon.core.errors import RecipeError
from bubble_pattern_addon.core.feature_recipe import Feature, without_defaults
from bubble_pattern_addon.core.fields import Linear
from bubble_pattern_addon.core.recipe import Recipe
from bubble_pattern_addon.core.recipe_file import recipe_from_dict, recipe_to_toml

SAID = {
    "a countersunk slot along the boundary": (
        'profile = "slot"\naspect = 0.3\nrim = "chamfer"\nrim_size = 0.1\nrim_angle = 82\nturn = "boundary"'
    ),
    "a drafted boss": (
        'kind = "bump"\nform = "boss"\nheight = 0.5\ndraft = 2\nrim = "fillet"\nrim_size = 0.2\n'
        'pull = [0, 0, 1]\naxis = "pull"'
    ),
    "a graded dimple": (
        'kind = "dimple"\ndepth = { kind = "linear", from = 0.1, to = 0.4, direction = [1, 0, 0] }\n'
        'profile = "polygon"\ncorners = 5\nrounding = 0.4\nturn = "random"\nturn_seed = 7\nangle = 15'
    ),
    "a curve": 'profile = "curve"\npoints = [[0, 0], [1, 0], [1, 2]]\nturn = "around"\n'
    "turn_point = [0, 0, 1]",
    "a mesh": 'profile = "mesh"\nmesh = "star.stl"\nkind = "bump"\nturn = "attribute"\n'
    'turn_attribute = "flow"',
    "a shaft's hole": 'across = "flats"\nsides = 24\naxis = 0.5\npull = [0, 1, 1]\nturn = "fixed"\n'
    "turn_direction = [1, 0, 0]",
}


def read(table: str) -> Feature:
    return recipe_from_dict(tomllib.loads(f"[region]\nall = true\n[feature]\n{table}")).feature


@pytest.mark.parametrize("name", SAID)
def test_what_is_written_is_read(name):
    table = SAID[name]
    feature = read(table)
    assert set(without_defaults(feature)) == {line.split(" = ")[0] for line in table.splitlines()}
    again = tomllib.loads(recipe_to_toml(Recipe(feature=feature)))
    assert recipe_from_dict(again | {"region": {"all": True}}).feature == feature


def test_a_field_is_a_field_and_a_number_a_number():
    assert read(SAID["a graded dimple"]).depth == Linear(from_=0.1, to=0.4, direction=(1, 0, 0))
    assert read("depth = { kind = \"constant\", value = 2 }").depth == 2.0
    assert read('axis = "pull"\npull = [0, 0, 2]').axis == 1.0


@pytest.mark.parametrize(
    ("table", "words"),
    [
        ('kind = "bmp"', 'did you mean "bump"?'),
        ('kind = "bump"\ndepth = 1', 'depth goes with kind = "hole" or "dimple"'),
        ("height = 1", 'height goes with kind = "bump"'),
        ('kind = "dimple"\ndraft = 2', "draft goes with"),
        ('kind = "bump"\ndraft = 2', 'form = "boss"'),
        ('kind = "dimple"\ndepth = 1', "more than half the diameter"),
        ("rim_size = 1", 'rim_size goes with rim = "chamfer" or "fillet"'),
        ('rim = "fillet"\nrim_angle = 60', 'rim_angle goes with rim = "chamfer"'),
        ('rim = "fillet"\nrim_size = 0.95', "rim_size = 0.95 leaves nothing"),
        ('rim = "fillet"\nrim_size = 0.4\nprofile = "slot"', "measures 0.36"),
        ('rim = "chamfer"\nrim_size = 0.5\ndepth = 0.3', "the rim is 0.5 deep"),
        ('rim = "chamfer"\nrim_angle = 180', "from 10 to 170"),
        ("draft = -1", "at least 0"),
        ("draft = 80", "at most 75"),
        ("depth = 0", "above 0"),
        ('depth = { kind = "linear", from = 0, to = 1, direction = [1, 0, 0] }', "can become 0"),
        ("aspect = 0.5", 'aspect goes with profile = "ellipse"'),
        ('profile = "slot"\naspect = 1.5', "at most 1"),
        ("corners = 5", 'corners goes with profile = "polygon"'),
        ('profile = "polygon"\ncorners = 2', "at least 3"),
        ('profile = "drop"\nrounding = 2', "from 0 to 1"),
        ('profile = "curve"', "needs points"),
        ('profile = "curve"\npoints = [[0, 0], [1, 1]]', "three or more"),
        ('profile = "curve"\npoints = [[0, 0], [1, 1], [1, 0], [0, 1]]', "across themselves"),
        ('profile = "curve"\npoints = [[0, 0], [1, 0], [1, 0], [0, 1]]', "each point once"),
        ('profile = "mesh"', "needs mesh"),
        ('profile = "mesh"\nmesh = "a.stl"\ndraft = 1', "says nothing about"),
        ('profile = "mesh"\nmesh = "a.stl"\nkind = "dimple"', "has no mesh"),
        ('across = "flats"\nsides = 6', "12 sides or more"),
        ('profile = "slot"\nacross = "flats"', 'across goes with profile = "circle"'),
        ('axis = "pull"', "give pull"),
        ("axis = 2\npull = [0, 0, 1]", "from 0 (normal) to 1 (pull)"),
        ('axis = "up"', '"normal", "pull" or a number'),
        ("pull = [0, 0, 0]", "no direction"),
        ('turn = "fixed"', "needs turn_direction"),
        ("turn_seed = 3", 'turn_seed goes with turn = "random"'),
        ('turn = "random"\nturn_seed = -3', "at least 0"),
        ("size = 3", "[feature] has no key"),
    ],
)  # fmt: skip
def test_what_contradicts_itself_is_refused(table, words):
    with pytest.raises(RecipeError) as caught:
        read(table)
    assert words in str(caught.value)
