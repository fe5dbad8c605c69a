"""A mesh as feature takes of the surface what it covers of its own plane, as a profile takes its outline."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import trimesh

from bubble_pattern_addon.core.errors import RecipeError
from bubble_pattern_addon.core.feature_recipe import Feature
from bubble_pattern_addon.core.mesh import Mesh
from bubble_pattern_addon.core.metric import Constant
from bubble_pattern_addon.core.pipeline import pattern_steps
from bubble_pattern_addon.core.progress import drive
from bubble_pattern_addon.core.quality import open_area
from bubble_pattern_addon.core.recipe import Packing, Recipe, Shaping, Solve
from bubble_pattern_addon.core.region import Region, make_region
from bubble_pattern_addon.core.results import results_of
from bubble_pattern_addon.core.solid import part_steps
from bubble_pattern_addon.core.solving import solving_steps
from bubble_pattern_addon.core.surroundings import Surroundings
from tests.core.bases import as_mesh, box

BASE = box((-10, -6, -2), (10, 6, 0))
DIAMETER = 1.2


def bar(length: float = 2.0, width: float = 0.5) -> Mesh:
    """A bar that crosses its own plane z = 0."""
    return as_mesh(trimesh.creation.box((length, width, 1.0)))


def ring() -> Mesh:
    return as_mesh(trimesh.creation.annulus(0.5, 1.0, 1.0, sections=64))


SHARES = {
    "bar": (bar(), 1.0 / (np.pi / 4 * (2.0**2 + 0.5**2))),
    "ring": (ring(), 64 * np.sin(np.pi / 32) / 2 / np.pi * 0.75),
    "wider below": (as_mesh(trimesh.creation.icosphere(4, 1.0).apply_translation((0, 0, -0.6))), 0.64),
}


@pytest.fixture(scope="module")
def region() -> Region:
    return make_region(BASE, BASE.area_vectors[:, 2] > 0)


def recipe(feature: Feature) -> Recipe:
    return replace(
        Recipe(), packing=Packing(pitch=Constant(2.0)), shaping=Shaping(Constant(DIAMETER)), feature=feature
    )


@pytest.mark.parametrize("name", SHARES)
@pytest.mark.parametrize("kind", ["hole", "bump"])
def test_the_open_area_is_what_is_missing_from_the_surface(region: Region, name: str, kind: str) -> None:
    mesh, share = SHARES[name]
    if (name, kind) == ("wider below", "bump"):
        share = 1.0  # it is widest on the plane
    feature = Feature(kind=kind, profile="mesh", mesh=name)
    pattern = drive(pattern_steps(region, recipe(feature), Surroundings(meshes={name: mesh})))
    circles = len(pattern) * np.pi / 4 * DIAMETER**2
    assert pattern.share == pytest.approx(share, rel=0.01)
    assert open_area(pattern, region) == pytest.approx(pattern.share[0] * circles / region.area)
    part = drive(part_steps(BASE, pattern, feature, mesh))
    assert part.check.problems == ()
    assert open_area(pattern, region) == pytest.approx(taken(part.mesh, region), rel=1e-6)


def taken(part: Mesh, region: Region) -> float:
    """Which share of the base's top is no longer there."""
    on_top = (np.abs(part.corners[..., 2]).max(axis=1) < 1e-9) & (part.area_vectors[:, 2] > 0)
    return 1 - part.area_vectors[on_top, 2].sum() / 2 / region.area


def test_a_target_open_area_is_met_by_what_the_mesh_opens(region: Region) -> None:
    feature = Feature(profile="mesh", mesh="bar")
    wanted = replace(recipe(feature), solve=Solve(open_area=0.08))
    solved = drive(solving_steps(region, wanted, Surroundings(meshes={"bar": bar()})))
    assert solved.met
    part = drive(part_steps(BASE, solved.pattern, feature, bar()))
    assert taken(part.mesh, region) == pytest.approx(0.08, rel=0.005)


def test_what_a_mesh_takes_away_is_known_from_the_part_alone(region: Region) -> None:
    feature = Feature(profile="mesh", mesh="bar")
    pattern = drive(pattern_steps(region, recipe(feature), Surroundings(meshes={"bar": bar()})))
    assert np.isnan(results_of(pattern, region, recipe(feature)).removed)
    assert results_of(pattern, region, recipe(feature), 2.5).removed == 2.5


def test_a_mesh_that_nobody_brings_counts_as_its_circle_and_a_bad_one_is_told(region: Region) -> None:
    feature = Feature(profile="mesh", mesh="bar")
    assert drive(pattern_steps(region, recipe(feature))).share is None
    half = bar()
    half = Mesh(half.vertices, half.triangles[:-1])
    with pytest.raises(RecipeError, match="not a closed mesh"):
        drive(pattern_steps(region, recipe(feature), Surroundings(meshes={"bar": half})))
