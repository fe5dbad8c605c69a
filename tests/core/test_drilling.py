"""Straight holes drilled, against the boolean that they take the place of."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bubble_pattern_addon.core import solid, tracing, triangulating
from bubble_pattern_addon.core.closed import measure
from bubble_pattern_addon.core.drilling import Spans, drilled
from bubble_pattern_addon.core.mesh import Floats, Ints, Mesh
from bubble_pattern_addon.core.part import Cut
from bubble_pattern_addon.core.plan import Plan, plan_steps
from bubble_pattern_addon.core.progress import drive
from bubble_pattern_addon.core.recipe import Feature
from tests.core.bases import box, hexagons, laid, moved, slab, together

UP = np.array([0.0, 0.0, 1.0])
KINDS = [
    Feature(sides=24),
    Feature(sides=7, depth=0.6),
    Feature(profile="cross", aspect=0.4),
    Feature(profile="slot", depth=0.5),
    Feature(profile="polygon", corners=6, rounding=0.3),
    Feature(profile="curve", points=((1.0, 0.0), (0.2, 0.3), (-0.6, 0.9), (-0.5, -0.9), (0.3, -0.2))),
]


def planned(base: Mesh, position: Floats, normal: Floats, diameter: float, feature: Feature) -> Plan:
    return drive(plan_steps(base, laid(position, normal, 2 * diameter, diameter), feature))


def drill(plan: Plan) -> tuple[Cut, Ints]:
    """What drilling alone leaves, and the features it did."""
    columns, wall, seen = plan.columns, plan.wall, np.flatnonzero(plan.meets)
    row = np.full(len(plan.pattern), -1)
    row[columns.feature] = np.arange(len(columns))
    owner, triangle = row[wall.seen_feature[seen]], wall.seen_triangle[seen]
    left, done = drilled(
        plan.sound.mesh, columns, Spans(owner, triangle, wall.seen_low[seen], wall.seen_high[seen])
    )
    return left, columns.feature[done]


def boolean(plan: Plan) -> Cut:
    base = plan.sound.mesh
    return solid.combine(base, np.arange(len(base.triangles)), plan.cutters)


def spread(seed: int, count: int, reach: float, apart: float) -> Floats:
    """Up to `count` random places on a slab's top, no two nearer than `apart`, and the normals there."""
    rng = np.random.default_rng(seed)
    place = np.zeros((0, 2))
    for at in rng.uniform(-reach, reach, (count, 2)):
        if not len(place) or np.hypot(*(place - at).T).min() > apart:
            place = np.append(place, [at], axis=0)
    return place


def on_top(base: Mesh, place: Floats) -> tuple[Floats, Floats]:
    """Points of the faces of a slab's top that lie over `place`, (n, 2), and these faces' normals."""
    top = np.flatnonzero(base.area_vectors[:, 2] > 0)
    a, b, c = base.corners[top][:, None].swapaxes(0, 2)[:, :, :, :2].swapaxes(1, 2)

    def left(p: Floats, q: Floats) -> Floats:
        return (q - p)[..., 0] * (place - p)[..., 1] - (q - p)[..., 1] * (place - p)[..., 0]

    inside = np.minimum(np.minimum(left(a, b), left(b, c)), left(c, a)) >= 0
    face = top[inside.argmax(axis=0)]
    normal = base.area_vectors[face]
    fall = ((place - base.corners[face][:, 0, :2]) * normal[:, :2]).sum(axis=1)
    height = base.corners[face][:, 0, 2] - fall / normal[:, 2]
    return np.column_stack([place, height]), normal


def areas(cut: Cut, of: Ints, number: Ints, count: int) -> Floats:
    return np.bincount(number, np.linalg.norm(Mesh(cut.mesh.vertices, of).area_vectors, axis=1), count)


def assert_same(one: Cut, other: Cut, base: Mesh) -> None:
    """Both left the same of every face of the base, and as much wall and floor for every feature."""
    mine, theirs = measure(one.mesh), measure(other.mesh)
    assert mine.closed
    assert mine.euler == theirs.euler
    assert len(mine.volumes) == len(theirs.volumes)
    assert mine.volumes.sum() == pytest.approx(theirs.volumes.sum(), rel=1e-9)
    faces = len(base.triangles)
    left = [areas(cut, cut.surface, cut.face, faces) for cut in (one, other)]
    assert np.allclose(*left, atol=1e-9 * np.ptp(base.vertices) ** 2)
    count = int(max(cut.feature.max(initial=-1) for cut in (one, other))) + 1
    walls = [areas(cut, cut.walls, cut.feature[cut.facet], count) for cut in (one, other)]
    assert np.allclose(*walls, rtol=1e-9)


