"""The finished part: a sound solid that looks like its base."""

from __future__ import annotations

import numpy as np
import pytest

bpy = pytest.importorskip("bpy", reason="needs the bpy module: python scripts/test.py --blender VERSION")

import bmesh  # noqa: E402
from mathutils import Euler, Matrix  # noqa: E402

from bubble_pattern_addon.blender.properties import pattern_of  # noqa: E402

from .parts import (  # noqa: E402
    activate,
    add_on_top,
    euler,
    is_closed,
    panel,
    plate,
    points,
    select_faces,
    volume,
)


def apply() -> bpy.types.Object:
    assert bpy.ops.bubble_pattern.apply() == {'FINISHED'}
    return bpy.context.object


def wall_faces(part: bpy.types.Object) -> list[bpy.types.MeshPolygon]:
    """Faces of the part that stand across the surface of a flat plate."""
    return [face for face in part.data.polygons if abs(face.normal.z) < 0.5 and face.area < 1e-4]


def test_the_part_is_a_solid_with_a_handle_per_hole() -> None:
    base = plate()
    pattern = add_on_top(base)
    part = apply()
    count = pattern.bubble_pattern.count
    assert is_closed(part.data)
    assert euler(part.data) == 2 - 2 * count
    assert not part.data.validate()
    holes = count * np.pi * (pattern.bubble_pattern.diameter / 2) ** 2 * 0.01
    assert volume(base) - volume(part) == pytest.approx(holes, rel=0.03)
    assert pattern.bubble_pattern.verdict == ""


def test_the_part_stands_in_the_place_of_its_base() -> None:
    base = plate()
    parent = bpy.data.objects.new("Parent", None)
    bpy.context.collection.objects.link(parent)
    parent.location = (1, 2, 3)
    base.parent = parent
    base.rotation_euler = (0.2, 0.3, 0.4)
    pattern = add_on_top(base)
    part = apply()
    assert part.parent == parent
    assert np.allclose(part.matrix_world, base.matrix_world)
    assert base.hide_get()
    assert base.hide_render
    assert pattern.hide_get()
    assert not part.hide_get()
    assert bpy.ops.bubble_pattern.edit() == {'FINISHED'}
    assert not base.hide_get()
    assert not pattern.hide_render
    assert part.hide_get()


@pytest.mark.parametrize("scale", [(2, 1, 1), (-1, 1, 1), (-1, 2, -1), (-1, -1, -2)])
def test_holes_are_round_and_outward_under_unapplied_scale(scale: tuple[float, float, float]) -> None:
    base = panel()
    base.matrix_world = Matrix.LocRotScale((1, 2, 3), Euler((0.1, 0.2, 0.3)), scale)
    pattern = add_on_top(base)
    part = apply()
    assert is_closed(part.data)
    removed = volume(base) - volume(part)
    settings = pattern.bubble_pattern
    thickness = 0.004 * abs(scale[2])
    holes = settings.count * np.pi * (settings.diameter / 2) ** 2 * thickness
    assert removed == pytest.approx(holes, rel=0.15)
    assert volume(part) > 0
    assert settings.verdict == ""


def test_untouched_faces_stay_as_they_were() -> None:
    base = panel()
    select_faces(base, lambda face: face.normal.z > 0.7 and face.calc_center_median().x > 0.03)
    bpy.ops.bubble_pattern.add()
    part = apply()

    def quads(mesh: bpy.types.Mesh) -> set[tuple]:
        return {
            tuple(sorted(tuple(mesh.vertices[v].co) for v in face.vertices))
            for face in mesh.polygons
            if len(face.vertices) == 4 and face.area > 1e-5  # a hole's wall is of far smaller ones
        }

    assert quads(part.data) <= quads(base.data)
    left = {q for q in quads(base.data) if max(corner[0] for corner in q) < 0.02}
    assert left
    assert left <= quads(part.data)


def test_ngons_with_vertices_on_a_line_are_bases_too() -> None:
    base = plate()
    made = bmesh.new()
    made.from_mesh(base.data)
    for edge in list(made.edges):
        bmesh.utils.edge_split(edge, edge.verts[0], 0.3)
    made.to_mesh(base.data)
    made.free()
    assert [len(face.vertices) for face in base.data.polygons] == [8] * 6
    pattern = add_on_top(base)
    part = apply()
    assert is_closed(part.data)
    assert euler(part.data) == 2 - 2 * pattern.bubble_pattern.count


