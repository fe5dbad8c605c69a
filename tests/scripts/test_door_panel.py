"""The demo's base: a sound shell of even thickness with a target region round an island."""

import numpy as np
import pytest
import trimesh

from bubble_pattern_addon.core.region import make_region
from bubble_pattern_addon.core.soundness import sound_base
from scripts.door_panel import ISLAND, ISLAND_RADIUS, THICKNESS, make_door_panel

PANEL = make_door_panel()


def test_the_panel_is_a_sound_solid() -> None:
    assert len(sound_base(PANEL.mesh).mesh.triangles) == len(PANEL.mesh.triangles)
    body = trimesh.Trimesh(PANEL.mesh.vertices, PANEL.mesh.triangles, process=False)
    assert body.is_watertight
    assert body.euler_number == 2
    # no fold: along every edge the faces bend by a right angle at most, as they do at the flange's end
    assert np.degrees(body.face_adjacency_angles).max() < 95


def test_the_region_has_the_outline_and_the_island_as_boundaries() -> None:
    region = make_region(PANEL.mesh, PANEL.region)
    assert len(region.loops) == 2
    inner = min(region.loops, key=len)
    distance = np.linalg.norm(region.base.vertices[inner][:, :2] - ISLAND, axis=1)
    assert np.allclose(distance, ISLAND_RADIUS, atol=1e-9)
    assert 12_000 < region.area < 14_000
    assert not (PANEL.region & PANEL.island).any()


def test_the_wall_is_even_under_the_region() -> None:
    mesh = PANEL.mesh
    half = len(mesh.vertices) // 2
    used = np.unique(mesh.triangles[PANEL.region])
    assert used.max() < half
    thickness = np.linalg.norm(mesh.vertices[used] - mesh.vertices[used + half], axis=1)
    assert thickness == pytest.approx(THICKNESS)
