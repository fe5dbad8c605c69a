"""Fields, limits and fixed sizes in the panel's settings: what comes of them on the points."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

bpy = pytest.importorskip("bpy", reason="needs the bpy module: python scripts/test.py --blender VERSION")

from mathutils import Euler, Matrix, Vector  # noqa: E402

from bubble_pattern_addon.blender import (  # noqa: E402
    field_panels,
    field_properties,
    generation,
    packing_panel,
    panels,
    pattern_object,
    properties,
    settings_recipe,
    shaping_panel,
)
from bubble_pattern_addon.core.blending import Fill, Most  # noqa: E402
from bubble_pattern_addon.core.field_tables import field_from_toml  # noqa: E402
from bubble_pattern_addon.core.metric import Constant  # noqa: E402
from bubble_pattern_addon.core.recipe import Packing, Recipe, RegionChoice, Seed, Shaping  # noqa: E402

from .parts import activate, add_on_top, panel, plate, points  # noqa: E402
from .test_file import reopened  # noqa: E402

SMALL, LARGE = 0.001, 0.003


def moved_plate(size: float = 0.1) -> Any:
    """A plate that stands askew in the world."""
    base = plate(size)
    base.matrix_world = Matrix.LocRotScale((0.3, -0.2, 0.7), Euler((0.3, 1.2, -2.0)), (1, 1, 1))
    bpy.context.view_layer.update()
    return base


def local(pattern: Any) -> np.ndarray:
    """Places of the points in the frame of the base, (n, 3)."""
    return np.array([item.vector for item in pattern.data.attributes["position"].data])


def sizes(pattern: Any, name: str = "wished") -> np.ndarray:
    return np.array([item.value for item in pattern.data.attributes[name].data])


def laid(size: float = 0.1) -> Any:
    """A pattern of pitch 5 on a plate that stands askew; its diameters vary from SMALL to LARGE."""
    pattern = add_on_top(moved_plate(size))
    settings = pattern.bubble_pattern
    settings.live = False
    settings.pitch, settings.diameter = 0.005, 0.002
    settings.diameter_field.start_size, settings.diameter_field.end_size = SMALL, LARGE
    settings.live = True
    generation.drive(generation.update_steps(pattern, bpy.context))
    assert not settings.trouble
    return pattern


def an_empty(at: tuple[float, float, float], base: Any, name: str = "Target") -> Any:
    """An empty at a place in the coordinates of the base."""
    empty = bpy.data.objects.new(name, None)
    bpy.context.collection.objects.link(empty)
    empty.matrix_world = base.matrix_world @ Matrix.Translation(at)
    bpy.context.view_layer.update()
    return empty


def a_curve(base: Any) -> Any:
    """A straight curve along the y axis of the base, at x = 0.02 on its top."""
    data = bpy.data.curves.new("Line", 'CURVE')
    data.dimensions = '3D'
    spline = data.splines.new('POLY')
    spline.points.add(1)
    for point, y in zip(spline.points, (-0.2, 0.2), strict=True):
        point.co = (0.02, y, 0.005, 1)
    curve = bpy.data.objects.new("Line", data)
    bpy.context.collection.objects.link(curve)
    curve.matrix_world = base.matrix_world
    bpy.context.view_layer.update()
    return curve


def a_plane(base: Any) -> Any:
    """A mesh of a single face, square to the x axis of the base at x = 0.02, far larger than the base."""
    mesh = bpy.data.meshes.new("Wall")
    mesh.from_pydata([(0.02, y, z) for y, z in ((-1, -1), (1, -1), (1, 1), (-1, 1))], [], [(0, 1, 2, 3)])
    wall = bpy.data.objects.new("Wall", mesh)
    bpy.context.collection.objects.link(wall)
    wall.matrix_world = base.matrix_world
    bpy.context.view_layer.update()
    return wall


def an_image(name: str = "Ramp") -> Any:
    """An image, 64 x 2, whose brightness is u."""
    image = bpy.data.images.new(name, 64, 2, float_buffer=True)
    values = np.ones((2, 64, 4), dtype=np.float32)
    values[..., :3] = ((np.arange(64) + 0.5) / 64)[None, :, None]
    image.pixels.foreach_set(values.ravel())
    image.pack()
    return image


def set_field(pattern: Any, **values: Any) -> None:
    """Set properties of the diameter's field one after the other, as a user does."""
    for name, value in values.items():
        setattr(pattern.bubble_pattern.diameter_field, name, value)


# -- every kind ----------------------------------------------------------------------------------------------


def linear(pattern: Any) -> np.ndarray:
    set_field(pattern, direction=(2, 0, 0), kind='LINEAR')
    return local(pattern)[:, 0] / 0.1 + 0.5


def between_points(pattern: Any) -> np.ndarray:
    end = an_empty((0.03, 0.04, 0), pattern.bubble_pattern.base)
    set_field(pattern, along='POINTS', start=(0, 0, 0), end_object=end, kind='LINEAR')
    return local(pattern) @ [0.03, 0.04, 0] / 0.05**2


