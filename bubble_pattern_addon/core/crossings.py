"""Where a surface passes through itself."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from .boxtree import BoxTree
from .mesh import Bools, Floats, Ints, Mesh

SHALLOWEST = 1e-6
"""Times the size of the mesh that faces must reach through each other to count: single precision in files
makes touching faces overlap by less.
"""
BLOCK = 1 << 18
"""Pairs looked at together: bounds the memory."""


def crossing_triangles(mesh: Mesh, tree: BoxTree) -> Ints:
    """Pairs of triangles of `mesh` that reach through each other, (k, 2), k = 0 for a sound surface.

    Two triangles do if an edge of one pierces the other, or if they lie in one plane, face the same way and
    overlap. Faces that only touch do not, nor do faces back to back, as where two bodies lie on each other.
    """
    size = np.linalg.norm(mesh.vertices.max(axis=0) - mesh.vertices.min(axis=0))
    slack = SHALLOWEST * float(size)
    plane = mesh.area_vectors
    length = np.linalg.norm(plane, axis=1)
    # a face without area has no plane: its heights are 0, so it is never through anything
    normal = plane / np.where(length > 0, length, 1)[:, None]
    overlapping, stabs = [], []
    for pair in close_pairs(tree):
        # most pairs are neighbours, whose planes clear them: what is cheap and clears many comes first
        over = _heights(mesh, normal, pair[:, 0], pair[:, 1])
        left = np.flatnonzero(_straddles(over, slack))
        under = _heights(mesh, normal, pair[left, 1], pair[left, 0])
        both = _straddles(under, slack)
        left, under = left[both], under[both]
        stabs += [
            _stabs(mesh, normal, pair[left], under, slack),
            _stabs(mesh, normal, pair[left, ::-1], over[left], slack),
        ]
        flat = np.abs(over) <= slack
        level = pair[flat[:, 0] & flat[:, 1] & flat[:, 2]]
        overlapping.append(level[_overlaps(mesh, normal, level, slack)])
    if not stabs:
        return np.zeros((0, 2), dtype=np.int64)
    return np.concatenate([*overlapping, _piercing(mesh, np.concatenate(stabs))])


def close_pairs(tree: BoxTree) -> Iterator[Ints]:
    """Blocks of pairs of triangles whose boxes meet, (m, 2), every pair once."""
    root = np.zeros(1, dtype=np.int64)
    waiting = [(len(tree.middle) - 1, root, root)]
    while waiting:
        level, one, other = waiting.pop()
        if len(one) > BLOCK:
            half = len(one) // 2
            waiting += [(level, one[:half], other[:half]), (level, one[half:], other[half:])]
            continue
        for middle, size in zip(tree.middle[level], tree.half[level], strict=True):
            meet = np.abs(middle[one] - middle[other]) <= size[one] + size[other]
            one, other = one[meet], other[meet]
        if level == 0:
            apart = one != other
            yield tree.order[np.stack([one[apart], other[apart]], axis=1)]
            continue
        one = np.stack([2 * one, 2 * one, 2 * one + 1, 2 * one + 1], axis=1).ravel()
        other = np.stack([2 * other, 2 * other + 1, 2 * other, 2 * other + 1], axis=1).ravel()
        there = (one <= other) & (other < tree.middle[level - 1].shape[1])
        waiting.append((level - 1, one[there], other[there]))


def _straddles(height: Floats, slack: float) -> Bools:
    """Are some of the three heights, (m, 3), clearly above 0 and some clearly below?"""
    below, above = height < -slack, height > slack
    return (below[:, 0] | below[:, 1] | below[:, 2]) & (above[:, 0] | above[:, 1] | above[:, 2])


def _heights(mesh: Mesh, normal: Floats, plane: Ints, triangle: Ints) -> Floats:
    """Heights of the corners of `triangle`, (m,), over the planes of the triangles `plane`, (m,): (m, 3)."""
    up = normal[plane]
    level = np.einsum("mk,mk->m", mesh.vertices[mesh.triangles[plane, 0]], up)
    corners = mesh.vertices[mesh.triangles[triangle]]
    return np.einsum("mck,mk->mc", corners, up) - level[:, None]


def _stabs(mesh: Mesh, normal: Floats, pair: Ints, height: Floats, slack: float) -> Ints:
    """Edges of the first triangle of each pair, (m, 2), that pass through the second one's plane within it.

    height: (m, 3) of the first's corners over that plane. Returns rows of first, second, ends of the edge
    (lower vertex first), direction through the plane, and where the second is met: -1 -1 inside, two
    vertices on the edge between them, a vertex and -1 in that vertex; (k, 7).
    """
    target = mesh.triangles[pair[:, 1]]
    corners = mesh.vertices[target]
    along = np.roll(corners, -1, axis=1) - corners
    inward = np.cross(normal[pair[:, 1], None], along)
    inward /= np.linalg.norm(inward, axis=2)[..., None]
    found = []
    for corner in range(3):
        ends = mesh.triangles[pair[:, 0]][:, [corner, (corner + 1) % 3]]
        # always from the lower vertex, so that both faces of an edge find it in the same place
        swap = ends[:, 0] > ends[:, 1]
        ends[swap] = ends[swap, ::-1]
        rise, fall = height[:, corner], height[:, (corner + 1) % 3]
        rise, fall = np.where(swap, fall, rise), np.where(swap, rise, fall)
        passes = (np.minimum(rise, fall) < -slack) & (np.maximum(rise, fall) > slack)
        start, end = mesh.vertices[ends[:, 0]], mesh.vertices[ends[:, 1]]
        point = start + (rise / np.where(passes, rise - fall, 1))[:, None] * (end - start)
        room = np.einsum("mck,mck->mc", point[:, None] - corners, inward)
        hit = np.flatnonzero(passes & np.all(room > -slack, axis=1))
        border = room[hit] <= slack
        side, sides = border.argmax(axis=1), border.sum(axis=1)
        # two sides meet in the corner at the end of the first of them, or at its start if they are the first
        # and last
        meet = np.where(border[:, 0] & border[:, 2] & ~border[:, 1], 0, side + 1) % 3
        here = np.take_along_axis(target[hit], np.where(sides > 1, meet, side)[:, None], axis=1)[:, 0]
        there = np.take_along_axis(target[hit], (side[:, None] + 1) % 3, axis=1)[:, 0]
        low = np.where(sides == 0, -1, np.where(sides == 1, np.minimum(here, there), here))
        high = np.where(sides == 1, np.maximum(here, there), -1)
        found.append(np.column_stack([pair[hit], ends[hit], rise[hit] > 0, low, high]))
    return np.concatenate(found).astype(np.int64)


def _piercing(mesh: Mesh, stabs: Ints) -> Ints:
    """Pairs (k, 2) of triangles whose `stabs`, rows of `_stabs`, go through the surface rather than touch it.

    Inside a triangle that is plain. On an edge or in a corner every face round it must be passed the same
    way: a body lying on another passes some of their planes there, but not all.
    """
    inside = stabs[:, 5] < 0
    doubtful = stabs[~inside]
    if len(doubtful) == 0:
        return stabs[inside, :2]
    _, kept = np.unique(doubtful[:, 1:], axis=0, return_index=True)
    doubtful = doubtful[kept]
    _, group, count = np.unique(doubtful[:, 2:], axis=0, return_inverse=True, return_counts=True)
    faces = np.bincount(mesh.triangles.ravel(), minlength=len(mesh.vertices))
    needed = np.where(doubtful[:, 6] < 0, faces[doubtful[:, 5]], 2)
    return np.concatenate([stabs[inside, :2], doubtful[count[group.ravel()] >= needed, :2]])


def _overlaps(mesh: Mesh, normal: Floats, pair: Ints, slack: float) -> Bools:
    """Do two triangles in one plane, (m, 2), face the same way and share more than a strip `slack` wide?
    (m,)
    """
    found = np.einsum("mk,mk->m", normal[pair[:, 0]], normal[pair[:, 1]]) > 0
    one, other = mesh.triangles[pair[:, 0]], mesh.triangles[pair[:, 1]]
    # neighbours across an edge cannot overlap while they face the same way
    found &= (one[:, :, None] == other[:, None]).any(axis=2).sum(axis=1) < 2
    some = pair[found]
    apart = np.zeros(len(some), dtype=bool)
    for one, other in (some.T, some[:, ::-1].T):
        corners, points = mesh.vertices[mesh.triangles[one]], mesh.vertices[mesh.triangles[other]]
        inward = np.cross(normal[one, None], np.roll(corners, -1, axis=1) - corners)
        inward /= np.linalg.norm(inward, axis=2)[..., None]
        for side in range(3):
            offset = points - corners[:, side, None]
            apart |= np.einsum("mck,mk->mc", offset, inward[:, side]).max(axis=1) <= slack
    found[found] = ~apart
    return found
