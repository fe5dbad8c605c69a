"""Adding a pattern: where its features are, whatever stands between the mesh and the world."""

from __future__ import annotations

import math
from types import SimpleNamespace

import numpy as np
import pytest

bpy = pytest.importorskip("bpy", reason="needs the bpy module: python scripts/test.py --blender VERSION")

from mathutils import Euler, Matrix  # noqa: E402

from bubble_pattern_addon.blender.properties import pattern_of  # noqa: E402

from .parts import (  # noqa: E402
    activate,
    add_on_top,
    closest_pair,
    euler,
    is_closed,
    off_surface,
    on_top,
    panel,
    plate,
    points,
    select_faces,
    sheet,
)


def test_selected_faces_become_the_region() -> None:
    base = plate()
    before = np.array([vertex.co for vertex in base.data.vertices])
    pattern = add_on_top(base)
    marked = [item.value for item in base.data.attributes["bubble_region"].data]
    assert marked == [face.normal.z > 0.7 for face in base.data.polygons]
    assert np.array_equal(before, [vertex.co for vertex in base.data.vertices])
    places = points(pattern)
    assert np.allclose(places[:, 2], 0.005, atol=1e-7)
    radius = points(pattern, "diameter") / 2
    assert (np.abs(places[:, :2]).max(axis=1) + radius < 0.05).all()


def test_a_good_pattern_without_typing_a_number() -> None:
    pattern = add_on_top(plate())
    settings = pattern.bubble_pattern
    assert 300 < settings.count < 800
    assert len(pattern.data.vertices) == settings.count
    assert settings.web > 0.2 * settings.pitch
    assert settings.margin > 0
    assert 0.2 < settings.open_area < 0.5
    assert settings.six > 0.9


def test_add_takes_pitch_and_diameter_and_lets_the_other_follow() -> None:
    base = plate()
    bpy.ops.bubble_pattern.add(pitch=0.006)
    settings = pattern_of(base).bubble_pattern
    assert (settings.pitch, settings.diameter) == pytest.approx((0.006, 0.0036))
    bpy.ops.bubble_pattern.remove()
    bpy.ops.bubble_pattern.add(diameter=0.003)
    settings = pattern_of(base).bubble_pattern
    assert (settings.pitch, settings.diameter) == pytest.approx((0.005, 0.003))
    bpy.ops.bubble_pattern.remove()
    bpy.ops.bubble_pattern.add(pitch=0.006, diameter=0.002)
    settings = pattern_of(base).bubble_pattern
    assert (settings.pitch, settings.diameter) == pytest.approx((0.006, 0.002))
    bpy.ops.bubble_pattern.remove()
    with pytest.raises(RuntimeError, match="smaller than the pitch"):
        bpy.ops.bubble_pattern.add(pitch=0.006, diameter=0.007)
    assert list(bpy.data.objects) == [base]


def last_operator() -> dict[str, float]:
    """Properties of the operator that Adjust Last Operation shows."""
    properties = bpy.context.window_manager.operators[-1].properties
    return {name: getattr(properties, name) for name in properties.keys()}  # noqa: SIM118


def test_adjust_last_operation_shows_what_was_chosen_and_takes_another_pitch() -> None:
    select_faces(plate(), on_top)
    bpy.ops.ed.undo_push(message="before")
    assert bpy.ops.bubble_pattern.add('EXEC_DEFAULT', True) == {'FINISHED'}
    settings = pattern_of(bpy.context.object).bubble_pattern
    shown = last_operator()
    pitch, diameter, count = settings.pitch, settings.diameter, settings.count
    assert (shown["pitch"], shown["diameter"]) == (pitch, diameter)

    for change, wanted in (
        ({"pitch": 2 * pitch}, (2 * pitch, 2 * diameter)),
        ({"diameter": diameter / 2}, (pitch, diameter / 2)),
        ({"pitch": 2 * pitch, "diameter": diameter / 2}, (2 * pitch, diameter / 2)),
        ({}, (pitch, diameter)),
    ):
        bpy.ops.ed.undo()
        assert [obj.name for obj in bpy.data.objects] == ["Plate"]
        assert [mesh.name for mesh in bpy.data.meshes] == ["Cube"]
        bpy.ops.object.mode_set(mode='OBJECT')
        assert "bubble_region" not in bpy.data.meshes["Cube"].attributes
        bpy.ops.object.mode_set(mode='EDIT')
        assert bpy.ops.bubble_pattern.add('EXEC_DEFAULT', True, **{**shown, **change}) == {'FINISHED'}
        settings = pattern_of(bpy.context.object).bubble_pattern
        assert (settings.pitch, settings.diameter) == pytest.approx(wanted, rel=1e-5)
        assert settings.count == pytest.approx(count * (pitch / wanted[0]) ** 2, rel=0.15)
        after = last_operator()
        assert (after["pitch"], after["diameter"]) == pytest.approx(wanted, rel=1e-5)