def radial(pattern: Any) -> np.ndarray:
    set_field(pattern, about='POINT', centre=(0.01, 0, 0), axis='Z', inner=0.01, radius=0.05, kind='RADIAL')
    return (np.hypot(local(pattern)[:, 0] - 0.01, local(pattern)[:, 1]) - 0.01) / 0.04


def about_an_object(pattern: Any) -> np.ndarray:
    target = an_empty((0.01, 0.02, 0.1), pattern.bubble_pattern.base)
    set_field(pattern, about='OBJECT', object=target, axis='Z', radius=0.05, kind='RADIAL')
    return np.hypot(local(pattern)[:, 0] - 0.01, local(pattern)[:, 1] - 0.02) / 0.05


def edge(pattern: Any) -> np.ndarray:
    set_field(pattern, distance=0.02, kind='EDGE')
    pattern.bubble_pattern.diameter_field.distance = 0.02  # the kind began with a distance of its own
    return (0.05 - np.abs(local(pattern)[:, :2]).max(axis=1)) / 0.02


def from_an_object(pattern: Any) -> np.ndarray:
    target = an_empty((0.01, 0.02, 0.005), pattern.bubble_pattern.base)
    set_field(pattern, kind='DISTANCE', object=target, distance=0.05)
    return np.linalg.norm(local(pattern) - [0.01, 0.02, 0.005], axis=1) / 0.05


def from_a_curve(pattern: Any) -> np.ndarray:
    set_field(pattern, kind='DISTANCE', object=a_curve(pattern.bubble_pattern.base), distance=0.05)
    return np.abs(local(pattern)[:, 0] - 0.02) / 0.05


def from_a_collection(pattern: Any) -> np.ndarray:
    group = bpy.data.collections.new("Group")
    bpy.context.scene.collection.children.link(group)
    at = np.array([(0.03, 0.0, 0.005), (-0.03, 0.0, 0.005)])
    for number, place in enumerate(at):
        group.objects.link(an_empty(tuple(place), pattern.bubble_pattern.base, f"Target {number}"))
    set_field(pattern, kind='DISTANCE', objects=group, distance=0.05)
    return np.linalg.norm(local(pattern)[:, None] - at, axis=2).min(axis=1) / 0.05


def painted_corners(pattern: Any) -> np.ndarray:
    """A vertex group, whose weights rise along x."""
    base = pattern.bubble_pattern.base
    group = base.vertex_groups.new(name="Weight")
    for vertex in base.data.vertices:
        group.add([vertex.index], vertex.co.x / 0.1 + 0.5, 'REPLACE')
    set_field(pattern, kind='ATTRIBUTE', attribute="Weight")
    return local(pattern)[:, 0] / 0.1 + 0.5


def an_attribute(pattern: Any) -> np.ndarray:
    base = pattern.bubble_pattern.base
    made = base.data.attributes.new("depth", 'FLOAT', 'CORNER')
    at = [base.data.vertices[loop.vertex_index].co.y for loop in base.data.loops]
    made.data.foreach_set("value", at)
    set_field(pattern, kind='ATTRIBUTE', attribute="depth", low=-0.05, high=0.05)
    return local(pattern)[:, 1] / 0.1 + 0.5


def a_colour(pattern: Any) -> np.ndarray:
    base = pattern.bubble_pattern.base
    made = base.data.color_attributes.new("Paint", 'FLOAT_COLOR', 'POINT')
    for vertex, item in zip(base.data.vertices, made.data, strict=True):
        item.color = (0, vertex.co.x / 0.1 + 0.5, 0, 1)
    set_field(pattern, kind='ATTRIBUTE', attribute="Paint", channel='GREEN')
    return local(pattern)[:, 0] / 0.1 + 0.5


def an_image_by_uv(pattern: Any) -> np.ndarray:
    base = pattern.bubble_pattern.base
    layer = base.data.uv_layers["UVMap"]
    for loop in base.data.loops:
        layer.uv[loop.index].vector = base.data.vertices[loop.vertex_index].co.xy * 9 + Vector((0.5, 0.5))
    set_field(pattern, kind='IMAGE', image=an_image(), mapping='UV', uv="UVMap")
    return local(pattern)[:, 0] * 9 + 0.5


def an_image_from_the_front(pattern: Any) -> np.ndarray:
    set_field(pattern, kind='IMAGE', image=an_image(), width=0.11)
    # y is up where one looks along z, and x to the right
    return local(pattern)[:, 0] / 0.11 + 0.5


KINDS = [
    linear,
    between_points,
    radial,
    about_an_object,
    edge,
    from_an_object,
    from_a_curve,
    from_a_collection,
    painted_corners,
    an_attribute,
    a_colour,
    an_image_by_uv,
    an_image_from_the_front,
]


