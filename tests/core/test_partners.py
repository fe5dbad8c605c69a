"""Symmetric patterns beyond their places: sub-regions, fixed sizes, and how partners stand."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial import cKDTree

from bubble_pattern_addon.core.blending import FaceSet, SubRegions
from bubble_pattern_addon.core.fields import Linear
from bubble_pattern_addon.core.isometries import images, isometries
from bubble_pattern_addon.core.mesh import Floats
from bubble_pattern_addon.core.metric import Constant
from bubble_pattern_addon.core.moving import moved_pattern
from bubble_pattern_addon.core.partners import along_or_square, found_partners, kin_of, partner_rows
from bubble_pattern_addon.core.pattern import Pattern, aimed, take
from bubble_pattern_addon.core.pipeline import pattern_steps
from bubble_pattern_addon.core.progress import drive
from bubble_pattern_addon.core.recipe import Feature, Limits, Packing, Recipe, Seed, Shaping
from bubble_pattern_addon.core.region import Region, make_region
from bubble_pattern_addon.core.shaping import reshaped
from bubble_pattern_addon.core.surroundings import Surroundings
from scripts.shapes import SHAPES, Shape, circle, coarse_sheet, grid_sheet, rectangle_outline

EXACT = 1e-6


def island() -> Shape:
    """A rectangle with a round island in its middle."""
    mesh = coarse_sheet([*rectangle_outline(80, 50), circle(9.0)[::-1]])
    return Shape(mesh, np.ones(len(mesh.triangles), dtype=bool), 3.0)


def packed(shape: Shape, word: str, **choices: object) -> tuple[Region, Pattern]:
    region = make_region(shape.mesh, shape.selected)
    shaping = Shaping(diameter=Constant(0.5 * shape.pitch))
    recipe = Recipe(packing=Packing(pitch=Constant(shape.pitch), symmetry=word), shaping=shaping)
    return region, drive(pattern_steps(region, replace(recipe, **choices)))


def error(pattern: Pattern) -> float:
    """The farthest, in pitches, that the image of a feature is from the feature that is its partner."""
    assert pattern.isometries is not None
    assert pattern.partners is not None
    away = images(pattern.isometries, pattern.position) - pattern.position[pattern.partners.T]
    return float((np.linalg.norm(away, axis=2) / pattern.pitch).max())


# --- sub-regions


def zones(middle: float = 0.0, gap: float | None = None) -> tuple[Region, Surroundings]:
    """A plate of 64 x 48 with a sub-region 28 wide about x = `middle`; with a `gap` each is bounded by its
    own border.
    """
    mesh = grid_sheet(
        np.linspace(-32, 32, 65), np.linspace(-24, 24, 49), lambda u, v: np.stack([u, v, 0 * u], axis=-1)
    )
    zone = (np.abs(mesh.corners.mean(axis=1)[:, 0] - middle) < 14).astype(np.int64)
    selected = np.ones(len(zone), dtype=bool)
    region = make_region(mesh, selected, None if gap is None else zone, gap or 0.0)
    return region, Surroundings(attributes={"zone": zone.astype(np.float64)})


def in_zones(inner: float, outer: float) -> SubRegions:
    return SubRegions(
        sets=(FaceSet(attribute="zone", equals=1, value=Constant(inner)),), otherwise=Constant(outer)
    )


@pytest.mark.parametrize("word", ["x", "xy", "rotate 2 z"])
@pytest.mark.parametrize("gap", [None, 1.0])
def test_sub_regions_each_with_its_pitch_are_packed_symmetrically(word, gap):
    region, around = zones(gap=gap)
    recipe = Recipe(
        packing=Packing(pitch=in_zones(2.0, 3.0), symmetry=word),
        shaping=Shaping(diameter=in_zones(1.2, 1.8)),
        limits=Limits(min_web=0.4),
    )
    pattern = drive(pattern_steps(region, recipe, around))
    assert pattern.symmetry == word
    assert error(pattern) < EXACT
    assert np.ptp(pattern.pitch[pattern.partners], axis=1).max() == 0
    assert np.ptp(pattern.diameter[partner_rows(pattern)], axis=1).max() == 0
    assert set(np.unique(pattern.pitch)) == {2.0, 3.0}
    assert len(cKDTree(pattern.position).query_pairs(0.9)) == 0
    if gap is not None:
        # the first rows on both sides of the border stay half the gap and half a pitch away from it
        to_border = np.abs(np.abs(pattern.position[:, 0]) - 14)
        assert (to_border > 0.999 * (gap / 2 + pattern.pitch / 2)).all()


def test_sub_regions_that_are_not_symmetric_are_packed_without_and_told():
    region, around = zones(middle=3.0)
    recipe = Recipe(packing=Packing(pitch=in_zones(2.0, 3.0), symmetry="x"))
    pattern = drive(pattern_steps(region, recipe, around))
    assert pattern.symmetry is None
    assert pattern.partners is None
    assert any("pitch is not symmetric" in note for note in pattern.notes)
    # borders alone count as well, where the plate is symmetric and the pitch is the same everywhere
    region, around = zones(middle=3.0, gap=1.0)
    recipe = Recipe(packing=Packing(pitch=Constant(3.0), symmetry="x"))
    pattern = drive(pattern_steps(region, recipe, around))
    assert pattern.symmetry is None
    assert any("target region is not symmetric" in note for note in pattern.notes)


# --- fixed sizes


@pytest.mark.parametrize(
    ("word", "solver"), [("x", "direct"), ("xy", "direct"), ("rotate 2 z", "direct"), ("x", "iterate")]
)
def test_a_fixed_size_is_its_partners_too(word, solver):
    seeds = (Seed(at=(30.0, 15.0, 0.0), diameter=2.4), Seed(at=(12.0, 0.0, 0.0), diameter=0.6))
    _, plain = packed(island(), word)
    _, pattern = packed(
        island(), word, shaping=Shaping(diameter=Constant(1.5), seeds=seeds, solver=solver, tolerance=1e-9)
    )
    near = cKDTree(pattern.position).query([seed.at for seed in seeds])[1]
    rows = partner_rows(pattern)
    assert pattern.diameter[near] == pytest.approx([2.4, 0.6])
    assert pattern.diameter[rows[near]] == pytest.approx(np.repeat([[2.4], [0.6]], rows.shape[1], axis=1))
    assert np.ptp(pattern.diameter[rows], axis=1).max() < 1e-6
    assert np.ptp(pattern.diameter) > 1.5
    assert len(plain) == len(pattern)


def test_partners_with_seeds_of_their_own_keep_these():
    seeds = (Seed(at=(30.0, 15.0, 0.0), diameter=2.4), Seed(at=(-30.0, 15.0, 0.0), diameter=1.0))
    _, pattern = packed(island(), "x", shaping=Shaping(diameter=Constant(1.5), seeds=seeds))
    near = cKDTree(pattern.position).query([seed.at for seed in seeds])[1]
    assert pattern.partners[near[0], 1] == near[1]
    assert pattern.diameter[near] == pytest.approx([2.4, 1.0])


def test_without_symmetry_a_seed_fixes_one_feature():
    seeds = (Seed(at=(30.0, 15.0, 0.0), diameter=2.4),)
    _, pattern = packed(
        island(), "off", shaping=Shaping(diameter=Constant(1.5), seeds=(*seeds, Seed((0.0, 20.0, 0.0), 1.0)))
    )
    assert (np.abs(pattern.diameter - 2.4) < 1e-9).sum() == 1


# --- how features stand

SLOT = Feature(profile="slot")


def unlike(pattern: Pattern, exact: bool = False) -> Floats:
    """How far, (n,), the image of the direction of a feature is from that of its partner; either way round
    unless they must be so `exact`ly.
    """
    along = aimed(pattern).tangent
    image = np.einsum("kab,nb->kna", pattern.isometries.turns, along)
    there = along[partner_rows(pattern).T]
    away = np.linalg.norm(image - there, axis=2)
    if not exact:
        away = np.minimum(away, np.linalg.norm(image + there, axis=2))
    return away.max(axis=0)


TURNS = {
    "row": SLOT,
    "random": replace(SLOT, turn="random", turn_seed=3),
    "angle": replace(SLOT, angle=25.0),
    "angle field": replace(SLOT, angle=Linear(from_=0.0, to=80.0, direction=(0.0, 1.0, 0.0))),
    "angle field that is not symmetric": replace(
        SLOT, angle=Linear(from_=0.0, to=80.0, direction=(1.0, 0.0, 0.0))
    ),
    "random and angle": replace(SLOT, turn="random", angle=25.0),
    "boundary": replace(SLOT, turn="boundary"),
    "fixed square to the plane": replace(SLOT, turn="fixed", turn_direction=(1.0, 0.0, 0.0), angle=20.0),
}


@pytest.mark.parametrize("word", ["x", "xy", "rotate 2 z"])
@pytest.mark.parametrize("turn", TURNS)
def test_partners_stand_as_each_others_images(word, turn):
    _, pattern = packed(island(), word, feature=TURNS[turn])
    assert unlike(pattern).max() < EXACT
    # who is on no plane stands so to its very direction, not only either way round
    rows = partner_rows(pattern)
    alone = (np.diff(np.sort(rows, axis=1), axis=1) > 0).all(axis=1)
    if "fixed" not in turn:
        assert unlike(pattern, exact=True)[alone].max() < EXACT


@pytest.mark.parametrize(("name", "word"), [("sphere", "x"), ("disc", "rotate 6"), ("disc", "rotate 5")])
def test_partners_stand_so_on_other_shapes(name, word):
    shape = SHAPES[name]()
    shape = replace(shape, pitch=2 * shape.pitch)
    _, pattern = packed(shape, word, feature=TURNS["random"])
    rows = partner_rows(pattern)
    # one on the axis of a rotation cannot
    off_axis = (rows[:, 1:] != np.arange(len(pattern))[:, None]).any(axis=1) | (len(pattern.isometries) == 2)
    assert unlike(pattern)[off_axis].max() < EXACT


def test_random_turns_are_random_in_one_half():
    _, pattern = packed(island(), "x", feature=TURNS["random"])
    half = pattern.position[:, 0] > 1e-6
    angle = np.mod(np.arctan2(*aimed(pattern).tangent[half, 1::-1].T), np.pi)
    assert np.histogram(angle, 6, (0, np.pi))[0].min() > 0.08 * half.sum()


def test_a_direction_given_in_space_is_kept_though_it_is_not_symmetric():
    feature = replace(SLOT, turn="fixed", turn_direction=(1.0, 1.0, 0.0))
    _, pattern = packed(island(), "x", feature=feature)
    assert np.abs(aimed(pattern).tangent - np.array([1, 1, 0]) / np.sqrt(2)).max() < EXACT


def test_a_later_shaping_keeps_them_alike():
    region, pattern = packed(island(), "xy")
    recipe = Recipe(shaping=Shaping(diameter=Constant(1.4)), feature=TURNS["random and angle"])
    assert unlike(reshaped(pattern, region, recipe, Surroundings())).max() < EXACT
    # without what is known of the symmetry they are not
    lost = replace(pattern, isometries=None, partners=None)
    found = replace(
        reshaped(lost, region, recipe, Surroundings()),
        isometries=pattern.isometries,
        partners=pattern.partners,
    )
    assert unlike(found).max() > 0.1


def test_partners_are_found_again_from_where_they_are():
    _, pattern = packed(island(), "xy")
    assert np.array_equal(
        found_partners(pattern.isometries, pattern.position, pattern.pitch), pattern.partners
    )
    fewer = take(pattern, np.arange(len(pattern)) != 7)
    assert found_partners(pattern.isometries, fewer.position, fewer.pitch) is None
    assert partner_rows(fewer) is None
    assert kin_of(fewer) is None
    assert kin_of(replace(pattern, isometries=None)) is None


def test_a_moved_pattern_has_its_symmetry_where_it_is():
    _, pattern = packed(island(), "xy")
    angle = 0.7
    matrix = np.eye(4)
    matrix[:2, :2] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
    matrix[:3, 3] = (4.0, -7.0, 2.0)
    assert error(moved_pattern(pattern, matrix, 25.4)) < EXACT


def test_a_direction_on_a_plane_turns_to_along_it_or_square_to_it():
    _, pattern = packed(island(), "x")
    kin = kin_of(pattern)
    on = np.flatnonzero(kin.on[0])
    assert len(on) > 3
    for degrees, turned in ((10.0, 0.0), (44.0, 0.0), (46.0, 90.0), (80.0, 90.0)):
        # measured from the plane x = 0
        angle = np.radians([degrees, turned])
        given, wanted = np.stack([np.sin(angle), np.cos(angle), 0 * angle], axis=1)
        vectors = np.tile(given, (len(pattern), 1))
        result = along_or_square(kin, vectors)
        assert result[on] == pytest.approx(np.tile(wanted, (len(on), 1)), abs=1e-12)
        assert np.array_equal(np.delete(result, on, axis=0), np.delete(vectors, on, axis=0))
    # of a lattice's rows the one that is its own image: 60 degrees off the plane is another of the same
    vectors = np.tile([np.sin(np.pi / 3), 0.5, 0.0], (len(pattern), 1))
    assert along_or_square(kin, vectors, six=True)[on] == pytest.approx(
        np.tile([0.0, 1.0, 0.0], (len(on), 1)), abs=1e-12
    )


def test_patterns_of_different_symmetries_have_none_together():
    from bubble_pattern_addon.core.isometries import same_isometries

    one, moved = isometries("x", np.zeros(3)), isometries("x", np.ones(3))
    assert same_isometries([one, isometries("x", np.zeros(3))]) is one
    assert same_isometries([one, moved]) is None
    assert same_isometries([one, None]) is None
    assert same_isometries([one, isometries("xy", np.zeros(3))]) is None
