"""Polygons with holes: cut open and triangulated, many at once."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bubble_pattern_addon.core import triangulating
from bubble_pattern_addon.core.cycles import followed, ranges, unrolled
from bubble_pattern_addon.core.keyholes import Contours, opened
from bubble_pattern_addon.core.mesh import Floats, Ints
from bubble_pattern_addon.core.triangulating import triangulated

SQUARE = np.array([[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]])
# Two strips beside each other in one cell, the upper one with a tongue that hangs over the lower.
STRIPS = [
    np.array([[-0.5, -0.5], [0.5, -0.5], [0.5, -0.05], [-0.5, -0.05]]),
    np.array([[-0.5, 0.05], [0.5, 0.05], [0.5, 0.5], [-0.5, 0.5]]),
]


def ring(centre: Floats, radius: float, corners: int, turn: float = 0.0) -> Floats:
    """A hole: clockwise."""
    angle = turn - np.arange(corners) * (2 * np.pi / corners)
    return np.asarray(centre) + radius * np.stack([np.cos(angle), np.sin(angle)], axis=1)


def discs(rng: np.random.Generator, count: int, radius: float) -> list[Floats]:
    """Holes in the square that keep apart from each other, from its sides and the gap between the strips."""
    middles = np.zeros((0, 2))
    for at in rng.uniform(radius - 0.48, 0.48 - radius, (count, 2)):
        clear = not len(middles) or np.hypot(*(middles - at).T).min() > 2.1 * radius
        if clear and abs(at[1]) > 0.06 + radius:
            middles = np.append(middles, [at], axis=0)
    return [ring(at, radius * rng.uniform(0.3, 1), rng.integers(3, 20), rng.uniform(0, 6)) for at in middles]


def shoelace(points: Floats) -> float:
    x, y = points.T
    return float((x * np.roll(y, -1) - np.roll(x, -1) * y).sum())


def laid_out(rounds: list[Floats], holes: list[Floats], cell: list[int]) -> tuple[Floats, Ints, Ints, int]:
    contours = [*rounds, *holes]
    total = np.array([len(points) for points in contours])
    return np.concatenate(contours), total, np.array(cell), len(rounds)


def assert_triangulated(flat: Floats, total: Ints, cell: Ints, outer: int) -> None:
    triangles = triangulated(flat, total, cell, outer)
    assert triangles is not None
    holes = len(total) - outer
    assert len(triangles) == total.sum() - 2 * outer + 2 * holes
    areas = np.array([shoelace(flat[corners]) for corners in triangles])
    assert areas.min() > -1e-12
    start = np.cumsum(total) - total
    enclosed = sum(shoelace(flat[begin : begin + size]) for begin, size in zip(start, total, strict=True))
    assert areas.sum() == pytest.approx(enclosed, rel=1e-9)
    # every side of a contour is a side of one triangle, the others run both ways
    following = np.arange(1, len(flat) + 1)
    following[start + total - 1] = start
    sides = np.stack([triangles, np.roll(triangles, -1, axis=1)], axis=2).reshape(-1, 2)
    ways = {(int(a), int(b)) for a, b in sides}
    assert len(ways) == len(sides)
    rim = {(a, int(b)) for a, b in enumerate(following)}
    assert {(a, b) for a, b in ways if (b, a) not in ways} == rim


@settings(max_examples=60, deadline=None)
@given(
    seed=st.integers(0, 10_000),
    counts=st.lists(st.integers(0, 60), min_size=1, max_size=5),
    radius=st.floats(0.01, 0.2),
    strips=st.booleans(),
)
def test_triangles_cover_what_the_contours_enclose(seed, counts, radius, strips):
    rng = np.random.default_rng(seed)
    rounds, holes, cell_of_round, cell_of_hole = [], [], [], []
    for number, count in enumerate(counts):
        outlines = STRIPS if strips else [SQUARE]
        rounds += outlines
        cell_of_round += [number] * len(outlines)
        some = discs(rng, count, radius)
        holes += some
        cell_of_hole += [number] * len(some)
    assert_triangulated(*laid_out(rounds, holes, [*cell_of_round, *cell_of_hole]))


def test_holes_in_a_grid_are_joined_whatever_is_equally_near():
    line = np.linspace(-0.4, 0.4, 9)
    holes = [ring((x, y), 0.03, 8) for x in line for y in line]
    assert_triangulated(*laid_out([SQUARE], holes, [0] * 82))


def test_a_hole_that_is_in_the_way_of_a_cut_has_its_polygon_done_otherwise(monkeypatch):
    rng = np.random.default_rng(1)
    given = laid_out([SQUARE, SQUARE], [*discs(rng, 30, 0.06), ring((0, 0), 0.2, 12)], [0, 1, *[0] * 17, 1])
    count = len(given[1]) - 2
    given = given[0], given[1], np.array([0, 1, *[0] * (count - 1), 1]), 2
    whole = triangulating._triangles
    calls = []

    def crossed(laid: Floats, contours: Contours) -> Ints:
        calls.append(len(contours.total))
        found = whole(laid, contours)
        # the first time one triangle is missing
        return found[1:] if len(calls) == 1 else found

    monkeypatch.setattr(triangulating, "_triangles", crossed)
    assert_triangulated(*given)
    assert len(calls) == 2


def test_contours_that_cross_are_not_triangulated():
    bow = np.array([[-0.5, -0.5], [0.5, 0.5], [0.5, -0.5], [-0.4, 0.5]])
    assert triangulated(*laid_out([bow], [], [0])) is None


def test_nothing_is_triangulated_to_nothing():
    empty = np.zeros(0, dtype=np.int64)
    assert triangulated(np.zeros((0, 2)), empty, empty, 0).shape == (0, 3)


def test_an_opened_contour_goes_along_every_cut_twice():
    holes = [ring((-0.2, 0), 0.1, 5), ring((0.2, 0), 0.1, 6), ring((0.2, 0.3), 0.05, 7)]
    points, total, cell, outer = laid_out([SQUARE], holes, [0, 0, 0, 0])
    one = opened(points, Contours(np.arange(len(points)), total), cell, outer)
    assert one.total.tolist() == [len(points) + 6]
    assert set(one.vertex.tolist()) == set(range(len(points)))
    assert shoelace(points[one.vertex]) == pytest.approx(
        sum(shoelace(contour) for contour in [SQUARE, *holes])
    )


@given(st.lists(st.integers(1, 40), min_size=1, max_size=8), st.integers(0, 1000))
def test_ways_unrolled_are_the_ways_followed(total, seed):
    total = np.array(total)
    name = np.random.default_rng(seed).permutation(total.sum())
    start = np.cumsum(total) - total
    following = np.empty(total.sum(), dtype=np.int64)
    after = np.arange(1, total.sum() + 1)
    after[start + total - 1] = start
    following[name] = name[after]
    rows = unrolled(following, name[start], total)
    assert rows.tolist() == name.tolist() == followed(following, name[start], total).tolist()


def test_ranges_lie_end_to_end():
    assert ranges(np.array([5, 2, 9]), np.array([2, 0, 3])).tolist() == [5, 6, 9, 10, 11]