@pytest.mark.parametrize("kind", KINDS)
def test_every_kind_gives_the_values_of_its_formula(kind: Callable[[Any], np.ndarray]) -> None:
    pattern = laid()
    before = local(pattern)
    share = np.clip(kind(pattern), 0, 1)
    settings = pattern.bubble_pattern
    set_field(pattern, start_size=SMALL, end_size=LARGE)  # where the kind began with others
    assert not settings.trouble
    assert np.array_equal(local(pattern), before), "sizes alone have changed"
    assert share.min() < 0.2
    assert share.max() > 0.8
    assert np.allclose(sizes(pattern), SMALL + (LARGE - SMALL) * share, atol=2e-7)
    assert not settings_recipe.is_outdated(settings)


def test_a_mesh_is_measured_on_its_faces() -> None:
    pattern = laid()
    wall = a_plane(pattern.bubble_pattern.base)
    set_field(pattern, kind='DISTANCE', object=wall, distance=0.1, start_size=SMALL, end_size=LARGE)
    share = (sizes(pattern) - SMALL) / (LARGE - SMALL)
    # points on the face are up to 1/60 of its diagonal apart
    assert np.abs(share * 0.1 - np.abs(local(pattern)[:, 0] - 0.02)).max() < 2.83 / 60
    assert np.corrcoef(share, np.abs(local(pattern)[:, 0] - 0.02))[0, 1] > 0.7


def test_a_graded_pitch_moves_the_bubbles_and_a_share_follows_it() -> None:
    pattern = laid()
    settings = pattern.bubble_pattern
    count = settings.count
    settings.pitch_field.kind = 'LINEAR'
    assert settings.pitch_field.start_size == pytest.approx(0.005)
    settings.pitch_field.end_size = 0.008
    assert settings.count < count
    x, pitch = local(pattern)[:, 0], sizes(pattern, "pitch")
    assert np.allclose(pitch, 0.005 + 0.003 * (x / 0.1 + 0.5), rtol=0.05)
    before = local(pattern)
    settings.diameter_mode = 'SHARE'
    settings.fill = 0.5
    assert np.array_equal(local(pattern), before)
    assert np.allclose(sizes(pattern), pitch / 2, rtol=1e-5)
    settings.diameter_field.kind = 'LINEAR'
    settings.diameter_field.start_share, settings.diameter_field.end_share = 0.3, 0.6
    assert np.allclose(sizes(pattern), pitch * (0.3 + 0.3 * (x / 0.1 + 0.5)), rtol=1e-4)


def test_what_is_not_chosen_yet_is_asked_for() -> None:
    pattern = laid()
    settings = pattern.bubble_pattern
    for kind, asked in (('ATTRIBUTE', "an attribute"), ('IMAGE', "an image"), ('DISTANCE', "an object")):
        settings.diameter_field.kind = kind
        assert settings.trouble.startswith("Diameter follows")
        assert asked in settings.trouble
        assert settings_recipe.is_outdated(settings)
    settings.diameter_field.attribute = "nothing"
    settings.diameter_field.kind = 'ATTRIBUTE'
    assert "no attribute of that name" in settings.trouble
    settings.diameter_field.kind = 'CONSTANT'
    assert not settings.trouble


def test_names_that_can_be_chosen() -> None:
    pattern = laid()
    base, field = pattern.bubble_pattern.base, pattern.bubble_pattern.diameter_field
    base.vertex_groups.new(name="Weight")
    from bubble_pattern_addon.blender.field_properties import attribute_names, uv_names

    names = attribute_names(field, bpy.context, "")
    assert {"Weight", "bubble_region"} <= set(names)
    assert "UVMap" not in names
    assert not [name for name in names if name.startswith(".")]
    assert uv_names(field, bpy.context, "") == ["UVMap"]


def test_apply_sees_that_an_object_was_moved_and_paint_renewed() -> None:
    pattern = laid()
    settings = pattern.bubble_pattern
    target = an_empty((0.03, 0, 0.005), settings.base)
    set_field(pattern, kind='DISTANCE', object=target, distance=0.05, start_size=SMALL, end_size=LARGE)
    before = sizes(pattern)
    target.matrix_world = settings.base.matrix_world @ Matrix.Translation((-0.03, 0, 0.005))
    bpy.context.view_layer.update()
    activate(pattern)
    assert bpy.ops.bubble_pattern.apply() == {'FINISHED'}
    assert not np.allclose(sizes(pattern), before)
    away = np.linalg.norm(local(pattern) - [-0.03, 0, 0.005], axis=1)
    assert np.allclose(sizes(pattern), SMALL + (LARGE - SMALL) * np.clip(away / 0.05, 0, 1), atol=2e-7)


# -- the recipe and back -------------------------------------------------------------------------------------