def assert_upright(cut: Cut, base: Mesh) -> None:
    """What is left of a face lies in its plane, the same way up, and inside it."""
    corners, face = cut.mesh.vertices[cut.surface], base.corners[cut.face]
    normal = base.area_vectors[cut.face]
    size = np.linalg.norm(normal, axis=1)
    normal = normal / size[:, None]
    pieces = np.einsum("ti,ti->t", Mesh(cut.mesh.vertices, cut.surface).area_vectors, normal)
    assert (pieces > -1e-9 * size).all()
    offset = corners - face[:, :1]
    assert np.abs(np.einsum("tci,ti->tc", offset, normal)).max() < 1e-9 * np.ptp(base.vertices)


@settings(max_examples=40, deadline=None)
@given(
    feature=st.sampled_from(KINDS),
    cells=st.integers(1, 40),
    seed=st.integers(0, 10_000),
    diameter=st.floats(0.3, 3.0),
    turn=st.floats(0, 6.3),
)
def test_drilling_leaves_what_the_boolean_leaves(feature, cells, seed, diameter, turn):
    base = slab(cells)
    position, normal = on_top(base, spread(seed, 40, 9, 1.6 * diameter))
    matrix = np.array([[np.cos(turn), -np.sin(turn), 0], [np.sin(turn), np.cos(turn), 0], [0, 0, 1]])
    base = moved(base, matrix)
    plan = planned(base, position @ matrix.T, normal @ matrix.T, diameter, feature)
    left = solid.cut(plan)
    assert_same(left, boolean(plan), plan.sound.mesh)
    assert_upright(left, plan.sound.mesh)
    # what is at random is in no doubt
    assert len(drill(plan)[1]) == len(plan.chosen)


@pytest.mark.parametrize("feature", KINDS)
def test_all_of_a_pattern_at_random_is_drilled(feature):
    base = slab(30)
    plan = planned(base, *on_top(base, spread(5, 200, 10, 1.3)), 1.2, feature)
    left, done = drill(plan)
    assert done.tolist() == plan.chosen.tolist()
    assert len(done) > 60
    assert_same(left, boolean(plan), base)


def test_a_corner_on_an_edge_is_left_to_the_boolean():
    base = box((-10, -10, -2), (10, 10, 0))
    # the diagonal of the top goes through the corners of the second
    place = np.array([[4.0, -3.0, 0.0], [2.0, 2.0, 0.0], [-2.0, 5.0, 0.0]])
    feature = Feature(sides=8)
    plan = planned(base, place, UP, 1.5, feature)
    diagonal = base.triangles[(np.abs(base.area_vectors[:, 2]) > 0) & (base.corners[..., 2].min(axis=1) == 0)]
    assert len(diagonal) == 2
    left, done = drill(plan)
    assert done.tolist() == [0, 2]
    assert measure(left.mesh).euler == -2
    whole = solid.cut(plan)
    assert_same(whole, boolean(plan), base)
    assert np.array_equal(np.unique(whole.feature[whole.facet]), [0, 1, 2])


def test_a_vertex_on_an_outline_is_left_to_the_boolean():
    base = slab(2)
    vertex = base.vertices[np.abs(base.vertices[:, :2]).sum(axis=1).argmin()]
    # a square with its sides along x and y, and the vertex in the middle of one of them
    half = 0.5 / np.sqrt(2)
    plan = planned(base, (vertex - [half, 0, 0])[None], UP, 1.0, Feature(sides=4, depth=0.2))
    eighth = np.array([[1, 1], [-1, 1]]) / np.sqrt(2)
    on = replace(plan.columns, outline=plan.columns.outline @ eighth)
    assert drill(replace(plan, columns=on))[1].tolist() == []
    beside = replace(on, centre=on.centre + [[1e-3, 2e-3, 0]])
    assert drill(replace(plan, columns=beside))[1].tolist() == [0]


def test_a_column_that_meets_more_than_its_wall_is_left_to_the_boolean():
    base = box((-10, -10, -2), (10, 10, 0))
    plan = planned(base, np.array([[4.0, -3.0, 0.0], [-2.0, 5.0, 0.0]]), UP, 1.5, Feature())
    lid = together(base, box((3, -4, 0.2), (5, -2, 0.4)))
    wall = plan.wall
    over = np.arange(len(base.triangles), len(lid.triangles))
    none = np.full(len(over), -0.1)
    seen = replace(
        wall,
        seen_feature=np.concatenate([wall.seen_feature, 0 * over]),
        seen_triangle=np.concatenate([wall.seen_triangle, over]),
        seen_low=np.concatenate([wall.seen_low, none]),
        seen_high=np.concatenate([wall.seen_high, none]),
        seen_axis=np.concatenate([wall.seen_axis, none]),
    )
    covered = replace(plan, wall=seen, sound=replace(plan.sound, mesh=lid))
    assert drill(covered)[1].tolist() == [1]


