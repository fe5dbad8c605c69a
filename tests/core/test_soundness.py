"""Every guard of the base fires, says where, and nothing harmless trips it."""

import numpy as np
import pytest

from bubble_pattern_addon.core import soundness
from bubble_pattern_addon.core.errors import BaseError
from bubble_pattern_addon.core.mesh import Mesh
from bubble_pattern_addon.core.soundness import sound_base, weld
from tests.core.bases import box, inside_out, moved, slab, soup, together

CUBE = box((0, 0, 0), (2, 2, 2))


def shifted(mesh: Mesh, *by: float) -> Mesh:
    return Mesh(mesh.vertices + np.array(by), mesh.triangles)


def refused(mesh: Mesh) -> str:
    with pytest.raises(BaseError) as caught:
        sound_base(mesh)
    text = str(caught.value)
    assert "\n" not in text
    assert text.endswith(".")
    return text


def test_a_sound_base_passes_as_it_is():
    base = sound_base(slab())
    assert np.array_equal(base.mesh.triangles, slab().triangles)
    assert np.array_equal(base.triangle, np.arange(len(slab().triangles)))


def test_an_unwelded_base_is_welded_and_remembers_its_triangles():
    loose = soup(CUBE)
    base = sound_base(loose)
    assert len(base.mesh.vertices) == 8
    assert np.array_equal(base.mesh.corners, loose.corners[base.triangle])
    assert np.array_equal(base.mesh.vertices, loose.vertices[base.vertex])


def test_weld_joins_only_what_is_exactly_equal():
    points = np.array([[1.0, 2, 3], [1, 2, 3 + 1e-15], [0.0, 0, 0], [1, 2, 3], [-0.0, 0, 0]])
    assert weld(points).tolist() == [0, 1, 2, 0, 2]


def test_faces_with_two_equal_corners_are_left_out():
    needle = np.array([[0, 0, 1], [3, 5, 3]])
    base = sound_base(Mesh(CUBE.vertices, np.concatenate([needle, CUBE.triangles])))
    assert base.triangle.tolist() == list(range(2, 14))


def test_a_face_without_area_in_a_closed_surface_is_kept():
    middle = np.concatenate([CUBE.vertices, [[1.0, 0, 0]]])
    # the edge from corner 0 to corner 4 gets a point on one side, and a face without area fills the slit
    assert np.array_equal(middle[[0, 4]], [[0, 0, 0], [2, 0, 0]])
    faces = CUBE.triangles.tolist()
    old = next(face for face in faces if {0, 4} <= set(face))
    turn = next(k for k in range(3) if {old[k], old[(k + 1) % 3]} == {0, 4})
    a, b, c = old[turn], old[(turn + 1) % 3], old[(turn + 2) % 3]
    faces.remove(old)
    base = Mesh(middle, np.array([*faces, [a, 8, c], [8, b, c], [a, b, 8]]))
    assert len(sound_base(base).mesh.triangles) == 14


def test_no_faces():
    assert "no faces" in refused(Mesh(CUBE.vertices, np.zeros((0, 3), dtype=np.int64)))


def test_faces_that_name_missing_vertices():
    assert "do not exist" in refused(Mesh(CUBE.vertices[:7], CUBE.triangles))


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_coordinates_that_are_no_numbers(value):
    vertices = CUBE.vertices.copy()
    vertices[3, 1] = value
    text = refused(Mesh(vertices, CUBE.triangles))
    assert "1 vertex" in text
    assert "vertex 3" in text


def test_nothing_but_faces_without_area():
    assert "zero area" in refused(Mesh(CUBE.vertices * [1, 0, 0], CUBE.triangles))


def test_open_edges_are_counted_and_placed():
    text = refused(Mesh(CUBE.vertices, CUBE.triangles[1:]))
    assert "3 edges" in text
    assert "one side only" in text
    assert "near (0, " in text


def test_an_open_sheet():
    assert "one side only" in refused(Mesh(CUBE.vertices, CUBE.triangles[:2]))


def test_non_manifold_edges():
    wing = np.array([[0, 1, 8], [1, 0, 9]])
    vertices = np.concatenate([CUBE.vertices, [[-1.0, -1, 1], [-2, -1, 1]]])
    assert "more than two faces" in refused(Mesh(vertices, np.concatenate([CUBE.triangles, wing])))