ENDS = {"from": 0.001, "to": 0.003}
SHOWN = [
    0.002,
    {"kind": "linear", **ENDS, "direction": [0.0, 1.0, 0.5], "falloff": "smooth", "invert": True},
    {"kind": "linear", **ENDS, "start": [0.0, 0.1, 0.2], "end": [1.0, 0.1, 0.3], "clamp": True},
    {"kind": "radial", **ENDS},
    {"kind": "radial", **ENDS, "centre": [0.1, 0.2, 0.3], "axis": [0.0, 0.0, 1.0], "inner": 0.01},
    {"kind": "radial", **ENDS, "object": "Target", "axis": "y", "radius": 0.4},
    {"kind": "boundary", **ENDS, "distance": 0.02, "loops": "islands", "falloff": "sharp"},
    {"kind": "distance", **ENDS, "distance": 0.02, "objects": ["Target"]},
    {"kind": "attribute", **ENDS, "name": "paint", "channel": "red", "low": -1.0, "high": 2.0},
    {"kind": "image", **ENDS, "image": "Ramp", "uv": "UVMap"},
    {"kind": "image", **ENDS, "image": "Ramp", "width": 0.3, "channel": "alpha"},
]
KEPT_AS_TEXT = [
    {"kind": "linear", **ENDS, "direction": [1.0, 0.0, 0.0], "curve": [[0.0, 0.0], [0.5, 0.9], [1.0, 1.0]]},
    {"kind": "radial", **ENDS, "axis": [1.0, 1.0, 0.0]},
    {"kind": "radial", **ENDS, "object": "Nothing of that name"},
    {"kind": "boundary", **ENDS, "distance": 0.02, "near": [[0.0, 0.0, 0.0]]},
    {"kind": "distance", **ENDS, "distance": 0.02, "points": [[0.0, 0.0, 0.0]]},
    {"kind": "image", **ENDS, "image": "Ramp", "project": [0.0, 0.0, 1.0]},
    {"kind": "image", **ENDS, "image": "nowhere.png"},
    {"kind": "max", "of": [0.001, {"kind": "boundary", **ENDS, "distance": 0.02}]},
    {"kind": "faces", "sets": [{"attribute": "middle", "value": 0.002}], "otherwise": 0.001},
]


@pytest.mark.parametrize("table", SHOWN + KEPT_AS_TEXT)
def test_a_recipe_goes_to_the_settings_and_back(table: Any) -> None:
    pattern = laid()
    an_empty((0, 0, 0), pattern.bubble_pattern.base)
    an_image()
    from bubble_pattern_addon.blender.field_recipe import same

    settings = pattern.bubble_pattern
    given = field_from_toml(table, "here")
    for diameter in (given, Fill(field_from_toml(replaced(table), "here"))):
        recipe = Recipe(
            region=RegionChoice(attribute="bubble_region", parts=("Left", "Front"), gap=0.002),
            packing=Packing(pitch=given, orientation=(0.0, 1.0, 0.25)),
            shaping=Shaping(diameter, seeds=(Seed((0.25, 0.5, 1.0), 0.002),), solver="iterate"),
        )
        settings_recipe.take_recipe(settings, recipe)
        constant = isinstance(given, Constant)
        wanted = {'CONSTANT'} if constant else {'RECIPE'} if table in KEPT_AS_TEXT else set(KIND_NAMES)
        assert settings.pitch_field.kind in wanted
        assert settings.diameter_field.kind in wanted
        assert settings.live
        assert same(unchecked(settings), recipe)


@pytest.mark.parametrize("word", ["off", "auto", "x", "yz", "rotate 3", "rotate 6 z"])
@pytest.mark.parametrize("centre", [None, (0.5, 0.25, -1.0)])
def test_symmetry_goes_to_the_settings_and_back(word: str, centre: tuple[float, float, float] | None) -> None:
    settings = laid().bubble_pattern
    recipe = settings_recipe.recipe_of(settings)
    packing = replace(recipe.packing, symmetry=word, symmetry_centre=centre)
    settings_recipe.take_packing(settings, packing)
    assert settings_recipe.recipe_of(settings).packing == packing


def test_a_symmetric_pattern_is_laid_from_the_settings() -> None:
    pattern = laid()
    pattern.bubble_pattern.symmetry = 'X'
    where = local(pattern)
    away = np.linalg.norm(where[:, None] * [-1, 1, 1] - where[None], axis=2).min(axis=1)
    assert len(where) > 50
    assert away.max() < 1e-3 * pattern.bubble_pattern.pitch