def test_defaults_leave_room_for_rows_in_a_strip() -> None:
    base = plate()
    base.scale = (1.0, 0.05, 1.0)
    pattern = add_on_top(base)
    assert len(np.unique(points(pattern)[:, 1].round(4))) >= 3


def test_object_mode_takes_all_faces() -> None:
    base = plate()
    assert bpy.ops.bubble_pattern.add() == {'FINISHED'}
    normals = points(pattern_of(bpy.context.object), "normal")
    assert len(np.unique(normals.round(3), axis=0)) >= 6
    assert off_surface(pattern_of(bpy.context.object), base)[0] < 1e-6


def test_object_mode_takes_the_marked_faces() -> None:
    base = plate()
    marked = base.data.attributes.new("bubble_region", 'BOOLEAN', 'FACE')
    marked.data.foreach_set("value", [face.normal.x > 0.7 for face in base.data.polygons])
    bpy.ops.bubble_pattern.add()
    assert np.allclose(points(pattern_of(bpy.context.object), "normal"), [1, 0, 0])


@pytest.mark.parametrize(
    "matrix",
    [
        Matrix.LocRotScale((3, -2, 7), Euler((0.3, 1.2, -2.0)), (1, 1, 1)),
        Matrix.LocRotScale((0, 0, 0), Euler((0, 0, 0)), (2, 0.5, 1.5)),
        Matrix.LocRotScale((1, 2, 3), Euler((0.4, -0.2, 0.9)), (1, 3, 0.7)),
        Matrix.LocRotScale((0, 0, 0), Euler((0, 0, 0)), (-1, 1, 1)),
        Matrix.LocRotScale((1, 0, 0), Euler((0.5, 0.5, 0)), (-1, -2, -0.5)),
    ],
    ids=["moved and turned", "scaled", "turned and scaled", "mirrored", "mirrored three ways"],
)
def test_right_in_world_space_under_any_transform(matrix: Matrix) -> None:
    base = panel()
    base.matrix_world = matrix
    pattern = add_on_top(base)
    distance, cosine = off_surface(pattern, base)
    assert distance < 1e-5 * pattern.bubble_pattern.pitch * 1000
    assert cosine > 0.99
    assert closest_pair(points(pattern)) > 0.85 * pattern.bubble_pattern.pitch


def test_right_in_world_space_under_a_sheared_parent() -> None:
    base = plate()
    parent = bpy.data.objects.new("Parent", None)
    bpy.context.collection.objects.link(parent)
    parent.scale = (1, 2, 1)
    parent.rotation_euler = (0, 0, 0.5)
    base.parent = parent
    base.rotation_euler = (0, 0, 0.6)
    pattern = add_on_top(base)
    distance, cosine = off_surface(pattern, base)
    assert distance < 1e-6
    assert cosine > 0.999
    assert closest_pair(points(pattern)) > 0.85 * pattern.bubble_pattern.pitch


def test_the_pattern_follows_its_base() -> None:
    base = plate()
    pattern = add_on_top(base)
    base.location = (5, 6, 7)
    base.rotation_euler = (1, 2, 3)
    bpy.context.view_layer.update()
    assert off_surface(pattern, base)[0] < 1e-5


def test_moving_the_base_changes_nothing() -> None:
    base = plate()
    pattern = add_on_top(base)
    before = np.array([vertex.co for vertex in pattern.data.vertices])
    base.location = (5, 6, 7)
    bpy.ops.bubble_pattern.update()
    assert np.array_equal(before, [vertex.co for vertex in pattern.data.vertices])


@pytest.mark.parametrize("kind", ['SUBSURF', 'MIRROR', 'SOLIDIFY'])
def test_the_region_survives_modifiers(kind: str) -> None:
    base = plate()
    for vertex in base.data.vertices:
        vertex.co.x += 0.2
    modifier = base.modifiers.new("Modifier", kind)
    if kind == 'SUBSURF':
        modifier.levels = 3
    pattern = add_on_top(base)
    distance, cosine = off_surface(pattern, base)
    assert distance < 1e-6
    assert cosine > 0.98
    if kind == 'MIRROR':
        x = points(pattern)[:, 0]
        assert (x > 0).sum() > 100
        assert (x < 0).sum() > 100


