"""A region laid flat: true to length where it can be, else with the least distortion.

A conformal map (B. Lévy and others, "Least squares conformal maps", 2002) lays a developable surface flat as
it is; on any other it is where the search for the least stretch begins: each triangle is fitted by a
rotation, then all are joined (L. Liu and others, "A local/global approach to mesh parameterization", 2008).
In the plane a rotation is a complex number.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array, csc_array
from scipy.sparse.linalg import splu

from .errors import RegionError
from .mesh import Bools, Floats, Ints
from .region import Region
from .seams import corner_vertices, find_cuts
from .surface import Complex, make_charts

# A stretch below this is none. Further cuts are worth it where none is left with them, or where the stretch
# is above MUCH and they take away half of it.
TRUE = 1.001
MUCH = 1.05
ROUNDS = 200
# Of the extent: the search rests where nothing moves more in a round.
STILL = 1e-7


@dataclass(frozen=True)
class Flat:
    """A region laid flat, as seen from outside.

    corners: (R, 3) complex, where the triangles' corners lie, in the unit of the base
    cuts: (R, 3) whether the edge opposite to each corner was cut open
    part: (R,) number of the connected piece that a triangle lies in
    stretch: the largest factor by which an edge of the region has become longer or shorter, 1 for none
    """

    corners: Complex
    cuts: Bools
    part: Ints
    stretch: float


def flatten(region: Region) -> Flat:
    """The region, with all its parts, laid flat; each part lies where it came out, they may overlap.

    Raises RegionError where a part folds over itself, as much curved a surface as that.
    """
    local = make_charts(region).corners
    best = _flattened(region, local, find_cuts(region))
    if best.stretch > TRUE:
        cuts = find_cuts(region, all_the_way=True)
        if not np.array_equal(cuts, best.cuts):
            other = _flattened(region, local, cuts)
            much_less = best.stretch > MUCH and other.stretch - 1 < (best.stretch - 1) / 2
            if other.stretch < TRUE or much_less:
                best = other
    if not np.isfinite(best.stretch):
        raise RegionError(
            "The target region is curved too much to be laid flat without folds: draw it projected, or "
            "divide it into smaller regions"
        )
    return best


def _flattened(region: Region, local: Complex, cuts: Bools) -> Flat:
    """The region cut open and laid flat; its stretch is infinite where it folds."""
    vertex = corner_vertices(region, (region.neighbours >= 0) & ~cuts)
    count = int(vertex.max()) + 1
    first = np.zeros(count, dtype=np.int64)
    first[vertex.ravel()] = np.arange(vertex.size)
    space = region.corners.reshape(-1, 3)[first]
    sheet = region.sheet[first // 3]
    conformal = _true_size(
        _conformal(local, vertex, _two_far_apart(space, sheet)), local, vertex, region.sheet
    )
    least = _least_stretch(local, vertex, sheet, conformal, region.extent)
    found = min((least, conformal), key=lambda flat: _stretch(local, flat[vertex]))
    return Flat(found[vertex], cuts, region.sheet, _stretch(local, found[vertex]))


def _sides(corners: Complex) -> Complex:
    """The side opposite to each corner, (R, 3)."""
    sides: Complex = np.roll(corners, -2, axis=1) - np.roll(corners, -1, axis=1)
    return sides


def _twice_area(corners: Complex) -> Floats:
    sides = _sides(corners)
    area: Floats = (sides[:, 0].conj() * sides[:, 1]).imag
    return area


def _stretch(local: Complex, flat: Complex) -> float:
    """Largest factor between a side's lengths; infinite where a triangle is turned over."""
    if (_twice_area(flat) <= 0).any() or not np.isfinite(flat).all():
        return np.inf
    factor = np.abs(_sides(flat)) / np.abs(_sides(local))
    return float(np.maximum(factor, 1 / factor).max())


