"""Saving, opening, and files of older versions."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

bpy = pytest.importorskip("bpy", reason="needs the bpy module: python scripts/test.py --blender VERSION")

from bubble_pattern_addon.blender import preview_nodes, properties, settings_recipe  # noqa: E402

from .parts import add_on_top, plate, points  # noqa: E402


def reopened(folder: Path) -> bpy.types.Object:
    """The only pattern of the current file after it was saved and opened again."""
    path = str(folder / "saved.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    assert not bpy.data.objects
    bpy.ops.wm.open_mainfile(filepath=path)
    (pattern,) = [obj for obj in bpy.data.objects if properties.is_pattern(obj)]
    return pattern


def test_a_saved_pattern_opens_and_can_be_edited(tmp_path: Path) -> None:
    pattern = add_on_top(plate())
    settings = pattern.bubble_pattern
    settings.edge_offset = 0.001
    count, places = settings.count, points(pattern)
    pattern = reopened(tmp_path)
    settings = pattern.bubble_pattern
    assert settings.base == bpy.data.objects["Plate"]
    assert settings.edge_offset == pytest.approx(0.001)
    assert settings.count == count
    assert np.array_equal(points(pattern), places)
    assert not settings_recipe.is_outdated(settings)
    bpy.context.view_layer.objects.active = pattern
    assert bpy.ops.bubble_pattern.update() == {'FINISHED'}
    assert np.array_equal(points(pattern), places)
    settings.pitch *= 1.5
    assert settings.count < count
    assert bpy.ops.bubble_pattern.apply() == {'FINISHED'}


def shown() -> int:
    graph = bpy.context.evaluated_depsgraph_get()
    return sum(1 for instance in graph.object_instances if instance.is_instance)


def test_an_older_preview_is_rebuilt_in_place(tmp_path: Path) -> None:
    pattern = add_on_top(plate())
    group = pattern.modifiers[preview_nodes.MODIFIER].node_group
    group.nodes.clear()
    group.interface.clear()
    group[preview_nodes.VERSION_KEY] = 0
    pattern.update_tag()
    assert shown() == 0
    pattern = reopened(tmp_path)
    groups = [group for group in bpy.data.node_groups if preview_nodes.VERSION_KEY in group]
    assert len(groups) == 1
    assert groups[0][preview_nodes.VERSION_KEY] == preview_nodes.VERSION
    assert shown() == pattern.bubble_pattern.count


def test_the_preview_of_a_newer_version_is_left_alone(tmp_path: Path) -> None:
    pattern = add_on_top(plate())
    group = pattern.modifiers[preview_nodes.MODIFIER].node_group
    group[preview_nodes.VERSION_KEY] = preview_nodes.VERSION + 1
    nodes = len(group.nodes)
    pattern = reopened(tmp_path)
    group = pattern.modifiers[preview_nodes.MODIFIER].node_group
    assert group[preview_nodes.VERSION_KEY] == preview_nodes.VERSION + 1
    assert len(group.nodes) == nodes


def test_all_patterns_share_one_preview() -> None:
    add_on_top(plate(name="One"))
    add_on_top(plate(name="Two"))
    assert len([g for g in bpy.data.node_groups if preview_nodes.VERSION_KEY in g]) == 1
