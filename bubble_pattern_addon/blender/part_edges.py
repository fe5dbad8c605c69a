"""The edges of a part, from the corners of its faces.

Blender finds edges too, in twice the time, and then does not say which faces are beside them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..core.mesh import Ints


@dataclass(frozen=True)
class Edges:
    """Edges of faces, E of them; the edge of a corner is the one to the next corner of its face.

    ends: (E, 2) vertices; of_corner: (L,) edge of each corner; first, last: (E,) lowest and highest corner
    whose edge it is: the faces on both sides
    """

    ends: Ints
    of_corner: Ints
    first: Ints
    last: Ints


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
    key |= np.maximum(corner_vertex, following)
    corner = np.argsort(key)
    key = key[corner]
    new = np.ones(len(key), dtype=bool)
    np.not_equal(key[1:], key[:-1], out=new[1:])
    of_corner = np.empty_like(corner)
    of_corner[corner] = np.cumsum(new) - 1
    starts = np.flatnonzero(new)
    ends = np.stack([key[starts] >> bits, key[starts] & ((1 << bits) - 1)], axis=1)
    first, last = np.minimum.reduceat(corner, starts), np.maximum.reduceat(corner, starts)
    return Edges(ends, of_corner, first, last)
