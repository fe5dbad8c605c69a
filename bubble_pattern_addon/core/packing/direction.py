"""A smooth field of row directions over surfaces without a boundary.

A direction carried along from one seed comes back turned round every piece of curvature, and a lattice
grown by it meets itself in long seams. A field that is smooth everywhere gathers the misfit in a few
points (12 on a sphere) that keep away from one another; the lattice grown along it has its defects
there. Found by diffusing and normalising in turn, which lowers the Ginzburg-Landau energy (Viertel and
Osting, "An Approach to Quad Meshing Based on Harmonic Cross-Valued Maps and the Ginzburg-Landau Theory",
2019, with six directions for 4).
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.sparse import coo_array, csr_array, diags_array

from ..mesh import Bools, Floats, Ints
from ..surface import Charts, Complex, product

Alike = Callable[[Complex], Complex]

# Diffusion per round as a share of the area, falling: far misfits first, near ones after.
SPREAD = (0.003, 0.0005)
ROUNDS, LAST_ROUNDS = 12, 3
# Patches of triangles that are enough for the far misfits.
ENOUGH = 2500
# A round is solved to this share of its right side, in at most so many steps.
NEARLY = 0.05
MOST_STEPS = 200


def smooth_directions(charts: Charts, chosen: Bools, alike: Alike | None = None) -> Complex:
    """Sixth powers of unit row directions in the frames of the triangles, (R,); 0 where not `chosen` (R,).

    alike: makes such values (R,) what they shall stay, such as symmetric
    chosen: triangles of whole connected parts
    """
    region = charts.region
    result = np.zeros(len(chosen), dtype=np.complex128)
    place = np.full(len(chosen), -1)
    members = np.flatnonzero(chosen)
    place[members] = np.arange(len(members))
    row, corner = np.nonzero((region.neighbours >= 0) & chosen[:, None])
    beyond = region.neighbours[row, corner]
    middle = region.corners.mean(axis=1)
    ends = region.corners[row, (corner + 1) % 3] - region.corners[row, (corner + 2) % 3]
    weight = np.linalg.norm(ends, axis=1) / np.linalg.norm(middle[row] - middle[beyond], axis=1)
    area = np.linalg.norm(region.area_vectors[members], axis=1) / 2
    transport = charts.turns[row, corner] ** 6
    n = len(members)
    # Row `beyond` of the Laplacian takes the neighbour's value, turned into its own frame.
    links = coo_array((weight * transport, (place[beyond], place[row])), shape=(n, n))
    degree = np.bincount(place[row], weight, n)
    laplacian = (diags_array(degree.astype(np.complex128)) - links).tocsr()
    parts = np.bincount(region.sheet[members], area, int(region.sheet.max()) + 1)[region.sheet[members]]
    area = area / parts
    # Far misfits meet as well between patches of triangles, which are few; the triangles finish it.
    patches, coarse, share = [], laplacian, area
    while coarse.shape[0] > ENOUGH:
        patch, turn = _paired(coarse)
        patches.append((patch, turn))
        coarse, share = _merged(coarse, patch, turn), np.bincount(patch, share)
    # The frames' own directions, which are at odds: from a smooth start, such as one direction of space seen
    # on the surface, the misfits that belong to it never part.
    value = np.ones(coarse.shape[0], dtype=np.complex128)
    for spread in SPREAD:
        value = _diffused(coarse, share, value, spread, ROUNDS)
    if alike is not None:
        kept = _kept_on_patches(alike, members, len(chosen), patches)
        for spread in SPREAD:
            value = _diffused(coarse, share, _most_alike(kept, value), spread, ROUNDS, kept)
    for patch, turn in reversed(patches):
        value = product(value[patch], turn)
    if patches:
        value = _evened(laplacian, value, LAST_ROUNDS)
    result[members] = value
    if alike is not None:
        result = alike(result)
        result[members] /= np.maximum(np.abs(result[members]), 1e-300)
    return result


def _kept_on_patches(
    alike: Alike, members: Ints, triangles: int, patches: list[tuple[Ints, Complex]]
) -> Alike:
    """What `alike` does to triangles, for the values of the coarsest of nested patches, each with its turn."""
    at, turn = np.arange(len(members)), np.ones(len(members), dtype=np.complex128)
    for patch, step in patches:
        at, turn = patch[at], product(turn, step[at])

    def kept(value: Complex) -> Complex:
        fine = np.zeros(triangles, dtype=np.complex128)
        fine[members] = product(value[at], turn)
        back = product(alike(fine)[members], turn.conj())
        n = len(value)
        return np.bincount(at, back.real, n) + 1j * np.bincount(at, back.imag, n)

    return kept


def _paired(laplacian: csr_array) -> tuple[Ints, Complex]:
    """The larger patch (n,) that each of n patches is a part of, and the turn (n,) that brings its value into
    the small one's own frame: patches that have each other for best neighbour are joined in pairs.
    """
    n = laplacian.shape[0]
    row = np.repeat(np.arange(n), np.diff(laplacian.indptr))
    column, link = laplacian.indices, laplacian.data
    beside = row != column
    row, column, link = row[beside], column[beside], link[beside]
    # Links of equal weight are told apart by an even scatter, else few are each other's best.
    low, high = np.minimum(row, column).astype(np.float64), np.maximum(row, column)
    weight = np.abs(link) * (1 + 0.3 * np.modf(low * 0.6180339887 + high * 0.4142135624)[0])
    begins = np.flatnonzero(np.append(True, np.diff(row) != 0)[: len(row)])
    heaviest = np.full(n, -1.0)
    heaviest[row[begins]] = np.maximum.reduceat(weight, begins) if len(row) else weight
    first = np.flatnonzero(weight == heaviest[row])[::-1]
    best, turn = np.full(n, -1), np.ones(n, dtype=np.complex128)
    best[row[first]] = column[first]
    turn[row[first]] = -link[first] / np.abs(link[first])
    number = np.arange(n)
    mutual = (best >= 0) & (best[best] == number)
    follows = mutual & (best < number)
    leader = np.where(follows, best, number)
    place = np.cumsum(~follows) - 1
    return place[leader], np.where(follows, turn, 1.0)


def _merged(laplacian: csr_array, patch: Ints, turn: Complex) -> csr_array:
    """The Laplacian of larger patches, as their parts' links add up to."""
    row, column = np.repeat(np.arange(len(patch)), np.diff(laplacian.indptr)), laplacian.indices
    link = product(product(laplacian.data, turn.conj()[row]), turn[column])
    n = int(patch.max()) + 1
    return coo_array((link, (patch[row], patch[column])), shape=(n, n)).tocsr()


