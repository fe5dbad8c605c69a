"""Places on the target region and the way from one to the next.

A place is a region row (a triangle) with barycentric coordinates, so that a bubble never leaves the surface;
it moves by walking straight on across the edges (a discrete geodesic, Polthier and Schmies, "Straightest
Geodesics on Polyhedral Surfaces", 1998). Steps are complex numbers in the orthonormal frame of the triangle
they start in.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from .cycles import members
from .mesh import Bools, Floats, Ints
from .metric import Places
from .region import Region
from .vectors import dots

Complex = NDArray[np.complex128]

# How far outside a triangle, as a share of its height, still counts as inside: far below any length that
# matters.
INSIDE = -1e-12
# The corners after and before each corner of a triangle.
AFTER, BEFORE = np.array([1, 2, 0]), np.array([2, 0, 1])
# A search that has crossed so many triangles goes in circles.
MOST_PASSES = 400
# One that has crossed LONG triangles asks the nearest of about so many SIGNPOSTS.
LONG = 8
SIGNPOSTS = 1500
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

    @cached_property
    def plane(self) -> Plane:
        """How the frames of a flat region lie in its one plane, whose axes are those of the first."""
        origin = in_plane(self, self.region.corners[:, 0])
        turn = np.einsum("rc,ac->ra", self.axes[:, 0], self.axes[0]).view(np.complex128)[:, 0]
        turn /= np.abs(turn)
        gradients = self.gradients * turn[:, None]
        return Plane(origin, turn, gradients.real.copy(), gradients.imag.copy())

    @cached_property
    def rises(self) -> tuple[Floats, Floats]:
        """What the barycentric coordinates grow by per length along either axis of the frame, (R, 3) each."""
        return self.gradients.real.copy(), self.gradients.imag.copy()

    @cached_property
    def signposts(self) -> tuple[cKDTree, Ints]:
        """Places all over a flat region, (x, y, sheet) in its plane, and the triangles they are in."""
        corners = self.region.corners
        sides = np.linalg.norm(np.roll(corners, -2, axis=1) - np.roll(corners, -1, axis=1), axis=2)
        spacing = np.sqrt(self.region.area / SIGNPOSTS)
        number = np.clip(np.ceil(sides.max(axis=1) / spacing), 1, SIGNPOSTS // 10).astype(np.int64)
        owner, place = members(number)
        share = (place + 0.5) / number[owner]
        # Along the line from the middle of the shortest side to the corner opposite to it.
        bary = np.repeat((1 - share)[:, None] / 2, 3, axis=1)
        bary[np.arange(len(owner)), sides.argmin(axis=1)[owner]] = share
        posts = _posted(self, in_plane(self, positions(self, Spots(owner, bary))), owner)
        return cKDTree(posts, balanced_tree=False, compact_nodes=False), owner


class Plane(NamedTuple):
    """Triangles of a flat region in complex coordinates of its plane: origin (R,) their first corners, turn
    (R,) their frames' directions; across, along (R, 3) what the barycentric coordinates grow by per length.
    """

    origin: Complex
    turn: Complex
    across: Floats
    along: Floats


class Spots(NamedTuple):
    """Places: region row (n,) and barycentric coordinates (n, 3)."""

    row: Ints
    barycentric: Floats

    def take(self, which: Ints | Bools) -> Spots:
        """The places `which`: rows (m,) or a mask (n,)."""
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
    away = corners - corners[:, :1]
    first = away[:, 1] / np.linalg.norm(away[:, 1], axis=1, keepdims=True)
    axes = np.stack([first, np.cross(region.normals, first)], axis=1)
    flat = np.empty(corners.shape[:2], dtype=np.complex128)
    # Many times as fast as one sum over all three axes of space; in the order in which that adds up.
    for part, axis in zip((flat.real, flat.imag), axes.swapaxes(0, 1)[..., None], strict=True):
        part[:] = away[..., 0] * axis[:, 0] + away[..., 2] * axis[:, 2] + away[..., 1] * axis[:, 1]
    edges = np.roll(flat, -2, axis=1) - np.roll(flat, -1, axis=1)  # edge opposite to each corner
    # Not as a product of complex columns: with numpy 1 its last bit hangs on where in memory the result lies.
    one, two = edges[:, 0], edges[:, 1]
    twice_area = one.real * two.imag - one.imag * two.real
    gradients = 1j * edges / twice_area[:, None]
    directions = edges / np.abs(edges)
    turns = -directions[region.neighbours, region.opposite] / directions
    turns[region.neighbours < 0] = 1.0
    return Charts(region, axes, flat, gradients, turns)


def positions(charts: Charts, spots: Spots) -> Floats:
    """The places `spots` as points in space, (n, 3)."""
    return np.einsum("nk,nkc->nc", spots.barycentric, charts.region.corners[spots.row])


def on_base(region: Region, spots: Spots) -> Places:
    """The same places on triangles of the base, which keep-outs may have cut to pieces for the region."""
    points = np.einsum("nk,nkc->nc", spots.barycentric, region.corners[spots.row])
    if region.within is None:
        return Places(points, region.triangles[spots.row], spots.barycentric)
    inside = np.einsum("nk,nkc->nc", spots.barycentric, region.within[spots.row])
    return Places(points, region.triangles[spots.row], inside)


def on_region(region: Region, places: Places) -> Spots:
    """Places on triangles of the base that are in the region, seen from the region's own ones."""
    first = np.searchsorted(region.triangles, places.triangle)
    if region.within is None:
        return Spots(first, places.barycentric)
    number = np.searchsorted(region.triangles, places.triangle, side="right") - first
    owner, place = members(number)
    piece = first[owner] + place
    # in the piece where the smallest coordinate is largest
    inside = np.einsum("nk,nkc->nc", places.barycentric[owner], np.linalg.inv(region.within[piece]))
    order = np.lexsort((piece, -inside.min(axis=1), owner))
    best = order[np.cumsum(number) - number]
    inside = np.maximum(inside[best], 0)
    return Spots(piece[best], inside / inside.sum(axis=1, keepdims=True))


