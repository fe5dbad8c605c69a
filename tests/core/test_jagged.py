"""Regions chosen face by face from a grid or a scan: the first row goes all round their jagged boundary."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import cKDTree

from bubble_pattern_addon.core.boundary import make_boundary, nearest_boundary
from bubble_pattern_addon.core.mesh import Floats, Mesh
from bubble_pattern_addon.core.metric import Constant
from bubble_pattern_addon.core.packing.pack import pack_steps
from bubble_pattern_addon.core.progress import drive
from bubble_pattern_addon.core.recipe import Packing
from bubble_pattern_addon.core.region import make_region
from bubble_pattern_addon.core.surface import positions
from scripts.shapes import JAGGED_RADIUS, Shape, pixel_disc, splinter_disc, tube_sheet


def packed(shape: Shape, pitch: float) -> tuple[Floats, Floats, int]:
    """Places of the bubbles, their distances to the boundary in pitches, and the size of the first row."""
    region = make_region(shape.mesh, shape.selected)
    ground, bubbles = drive(pack_steps(region, Packing(pitch=Constant(pitch))))
    points = positions(ground.charts, bubbles.spots)
    boundary = make_boundary(region, pitch / 8)
    assert boundary is not None
    return points, nearest_boundary(boundary, points, bubbles.spots.row)[0] / pitch, bubbles.fixed


def check_round(points: Floats, away: Floats, first: int, pitch: float) -> None:
    """The first row stands half a pitch from the boundary of the disc and goes on all round it."""
    assert away.min() > 0.47
    # in a narrow pocket a bubble stands in the middle
    assert away[:first].max() < 0.6
    assert np.abs(away[:first] - 0.5).mean() < 0.01
    angle = np.sort(np.arctan2(points[:first, 1], points[:first, 0]))
    gap = np.diff(angle, append=angle[0] + 2 * np.pi) * (JAGGED_RADIUS - pitch / 2) / pitch
    # where the line turns between two long teeth a bubble stands, and the others keep clear of it
    assert gap.max() < 1.9
    assert abs(gap.mean() - 1) < 0.1


@settings(max_examples=12, deadline=None)
@given(curved=st.booleans(), shift=st.floats(0, 1), pitch=st.floats(3.5, 14))
def test_the_first_row_goes_round_a_disc_of_squares(curved: bool, shift: float, pitch: float) -> None:
    check_round(*packed(pixel_disc(curved, shift), pitch), pitch)


@settings(max_examples=12, deadline=None)
@given(curved=st.booleans(), seed=st.integers(0, 1000), pitch=st.floats(5, 14))
def test_the_first_row_goes_round_a_disc_of_splinters(curved: bool, seed: int, pitch: float) -> None:
    check_round(*packed(splinter_disc(curved, seed), pitch), pitch)


@pytest.mark.parametrize("pitch", [2.4, 3.3, 6.0])
def test_the_first_row_goes_round_teeth(pitch: float) -> None:
    tube = tube_sheet(15, 80, 96, 80)
    # every square of the tube is two triangles, of which one is taken where the region ends
    along = tube.corners.mean(axis=1)[:, 2]
    points, away, first = packed(Shape(tube, (along > 9.5) & (along < 69.5), pitch), pitch)
    assert away.min() > 0.48
    for end in (points[:first, 2] < 40, points[:first, 2] > 40):
        assert end.sum() == pytest.approx(2 * np.pi * 15 / pitch, rel=0.06)
    places = positions_on(tube, 10 + pitch / 2, 69 - pitch / 2)
    assert cKDTree(points).query(places)[0].max() < 0.95 * pitch


def positions_on(tube: Mesh, low: float, high: float) -> Floats:
    """Middles of the tube's faces between two heights."""
    middle = tube.corners.mean(axis=1)
    return middle[(middle[:, 2] > low) & (middle[:, 2] < high)]
