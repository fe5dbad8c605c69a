"""The target region: the selected triangles of the base as a surface with its own boundary."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from .boxtree import BoxTree, build_tree
from .errors import RegionError
from .mesh import Bools, Floats, Ints, Mesh
from .vectors import dots

if TYPE_CHECKING:
    from .surface import Charts

# A triangle is flat when its height is below this share of its longest edge: walking over it would divide by
# zero.
FLAT = 1e-12
# Faces that turn by no more than this, in radians, lie in one plane: as much as single precision costs.
LEVEL = 1e-4
# Sheets whose normals have a cosine below this face away from each other.
BACK_TO_BACK = -0.5


@dataclass(frozen=True)
class Region:
    """Target region on a base geometry.

    base: the whole base, vertices welded where they coincide exactly (triangles keep their rows)
    mesh: the region's own R triangles; they are the base's where no keep-out cuts these, else pieces of them
    triangles: (R,) row of base.triangles that each is or lies in, ascending; pieces of one repeat it
    within: (R, 3, 3) barycentric coordinates of each corner in that triangle of the base; None: all are whole
    neighbours: (R, 3) region row across the edge opposite to each corner, -1 at the boundary
    opposite: (R, 3) the corner of that neighbour which lies opposite to the shared edge
    sheet: (R,) label of the connected part a triangle belongs to
    loops: boundary loops as rows of mesh.vertices, the region on the left of each edge
    rim: (S, 2) every boundary edge as (region row, opposite corner), in the order of the loops
    reserve: (S,) what the first row keeps from each of these beyond its radius: half the gap between
    sub-regions on the borders that they share, else 0
    part, gap: (R,) the sub-region of each triangle and what stays free between two of them; None: all is one
    kept_out: area that keep-outs have taken from it; notes: what a designer should know of the region, one
    sentence each
    """

    base: Mesh
    mesh: Mesh
    triangles: Ints
    neighbours: Ints
    opposite: Ints
    sheet: Ints
    loops: tuple[Ints, ...]
    rim: Ints
    reserve: Floats
    within: Floats | None = None
    part: Ints | None = None
    gap: float = 0.0
    kept_out: float = 0.0
    notes: tuple[str, ...] = ()

    @cached_property
    def corners(self) -> Floats:
        """Corner positions of the region's triangles, (R, 3, 3)."""
        return self.mesh.corners

    @cached_property
    def charts(self) -> Charts:
        """Frames of the triangles."""
        from .surface import make_charts  # which knows regions

        return make_charts(self)

    @cached_property
    def area_vectors(self) -> Floats:
        """Outward normals as long as twice the area, (R, 3)."""
        corners = self.corners
        return np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])

    @cached_property
    def normals(self) -> Floats:
        """Outward unit normals of the triangles, (R, 3)."""
        return self.area_vectors / np.linalg.norm(self.area_vectors, axis=1, keepdims=True)

    @cached_property
    def area(self) -> float:
        """Surface area of the region."""
        return float(np.linalg.norm(self.area_vectors, axis=1).sum() / 2)

    @cached_property
    def extent(self) -> float:
        """Longest side of the region's bounding box."""
        return float(np.ptp(self.corners.reshape(-1, 3), axis=0).max())

    @cached_property
    def single_sheet(self) -> bool:
        """Whether the region is one piece with all normals in one cone: no part of it can face another."""
        mean = self.area_vectors.sum(axis=0)
        length = np.linalg.norm(mean)
        return bool(self.sheet.max() == 0 and length > 0 and (self.normals @ mean).min() > 0.7 * length)

    def same_side(self, row: Ints, other: Ints) -> Bools:
        """Whether what is close in space on the triangles `row` and `other` (m,) is so on the surface too:
        both are on one piece and face within 120 degrees of each other. Round an edge they do, on the two
        sides of a wall they do not.
        """
        if self.single_sheet:
            return np.ones(len(row), dtype=bool)
        cosine = dots(self.normals[row], self.normals[other])
        return (cosine > BACK_TO_BACK) & (self.sheet[row] == self.sheet[other])

    @cached_property
    def flat(self) -> bool:
        """Whether all triangles face the same way: each part of the region lies in a plane."""
        away = self.normals - self.normals[0]
        return bool(dots(away, away).max() < LEVEL**2)

    @cached_property
    def boundary_segments(self) -> Floats:
        """Start and end of every boundary edge, the region on the left, (S, 2, 3)."""
        if not len(self.rim):
            return np.empty((0, 2, 3))
        row, corner = self.rim.T
        ends = np.stack([(corner + 1) % 3, (corner + 2) % 3], axis=1)
        return self.corners[row[:, None], ends]

    @cached_property
    def tree(self) -> BoxTree:
        """Boxes round the triangles of the whole base."""
        return build_tree(self.base.columns)

    @cached_property
    def perimeter(self) -> float:
        """Length of all boundary loops together."""
        start, end = self.boundary_segments.swapaxes(0, 1)
        return float(np.linalg.norm(end - start, axis=1).sum())