def test_materials_and_uv_maps_survive() -> None:
    base = panel()
    add_on_top(base)
    part = apply()
    mesh = part.data
    assert [material.name for material in mesh.materials] == ["Body", "Front"]
    uv = mesh.uv_layers.active.data
    assert mesh.uv_layers.active.name == "UVMap"
    for face in mesh.polygons:
        if face.area < 1e-9:  # a sliver's normal may be anything
            continue
        center = face.center
        on_front = abs(center.z - 0.02 * np.cos(center.x * 10) * np.cos(center.y * 10)) < 2e-4
        if face.normal.z > 0.7 and on_front:
            assert face.material_index == 1
        elif face.normal.z < -0.7:
            assert face.material_index == 0
        for loop in face.loop_indices:
            place = mesh.vertices[mesh.loops[loop].vertex_index].co
            expected = np.array([place.x / 0.2 + 0.5, place.y / 0.2 + 0.5])
            assert np.allclose(uv[loop].uv, expected, atol=1e-4) or face.normal.z < 0.7


def test_walls_take_a_material_of_their_own() -> None:
    base = plate()
    pattern = add_on_top(base)
    pattern.bubble_pattern.wall_material = bpy.data.materials.new("Inside")
    part = apply()
    walls = {face.index for face in wall_faces(part)}
    assert walls
    names = [material.name if material else None for material in part.data.materials]
    for face in part.data.polygons:
        assert (names[face.material_index] == "Inside") == (face.index in walls)


def test_a_smooth_panel_shades_as_before() -> None:
    base = panel(cells=40)
    add_on_top(base)
    part = apply()
    mesh = part.data

    def normal_at(x: float, y: float) -> np.ndarray:
        slope = [0.2 * np.sin(x * 10) * np.cos(y * 10), 0.2 * np.cos(x * 10) * np.sin(y * 10), 1]
        return np.array(slope) / np.linalg.norm(slope)

    checked = 0
    for face in mesh.polygons:
        if face.normal.z < 0.7 or face.area < 1e-12:
            continue
        for loop in face.loop_indices:
            x, y, _ = mesh.vertices[mesh.loops[loop].vertex_index].co
            if max(abs(x), abs(y)) < 0.09:
                assert np.dot(mesh.corner_normals[loop].vector, normal_at(x, y)) > 0.9999
                checked += 1
    assert checked > 1000


def test_walls_are_smooth_round_the_hole_and_sharp_at_the_rim() -> None:
    base = plate()
    pattern = add_on_top(base)
    part = apply()
    mesh = part.data
    centres = points(pattern)[:, :2]
    walls = wall_faces(part)
    assert all(face.use_smooth for face in walls)
    for face in walls[:200]:
        for loop in face.loop_indices:
            place = np.array(mesh.vertices[mesh.loops[loop].vertex_index].co)[:2]
            centre = centres[np.linalg.norm(centres - place, axis=1).argmin()]
            inward = (centre - place) / np.linalg.norm(centre - place)
            assert np.dot(np.array(mesh.corner_normals[loop].vector)[:2], inward) > 0.999
    wall_edges = {key for face in walls for key in face.edge_keys}
    others = {key for face in mesh.polygons if abs(face.normal.z) > 0.5 for key in face.edge_keys}
    sharp = {edge.key for edge in mesh.edges if edge.use_edge_sharp}
    assert sharp == wall_edges & others


def test_sharp_edges_of_the_base_stay_sharp() -> None:
    base = panel()
    add_on_top(base)
    part = apply()

    def length_of_sharp(mesh: bpy.types.Mesh, rims: bool) -> float:
        total = 0.0
        for edge in mesh.edges:
            a, b = (mesh.vertices[v].co for v in edge.vertices)
            outside = max(abs((a.x + b.x) / 2), abs((a.y + b.y) / 2)) > 0.0999
            if edge.use_edge_sharp and outside != rims:
                total += (a - b).length
        return total

    assert length_of_sharp(part.data, False) == pytest.approx(length_of_sharp(base.data, False), rel=1e-5)


def test_attributes_of_every_domain_are_carried() -> None:
    base = plate()
    mesh = base.data
    for name, kind, domain, value in [
        ("weight", 'FLOAT', 'POINT', [v.co.x for v in mesh.vertices]),
        ("zone", 'INT', 'FACE', [7] * 6),
        ("crease_edge", 'FLOAT', 'EDGE', [0.5] * 12),
    ]:
        mesh.attributes.new(name, kind, domain).data.foreach_set("value", value)
    colors = mesh.color_attributes.new("Color", 'FLOAT_COLOR', 'CORNER')
    colors.data.foreach_set("color", [0.2, 0.4, 0.6, 1.0] * len(mesh.loops))
    add_on_top(base)
    made = apply().data
    x = np.array([v.co.x for v in made.vertices])
    assert np.allclose([item.value for item in made.attributes["weight"].data], x, atol=1e-6)
    assert {item.value for item in made.attributes["zone"].data} == {0, 7}
    assert np.allclose([c.color for c in made.color_attributes["Color"].data], [0.2, 0.4, 0.6, 1.0])
    creased = [e for e in made.edges if made.attributes["crease_edge"].data[e.index].value > 0]
    assert len(creased) == 12


