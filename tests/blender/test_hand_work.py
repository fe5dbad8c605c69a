"""Hand work in Blender: points moved, added, deleted and pinned in Edit Mode, and settled."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

bpy = pytest.importorskip("bpy", reason="needs the bpy module: python scripts/test.py --blender VERSION")

import bmesh  # noqa: E402

from bubble_pattern_addon.blender import settings_recipe, sources  # noqa: E402

from .parts import activate, add_on_top, panel, plate, points  # noqa: E402
from .test_file import reopened  # noqa: E402

PITCH = 0.005


def editing(base: bpy.types.Object | None = None) -> bpy.types.Object:
    """A pattern whose points are being edited, none selected."""
    pattern = add_on_top(base or plate())
    bpy.ops.object.mode_set(mode='OBJECT')
    pattern.bubble_pattern.diameter = 0.6 * PITCH
    pattern.bubble_pattern.pitch = PITCH
    activate(pattern)
    assert bpy.ops.bubble_pattern.edit_sizes() == {'FINISHED'}
    bpy.ops.mesh.select_all(action='DESELECT')
    return pattern


def change(pattern: bpy.types.Object, work: Callable[[bmesh.types.BMesh], None]) -> None:
    """Do `work` on the points as the user would in Edit Mode."""
    edited = bmesh.from_edit_mesh(pattern.data)
    edited.verts.ensure_lookup_table()
    work(edited)
    edited.select_flush_mode()
    bmesh.update_edit_mesh(pattern.data)


def nearest(pattern: bpy.types.Object, x: float, y: float) -> int:
    """Number of the point nearest to a place of the pattern's own frame."""
    edited = bmesh.from_edit_mesh(pattern.data)
    return min(edited.verts, key=lambda v: (v.co.x - x) ** 2 + (v.co.y - y) ** 2).index


def select(pattern: bpy.types.Object, *numbers: int) -> None:
    """Select these points and no others."""
    bpy.ops.mesh.select_all(action='DESELECT')
    change(pattern, lambda mesh: [mesh.verts[number].select_set(True) for number in numbers])


def shown(pattern: bpy.types.Object, name: str = "position") -> np.ndarray:
    """An attribute of the points while they are edited."""
    bpy.ops.object.mode_set(mode='OBJECT')
    found = points(pattern, name)
    bpy.ops.object.mode_set(mode='EDIT')
    return found


def by_id(pattern: bpy.types.Object) -> dict[int, np.ndarray]:
    return dict(zip(shown(pattern, "id").tolist(), shown(pattern), strict=True))


def test_pinned_and_moved_point_stays_and_survives_an_update() -> None:
    pattern = editing()
    settings = pattern.bubble_pattern
    before = by_id(pattern)
    number = nearest(pattern, 0.003, 0.002)
    select(pattern, number)
    assert bpy.ops.bubble_pattern.pin() == {'FINISHED'}
    assert bpy.context.mode == 'EDIT_MESH'
    assert len(settings.pins) == 1
    assert not settings_recipe.is_outdated(settings)
    bpy.ops.transform.translate(value=(0.0015, 0.001, 0.0004))
    assert bpy.ops.bubble_pattern.settle() == {'FINISHED'}
    assert bpy.context.mode == 'EDIT_MESH'
    after = by_id(pattern)
    assert after.keys() == before.keys()
    target = before[number] + [0.0015, 0.001, 0]
    assert np.abs(after[number] - target).max() < 1e-7
    moved = [key for key in before if np.linalg.norm(after[key] - before[key]) > 1e-4]
    assert 1 < len(moved) < len(before)
    assert settings.hand_made
    assert np.array_equal(np.flatnonzero(shown(pattern, "pinned")), [number])
    assert pattern.data.total_vert_sel == 1
    bpy.ops.object.mode_set(mode='OBJECT')
    assert not settings_recipe.is_outdated(settings)
    assert bpy.ops.bubble_pattern.update() == {'FINISHED'}
    assert not settings.hand_made
    assert np.linalg.norm(points(pattern) - target, axis=1).min() < 1e-7
    assert points(pattern, "pinned").sum() == 1