def make_region(base: Mesh, selected: Bools, parts: Ints | None = None, gap: float = 0.0) -> Region:
    """Region made of the `selected` (T,) triangles of `base`.

    parts: (T,) numbers of sub-regions; each is bounded by its own border, and where two meet the features
    of both stay half the `gap` away from it; None: all is one

    Edges that more than two region triangles share, or that two of them run along in the same direction,
    count as boundary: bubbles do not cross them.

    Raises RegionError where nothing is selected, a coordinate is not a number or a triangle has no area.
    """
    triangles = np.flatnonzero(selected)
    if not len(triangles):
        raise RegionError("The target region is empty: select at least one face.")
    welded = weld(base)
    _check_geometry(welded, triangles)
    mesh = Mesh(welded.vertices, welded.triangles[triangles])
    return region_of(welded, mesh, triangles, None if parts is None else parts[triangles], gap)


def region_of(
    base: Mesh, mesh: Mesh, triangles: Ints, part: Ints | None, gap: float, within: Floats | None = None
) -> Region:
    """The region whose own triangles are `mesh`; for the other arguments see Region."""
    rows = mesh.triangles
    neighbours, opposite = _adjacency(rows)
    shared = np.zeros_like(neighbours, dtype=bool)
    if part is not None:
        shared = (neighbours >= 0) & (part[neighbours] != part[:, None])
        neighbours, opposite = np.where(shared, -1, neighbours), np.where(shared, -1, opposite)
    loops, rim = boundary_loops(rows, neighbours, opposite)
    reserve = np.where(shared[rim[:, 0], rim[:, 1]], gap / 2, 0.0)
    return Region(
        base,
        mesh,
        triangles,
        neighbours,
        opposite,
        _sheets(neighbours),
        loops,
        rim,
        reserve,
        within,
        part,
        gap,
    )


def weld(mesh: Mesh) -> Mesh:
    """The same triangles on vertices that are unique by position; rows of `triangles` keep their order."""
    # Sorting one opaque key per vertex is several times faster than np.unique(axis=0); adding 0.0 makes -0.0
    # equal 0.0.
    keys = np.ascontiguousarray(mesh.vertices + 0.0).view(np.dtype((np.void, 24))).ravel()
    _, first, inverse = np.unique(keys, return_index=True, return_inverse=True)
    if len(first) == len(keys):
        return mesh
    order = np.sort(first)
    rank = np.searchsorted(order, first)
    return Mesh(mesh.vertices[order], rank[inverse.reshape(-1)][mesh.triangles])


