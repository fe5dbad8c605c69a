"""Outlines: exactly as wide as asked, closed, simple, and moved inward by what they should be."""

import manifold3d
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bubble_pattern_addon.core.feature_recipe import ASPECTS, Feature
from bubble_pattern_addon.core.profile import (
    covered,
    largest_inset,
    outlines,
    signed_area,
)

HOOK = ((-1, -1), (1, -1), (1, 1), (0.4, 1), (0.4, -0.4), (-1, -0.4))
PROFILES = ("circle", "ellipse", "slot", "rectangle", "polygon", "drop", "cross", "curve")


def profile(name: str, rounding: float = 0.0, corners: int = 6) -> Feature:
    rounds = name in ("rectangle", "polygon", "drop", "cross")
    return Feature(
        profile=name,
        rounding=rounding if rounds else 0.0,
        corners=corners,
        points=HOOK if name == "curve" else (),
    )


@settings(max_examples=60, deadline=None, derandomize=True)
@given(
    name=st.sampled_from(PROFILES),
    rounding=st.one_of(st.just(0.0), st.floats(0.05, 1)),
    corners=st.integers(3, 9),
    count=st.integers(3, 16).map(lambda n: 4 * n),
    sizes=st.lists(st.tuples(st.floats(0.01, 100), st.floats(0.05, 1)), min_size=1, max_size=4),
    share=st.floats(0, 0.95),
)
def test_outlines_are_simple_and_measure_their_diameter(name, rounding, corners, count, sizes, share):
    diameter, aspect = np.array(sizes).T
    made = outlines(profile(name, rounding, corners), diameter, aspect, count)
    assert np.allclose(np.linalg.norm(made.corners, axis=2).max(axis=1), diameter / 2, rtol=1e-12)
    moved = made.at(np.stack([0 * made.room, share * made.room], axis=1))
    assert np.allclose(moved[:, 0], made.corners)
    edges = np.linalg.norm(np.roll(moved, -1, axis=2) - moved, axis=3)
    assert (edges.min(axis=(1, 2)) > 1e-7 * diameter).all()
    # manifold3d's polygons have a fixed number of decimals
    for outline in (moved / diameter[:, None, None, None]).reshape(-1, *moved.shape[2:]):
        section = manifold3d.CrossSection([outline], manifold3d.FillRule.Positive)
        assert section.num_contour() == 1
        assert section.area() == pytest.approx(float(signed_area(outline)), rel=1e-5)
    reach = np.linalg.norm(moved[:, 1], axis=2).max(axis=1)
    assert np.all(reach <= diameter / 2 * (1 + 1e-12))


@pytest.mark.parametrize("name", [name for name in PROFILES if name != "ellipse"])
def test_an_inset_moves_every_straight_edge_by_just_that(name):
    made = outlines(profile(name), np.full(1, 2.0), np.full(1, ASPECTS.get(name, 1.0)), 64)
    inset = 0.3 * made.room[0]
    moved = made.at(np.full((1, 1), inset))[0, 0]
    section = manifold3d.CrossSection([made.corners[0]], manifold3d.FillRule.Positive)
    expected = section.offset(-inset, manifold3d.JoinType.Miter, 100.0)
    assert float(signed_area(moved)) == pytest.approx(expected.area(), rel=2e-3)


@pytest.mark.parametrize(
    ("name", "area"),
    [
        ("circle", np.pi),
        ("ellipse", np.pi * 0.6),
        ("slot", np.pi * 0.16 + 4 * 0.6 * 0.4),
        ("rectangle", 4 * 0.6 / 1.36),
        ("polygon", 1.5 * np.sqrt(3)),
        ("cross", (4 * 0.35 * 2 - 4 * 0.35**2) / (1 + 0.35**2)),
    ],
)
def test_areas_are_those_of_the_formulas(name, area):
    made = outlines(profile(name), np.full(1, 2.0), np.full(1, ASPECTS.get(name, 1.0)), 256)
    assert float(signed_area(made.corners)[0]) == pytest.approx(area, rel=2e-3)


def test_a_circle_across_flats_has_its_facets_on_the_circle():
    made = outlines(Feature(across="flats"), np.full(1, 2.0), np.ones(1), 16)
    corners = made.corners[0]
    middle = (corners + np.roll(corners, 1, axis=0)) / 2
    assert np.allclose(np.linalg.norm(middle, axis=1), 1)


def test_covered_is_the_circle_that_fits():
    square = np.array([[[-1, -1], [1, -1], [1, 1], [-1, 1]]], dtype=float)
    assert covered(square) == pytest.approx([1.0])
    assert covered(square + [3, 0]) == pytest.approx([0.0])
    assert covered(square + [0.5, 0]) == pytest.approx([0.5])


def test_the_largest_inset_is_half_the_narrowest_place():
    assert largest_inset(np.array([[-2, -1], [2, -1], [2, 1], [-2, 1]])) * np.sqrt(5) == pytest.approx(
        1, 1e-2
    )
    assert largest_inset(np.array(HOOK)) * np.sqrt(2) == pytest.approx(0.3, 2e-2)
    assert largest_inset(np.array([[0, 0], [1, 1], [1, 0], [0, 1]])) == 0
