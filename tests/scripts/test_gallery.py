"""The gallery: sound bases, recipes whose patterns keep their limits, and a name that is none."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
import trimesh
from scipy.spatial import cKDTree

from bubble_pattern_addon.batch import surroundings_of
from bubble_pattern_addon.core.files import LoadedBase
from bubble_pattern_addon.core.metric import Places
from bubble_pattern_addon.core.pattern import Pattern
from bubble_pattern_addon.core.pipeline import pattern_steps
from bubble_pattern_addon.core.progress import drive
from bubble_pattern_addon.core.quality import measure
from bubble_pattern_addon.core.recipe import Recipe
from bubble_pattern_addon.core.recipe_file import load_recipe
from bubble_pattern_addon.core.region import Region, make_region
from bubble_pattern_addon.core.soundness import sound_base
from scripts.feature_bases import FEATURE_BASES
from scripts.gallery import FEATURES, NAMES, RECIPES, RESULTS, ROOT, parse
from scripts.gallery_bases import BASES, FINISHES, GalleryBase
from scripts.moulding import THICKNESS, vertex_normals

LOOPS = {"speaker-uniform": 2, "conference-station": 4, "slots": 2, "dimples": 0, "grip": 2}
SOLID = ("dimples", "grip")


@cache
def base_of(name: str) -> GalleryBase:
    return {**BASES, **FEATURE_BASES}[name]()


@cache
def packed(name: str) -> tuple[Recipe, Region, Pattern]:
    """The recipe, the region and the pattern, without the solid."""
    base = base_of(name)
    recipe = load_recipe(RECIPES / f"{name}.toml")
    region = make_region(base.mesh, base.region)
    surroundings = surroundings_of(LoadedBase(base.mesh, base.sub_regions), {})
    return recipe, region, drive(pattern_steps(region, recipe, surroundings), None)


def diameters(name: str, sub_region: str) -> tuple[np.ndarray, np.ndarray]:
    """Pitches and diameters of the features in a sub-region."""
    pattern = packed(name)[2]
    here = base_of(name).sub_regions[sub_region][pattern.places.triangle]
    assert here.sum() > 20
    return pattern.pitch[here], pattern.diameter[here]


def test_every_result_has_a_base_and_a_recipe_and_no_other_has() -> None:
    assert set(RESULTS) == set(BASES)
    assert set(FEATURES) == set(FEATURE_BASES)
    assert set(NAMES) == {path.stem for path in RECIPES.glob("*.toml")}


@pytest.mark.parametrize("name", NAMES)
def test_a_base_is_a_sound_solid_without_handles(name: str) -> None:
    base = base_of(name)
    sound_base(base.mesh)
    body = trimesh.Trimesh(base.mesh.vertices, base.mesh.triangles, process=False)
    assert body.is_watertight
    assert body.is_winding_consistent
    assert body.body_count == base.bodies
    assert body.euler_number == 2 * base.bodies
    # no fold: along every edge the faces bend by about a right angle at most, as they do at the foot
    assert np.degrees(body.face_adjacency_angles).max() < 105


@pytest.mark.parametrize("name", NAMES)
def test_the_region_has_the_boundaries_it_is_drawn_with(name: str) -> None:
    base = base_of(name)
    assert len(make_region(base.mesh, base.region).loops) == LOOPS.get(name, 1)
    parts: Mapping[str, np.ndarray] = base.sub_regions
    if parts:
        assert (np.sum(list(parts.values()), axis=0) == base.region).all()
    assert {base.body, *base.finishes} <= set(FINISHES)


@pytest.mark.parametrize("name", [name for name in NAMES if name not in SOLID])
def test_the_wall_under_the_region_has_real_thickness(name: str) -> None:
    base = base_of(name)
    # at the boundary the normals are those of beads and badges too
    used = np.setdiff1d(base.mesh.triangles[base.region], base.mesh.triangles[~base.region])
    below = base.mesh.vertices - THICKNESS * vertex_normals(base.mesh.vertices, base.mesh.triangles)
    # under every vertex of the region there is one of the inner side, a wall's thickness away
    distance, _ = cKDTree(base.mesh.vertices).query(below[used])
    assert distance.max() < 0.1 * THICKNESS


@pytest.mark.parametrize("name", NAMES)
def test_features_neither_overlap_nor_pass_the_limits(name: str) -> None:
    recipe, region, pattern = packed(name)
    assert len(pattern) > 100
    points, radius = pattern.places.position, pattern.diameter / 2
    near = cKDTree(points).query_pairs(float(pattern.diameter.max()) + 2.0, output_type="ndarray")
    gap = np.linalg.norm(points[near[:, 0]] - points[near[:, 1]], axis=1) - radius[near].sum(axis=1)
    assert gap.min() >= recipe.limits.min_web - 1e-6
    segments = region.boundary_segments
    if not len(segments):
        return
    start, way = segments[:, 0], segments[:, 1] - segments[:, 0]
    to = points[:, None] - start
    share = np.clip((to * way).sum(axis=2) / (way**2).sum(axis=1), 0, 1)
    margin = np.linalg.norm(to - share[..., None] * way, axis=2).min(axis=1) - radius
    assert margin.min() > 0


@pytest.mark.parametrize("name", NAMES)
def test_no_hole_is_missing_anywhere(name: str) -> None:
    recipe, region, pattern = packed(name)
    random = np.random.default_rng(0)
    area = np.linalg.norm(region.area_vectors, axis=1)
    row = random.choice(len(area), 20_000, p=area / area.sum())
    barycentric = random.dirichlet([1, 1, 1], len(row))
    position = np.einsum("nk,nkc->nc", barycentric, region.corners[row])
    base = base_of(name)
    surroundings = replace(surroundings_of(LoadedBase(base.mesh, base.sub_regions), {}), region=region)
    pitch = recipe.packing.pitch.bind(surroundings)(Places(position, region.triangles[row], barycentric))
    distance, _ = cKDTree(pattern.places.position).query(position)
    # 0.58 in the middle of three, 0.71 of four; a place left out makes it 1
    assert (distance / pitch).max() < 0.9
    assert measure(pattern, region).void < 0.9


def test_result_2_has_one_size_in_the_centre_and_smaller_ones_beside_it() -> None:
    _, centre = diameters("speaker-round-centre", "centre")
    assert np.ptp(centre) < 1e-9
    for side in ("left", "right"):
        _, around = diameters("speaker-round-centre", side)
        assert around.max() <= centre[0] + 1e-9
        assert around.min() < 0.5 * centre[0]


def test_result_4_has_all_four_combinations_of_regular_and_graded() -> None:
    def graded(values: np.ndarray) -> bool:
        low, high = np.quantile(values, [0.05, 0.95])
        return bool(high > 1.4 * low)

    found = {
        part: tuple(map(graded, diameters("conference-station", part)))
        for part in base_of("conference-station").sub_regions
    }
    assert found == {
        "right": (False, False),
        "left": (False, True),
        "front": (True, False),
        "middle": (True, True),
    }


def test_a_wrong_name_is_told_in_one_line(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as end:
        parse(["--only", "toaster"])
    assert end.value.code == 2
    said = capsys.readouterr().err
    assert said.count("\n") == 1
    assert "toaster" in said
    assert "desk-phone" in said


def test_the_readme_shows_every_result_in_a_small_picture() -> None:
    readme = Path(ROOT / "README.md").read_text("utf-8")
    gallery = readme[readme.index("## Gallery") :]
    for name in RESULTS:
        assert re.search(rf"\(docs/gallery/{name}\.jpg\)", gallery), name
        assert (ROOT / "docs" / "gallery" / f"{name}.jpg").stat().st_size <= 60_000
    assert (ROOT / "docs" / "gallery" / "contact_sheet.jpg").stat().st_size <= 200_000
    assert "(docs/gallery/features.jpg)" in readme
    assert (ROOT / "docs" / "gallery" / "features.jpg").stat().st_size <= 200_000