def _check_geometry(base: Mesh, triangles: Ints) -> None:
    rows = base.triangles[triangles]
    bad = ~np.isfinite(base.vertices).all(axis=1)[rows].all(axis=1)
    if bad.any():
        raise RegionError(
            f"{_count(bad, 'face')} of the target region has a coordinate that is not a number (first: face "
            f"{triangles[bad][0]}): repair or delete these faces."
        )
    corners = base.vertices[rows]
    edges = corners - corners[:, [2, 0, 1]]
    longest = np.einsum("tkc,tkc->tk", edges, edges).max(axis=1)
    across = np.cross(edges[:, 0], edges[:, 1])
    flat = dots(across, across) <= (FLAT * longest) ** 2
    if flat.any():
        at = corners[flat][0].mean(axis=0)
        raise RegionError(
            f"{_count(flat, 'face')} of the target region has no area (first: near {at[0]:.6g}, {at[1]:.6g}, "
            f"{at[2]:.6g}): merge its vertices by distance or leave it out of the selection."
        )


def _count(bad: Bools, noun: str) -> str:
    number = int(bad.sum())
    return f"One {noun}" if number == 1 else f"Each of {number} {noun}s"


def _adjacency(rows: Ints) -> tuple[Ints, Ints]:
    """Neighbour and opposite corner across the edge opposite to each corner, both (R, 3)."""
    start, end = np.roll(rows, -1, axis=1).ravel(), np.roll(rows, -2, axis=1).ravel()
    low, high = np.minimum(start, end), np.maximum(start, end)
    edge = low * (rows.max(initial=0) + 1) + high
    order = np.argsort(edge, kind="stable")
    same = np.diff(edge[order]) == 0
    # in runs of two: a third triangle at an edge makes it part of the boundary
    pair = np.flatnonzero(same & ~np.append(False, same[:-1]) & ~np.append(same[1:], False))
    one, two = order[pair], order[pair + 1]
    facing = start[one] == end[two]
    one, two = one[facing], two[facing]
    neighbours = np.full(rows.size, -1)
    opposite = np.full(rows.size, -1)
    neighbours[one], neighbours[two] = two // 3, one // 3
    opposite[one], opposite[two] = two % 3, one % 3
    return neighbours.reshape(-1, 3), opposite.reshape(-1, 3)


def _sheets(neighbours: Ints) -> Ints:
    row, corner = np.nonzero(neighbours >= 0)
    links = coo_matrix((np.ones(len(row)), (row, neighbours[row, corner])), shape=(len(neighbours),) * 2)
    return connected_components(links, directed=False)[1].astype(np.int64)


def boundary_loops(rows: Ints, neighbours: Ints, opposite: Ints) -> tuple[tuple[Ints, ...], Ints]:
    """Boundary edges chained into loops: vertex rows per loop, and all edges as (row, opposite corner) in
    loop order.
    """
    row, corner = np.nonzero(neighbours < 0)
    following = _next_boundary_edge(row, corner, neighbours, opposite)
    number = np.full(neighbours.shape, -1)
    number[row, corner] = np.arange(len(row))
    after = number[following].tolist()
    seen = [False] * len(row)
    loops: list[Ints] = []
    order: list[int] = []
    for first in range(len(row)):
        loop: list[int] = []
        at = first
        while not seen[at]:
            seen[at] = True
            loop.append(at)
            at = after[at]
        if loop:
            loops.append(rows[row[loop], (corner[loop] + 1) % 3])
            order.extend(loop)
    return tuple(loops), np.stack([row, corner], axis=1)[order]


def _next_boundary_edge(row: Ints, corner: Ints, neighbours: Ints, opposite: Ints) -> tuple[Ints, Ints]:
    """The boundary edge that leaves where each given one ends, found by turning round that vertex inside the
    region.
    """
    # the next edge of the same triangle starts where this one ends
    row, corner = row.copy(), (corner + 1) % 3
    turning = np.flatnonzero(neighbours[row, corner] >= 0)
    while len(turning):
        r, c = row[turning], corner[turning]
        row[turning], corner[turning] = neighbours[r, c], (opposite[r, c] + 1) % 3
        turning = turning[neighbours[row[turning], corner[turning]] >= 0]
    return row, corner
