"""Patterns with different features on one base."""

from __future__ import annotations

import numpy as np
import pytest

from bubble_pattern_addon.core.feature_recipe import Feature
from bubble_pattern_addon.core.progress import drive
from bubble_pattern_addon.core.several import Layer, layered_steps
from bubble_pattern_addon.core.solid import part_steps
from tests.core.bases import box, hexagons, laid, polygon_area
from tests.core.test_solid import assert_sources

BASE = box((-15, -10, -2), (15, 10, 0))
PLACES = hexagons(28, 18, 3)
HOLES = Layer(laid(PLACES[::2], (0, 0, 1), 3, 1.8), Feature(sides=16))
BUMPS = Layer(laid(PLACES[1::2], (0, 0, 1), 3, 1.8), Feature(kind="bump", form="boss", height=0.5, sides=16))


@pytest.mark.parametrize("layers", [(HOLES, BUMPS), (BUMPS, HOLES)])
def test_layers_add_up_and_every_face_knows_where_it_is_from(layers):
    part = drive(layered_steps(BASE, layers))
    check = part.check
    assert check.problems == ()
    assert check.unchanged
    holes, bumps = len(HOLES.pattern), len(BUMPS.pattern)
    assert check.through == part.pierced.sum() == holes
    assert check.base_euler - check.euler == 2 * holes
    expected = polygon_area(1.8, 16) * (2 * holes - 0.5 * bumps)
    assert check.removed_volume == pytest.approx(expected, rel=1e-9)
    assert_sources(part, BASE)
    first = len(layers[0].pattern)
    assert part.pierced[:first].all() == (layers[0] is HOLES)
    for which in (0, first - 1, first, holes + bumps - 1):
        at = np.concatenate([layer.pattern.position for layer in layers])[which]
        wall = part.mesh.corners[part.source == -1 - which].reshape(-1, 3)
        assert np.linalg.norm((wall - at)[:, :2], axis=1).max() == pytest.approx(0.9)
    assert part.kind == "feature"
    assert np.array_equal(part.facet >= 0, part.source < 0)
    owners = np.unique(np.stack([part.facet, part.source])[:, part.source < 0], axis=1)
    assert len(np.unique(owners[0])) == owners.shape[1]  # no facet is shared by two features


def test_one_layer_is_the_part_itself():
    part = drive(layered_steps(BASE, [HOLES]))
    plain = drive(part_steps(BASE, HOLES.pattern, HOLES.feature))
    assert np.array_equal(part.mesh.vertices, plain.mesh.vertices)
    assert np.array_equal(part.source, plain.source)
    assert part.check == plain.check


def test_where_an_earlier_layer_took_the_ground_a_later_one_reports():
    over = laid(HOLES.pattern.position, (0, 0, 1), 3, 1.2)
    part = drive(layered_steps(BASE, [HOLES, Layer(over, BUMPS.feature)]))
    count = len(HOLES.pattern)
    assert [which for which, _ in part.failures] == list(range(count, 2 * count))
    assert part.check.watertight
