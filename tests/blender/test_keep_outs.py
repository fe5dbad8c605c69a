"""Keep-outs in Blender: objects, collections, faces and shapes that the pattern goes round."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from bubble_pattern_addon.blender import live, settings_recipe, sources  # noqa: E402
from bubble_pattern_addon.blender.properties import pattern_of  # noqa: E402
from bubble_pattern_addon.core.recipe import KeepOut, RegionChoice  # noqa: E402
from tests.blender import parts  # noqa: E402


def laid() -> bpy.types.Object:
    """A pattern on the top of a plate of 100 mm, pitch 4 mm."""
    base = parts.plate()
    parts.select_faces(base, parts.on_top)
    assert bpy.ops.bubble_pattern.add(pitch=0.004) == {'FINISHED'}
    bpy.ops.object.mode_set(mode='OBJECT')
    return pattern_of(base)


def boss(at: tuple[float, float, float], radius: float = 0.01, name: str = "Boss") -> bpy.types.Object:
    bpy.ops.mesh.primitive_cylinder_add(vertices=128, radius=radius, depth=0.02, location=at)
    bpy.context.object.name = name
    return bpy.context.object


def add(pattern: bpy.types.Object, kind: str, **values: Any) -> Any:
    """One more keep-out with these properties."""
    parts.activate(pattern)
    assert bpy.ops.bubble_pattern.keep_out_add(kind=kind) == {'FINISHED'}
    entry = pattern.bubble_pattern.keep_out[-1]
    for key, value in values.items():
        setattr(entry, key, value)
    assert not pattern.bubble_pattern.trouble
    return entry


def away_from(pattern: bpy.types.Object, x: float, y: float) -> np.ndarray:
    """Distances of the points to an upright axis in world space."""
    return np.linalg.norm(parts.points(pattern)[:, :2] - [x, y], axis=1)


def test_selected_object_is_kept_out_below_and_when_it_moves() -> None:
    pattern = laid()
    obj = boss((0.02, 0.01, -0.05))
    parts.activate(pattern)
    obj.select_set(True)
    assert bpy.ops.bubble_pattern.keep_out_add(kind='OBJECT') == {'FINISHED'}
    entry = pattern.bubble_pattern.keep_out[0]
    assert entry.object == obj
    assert away_from(pattern, 0.02, 0.01).min() == pytest.approx(0.012, abs=2e-5)
    entry.margin = 0.003
    assert away_from(pattern, 0.02, 0.01).min() == pytest.approx(0.015, abs=2e-5)
    before = pattern.bubble_pattern.fingerprint
    obj.location.x = -0.02
    obj.scale = (0.5, 0.5, 1.0)
    bpy.context.view_layer.update()
    recipe = settings_recipe.recipe_of(pattern.bubble_pattern)
    source = sources.read_source(
        pattern.bubble_pattern.base, pattern.bubble_pattern.region, bpy.context, recipe
    )
    assert source.fingerprint != before
    assert bpy.ops.bubble_pattern.update() == {'FINISHED'}
    assert away_from(pattern, -0.02, 0.01).min() == pytest.approx(0.01, abs=2e-5)
    assert away_from(pattern, 0.02, 0.01).min() < 0.003


def test_pattern_says_that_a_keep_out_has_moved() -> None:
    pattern = laid()
    obj = boss((0.02, 0.01, 0.0))
    add(pattern, 'OBJECT', object=obj)
    live.look()
    assert not live.trouble_of(pattern)
    obj.location.x = 0.0
    bpy.context.view_layer.update()
    live.look()
    assert "or a keep-out" in live.trouble_of(pattern)
    assert bpy.ops.bubble_pattern.update() == {'FINISHED'}
    assert not live.trouble_of(pattern)


def test_base_and_object_moved_together() -> None:
    pattern = laid()
    obj = boss((0.02, 0.01, 0.0))
    add(pattern, 'OBJECT', object=obj)
    before = len(parts.points(pattern))
    base = pattern.bubble_pattern.base
    obj.parent = base
    base.location, base.rotation_euler = (0.3, -0.2, 0.1), (0.4, 0.0, 0.0)
    bpy.context.view_layer.update()
    assert bpy.ops.bubble_pattern.update() == {'FINISHED'}
    inverse = np.array(base.matrix_world.inverted())
    after = parts.points(pattern) @ inverse[:3, :3].T + inverse[:3, 3]
    assert len(after) == pytest.approx(before, rel=0.02)  # the last bits of the outline are others
    assert np.linalg.norm(after[:, :2] - [0.02, 0.01], axis=1).min() == pytest.approx(0.012, abs=2e-5)


def test_collection_with_a_modifier_and_without_the_base() -> None:
    pattern = laid()
    base = pattern.bubble_pattern.base
    group = bpy.data.collections.new("Bosses")
    bpy.context.scene.collection.children.link(group)
    one = boss((-0.03, -0.02, 0.0), 0.006)
    one.modifiers.new("Two", 'MIRROR')
    one.modifiers["Two"].mirror_object = base
    for obj in (one, base, bpy.context.scene.camera):
        if obj is not None:
            group.objects.link(obj)
    add(pattern, 'COLLECTION', collection=group, margin=0.001)
    for x in (-0.03, 0.03):
        assert away_from(pattern, x, -0.02).min() == pytest.approx(0.009, abs=2e-5)
    bpy.data.collections.remove(group)
    assert not settings_recipe.recipe_of(pattern.bubble_pattern).region.keep_out
    assert settings_recipe.is_outdated(pattern.bubble_pattern)
    assert bpy.ops.bubble_pattern.update() == {'FINISHED'}


def test_deleted_object_is_kept_out_no_longer() -> None:
    pattern = laid()
    count = pattern.bubble_pattern.count
    obj = boss((0.0, 0.0, 0.0))
    add(pattern, 'OBJECT', object=obj)
    assert pattern.bubble_pattern.count < count
    parts.activate(obj)
    bpy.ops.object.delete()
    assert settings_recipe.is_outdated(pattern.bubble_pattern)
    parts.activate(pattern)
    assert bpy.ops.bubble_pattern.update() == {'FINISHED'}
    assert pattern.bubble_pattern.count == count


def test_selected_faces_are_kept_out() -> None:
    base = parts.panel()
    pattern = parts.add_on_top(base)
    count = pattern.bubble_pattern.count
    parts.select_faces(base, lambda face: parts.on_top(face) and face.calc_center_median().xy.length < 0.03)
    assert bpy.ops.bubble_pattern.keep_out_add(kind='FACES') == {'FINISHED'}
    assert bpy.context.mode == 'EDIT_MESH'
    assert pattern.bubble_pattern.keep_out[0].faces == "bubble_keep_out"
    bpy.ops.object.mode_set(mode='OBJECT')
    assert bpy.ops.bubble_pattern.update() == {'FINISHED'}
    assert pattern.bubble_pattern.count < count
    near = away_from(pattern, 0.0, 0.0).min()
    pattern.bubble_pattern.keep_out[0].margin = 0.005
    assert away_from(pattern, 0.0, 0.0).min() == pytest.approx(near + 0.005, abs=0.002)


def test_shape_and_apply_and_undo() -> None:
    pattern = laid()
    count = pattern.bubble_pattern.count
    add(pattern, 'CYLINDER', centre=(0.0, 0.0, 0.0), diameter=0.03)
    assert away_from(pattern, 0.0, 0.0).min() == pytest.approx(0.017, abs=2e-5)
    assert bpy.ops.bubble_pattern.apply() == {'FINISHED'}
    assert not pattern.bubble_pattern.verdict
    assert bpy.ops.bubble_pattern.edit() == {'FINISHED'}
    parts.activate(pattern)
    assert bpy.ops.bubble_pattern.keep_out_remove() == {'FINISHED'}
    assert pattern.bubble_pattern.count == count
    with pytest.raises(RuntimeError, match="Nothing is kept out"):
        bpy.ops.bubble_pattern.keep_out_remove()


def test_trouble_is_told_in_the_sidebars_words() -> None:
    pattern = laid()
    obj = boss((0.0, 0.0, 0.0), 0.5)
    parts.activate(pattern)
    bpy.ops.bubble_pattern.keep_out_add(kind='OBJECT')
    pattern.bubble_pattern.keep_out[0].object = obj
    assert "leave nothing" in pattern.bubble_pattern.trouble
    pattern.bubble_pattern.keep_out[0].kind = 'BOX'
    assert not pattern.bubble_pattern.trouble
    entry = pattern.bubble_pattern.keep_out[0]
    entry.use_along = True
    entry.along = (0, 0, 1)
    assert pattern.bubble_pattern.trouble.startswith("Keep-Outs, entry 1")


def test_keep_outs_go_to_the_settings_and_back() -> None:
    pattern = laid()
    boss((0, 0, 0), name="Logo")
    bpy.context.scene.collection.children.link(bpy.data.collections.new("Bosses"))
    settings = pattern.bubble_pattern
    recipe = settings_recipe.recipe_of(settings)
    entries = (
        KeepOut(faces="Top", margin=0.5),
        KeepOut(object="Logo", axis=(0.0, 1.0, 0.0), reach=2.0),
        KeepOut(collection="Bosses", margin=1.0),
        KeepOut(file="logo.stl"),
        KeepOut(sphere=(1.0, 2.0, 3.0), diameter=4.0),
        KeepOut(cylinder=(1.0, 2.0, 3.0), diameter=4.0, axis=(1.0, 1.0, 0.0)),
        KeepOut(box=(1.0, 2.0, 3.0), size=(4.0, 5.0, 6.0), axis=(0.0, 1.0, 1.0), along=(1.0, 0.0, 0.0)),
    )
    wanted = RegionChoice(attribute=recipe.region.attribute, keep_out=entries)
    from dataclasses import replace

    settings_recipe.take_recipe(settings, replace(recipe, region=wanted))
    assert settings_recipe.recipe_of(settings).region == wanted


def test_batch_reads_objects_and_files(tmp_path: Path) -> None:
    import trimesh

    from bubble_pattern_addon.batch import main

    base = parts.plate(size=100.0, thickness=4.0)
    boss((20.0, 10.0, 0.0), 8.0)
    parts.activate(base)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "plate.blend"))
    trimesh.creation.box((20, 20, 20)).apply_translation((-20, -10, 0)).export(tmp_path / "logo.stl")
    recipe = tmp_path / "recipe.toml"
    recipe.write_text(
        "[region]\nnear = [0, 0, 9]\n"
        'keep_out = [{ object = "Boss", margin = 1.0 }, { file = "logo.stl" }]\n'
        "[packing]\npitch = 4.0\n[output]\nblend = true\n"
    )
    out = tmp_path / "out"
    assert main([str(recipe), "--base", str(tmp_path / "plate.blend"), "--out", str(out), "--quiet"]) == 0
    table = np.genfromtxt(out / "features.csv", delimiter=",", names=True)
    assert np.hypot(table["x"] - 20, table["y"] - 10).min() == pytest.approx(11, abs=0.02)
    beyond = [np.maximum(np.abs(table[axis] - at) - 10, 0) for axis, at in (("x", -20), ("y", -10))]
    assert np.hypot(*beyond).min() == pytest.approx(2, abs=0.02)
    assert (out / "keep_out_2.stl").exists()
    bpy.ops.wm.open_mainfile(filepath=str(out / "pattern.blend"))
    [pattern] = [obj for obj in bpy.data.objects if obj.bubble_pattern.base]
    count = pattern.bubble_pattern.count
    assert not settings_recipe.is_outdated(pattern.bubble_pattern)
    bpy.ops.bubble_pattern.edit()
    assert bpy.ops.bubble_pattern.update() == {'FINISHED'}
    assert pattern.bubble_pattern.count == pytest.approx(count, abs=2)
