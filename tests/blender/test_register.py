"""Registering and unregistering leaves nothing behind; buttons that cannot work say why."""

from __future__ import annotations

from collections.abc import Callable

import pytest

bpy = pytest.importorskip("bpy", reason="needs the bpy module: python scripts/test.py --blender VERSION")

import bubble_pattern_addon  # noqa: E402

from .parts import activate, add_on_top, plate, select_faces  # noqa: E402


def traces() -> dict[str, list[str]]:
    """Everything in Blender that a registered add-on could leave something in."""
    found = {
        "types": dir(bpy.types),
        "operators": [f"{name}.{op}" for name in dir(bpy.ops) for op in dir(getattr(bpy.ops, name))],
        "object": list(bpy.types.Object.bl_rna.properties.keys()),
        "scene": list(bpy.types.Scene.bl_rna.properties.keys()),
        "window": list(bpy.types.WindowManager.bl_rna.properties.keys()),
        "preset folders": bpy.utils.preset_paths("bubble_pattern"),
        "export menu": [str(f) for f in bpy.types.TOPBAR_MT_file_export._dyn_ui_initialize()],
        "panels": [str(cls) for cls in bpy.types.Panel.__subclasses__() if hasattr(cls, "bl_rna")],
    }
    for name in dir(bpy.app.handlers):
        handlers = getattr(bpy.app.handlers, name)
        if isinstance(handlers, list):
            found[name] = [handler.__name__ for handler in handlers]
    for config in bpy.context.window_manager.keyconfigs:
        found[config.name] = [f"{m.name} {item.idname}" for m in config.keymaps for item in m.keymap_items]
    del found["panels"]
    return found


def test_unregistering_leaves_nothing_twice_in_a_row() -> None:
    bubble_pattern_addon.unregister()
    try:
        before = traces()
        assert not [name for name in before["types"] if "BUBBLE" in name.upper()]
        for _ in range(2):
            bubble_pattern_addon.register()
            assert traces() != before
            bubble_pattern_addon.unregister()
            assert traces() == before
    finally:
        bubble_pattern_addon.register()


def test_registering_does_not_wait_for_scipy() -> None:
    import subprocess
    import sys
    from pathlib import Path

    code = (
        "import sys, bpy, bubble_pattern_addon as a; a.register(); late = {'scipy', 'trimesh', 'manifold3d'}"
        " & set(sys.modules); a.unregister(); print('loaded', sorted(late))"
    )
    root = Path(__file__).parents[2]
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=root, capture_output=True, text=True, timeout=120, check=False
    )
    assert "loaded []" in done.stdout


def nothing() -> None:
    pass


def a_plate() -> None:
    plate()


def a_plate_in_edit_mode_with_nothing_selected() -> None:
    select_faces(plate(), lambda face: False)


def a_camera() -> None:
    bpy.ops.object.camera_add()


def a_pattern() -> None:
    activate(add_on_top(plate()))


def a_base_with_a_pattern() -> None:
    base = plate()
    add_on_top(base)
    bpy.context.view_layer.objects.active = base


def a_pattern_whose_base_was_deleted() -> None:
    base = plate()
    activate(add_on_top(base))
    bpy.context.collection.objects.unlink(base)


def an_empty_mesh() -> None:
    obj = bpy.data.objects.new("Empty", bpy.data.meshes.new("Empty"))
    bpy.context.collection.objects.link(obj)
    bpy.context.view_layer.objects.active = obj


@pytest.mark.parametrize(
    ("operator", "situation", "reason"),
    [
        ("add", nothing, "Select a mesh object first"),
        ("add", a_camera, "Select a mesh object first"),
        ("add", a_plate_in_edit_mode_with_nothing_selected, "Select the faces that the pattern shall fill"),
        ("add", a_pattern, "This is a pattern already"),
        ("add", a_base_with_a_pattern, "select faces in Edit Mode to add another one"),
        ("add", an_empty_mesh, "The object has no faces"),
        ("update", a_plate, "Select a pattern, its base or its part first"),
        ("apply", nothing, "Select a pattern, its base or its part first"),
        ("apply", a_pattern_whose_base_was_deleted, "The base of this pattern has been deleted"),
        ("remove", a_plate, "Select a pattern, its base or its part first"),
        ("edit", a_plate, "Select a pattern, its base or its part first"),
        ("region_assign", a_pattern, "switch to Edit Mode first"),
        ("region_edit", a_plate, "Select a pattern, its base or its part first"),
    ],
)
def test_a_button_that_cannot_work_says_why(
    operator: str, situation: Callable[[], None], reason: str
) -> None:
    situation()
    function = getattr(bpy.ops.bubble_pattern, operator)
    assert not function.poll()
    with pytest.raises(RuntimeError, match=reason):
        function()


def test_buttons_need_object_mode() -> None:
    base = plate()
    add_on_top(base)
    bpy.ops.bubble_pattern.region_edit()
    for name in ("update", "apply", "remove", "edit"):
        with pytest.raises(RuntimeError, match="Switch to Object Mode first"):
            getattr(bpy.ops.bubble_pattern, name)()


def test_names_and_tooltips_are_as_blender_has_them() -> None:
    from bubble_pattern_addon.blender.operators import CLASSES

    for cls in CLASSES:
        assert cls.bl_label == cls.bl_label.title()
        description = getattr(bpy.ops.bubble_pattern, cls.bl_idname.split(".")[1]).get_rna_type().description
        assert description
        assert not description.endswith(".")
        assert 'UNDO' in cls.bl_options
    for prop in bpy.types.Object.bl_rna.properties["bubble_pattern"].fixed_type.properties:
        if prop.is_hidden or prop.identifier in {"rna_type", "name"}:
            continue
        assert prop.description, prop.identifier
        assert not prop.description.endswith("."), prop.identifier


def test_a_pattern_without_its_base_can_be_removed() -> None:
    a_pattern_whose_base_was_deleted()
    assert bpy.ops.bubble_pattern.remove() == {'FINISHED'}
    assert not list(bpy.context.scene.objects)