def _evened(laplacian: csr_array, value: Complex, rounds: int) -> Complex:
    """Unit values, each `rounds` times the mean of its own and its neighbours'."""
    own = 1 / laplacian.diagonal().real
    for _ in range(rounds):
        value = value - 0.5 * own * (laplacian @ value)
        value = value / np.maximum(np.abs(value), 1e-300)
    return value


def _most_alike(kept: Alike, value: Complex) -> Complex:
    """The values turned, all by the same angle, so that `kept` takes least away from them.

    It is the sum of a linear and an antilinear map, p and m of `value`, as mirrors are the latter: of the
    values turned by t it makes t p + m / t, which is longest where t^2 p has the direction of m.
    """
    one, other = kept(value), kept(1j * value)
    p, m = (one - 1j * other) / 2, (one + 1j * other) / 2
    common = np.einsum("n,n->", p.conj(), m)
    return value * np.exp(0.5j * np.angle(common)) if abs(common) > 0 else value


def _diffused(
    laplacian: csr_array,
    area: Floats,
    value: Complex,
    spread: float,
    rounds: int,
    kept: Alike | None = None,
) -> Complex:
    """Unit values after `rounds` of diffusing and normalising."""
    implicit = (diags_array(area.astype(np.complex128)) + spread * laplacian).tocsr()
    for _ in range(rounds):
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
