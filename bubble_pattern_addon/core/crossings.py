"""Where a surface passes through itself."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .boxtree import BoxTree, close_pairs
from .mesh import Bools, Floats, Ints, Mesh, area_columns

SHALLOWEST = 1e-6
"""Times the size of the mesh that faces must reach through each other to count: single precision in files
makes touching faces overlap by less.
"""


def crossing_triangles(mesh: Mesh, columns: Floats, tree: BoxTree, sheet: Ints) -> Ints:
    """Pairs of triangles of `mesh` that reach through each other, (k, 2), k = 0 for a sound surface.

    columns: the mesh's; tree: of its triangles; sheet: (T,) the one each triangle is on, below 0 for none,
    see `sheets`: two of the same sheet are not compared

    Two triangles do if an edge of one pierces the other, or if they lie in one plane, face the same way and
    overlap. Faces that only touch do not, nor do faces back to back, as where two bodies lie on each other.
    """
    size = np.linalg.norm(mesh.vertices.max(axis=0) - mesh.vertices.min(axis=0))
    slack = SHALLOWEST * float(size)
    planes = _planes(mesh, columns)
    normal = np.ascontiguousarray(planes.normal.T)
    overlapping, stabs = [], []
    for one, other in close_pairs(tree, sheet):
        # most pairs are neighbours, whose planes clear them: what is cheap and clears many comes first
        over = planes.heights(one, other)
        low, high = over.min(axis=0), over.max(axis=0)
        left = np.flatnonzero((low < -slack) & (high > slack))
        under = planes.heights(other[left], one[left])
        both = (under.min(axis=0) < -slack) & (under.max(axis=0) > slack)
        left, under = left[both], under[:, both]
        pair = np.stack([one[left], other[left]], axis=1)
        stabs += [
            _stabs(mesh, normal, pair, under.T, slack),
            _stabs(mesh, normal, pair[:, ::-1], over[:, left].T, slack),
        ]
        flat = (low >= -slack) & (high <= slack)
        level = np.stack([one[flat], other[flat]], axis=1)
        overlapping.append(level[_overlaps(mesh, normal, level, slack)])
    if not stabs:
        return np.zeros((0, 2), dtype=np.int64)
    return np.concatenate([*overlapping, _piercing(mesh, np.concatenate(stabs))])


@dataclass(frozen=True)
class _Planes:
    """Triangles and their planes, a row per coordinate, which is several times faster to pick from.

    corners: (3 coordinates, 3 corners, T); normal: (3, T) unit normals; level: (T,) their planes' heights
    """

    corners: Floats
    normal: Floats
    level: Floats

    def heights(self, plane: Ints, triangle: Ints) -> Floats:
        """Heights of the corners of `triangle`, (m,), over the planes of `plane`, (m,): (3, m)."""
        above = -np.broadcast_to(self.level[plane], (3, len(plane)))
        for corners, normal in zip(self.corners, self.normal, strict=True):
            along = normal[plane]
            for row, corner in zip(above, corners, strict=True):
                row += corner[triangle] * along
        return above


def _planes(mesh: Mesh, columns: Floats) -> _Planes:
    # from the middle, so that heights are not small differences of large numbers
    corners = columns - ((mesh.vertices.min(axis=0) + mesh.vertices.max(axis=0)) / 2)[:, None, None]
    normal = area_columns(columns)
    length = np.sqrt((normal**2).sum(axis=0))
    # a face without area has no plane: its heights are 0, so it is never through anything
    normal /= np.where(length > 0, length, 1)
    return _Planes(corners, normal, (corners[:, 0] * normal).sum(axis=0))


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
    one, other = mesh.triangles[pair[:, 0]].T, mesh.triangles[pair[:, 1]].T
    # neighbours across an edge cannot overlap while they face the same way
    shared = sum((mine == its).astype(np.int8) for mine in one for its in other)
    found = np.asarray(shared) < 2
    found[found] = np.einsum("mk,mk->m", *(normal[side] for side in pair[found].T)) > 0
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