def test_features_of_a_symmetric_pattern_stand_symmetrically_after_another_shaping() -> None:
    pattern = laid()
    settings = pattern.bubble_pattern
    settings.symmetry = 'X'
    settings.profile, settings.turn, settings.angle = 'SLOT', 'RANDOM', 0.3
    where = local(pattern)
    near = np.linalg.norm(where[:, None] * [-1, 1, 1] - where[None], axis=2).argmin(axis=1)
    along = np.array([item.vector for item in pattern.data.attributes["heading"].data])
    image = along[near] * [-1, 1, 1]
    off = np.minimum(np.linalg.norm(along - image, axis=1), np.linalg.norm(along + image, axis=1))
    assert len(np.unique(np.round(along[:, 0], 3))) > 20
    assert off.max() < 1e-4
    # read without one of the points, it has lost its symmetry: nothing to keep
    recipe = settings_recipe.recipe_of(settings)
    mesh = generation.read_source(settings.base, settings.region, bpy.context, recipe).base.mesh
    assert pattern_object.read_pattern(pattern, mesh).symmetry == "x"
    aside = int(np.argmax(where[:, 0]))
    pattern.data.attributes["pitch"].data[aside].value = 0.0
    read = pattern_object.read_pattern(pattern, mesh)
    assert read.isometries is None
    assert read.partners is None


KIND_NAMES = ('LINEAR', 'RADIAL', 'EDGE', 'DISTANCE', 'ATTRIBUTE', 'IMAGE')


def replaced(table: Any) -> Any:
    """The same field with shares of the pitch for values."""
    if not isinstance(table, dict):
        return 0.5
    return {**table, "from": 0.25, "to": 0.75} if "from" in table else table


def unchecked(settings: Any) -> Recipe:
    """The recipe of the settings, whether its values go together or not."""
    import unittest.mock

    with unittest.mock.patch.object(settings_recipe, "check_recipe"):
        return settings_recipe.recipe_of(settings)


def test_text_from_a_recipe_works_and_nonsense_is_told() -> None:
    pattern = laid()
    settings = pattern.bubble_pattern
    set_field(pattern, kind='RECIPE')
    assert "Diameter" in settings.trouble
    set_field(pattern, text='{ kind = "max", of = [0.002, { kind = "radial", from = 0.001, to = 0.003 }] }')
    assert not settings.trouble
    assert isinstance(settings_recipe.recipe_of(settings).shaping.diameter, Most)
    assert sizes(pattern).min() == pytest.approx(0.002)
    assert sizes(pattern).max() > 0.0028
    set_field(pattern, text='{ kind = "lineal" }')
    assert 'did you mean "linear"?' in settings.trouble


# -- limits --------------------------------------------------------------------------------------------------


def test_limits_shrink_and_leave_out_and_bring_back() -> None:
    pattern = laid()
    settings = pattern.bubble_pattern
    count, before = settings.count, local(pattern)
    set_field(pattern, kind='LINEAR', start_size=SMALL, end_size=LARGE)
    settings.min_web = 0.0025
    assert settings.web >= 0.0025 * (1 - 1e-5)
    assert settings.shrunk > 0
    assert settings.count == count
    settings.min_diameter = 0.0015
    assert settings.dropped == count - settings.count > 0
    made = sizes(pattern, "diameter")
    assert (made == 0).sum() == settings.dropped
    assert made[made > 0].min() >= 0.0015 * (1 - 1e-6)
    assert np.array_equal(local(pattern), before)
    settings.min_diameter = settings.min_web = 0.0
    assert (settings.count, settings.dropped, settings.shrunk) == (count, 0, 0)
    assert np.array_equal(sizes(pattern, "diameter"), sizes(pattern))
    settings.min_margin = 0.004
    assert settings.margin >= 0.004 * (1 - 1e-5)


def test_features_left_out_are_in_no_part_and_not_shown() -> None:
    pattern = laid(0.06)
    settings = pattern.bubble_pattern
    set_field(pattern, kind='LINEAR', start_size=SMALL, end_size=LARGE)
    settings.min_diameter = 0.002
    assert settings.dropped
    graph = bpy.context.evaluated_depsgraph_get()
    assert sum(1 for instance in graph.object_instances if instance.is_instance) == settings.count
    activate(pattern)
    assert bpy.ops.bubble_pattern.apply() == {'FINISHED'}
    part = settings.part.data
    assert len(part.vertices) - len(part.edges) + len(part.polygons) == 2 - 2 * settings.count


def test_points_deleted_by_hand_stay_away_when_sizes_change() -> None:
    pattern = laid()
    settings = pattern.bubble_pattern
    import bmesh

    made = bmesh.new()
    made.from_mesh(pattern.data)
    made.verts.ensure_lookup_table()
    bmesh.ops.delete(made, geom=made.verts[3:5], context='VERTS')
    made.to_mesh(pattern.data)
    made.free()
    ids = sizes(pattern, "id")
    set_field(pattern, kind='LINEAR', start_size=SMALL, end_size=LARGE)
    settings.min_diameter = 0.002
    assert settings.dropped
    assert np.array_equal(sizes(pattern, "id"), ids)
    settings.min_diameter = 0.0
    assert settings.count == len(ids)
    assert np.allclose(
        sizes(pattern), SMALL + (LARGE - SMALL) * (local(pattern)[:, 0] / 0.1 + 0.5), atol=2e-7
    )