def test_the_region_survives_edits() -> None:
    base = plate()
    pattern = add_on_top(base)
    activate(base)
    bpy.ops.object.mode_set(mode='EDIT')
    bpy.ops.mesh.select_all(action='SELECT')
    bpy.ops.mesh.subdivide(number_cuts=3)
    bpy.ops.object.mode_set(mode='OBJECT')
    bpy.ops.bubble_pattern.update()
    assert np.allclose(points(pattern)[:, 2], 0.005, atol=1e-7)
    assert pattern.bubble_pattern.count > 300


def test_preview_shows_every_feature_in_its_size_and_direction() -> None:
    pattern = add_on_top(panel())
    graph = bpy.context.evaluated_depsgraph_get()
    shown = [np.array(i.matrix_world) for i in graph.object_instances if i.is_instance]
    assert len(shown) == pattern.bubble_pattern.count
    matrices = np.array(shown)
    sizes = np.linalg.norm(matrices[:, :3, :3], axis=1)
    assert np.allclose(sizes, pattern.bubble_pattern.diameter, rtol=1e-4)
    axes = matrices[:, :3, 2] / sizes[:, 2:]
    assert np.allclose(axes, points(pattern, "normal"), atol=1e-4)
    along, tangent = matrices[:, :3, 0] / sizes[:, :1], points(pattern, "tangent")
    tangent -= (tangent * axes).sum(axis=1, keepdims=True) * axes
    assert np.allclose(along, tangent / np.linalg.norm(tangent, axis=1, keepdims=True), atol=1e-4)


def two_patterns() -> tuple[bpy.types.Object, bpy.types.Object, bpy.types.Object]:
    """A base, the pattern on its top, and the one that was added below."""
    base = plate()
    first = add_on_top(base)
    select_faces(base, lambda face: face.normal.z < -0.7)
    bpy.ops.bubble_pattern.add()
    return base, first, pattern_of(base)


def test_a_second_pattern_has_a_region_of_its_own() -> None:
    _base, first, second = two_patterns()
    assert second != first
    assert second.bubble_pattern.region != first.bubble_pattern.region
    assert np.allclose(points(first)[:, 2], 0.005)
    assert np.allclose(points(second)[:, 2], -0.005)


def test_the_sidebar_shows_the_newest_pattern_or_the_one_chosen() -> None:
    base, first, second = two_patterns()
    assert second not in {first, None}
    base.bubble_pattern.pattern = first
    assert pattern_of(base) == first
    copy = base.copy()
    bpy.context.collection.objects.link(copy)
    assert pattern_of(copy) is None


def test_a_refused_base_stays_as_it_was() -> None:
    base = plate()
    base.scale.z = 0.0
    select_faces(base, on_top)
    with pytest.raises(RuntimeError, match="scaled to zero"):
        bpy.ops.bubble_pattern.add()
    assert "bubble_region" not in base.data.attributes or bpy.context.mode == 'EDIT_MESH'
    assert bpy.context.mode == 'EDIT_MESH'
    bpy.ops.object.mode_set(mode='OBJECT')
    assert "bubble_region" not in base.data.attributes
    assert len(bpy.data.objects) == 1


def test_cancelling_leaves_nothing() -> None:
    from bubble_pattern_addon.blender.operators import BUBBLE_PATTERN_OT_add

    base = plate()
    select_faces(base, on_top)
    operator = SimpleNamespace(wanted_lengths=lambda: (None, None))
    steps = BUBBLE_PATTERN_OT_add.steps(operator, bpy.context)
    for _ in range(3):
        next(steps)
    steps.close()
    assert bpy.context.mode == 'EDIT_MESH'
    bpy.ops.object.mode_set(mode='OBJECT')
    assert list(bpy.data.objects) == [base]
    assert "bubble_region" not in base.data.attributes