def test_deleted_points_leave_a_gap_that_closes_or_is_filled() -> None:
    pattern = editing()
    settings = pattern.bubble_pattern
    count = settings.count
    numbers = [nearest(pattern, *at) for at in ((0.0, 0.0), (0.02, 0.02))]
    gone = shown(pattern, "id")[numbers]
    select(pattern, *numbers)
    bpy.ops.mesh.delete(type='VERT')
    assert bpy.ops.bubble_pattern.settle() == {'FINISHED'}
    assert settings.count == count - 2
    assert not set(gone) & set(shown(pattern, "id"))
    assert shown(pattern, "pitch").max() > 1.01 * PITCH
    select(pattern, nearest(pattern, -0.02, 0.0))
    bpy.ops.mesh.delete(type='VERT')
    assert bpy.ops.bubble_pattern.settle(fill_voids=True) == {'FINISHED'}
    assert count - 3 <= settings.count <= count
    assert shown(pattern, "pitch").max() == pytest.approx(PITCH)


def test_copies_and_points_from_nothing_are_new_features() -> None:
    pattern = editing(panel())
    settings = pattern.bubble_pattern
    count = settings.count
    ids = shown(pattern, "id")
    select(pattern, nearest(pattern, 0.0, 0.0))
    bpy.ops.mesh.duplicate()
    bpy.ops.transform.translate(value=(0.002, 0.0, 0.0))
    change(pattern, lambda mesh: mesh.verts.new((0.03, 0.03, 0.02)))
    assert bpy.ops.bubble_pattern.settle(pin_moved=True) == {'FINISHED'}
    assert settings.count == count + 2
    after = shown(pattern, "id")
    assert set(ids) < set(after)
    assert len(set(after)) == len(after) == count + 2
    assert len(settings.pins) == 2
    assert (shown(pattern, "diameter") > 0).all()
    at = shown(pattern)[shown(pattern, "pinned")]
    assert np.abs(np.sort(at[:, 0]) - [0.002, 0.03]).max() < 0.003
    bpy.ops.object.mode_set(mode='OBJECT')
    assert bpy.ops.bubble_pattern.apply() == {'FINISHED'}
    assert not settings.verdict


def test_undo_and_redo_bring_settings_and_points_back() -> None:
    pattern = editing()
    name, count = pattern.name, pattern.bubble_pattern.count
    bpy.ops.ed.undo_push(message="start")
    select(pattern, nearest(pattern, 0.0, 0.0))
    bpy.ops.ed.undo_push(message="select")
    bpy.ops.bubble_pattern.pin()
    bpy.ops.ed.undo_push(message="pin")
    select(pattern, nearest(pattern, 0.02, 0.0))
    bpy.ops.mesh.delete(type='VERT')
    bpy.ops.ed.undo_push(message="delete")
    bpy.ops.bubble_pattern.settle()
    bpy.ops.ed.undo_push(message="settle")

    def state() -> tuple[int, int, bool, int]:
        settings = bpy.data.objects[name].bubble_pattern
        edited = bmesh.from_edit_mesh(bpy.data.objects[name].data)
        return len(settings.pins), settings.count, settings.hand_made, len(edited.verts)

    assert state() == (1, count - 1, True, count - 1)
    states = [(1, count, False, count - 1), (1, count, False, count), (0, count, False, count)]
    for expected in states:
        bpy.ops.ed.undo()
        assert state() == expected
    for expected in [*reversed(states[:-1]), (1, count - 1, True, count - 1)]:
        bpy.ops.ed.redo()
        assert state() == expected


def test_unpin() -> None:
    pattern = editing()
    numbers = [nearest(pattern, 0.0, 0.0), nearest(pattern, 0.02, 0.0)]
    with pytest.raises(RuntimeError, match="Select features first"):
        bpy.ops.bubble_pattern.pin()
    select(pattern, *numbers)
    with pytest.raises(RuntimeError, match="No feature is pinned"):
        bpy.ops.bubble_pattern.unpin()
    bpy.ops.bubble_pattern.pin()
    select(pattern, numbers[0])
    bpy.ops.bubble_pattern.unpin()
    assert np.array_equal(np.flatnonzero(shown(pattern, "pinned")), [numbers[1]])
    assert len(pattern.bubble_pattern.pins) == 1
    bpy.ops.object.mode_set(mode='OBJECT')
    with pytest.raises(RuntimeError, match="Go to Edit Mode of the pattern and move features"):
        bpy.ops.bubble_pattern.settle()


