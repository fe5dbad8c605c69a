"""What a disc sees of a triangle is what a cloud of points on it says."""

import numpy as np
from hypothesis import assume, given
from hypothesis import strategies as st

from bubble_pattern_addon.core.wall import disc_spans

NUMBER = st.floats(-3, 3)
LINE = np.linspace(0, 1, 81)
U, V = (side.ravel() for side in np.meshgrid(LINE, LINE))
SHARE = np.stack([1 - U, U * (1 - V), U * V], axis=1)


@given(corners=st.lists(st.tuples(NUMBER, NUMBER, NUMBER), min_size=3, max_size=3), radius=st.floats(0.1, 2))
def test_spans_bound_every_point_and_no_more(corners, radius):
    triangle = np.array(corners)
    normal = np.cross(triangle[1] - triangle[0], triangle[2] - triangle[0])
    size = np.linalg.norm(normal)
    assume(size > 0.05)
    span = disc_spans(triangle[None], np.array([radius]))
    points = SHARE @ triangle
    seen = points[np.hypot(points[:, 0], points[:, 1]) <= radius, 2]
    if len(seen):
        assert span.inside[0]
        assert span.low[0] <= seen.min() + 1e-9
        assert span.high[0] >= seen.max() - 1e-9
    if span.inside[0]:
        # within a slightly wider disc there are points nearly as high and as low
        wide = points[np.hypot(points[:, 0], points[:, 1]) <= radius + 0.2]
        slope = np.abs(np.diff(triangle[[0, 1, 2, 0], 2])).max()
        assert len(wide)
        assert wide[:, 2].min() - span.low[0] <= 0.05 * slope + 1e-9
        assert span.high[0] - wide[:, 2].max() <= 0.05 * slope + 1e-9
    if abs(normal[2]) > 1e-3 * size:
        assert span.facing[0] == np.sign(normal[2])
    if np.isfinite(span.axis[0]):
        assert abs(normal @ ([0, 0, span.axis[0]] - triangle[0])) < 1e-6 * size


def test_a_disc_within_a_triangle_sees_its_own_rim():
    tilted = np.array([[[-9.0, -9, -9], [9, -9, 9], [0, 18, 0]]])
    span = disc_spans(tilted, np.array([2.0]))
    assert np.allclose([span.low, span.high, span.axis], [[-2], [2], [0]])
    assert span.facing[0] == 1


def test_an_upright_triangle_is_edge_on_and_never_crossed_by_the_axis():
    span = disc_spans(np.array([[[0.5, -5, 0], [0.5, 5, 0], [0.5, 0, 7.0]]]), np.array([1.0]))
    assert span.facing[0] == 0
    assert np.isnan(span.axis[0])
    assert span.low[0] == 0
    assert np.isclose(span.high[0], 7)
