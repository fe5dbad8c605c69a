"""Places on the target region and the way from one to the next.

A place is a region row (a triangle) with barycentric coordinates, so that a bubble never leaves the surface;
it moves by walking straight on across the edges (a discrete geodesic, Polthier and Schmies, "Straightest
Geodesics on Polyhedral Surfaces", 1998). Steps are complex numbers in the orthonormal frame of the triangle
they start in.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .mesh import Floats, Ints
from .region import Region

Complex = NDArray[np.complex128]

# How far outside a triangle, as a share of its height, still counts as inside: far below any length that
# matters.
INSIDE = -1e-12
# Faces that turn by more than this meet in an edge, not in a smooth surface.
CREASE = np.radians(35.0)


@dataclass(frozen=True)
class Charts:
    """The plane frames of a region's triangles and how they fit together.

    region: the region they belong to
    axes: (R, 2, 3) orthonormal axes of each triangle's plane; axis 0 runs along the edge from corner 0 to
    corner 1
    corners: (R, 3) corner positions in the frame, corner 0 at the origin
    gradients: (R, 3) gradients of the three barycentric coordinates
    turns: (R, 3) unit rotations that take a step from this frame into that of the neighbour opposite to each
    corner
    """

    region: Region
    axes: Floats
    corners: Complex
    gradients: Complex
    turns: Complex


class Spots(NamedTuple):
    """Places: region row (n,) and barycentric coordinates (n, 3)."""

    row: Ints
    barycentric: Floats

    def take(self, which: Ints | NDArray[np.bool_]) -> Spots:
        """The places `which`."""
        return Spots(self.row[which], self.barycentric[which])


class Walk(NamedTuple):
    """Where a walk ended. arrived: places; carried: (n,) directions brought along, in the new frame; left:
    (n,) what remained of the step where the boundary stopped it, 0 elsewhere.
    """

    arrived: Spots
    carried: Complex
    left: Complex


def make_charts(region: Region) -> Charts:
    """Frames of the region's triangles."""
    corners = region.corners
    first = corners[:, 1] - corners[:, 0]
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    axes = np.stack([first, np.cross(region.normals, first)], axis=1)
    local = np.einsum("rkc,rac->rka", corners - corners[:, :1], axes)
    flat = local[..., 0] + 1j * local[..., 1]
    edges = np.roll(flat, -2, axis=1) - np.roll(flat, -1, axis=1)  # edge opposite to each corner
    twice_area = np.imag(np.conj(edges[:, 0]) * edges[:, 1])
    gradients = 1j * edges / twice_area[:, None]
    directions = edges / np.abs(edges)
    turns = np.ones_like(directions)
    row, corner = np.nonzero(region.neighbours >= 0)
    beyond, opposite = region.neighbours[row, corner], region.opposite[row, corner]
    turns[row, corner] = -directions[beyond, opposite] / directions[row, corner]
    return Charts(region, axes, flat, gradients, turns)


def positions(charts: Charts, spots: Spots) -> Floats:
    """Points in space, (n, 3)."""
    return np.einsum("nk,nkc->nc", spots.barycentric, charts.region.corners[spots.row])


def to_frame(charts: Charts, row: Ints, vectors: Floats) -> Complex:
    """Vectors (n, 3) projected onto the planes of the triangles `row` (n,)."""
    return np.einsum("nac,nc->na", charts.axes[row], vectors).view(np.complex128)[:, 0]


def to_space(charts: Charts, row: Ints, steps: Complex) -> Floats:
    """Steps (n,) in the frames of the triangles `row` as vectors in space, (n, 3)."""
    parts = np.ascontiguousarray(steps).view(np.float64).reshape(-1, 2)
    return np.einsum("na,nac->nc", parts, charts.axes[row])


