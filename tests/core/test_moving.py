"""A recipe moved with everything else makes the same."""

from __future__ import annotations

import tomllib
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from bubble_pattern_addon.core.blending import Blend, Fill
from bubble_pattern_addon.core.errors import RecipeError
from bubble_pattern_addon.core.fields import Distance, Edge, Linear, Radial
from bubble_pattern_addon.core.mesh import Floats, Mesh
from bubble_pattern_addon.core.metric import Constant, Described, Places
from bubble_pattern_addon.core.moving import moved, moved_recipe
from bubble_pattern_addon.core.painted import Image
from bubble_pattern_addon.core.pipeline import pattern_steps
from bubble_pattern_addon.core.progress import drive
from bubble_pattern_addon.core.recipe import Packing, Recipe, RegionChoice, Seed, Shaping
from bubble_pattern_addon.core.recipe_checks import check_recipe
from bubble_pattern_addon.core.recipe_file import recipe_from_dict, recipe_to_toml
from bubble_pattern_addon.core.region import Region, make_region
from bubble_pattern_addon.core.surroundings import Surroundings
from scripts.shapes import SHAPES

ENDS = {"from_": 1.0, "to": 3.0}
MATRIX = np.eye(4)
MATRIX[:3, :3] = Rotation.from_rotvec([0.4, -1.1, 0.7]).as_matrix()
MATRIX[:3, 3] = 5.0, -3.0, 2.0
PICTURES = {"grey": np.random.default_rng(1).random((20, 30, 1))}


def regions(name: str) -> tuple[Region, Region]:
    shape = SHAPES[name]()
    there = shape.mesh.vertices @ MATRIX[:3, :3].T + MATRIX[:3, 3]
    return (
        make_region(shape.mesh, shape.selected),
        make_region(Mesh(there, shape.mesh.triangles), shape.selected),
    )


def middles(region: Region) -> Places:
    n = len(region.triangles)
    return Places(region.corners.mean(axis=1), region.triangles, np.full((n, 3), 1 / 3))


FIELDS: list[Described] = [
    Constant(2.0),
    Linear(**ENDS, direction=(1.0, 2.0, 0.5)),
    Linear(**ENDS, start=(0.0, 1.0, 2.0), end=(30.0, 4.0, 1.0)),
    Radial(**ENDS, centre=(3.0, 4.0, 5.0), axis=(0.0, 1.0, 1.0), radius=60.0),
    Radial(**ENDS),
    Edge(**ENDS, distance=10.0, near=((0.0, 0.0, 0.0),)),
    Distance(**ENDS, distance=40.0, points=((1.0, 2.0, 3.0),), lines=(((0, 0, 0), (9.0, 9.0, 0)),)),
    Image(**ENDS, image="grey"),
    Image(**ENDS, image="grey", project=(0.1, 0.0, 1.0), centre=(1.0, 2.0, 0.0), width=80.0),
    Image(**ENDS, image="grey", project=(1.0, 0.2, 1.0), up=(0.0, 1.0, 0.0)),
    Fill(Blend(first=Constant(0.3), second=Linear(**ENDS, direction=(0.0, 1.0, 0.0)), mask=Radial(**ENDS))),
]


@pytest.mark.parametrize("word", ["x", "xy", "rotate 2 z"])
def test_a_symmetry_turns_with_the_base_and_back(word: str) -> None:
    """The pattern on a base that stands askew is that on the upright one, moved."""
    packing = Packing(pitch=Constant(25.0), symmetry=word)
    recipe = Recipe(region=RegionChoice(all=True), packing=packing, shaping=Shaping(Constant(9.0)))
    here, there = regions("panel-coarse")
    askew = moved_recipe(recipe, MATRIX, here)
    assert recipe_from_dict(tomllib.loads(recipe_to_toml(askew))) == askew
    assert moved_recipe(askew, np.linalg.inv(MATRIX), there).packing == recipe.packing
    one, other = (drive(pattern_steps(*given)) for given in ((here, recipe), (there, askew)))
    assert one.symmetry == other.symmetry == word
    moved_there = one.position @ MATRIX[:3, :3].T + MATRIX[:3, 3]
    assert cKDTree(moved_there).query(other.position)[0].max() < 0.02 * 25.0
    assert drive(pattern_steps(there, recipe)).symmetry is None


def test_axes_that_are_none_are_refused() -> None:
    for axes in (((1.0, 0.0, 0.0),), ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 1.0, 1.0))):
        with pytest.raises(RecipeError, match="symmetry_axes"):
            check_recipe(Recipe(RegionChoice(all=True), Packing(symmetry_axes=axes)))


@pytest.mark.parametrize("field", FIELDS)
@pytest.mark.parametrize("name", ["trapezoid", "panel-coarse"])
def test_a_moved_field_has_the_same_values_at_moved_places(field: Described, name: str) -> None:
    here, there = regions(name)

    def values(described: Described, region: Region) -> Floats:
        around = Surroundings(region=region, images=PICTURES, pitch=lambda places: np.full(len(places), 2.0))
        return described.bind(around)(middles(region))

    assert np.allclose(values(field, here), values(moved(field, MATRIX, here), there), atol=1e-9)
    back = np.linalg.inv(MATRIX)
    again = moved(moved(field, MATRIX, here), back, there)
    assert np.allclose(values(again, here), values(field, here), atol=1e-9)


def test_seeds_region_and_rows_go_along() -> None:
    here, _ = regions("trapezoid")
    recipe = Recipe(
        region=RegionChoice(near=(1.0, 0.0, 0.0)),
        packing=Packing(orientation=(0.0, 0.0, 2.0)),
        shaping=Shaping(seeds=(Seed((0.0, 1.0, 0.0), 2.0),)),
    )
    result = moved_recipe(recipe, MATRIX, here)
    assert result.region.near == pytest.approx(tuple(MATRIX[:3, 0] + MATRIX[:3, 3]))
    assert result.packing.orientation == pytest.approx(tuple(2 * MATRIX[:3, 2]))
    assert result.shaping.seeds[0].at == pytest.approx(tuple(MATRIX[:3, 1] + MATRIX[:3, 3]))
    assert result.shaping.seeds[0].diameter == 2.0
    assert moved_recipe(recipe, np.eye(4), here) is recipe
    assert replace(result, region=recipe.region, packing=recipe.packing, shaping=recipe.shaping) == recipe