def to_frame(charts: Charts, row: Ints, vectors: Floats) -> Complex:
    """Vectors (n, 3) projected onto the planes of the triangles `row` (n,), as steps there, (n,)."""
    return np.einsum("nac,nc->na", charts.axes[row], vectors).view(np.complex128)[:, 0]


def to_space(charts: Charts, row: Ints, steps: Complex) -> Floats:
    """Steps (n,) in the frames of the triangles `row` as vectors in space, (n, 3)."""
    parts = np.ascontiguousarray(steps).view(np.float64).reshape(-1, 2)
    return np.einsum("na,nac->nc", parts, charts.axes[row])


def walk(
    charts: Charts, start: Spots, steps: Complex, carried: Complex | None = None, stopping: bool = True
) -> Walk:
    """Walk straight from `start` by `steps` (n,), all at once.

    Directions `carried` (n,) are transported along. A walk ends where it meets the boundary; in a plane,
    where only the end matters, it may go round what lies between. Who does not ask where it was stopped, only
    which walks were not, is answered quicker without `stopping`.
    """
    if charts.region.flat:
        return _walk_in_plane(charts, start, steps, steps if carried is None else carried, stopping)
    return _walk_straight(charts, start, steps, carried)


def _walk_straight(charts: Charts, start: Spots, steps: Complex, carried: Complex | None) -> Walk:
    """Walk over one edge after the other: every pass takes everyone over at most one."""
    row = start.row.copy()
    carried = steps.astype(np.complex128) if carried is None else carried.astype(np.complex128)
    rate = _rates(charts, row, steps)
    bary = start.barycentric + rate
    left = np.zeros(len(row), dtype=np.complex128)
    out = np.flatnonzero(_outside(bary))
    # Most steps end in the triangle they start in; from here on only the others are looked at.
    at, here, step, rate = row[out], start.barycentric[out], steps[out], rate[out]
    turned = np.ones(len(out), dtype=np.complex128)
    there = bary[out]
    while len(out):
        here, corner, share = _to_edge(here, rate, there)
        step = step * (1 - share)
        beyond, entry = charts.region.neighbours[at, corner], charts.region.opposite[at, corner]
        stopped = beyond < 0
        if stopped.any():
            ended = out[stopped]
            row[ended], bary[ended], left[ended] = at[stopped], here[stopped], step[stopped]
            carried[ended] = product(carried[ended], turned[stopped])
            on = np.flatnonzero(~stopped)
            out, at, here, step, turned = out[on], at[on], here[on], step[on], turned[on]
            corner, beyond, entry = corner[on], beyond[on], entry[on]
        turn = charts.turns[at, corner]
        here, at = _across(here, corner, entry), beyond
        step, turned = product(step, turn), product(turned, turn)
        rate = _rates(charts, at, step)
        there = here + rate
        outside = _outside(there)
        inside, on = np.flatnonzero(~outside), np.flatnonzero(outside)
        ended = out[inside]
        row[ended], bary[ended] = at[inside], there.take(inside, axis=0)
        carried[ended] = product(carried[ended], turned[inside])
        out, at, step, turned = out[on], at[on], step[on], turned[on]
        here, rate, there = here.take(on, axis=0), rate.take(on, axis=0), there.take(on, axis=0)
    return Walk(Spots(row, bary), carried, left)


