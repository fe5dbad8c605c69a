"""The cutters: closed, disjoint, exactly as wide and deep as asked."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bubble_pattern_addon.core.closed import measure
from bubble_pattern_addon.core.errors import RecipeError
from bubble_pattern_addon.core.feature import make_cutters
from bubble_pattern_addon.core.feature_sizes import sides
from bubble_pattern_addon.core.recipe import Feature
from tests.core.bases import hexagons, laid, polygon_area


@given(
    diameters=st.lists(st.floats(0.01, 50), min_size=1, max_size=12),
    count=st.one_of(st.none(), st.integers(3, 64)),
    top=st.floats(0.01, 3),
    bottom=st.floats(0.01, 3),
)
def test_cutters_are_closed_prisms_of_the_asked_size(diameters, count, top, bottom):
    diameter = np.array(diameters)
    number = len(diameter)
    position = np.stack([np.arange(number) * 60.0, np.zeros(number), np.zeros(number)], axis=1)
    pattern, feature = laid(position, (1, 2, 3), 1, diameter), Feature(sides=count)
    cutters = make_cutters(pattern, feature, np.arange(number), np.full(number, top), np.full(number, bottom))
    found = measure(cutters.mesh)
    assert found.closed
    assert found.euler == 2 * number
    expected = [
        polygon_area(d, s) * (top + bottom) for d, s in zip(diameter, sides(feature, diameter), strict=True)
    ]
    assert np.allclose(np.sort(found.volumes), np.sort(expected), rtol=1e-6)


def test_every_facet_is_flat_and_belongs_to_its_feature():
    pattern = laid(hexagons(20, 20, 4), (0, 3, 4), 4, np.linspace(1, 3, len(hexagons(20, 20, 4))))
    chosen = np.arange(1, len(pattern), 2)
    ones = np.ones(len(chosen))
    cutters = make_cutters(pattern, Feature(), chosen, ones, 2 * ones)
    normal = cutters.mesh.area_vectors
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    for facet in range(0, len(cutters.feature), 7):
        mine = cutters.facet == facet
        assert np.abs(normal[mine] - normal[mine][0]).max() < 1e-9
        corners = cutters.mesh.corners[mine].reshape(-1, 3)
        feature = cutters.feature[facet]
        offset = corners - pattern.position[feature]
        along = offset @ pattern.normal[feature]
        assert set(np.round(along, 9)) <= {1.0, -2.0}
        aside = np.linalg.norm(offset - along[:, None] * pattern.normal[feature], axis=1)
        assert np.allclose(aside, pattern.diameter[feature] / 2)
    assert set(np.unique(cutters.feature)) == set(chosen)


def test_the_first_corner_points_along_the_tangent():
    pattern = laid([[0, 0, 0]], (0, 0, 1), 3, 2.0)
    cutters = make_cutters(pattern, Feature(sides=12), np.arange(1), np.ones(1), np.ones(1))
    assert np.allclose(cutters.mesh.vertices[0], pattern.tangent[0] + [0, 0, 1])


def test_sides_follow_the_chord_height():
    diameter = np.array([0.5, 2.0, 8.0, 100.0])
    count = sides(Feature(tolerance=0.01), diameter)
    assert np.all(count % 4 == 0)
    assert np.all(np.diff(count) >= 0)
    free = (count > 12) & (count < 256)
    assert free.sum() >= 2
    assert np.all((diameter / 2 * (1 - np.cos(np.pi / count)))[free] <= 0.01)
    assert np.all((diameter / 2 * (1 - np.cos(np.pi / (count - 4))))[free] > 0.01)


def test_by_default_the_widest_hole_has_32_sides_and_none_fewer_than_12():
    count = sides(Feature(), np.array([0.01, 1.0, 4.0]))
    assert count.tolist() == [12, 16, 32]
    assert sides(Feature(sides=6), np.ones(2)).tolist() == [6, 6]


@pytest.mark.parametrize(
    "feature", [Feature(sides=2), Feature(tolerance=0.0), Feature(tolerance=float("nan"))]
)
def test_nonsense_is_refused(feature):
    with pytest.raises(RecipeError):
        sides(feature, np.ones(3))
