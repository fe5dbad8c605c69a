"""Axes and headings of features: where they should point, on every kind of surface."""

from __future__ import annotations

import csv
from dataclasses import replace

import numpy as np
import pytest

from bubble_pattern_addon.core.errors import FieldError, RecipeError
from bubble_pattern_addon.core.export import write_features
from bubble_pattern_addon.core.feature_recipe import Feature
from bubble_pattern_addon.core.fields import Linear
from bubble_pattern_addon.core.heading import along_boundary, headed
from bubble_pattern_addon.core.links import Links, links_of
from bubble_pattern_addon.core.mesh import Floats, Mesh
from bubble_pattern_addon.core.metric import Constant
from bubble_pattern_addon.core.moving import moved_feature
from bubble_pattern_addon.core.pattern import Pattern, aimed, all_bubbles, joined, split, take
from bubble_pattern_addon.core.pipeline import pattern_steps
from bubble_pattern_addon.core.progress import drive
from bubble_pattern_addon.core.quality import open_area
from bubble_pattern_addon.core.recipe import Packing, Recipe, Shaping
from bubble_pattern_addon.core.recipe_names import feature_names
from bubble_pattern_addon.core.region import Region, make_region
from bubble_pattern_addon.core.shaping import reshaped
from bubble_pattern_addon.core.surroundings import NOTHING, Surroundings
from scripts.shapes import SHAPES

NAMES = ("trapezoid", "panel", "tube")
TURNS = {
    "row": Feature(angle=20.0),
    "fixed": Feature(turn="fixed", turn_direction=(1.0, 0.5, 0.25)),
    "towards": Feature(turn="towards", turn_point=(1.0, 2.0, 3.0)),
    "around": Feature(turn="around", turn_point=(1.0, 2.0, 3.0), angle=10.0),
    "boundary": Feature(turn="boundary"),
    "curvature": Feature(turn="curvature"),
    "random": Feature(turn="random", turn_seed=3),
    "pull": Feature(axis=0.7, pull=(0.3, 0.2, 1.0), turn="fixed", turn_direction=(0.0, 1.0, 0.0)),
}


class Case:
    def __init__(self, name: str) -> None:
        shape = SHAPES[name]()
        self.region: Region = make_region(shape.mesh, shape.selected)
        pitch = float(np.sqrt(self.region.area / 150))
        self.recipe = Recipe(packing=Packing(pitch=Constant(pitch)), shaping=Shaping(Constant(0.6 * pitch)))
        self.pattern: Pattern = drive(pattern_steps(self.region, self.recipe))
        self.links: Links = links_of(self.pattern, self.region)

    def headed(self, feature: Feature, **more: object) -> Pattern:
        return headed(self.pattern, self.links, feature, Surroundings(region=self.region, **more))


@pytest.fixture(scope="module")
def cases() -> dict[str, Case]:
    return {name: Case(name) for name in NAMES if name in SHAPES}


def alike(one: Floats, other: Floats) -> Floats:
    return np.abs(np.einsum("ni,ni->n", one, other))


@pytest.mark.parametrize("turn", TURNS)
def test_headings_are_unit_vectors_square_to_the_axes(cases, turn):
    for case in cases.values():
        if turn == "boundary" and not len(case.region.rim):
            continue
        stands = aimed(case.headed(TURNS[turn]))
        assert np.allclose(np.linalg.norm(stands.normal, axis=1), 1)
        assert np.allclose(np.linalg.norm(stands.tangent, axis=1), 1)
        assert np.allclose(np.einsum("ni,ni->n", stands.normal, stands.tangent), 0, atol=1e-12)


def test_the_default_leaves_the_pattern_as_it_is(cases):
    for case in cases.values():
        plain = case.headed(Feature())
        assert plain.axis is plain.heading is plain.share is None
        assert plain.sizes == {}
        assert aimed(plain) is plain


def test_points_are_faced_and_gone_round(cases):
    pattern = cases["trapezoid"].pattern
    point = (3.0, -2.0, 0.0)
    away = np.array(point) - pattern.position
    away /= np.linalg.norm(away, axis=1)[:, None]
    towards = cases["trapezoid"].headed(Feature(turn="towards", turn_point=point)).heading
    around = cases["trapezoid"].headed(Feature(turn="around", turn_point=point)).heading
    assert np.allclose(towards, away, atol=1e-9)
    assert np.allclose(np.einsum("ni,ni->n", around, away), 0, atol=1e-9)
    turned = cases["trapezoid"].headed(Feature(turn="towards", turn_point=point, angle=90.0)).heading
    assert np.allclose(np.cross(pattern.normal, towards), turned, atol=1e-9)