def test_faces_that_point_different_ways():
    triangles = CUBE.triangles.copy()
    triangles[4] = triangles[4, ::-1]
    text = refused(Mesh(CUBE.vertices, triangles))
    assert "turned inward" in text
    assert "recalculate" in text


def test_inside_out():
    assert "inside out" in refused(inside_out(CUBE))


def test_one_body_of_several_inside_out():
    text = refused(together(box((0, 0, 0), (9, 9, 9)), shifted(inside_out(CUBE), 20, 0, 0)))
    assert "inside out" in text
    assert "at (20, " in text


def test_a_body_inside_a_body():
    text = refused(together(box((0, 0, 0), (9, 9, 9)), shifted(CUBE, 3, 3, 3)))
    assert "inside another" in text


def test_a_body_in_the_hollow_of_another_and_several_bodies_are_sound():
    hollow = together(box((0, 0, 0), (9, 9, 9)), inside_out(box((1, 1, 1), (8, 8, 8))))
    sound_base(together(hollow, shifted(CUBE, 3, 3, 3), shifted(CUBE, 30, 0, 0)))


def test_no_volume():
    sheet = Mesh(CUBE.vertices * [1, 1, 0], CUBE.triangles)
    assert "no volume" in refused(sheet)


@pytest.mark.parametrize("by", [(1, 0.3, 0.2), (1, 0, 0), (1, 1, 0), (0.1, 0.1, 0.1)])
@pytest.mark.parametrize("turn", [0.0, 0.7])
def test_bodies_that_overlap(by, turn):
    matrix = np.array([[np.cos(turn), -np.sin(turn), 0], [np.sin(turn), np.cos(turn), 0], [0, 0, 1]])
    assert "passes through itself" in refused(moved(together(CUBE, shifted(CUBE, *by)), matrix))


def test_the_same_body_twice():
    refused(together(CUBE, CUBE))
    refused(soup(together(CUBE, CUBE)))


@pytest.mark.parametrize("by", [(2, 0, 0), (2, 0.5, 0.5), (2, 2, 0), (2, 2, 2), (2 - 1e-8, 0, 0), (3, 0, 0)])
def test_bodies_that_only_touch_are_sound(by):
    sound_base(together(CUBE, shifted(CUBE, *by)))


@pytest.mark.parametrize("turn", [0.0, 0.4])
def test_bars_laid_crosswise_and_pins_in_corners_only_touch(turn):
    matrix = np.array([[np.cos(turn), 0, -np.sin(turn)], [0, 1, 0], [np.sin(turn), 0, np.cos(turn)]])
    bar, cross = box((-5, -1, -2), (5, 1, 0)), box((-1, -5, 0), (1, 5, 2))
    pin = box((1, 1, -1), (2, 2, 1))
    sound_base(moved(together(bar, cross, pin), matrix))


def test_a_surface_that_passes_through_itself():
    base = slab()
    vertices = base.vertices.copy()
    # the middle of the underside pulled up through the top
    vertices[len(vertices) // 2 + len(vertices) // 4, 2] += 3
    assert "passes through itself" in refused(Mesh(vertices, base.triangles))


def test_a_surface_pinched_in_a_point_has_a_vertex_for_each_side():
    pinched = soup(together(CUBE, shifted(CUBE, 2, 2, 2)))
    assert len(sound_base(pinched).mesh.vertices) == 16


def test_a_base_is_examined_once_and_again_after_any_change(monkeypatch):
    looked = []
    examined = soundness._examined
    monkeypatch.setattr(soundness, "_known", {})
    monkeypatch.setattr(soundness, "_examined", lambda base: looked.append(0) or examined(base))
    base = box((0, 0, 0), (1, 1, 1))
    first = sound_base(base)
    assert sound_base(Mesh(base.vertices.copy(), base.triangles.copy())) is first
    assert len(looked) == 1
    with pytest.raises(ValueError, match="read-only"):
        first.mesh.vertices[0] = 5
    base.vertices[0, 0] -= 1e-12
    assert sound_base(base).mesh.vertices[0, 0] == base.vertices[0, 0]
    for _ in range(2):
        with pytest.raises(BaseError):
            sound_base(Mesh(base.vertices, base.triangles[1:]))
    assert len(looked) == 4