def test_settings_lay_the_pattern_anew_as_they_change() -> None:
    pattern = add_on_top(plate())
    settings = pattern.bubble_pattern
    places, count = points(pattern), settings.count
    settings.diameter *= 1.2
    assert settings.trouble == ""
    assert np.array_equal(places, points(pattern))
    assert np.allclose(points(pattern, "diameter"), settings.diameter)
    settings.pitch *= 2
    assert math.isclose(settings.count, count / 4, rel_tol=0.2)
    settings.diameter = settings.pitch * 1.1
    assert settings.trouble.startswith("Diameter = ")
    assert "leaves no web" in settings.trouble
    with pytest.raises(RuntimeError, match="leaves no web"):
        bpy.ops.bubble_pattern.update()


@pytest.mark.parametrize(
    ("system", "scale", "diameter", "pitch"),
    [
        ('METRIC', 1.0, "9 mm", "8 mm"),
        ('METRIC', 0.001, "9 µm", "8 µm"),
        ('IMPERIAL', 1.0, "354.3 thou", "315 thou"),
        ('NONE', 1.0, "0.009", "0.008"),
    ],
)
def test_errors_tell_lengths_in_the_scene_s_unit(
    system: str, scale: float, diameter: str, pitch: str
) -> None:
    units = bpy.context.scene.unit_settings
    units.system, units.scale_length = system, scale
    settings = add_on_top(plate()).bubble_pattern
    settings.pitch = 0.008
    settings.diameter = 0.009
    told = f"Diameter = {diameter} leaves no web at pitch {pitch}:"
    assert settings.trouble.startswith(told)
    with pytest.raises(RuntimeError, match=f"Error: {told}"):
        bpy.ops.bubble_pattern.update()


def test_assigning_another_region() -> None:
    base = plate()
    pattern = add_on_top(base)
    assert bpy.ops.bubble_pattern.region_edit() == {'FINISHED'}
    assert base.data.total_face_sel == 1
    bpy.ops.object.mode_set(mode='OBJECT')
    select_faces(base, lambda face: face.normal.x > 0.7)
    assert bpy.ops.bubble_pattern.region_assign() == {'FINISHED'}
    assert np.allclose(points(pattern, "normal"), [1, 0, 0])


@pytest.mark.parametrize("offset", [-1, 0, 1])
@pytest.mark.parametrize("whole", [True, False], ids=["whole sheet", "part of a sheet"])
def test_a_solidified_sheet_is_filled_on_the_side_it_faced(offset: int, whole: bool) -> None:
    base = sheet()
    wall = base.modifiers.new("Wall", 'SOLIDIFY')
    wall.thickness, wall.offset = 0.003, offset
    select_faces(base, lambda face: whole or face.calc_center_median().length < 0.06)
    bpy.ops.bubble_pattern.add()
    pattern = pattern_of(bpy.context.object)
    assert (points(pattern, "normal")[:, 2] > 0.5).all()
    assert off_surface(pattern, base)[0] < 1e-6
    assert bpy.ops.bubble_pattern.apply() == {'FINISHED'}
    part = bpy.context.object.data
    assert is_closed(part)
    assert euler(part) == 2 - 2 * pattern.bubble_pattern.count
    assert pattern.bubble_pattern.verdict == ""


def test_both_sides_selected_by_hand_are_both_filled() -> None:
    base = plate()
    base.modifiers.new("Fine", 'SUBSURF').subdivision_type = 'SIMPLE'
    passed = bpy.data.node_groups.new("Passed", 'GeometryNodeTree')
    for way in ('INPUT', 'OUTPUT'):
        passed.interface.new_socket("Geometry", in_out=way, socket_type='NodeSocketGeometry')
    ends = passed.nodes.new('NodeGroupInput'), passed.nodes.new('NodeGroupOutput')
    passed.links.new(ends[0].outputs[0], ends[1].inputs[0])
    base.modifiers.new("Nodes", 'NODES').node_group = passed
    select_faces(base, lambda face: abs(face.normal.z) > 0.7)
    bpy.ops.bubble_pattern.add()
    pattern = pattern_of(bpy.context.object)
    up = points(pattern, "normal")[:, 2]
    assert (up > 0.5).sum() == (up < -0.5).sum() > 100
    with pytest.raises(RuntimeError, match="keep one side"):
        bpy.ops.bubble_pattern.apply()
    assert set(bpy.data.objects) == {base, pattern}
    pattern.bubble_pattern.depth_mode = 'BLIND'
    pattern.bubble_pattern.depth = 0.002
    assert bpy.ops.bubble_pattern.apply() == {'FINISHED'}
    assert pattern.bubble_pattern.verdict == ""
    assert euler(bpy.context.object.data) == 2