@pytest.mark.parametrize("end", ["top", "bottom"])
def test_a_column_that_ends_in_the_surface_is_left_to_the_boolean(end):
    base = slab(12)
    plan = planned(base, *on_top(base, spread(1, 6, 8, 4)), 2.0, Feature())
    short = getattr(plan.columns, end).copy()
    short[2] = 0.0 if end == "top" else 1.0
    done = drill(replace(plan, columns=replace(plan.columns, **{end: short})))[1]
    assert done.tolist() == np.delete(plan.chosen, 2).tolist()


def test_columns_that_overlap_are_left_to_the_boolean():
    base = slab(12)
    one, other = (
        planned(base, *on_top(base, np.array([at])), 2.0, Feature()) for at in ([0.3, 0.2], [1.0, 0.4])
    )
    pair = planned(base, *on_top(base, np.array([[0.3, 0.2], [5.0, 5.4]])), 2.0, Feature()).columns
    both = replace(
        pair,
        centre=np.concatenate([one.columns.centre, other.columns.centre]),
        frame=np.concatenate([one.columns.frame, other.columns.frame]),
    )
    met = [plan.wall.seen_triangle[plan.meets] for plan in (one, other)]
    owner = np.repeat([0, 1], [len(triangles) for triangles in met])
    level = np.zeros(len(owner))
    for number, triangles in enumerate(met):
        mine = np.full(len(triangles), number)
        left, done = drilled(base, both, Spans(mine, triangles, 0.0 * mine, 0.0 * mine))
        assert done.tolist() == [number]
    left, done = drilled(base, both, Spans(owner, np.concatenate(met), level, level))
    assert done.tolist() == []
    assert left.mesh is base


def test_a_triangulation_that_does_not_cover_its_face_is_not_taken(monkeypatch):
    plan = planned(slab(12), *on_top(slab(12), spread(3, 9, 8, 4)), 2.0, Feature())
    whole = triangulating.manifold3d.triangulate
    monkeypatch.setattr(triangulating.manifold3d, "triangulate", lambda polygons: whole(polygons)[1:])
    assert len(drill(plan)[1]) == 0
    assert_same(solid.cut(plan), boolean(plan), plan.sound.mesh)


def test_holes_by_the_hundred_in_the_two_triangles_of_a_plate():
    base = box((-20, -20, -2), (20, 20, 0))
    place = hexagons(40, 40, 2.9) + [0.013, 0.029, 0]
    plan = planned(base, place, UP, 2.0, Feature())
    left, done = drill(plan)
    assert len(done) == len(place) > 150
    assert_same(left, boolean(plan), base)


@pytest.mark.parametrize("together", [1, 100])
def test_how_many_are_worked_on_together_changes_nothing(monkeypatch, together):
    base = slab(20)
    plan = planned(base, *on_top(base, spread(2, 60, 9, 2)), 1.5, Feature(sides=16))
    whole = solid.cut(plan)
    monkeypatch.setattr(tracing, "TOGETHER", together)
    parts = solid.cut(plan)
    assert np.array_equal(whole.mesh.vertices, parts.mesh.vertices)
    assert np.array_equal(whole.mesh.triangles, parts.mesh.triangles)
    assert np.array_equal(whole.facet, parts.facet)


def test_walls_are_numbered_by_the_side_they_are_of():
    base = slab(20)
    plan = planned(base, *on_top(base, spread(2, 30, 9, 3)), 2.0, Feature(sides=16, depth=0.5))
    left = drill(plan)[0]
    columns = plan.columns
    flat = np.bincount(left.facet, minlength=len(left.feature))
    assert (flat[columns.side_facet] >= 2).all()
    assert (flat[columns.floor_facet] == 14).all()
    normal = Mesh(left.mesh.vertices, left.walls).area_vectors
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    middle = left.mesh.vertices[left.walls].mean(axis=1)
    owner = np.searchsorted(columns.feature, left.feature[left.facet])
    inward = columns.centre[owner] - middle
    axis = columns.frame[owner, 2]
    inward -= np.einsum("ti,ti->t", inward, axis)[:, None] * axis
    on_floor = np.isin(left.facet, columns.floor_facet)
    assert (np.einsum("ti,ti->t", inward, normal)[~on_floor] > 0.9).all()
    assert np.allclose(normal[on_floor], axis[on_floor])
