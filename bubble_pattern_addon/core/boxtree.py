"""A tree of boxes round the triangles of a mesh, asked many questions at once.

Triangles are sorted along a Morton curve and paired up level by level, so the tree is a handful of plain
arrays and a query is a frontier of (question, box) pairs that descends one level per pass: no recursion, no
loop over triangles.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from .mesh import Bools, Floats, Ints

Overlap = Callable[[Ints, Ints, Floats, Floats], Bools]
"""(questions (m,), boxes (m,), middles (3, boxes) and half sizes (3, boxes) of a level) -> (m,) may that
question meet that box?"""


BLOCK = 1 << 18
"""Pairs looked at together: bounds the memory."""


@dataclass(frozen=True)
class BoxTree:
    """order: (T,) triangles along the curve; middle, half: per level, from single triangles up to one box,
    (3, m).
    """

    order: Ints
    middle: tuple[Floats, ...]
    half: tuple[Floats, ...]


def build_tree(columns: Floats) -> BoxTree:
    """Tree over triangles given by their corners as in `Mesh.columns`, (3, 3, T), T at least 1."""
    low, high = columns.min(axis=1), columns.max(axis=1)
    order = np.argsort(_morton(low + high), kind="stable")
    # an axis per row: queries look at one axis after the other
    low, high = low[:, order], high[:, order]
    middle, half = [], []
    while True:
        middle.append((low + high) / 2)
        # rounding of the middle must not shrink a box
        half.append(np.maximum(high - middle[-1], middle[-1] - low) * (1 + 1e-15))
        if low.shape[1] == 1:
            return BoxTree(order, tuple(middle), tuple(half))
        low, high = _by_twos(low, np.minimum), _by_twos(high, np.maximum)


def _by_twos(values: Floats, merge: np.ufunc) -> Floats:
    """Columns of `values`, (k, m), merged with their neighbours, (k, m / 2 rounded up): the last of an odd
    number stays alone.
    """
    merged = values[:, ::2].copy()
    pairs = values.shape[1] // 2
    merge(merged[:, :pairs], values[:, 1::2], out=merged[:, :pairs])
    return merged


def meeting(tree: BoxTree, questions: int, overlap: Overlap) -> tuple[Ints, Ints]:
    """All pairs (question 0 .. questions-1, triangle) that `overlap` lets pass on every level looked at: (m,)
    and (m,), sorted by question, then triangle.
    """
    top = len(tree.middle) - 1
    box = np.arange(tree.middle[top - top % 2].shape[1])
    asked, box = np.repeat(np.arange(questions), len(box)), np.tile(box, questions)
    # two levels at a time: of two boxes that a box is made of more than one passes
    for level in range(top - top % 2, -1, -2):
        passed = np.flatnonzero(overlap(asked, box, tree.middle[level], tree.half[level]))
        asked, box = asked[passed], box[passed]
        if level:
            asked, box = np.repeat(asked, 4), (4 * box[:, None] + np.arange(4)).ravel()
            count = tree.middle[level - 2].shape[1]
            if box.max(initial=0) >= count:
                there = np.flatnonzero(box < count)
                asked, box = asked[there], box[there]
    number = len(tree.order)
    return np.divmod(np.sort(asked * number + tree.order[box]), number)


def meeting_cylinders(tree: BoxTree, start: Floats, end: Floats, radius: Floats) -> tuple[Ints, Ints]:
    """Pairs (cylinder, triangle) that may meet, (m,) and (m,), sorted; those left out do not.

    Cylinders run from `start` to `end`, (n, 3), not at the same place, with `radius`, (n,).
    """
    axis = end - start
    length = np.linalg.norm(axis, axis=1)
    along = np.ascontiguousarray((axis / length[:, None]).T)
    centre = np.ascontiguousarray((start + end).T / 2)
    reach = np.ascontiguousarray((np.abs(axis) / 2 + radius[:, None]).T)

    def overlap(which: Ints, box: Ints, middle: Floats, half: Floats) -> Bools:
        """May the `box`, (m,), of this level's middles and half sizes meet the cylinder `which`, (m,)?

        It may where the boxes round both overlap, and the ball round the triangles' box is no farther from
        the cylinder's axis than both radii.
        """
        near = np.ones(len(which), dtype=bool)
        height, square, size = np.zeros((3, len(which)))
        for k in range(3):
            offset, extent = middle[k][box] - centre[k][which], half[k][box]
            near &= np.abs(offset) <= reach[k][which] + extent
            height += offset * along[k][which]
            square += offset * offset
            size += extent * extent
        sphere = radius[which] + np.sqrt(size)
        return near & (square - height * height <= sphere * sphere * (1 + 1e-9))

    return meeting(tree, len(start), overlap)


def close_pairs(tree: BoxTree, group: Ints | None = None) -> Iterator[tuple[Ints, Ints]]:
    """Blocks of pairs of triangles whose boxes meet, (m,) and (m,), every pair once.

    group: (T,) pairs within a group from 0 on are left out, those of triangles below 0 are not
    """
    kinds = None if group is None else _groups(tree, group)
    # a flat thing's layers lie apart along its shortest side
    axes = np.argsort(tree.half[-1][:, 0], kind="stable")
    root = np.zeros(1, dtype=np.int64)
    waiting = [(len(tree.middle) - 1, root, root)]
    while waiting:
        level, one, other = waiting.pop()
        if len(one) > BLOCK:
            half = len(one) // 2
            waiting += [(level, one[:half], other[:half]), (level, one[half:], other[half:])]
            continue
        if kinds is not None:
            kind = kinds[level][one]
            apart = np.flatnonzero((kind < 0) | (kind != kinds[level][other]))
            one, other = one[apart], other[apart]
        for axis in axes:
            middle, size = tree.middle[level][axis], tree.half[level][axis]
            meet = np.flatnonzero(np.abs(middle[one] - middle[other]) <= size[one] + size[other])
            one, other = one[meet], other[meet]
        if level == 0:
            apart = np.flatnonzero(one != other)
            yield tree.order[one[apart]], tree.order[other[apart]]
            continue
        one = np.stack([2 * one, 2 * one, 2 * one + 1, 2 * one + 1], axis=1).ravel()
        other = np.stack([2 * other, 2 * other + 1, 2 * other, 2 * other + 1], axis=1).ravel()
        there = np.flatnonzero((one <= other) & (other < tree.middle[level - 1].shape[1]))
        waiting.append((level - 1, one[there], other[there]))


def _groups(tree: BoxTree, group: Ints) -> list[Ints]:
    """The group of every box, per level: that of all its triangles, or -1 where they are not of one."""
    kinds = [group[tree.order]]
    for _ in tree.middle[1:]:
        kind, second = kinds[-1][::2].copy(), kinds[-1][1::2]
        kind[: len(second)][kind[: len(second)] != second] = -1
        kinds.append(kind)
    return kinds


def _morton(points: Floats) -> Ints:
    """Place of each of `points`, (3, n), on a Morton curve of 21 bits per axis."""
    low = points.min(axis=1, keepdims=True)
    size = max(float((points.max(axis=1, keepdims=True) - low).max()), np.finfo(float).tiny)
    cells = ((points - low) / size * (2**21 - 1)).astype(np.uint64)
    code = np.zeros(points.shape[1], dtype=np.uint64)
    for axis in range(3):
        code |= _spread(cells[axis]) << np.uint64(axis)
    return code.view(np.int64)


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