def _walk_in_plane(charts: Charts, start: Spots, steps: Complex, carried: Complex, stopping: bool) -> Walk:
    """Search for where the steps end; what is not found there goes straight and ends at the boundary, or if
    there is no `stopping` stays anywhere with all of its step left.
    """
    frames = charts.plane
    ends = in_plane(charts, positions(charts, start)) + product(steps, frames.turn[start.row])
    arrived, there = search(charts, start.row, ends)
    carried = product(carried, frames.turn[start.row] * np.conj(frames.turn[arrived.row]))
    left = np.zeros(len(steps), dtype=np.complex128)
    lost = np.flatnonzero(~there)
    if len(lost) and not stopping:
        left[lost] = steps[lost]
    elif len(lost):
        straight = _walk_straight(charts, start.take(lost), steps[lost], carried[lost])
        arrived.row[lost], arrived.barycentric[lost] = straight.arrived
        carried[lost], left[lost] = straight.carried, straight.left
    return Walk(arrived, carried, left)


def in_plane(charts: Charts, points: Floats) -> Complex:
    """Points (n, 3) of a flat region as complex numbers in its plane, (n,)."""
    return np.einsum("nc,ac->na", points, charts.axes[0]).view(np.complex128)[:, 0]


def search(charts: Charts, row: Ints, ends: Complex) -> tuple[Spots, Bools]:
    """Places of points `ends` (n,) in the plane of a flat region, and which of them (n,) were found.

    Every search starts in the triangle `row` and steps over the edge that the point lies farthest beyond: it
    costs a fraction of a walk. It gives up where only the boundary is in that direction. Those that take
    long, as where narrow triangles fan out, start anew from the nearest signpost.
    """
    frames, neighbours = charts.plane, charts.region.neighbours
    row = row.copy()
    bary = np.zeros((len(row), 3))
    found = np.zeros(len(row), dtype=bool)
    out, at = np.arange(len(row)), row
    for number in range(MOST_PASSES):
        if number == LONG:
            at = nearest_signpost(charts, ends, at)
        offset = (ends - frames.origin[at])[:, None]
        here = offset.real * frames.across[at] + offset.imag * frames.along[at]
        here[:, 0] += 1
        inside = ~_outside(here)
        ended = out[inside]
        row[ended], bary[ended], found[ended] = at[inside], here[inside], True
        here, beyond = here[~inside], neighbours[at[~inside]]
        out, ends = out[~inside], ends[~inside]
        if not len(out):
            break
        here[beyond < 0] = np.inf
        corner, pick = here.argmin(axis=1), np.arange(len(out))
        going = here[pick, corner] < 0
        out, ends, at = out[going], ends[going], beyond[pick, corner][going]
    return Spots(row, bary), found


def nearest_signpost(charts: Charts, ends: Complex, row: Ints) -> Ints:
    """Triangle (n,) of the signpost nearest to each of the points `ends`, on the sheet of the triangles `row`
    (n,) or (1,).
    """
    tree, owner = charts.signposts
    return owner[tree.query(_posted(charts, ends, row))[1]]


