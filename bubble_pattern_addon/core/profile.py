"""The outline of a feature square to its axis, for all features at once, and moved inward as draft and rim
ask.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from .mesh import Bools, Floats, Ints

if TYPE_CHECKING:
    from .feature_recipe import Feature

# What is as round as can be keeps straight edges of this share, so that no two corners fall together.
STRAIGHT = 0.02
# Of a rounded corner that has been moved inward by more than its radius this share of it stays.
KEPT_ROUND = 0.05


@dataclass(frozen=True)
class Outlines:
    """Closed outlines of n features, k corners each, counter-clockwise seen from outside, round the axis.

    A corner lies at base + push (d + sign rho) + rho out for an inset d, with rho = radius - sign d: straight
    edges move inward by d, arcs about their own centre, convex ones smaller and concave ones larger.

    base, push, out: (n or 1, k, 2) lengths, and pure numbers; radius: (n or 1, k) of the arc a corner is on,
    0 for none; sign: (k,) 1 where the outline is convex, -1 where it is concave
    room: (n,) the largest inset, where nothing is left of the outline or its sides meet
    """

    base: Floats
    push: Floats
    out: Floats
    radius: Floats
    sign: Ints
    room: Floats

    def __len__(self) -> int:
        return len(self.room)

    def at(self, inset: Floats) -> Floats:
        """Corners moved inward by `inset`, (n, s): (n, s, k, 2)."""
        inset = inset[:, :, None]
        radius = self.radius[:, None]
        # what is sharp stays sharp
        rho = np.where(radius > 0, np.maximum(radius - self.sign * inset, KEPT_ROUND * radius), 0.0)
        push = (inset + self.sign * rho)[..., None]
        return self.base[:, None] + self.push[:, None] * push + rho[..., None] * self.out[:, None]

    @property
    def corners(self) -> Floats:
        """The outlines as they are, (n, k, 2)."""
        return self.at(np.zeros((len(self), 1)))[:, 0]

    @property
    def convex(self) -> bool:
        """None has a concave corner."""
        return bool((self.sign > 0).all())


def outlines(feature: Feature, diameter: Floats, aspect: Floats, count: int) -> Outlines:
    """Outlines of features with these diameters, narrow over long side `aspect`, both (n,), and `count`
    facets round a full turn.

    The circle round each about the axis measures the diameter: its farthest corner lies on that. Only a
    circle across flats reaches beyond, by 1/cos(pi/count).
    """
    unit = _unit(feature, np.clip(aspect, 1e-3, 1.0), count)
    reach = np.linalg.norm(unit.corners, axis=2).max(axis=1)
    if feature.profile == "circle" and feature.across == "flats":
        reach = reach * np.cos(np.pi / count)
    size = np.broadcast_to(diameter / 2 / reach, len(diameter))
    room = unit.room * size
    if feature.profile == "circle":
        room = diameter / 2
    return Outlines(
        unit.base * size[:, None, None], unit.push, unit.out, unit.radius * size[:, None], unit.sign, room
    )


def _unit(feature: Feature, aspect: Floats, count: int) -> Outlines:
    """Outlines of about the size 1, (n of aspects)."""
    profile = feature.profile
    if profile in ("circle", "mesh"):
        return _arcs(np.zeros((1, 1, 2)), np.ones(1), np.zeros(1), np.full((1, 1), 2 * np.pi), count, True)
    if profile == "ellipse":
        return _ellipse(aspect, count)
    if profile == "slot":
        return _slot(np.minimum(aspect, 1 - STRAIGHT), count)
    if profile == "drop":
        return _drop(np.minimum(aspect, 1 - STRAIGHT), feature.rounding, count)
    if profile == "rectangle":
        one = np.ones_like(aspect)
        corners = np.stack([[one, -aspect], [one, aspect], [-one, aspect], [-one, -aspect]])
        return _cornered(corners.transpose(2, 0, 1), feature.rounding * aspect, aspect, count)
    if profile == "cross":
        return _cross(np.minimum(aspect, 0.9), feature.rounding, count)
    if profile == "polygon":
        turn = 2 * np.pi / feature.corners * np.arange(feature.corners)
        corners = np.stack([np.cos(turn), np.sin(turn)], axis=1)[None]
        inner = np.full(1, np.cos(np.pi / feature.corners))
        return _cornered(corners, feature.rounding * inner, inner, count)
    corners = counter_clockwise(np.array(feature.points))
    room = _curve_room(feature.points) * np.linalg.norm(corners, axis=1).max()
    return _cornered(corners[None], np.zeros(1), np.full(1, room), count)


def _arcs(
    centre: Floats, radius: Floats, start: Floats, sweep: Floats, count: int, closed: bool = False
) -> Outlines:
    """Arcs round `centre`, (n, a, 2), of one `radius`, (n,), from the angles `start`, (a,), on by `sweep`,
    (n or 1, a); the last corner of one that is closed would be its first.
    """
    steps = np.maximum(2, np.ceil(count * sweep.max(axis=0) / (2 * np.pi) - 1e-9)).astype(np.int64)
    arc = np.repeat(np.arange(len(start)), steps + (not closed))
    share = np.concatenate([np.arange(number + (not closed)) / number for number in steps])
    angle = start[arc] + sweep[:, arc] * share
    out = np.stack([np.cos(angle), np.sin(angle)], axis=2)
    return Outlines(
        centre[:, arc],
        np.zeros((1, len(arc), 2)),
        out,
        np.repeat(radius[:, None], len(arc), axis=1),
        np.ones(len(arc), dtype=np.int64),
        radius,
    )


def _ellipse(aspect: Floats, count: int) -> Outlines:
    """Half as long as 1: an inset takes the same from both half axes, which keeps it an ellipse."""
    angle = 2 * np.pi / count * np.arange(count)
    round_ = np.stack([np.cos(angle), np.sin(angle)], axis=1)[None]
    base = round_ * np.stack([np.ones_like(aspect), aspect], axis=1)[:, None]
    none = np.zeros((1, count))
    return Outlines(base, -round_, round_, none, np.ones(count, dtype=np.int64), aspect)


def _slot(aspect: Floats, count: int) -> Outlines:
    centre = np.zeros((len(aspect), 2, 2))
    centre[:, :, 0] = (1 - aspect)[:, None] * [1, -1]
    sweep = np.full((1, 2), np.pi)
    # even, so that a corner lies at the very end
    return _arcs(centre, aspect, np.array([-np.pi / 2, np.pi / 2]), sweep, 4 * -(-count // 4))


def _drop(aspect: Floats, rounding: float, count: int) -> Outlines:
    """A circle and its two tangents that meet in a tip, from -1 to 1 along x."""
    lean = np.arccos(aspect / (2 - aspect))  # from the axis to where the tangents leave the circle
    centre = np.stack([aspect - 1, np.zeros_like(aspect)], axis=1)[:, None]
    sweep = 2 * (np.pi - lean)[:, None]
    body = _arcs(centre, aspect, np.zeros(1), sweep, count)
    angle = lean[:, None] + np.arctan2(body.out[..., 1], body.out[..., 0]) % (2 * np.pi)
    # arcs start at the angle 0: turn each to where its own tangent leaves
    body_out = np.stack([np.cos(angle), np.sin(angle)], axis=2)
    ends = 2 * int(np.ceil(count * lean.max() / (2 * np.pi))) if rounding else 0
    share = np.linspace(-1, 1, ends + 1) if ends else np.zeros(1)
    turn = lean[:, None] * share
    tip = np.zeros((len(aspect), len(share), 2))
    push = tip.copy()
    tip[..., 0] = 1
    push[..., 0] = -((2 - aspect) / aspect)[:, None]
    tip_radius = np.repeat(rounding * (1 - STRAIGHT) * aspect[:, None], len(share), axis=1)
    k = body.out.shape[1]
    return Outlines(
        np.concatenate([np.repeat(centre, k, axis=1), tip], axis=1),
        np.concatenate([np.zeros((len(aspect), k, 2)), push], axis=1),
        np.concatenate([body_out, np.stack([np.cos(turn), np.sin(turn)], axis=2)], axis=1),
        np.concatenate([body.radius, tip_radius], axis=1),
        np.ones(k + len(share), dtype=np.int64),
        aspect,
    )


def _cross(aspect: Floats, rounding: float, count: int) -> Outlines:
    """Two bars from -1 to 1, `aspect` as wide as long."""
    one = np.ones_like(aspect)
    arm = np.stack([[one, -aspect], [one, aspect], [aspect, aspect]]).transpose(2, 0, 1)
    arms = [arm]
    for _ in range(3):
        arms.append(arms[-1][..., ::-1] * [-1, 1])
    corners = np.concatenate(arms, axis=1)
    return _cornered(corners, rounding * np.minimum(aspect, (1 - aspect) / 2), aspect, count)


def _cornered(corners: Floats, radius: Floats, room: Floats, count: int) -> Outlines:
    """Polygons, (n, c, 2), whose corners are rounded by `radius`, (n,); alike in the angles they turn by."""
    along = np.roll(corners, -1, axis=1) - corners
    along /= np.linalg.norm(along, axis=2, keepdims=True)
    before = np.roll(along, 1, axis=1)
    turn = np.arctan2(_cross2(before, along), np.einsum("nci,nci->nc", before, along))
    inward, inward_before = _left(along), _left(before)
    # the corner moves along this for every edge to move by 1
    push = (inward + inward_before) / (1 + np.einsum("nci,nci->nc", inward, inward_before))[..., None]
    sign = np.where(turn[0] < 0, -1, 1)
    if not radius.any():
        none = np.zeros((1, corners.shape[1]))
        return Outlines(corners, push, np.zeros_like(push), none, sign, room)
    steps = np.maximum(2, np.ceil(count * np.abs(turn).max(axis=0) / (2 * np.pi) - 1e-9)).astype(np.int64)
    corner = np.repeat(np.arange(len(steps)), steps + 1)
    share = np.concatenate([np.arange(number + 1) / number for number in steps])
    away = -inward_before * sign[:, None]
    angle = np.arctan2(away[..., 1], away[..., 0])[:, corner] + turn[:, corner] * share
    return Outlines(
        corners[:, corner],
        push[:, corner],
        np.stack([np.cos(angle), np.sin(angle)], axis=2),
        np.repeat((1 - STRAIGHT) * radius[:, None], len(corner), axis=1),
        sign[corner],
        room,
    )


def _left(along: Floats) -> Floats:
    """Directions (..., 2) turned to the left by a right angle."""
    return np.stack([-along[..., 1], along[..., 0]], axis=-1)


def _cross2(a: Floats, b: Floats) -> Floats:
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]


def signed_area(corners: Floats) -> Floats:
    """Area of polygons (..., k, 2), above 0 where they run counter-clockwise."""
    after = np.roll(corners, -1, axis=-2)
    return np.asarray(_cross2(corners, after).sum(axis=-1) / 2)


def counter_clockwise(corners: Floats) -> Floats:
    """The polygon (k, 2) in that sense."""
    return corners if signed_area(corners) > 0 else corners[::-1].copy()


def covered(corners: Floats) -> Floats:
    """Radius of the largest circle about the axis inside each of the polygons (n, k, 2), 0 where the axis is
    outside: (n,).
    """
    along = np.roll(corners, -1, axis=1) - corners
    square = np.einsum("nki,nki->nk", along, along)
    share = np.clip(-np.einsum("nki,nki->nk", corners, along) / np.where(square > 0, square, 1), 0, 1)
    nearest = np.linalg.norm(corners + share[..., None] * along, axis=2).min(axis=1)
    after = np.roll(corners, -1, axis=1)
    turn = np.arctan2(_cross2(corners, after), np.einsum("nki,nki->nk", corners, after)).sum(axis=1)
    inside: Bools = np.abs(turn) > np.pi
    return np.where(inside, nearest, 0.0)


def largest_inset(points: Floats) -> float:
    """How far the edges of a simple polygon, (k, 2), can move inward before one vanishes or two of them meet,
    relative to its farthest corner, or a little less; 0 for a polygon that is not simple. Found by halving.
    """
    reach = np.linalg.norm(points, axis=1).max()
    if not (np.isfinite(reach) and reach > 0):
        return 0.0
    corners = counter_clockwise(points / reach)
    along = np.roll(corners, -1, axis=0) - corners
    if np.linalg.norm(along, axis=1).min() < 1e-9 or not _simple(corners):
        return 0.0
    whole = _cornered(corners[None], np.zeros(1), np.zeros(1), 4)
    if not np.isfinite(whole.push).all():
        return 0.0
    low, high = 0.0, 1.0
    for _ in range(30):
        middle = (low + high) / 2
        moved = whole.at(np.full((1, 1), middle))[0, 0]
        edges = np.roll(moved, -1, axis=0) - moved
        if np.einsum("ki,ki->k", edges, along).min() > 0 and _simple(moved):
            low = middle
        else:
            high = middle
    return low


@lru_cache(16)
def _curve_room(points: tuple[tuple[float, float], ...]) -> float:
    return largest_inset(np.array(points))


def _simple(corners: Floats) -> bool:
    """Does a polygon that should run counter-clockwise enclose what its area says, in one piece?"""
    import manifold3d  # here, so that a recipe without curves can be read without it

    area = float(signed_area(corners))
    section = manifold3d.CrossSection([corners], manifold3d.FillRule.Positive)
    return area > 0 and section.num_contour() == 1 and abs(section.area() - area) < 1e-6 * area
