"""A smooth field of row directions over surfaces without a boundary.

A direction carried along from one seed comes back turned round every piece of curvature, and a lattice
grown by it meets itself in long seams. A field that is smooth everywhere gathers the misfit in a few
points (12 on a sphere) that keep away from one another; the lattice grown along it has its defects
there. Found by diffusing and normalising in turn, which lowers the Ginzburg-Landau energy (Viertel and
Osting, "An Approach to Quad Meshing Based on Harmonic Cross-Valued Maps and the Ginzburg-Landau Theory",
2019, with six directions for 4).
"""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_array, csr_array, diags_array

from ..mesh import Bools, Floats, Ints
from ..surface import Charts, Complex, product
from .symmetric_field import Alike, most_alike, on_patches

# Diffusion per round as a share of the area, and rounds of it.
SPREAD, ROUNDS = 0.001, 14
# Patches of triangles that are enough for that; on finer ones values are so often evened with those beside.
ENOUGH = 1200
EVENINGS = 3
# A round is solved to this share of its right side, in at most so many steps.
NEARLY = 0.05
MOST_STEPS = 200


def smooth_directions(charts: Charts, chosen: Bools, alike: Alike | None = None) -> Complex:
    """Sixth powers of unit row directions in the frames of the triangles, (R,); 0 where not `chosen` (R,).

    chosen: triangles of whole connected parts without a boundary; alike: makes such values (R,) what they
    shall stay, such as symmetric
    """
    region = charts.region
    members = np.flatnonzero(chosen)
    area = np.linalg.norm(region.area_vectors[members], axis=1)
    share = area / np.bincount(region.sheet[members], area)[region.sheet[members]]
    # Far misfits meet as well between patches of triangles, which are few; the triangles finish it.
    levels, coarse = [], _laplacian(charts, members)
    while coarse.shape[0] > ENOUGH:
        patch, turn = _patches(coarse)
        levels.append((coarse, patch, turn))
        coarse, share = _merged(coarse, patch, turn), np.bincount(patch, share)
    # The frames' own directions, which are at odds: from a smooth start, such as one direction of space seen
    # on the surface, the misfits that belong to it never part.
    value = _diffused(coarse, share, np.ones(coarse.shape[0], dtype=np.complex128))
    if alike is not None:
        kept = on_patches(alike, members, len(chosen), [(patch, turn) for _, patch, turn in levels])
        value = _diffused(coarse, share, most_alike(kept, value), kept)
    for finer, patch, turn in reversed(levels):
        value = _evened(finer, product(value[patch], turn))
    result = np.zeros(len(chosen), dtype=np.complex128)
    result[members] = value
    if alike is not None:
        result = alike(result)
        result[members] /= np.maximum(np.abs(result[members]), 1e-300)
    return result


def _laplacian(charts: Charts, members: Ints) -> csr_array:
    """How much the value of each of the n triangles `members` differs from those beside it, (n, n)."""
    corners, n = charts.region.corners, len(members)
    beyond = charts.region.neighbours[members]
    place = np.full(len(corners), -1, dtype=np.int32)
    place[members] = np.arange(n)
    edges = np.roll(charts.corners[members], -2, axis=1) - np.roll(charts.corners[members], -1, axis=1)
    middle = (corners[:, 0] + corners[:, 1] + corners[:, 2]) / 3
    across = middle[members, None] - middle[beyond]
    weight = np.abs(edges) / np.sqrt(np.einsum("nkc,nkc->nk", across, across))
    # A neighbour's value is turned into the triangle's own frame.
    back = charts.turns[members].conj().ravel()
    cube = product(product(back, back), back)
    column = np.concatenate([np.arange(n, dtype=np.int32)[:, None], place[beyond]], axis=1)
    link = np.concatenate([weight.sum(axis=1)[:, None], -weight * product(cube, cube).reshape(n, 3)], axis=1)
    return csr_array((link.ravel(), column.ravel(), 4 * np.arange(n + 1)), shape=(n, n))


