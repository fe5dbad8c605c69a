"""Features of a symmetric pattern that are each other's images, and directions that are so as well."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from .isometries import Isometries, depth, images
from .mesh import Bools, Floats, Ints
from .pattern import Pattern

# A feature nearer to the image of another than this, in pitches, is the partner.
NEAR = 0.1
# Depths that differ by less than this, in pitches, are the same.
SAME_DEPTH = 1e-5
# A direction that is off a plane, or off being square to it, by less than this is its own image.
OWN = 1e-4


@dataclass(frozen=True)
class Kin:
    """Of n features: lead (n,) the row of the partner that is deepest in the part of space that the images
    fill; turn (n, 3, 3) and sign (n,) of the isometry that takes that one here, -1 for a mirror; on: (m, n)
    which are their own images at each of the m planes, planes: (m, 3) their normals
    """

    lead: Ints
    turn: Floats
    sign: Ints
    on: Bools
    planes: Floats


def kin_of(pattern: Pattern) -> Kin | None:
    """Who is whose partner; None without a symmetry, or where a partner is missing."""
    group, row, n = pattern.isometries, partner_rows(pattern), len(pattern)
    if group is None or row is None:
        return None
    level = np.round(depth(group, pattern.position) / (SAME_DEPTH * pattern.pitch))
    rank = np.lexsort((np.arange(n), -level)).argsort()
    lead = row[np.arange(n), rank[row].argmin(axis=1)]
    # The first of the isometries that takes the one that leads here.
    number = (row[lead] == np.arange(n)[:, None]).argmax(axis=1)
    turn = group.turns[number]
    sign = np.where(np.linalg.det(group.turns) < 0, -1, 1)[number]
    mirrors = 1 + np.arange(len(group.planes))
    return Kin(lead, turn, sign, (row[:, mirrors] == np.arange(n)[:, None]).T, group.planes)


def partner_rows(pattern: Pattern) -> Ints | None:
    """Rows (n, k) of the features to which the isometries take each one; None without a symmetry, or where
    one is missing.
    """
    if pattern.partners is None or not len(pattern):
        return None
    order = np.argsort(pattern.ids)
    place = np.searchsorted(pattern.ids, pattern.partners, sorter=order)
    row = order[np.minimum(place, len(order) - 1)]
    return row if np.array_equal(pattern.ids[row], pattern.partners) else None


def found_partners(group: Isometries, position: Floats, pitch: Floats) -> Ints | None:
    """Rows (n, k) of the features at the images of those at `position` (n, 3); None where one is missing."""
    if not len(position):
        return None
    away, row = cKDTree(position).query(images(group, position))
    return row.T if (away < NEAR * pitch).all() else None


def alike(kin: Kin, vectors: Floats) -> Floats:
    """The vectors (n, 3) of those that lead, and their images at the partners."""
    return np.einsum("nab,nb->na", kin.turn, vectors[kin.lead])


def along_or_square(kin: Kin, vectors: Floats, which: Bools | None = None, six: bool = False) -> Floats:
    """Unit vectors (n, 3), those of features on a plane turned to along it or square to it, if they are among
    `which` (n,): to what is nearer, or, where they run along one of the `six` directions of a lattice that is
    its own image, to that of these which is so itself.
    """
    result = vectors.copy()
    for on, normal in zip(kin.on, kin.planes, strict=True):
        rows = np.flatnonzero(on if which is None else on & which)
        up = result[rows] @ normal
        along = result[rows] - up[:, None] * normal
        flat = np.linalg.norm(along, axis=1)
        lies = flat >= np.abs(up)
        if six:
            lies = np.cos(6 * np.arctan2(np.abs(up), flat)) > 0
        lies |= np.abs(up) < OWN
        lies &= flat > OWN
        square = np.where(up < 0, -1.0, 1.0)[:, None] * normal
        result[rows] = np.where(lies[:, None], along / np.maximum(flat, OWN)[:, None], square)
    return result


def own_image(kin: Kin, vectors: Floats) -> Bools:
    """Whether unit vectors (n, 3) run along, or square to, the planes that their features are on, (n,)."""
    up = np.abs(vectors @ kin.planes.T).T
    return (~kin.on | (up < OWN) | (up > 1 - OWN)).all(axis=0)
