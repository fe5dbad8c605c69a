"""Splitting a crowded face changes neither its shape nor its neighbours."""

import numpy as np
import pytest

from bubble_pattern_addon.core.closed import measure
from bubble_pattern_addon.core.splitting import MANY, split_crowded
from tests.core.bases import box, moved

TURN = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))[0]


@pytest.mark.parametrize("matrix", [np.eye(3), TURN, np.diag([1.0, -1, 1]) @ TURN])
def test_a_crowded_triangle_is_split_inside_only(matrix):
    base = moved(box((0, 0, 0), (40, 30, 2)), matrix)
    crowded = 3
    rng = np.random.default_rng(1)
    share = np.sort(rng.uniform(size=(2 * MANY, 2)), axis=1)
    a, b, c = base.corners[crowded]
    place = a + share[:, :1] * (b - a) + (share[:, 1:] - share[:, :1]) * (c - a)
    split, face = split_crowded(base, np.full(len(place), crowded), place, np.full(len(place), 0.2))
    pieces = np.flatnonzero(face == crowded)
    assert MANY / 8 < len(pieces) < MANY
    assert measure(split).closed
    assert measure(split).volumes == pytest.approx(measure(base).volumes)
    whole = face != crowded
    assert np.array_equal(split.triangles[whole], base.triangles[face[whole]])
    assert np.array_equal(split.vertices[:8], base.vertices)
    vectors = split.area_vectors[pieces]
    assert np.allclose(vectors.sum(axis=0), base.area_vectors[crowded])
    assert (vectors @ base.area_vectors[crowded] > 0).all()
    # every new point is one of the places, so that it falls out with its hole
    made = split.vertices[8:]
    assert (np.linalg.norm(made[:, None] - place, axis=2).min(axis=1) == 0).all()


def test_a_face_with_few_holes_stays_whole():
    base = box((0, 0, 0), (40, 30, 2))
    place = np.repeat(base.corners[:1].mean(axis=1), MANY - 1, axis=0)
    split, face = split_crowded(base, np.zeros(MANY - 1, dtype=np.int64), place, np.ones(MANY - 1))
    assert split is base
    assert np.array_equal(face, np.arange(12))