def _patches(laplacian: csr_array) -> tuple[Ints, Complex]:
    """The larger patch (n,) that each of n patches is a part of, and the turn (n,) that brings its value into
    the small one's own frame.

    Every patch that ranks above all beside it leads one; the others follow the leader they have most in
    common with, or else one that somebody beside them follows.
    """
    n = laplacian.shape[0]
    row, number = np.repeat(np.arange(n), np.diff(laplacian.indptr)), np.arange(n)
    column, link = laplacian.indices, laplacian.data
    beside = row != column
    row, column, link = row[beside], column[beside], link[beside]
    # An even scatter: leaders stand apart, and none has a long queue behind it.
    rank = np.modf(number * 0.6180339887)[0]
    begins = np.flatnonzero(np.append(True, np.diff(row) != 0)[: len(row)])
    highest = np.full(n, -1.0)
    highest[row[begins]] = np.maximum.reduceat(rank[column], begins) if len(row) else rank
    leader = np.where(rank > highest, number, -1)
    turn = np.ones(n, dtype=np.complex128)
    for _ in range(2):
        may = (leader[row] < 0) & (leader[column] >= 0)
        follower, ahead, common = row[may], column[may], link[may]
        order = np.lexsort((-np.abs(common), follower))
        best = order[np.append(True, np.diff(follower[order]) != 0)[: len(order)]]
        follower, ahead, common = follower[best], ahead[best], common[best]
        turn[follower] = product(-common / np.abs(common), turn[ahead])
        leader[follower] = leader[ahead]
    leader = np.where(leader < 0, number, leader)
    place = np.cumsum(leader == number) - 1
    return place[leader], turn


def _merged(laplacian: csr_array, patch: Ints, turn: Complex) -> csr_array:
    """The Laplacian of larger patches, as their parts' links add up to."""
    row, column = np.repeat(np.arange(len(patch)), np.diff(laplacian.indptr)), laplacian.indices
    link = product(product(laplacian.data, turn.conj()[row]), turn[column])
    n = int(patch.max()) + 1
    return coo_array((link, (patch[row], patch[column])), shape=(n, n)).tocsr()


def _evened(laplacian: csr_array, value: Complex) -> Complex:
    """Unit values, each EVENINGS times the mean of its own and its neighbours'."""
    own = 1 / laplacian.diagonal().real
    for _ in range(EVENINGS):
        value = value - 0.5 * own * (laplacian @ value)
        value = value / np.maximum(np.abs(value), 1e-300)
    return value


def _diffused(laplacian: csr_array, area: Floats, value: Complex, kept: Alike | None = None) -> Complex:
    """Unit values after ROUNDS of diffusing and normalising, each `kept` what it shall stay."""
    implicit = (diags_array(area.astype(np.complex128)) + SPREAD * laplacian).tocsr()
    for _ in range(ROUNDS):
        value = _solved(implicit, area * value, value)
        value = value if kept is None else kept(value)
        value = value / np.maximum(np.abs(value), 1e-300)
    return value


def _solved(matrix: csr_array, right: Complex, guess: Complex) -> Complex:
    """Solution (n,) of `matrix` x = `right`, nearly enough for one round, by conjugate gradients.

    Not by a factorisation, nor with inner products of BLAS: on a busy machine their threads wait for one
    another a hundred times as long as they work.
    """
    scale = 1 / matrix.diagonal().real
    x = guess.copy()
    residual = right - matrix @ x
    enough = NEARLY**2 * _square(right, scale)
    towards = scale * residual
    size = _square(residual, scale)
    for _ in range(MOST_STEPS):
        if size <= enough:
            break
        image = matrix @ towards
        share = size / np.einsum("n,n->", towards.conj(), image).real
        x += share * towards
        residual -= share * image
        size, before = _square(residual, scale), size
        towards = scale * residual + (size / before) * towards
    return x


def _square(vector: Complex, scale: Floats) -> float:
    squares = vector.real * vector.real + vector.imag * vector.imag
    return float(np.einsum("n,n->", squares, scale))
