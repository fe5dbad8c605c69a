"""Faces with many corners from the triangles of flat facets: the walls of a hole as quads, its floor whole.

A boolean leaves triangles. Who goes on with a part wants what was modelled: loops to select round a wall,
rims to bevel.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .cycles import followed
from .mesh import Bools, Ints
from .ranking import ranked


@dataclass(frozen=True)
class Faces:
    """N faces.

    corner: (C,) vertices at their corners, one face after the other; total: (N,) corners of each; triangle:
    (N,) one of the triangles each is made of
    """

    corner: Ints
    total: Ints
    triangle: Ints


def joined_faces(triangles: Ints, facet: Ints) -> Faces:
    """The `triangles`, (T, 3), those of each `facet`, (T,) from 0 on, joined to one face.

    No edge has more than two triangles, which run along it in opposite directions. A facet that would not be
    one face whose outline passes every vertex once stays triangles: where it is in several pieces, has a
    hole, or a vertex inside. First come quads of two triangles, then other faces, then what stays.
    """
    key, order = ranked(facet.copy(), int(facet.max(initial=0)).bit_length())
    number = np.bincount(facet)[key]
    two = order[number == 2].reshape(-1, 2)
    quads, fits = _quads(triangles[two[:, 0]], triangles[two[:, 1]])
    rest = np.concatenate([order[number != 2], two[~fits].ravel()])
    others = _discs(triangles[rest], facet[rest])
    triangle = np.concatenate([two[fits, 0], rest[others.triangle]])
    total = np.concatenate([np.full(fits.sum(), 4), others.total])
    corner = np.concatenate([quads[fits].ravel(), others.corner])
    return Faces(corner, total, triangle)


def _quads(one: Ints, other: Ints) -> tuple[Ints, Bools]:
    """Two triangles each, (n, 3) and (n, 3), as a face with four corners, (n, 4), and whether they share an
    edge, as they must for that, (n,).
    """
    # a row per corner, several times faster to pick from
    one, other = np.ascontiguousarray(one.T), np.ascontiguousarray(other.T)
    tip, start, end = _from_apart(one, other)
    across, back, forth = _from_apart(other, one)
    fits = (start == forth) & (end == back) & (tip != across)
    return np.stack([tip, start, across, end], axis=1), fits


def _from_apart(one: Ints, other: Ints) -> tuple[Ints, Ints, Ints]:
    """The corners of each of `one`, (3, n), from the first that `other`, (3, n), has not."""
    first, second = ((corner == other).any(axis=0) for corner in one[:2])
    turn = np.where(first, np.where(second, 2, 1), 0)
    number = np.arange(len(turn))
    return tuple(one[(turn + place) % 3, number] for place in range(3))


def _discs(triangles: Ints, facet: Ints) -> Faces:
    """`joined_faces` for facets of any number of triangles: facets by their number, then what is left."""
    opposite = _across(triangles, facet)
    rim = np.flatnonzero(opposite < 0)
    owner = facet[rim // 3]
    count = np.bincount(facet)
    total = np.bincount(owner, minlength=len(count))
    first = np.zeros(len(count), dtype=np.int64)
    first[owner[::-1]] = rim[::-1]
    # a disc has two more edges than triangles, if all its vertices are on the rim
    discs = np.flatnonzero((total == count + 2) & (count > 0))
    sides = followed(_following(opposite, rim), first[discs], total[discs])
    corner = triangles.ravel()[sides]
    # going round twice takes a rim in several pieces
    again = np.repeat(np.arange(len(discs)), total[discs])[sides == np.repeat(first[discs], total[discs])]
    simple = (np.bincount(again, minlength=len(discs)) == 1) & _once(corner, total[discs])
    corner = corner[np.repeat(simple, total[discs])]
    discs = discs[simple]
    whole = np.zeros(len(count), dtype=bool)
    whole[discs] = True
    left = np.flatnonzero(~whole[facet])
    return Faces(
        np.concatenate([corner, triangles[left].ravel()]),
        np.concatenate([total[discs], np.full(len(left), 3)]),
        np.concatenate([first[discs] // 3, left]),
    )


def _across(triangles: Ints, facet: Ints) -> Ints:
    """The side on the other side of each edge within a facet, (3 T,), -1 on its rim.

    Side 3 t + k runs from corner k of triangle t to the next one.
    """
    start, end = triangles.ravel(), np.roll(triangles, -1, axis=1).ravel()
    bits = int(triangles.max(initial=0)).bit_length()
    key, side = ranked((np.minimum(start, end) << bits) | np.maximum(start, end), 2 * bits)
    pair = np.flatnonzero(key[1:] == key[:-1])
    one, other = side[pair], side[pair + 1]
    same = facet[one // 3] == facet[other // 3]
    one, other = one[same], other[same]
    opposite = np.full(len(start), -1)
    opposite[one], opposite[other] = other, one
    return opposite


def _following(opposite: Ints, rim: Ints) -> Ints:
    """Of the sides `rim` the next one on the rim, (3 T,), 0 for all other sides."""
    following = np.zeros(len(opposite), dtype=np.int64)
    side, at = rim, _next(rim)
    while len(side):
        across = opposite[at]
        ended = across < 0
        following[side[ended]] = at[ended]
        side, at = side[~ended], _next(across[~ended])
    return following


def _next(side: Ints) -> Ints:
    """The next side of the same triangle."""
    return np.where(side % 3 == 2, side - 2, side + 1)


def _once(corner: Ints, total: Ints) -> Bools:
    """Which faces, (n,) with `total` of the vertices `corner`, have every vertex once."""
    once = np.ones(len(total), dtype=bool)
    large = np.repeat(total > 4, total)
    owner, vertex = np.repeat(np.arange(len(total)), total)[large], corner[large]
    bits = int(vertex.max(initial=0)).bit_length()
    key = np.sort((owner << bits) | vertex)
    once[key[1:][key[1:] == key[:-1]] >> bits] = False
    return once
