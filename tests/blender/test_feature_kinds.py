"""Features of every kind in Blender: settings and recipe, preview, and the part."""

from __future__ import annotations

import tomllib
from pathlib import Path

import numpy as np
import pytest

bpy = pytest.importorskip("bpy", reason="needs the bpy module: python scripts/test.py --blender VERSION")

from bubble_pattern_addon import batch  # noqa: E402
from bubble_pattern_addon.blender.feature_settings import feature_of, take_feature  # noqa: E402
from bubble_pattern_addon.blender.feature_shapes import KEY  # noqa: E402
from bubble_pattern_addon.blender.properties import pattern_of  # noqa: E402
from bubble_pattern_addon.blender.settings_recipe import is_outdated  # noqa: E402
from bubble_pattern_addon.core.feature_recipe import Feature  # noqa: E402
from bubble_pattern_addon.core.fields import Linear  # noqa: E402
from bubble_pattern_addon.core.recipe_file import recipe_from_dict  # noqa: E402

from .parts import activate, add_on_top, euler, is_closed, panel, plate, points, volume  # noqa: E402

GROWS = Linear(from_=0.2, to=0.8, direction=(1.0, 0.0, 0.0))
FEATURES = [
    Feature(),
    Feature(depth=0.002, draft=3.0, rim="chamfer", rim_size=0.0002, rim_angle=82.0),
    Feature(rim="fillet", profile="slot", aspect=0.3, turn="boundary", angle=15.0),
    Feature(
        kind="dimple", depth=0.0003, profile="polygon", corners=5, rounding=0.5, turn="random", turn_seed=4
    ),
    Feature(kind="dimple"),
    Feature(kind="bump", height=0.0007),
    Feature(
        kind="bump", form="boss", draft=2.0, rim="fillet", rim_size=0.0003, pull=(0.0, 0.5, 1.0), axis=0.5
    ),
    Feature(
        kind="bump", form="cone", profile="cross", aspect=0.4, turn="fixed", turn_direction=(0.0, 1.0, 0.0)
    ),
    Feature(profile="drop", turn="around", turn_point=(0.01, 0.0, 0.0), aspect=GROWS),
    Feature(profile="curve", points=((0.0, 0.0), (1.0, 0.0), (0.0, 2.0)), turn="curvature"),
    Feature(depth=Linear(from_=0.001, to=0.002, direction=(0.0, 1.0, 0.0)), across="flats", sides=24),
    Feature(
        profile="ellipse",
        aspect=0.6,
        angle=Linear(from_=0.0, to=90.0, direction=(1.0, 0.0, 0.0)),
        draft=Linear(from_=0.0, to=5.0, direction=(1.0, 0.0, 0.0)),
        turn="attribute",
        turn_attribute="flow",
    ),
]


def shapes() -> list[bpy.types.Object]:
    return [obj for obj in bpy.data.objects if KEY in obj]


def instances(pattern: bpy.types.Object) -> list[bpy.types.Mesh]:
    graph = bpy.context.evaluated_depsgraph_get()
    return [entry.object.data for entry in graph.object_instances if entry.is_instance]


@pytest.mark.parametrize("feature", FEATURES, ids=lambda f: f"{f.kind}-{f.profile}-{f.turn}")
def test_a_feature_taken_over_is_the_same_feature(feature: Feature) -> None:
    pattern = add_on_top(plate(0.05))
    settings = pattern.bubble_pattern
    settings.live = False
    take_feature(settings, feature)
    assert feature_of(settings) == feature


def test_every_key_of_the_recipe_has_a_property() -> None:
    known = bpy.types.Object.bl_rna.properties["bubble_pattern"].fixed_type.properties
    named = {"tolerance": "facet_tolerance", "points": "profile_points", "mesh": "profile_mesh"}
    for key in Feature.__dataclass_fields__:
        assert named.get(key, key) in known, key


def test_bumps_stand_on_the_part() -> None:
    base = plate(0.05)
    pattern = add_on_top(base)
    settings = pattern.bubble_pattern
    settings.kind = 'BUMP'
    settings.height = 0.0005
    assert not is_outdated(settings)
    assert bpy.ops.bubble_pattern.apply() == {'FINISHED'}
    part = bpy.context.object
    assert is_closed(part.data)
    assert euler(part.data) == 2
    assert volume(part) > volume(base)
    assert max(vertex.co.z for vertex in part.data.vertices) == pytest.approx(0.0055, abs=1e-7)
    assert settings.verdict == ""


