"""Which side of a wall is meant, where both sides carry the mark of the target region."""

from __future__ import annotations

from contextlib import nullcontext

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bubble_pattern_addon.core.errors import RegionError
from bubble_pattern_addon.core.mesh import Bools, Floats, Ints, Mesh
from bubble_pattern_addon.core.sides import LOOKS, check_one_side, faced_side, lies_on_both_sides

from .bases import grid, halves

SIZE = 40.0


def sheet(cells: int, bend: float = 6.0) -> Mesh:
    """A square surface curved both ways, its normals up."""
    line = np.linspace(-SIZE / 2, SIZE / 2, cells + 1)
    x, y = np.meshgrid(line, line, indexing="ij")
    height = bend * np.cos(x / 12) * np.cos(y / 12)
    places = np.stack([x.ravel(), y.ravel(), height.ravel()], axis=1)
    return Mesh(places, grid(cells, cells))


def thickened(surface: Mesh, thickness: float, offset: float) -> tuple[Mesh, Ints]:
    """A wall made of `surface`, below it (offset -1), above it (1) or in between; and which of its triangles
    are its outer side (1), its inner side (-1) and its rim (0).
    """
    up = np.zeros_like(surface.vertices)
    np.add.at(up, surface.triangles, surface.area_vectors[:, None])
    up /= np.linalg.norm(up, axis=1, keepdims=True)
    outer = surface.vertices + up * thickness * (offset + 1) / 2
    below = len(outer)
    edges = np.stack([surface.triangles, np.roll(surface.triangles, -1, axis=1)], axis=2).reshape(-1, 2)
    keys, count = np.unique(np.sort(edges, axis=1), axis=0, return_counts=True)
    rim = edges[(np.sort(edges, axis=1)[:, None] == keys[count == 1]).all(axis=2).any(axis=1)]
    one, two = rim.T
    sides = [
        np.stack([two, one, one + below], axis=1),
        np.stack([two, one + below, two + below], axis=1),
    ]
    triangles = np.concatenate([surface.triangles, surface.triangles[:, ::-1] + below, *sides])
    side = np.repeat([1, -1, 0], [len(surface.triangles), len(surface.triangles), 2 * len(rim)])
    return Mesh(np.concatenate([outer, outer - up * thickness]), triangles), side


def inner_part(surface: Mesh) -> Bools:
    """Triangles well away from the surface's edge."""
    return np.abs(surface.corners.mean(axis=1)[:, :2]).max(axis=1) < SIZE / 3


@settings(max_examples=25)
@given(
    cells=st.integers(3, 12),
    thickness=st.floats(0.05, 2.0),
    offset=st.floats(-1, 1),
    bend=st.floats(-4, 4),
    everything=st.booleans(),
    turned=st.booleans(),
)
def test_the_side_that_the_surface_faced_is_kept(
    cells: int, thickness: float, offset: float, bend: float, everything: bool, turned: bool
) -> None:
    surface = sheet(cells, bend)
    if turned:
        surface = Mesh(surface.vertices * [1, -1, -1], surface.triangles)
    wall, side = thickened(surface, thickness, offset)
    marked = np.ones(len(surface.triangles), dtype=bool) if everything else inner_part(surface)
    rim = np.full((side == 0).sum(), everything)
    selected = np.concatenate([marked, marked, rim])
    kept = faced_side(wall, selected, Mesh(surface.vertices, surface.triangles[marked]))
    assert np.array_equal(kept, selected & (side == 1))


def test_a_fine_region_is_decided_by_a_sample() -> None:
    surface = sheet(40)
    assert len(surface.triangles) > 3 * LOOKS
    wall, side = thickened(surface, 1.0, -1.0)
    kept = faced_side(wall, np.ones(len(side), dtype=bool), surface)
    assert np.array_equal(kept, side == 1)


def test_a_mirrored_copy_follows_the_surface_it_is_joined_to() -> None:
    """Half of a tube is modelled, the other half mirrored: there the lines to the original lead astray."""
    around, cells = np.linspace(0, 2 * np.pi, 49)[:-1], 6
    length = np.linspace(0, 50, cells + 1)
    angle, along = np.meshgrid(around, length, indexing="ij")
    at = np.arange(angle.size).reshape(angle.shape)
    ahead = np.roll(at, -1, axis=0)
    triangles = halves(at[:, :-1], ahead[:, :-1], ahead[:, 1:], at[:, 1:])
    places = np.stack([20 * np.cos(angle), 20 * np.sin(angle), along], axis=2).reshape(-1, 3)
    tube = Mesh(places, triangles)
    half = tube.corners.mean(axis=1)[:, 1] > 0
    wall, side = thickened(tube, 1.5, -1.0)
    kept = faced_side(wall, np.ones(len(side), dtype=bool), Mesh(places, triangles[half]))
    assert np.array_equal(kept, side == 1)


@pytest.mark.parametrize("selected_sides", [(1,), (-1,), (1, -1)])
def test_sides_selected_by_hand_stay(selected_sides: tuple[int, ...]) -> None:
    wall, side = thickened(sheet(8), 1.0, -1.0)
    selected = np.isin(side, selected_sides)
    kept = faced_side(wall, selected, Mesh(wall.vertices, wall.triangles[selected]))
    assert np.array_equal(kept, selected)
    both = len(selected_sides) == 2
    assert lies_on_both_sides(wall, selected) == both
    with pytest.raises(RegionError, match="both sides of the wall") if both else nullcontext():
        check_one_side(wall, selected)


def test_without_an_original_surface_nothing_is_left_out() -> None:
    wall, side = thickened(sheet(4), 1.0, -1.0)
    selected = np.ones(len(side), dtype=bool)
    assert faced_side(wall, selected, Mesh(wall.vertices, np.empty((0, 3), dtype=np.int64))).all()
    assert not faced_side(wall, ~selected, wall).any()
    far = Mesh(wall.vertices + [500.0, 0, 0], wall.triangles)
    assert faced_side(wall, selected, far).all()


def test_a_rounded_rim_that_joins_both_sides_does_not_lead_to_the_other() -> None:
    """Both sides are one smooth sheet then, as after a subdivision of the wall."""
    width, thickness, cells = 30.0, 2.0, 10
    flat = np.linspace(-width / 2, width / 2, 12)
    turn = np.linspace(np.pi / 2, -np.pi / 2, 9)[1:-1]
    round_end = np.stack([width / 2 + np.cos(turn), np.sin(turn)], axis=1) * [1, thickness / 2]
    top = np.stack([flat, np.full(len(flat), thickness / 2)], axis=1)
    outline = np.concatenate([top, round_end, -top, -round_end])
    depth = np.linspace(0, 20, cells + 1)
    n = len(outline)
    places: Floats = np.concatenate([np.insert(outline, 1, y, axis=1) for y in depth])
    at = np.arange(n * (cells + 1)).reshape(cells + 1, n)
    ahead = np.roll(at, -1, axis=1)
    tube = Mesh(places, halves(at[:-1], ahead[:-1], ahead[1:], at[1:]))
    up = tube.area_vectors[:, 2] / np.linalg.norm(tube.area_vectors, axis=1)
    assert (up[tube.corners[:, :, 2].min(axis=1) > 0.99] > 0.99).all()
    corners = np.array([[-15, 0, 1], [15, 0, 1], [15, 20, 1], [-15, 20, 1]], dtype=float)
    plate = Mesh(corners, np.array([[0, 1, 2], [0, 2, 3]]))
    kept = faced_side(tube, np.ones(len(up), dtype=bool), plate)
    assert kept[up > 0.99].all()
    assert not kept[up < -0.99].any()
