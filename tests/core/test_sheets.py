"""Sheets are found where a surface cannot pass through itself, and nowhere else."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from bubble_pattern_addon.core.boxtree import build_tree, close_pairs
from bubble_pattern_addon.core.closed import opposites
from bubble_pattern_addon.core.crossings import crossing_triangles
from bubble_pattern_addon.core.mesh import Floats, Ints, Mesh
from bubble_pattern_addon.core.sheets import sheets
from scripts.shapes import fine_sheet, rectangle_outline
from scripts.shapes import slab as thickened
from tests.core.bases import box, moved, slab, together


def sheets_of(mesh: Mesh) -> Ints:
    opposite = opposites(mesh.triangles)
    assert opposite is not None
    return sheets(mesh, (opposite % len(mesh.triangles)).reshape(3, -1))


def crossings(mesh: Mesh, sheet: Ints) -> set[tuple[int, int]]:
    pairs = crossing_triangles(mesh, mesh.columns, build_tree(mesh.columns), sheet)
    return {(min(pair), max(pair)) for pair in pairs.tolist()}


def assert_sheets_hide_nothing(mesh: Mesh) -> None:
    """No pair within a sheet reaches through itself: all crossings are found without those pairs."""
    everything = crossings(mesh, np.full(len(mesh.triangles), -1))
    sheet = sheets_of(mesh)
    assert crossings(mesh, sheet) == everything
    assert all(sheet[a] < 0 or sheet[a] != sheet[b] for a, b in everything)


def test_a_slab_has_a_sheet_for_every_side():
    base = slab()
    sheet = sheets_of(base)
    assert sheet.min() >= 0
    assert len(np.unique(sheet)) == 6
    assert len(np.unique(sheet[:288])) == 1


@pytest.mark.parametrize("turn", [(0, 0, 0), (45, 0, 0), (0, 45, 0), (0, 0, 45), (45, 45, 45), (30, 0, 60)])
def test_flat_faces_are_one_sheet_each_however_they_lie(turn):
    sheet = fine_sheet(rectangle_outline(8.0, 5.0), 0.4)
    base = moved(thickened(sheet, 1.0), Rotation.from_euler("xyz", turn, degrees=True).as_matrix())
    found = sheets_of(base)
    assert found.min() >= 0
    assert len(np.unique(found)) == 6


def steps(turns: float, width: float, rise: float, thickness: float) -> Mesh:
    """A winding stair with a smooth tread, thickened: over its middle there are as many layers as turns."""
    count = int(turns * 24)
    angle = np.linspace(0, turns * 2 * np.pi, count + 1)
    ring = [
        np.stack([r * np.cos(angle), r * np.sin(angle), rise * angle / (2 * np.pi) - down], axis=1)
        for down in (0, thickness)
        for r in (2.0, 2.0 + width)
    ]
    low, high = np.arange(count), np.arange(1, count + 1)
    inner, outer, under, far = (k * (count + 1) for k in range(4))

    def strip(a: int, b: int) -> Ints:
        one = np.stack([a + low, b + low, b + high], axis=1)
        return np.concatenate([one, np.stack([a + low, b + high, a + high], axis=1)])

    ends = [[inner, under, far], [inner, far, outer]]
    tops = [[inner + count, outer + count, far + count], [inner + count, far + count, under + count]]
    faces = [strip(inner, outer), strip(outer, far), strip(far, under), strip(under, inner), ends, tops]
    return Mesh(np.concatenate(ring), np.concatenate(faces))


@pytest.mark.parametrize(("rise", "crossing"), [(1.0, False), (0.0, True), (0.2, True)])
def test_a_winding_stair_is_no_sheet_where_it_comes_to_lie_over_itself(rise, crossing):
    base = steps(1.5, 1.0, rise, 0.5)
    tread = np.arange(2 * 36)
    assert (sheets_of(base)[tread] < 0).all()
    assert bool(crossings(base, sheets_of(base))) == crossing
    assert_sheets_hide_nothing(base)
    assert (sheets_of(steps(0.9, 1.0, rise, 0.5))[: 2 * int(0.9 * 24)] >= 0).all()


def test_bodies_in_one_another_are_found_though_each_is_all_sheets():
    inside = together(box((0, 0, 0), (4, 4, 4)), box((1, 1, 3), (2, 2, 6)))
    assert sheets_of(inside).min() >= 0
    assert len(crossings(inside, sheets_of(inside))) > 0
    assert_sheets_hide_nothing(inside)


def bent(mesh: Mesh, shift: Floats, reach: float) -> Mesh:
    """`mesh` with a lump of it drawn along `shift`."""
    middle = mesh.vertices[len(mesh.vertices) // 4]
    near = np.exp(-((np.linalg.norm(mesh.vertices - middle, axis=1) / reach) ** 2))
    return Mesh(mesh.vertices + near[:, None] * shift, mesh.triangles)


@settings(max_examples=60)
@given(
    shift=st.tuples(*[st.floats(-9, 9)] * 3),
    reach=st.floats(0.5, 8),
    noise=st.floats(0, 1.0),
    seed=st.integers(0, 99),
)
def test_whatever_passes_through_itself_is_found_with_sheets_as_without(shift, reach, noise, seed):
    base = bent(slab(8), np.array(shift), reach)
    astray = np.random.default_rng(seed).normal(size=base.vertices.shape)
    assert_sheets_hide_nothing(Mesh(base.vertices + noise * astray, base.triangles))


@given(seed=st.integers(0, 99), groups=st.integers(1, 5))
def test_close_pairs_leave_out_those_within_a_group_and_no_others(seed, groups):
    random = np.random.default_rng(seed)
    columns = random.uniform(0, 3, (3, 1, 40)) + random.uniform(0, 1, (3, 3, 40))
    group = random.integers(-1, groups, 40)
    tree = build_tree(columns)

    def found(*given: Ints) -> set[frozenset[int]]:
        pairs = [(a, b) for block in close_pairs(tree, *given) for a, b in zip(*block, strict=True)]
        assert len({frozenset(pair) for pair in pairs}) == len(pairs)
        return {frozenset((int(a), int(b))) for a, b in pairs}

    low, high = columns.min(axis=1).T, columns.max(axis=1).T
    meet = np.all((low[:, None] <= high) & (low <= high[:, None]), axis=2)
    everything = {frozenset((a, b)) for a, b in np.argwhere(meet).tolist() if a < b}
    assert found() == everything
    apart = {pair for pair in everything if len(set(group[list(pair)])) > 1 or group[min(pair)] < 0}
    assert found(group) == apart