def test_slots_head_along_the_boundary_in_preview_and_part() -> None:
    base = plate(0.05)
    pattern = add_on_top(base)
    settings = pattern.bubble_pattern
    settings.profile = 'SLOT'
    settings.aspect = 0.4
    settings.turn = 'BOUNDARY'
    heading = points(pattern, "heading")
    first = points(pattern, "row") == 0
    assert np.allclose(np.abs(heading[first]).max(axis=1), 1, atol=1e-5)
    rotation = points(pattern, "rotation")
    x = 1 - 2 * (rotation[:, 2] ** 2 + rotation[:, 3] ** 2)
    assert np.allclose(x, heading[:, 0], atol=1e-5)
    settings.turn = 'ROW'
    assert "heading" not in pattern.data.attributes
    settings.turn = 'BOUNDARY'
    assert bpy.ops.bubble_pattern.apply() == {'FINISHED'}
    part = bpy.context.object
    assert is_closed(part.data)
    assert euler(part.data) == 2 - 2 * settings.count


def test_the_preview_looks_like_the_feature() -> None:
    pattern = add_on_top(plate(0.05))
    settings = pattern.bubble_pattern
    assert shapes() == []
    assert len(instances(pattern)) == settings.count
    settings.kind = 'BUMP'
    settings.height = 0.5 * settings.diameter
    (shape,) = shapes()
    assert max(vertex.co.z for vertex in shape.data.vertices) == pytest.approx(0.5, rel=1e-5)
    shown = instances(pattern)
    assert len(shown) == settings.count
    assert {len(mesh.vertices) for mesh in shown} == {len(shape.data.vertices)}
    settings.kind = 'HOLE'
    settings.profile = 'DROP'
    (shape,) = shapes()
    reach = [vertex.co.xy.length for vertex in shape.data.vertices]
    assert max(reach) == pytest.approx(0.5, rel=1e-6)
    settings.rim = 'CHAMFER'
    (shape,) = shapes()
    assert {face.material_index for face in shape.data.polygons} == {0, 1}
    settings.profile = 'CIRCLE'
    settings.rim = 'SHARP'
    assert shapes() == []
    settings.profile = 'CROSS'
    activate(pattern)
    assert bpy.ops.bubble_pattern.remove() == {'FINISHED'}
    assert shapes() == []


def test_patterns_that_look_alike_share_their_shape_and_a_copy_keeps_it() -> None:
    pattern = add_on_top(plate(0.05))
    settings = pattern.bubble_pattern
    settings.profile = 'SLOT'
    (shape,) = shapes()
    copy = pattern.copy()
    copy.data = pattern.data.copy()
    bpy.context.collection.objects.link(copy)
    settings.profile = 'DROP'
    assert shape in shapes()
    assert len(shapes()) == 2


def test_a_curve_and_a_mesh_as_features() -> None:
    base = plate(0.05)
    pattern = add_on_top(base)
    settings = pattern.bubble_pattern
    bpy.ops.curve.primitive_bezier_circle_add(radius=1.0)
    curve = bpy.context.object
    curve.scale = (1.0, 0.5, 1.0)
    bpy.context.view_layer.update()
    settings.profile = 'CURVE'
    assert "Curve" in settings.trouble or settings.trouble == "" or is_outdated(settings)
    settings.profile_curve = curve
    assert settings.trouble == ""
    feature = feature_of(settings)
    outline = np.array(feature.points)
    assert np.abs(outline).max(axis=0) == pytest.approx([1.0, 0.5], rel=2e-2)
    activate(base)
    assert bpy.ops.bubble_pattern.apply() == {'FINISHED'}
    assert euler(bpy.context.object.data) == 2 - 2 * settings.count
    assert bpy.ops.bubble_pattern.edit() == {'FINISHED'}

    bpy.ops.mesh.primitive_cone_add(vertices=6, radius1=1.0, depth=2.0, location=(9, 9, 9))
    cone = bpy.context.object
    for vertex in cone.data.vertices:
        vertex.co.z += 1.0
    settings.kind = 'BUMP'
    settings.profile = 'MESH'
    settings.profile_mesh = cone
    settings.height = 0.0006
    hexagon = settings.count * 3 * np.sqrt(3) / 8 * settings.diameter**2
    assert settings.open_area == pytest.approx(hexagon / 0.05**2, rel=1e-4)
    activate(base)
    assert bpy.ops.bubble_pattern.apply() == {'FINISHED'}
    part = bpy.context.object
    assert is_closed(part.data)
    assert max(vertex.co.z for vertex in part.data.vertices) == pytest.approx(0.0056, abs=1e-7)


