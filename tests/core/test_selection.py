"""Choosing the target region: by a point, by a name, or the whole base."""

import numpy as np
import pytest
import trimesh
from hypothesis import given
from hypothesis import strategies as st

from bubble_pattern_addon.core.errors import RecipeError, RegionError
from bubble_pattern_addon.core.mesh import Mesh
from bubble_pattern_addon.core.recipe import RegionChoice
from bubble_pattern_addon.core.selection import grown, nearest_triangle, neighbour_pairs, select, sub_regions

from .bases import as_mesh

BOX = as_mesh(trimesh.creation.box((2, 4, 6)))
DRUM = as_mesh(trimesh.creation.cylinder(radius=5, height=4, sections=36))


def unwelded(mesh: Mesh) -> Mesh:
    return Mesh(mesh.corners.reshape(-1, 3), np.arange(3 * len(mesh.triangles)).reshape(-1, 3))


@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize("side", [-1, 1])
def test_a_point_by_a_box_takes_that_side_only(axis: int, side: int) -> None:
    point = np.zeros(3)
    point[axis] = side * 10
    selected = select(BOX, RegionChoice(near=tuple(point)))
    normals = BOX.area_vectors[selected]
    assert selected.sum() == 2
    assert (side * normals[:, axis] > 0).all()


def test_growing_stops_at_edges_sharper_than_the_angle() -> None:
    wall = select(DRUM, RegionChoice(near=(5, 0, 0), max_angle=20))
    assert wall.sum() == 72  # 36 facets of 10 degrees each
    facet = select(DRUM, RegionChoice(near=(5, 0.1, 0), max_angle=9))
    assert facet.sum() == 2
    assert select(DRUM, RegionChoice(near=(5, 0, 0), max_angle=90)).all()


def test_growing_goes_by_position_where_a_file_shares_no_vertices() -> None:
    assert (
        select(unwelded(DRUM), RegionChoice(near=(5, 0, 0))) == select(DRUM, RegionChoice(near=(5, 0, 0)))
    ).all()


def test_an_edge_of_three_triangles_is_not_crossed() -> None:
    vertices = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1.0]])
    fan = Mesh(vertices, np.array([[0, 1, 2], [1, 0, 3], [0, 1, 4]]))
    assert len(neighbour_pairs(fan)) == 0
    assert grown(fan, 0, 180).sum() == 1


def test_triangles_without_area_or_numbers_are_never_the_nearest() -> None:
    vertices = np.array([[0, 0, 0], [0, 0, 0], [0, 0, 0], [9, 0, 0], [10, 0, 0], [9, 1, 0], [np.nan, 0, 0]])
    mesh = Mesh(vertices, np.array([[0, 1, 2], [3, 4, 5], [6, 4, 5]]))
    assert nearest_triangle(mesh, np.zeros(3)) == 1
    with pytest.raises(RegionError, match="no face with an area"):
        nearest_triangle(Mesh(vertices, mesh.triangles[:1]), np.zeros(3))


GRID = np.array([[i, j, 40 - i - j] for i in range(41) for j in range(41 - i)]) / 40
SAMPLES = np.einsum("gk,tkx->tgx", GRID, DRUM.corners)


@given(st.tuples(*[st.floats(-20, 20)] * 3))
def test_the_nearest_triangle_is_the_nearest_by_dense_sampling(point: tuple[float, float, float]) -> None:
    sampled = np.linalg.norm(SAMPLES - point, axis=2).min(axis=1)
    chosen = nearest_triangle(DRUM, np.array(point))
    assert sampled[chosen] <= sampled.min() + 0.2  # spacing of the samples on the largest triangle


def test_names_mean_the_faces_that_carry_them() -> None:
    mask = np.arange(len(BOX.triangles)) < 2
    names = {"Grille": mask, "Body": ~mask, "Unused": np.zeros_like(mask)}
    assert (select(BOX, RegionChoice(material="Grille"), materials=names) == mask).all()
    assert (select(BOX, RegionChoice(attribute="Body"), attributes=names) == ~mask).all()
    assert select(BOX, RegionChoice(all=True)).all()
    with pytest.raises(RegionError, match='no material "Gril": did you mean "Grille"'):
        select(BOX, RegionChoice(material="Gril"), materials=names)
    with pytest.raises(RegionError, match='it has "Body", "Grille", "Unused"'):
        select(BOX, RegionChoice(attribute="xyzzy"), attributes=names)
    with pytest.raises(RegionError, match="it has none"):
        select(BOX, RegionChoice(attribute="bubble_region"), materials=names)
    with pytest.raises(RegionError, match='empty: no face has the material "Unused"'):
        select(BOX, RegionChoice(material="Unused"), materials=names)
    with pytest.raises(RecipeError, match="chooses no faces"):
        select(BOX, RegionChoice())
    with pytest.raises(RegionError, match="the base has no faces"):
        select(Mesh(BOX.vertices, BOX.triangles[:0]), RegionChoice(all=True))


def test_sub_regions_are_numbered_in_their_order_and_the_first_has_what_two_share():
    masks = {"Centre": np.array([True, True, False, False]), "Rim": np.array([False, True, True, False])}
    choice = RegionChoice(all=True, parts=("Rim", "Centre"))
    assert sub_regions(choice, {"Centre": masks["Centre"]}, {"Rim": masks["Rim"]}).tolist() == [2, 1, 1, 0]
    assert sub_regions(RegionChoice(all=True)) is None
    with pytest.raises(RegionError, match='did you mean "Centre"'):
        sub_regions(RegionChoice(all=True, parts=("Center",)), masks)
