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

    Two triangles do if an edge of one pierces the inside of the other, or if they lie in one plane, face the
    same way and overlap. Faces that only touch do not, nor do faces back to back, as where two bodies lie on
    each other.
    """
    size = np.linalg.norm(mesh.vertices.max(axis=0) - mesh.vertices.min(axis=0))
    slack = SHALLOWEST * float(size)
    plane = mesh.area_vectors
    length = np.linalg.norm(plane, axis=1)
    # a face without area has no plane: its heights are 0, so it is never through anything
    normal = plane / np.where(length > 0, length, 1)[:, None]
    found = [np.zeros((0, 2), dtype=np.int64)]
    for pair in close_pairs(tree):
        found.append(pair[_cross(mesh, normal, pair, slack)])
    return np.concatenate(found)


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


def _cross(mesh: Mesh, normal: Floats, pair: Ints, slack: float) -> Bools:
    """Do the triangles of each pair, (m, 2), reach through each other by more than `slack`? (m,)"""
    # most pairs are neighbours, whose planes clear them: what is cheap and clears many comes first
    over = _heights(mesh, normal, pair[:, 0], pair[:, 1])
    left = np.flatnonzero(_straddles(over, slack))
    under = _heights(mesh, normal, pair[left, 1], pair[left, 0])
    left, under = _those(_straddles(under, slack), left, under)
    crossing = np.zeros(len(pair), dtype=bool)
    heights = np.stack([under, over[left]], axis=1)
    crossing[left] = _pierces(mesh.vertices[mesh.triangles[pair[left]]], normal[pair[left]], heights, slack)

    flat = np.abs(over) <= slack
    level = np.flatnonzero(flat[:, 0] & flat[:, 1] & flat[:, 2])
    level = level[np.einsum("mk,mk->m", normal[pair[level, 0]], normal[pair[level, 1]]) > 0]
    one, other = mesh.triangles[pair[level, 0]], mesh.triangles[pair[level, 1]]
    # neighbours across an edge cannot overlap while they face the same way
    level = level[(one[:, :, None] == other[:, None]).any(axis=2).sum(axis=1) < 2]
    crossing[level] = _overlaps(mesh.vertices[mesh.triangles[pair[level]]], normal[pair[level]], slack)
    return crossing


def _straddles(height: Floats, slack: float) -> Bools:
    """Are some of the three heights, (m, 3), clearly above 0 and some clearly below?"""
    below, above = height < -slack, height > slack
    return (below[:, 0] | below[:, 1] | below[:, 2]) & (above[:, 0] | above[:, 1] | above[:, 2])


def _those(chosen: Bools, *arrays: np.ndarray) -> tuple[np.ndarray, ...]:
    return tuple(array[chosen] for array in arrays)


def _heights(mesh: Mesh, normal: Floats, plane: Ints, triangle: Ints) -> Floats:
    """Heights of the corners of `triangle`, (m,), over the planes of the triangles `plane`, (m,): (m, 3)."""
    up = normal[plane]
    level = np.einsum("mk,mk->m", mesh.vertices[mesh.triangles[plane, 0]], up)
    corners = mesh.vertices[mesh.triangles[triangle]]
    return np.einsum("mck,mk->mc", corners, up) - level[:, None]


def _pierces(corners: Floats, normal: Floats, height: Floats, slack: float) -> Bools:
    """Does an edge of one triangle pass through the inside of the other, clear of its edges by `slack`?"""
    found = np.zeros(len(corners), dtype=bool)
    for one, other in ((0, 1), (1, 0)):
        edge = np.roll(corners[:, other], -1, axis=1) - corners[:, other]
        inward = np.cross(normal[:, other, None], edge)
        inward /= np.linalg.norm(inward, axis=2)[..., None]
        for corner in range(3):
            start, end = corners[:, one, corner], corners[:, one, (corner + 1) % 3]
            rise, fall = height[:, one, corner], height[:, one, (corner + 1) % 3]
            passes = np.minimum(rise, fall) < -slack
            passes &= np.maximum(rise, fall) > slack
            share = rise / np.where(passes, rise - fall, 1)
            point = start + share[:, None] * (end - start)
            room = np.einsum("mck,mck->mc", point[:, None] - corners[:, other], inward)
            found |= passes & np.all(room > slack, axis=1)
    return found


def _overlaps(corners: Floats, normal: Floats, slack: float) -> Bools:
    """Do two triangles in one plane share more than a strip `slack` wide? None of their six edges separates
    them.
    """
    found = np.ones(len(corners), dtype=bool)
    for one in (0, 1):
        edge = np.roll(corners[:, one], -1, axis=1) - corners[:, one]
        inward = np.cross(normal[:, one, None], edge)
        inward /= np.linalg.norm(inward, axis=2)[..., None]
        for side in range(3):
            offset = corners[:, 1 - one] - corners[:, one, side][:, None]
            found &= np.einsum("mck,mk->mc", offset, inward[:, side]).max(axis=1) > slack
    return found
