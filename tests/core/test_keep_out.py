"""Keep-outs: what they cover is cut out of the region, and the first row follows them like any boundary."""

from __future__ import annotations

import tomllib
from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from bubble_pattern_addon.core.errors import RecipeError, RegionError
from bubble_pattern_addon.core.keep_out import region_with_keep_outs
from bubble_pattern_addon.core.mesh import Bools, Floats, Mesh
from bubble_pattern_addon.core.metric import Constant
from bubble_pattern_addon.core.moving import moved_recipe
from bubble_pattern_addon.core.pattern import Pattern
from bubble_pattern_addon.core.pipeline import pattern_steps
from bubble_pattern_addon.core.progress import drive
from bubble_pattern_addon.core.quality import measure, min_margin
from bubble_pattern_addon.core.recipe import KeepOut, Limits, Packing, Recipe, RegionChoice, Shaping
from bubble_pattern_addon.core.recipe_checks import check_choice
from bubble_pattern_addon.core.recipe_file import recipe_from_dict, recipe_to_toml
from bubble_pattern_addon.core.region import Region, make_region
from bubble_pattern_addon.core.shaping import reshaped
from bubble_pattern_addon.core.surface import Spots, on_base, on_region
from bubble_pattern_addon.core.surroundings import NOTHING, Solid, Solids
from scripts.shapes import circle, coarse_sheet, panel_sheet, rectangle_outline, slab, sphere_sheet
from tests.core.bases import as_mesh, box

PLATE = coarse_sheet(rectangle_outline(100, 60))
PANEL = panel_sheet(40)
PITCH = 3.0
Z = np.array([0.0, 0.0, 1.0])


def region_less(mesh: Mesh, *keep_outs: KeepOut, solids: Solids | None = None, **masks: Bools) -> Region:
    everything = np.ones(len(mesh.triangles), bool)
    return region_with_keep_outs(mesh, everything, None, 0.0, keep_outs, masks, solids or {})


def packed(region: Region, pitch: float = PITCH, **limits: float) -> Pattern:
    recipe = Recipe(
        packing=Packing(pitch=Constant(pitch)),
        shaping=Shaping(diameter=Constant(0.6 * pitch)),
        limits=Limits(**limits),
    )
    return drive(pattern_steps(region, recipe))


def beside(pattern: Pattern, distance: Floats, pitch: float = PITCH) -> Floats:
    """Distances of the first row's bubbles that run along the keep-out, in pitches."""
    first = distance[(pattern.row == 0) & (distance < 0.75 * pitch)]
    assert len(first) > 5
    return first / pitch


def body(mesh: trimesh.Trimesh, *offset: float) -> Mesh:
    found = as_mesh(mesh)
    return Mesh(found.vertices + np.array(offset), found.triangles)


def test_round_boss_is_packed_like_a_round_island() -> None:
    region = region_less(PLATE, KeepOut(sphere=(20.0, 5.0, 0.0), diameter=16.0, margin=2.0))
    island = coarse_sheet([rectangle_outline(100, 60)[0], circle(10, (20.0, 5.0))[::-1]])
    like = make_region(island, np.ones(len(island.triangles), bool))
    pattern, reference = packed(region), packed(like)
    assert region.area == pytest.approx(like.area, rel=1e-4)
    assert region.kept_out == pytest.approx(np.pi * 100, rel=1e-3)
    assert len(pattern) == len(reference)
    assert (pattern.row == 0).sum() == (reference.row == 0).sum()
    ours, theirs = measure(pattern, region), measure(reference, like)
    assert ours.six > theirs.six - 0.03
    assert ours.gap_min > theirs.gap_min - 0.05
    away = np.linalg.norm(pattern.position - [20, 5, 0], axis=1) - 10
    assert np.abs(beside(pattern, away) - 0.5).max() < 0.005


@settings(max_examples=5, deadline=None, derandomize=True)
@given(
    x=st.floats(-25, 25),
    y=st.floats(-8, 8),
    diameter=st.floats(4, 24),
    margin=st.floats(0, 4),
)
def test_no_feature_is_nearer_than_the_margin(x: float, y: float, diameter: float, margin: float) -> None:
    boss = KeepOut(cylinder=(x, y, 30.0), diameter=diameter, margin=margin)
    region = region_less(PLATE, boss)
    pattern = packed(region)
    away = np.hypot(pattern.position[:, 0] - x, pattern.position[:, 1] - y) - diameter / 2 - margin
    assert (away - pattern.diameter / 2).min() > -1e-3 * PITCH
    assert min_margin(pattern, region) == pytest.approx((away - pattern.diameter / 2).min(), abs=0.2 * PITCH)