def test_a_kind_starts_with_sizes_that_suit_the_diameter() -> None:
    settings = add_on_top(plate(0.05)).bubble_pattern
    settings.kind = 'BUMP'
    assert settings.height == pytest.approx(settings.diameter / 4, rel=0.1)
    settings.form = 'BOSS'
    settings.rim = 'FILLET'
    assert settings.rim_size == pytest.approx(settings.diameter / 10, rel=0.1)
    settings.height = 0.002
    settings.kind = 'DIMPLE'
    settings.kind = 'BUMP'
    assert settings.height == pytest.approx(0.002)


def test_a_batch_run_takes_its_mesh_into_the_blend(tmp_path: Path) -> None:
    bpy.ops.mesh.primitive_cube_add(size=1.0)
    bpy.ops.wm.stl_export(filepath=str(tmp_path / "base.stl"))
    bpy.ops.mesh.primitive_cone_add(vertices=6, depth=1.0, location=(0, 0, 0.5))
    bpy.ops.wm.stl_export(filepath=str(tmp_path / "cone.stl"), export_selected_objects=True)
    (tmp_path / "recipe.toml").write_text(
        "[region]\nnear = [0, 0, 0.5]\n[packing]\npitch = 0.2\n[output]\nblend = true\n"
        '[feature]\nkind = "bump"\nprofile = "mesh"\nmesh = "cone.stl"\nheight = 0.05\n'
    )
    out = tmp_path / "out"
    files = [str(tmp_path / "recipe.toml"), "--base", str(tmp_path / "base.stl"), "--out", str(out)]
    assert batch.main([*files, "--quiet"]) == 0
    bpy.ops.wm.open_mainfile(filepath=str(out / "pattern.blend"))
    (pattern,) = (obj for obj in bpy.data.objects if obj.bubble_pattern.base is not None)
    settings = pattern.bubble_pattern
    assert feature_of(settings) == Feature(kind="bump", profile="mesh", mesh="cone", height=0.05)
    assert len(shapes()) == 1


def test_an_open_curve_is_told() -> None:
    pattern = add_on_top(plate(0.05))
    settings = pattern.bubble_pattern
    bpy.ops.curve.primitive_bezier_curve_add()
    settings.profile = 'CURVE'
    settings.profile_curve = bpy.context.object
    assert "closed loop" in settings.trouble


def test_vectors_of_the_base_lead() -> None:
    base = panel()
    base.rotation_euler = (0.1, 0.2, 0.3)
    flow = base.data.attributes.new("flow", 'FLOAT_VECTOR', 'POINT')
    flow.data.foreach_set("vector", np.tile([0.0, 1.0, 0.0], len(base.data.vertices)).astype(np.float32))
    pattern = add_on_top(base)
    settings = pattern.bubble_pattern
    settings.profile = 'SLOT'
    settings.turn_attribute = "flow"
    settings.turn = 'ATTRIBUTE'
    along = points(pattern, "heading") @ np.array(base.matrix_world)[:3, 1]
    assert along.min() > 0.9


def test_walls_of_bumps_have_their_material() -> None:
    base = panel()
    pattern = add_on_top(base)
    settings = pattern.bubble_pattern
    rubber = bpy.data.materials.new("Rubber")
    settings.kind = 'BUMP'
    settings.wall_material = rubber
    assert bpy.ops.bubble_pattern.apply() == {'FINISHED'}
    part = bpy.context.object
    index = [slot.material for slot in part.material_slots].index(rubber)
    count = sum(face.material_index == index for face in part.data.polygons)
    assert count >= settings.count


def test_a_recipe_of_bumps_runs_in_the_panel_and_says_what_it_made(tmp_path: Path) -> None:
    pattern = add_on_top(plate(0.05))
    settings = pattern.bubble_pattern
    settings.kind = 'BUMP'
    settings.form = 'BOSS'
    settings.rim = 'FILLET'
    text = settings.made_with
    recipe = recipe_from_dict(tomllib.loads(text))
    assert recipe.feature == Feature()
    assert feature_of(settings).rim == "fillet"
    assert pattern_of(bpy.context.object) == pattern
