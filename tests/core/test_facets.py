"""Triangles of facets joined to faces with many corners."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from bubble_pattern_addon.core.facets import Faces, joined_faces
from bubble_pattern_addon.core.ranking import ranked
from tests.core.bases import grid


def outlines(faces: Faces) -> list[list[int]]:
    """The corners of each face."""
    return [part.tolist() for part in np.split(faces.corner, np.cumsum(faces.total)[:-1])]


def directed(corners: list[int]) -> set[tuple[int, int]]:
    return set(zip(corners, corners[1:] + corners[:1], strict=True))


def rim_of(triangles: np.ndarray) -> list[tuple[int, int]]:
    """Edges that lead round these triangles."""
    sides = set().union(*(directed(list(map(int, corners))) for corners in triangles))
    return [side for side in sides if side[::-1] not in sides]


def one_face(triangles: np.ndarray) -> bool:
    """Is all that hangs together here a disc, with every vertex once on its rim?"""
    rim = dict(rim_of(triangles))
    if len(rim) != len(rim_of(triangles)) or set(rim) != set(triangles.ravel().tolist()):
        return False
    start = at = next(iter(rim))
    for passed in range(1, len(rim) + 1):
        at = rim[at]
        if at == start:
            return passed == len(rim)
    return False


@given(st.integers(1, 4), st.integers(1, 4), st.data())
def test_a_facet_is_one_face_if_it_can_be(rows: int, columns: int, data: st.DataObject) -> None:
    triangles = grid(rows, columns)
    labels = st.lists(st.integers(0, 3), min_size=len(triangles), max_size=len(triangles))
    facet = np.array(data.draw(labels))
    faces = joined_faces(triangles, facet)
    assert len(faces.corner) == faces.total.sum()
    found = outlines(faces)
    for number in np.unique(facet):
        own = triangles[facet == number]
        mine = [corners for corners, of in zip(found, facet[faces.triangle], strict=True) if of == number]
        if one_face(own):
            (corners,) = mine
            assert len(set(corners)) == len(corners)
            assert directed(corners) == set(rim_of(own))
        else:
            assert sorted(map(sorted, mine)) == sorted(map(sorted, own.tolist()))


def test_two_triangles_that_share_nothing_stay() -> None:
    faces = joined_faces(np.array([[0, 1, 2], [3, 4, 5]]), np.array([7, 7]))
    assert faces.total.tolist() == [3, 3]


def test_no_triangles_are_no_faces() -> None:
    faces = joined_faces(np.zeros((0, 3), dtype=np.int64), np.zeros(0, dtype=np.int64))
    assert len(faces.corner) == len(faces.total) == len(faces.triangle) == 0


@given(st.lists(st.integers(0, 9), max_size=30), st.sampled_from([4, 63]))
def test_ranked_keys_know_their_places(keys: list[int], bits: int) -> None:
    key, place = ranked(np.array(keys, dtype=np.int64), bits)
    assert key.tolist() == sorted(keys)
    assert place.tolist() == sorted(range(len(keys)), key=lambda at: (keys[at], at))
