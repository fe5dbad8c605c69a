"""The edges of a part, from the corners of its faces.

Blender finds edges too, in several times the time, and then does not say which faces are beside them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..core.mesh import Ints
from ..core.ranking import ranked
from .attributes import Array


@dataclass(frozen=True)
class Edges:
    """Edges of faces, E of them; the edge of a corner is the one to the next corner of its face.

    ends: (E, 2) vertices, the lower first; of_corner: (L,) edge of each corner; first, last: (E,) lowest and
    highest corner whose edge it is: the faces on both sides
    """

    ends: Array
    of_corner: Array
    first: Array
    last: Array


def find_edges(corner_vertex: Ints, start: Ints, total: Ints) -> Edges:
    """Edges of the faces whose corners are at the vertices `corner_vertex`, (L,), one face after the other.

    start, total: (F,) first corner and number of corners of each face
    """
    following = np.empty_like(corner_vertex)
    following[:-1] = corner_vertex[1:]
    following[start + total - 1] = corner_vertex[start]
    bits = int(corner_vertex.max(initial=0)).bit_length()
    key = np.minimum(corner_vertex, following)
    key <<= bits
    np.maximum(corner_vertex, following, out=following)
    key |= following
    key, corner = ranked(key, 2 * bits)
    of_corner = np.empty(len(key), dtype=np.int32)
    if _in_pairs(key):
        key, first, last = key[::2], corner[::2], corner[1::2]
        of_corner[first] = of_corner[last] = np.arange(len(key), dtype=np.int32)
    else:
        new = np.ones(len(key), dtype=bool)
        np.not_equal(key[1:], key[:-1], out=new[1:])
        of_corner[corner] = np.cumsum(new) - 1
        starts = np.flatnonzero(new)
        key, first, last = key[starts], corner[starts], corner[np.roll(starts, -1) - 1]
    ends = np.empty((len(key), 2), dtype=np.int32)
    ends[:, 0], ends[:, 1] = key >> bits, key & ((1 << bits) - 1)
    return Edges(ends, of_corner, first, last)


def _in_pairs(key: Ints) -> bool:
    """Does each of the ranked keys, (L,), stand there twice, as the edges of a closed surface do?"""
    one, other = key[::2], key[1::2]
    return len(one) == len(other) and bool(np.all(one == other) and not np.any(one[1:] == one[:-1]))