def test_sub_regions_have_a_first_row_each_and_a_gap_between() -> None:
    base = panel()
    left = base.data.attributes.new("Left", 'BOOLEAN', 'FACE')
    left.data.foreach_set("value", [face.center.x < 0 for face in base.data.polygons])
    pattern = add_on_top(base)
    settings = pattern.bubble_pattern
    assert (np.abs(local(pattern)[:, 0]) < settings.pitch / 4).any()
    settings.parts = "Left"
    assert not settings.trouble
    assert np.abs(local(pattern)[:, 0]).min() > 0.45 * settings.pitch
    settings.gap = 0.01
    assert np.abs(local(pattern)[:, 0]).min() > 0.45 * settings.pitch + 0.005
    settings.parts = "Lefts"
    assert "Left" in settings.trouble
    # other faces in the sub-region are another pattern
    settings.parts = "Left"
    before = local(pattern)
    left = base.data.attributes["Left"]
    left.data.foreach_set("value", [face.center.x < 0.05 for face in base.data.polygons])
    base.data.update_tag()
    activate(base)
    assert bpy.ops.bubble_pattern.apply() == {'FINISHED'}
    assert len(local(pattern)) != len(before) or not np.allclose(local(pattern), before)


# -- fixed sizes ---------------------------------------------------------------------------------------------


def select_points(pattern: Any, chosen: np.ndarray) -> None:
    """Go to Edit Mode of the pattern with the chosen points selected."""
    if pattern.mode == 'EDIT':
        bpy.ops.object.mode_set(mode='OBJECT')
    activate(pattern)
    pattern.data.vertices.foreach_set("select", chosen)
    bpy.ops.object.mode_set(mode='EDIT')


def test_fixed_sizes_stay_and_the_others_level_out() -> None:
    pattern = laid()
    settings = pattern.bubble_pattern
    x = local(pattern)[:, 0]
    before = local(pattern)
    left, right = x < -0.043, x > 0.043
    select_points(pattern, left)
    assert bpy.ops.bubble_pattern.fix_sizes(diameter=0.001) == {'FINISHED'}
    assert pattern.mode == 'EDIT'
    select_points(pattern, right)
    assert bpy.ops.bubble_pattern.fix_sizes(diameter=0.003) == {'FINISHED'}
    bpy.ops.object.mode_set(mode='OBJECT')
    assert len(settings.seeds) == left.sum() + right.sum()
    made = sizes(pattern)
    assert np.allclose(made[left], 0.001)
    assert np.allclose(made[right], 0.003)
    assert np.array_equal(local(pattern), before)
    between = ~(left | right)
    assert (made[between] > 0.001).all()
    assert (made[between] < 0.003).all()
    assert np.corrcoef(made[between], x[between])[0, 1] > 0.98
    assert not settings_recipe.is_outdated(settings)
    # one of them again, in place of what it was
    one = np.arange(len(x)) == np.flatnonzero(left)[0]
    select_points(pattern, one)
    assert bpy.ops.bubble_pattern.fix_sizes(diameter=0.002) == {'FINISHED'}
    assert len(settings.seeds) == left.sum() + right.sum()
    # free again
    select_points(pattern, left)
    assert bpy.ops.bubble_pattern.free_sizes() == {'FINISHED'}
    assert len(settings.seeds) == right.sum()
    bpy.ops.object.mode_set(mode='OBJECT')
    assert np.allclose(sizes(pattern), 0.003)
    assert bpy.ops.bubble_pattern.free_sizes() == {'FINISHED'}
    assert np.allclose(sizes(pattern), 0.002)
    assert not bpy.ops.bubble_pattern.free_sizes.poll()


def test_features_keep_the_sizes_that_they_have() -> None:
    pattern = laid()
    set_field(pattern, kind='LINEAR', start_size=SMALL, end_size=LARGE)
    before = sizes(pattern)
    chosen = np.abs(local(pattern)[:, 0]) > 0.043
    select_points(pattern, chosen)
    assert bpy.ops.bubble_pattern.fix_sizes() == {'FINISHED'}
    bpy.ops.object.mode_set(mode='OBJECT')
    assert np.allclose(sizes(pattern)[chosen], before[chosen], rtol=1e-5)
    assert np.abs(sizes(pattern)[~chosen] - before[~chosen]).max() > 1e-5


def test_sizes_are_fixed_in_edit_mode_of_the_pattern_alone() -> None:
    pattern = laid()
    activate(pattern)
    with pytest.raises(RuntimeError, match="in Edit Mode of the pattern"):
        bpy.ops.bubble_pattern.fix_sizes()
    select_points(pattern, np.zeros(len(pattern.data.vertices), dtype=bool))
    with pytest.raises(RuntimeError, match="Select the features"):
        bpy.ops.bubble_pattern.fix_sizes()
    bpy.ops.object.mode_set(mode='OBJECT')
    pattern.bubble_pattern.min_diameter = 0.001
    set_field(pattern, kind='LINEAR', start_size=0.0005, end_size=LARGE)
    out = sizes(pattern, "diameter") == 0
    assert out.any()
    select_points(pattern, out)
    with pytest.raises(RuntimeError, match="left out as too small: give a diameter"):
        bpy.ops.bubble_pattern.fix_sizes()
    assert not pattern.bubble_pattern.seeds
    assert pattern.mode == 'EDIT'