def test_the_first_row_heads_along_its_boundary(cases):
    case = cases["trapezoid"]
    pattern = case.headed(Feature(turn="boundary"))
    first = np.flatnonzero(pattern.row == 0)
    a, b = case.region.boundary_segments.swapaxes(0, 1)
    for which in first[::7]:
        share = np.clip(
            np.einsum("si,si->s", pattern.position[which] - a, b - a) / np.einsum("si,si->s", b - a, b - a),
            0,
            1,
        )
        nearest = np.linalg.norm(a + share[:, None] * (b - a) - pattern.position[which], axis=1).argmin()
        along = (b - a)[nearest] / np.linalg.norm((b - a)[nearest])
        assert pattern.heading[which] @ along == pytest.approx(1, abs=1e-9)


def test_a_boundary_of_small_steps_leads_as_the_line_that_it_stands_for():
    cells, size = 60, 40.0
    line = np.linspace(-size, size, cells + 1)
    x, y = np.meshgrid(line, line, indexing="ij")
    number = np.arange((cells + 1) ** 2).reshape(cells + 1, cells + 1)
    a, b, c, d = number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]
    triangles = np.concatenate([np.stack([a, b, c], -1), np.stack([a, c, d], -1)], axis=0).reshape(-1, 3)
    mesh = Mesh(np.column_stack([x.ravel(), y.ravel(), np.zeros(x.size)]), triangles)
    middle = mesh.vertices[triangles].mean(axis=1)
    cell = (np.floor((middle[:, :2] + size) / (2 * size / cells)) + 0.5) * (2 * size / cells) - size
    region = make_region(mesh, np.linalg.norm(cell, axis=1) < 34)
    angle = np.linspace(0, 2 * np.pi, 90, endpoint=False)
    radius = np.tile([10.0, 20.0, 30.0], 30)
    position = np.stack([radius * np.cos(angle), radius * np.sin(angle), np.zeros(90)], axis=1)
    along = along_boundary(region, position, np.full(90, 4.0))
    tangent = np.stack([-np.sin(angle), np.cos(angle), np.zeros(90)], axis=1)
    # the nearest point of the inner circles is on the steps anywhere near
    assert (np.abs(np.einsum("ni,ni->n", along, tangent)) > np.cos(np.radians(30.0))).all()
    assert (np.abs(np.einsum("ni,ni->n", along, tangent))[2::3] > np.cos(np.radians(18.0))).all()


def test_on_a_tube_the_least_bend_is_along_its_axis(cases):
    case = cases["tube"]
    extent = np.ptp(case.region.corners.reshape(-1, 3), axis=0)
    pattern = case.headed(Feature(turn="curvature"))
    length = np.abs(pattern.heading).mean(axis=0)
    assert length.max() > 0.98, extent
    flat = cases["trapezoid"].headed(Feature(turn="curvature"))
    assert np.allclose(flat.heading, flat.tangent)


def test_random_headings_are_the_bubbles_own(cases):
    case = cases["trapezoid"]
    feature = Feature(turn="random", turn_seed=5)
    whole = case.headed(feature)
    again = case.headed(feature)
    other = case.headed(replace(feature, turn_seed=6))
    assert np.array_equal(whole.heading, again.heading)
    assert not np.allclose(whole.heading, other.heading)
    some = np.arange(0, len(case.pattern), 3)
    part = headed(take(case.pattern, some), Links(*np.zeros((4, 0), dtype=int)), feature, NOTHING)
    assert np.allclose(part.heading, whole.heading[some])
    angle = np.arctan2(*whole.heading[:, 1::-1].T)
    assert abs(np.exp(1j * angle).mean()) < 0.25


