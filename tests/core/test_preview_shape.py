"""What stands for a feature in the viewport: closed, as wide as it says, and shown for what it is."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bubble_pattern_addon.core.closed import measure
from bubble_pattern_addon.core.feature_sizes import feature_sizes
from bubble_pattern_addon.core.mesh import Mesh
from bubble_pattern_addon.core.preview_shape import DARK, LIGHT, preview_shape
from tests.core.bases import laid
from tests.core.test_feature_kinds import KINDS, OUTLINES, PYRAMID, STAMPED, UP

ONE = laid([[0, 0, 0]], UP, 2.0, 1.0)


@pytest.mark.parametrize("profile", OUTLINES)
@pytest.mark.parametrize("kind", KINDS)
def test_shapes_are_closed_and_measure_one_across(kind, profile):
    feature = replace(KINDS[kind], **OUTLINES[profile])
    if feature.rim_size is not None:
        feature = replace(feature, rim_size=0.05)
    shape, shown = preview_shape(feature, feature_sizes(feature, ONE))
    assert measure(shape).closed
    assert np.linalg.norm(shape.vertices[:, :2], axis=1).max() == pytest.approx(0.5)
    assert len(shown) == len(shape.triangles)
    if feature.adds:
        assert shape.vertices[:, 2].max() == pytest.approx(feature.height)
    if feature.adds or feature.kind == "dimple":
        assert (shown == LIGHT).all()
    elif feature.rim == "sharp":
        assert (shown == DARK).all()
    else:
        top = [shape.corners[shown == look][..., 2].max() for look in (LIGHT, DARK)]
        assert top[1] > top[0]


def test_a_mesh_stands_for_itself_and_a_hole_for_its_outline():
    feature = replace(STAMPED, height=0.4)
    bump, shown = preview_shape(feature, feature_sizes(feature, ONE), PYRAMID)
    assert bump.vertices[:, 2].max() == pytest.approx(0.4)
    assert (shown == LIGHT).all()
    drill = Mesh(PYRAMID.vertices * [1, 1, -1], PYRAMID.triangles[:, ::-1].copy())
    feature = replace(STAMPED, kind="hole")
    hole, shown = preview_shape(feature, feature_sizes(feature, ONE), drill)
    assert np.abs(hole.vertices[:, 2]).max() < 0.1
    assert (shown == DARK).all()
