"""The edges we find are those Blender finds."""

from __future__ import annotations

import bpy
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bubble_pattern_addon.blender.attributes import CORNER_EDGE, CORNER_VERTEX, read_named, read_values
from bubble_pattern_addon.blender.part_edges import find_edges


@pytest.mark.parametrize("closed", [True, False])
def test_edges_of_triangles_quads_and_n_gons(closed: bool) -> None:
    bpy.ops.mesh.primitive_cylinder_add(vertices=7, end_fill_type='NGON' if closed else 'NOTHING')
    bpy.ops.mesh.primitive_ico_sphere_add()
    bpy.ops.object.select_all(action='SELECT')
    bpy.ops.object.join()
    mesh = bpy.context.object.data
    start = read_values(mesh.polygons, "loop_start", np.int32).astype(np.int64)
    total = read_values(mesh.polygons, "loop_total", np.int32).astype(np.int64)
    edges = find_edges(read_named(mesh, CORNER_VERTEX, len(mesh.loops)).astype(np.int64), start, total)
    theirs = np.sort(np.array([edge.vertices for edge in mesh.edges]), axis=1)
    assert set(map(tuple, edges.ends.tolist())) == set(map(tuple, theirs.tolist()))
    assert len(edges.ends) == len(theirs)
    assert np.array_equal(edges.ends[edges.of_corner], theirs[read_named(mesh, CORNER_EDGE, len(mesh.loops))])
    corners = np.arange(len(mesh.loops))
    for number in range(len(edges.ends)):
        own = corners[edges.of_corner == number]
        assert (edges.first[number], edges.last[number]) == (own.min(), own.max())
    assert bool((edges.first == edges.last).any()) != closed


def test_no_faces_have_no_edges() -> None:
    none = np.zeros(0, dtype=np.int64)
    assert len(find_edges(none, none, none).ends) == 0


FACES = st.lists(st.lists(st.integers(0, 7), min_size=3, max_size=5, unique=True), max_size=12)


@given(FACES, st.sampled_from([1, 2**28]))
def test_edges_are_those_of_a_table(faces: list[list[int]], apart: int) -> None:
    """Of any faces, also with one or three of them at an edge, and of vertices too many to be sorted with
    their places.
    """
    total = np.array([len(face) for face in faces], dtype=np.int64)
    vertex = np.array([apart * corner for face in faces for corner in face], dtype=np.int64)
    table: dict[tuple[int, int], list[int]] = {}
    corner = 0
    for face in faces:
        for one, two in zip(face, face[1:] + face[:1], strict=True):
            table.setdefault((apart * min(one, two), apart * max(one, two)), []).append(corner)
            corner += 1
    edges = find_edges(vertex, np.cumsum(total) - total, total)
    assert list(map(tuple, edges.ends.tolist())) == sorted(table)
    for number, ends in enumerate(sorted(table)):
        own = table[ends]
        assert (edges.first[number], edges.last[number]) == (own[0], own[-1])
        assert set(edges.of_corner[own].tolist()) == {number}