def test_limits_count_keep_outs_as_boundary() -> None:
    region = region_less(PLATE, KeepOut(box=(0.0, 0.0, 0.0), size=(30.0, 12.0, 1.0)))
    pattern = packed(region, min_margin=0.9)
    assert min_margin(pattern, region) == pytest.approx(0.9, abs=1e-6)
    assert (pattern.diameter < 1.3).sum() > 20  # the first row, which wished for 1.8


@pytest.mark.parametrize("way", ["object", "file", "collection"])
def test_body_is_avoided_in_its_shadow(way: str) -> None:
    ring = body(trimesh.creation.annulus(6, 12, 4, sections=160), -10.0, 3.0, 40.0)
    peg = body(trimesh.creation.cylinder(4, 5, sections=160), 30.0, -10.0, -9.0)
    solids: Any = {(way, "bosses"): [Solid(ring, Z), Solid(peg, Z)]}
    entry = KeepOut(**{way: "bosses"}, margin=1.0)  # type: ignore[arg-type]
    region = region_less(PLATE, entry, solids=solids)
    assert len(region.loops) == 4
    assert region.area == pytest.approx(6000 - np.pi * (13**2 - 5**2 + 5**2), rel=1e-3)
    assert region.sheet.max() == 1  # the ring's inside is filled too
    pattern = packed(region)
    from_ring = np.abs(np.linalg.norm(pattern.position[:, :2] - [-10, 3], axis=1) - 9) - 4
    assert np.abs(beside(pattern, from_ring) - 0.5).max() < 0.005


def test_body_seen_along_another_axis_and_within_reach() -> None:
    bar = body(trimesh.creation.box((10, 60, 2)), 0.0, 0.0, 12.0)
    solids = {("object", "bar"): [Solid(bar, np.array([0.0, 1.0, 0.0]))]}
    with pytest.raises(RegionError, match="leave nothing"):  # the whole plane y = 0 is in its shadow
        region_less(
            coarse_sheet(rectangle_outline(8, 8)), KeepOut(object="bar", axis=(0, 0, 1)), solids=solids
        )
    assert region_less(PLATE, KeepOut(object="bar"), solids=solids).kept_out == 0
    near = KeepOut(object="bar", axis=(0, 0, 1), reach=11.5)
    far = KeepOut(object="bar", axis=(0, 0, 1), reach=10.5)
    assert region_less(PLATE, near, solids=solids).kept_out == pytest.approx(600, rel=1e-3)
    assert region_less(PLATE, far, solids=solids).kept_out == 0
    assert "takes nothing" in region_less(PLATE, far, solids=solids).notes[0]
    assert not region_less(PLATE, near, solids=solids).notes


def test_open_and_flat_bodies_cover_what_they_show() -> None:
    letter = coarse_sheet([rectangle_outline(20, 20)[0], rectangle_outline(8, 8)[0][::-1]])
    upside_down = Mesh(letter.vertices + [0, 0, 5], letter.triangles[:, ::-1])
    region = region_less(PLATE, KeepOut(object="O"), solids={("object", "O"): [Solid(upside_down, Z)]})
    assert region.kept_out == pytest.approx(400 - 64, rel=1e-3)


@pytest.mark.parametrize("margin", [0.0, 2.5])
def test_faces_are_taken_out_with_a_margin(margin: float) -> None:
    panel = panel_sheet(40)
    middle = panel.corners.mean(axis=1)
    boss = (np.abs(middle[:, :2]) < 22).all(axis=1)
    region = region_less(panel, KeepOut(faces="boss", margin=margin), boss=boss)
    pattern = packed(region, 6.5)
    bare = make_region(panel, ~boss)
    edges = bare.boundary_segments[(np.abs(bare.boundary_segments[:, :, :2]) < 50).all(axis=(1, 2))]
    from bubble_pattern_addon.core.distance import boundary_distance

    away = boundary_distance(pattern.position, edges) - margin
    row = beside(pattern, away, 6.5) - 0.5
    assert row.min() > -0.005
    # between two of the teeth that the faces' edges make
    assert row.max() < (0.02 if margin == 0 else 0.005)
    assert (region.within is None) == (margin == 0)