def weights(part: bpy.types.Object, name: str) -> dict[int, float]:
    """Weight of each vertex that is in the vertex group."""
    index = part.vertex_groups[name].index
    pairs = [(v.index, e.weight) for v in part.data.vertices for e in v.groups if e.group == index]
    return dict(pairs)


@pytest.mark.parametrize("blind", [False, True], ids=["through", "blind"])
def test_vertex_groups_are_carried(blind: bool) -> None:
    base = plate()
    ramp, half, _, nil = (base.vertex_groups.new(name=name) for name in ("Ramp", "Half", "Empty", "Nil"))
    for vertex in base.data.vertices:
        ramp.add([vertex.index], vertex.co.x / 0.1 + 0.5, 'REPLACE')
        if vertex.co.x < 0:
            half.add([vertex.index], 0.75, 'REPLACE')
        nil.add([vertex.index], 0.0, 'REPLACE')
    half.lock_weight = True
    base.vertex_groups.active = half
    pattern = add_on_top(base)
    if blind:
        pattern.bubble_pattern.depth_mode, pattern.bubble_pattern.depth = 'BLIND', 0.004
    part = apply()
    assert [group.name for group in part.vertex_groups] == ["Ramp", "Half", "Empty", "Nil"]
    assert [group.lock_weight for group in part.vertex_groups] == [False, True, False, False]
    assert part.vertex_groups.active.name == "Half"
    x = np.array([vertex.co.x for vertex in part.data.vertices])
    inside = np.abs(x) < 0.05 - 1e-6
    found = weights(part, "Ramp")
    rim = [v for v in np.flatnonzero(inside) if abs(part.data.vertices[v].co.z - 0.005) < 1e-6]
    assert len(rim) > 1000
    assert np.allclose([found[v] for v in rim], x[rim] / 0.1 + 0.5, atol=1e-5)
    found = weights(part, "Half")
    assert np.allclose([found[v] for v in rim], 0.75 * (0.5 - x[rim] / 0.1), atol=1e-5)
    corners = np.flatnonzero(~inside)
    assert {v for v in corners if v in found} == {v for v in corners if x[v] < 0}
    assert weights(part, "Empty") == {}
    assert sorted(weights(part, "Nil")) == corners.tolist()


def test_vertex_groups_of_the_modified_mesh_are_carried() -> None:
    base = panel()
    base.vertex_groups.new(name="All").add(range(len(base.data.vertices)), 1.0, 'REPLACE')
    base.modifiers.new("Fine", 'SUBSURF').levels = 1
    add_on_top(base)
    part = apply()
    found = weights(part, "All")
    assert sorted(found) == list(range(len(part.data.vertices)))
    assert np.allclose(list(found.values()), 1.0, atol=1e-5)


def test_blind_holes_leave_the_wall_closed() -> None:
    base = plate()
    pattern = add_on_top(base)
    pattern.bubble_pattern.depth_mode = 'BLIND'
    pattern.bubble_pattern.depth = 0.004
    part = apply()
    assert is_closed(part.data)
    assert euler(part.data) == 2
    assert len([f for f in part.data.polygons if abs(f.center.z - 0.001) < 1e-6]) > 0


def test_walls_are_of_quads_and_floors_are_whole() -> None:
    base = plate()
    pattern = add_on_top(base)
    pattern.bubble_pattern.depth_mode, pattern.bubble_pattern.depth = 'BLIND', 0.004
    part = apply()
    walls = wall_faces(part)
    corners = [len(face.vertices) for face in walls]
    assert set(corners) <= {4, 5}  # one more where an edge of the base's triangles meets the rim
    assert corners.count(4) > 0.95 * len(corners)
    floors = [face for face in part.data.polygons if abs(face.center.z - 0.001) < 1e-6]
    assert len(floors) == pattern.bubble_pattern.count
    assert sum(len(face.vertices) for face in floors) == len(walls)
    assert all(face.normal.z > 0.999 for face in floors)


def test_an_open_base_is_refused_and_nothing_is_left() -> None:
    base = plate()
    pattern = add_on_top(base)
    select_faces(base, lambda face: face.normal.z < -0.7)
    bpy.ops.mesh.delete(type='FACE')
    bpy.ops.object.mode_set(mode='OBJECT')
    objects, meshes = len(bpy.data.objects), len(bpy.data.meshes)
    with pytest.raises(RuntimeError, match="not a closed solid"):
        bpy.ops.bubble_pattern.apply()
    assert (len(bpy.data.objects), len(bpy.data.meshes)) == (objects, meshes)
    assert not base.hide_get()
    activate(pattern)
    assert bpy.ops.bubble_pattern.update() == {'FINISHED'}  # a preview is still possible