# -- files ---------------------------------------------------------------------------------------------------


def test_fields_and_fixed_sizes_are_saved(tmp_path: Path) -> None:
    pattern = laid()
    settings = pattern.bubble_pattern
    target = an_empty((0.03, 0, 0.005), settings.base)
    set_field(pattern, kind='DISTANCE', object=target, distance=0.05, start_size=SMALL, end_size=LARGE)
    settings.pitch_field.kind = 'IMAGE'
    settings.pitch_field.image = an_image()
    settings.pitch_field.end_size = 0.008
    settings.min_diameter = 0.0015
    select_points(pattern, local(pattern)[:, 0] < -0.04)
    bpy.ops.bubble_pattern.fix_sizes(diameter=0.002)
    bpy.ops.object.mode_set(mode='OBJECT')
    before = {name: sizes(pattern, name) for name in ("id", "diameter", "wished", "pitch")}
    places, recipe = local(pattern), settings_recipe.recipe_of(settings)
    prints = (settings.fingerprint, settings.size_trace)
    pattern = reopened(tmp_path)
    settings = pattern.bubble_pattern
    assert settings_recipe.recipe_of(settings) == recipe
    assert not settings_recipe.is_outdated(settings)
    assert settings.diameter_field.object.name == "Target"
    bpy.context.view_layer.objects.active = pattern
    assert bpy.ops.bubble_pattern.update() == {'FINISHED'}
    assert (settings.fingerprint, settings.size_trace) == prints
    assert np.array_equal(local(pattern), places)
    for name, values in before.items():
        assert np.array_equal(sizes(pattern, name), values)


def test_a_file_of_the_first_version_opens_up_to_date(tmp_path: Path) -> None:
    pattern = add_on_top(plate())
    settings = pattern.bubble_pattern
    pitch, diameter = field_properties.typed(settings.pitch), field_properties.typed(settings.diameter)
    # as 0.1.0 wrote it
    settings.made_with = (
        '[region]\nmax_angle = 20.0\nattribute = "bubble_region"\nall = false\n\n'
        f'[packing]\npitch = {pitch}\nedge_offset = 0.0\nintegrator = "fire"\nseed = 0\niterations = 60\n'
        f"tolerance = 0.001\n\n[shaping]\ndiameter = {diameter}\n\n"
        '[feature]\nkind = "hole"\n\n[limits]\nmin_web = 0.0\nmin_margin = 0.0\n\n'
        "[output]\nblend = false\npicture = false\nformats = []\n"
    )
    settings.version = 1
    pattern.data.attributes.remove(pattern.data.attributes["wished"])
    places = points(pattern)
    pattern = reopened(tmp_path)
    settings = pattern.bubble_pattern
    assert settings.version == properties.SETTINGS_VERSION
    assert not settings_recipe.is_outdated(settings)
    settings.diameter *= 0.5
    assert np.array_equal(points(pattern), places)
    assert np.allclose(sizes(pattern, "diameter"), diameter / 2)
    # one that was not up to date is not called so
    settings.version, settings.made_with = 1, settings.made_with.replace("seed = 0", "seed = 1")
    assert settings_recipe.is_outdated(reopened(tmp_path).bubble_pattern)


# -- the panels ----------------------------------------------------------------------------------------------


class Layout:
    """Takes down what is drawn, and looks whether there is such a thing."""

    def __init__(self, drawn: list[str]) -> None:
        self.drawn = drawn

    def prop(self, data: Any, name: str, **options: Any) -> None:
        assert name in data.bl_rna.properties
        check_icon(options)
        self.drawn.append(name)

    def operator(self, name: str, **options: Any) -> None:
        check_icon(options)
        self.drawn.append(name)

    def template_ID(self, data: Any, name: str, open: str) -> None:
        self.prop(data, name)

    def label(self, **options: Any) -> None:
        check_icon(options)

    def row(self, **_options: Any) -> Layout:
        return Layout(self.drawn)

    column = split = row


def check_icon(options: Any) -> None:
    known = bpy.types.UILayout.bl_rna.functions["prop"].parameters["icon"].enum_items
    assert options.get("icon", 'NONE') in known