def test_an_attribute_leads(cases):
    case = cases["trapezoid"]
    feature = Feature(turn="attribute", turn_attribute="flow")
    assert feature_names(feature).vectors == {"flow"}
    way = np.zeros((len(case.region.base.triangles), 3, 3))
    way[..., 0], way[..., 1], way[..., 2] = 3.0, 4.0, 5.0
    assert np.allclose(case.headed(feature, vectors={"flow": way}).heading, [0.6, 0.8, 0])
    parts = {f"flow_{axis}": way[..., k] for k, axis in enumerate("xyz")}
    assert np.allclose(case.headed(feature, attributes=parts).heading, [0.6, 0.8, 0])
    with pytest.raises(FieldError, match=r"turn_attribute.*no attribute of vectors"):
        case.headed(feature)


def test_a_closed_region_has_no_boundary_to_follow(cases):
    shape = SHAPES["sphere"]()
    case = cases["trapezoid"]
    region = make_region(shape.mesh, shape.selected)
    with pytest.raises(FieldError, match="closed"):
        headed(case.pattern, case.links, Feature(turn="boundary"), Surroundings(region=region))


def test_half_way_between_normal_and_pull(cases):
    case = cases["panel"]
    pull = np.array([0.0, 0.0, 1.0])
    half = case.headed(Feature(axis=0.5, pull=tuple(pull))).axis
    assert np.allclose(half @ pull, np.einsum("ni,ni->n", half, case.pattern.normal))
    assert np.allclose(case.headed(Feature(axis=1.0, pull=(0, 0, 7.0))).axis, pull)


def test_sizes_vary_over_the_region_and_are_judged_there(cases, tmp_path):
    case = cases["trapezoid"]
    grows = Linear(from_=0.2, to=0.9, direction=(1.0, 0.0, 0.0))
    feature = Feature(
        profile="slot", aspect=grows, turn="boundary", angle=Linear(from_=0, to=90, direction=(0, 1, 0))
    )
    pattern = reshaped(case.pattern, case.region, replace(case.recipe, feature=feature), NOTHING)
    assert set(pattern.sizes) == {"aspect"}
    order = np.argsort(pattern.position[:, 0])
    assert np.all(np.diff(pattern.sizes["aspect"][order]) >= -1e-12)
    assert open_area(pattern, case.region) < open_area(case.pattern, case.region)
    write_features(tmp_path / "features.csv", pattern)
    with (tmp_path / "features.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert list(rows[0])[-7:] == ["ax", "ay", "az", "hx", "hy", "hz", "aspect"]
    assert [float(row["aspect"]) for row in rows] == pattern.sizes["aspect"].tolist()
    with pytest.raises(RecipeError, match=r"\[feature\] depth becomes"):
        case.headed(Feature(depth=Linear(from_=-1, to=1, direction=(1.0, 0.0, 0.0))))


def test_columns_go_with_their_features(cases):
    pattern = cases["trapezoid"].headed(
        replace(TURNS["pull"], depth=Linear(from_=1, to=2, direction=(1, 0, 0)))
    )
    kept = np.arange(len(pattern)) % 3 > 0
    back = all_bubbles(split(pattern, kept))
    for name in ("axis", "heading"):
        assert np.array_equal(getattr(back, name), getattr(pattern, name))
    assert np.array_equal(back.sizes["depth"], pattern.sizes["depth"])
    plain = replace(pattern, axis=None, heading=None, sizes={}, share=np.full(len(pattern), 0.5))
    both = joined([pattern, plain])
    assert np.array_equal(both.axis[len(pattern) :], plain.normal)
    assert np.array_equal(both.heading[: len(pattern)], pattern.heading)
    assert both.sizes == {}
    assert both.share.tolist() == [1.0] * len(pattern) + [0.5] * len(plain)


def test_a_feature_moves_with_everything_else(cases):
    turn = np.eye(4)
    turn[:3, :3] = [[0, -1, 0], [1, 0, 0], [0, 0, 1]]
    turn[:3, 3] = [1, 2, 3]
    feature = Feature(
        axis=0.5,
        pull=(1, 0, 0),
        turn="around",
        turn_point=(1, 0, 0),
        depth=Linear(from_=1, to=2, direction=(1, 0, 0)),
    )
    moved = moved_feature(feature, turn, cases["trapezoid"].region)
    assert moved.pull == (0, 1, 0)
    assert moved.turn_point == (1, 3, 3)
    assert moved.depth.direction == (0, 1, 0)
    assert moved_feature(TURNS["fixed"], turn, cases["trapezoid"].region).turn_direction == (-0.5, 1, 0.25)