def test_a_changed_base_is_laid_anew_before_it_is_cut() -> None:
    base = plate()
    pattern = add_on_top(base)
    before = pattern.bubble_pattern.count
    for vertex in base.data.vertices:
        vertex.co.x *= 2
    base.data.update_tag()
    part = apply()
    assert pattern.bubble_pattern.count > 1.7 * before
    assert euler(part.data) == 2 - 2 * pattern.bubble_pattern.count


def test_features_deleted_by_hand_stay_away() -> None:
    base = plate()
    pattern = add_on_top(base)
    activate(pattern)
    bpy.ops.object.mode_set(mode='EDIT')
    bpy.ops.mesh.select_all(action='DESELECT')
    bpy.ops.object.mode_set(mode='OBJECT')
    for index in (0, 5, 9):
        pattern.data.vertices[index].select = True
    bpy.ops.object.mode_set(mode='EDIT')
    bpy.ops.mesh.delete(type='VERT')
    bpy.ops.object.mode_set(mode='OBJECT')
    part = apply()
    assert euler(part.data) == 2 - 2 * (pattern.bubble_pattern.count - 3)


def test_two_patterns_make_one_part() -> None:
    base = plate()
    first = add_on_top(base)
    select_faces(base, lambda face: face.normal.x > 0.7)
    bpy.ops.bubble_pattern.add()
    second = pattern_of(bpy.context.object)
    for pattern in (first, second):
        pattern.bubble_pattern.depth_mode = 'BLIND'
        pattern.bubble_pattern.depth = 0.0005
    part = apply()
    assert is_closed(part.data)
    assert first.bubble_pattern.part == second.bubble_pattern.part == part


def test_patterns_with_different_features_make_one_part() -> None:
    base = plate()
    first = add_on_top(base)
    select_faces(base, lambda face: face.normal.z < -0.7)
    bpy.ops.bubble_pattern.add()
    second = pattern_of(bpy.context.object)
    first.bubble_pattern.depth_mode = 'BLIND'
    first.bubble_pattern.depth = 0.0005
    second.bubble_pattern.kind = 'BUMP'
    second.bubble_pattern.height = 0.0006
    part = apply()
    assert is_closed(part.data)
    assert euler(part.data) == 2
    height = [vertex.co.z for vertex in part.data.vertices]
    assert (min(height), max(height)) == pytest.approx((-0.0056, 0.005), abs=1e-7)
    assert first.bubble_pattern.verdict == second.bubble_pattern.verdict == ""


def test_applying_again_replaces_the_part() -> None:
    pattern = add_on_top(plate())
    part = apply()
    objects, meshes = len(bpy.data.objects), len(bpy.data.meshes)
    bpy.ops.bubble_pattern.edit()
    pattern.bubble_pattern.pitch *= 2
    assert apply() == part
    assert (len(bpy.data.objects), len(bpy.data.meshes)) == (objects, meshes)
    assert euler(part.data) == 2 - 2 * pattern.bubble_pattern.count


def test_removing_leaves_the_base_as_it_was() -> None:
    base = plate()
    before = {attribute.name for attribute in base.data.attributes}
    add_on_top(base)
    apply()
    assert bpy.ops.bubble_pattern.remove() == {'FINISHED'}
    assert list(bpy.data.objects) == [base]
    assert list(bpy.data.meshes) == [base.data]
    assert not base.hide_get()
    assert not base.hide_render
    after = {attribute.name for attribute in base.data.attributes}
    assert {name for name in before ^ after if not name.startswith(".")} == set()


def test_removing_can_keep_the_part() -> None:
    base = plate()
    add_on_top(base)
    part = apply()
    bpy.ops.bubble_pattern.remove(keep_part=True)
    assert set(bpy.data.objects) == {base, part}
    assert base.hide_get()
    assert bpy.context.object == part


def test_undo_takes_apply_back_in_one_step() -> None:
    base = plate()
    add_on_top(base)
    bpy.ops.ed.undo_push(message="before")
    bpy.ops.bubble_pattern.apply()
    bpy.ops.ed.undo_push(message="Apply")
    bpy.ops.ed.undo()
    assert sorted(obj.name for obj in bpy.data.objects) == ["Plate", "Plate Pattern"]
    assert not bpy.data.objects["Plate"].hide_get()
    assert [mesh for mesh in bpy.data.meshes if "Part" in mesh.name] == []