def test_hand_work_is_not_thrown_away_unasked() -> None:
    pattern = editing()
    settings = pattern.bubble_pattern
    select(pattern, nearest(pattern, 0.0, 0.0))
    bpy.ops.mesh.delete(type='VERT')
    bpy.ops.bubble_pattern.settle()
    bpy.ops.object.mode_set(mode='OBJECT')
    before, count = points(pattern), settings.count
    settings.diameter = 0.002
    assert np.array_equal(points(pattern), before)
    assert points(pattern, "diameter").max() == pytest.approx(0.002)
    assert settings.hand_made
    settings.pitch = 0.006
    assert np.array_equal(points(pattern), before)
    assert settings_recipe.is_outdated(settings)
    activate(pattern)
    with pytest.raises(RuntimeError, match="packing has changed since the features were settled by hand"):
        bpy.ops.bubble_pattern.apply()
    settings.pitch = PITCH
    assert not settings_recipe.is_outdated(settings)
    assert np.array_equal(points(pattern), before)
    for vertex in settings.base.data.vertices:
        vertex.co.x *= 1.01
    settings.base.data.update_tag()
    bpy.context.view_layer.update()
    settings.diameter = 0.0025
    assert "settled by hand" in settings.trouble
    assert np.array_equal(points(pattern), before)
    assert bpy.ops.bubble_pattern.update() == {'FINISHED'}
    assert settings.count > count
    assert not settings.hand_made
    assert not settings.trouble


def test_trouble_leaves_everything_as_it_was() -> None:
    pattern = editing()
    settings = pattern.bubble_pattern
    select(pattern, nearest(pattern, 0.0, 0.0), nearest(pattern, 0.02, 0.0))
    bpy.ops.transform.translate(value=(0.5, 0.0, 0.0))
    with pytest.raises(RuntimeError, match="2 features are off the target region"):
        bpy.ops.bubble_pattern.settle()
    assert bpy.context.mode == 'EDIT_MESH'
    bpy.ops.transform.translate(value=(-0.5, 0.0, 0.0))
    bpy.ops.object.mode_set(mode='OBJECT')
    settings.live = False
    settings.pitch = 0.006
    bpy.ops.object.mode_set(mode='EDIT')
    with pytest.raises(RuntimeError, match="packing has changed"):
        bpy.ops.bubble_pattern.settle()
    settings.pitch = PITCH
    bpy.ops.mesh.select_all(action='SELECT')
    bpy.ops.mesh.delete(type='VERT')
    with pytest.raises(RuntimeError, match="No point of the pattern is left"):
        bpy.ops.bubble_pattern.settle()


def test_pins_without_room_are_told_in_the_scenes_unit() -> None:
    pattern = editing()
    select(pattern, nearest(pattern, 0.0, 0.0))
    bpy.ops.bubble_pattern.pin()
    bpy.ops.mesh.duplicate()
    bpy.ops.transform.translate(value=(0.001, 0.0, 0.0))
    with pytest.raises(RuntimeError, match=r"Two pinned features .* are 0\.001 m apart|1 mm apart"):
        bpy.ops.bubble_pattern.settle()


def test_settled_pattern_is_saved_and_follows_its_base(tmp_path: Path) -> None:
    pattern = editing()
    number = nearest(pattern, 0.003, 0.002)
    select(pattern, number)
    bpy.ops.bubble_pattern.pin()
    bpy.ops.transform.translate(value=(0.001, 0.0, 0.0))
    bpy.ops.bubble_pattern.settle()
    bpy.ops.object.mode_set(mode='OBJECT')
    before = points(pattern)
    pattern = reopened(tmp_path)
    settings = pattern.bubble_pattern
    assert settings.hand_made
    assert len(settings.pins) == 1
    assert np.array_equal(points(pattern), before)
    settings.base.location = (1.0, 2.0, 3.0)
    bpy.context.view_layer.update()
    recipe = settings_recipe.recipe_of(settings)
    source = sources.read_source(settings.base, settings.region, bpy.context, recipe)
    assert source.fingerprint == settings.fingerprint
    activate(pattern)
    bpy.ops.object.mode_set(mode='EDIT')
    assert bpy.ops.bubble_pattern.settle() == {'FINISHED'}
    assert np.abs(shown(pattern) - [1, 2, 3] - before).max() < 0.03 * PITCH


@pytest.mark.parametrize(("x", "y", "by"), [(0.003, 0.002, 0.001), (0.01, -0.01, 0.002)])
def test_who_settles_again_changes_nothing(x: float, y: float, by: float) -> None:
    pattern = editing()
    select(pattern, nearest(pattern, x, y))
    bpy.ops.bubble_pattern.pin()
    bpy.ops.transform.translate(value=(by, 0.0, 0.0))
    bpy.ops.bubble_pattern.settle()
    before = shown(pattern)
    bpy.ops.bubble_pattern.settle()
    assert np.abs(shown(pattern) - before).max() < 0.03 * PITCH
