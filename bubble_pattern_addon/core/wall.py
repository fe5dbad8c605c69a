"""The near wall under every feature: how thick it is, where a straight cutter must start and end.

A feature looks down its axis at the disc it covers. Every triangle of the base is cut to that disc in closed
form, so what is measured holds for the whole disc and not for a few sample rays: a sloping far side, a rib
half under the hole or a next wall close behind are seen wherever they are.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

import numpy as np

from .boxtree import BoxTree, meeting_cylinders
from .mesh import Bools, Floats, Ints, Mesh
from .pattern import Pattern

STEEPEST = 3.0
"""Times its radius that the surface may rise or fall under a feature (about 72 degrees) before it counts as
folded.
"""
CLEARANCE = 0.2
"""Times its radius that a cutter stands over the surface, and out of the wall's far side, where there is
room.
"""
DEEPEST = 20.0
"""Times its diameter that a through-hole may be deep unless the recipe says otherwise."""
BLOCK = 4096
"""Features looked at together: bounds the memory."""


class Fault(IntEnum):
    """Why a feature cannot be cut."""

    NONE = 0
    OFF = 1
    FOLDED = 2
    THICK = 3
    CROWDED = 4
    BREAKS = 5
    MEETS = 6
    COVERED = 7
    CLOSED = 8
    RIM = 9
    FLAT = 10
    STEEP_CAP = 11
    THIN = 12
    AVERTED = 13


@dataclass(frozen=True)
class NearWall:
    """Heights along the features' normals, 0 at their centres, outward positive; all (n,).

    thickness: of the wall along the axis; nan where no far side was found
    top: where a cutter starts, clear of the surface and of what hangs above it
    far_low: lowest point of the wall's far side under the disc; nan where none was found
    far_high: highest point of that far side
    bottom: where a through cutter ends, clear of the far side and of the next wall
    fault: Fault of a through-hole there
    surface_low, surface_high: lowest and highest point of the surface under the disc
    over: height of what hangs above the surface, inf where nothing does
    seen_feature, seen_triangle, seen_low, seen_high: (k,) every triangle with a part inside a feature's
        cylinder
        and the heights of that part
    seen_axis: (k,) height at which the feature's axis crosses that triangle, nan where it does not
    """

    thickness: Floats
    top: Floats
    far_low: Floats
    far_high: Floats
    bottom: Floats
    fault: Ints
    surface_low: Floats
    surface_high: Floats
    over: Floats
    seen_feature: Ints
    seen_triangle: Ints
    seen_low: Floats
    seen_high: Floats
    seen_axis: Floats


def near_wall(
    base: Mesh, tree: BoxTree, pattern: Pattern, deepest: Floats, highest: Floats | None = None
) -> NearWall:
    """Wall under every feature of `pattern`, looked for down to `deepest`, (n,), below its centre, along its
    normal; at least up to `highest`, (n,).
    """
    highest = np.zeros(len(pattern)) if highest is None else highest
    blocks = []
    for start in range(0, max(len(pattern), 1), BLOCK):
        ids = np.arange(start, min(start + BLOCK, len(pattern)))
        blocks.append(_look(base, tree, pattern, ids, deepest[ids], highest[ids]))
    return NearWall(*(np.concatenate(parts) for parts in zip(*blocks, strict=True)))


def _look(
    base: Mesh, tree: BoxTree, pattern: Pattern, ids: Ints, deepest: Floats, highest: Floats
) -> tuple[np.ndarray, ...]:
    """One block of `near_wall`: the fields of NearWall."""
    centre, normal, radius = pattern.position[ids], pattern.normal[ids], pattern.diameter[ids] / 2
    up = np.maximum((STEEPEST + 2 * CLEARANCE) * radius, highest + CLEARANCE * radius)
    down = deepest + 2 * radius
    owner, triangle = meeting_cylinders(
        tree, centre + up[:, None] * normal, centre - down[:, None] * normal, radius
    )
    spans = disc_spans(_local(base, pattern, ids, owner, triangle), radius[owner])
    owner, triangle, spans = owner[spans.inside], triangle[spans.inside], spans.only(spans.inside)
    sheets = _Sheets(owner, spans, 1e-6 * radius)

    front, back = spans.facing > 0, spans.facing < 0
    upright = spans.facing == 0
    surface_low, surface_high = sheets.grow(front | upright, np.zeros(len(ids)))
    on_base = sheets.any(front & (spans.low <= sheets.slack[owner]) & (spans.high >= -sheets.slack[owner]))
    below = back & np.isfinite(spans.axis) & (spans.axis < -sheets.slack[owner])
    first = sheets.highest(below, spans.axis)
    thickness = np.where(np.isfinite(first), -first, np.nan)
    far_low, far_high = sheets.grow(back | upright, np.where(np.isfinite(first), first, np.nan))

    over = sheets.lowest(spans.low > surface_high[owner] + sheets.slack[owner], spans.low)
    under = sheets.highest(spans.high < far_low[owner] - sheets.slack[owner], spans.high)
    clear = CLEARANCE * radius
    top = surface_high + np.minimum(clear, (over - surface_high) / 2)
    bottom = far_low - np.minimum(clear, (far_low - under) / 2)
    # another wall's front that starts above the lowest point of this wall's far side
    beside = sheets.any(
        front
        & (spans.high < surface_low[owner] - sheets.slack[owner])
        & (spans.high >= far_low[owner] - sheets.slack[owner])
    )
    fault = np.zeros(len(ids), dtype=np.int64)
    # something over the surface whose underside dips below the surface's highest point under the disc
    covering = sheets.any(
        back
        & (spans.low > np.nan_to_num(far_high, nan=-np.inf)[owner] + sheets.slack[owner])
        & (spans.low <= surface_high[owner] + sheets.slack[owner])
    )
    fault[beside] = Fault.CROWDED
    fault[~np.isfinite(thickness) | (-far_low > deepest)] = Fault.THICK
    fault[covering] = Fault.COVERED
    fault[(surface_high > STEEPEST * radius) | (surface_low < -STEEPEST * radius)] = Fault.FOLDED
    fault[~on_base] = Fault.OFF
    seen = (ids[owner], triangle, spans.low, spans.high, spans.axis)
    surface = (surface_low, surface_high, over)
    return (thickness, top, far_low, far_high, bottom, fault, *surface, *seen)


def _local(base: Mesh, pattern: Pattern, ids: Ints, owner: Ints, triangle: Ints) -> Floats:
    """Corners of each triangle in the frame of its feature, z along the normal, (m, 3, 3)."""
    normal = pattern.normal[ids]
    tangent = pattern.tangent[ids]
    tangent = tangent - np.einsum("ij,ij->i", tangent, normal)[:, None] * normal
    tangent /= np.linalg.norm(tangent, axis=1)[:, None]
    frame = np.stack([tangent, np.cross(normal, tangent), normal], axis=1)
    place = np.ascontiguousarray(base.triangles[triangle].T)
    # a row per coordinate and corner, several times faster to work on
    local = np.zeros((3, 3, len(owner)))
    for axis in range(3):
        offset = base.vertices[:, axis][place] - pattern.position[ids, axis][owner]
        for side in range(3):
            local[side] += offset * frame[:, side, axis][owner]
    return local.transpose(2, 1, 0)


@dataclass(frozen=True)
class Spans:
    """What a disc looking down its axis sees of triangles; all (m,).

    low, high: heights of the part inside the disc; inside: is there such a part; facing: 1 towards the
    viewer, -1 away, 0 edge-on; axis: height where the axis crosses the triangle, nan where it does not
    """

    low: Floats
    high: Floats
    inside: Bools
    facing: Ints
    axis: Floats

    def only(self, chosen: Bools) -> Spans:
        """Those of the spans that are `chosen`, (m,)."""
        return Spans(
            self.low[chosen], self.high[chosen], self.inside[chosen], self.facing[chosen], self.axis[chosen]
        )


def disc_spans(local: Floats, radius: Floats) -> Spans:
    """Cut triangles `local`, (m, 3, 3), to the cylinder of `radius`, (m,), round the z axis.

    Height is linear on a triangle, so over triangle and disc together it is extreme at a corner inside the
    disc, where an edge crosses the circle, or at the two points of the circle along the gradient, if they
    lie in the triangle.
    """
    # a row per corner, several times faster to work on
    x, y, height = corners = np.ascontiguousarray(local.transpose(2, 1, 0))
    along = corners[:, [1, 2, 0]] - corners
    low, high = np.full(len(local), np.inf), np.full(len(local), -np.inf)

    def take(heights: Floats, valid: Bools) -> None:
        """Widen each span to those of its `heights` that are `valid`, both (k, m)."""
        np.minimum(low, np.where(valid, heights, np.inf).min(axis=0), out=low)
        np.maximum(high, np.where(valid, heights, -np.inf).max(axis=0), out=high)

    distance = x * x + y * y - radius**2
    take(height, distance <= 0)
    square = along[0] * along[0] + along[1] * along[1]
    half = along[0] * x + along[1] * y
    root = half * half - square * distance
    crossing = (root >= 0) & (square > 0)
    root, square = np.sqrt(np.where(crossing, root, 0)), np.where(crossing, square, 1)
    for share in ((-root - half) / square, (root - half) / square):
        take(height + share * along[2], crossing & (share >= 0) & (share <= 1))

    plane = _cross(along[:, 0], along[:, 1])
    size = np.sqrt((plane * plane).sum(axis=0))
    facing = np.where(np.abs(plane[2]) > 1e-6 * size, np.sign(plane[2]), 0).astype(np.int64)
    slope = np.sqrt(plane[0] * plane[0] + plane[1] * plane[1])
    steep = slope > 1e-12 * size
    uphill = np.where(steep, plane[:2] / np.where(steep, slope, 1), [[1.0], [0.0]])
    for point in (radius * uphill, -radius * uphill):
        found = _height_at(corners, along, plane, facing, point, radius)
        take(found[None], np.isfinite(found))
    axis = _height_at(corners, along, plane, facing, np.zeros_like(uphill), radius)
    return Spans(low, high, high >= low, facing, axis)


def _cross(a: Floats, b: Floats) -> Floats:
    """Cross products of vectors given as rows of coordinates, (3, m)."""
    return np.stack([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]])


def _height_at(
    corners: Floats, along: Floats, plane: Floats, facing: Ints, point: Floats, radius: Floats
) -> Floats:
    """Height of each triangle over `point`, (2, m); nan where the point is outside (edges count as inside).

    corners, along: (3 coordinates, 3, m) corners and the edges from them; plane: (3, m) area vectors
    """
    x, y = point[0] - corners[0], point[1] - corners[1]
    side = along[0] * y - along[1] * x
    slack = 1e-9 * radius * (np.abs(along[0]) + np.abs(along[1]))
    inside = np.all(side * facing >= -slack, axis=0) & (facing != 0)
    fall = plane[0] * x[0] + plane[1] * y[0]
    return np.where(inside, corners[2, 0] - fall / np.where(inside, plane[2], 1), np.nan)


@dataclass(frozen=True)
class _Sheets:
    """Spans gathered per feature. owner: (m,) feature of each span; slack: (n,) heights closer than this are
    equal.
    """

    owner: Ints
    spans: Spans
    slack: Floats

    def lowest(self, chosen: Bools, heights: Floats) -> Floats:
        """Least of the `heights`, (m,), of each feature's `chosen` spans, (m,): (n,), inf for none."""
        found = np.full(len(self.slack), np.inf)
        np.minimum.at(found, self.owner[chosen], heights[chosen])
        return found

    def highest(self, chosen: Bools, heights: Floats) -> Floats:
        """Largest of the `heights`, (m,), of each feature's `chosen` spans, (m,): (n,), -inf for none."""
        found = np.full(len(self.slack), -np.inf)
        np.maximum.at(found, self.owner[chosen], heights[chosen])
        return found

    def any(self, chosen: Bools) -> Bools:
        """Which features have a span that is `chosen`, (m,): (n,)."""
        return np.bincount(self.owner[chosen], minlength=len(self.slack)) > 0

    def grow(self, chosen: Bools, seed: Floats) -> tuple[Floats, Floats]:
        """Lowest and highest of the chosen spans that hang together with the height `seed`, both (n,).

        A sheet is connected, so the heights it takes over the disc are one interval without gaps.
        """
        low, high = seed.copy(), seed.copy()
        slack = self.slack[self.owner]
        waiting = chosen.copy()
        while True:
            touching = (
                waiting
                & (self.spans.low <= high[self.owner] + slack)
                & (self.spans.high >= low[self.owner] - slack)
            )
            if not touching.any():
                return low, high
            waiting &= ~touching
            np.minimum.at(low, self.owner[touching], self.spans.low[touching])
            np.maximum.at(high, self.owner[touching], self.spans.high[touching])