def test_the_sidebar_shows_what_a_kind_needs() -> None:
    pattern = laid()
    settings = pattern.bubble_pattern
    field = settings.diameter_field
    activate(pattern)
    for kind in ('CONSTANT', *KIND_NAMES, 'RECIPE'):
        field.kind = kind
        drawn: list[str] = []
        field_panels.draw_field(Layout(drawn), settings, "diameter", "diameter_field", "size", "Diameter")
        assert "kind" in drawn
        assert ("diameter" in drawn) == (kind == 'CONSTANT')
        assert ("start_size" in drawn) == ("falloff" in drawn) == (kind in KIND_NAMES)
        assert len(drawn) == len(set(drawn))
    field.kind = 'RADIAL'
    for about, shown in (('POINT', "centre"), ('OBJECT', "object")):
        field.about = about
        drawn = []
        field_panels.draw_field(Layout(drawn), settings, "fill", "diameter_field", "share", "Diameter")
        assert {shown, "start_share", "axis"} <= set(drawn)
    field.kind = 'CONSTANT'
    for cls in (packing_panel.BUBBLE_PATTERN_PT_packing, shaping_panel.BUBBLE_PATTERN_PT_shaping):
        drawn = []
        cls.draw(SimpleNamespace(layout=Layout(drawn), fields=()), bpy.context)
        assert drawn
    assert {"bubble_pattern.edit_sizes", "diameter_mode"} <= set(drawn)
    assert bpy.ops.bubble_pattern.edit_sizes() == {'FINISHED'}
    assert pattern.mode == 'EDIT'
    assert bpy.context.active_object == pattern
    assert tuple(bpy.context.tool_settings.mesh_select_mode) == (True, False, False)
    drawn = []
    main = SimpleNamespace(layout=Layout(drawn), draw_points=panels.BUBBLE_PATTERN_PT_main.draw_points)
    main.draw_points(main, main.layout, settings)
    names = ("settle", "pin", "unpin", "fix_sizes", "free_sizes")
    assert drawn == [f"bubble_pattern.{name}" for name in names]


def test_a_curve_of_one_s_own_goes_through_its_five_heights() -> None:
    pattern = add_on_top(plate())
    settings = pattern.bubble_pattern
    field = settings.diameter_field
    field.kind = 'LINEAR'
    field.falloff, field.heights = 'CURVE', (0.0, 0.9, 1.0, 0.2, 0.0)
    graded = settings_recipe.recipe_of(settings).shaping.diameter
    assert graded.falloff == "curve"
    assert graded.curve == ((0.0, 0.0), (0.25, 0.9), (0.5, 1.0), (0.75, 0.2), (1.0, 0.0))
    least, most = sorted((field.start_size, field.end_size))
    sizes = points(pattern, "diameter")
    assert least < most
    assert sizes.max() - sizes.min() > 0.9 * (most - least)  # there and back again
    settings_recipe.take_recipe(settings, settings_recipe.recipe_of(settings))
    assert (field.kind, field.falloff) == ('LINEAR', 'CURVE')
    assert tuple(field.heights) == pytest.approx((0.0, 0.9, 1.0, 0.2, 0.0))
    drawn: list[str] = []
    field_panels.draw_field(Layout(drawn), settings, "diameter", "diameter_field", "size", "Diameter")
    assert "heights" in drawn


def test_names_and_tooltips_of_fields_are_as_blender_has_them() -> None:
    from bubble_pattern_addon.blender.fixed_sizes import CLASSES

    groups = [cls.bl_rna for cls in properties.CLASSES]
    for group in groups:
        for prop in group.properties:
            if prop.is_hidden or prop.identifier in {"rna_type", "name"}:
                continue
            assert prop.description, prop.identifier
            assert not prop.description.endswith(".")
            for item in getattr(prop, "enum_items", ()):
                assert not item.description.endswith(".")
    for cls in CLASSES:
        assert cls.bl_label == cls.bl_label.title()
        assert not cls.bl_rna.description.endswith(".")
    lengths = {"start_size", "end_size", "distance", "inner", "radius", "width"}
    known = properties.BubblePatternField.bl_rna.properties
    assert all(known[name].subtype == 'DISTANCE' for name in lengths)
    limits = properties.BubblePatternSettings.bl_rna.properties
    assert all(limits[name].subtype == 'DISTANCE' for name in ("min_web", "min_margin", "min_diameter"))


def test_a_curved_panel_with_everything_at_once() -> None:
    pattern = add_on_top(panel())
    settings = pattern.bubble_pattern
    settings.live = False
    settings.pitch_field.kind = 'EDGE'
    settings.pitch_field.start_size, settings.pitch_field.end_size = 0.006, 0.012
    settings.pitch_field.distance = 0.06
    settings.diameter_mode = 'SHARE'
    settings.diameter_field.kind = 'RADIAL'
    settings.min_web, settings.min_diameter = 0.002, 0.002
    settings.live = True
    activate(pattern)
    assert bpy.ops.bubble_pattern.update() == {'FINISHED'}
    assert settings.web >= 0.002 * (1 - 1e-5)
    assert settings.count > 100
    assert bpy.ops.bubble_pattern.apply() == {'FINISHED'}
    assert not settings.verdict