def walk(charts: Charts, start: Spots, steps: Complex, carried: Complex | None = None) -> Walk:
    """Walk straight from `start` by `steps` (n,), all at once: every pass takes everyone over at most one
    edge.

    Directions `carried` (n,) are transported along. A walk ends where it meets the boundary.
    """
    row, bary = start.row.copy(), start.barycentric.copy()
    left = steps.astype(np.complex128, copy=True)
    carried = left.copy() if carried is None else carried.copy()
    neighbours, opposite = charts.region.neighbours, charts.region.opposite
    active = np.arange(len(row))
    while len(active):
        at, here, step = row[active], bary[active], left[active]
        rate = np.real(np.conj(charts.gradients[at]) * step[:, None])
        there = here + rate
        leaving = there.min(axis=1) < INSIDE
        inside = ~leaving
        bary[active[inside]] = there[inside]
        left[active[inside]] = 0
        active, at, here = active[leaving], at[leaving], here[leaving]
        step, rate = step[leaving], rate[leaving]
        with np.errstate(divide="ignore", invalid="ignore"):
            share = np.where(here + rate < INSIDE, np.maximum(here, 0) / -rate, np.inf)
        corner = share.argmin(axis=1)
        pick = np.arange(len(active))
        share = np.minimum(share[pick, corner], 1.0)
        here = np.maximum(here + share[:, None] * rate, 0)
        here[pick, corner] = 0
        here /= here.sum(axis=1, keepdims=True)
        step = step * (1 - share)
        beyond, entry = neighbours[at, corner], opposite[at, corner]
        stopped = beyond < 0
        bary[active[stopped]], left[active[stopped]] = here[stopped], step[stopped]
        crossing = ~stopped
        active, pick = active[crossing], pick[crossing]
        at, corner, beyond, entry = at[crossing], corner[crossing], beyond[crossing], entry[crossing]
        crossed = np.zeros((len(active), 3))
        order = np.arange(len(active))
        crossed[order, (entry + 1) % 3] = here[pick, (corner + 2) % 3]
        crossed[order, (entry + 2) % 3] = here[pick, (corner + 1) % 3]
        turn = charts.turns[at, corner]
        row[active], bary[active], left[active] = beyond, crossed, step[pick] * turn
        carried[active] *= turn
    return Walk(Spots(row, bary), carried, left)


def smooth_normals(region: Region, spots: Spots) -> Floats:
    """Outward unit normals (n, 3) of the surface that the triangles stand for.

    Interpolated between corner normals, each the mean (weighted by area) of the triangles round that vertex
    that turn by less than CREASE from this one: a tessellated curve is smooth, an edge stays an edge.
    """
    corner_normals = _corner_normals(region)
    normal = np.einsum("nk,nkc->nc", spots.barycentric, corner_normals[spots.row])
    return normal / np.linalg.norm(normal, axis=1, keepdims=True)


def _corner_normals(region: Region) -> Floats:
    vertices = region.base.triangles[region.triangles].ravel()
    vertex, corner_of = np.unique(vertices, return_inverse=True)
    corner_of = corner_of.reshape(-1)
    order = np.argsort(corner_of, kind="stable")
    count = np.bincount(corner_of, minlength=len(vertex))
    start = np.cumsum(count) - count
    # Every corner meets all corners at its vertex, itself among them.
    own = np.repeat(np.arange(len(vertices)), count[corner_of])
    turn = np.arange(len(own)) - np.repeat(np.cumsum(count[corner_of]) - count[corner_of], count[corner_of])
    other = order[start[corner_of[own]] + turn]
    normals = region.normals
    smooth = np.einsum("mc,mc->m", normals[own // 3], normals[other // 3]) > np.cos(CREASE)
    own, other = own[smooth], other[smooth]
    weighted = region.area_vectors[other // 3]
    total = np.stack([np.bincount(own, axis, len(vertices)) for axis in weighted.T], axis=1)
    return (total / np.linalg.norm(total, axis=1, keepdims=True)).reshape(-1, 3, 3)