def test_faces_on_the_other_side_of_a_thin_wall_do_not_count() -> None:
    solid = slab(panel_sheet(20), 1.0)
    whole = make_region(solid, np.ones(len(solid.triangles), bool))
    spot = (solid.area_vectors[:, 2] > 0) & (np.abs(solid.corners.mean(axis=1)[:, :2]) < 30).all(axis=1)
    region = region_less(solid, KeepOut(faces="spot", margin=5.0), spot=spot)
    below, whole_below = region.normals[:, 2] < -0.5, whole.normals[:, 2] < -0.5
    area, whole_area = (np.linalg.norm(r.area_vectors, axis=1) / 2 for r in (region, whole))
    assert area[below].sum() == pytest.approx(whole_area[whole_below].sum())
    assert region.kept_out > whole_area[spot].sum() + 5 * 4 * 55


def test_pieces_know_their_places_on_the_base() -> None:
    region = region_less(PANEL, KeepOut(sphere=(10.0, 20.0, 18.0), diameter=60.0))
    rng = np.random.default_rng(4)
    spots = Spots(rng.integers(0, len(region.triangles), 400), rng.dirichlet([1, 1, 1], 400))
    places = on_base(region, spots)
    there = np.einsum("nk,nkc->nc", places.barycentric, PANEL.corners[places.triangle])
    assert np.abs(there - places.position).max() < 1e-9
    back = on_region(region, places)
    points = np.einsum("nk,nkc->nc", back.barycentric, region.corners[back.row])
    assert np.abs(points - places.position).max() < 1e-9
    assert region.flat is False
    assert region.area + region.kept_out == pytest.approx(make_region(PANEL, region_mask()).area)


def region_mask() -> Bools:
    return np.ones(len(PANEL.triangles), bool)


def test_shaping_anew_on_a_cut_region_gives_the_same() -> None:
    region = region_less(PANEL, KeepOut(sphere=(10.0, 20.0, 18.0), diameter=60.0))
    pattern = packed(region, 6.5)
    recipe = Recipe(packing=Packing(pitch=Constant(6.5)), shaping=Shaping(diameter=Constant(0.6 * 6.5)))
    again = reshaped(pattern, region, recipe, NOTHING)
    assert np.array_equal(again.diameter, pattern.diameter)


def test_keep_out_can_open_a_closed_surface() -> None:
    sphere = sphere_sheet(30.0, 4)
    region = region_less(sphere, KeepOut(cylinder=(0, 0, 30.0), diameter=20.0, reach=5.0))
    assert len(region.loops) == 1
    pattern = packed(region, 5.0)
    polar = np.linalg.norm(pattern.position[:, :2], axis=1)[pattern.position[:, 2] > 0]
    assert polar.min() > 12


def test_sub_regions_stay_apart_round_a_keep_out() -> None:
    mesh = panel_sheet(20)
    parts = (mesh.corners.mean(axis=1)[:, 0] > 0).astype(np.int64)
    everything = np.ones(len(parts), bool)
    boss = [KeepOut(sphere=(0.0, 0.0, 20.0), diameter=50.0)]
    region = region_with_keep_outs(mesh, everything, parts, 4.0, boss, {}, {})
    assert region.sheet.max() == 1
    assert len(region.loops) == 2
    assert set(np.unique(region.reserve)) == {0.0, 2.0}
    pattern = packed(region, 6.5)
    assert np.abs(pattern.position[:, 0]).min() > 2 + 3.25 - 0.05


# -- recipe --------------------------------------------------------------------------------------------------

ENTRIES: Sequence[KeepOut] = (
    KeepOut(faces="Bosses", margin=0.5),
    KeepOut(object="Logo", axis=(0.0, 1.0, 0.0), reach=2.0),
    KeepOut(collection="Bosses", margin=1.0),
    KeepOut(file="logo.stl"),
    KeepOut(sphere=(1.0, 2.0, 3.0), diameter=4.0),
    KeepOut(cylinder=(1.0, 2.0, 3.0), diameter=4.0, axis=(1.0, 1.0, 0.0)),
    KeepOut(box=(1.0, 2.0, 3.0), size=(4.0, 5.0, 6.0), axis=(0.0, 1.0, 1.0), along=(1.0, 0.0, 0.0)),
)


