"""A tree of boxes round the triangles of a mesh, asked many questions at once.

Triangles are sorted along a Morton curve and paired up level by level, so the tree is a handful of plain
arrays and a query is a frontier of (question, box) pairs that descends one level per pass: no recursion, no
loop over triangles.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from .mesh import Bools, Floats, Ints

Overlap = Callable[[Ints, Floats, Floats], Bools]
"""(questions (m,), box middles (3, m), box half sizes (3, m)) -> (m,) may that question meet that box?"""


@dataclass(frozen=True)
class BoxTree:
    """order: (T,) triangles along the curve; middle, half: per level, from single triangles up to one box,
    (3, m).
    """

    order: Ints
    middle: tuple[Floats, ...]
    half: tuple[Floats, ...]


def build_tree(corners: Floats) -> BoxTree:
    """Tree over triangles given by their `corners`, (T, 3, 3), T at least 1."""
    a, b, c = corners.swapaxes(0, 1)
    low, high = np.minimum(np.minimum(a, b), c), np.maximum(np.maximum(a, b), c)
    order = np.argsort(_morton(low + high), kind="stable")
    # an axis per row: queries look at one axis after the other
    low, high = low[order].T.copy(), high[order].T.copy()
    middle, half = [], []
    while True:
        middle.append((low + high) / 2)
        # rounding of the middle must not shrink a box
        half.append(np.maximum(high - middle[-1], middle[-1] - low) * (1 + 1e-15))
        if low.shape[1] == 1:
            return BoxTree(order, tuple(middle), tuple(half))
        starts = np.arange(0, low.shape[1], 2)
        low, high = np.minimum.reduceat(low, starts, axis=1), np.maximum.reduceat(high, starts, axis=1)


def meeting(tree: BoxTree, questions: int, overlap: Overlap) -> tuple[Ints, Ints]:
    """All pairs (question 0 .. questions-1, triangle) that `overlap` lets pass on every level: (m,) and (m,),
    sorted by question, then triangle.
    """
    asked = np.arange(questions)
    box = np.zeros(questions, dtype=np.int64)
    for level in range(len(tree.middle) - 1, -1, -1):
        passed = overlap(asked, tree.middle[level][:, box], tree.half[level][:, box])
        asked, box = asked[passed], box[passed]
        if level:
            asked, box = np.repeat(asked, 2), np.stack([2 * box, 2 * box + 1], axis=1).ravel()
            there = box < tree.middle[level - 1].shape[1]
            asked, box = asked[there], box[there]
    triangle = tree.order[box]
    by_question = np.lexsort((triangle, asked))
    return asked[by_question], triangle[by_question]


def meeting_cylinders(tree: BoxTree, start: Floats, end: Floats, radius: Floats) -> tuple[Ints, Ints]:
    """Pairs (cylinder, triangle) that may meet, (m,) and (m,), sorted; those left out do not.

    Cylinders run from `start` to `end`, (n, 3), not at the same place, with `radius`, (n,).
    """
    axis = end - start
    length = np.linalg.norm(axis, axis=1)
    along = np.ascontiguousarray((axis / length[:, None]).T)
    centre = np.ascontiguousarray((start + end).T / 2)
    reach = np.ascontiguousarray((np.abs(axis) / 2 + radius[:, None]).T)

    def overlap(which: Ints, middle: Floats, half: Floats) -> Bools:
        """May the box with this middle and half size, (3, m), meet the cylinder `which`, (m,)? See Overlap.

        It may where the boxes round both overlap, and the ball round the triangles' box is no farther from
        the cylinder's axis than both radii.
        """
        apart = np.zeros(len(which), dtype=bool)
        height, square, size = np.zeros((3, len(which)))
        for k in range(3):
            offset = middle[k] - centre[k][which]
            apart |= np.abs(offset) > reach[k][which] + half[k]
            height += offset * along[k][which]
            square += offset**2
            size += half[k] ** 2
        sphere = radius[which] + np.sqrt(size)
        return ~apart & (square - height**2 <= sphere**2 * (1 + 1e-9))

    return meeting(tree, len(start), overlap)


def _morton(points: Floats) -> Ints:
    """Place of each of `points`, (n, 3), on a Morton curve of 21 bits per axis."""
    low = points.min(axis=0)
    size = max(float((points.max(axis=0) - low).max()), np.finfo(float).tiny)
    cells = ((points - low) / size * (2**21 - 1)).astype(np.uint64)
    code = np.zeros(len(points), dtype=np.uint64)
    for axis in range(3):
        code |= _spread(cells[:, axis]) << np.uint64(axis)
    return code.astype(np.int64)


def _spread(bits: np.ndarray) -> np.ndarray:
    """Two empty bits between each of the lower 21 bits."""
    for shift, mask in (
        (32, 0x1F00000000FFFF),
        (16, 0x1F0000FF0000FF),
        (8, 0x100F00F00F00F00F),
        (4, 0x10C30C30C30C30C3),
        (2, 0x1249249249249249),
    ):
        bits = (bits | (bits << np.uint64(shift))) & np.uint64(mask)
    return bits