def _two_far_apart(space: Floats, sheet: Ints) -> Ints:
    """Two vertices of each sheet that are far from each other, (2, sheets): by the longest of its extents."""
    sheets = int(sheet.max()) + 1
    low, high = np.full((sheets, 3), np.inf), np.full((sheets, 3), -np.inf)
    np.minimum.at(low, sheet, space)
    np.maximum.at(high, sheet, space)
    along = space[np.arange(len(space)), (high - low).argmax(axis=1)[sheet]]
    order = np.lexsort((np.arange(len(space)), along, sheet))
    start = np.flatnonzero(np.diff(sheet[order], prepend=-1))
    end = np.append(start[1:], len(order)) - 1
    return np.stack([order[start], order[end]])


def _conformal(local: Complex, vertex: Ints, pins: Ints) -> Complex:
    """Least-squares conformal map, (V,), with two vertices of each sheet at 0 and 1."""
    weight = _sides(local) / np.sqrt(_twice_area(local))[:, None]
    count = int(vertex.max()) + 1
    rows = np.repeat(np.arange(len(vertex)), 3)
    matrix = coo_array((weight.ravel(), (rows, vertex.ravel())), shape=(len(vertex), count)).tocsc()
    free = np.setdiff1d(np.arange(count), pins)
    flat = np.zeros(count, dtype=np.complex128)
    flat[pins[1]] = 1.0
    if len(free):
        inner = matrix[:, free]
        flat[free] = _solved(inner.conj().T @ inner, -(inner.conj().T @ (matrix @ flat)))
    return flat


def _solved(matrix: csc_array, right: NDArray[np.complex128]) -> Complex:
    solution: Complex = splu(csc_array(matrix), permc_spec="MMD_AT_PLUS_A").solve(right)
    return solution


def _true_size(flat: Complex, local: Complex, vertex: Ints, part: Ints) -> Complex:
    """The map with each part as large as it is in space."""
    is_, was = _twice_area(flat[vertex]), _twice_area(local)
    scale = np.sqrt(np.bincount(part, was) / np.abs(np.bincount(part, is_)))
    factor = np.ones(len(flat))
    factor[vertex.ravel()] = np.repeat(scale[part], 3)
    return flat * factor


def _least_stretch(local: Complex, vertex: Ints, sheet: Ints, flat: Complex, extent: float) -> Complex:
    """From `flat` (V,) towards the map whose triangles differ least from turned ones: as rigid as
    possible.
    """
    sides = _sides(local)
    area = _twice_area(local)
    dot = (np.roll(sides, -2, axis=1).conj() * np.roll(sides, -1, axis=1)).real
    cotangent = -dot / area[:, None]
    start, end = np.roll(vertex, -1, axis=1).ravel(), np.roll(vertex, -2, axis=1).ravel()
    count = len(flat)
    weight = cotangent.ravel()
    links = coo_array((weight, (start, end)), shape=(count, count)).tocsc()
    links = links + links.T
    degree = np.asarray(links.sum(axis=1)).ravel()
    matrix = (coo_array((degree, (np.arange(count),) * 2), shape=(count, count)) - links).tocsc()
    held = np.flatnonzero(np.diff(np.sort(sheet), prepend=-1))
    held = np.argsort(sheet, kind="stable")[held]
    free = np.setdiff1d(np.arange(count), held)
    if not len(free):
        return flat
    solve = splu(csc_array(matrix[free][:, free]), permc_spec="MMD_AT_PLUS_A").solve
    beside = matrix[free][:, held] @ flat[held]
    for _ in range(ROUNDS):
        turn = (cotangent * sides.conj() * _sides(flat[vertex])).sum(axis=1)
        turn /= np.maximum(np.abs(turn), 1e-300)
        pull = cotangent * sides * turn[:, None]
        force = _summed(end, pull, count) - _summed(start, pull, count)
        right = force[free] - beside
        there = solve(np.stack([right.real, right.imag], axis=1)) @ np.array([1.0, 1j])
        moved = np.abs(there - flat[free]).max()
        flat = flat.copy()
        flat[free] = there
        if moved < STILL * extent:
            break
    return flat


def _summed(where: Ints, values: Complex, count: int) -> Complex:
    values = values.ravel()
    return np.bincount(where, values.real, count) + 1j * np.bincount(where, values.imag, count)