def test_keep_outs_go_to_toml_and_back() -> None:
    recipe = Recipe(region=RegionChoice(all=True, keep_out=tuple(ENTRIES)))
    assert recipe_from_dict(tomllib.loads(recipe_to_toml(recipe))) == recipe


@pytest.mark.parametrize(
    ("entry", "message"),
    [
        ("{ margin = 1.0 }", "entry 1 names nothing: give one of faces"),
        ('{ faces = "a", object = "b" }', "names 2 things"),
        ("{ sphere = [0, 0, 0] }", "a sphere lacks diameter"),
        ("{ box = [0, 0, 0], size = [1, 0, 1] }", "size = 0 must be a number above 0"),
        ("{ sphere = [0, 0, 0], diameter = 1, reach = 2 }", "reach does not go with sphere"),
        ("{ cylinder = [0, 0, 0], diameter = 1, axis = [0, 0, 0] }", "is no direction"),
        ("{ box = [0, 0, 0], size = [1, 1, 1], along = [0, 0, 2] }", "are parallel"),
        ('{ object = "a", reach = -1 }', "reach = -1 must be at least 0"),
        ('{ faces = "a", margin = -1 }', "margin = -1 must be at least 0"),
        ('{ faces = "a", marign = 1 }', "did you mean margin"),
        ("3", "must be a list of tables"),
    ],
)
def test_keep_outs_that_make_no_sense(entry: str, message: str) -> None:
    text = f"[region]\nall = true\nkeep_out = [{entry}]"
    with pytest.raises(RecipeError, match=message):
        recipe_from_dict(tomllib.loads(text))


def test_keep_outs_that_are_not_there() -> None:
    with pytest.raises(RegionError, match='no face attribute or material "bos": did you mean "boss"'):
        region_less(PLATE, KeepOut(faces="bos"), boss=np.zeros(len(PLATE.triangles), bool))
    with pytest.raises(RegionError, match='object = "Logo" is not there'):
        region_less(PLATE, KeepOut(object="Logo"))
    with pytest.raises(RegionError, match="cover all faces"):
        region_less(PLATE, KeepOut(faces="all"), all=np.ones(len(PLATE.triangles), bool))
    with pytest.raises(RegionError, match="leave nothing"):
        region_less(PLATE, KeepOut(sphere=(0, 0, 0), diameter=200))
    upright = Solid(coarse_sheet(rectangle_outline(4, 4)), np.array([1.0, 0.0, 0.0]))
    with pytest.raises(RegionError, match="no face across its axis"):
        region_less(PLATE, KeepOut(object="Logo"), solids={("object", "Logo"): [upright]})


def test_moved_recipe_keeps_out_the_same_places() -> None:
    turn = trimesh.transformations.rotation_matrix(0.7, [1, 2, 3])
    turn[:3, 3] = 5, -7, 11
    recipe = Recipe(
        region=RegionChoice(
            all=True,
            keep_out=(
                KeepOut(box=(-20, 0, 0), size=(20, 10, 4)),
                KeepOut(cylinder=(20, 0, 0), diameter=12, reach=1),
            ),
        )
    )
    before = region_less(PLATE, *recipe.region.keep_out)
    after = moved_recipe(recipe, turn, before)
    check_choice(after.region)
    there = Mesh(PLATE.vertices @ turn[:3, :3].T + turn[:3, 3], PLATE.triangles)
    assert region_less(there, *after.region.keep_out).area == pytest.approx(before.area, rel=1e-9)
    assert before.area == pytest.approx(6000 - 200 - np.pi * 36, rel=1e-4)


def test_base_with_a_keep_out_stays_as_it_is() -> None:
    base = box((0, 0, 0), (40, 40, 3))
    top = base.area_vectors[:, 2] > 0
    region = region_with_keep_outs(base, top, None, 0.0, [KeepOut(sphere=(20, 20, 3), diameter=15)], {}, {})
    assert region.base is base
    assert set(np.unique(region.triangles)) == set(np.flatnonzero(top))