def _posted(charts: Charts, ends: Complex, row: Ints) -> Floats:
    """Points of the plane with the sheet of their triangles as a third coordinate that keeps sheets apart."""
    apart = 10 * charts.region.extent * charts.region.sheet[row]
    return np.stack(np.broadcast_arrays(ends.real, ends.imag, apart), axis=1)


def product(a: Complex, b: Complex) -> Complex:
    """a times b, both (n,), to the same last bit wherever in memory the result lies.

    numpy 1 multiplies with other instructions, which round differently, where the result touches an operand;
    an allocator without headers between its blocks puts it there now and then.
    """
    return np.multiply(a, b, out=np.empty(len(a) + 2, dtype=np.complex128)[1:-1])


def _rates(charts: Charts, row: Ints, steps: Complex) -> Floats:
    """Change (n, 3) of the barycentric coordinates over each step."""
    across, along = charts.rises
    rate = across.take(row, axis=0)
    rate *= steps.real[:, None]
    rate += along.take(row, axis=0) * steps.imag[:, None]
    return rate


def _outside(bary: Floats) -> Bools:
    return (bary[:, 0] < INSIDE) | (bary[:, 1] < INSIDE) | (bary[:, 2] < INSIDE)


def _to_edge(here: Floats, rate: Floats, there: Floats) -> tuple[Floats, Ints, Floats]:
    """Where steps by `rate` leave their triangles on the way `there`, all (n, 3): place (n, 3), corner
    opposite to that edge (n,), share of the step made (n,).
    """
    shares = np.full(here.shape, np.inf)
    np.divide(np.maximum(here, 0), -rate, out=shares, where=there < INSIDE)
    corner = shares.argmin(axis=1)
    pick = np.arange(len(here))
    share = np.minimum(shares[pick, corner], 1.0)
    place = rate * share[:, None]
    place += here
    np.maximum(place, 0, out=place)
    place[pick, corner] = 0
    place /= (place[:, 0] + place[:, 1] + place[:, 2])[:, None]
    return place, corner, share


def _across(here: Floats, corner: Ints, entry: Ints) -> Floats:
    """The same places on an edge as seen from the triangle beyond, whose corner `entry` lies opposite
    to it.
    """
    pick = np.arange(len(here))
    crossed = np.zeros_like(here)
    crossed[pick, AFTER[entry]] = here[pick, BEFORE[corner]]
    crossed[pick, BEFORE[entry]] = here[pick, AFTER[corner]]
    return crossed


def smooth_normals(region: Region, spots: Spots) -> Floats:
    """Outward unit normals (n, 3) of the surface that the triangles stand for.

    Interpolated between corner normals, each the mean (weighted by area) of the triangles round that vertex
    that turn by less than CREASE from this one: a tessellated curve is smooth, an edge stays an edge.
    """
    if region.flat:
        return region.normals[spots.row]
    rows, of_spot = np.unique(spots.row, return_inverse=True)
    corner_normals = _corner_normals(region, rows)
    normal = np.einsum("nk,nkc->nc", spots.barycentric, corner_normals[of_spot.reshape(-1)])
    return normal / np.linalg.norm(normal, axis=1, keepdims=True)


def _corner_normals(region: Region, rows: Ints) -> Floats:
    """Unit normals (r, 3, 3) at the corners of the triangles `rows` (r,)."""
    vertices = region.mesh.triangles.ravel()
    order = np.argsort(vertices, kind="stable")
    count = np.bincount(vertices)
    start = np.cumsum(count) - count
    # Every corner meets all corners at its vertex, itself among them.
    asked = (3 * rows[:, None] + np.arange(3)).ravel()
    number = count[vertices[asked]]
    own, turn = members(number)
    other = order[start[vertices[asked[own]]] + turn] // 3
    normals = region.normals
    smooth = dots(normals[asked[own] // 3], normals[other]) > np.cos(CREASE)
    own, weighted = own[smooth], region.area_vectors[other[smooth]]
    total = np.stack([np.bincount(own, axis, len(asked)) for axis in weighted.T], axis=1)
    return (total / np.linalg.norm(total, axis=1, keepdims=True)).reshape(-1, 3, 3)
