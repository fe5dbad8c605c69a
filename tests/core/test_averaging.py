"""Diameters from seeds: Eq. 4 of the paper, iterated and solved."""

from __future__ import annotations

import time

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bubble_pattern_addon.core.averaging import averaged, weight_matrix
from bubble_pattern_addon.core.errors import RecipeError
from bubble_pattern_addon.core.links import TOUCHING, Links, links_of
from bubble_pattern_addon.core.mesh import Floats
from bubble_pattern_addon.core.metric import Constant
from bubble_pattern_addon.core.pattern import Pattern
from bubble_pattern_addon.core.pipeline import pattern_steps
from bubble_pattern_addon.core.progress import drive
from bubble_pattern_addon.core.recipe import Packing, Recipe, Seed, Shaping
from bubble_pattern_addon.core.region import Region, make_region
from scripts.shapes import SHAPES


def lay(name: str, pitch: float, shaping: Shaping) -> tuple[Region, Pattern]:
    shape = SHAPES[name]()
    region = make_region(shape.mesh, shape.selected)
    return region, drive(
        pattern_steps(region, Recipe(packing=Packing(pitch=Constant(pitch)), shaping=shaping))
    )


REGION, PLAIN = lay("trapezoid", 3.0, Shaping())
LINKS = links_of(PLAIN, REGION)


def sizes(shaping: Shaping, base: float = 1.8, links: Links = LINKS) -> Floats:
    start = np.full(len(PLAIN), base)
    return averaged(shaping, start, links, PLAIN.position, PLAIN.pitch)[0]


def seeds_at(rows: list[int], diameters: list[float]) -> tuple[Seed, ...]:
    at = PLAIN.position[rows].tolist()
    return tuple(Seed(tuple(point), size) for point, size in zip(at, diameters, strict=True))


THREE = seeds_at([5, 400, 800], [1.0, 2.6, 1.4])


def test_the_weights_are_those_of_the_formula() -> None:
    weights = weight_matrix(LINKS, len(PLAIN)).toarray()
    assert np.allclose(weights.sum(axis=1), 1)
    for row in (0, 100, 500):
        near = np.flatnonzero(weights[row])
        distance = np.linalg.norm(PLAIN.position[near] - PLAIN.position[row], axis=1)
        expected = 1 - distance / (TOUCHING * 3.0)
        assert (expected > 0).all()  # the outermost neighbour has its say
        assert np.allclose(weights[row, near], expected / expected.sum())
        assert near.tolist() == [
            n for n in range(len(PLAIN))
            if n != row and np.linalg.norm(PLAIN.position[n] - PLAIN.position[row]) < TOUCHING * 3.0
        ]  # fmt: skip


def test_every_free_feature_is_the_average_of_its_neighbours_and_seeds_stay() -> None:
    found = sizes(Shaping(seeds=THREE))
    assert found[[5, 400, 800]].tolist() == [1.0, 2.6, 1.4]
    free = np.setdiff1d(np.arange(len(PLAIN)), [5, 400, 800])
    assert np.allclose((weight_matrix(LINKS, len(PLAIN)) @ found)[free], found[free])
    assert ((found >= 1.0) & (found <= 2.6)).all()
    assert np.ptp(found[free]) > 0.5


def test_the_iteration_comes_to_the_direct_solution() -> None:
    direct = sizes(Shaping(seeds=THREE))
    iterated = sizes(Shaping(seeds=THREE, solver="iterate", tolerance=1e-12, iterations=200_000))
    assert np.allclose(iterated, direct, rtol=1e-7)
    # at the default tolerance it stops a little before
    assert np.allclose(sizes(Shaping(seeds=THREE, solver="iterate")), direct, rtol=0.05)


def test_the_iteration_ends_at_its_limit() -> None:
    once = sizes(Shaping(seeds=THREE, solver="iterate", iterations=1))
    start = np.full(len(PLAIN), 1.8)
    start[[5, 400, 800]] = 1.0, 2.6, 1.4
    expected = weight_matrix(LINKS, len(PLAIN)) @ start
    expected[[5, 400, 800]] = 1.0, 2.6, 1.4
    assert np.allclose(once, expected)


@given(
    st.lists(
        st.tuples(st.integers(0, 900), st.floats(0.5, 2.9)), min_size=1, max_size=6, unique_by=lambda s: s[0]
    )
)
@settings(max_examples=20, derandomize=True, deadline=None)
def test_no_average_leaves_the_range_of_the_seeds(seeds: list[tuple[int, float]]) -> None:
    rows, diameters = zip(*seeds, strict=True)
    found = sizes(Shaping(seeds=seeds_at([*rows], [*diameters])))
    assert found.min() >= min(diameters) - 1e-9
    assert found.max() <= max(diameters) + 1e-9


def test_a_seed_fixes_the_feature_nearest_to_it() -> None:
    x, y, z = PLAIN.position[400]
    assert sizes(Shaping(seeds=(Seed((x + 0.9, y - 0.5, z + 0.4), 2.2),)))[400] == 2.2


def test_one_seed_alone_gives_its_size_to_all() -> None:
    assert np.allclose(sizes(Shaping(seeds=seeds_at([0], [2.2]))), 2.2)


def test_parts_that_no_seed_reaches_keep_the_diameter_and_it_is_told() -> None:
    _, plain = lay("parts", 3.0, Shaping(Constant(1.5)))
    at = tuple(plain.position[0])
    region, pattern = lay("parts", 3.0, Shaping(Constant(1.5), seeds=(Seed(at, 2.0),)))
    sheet = region.sheet[np.searchsorted(region.triangles, pattern.places.triangle)]
    seeded = sheet == sheet[0]
    assert 0 < seeded.sum() < len(pattern)
    assert np.allclose(pattern.wished[seeded], 2.0)
    assert (pattern.wished[~seeded] == 1.5).all()
    assert pattern.notes == (
        f"{(~seeded).sum()} features are linked to no seed and as large as without seeds.",
    )


def test_a_seed_off_the_pattern_and_two_on_one_feature_are_refused() -> None:
    with pytest.raises(RecipeError, match=r"seed 2 is .* away from the nearest feature"):
        sizes(Shaping(seeds=(*seeds_at([3], [2.0]), Seed((0.0, 0.0, 50.0), 2.0))))
    x, y, z = PLAIN.position[3]
    with pytest.raises(RecipeError, match="seeds 1 and 3 fix the same feature"):
        sizes(Shaping(seeds=(*seeds_at([3, 9], [2.0, 1.0]), Seed((x + 0.1, y, z), 1.0))))


def test_thousands_of_features_take_well_under_a_second() -> None:
    shape = SHAPES["trapezoid"]()
    region = make_region(shape.mesh, shape.selected)
    recipe = Recipe(packing=Packing(pitch=Constant(1.0), iterations=2), shaping=Shaping(Constant(0.5)))
    pattern = drive(pattern_steps(region, recipe))
    assert len(pattern) > 7000
    links = links_of(pattern, region)
    seeds = tuple(Seed(tuple(pattern.position[row]), 0.3 + row / 20_000) for row in range(0, 7000, 1000))
    start = time.process_time()
    averaged(Shaping(seeds=seeds), np.full(len(pattern), 0.5), links, pattern.position, pattern.pitch)
    assert time.process_time() - start < 1.0


def test_the_order_of_the_links_does_not_matter() -> None:
    turned = Links(LINKS.second[::-1], LINKS.first[::-1], LINKS.distance[::-1], LINKS.reach[::-1])
    assert np.allclose(sizes(Shaping(seeds=THREE)), sizes(Shaping(seeds=THREE), links=turned))
