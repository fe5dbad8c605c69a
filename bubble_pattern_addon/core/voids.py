"""Voids of an arrangement: the largest circle between the bubbles that holds none of their centres."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from .distance import index_segments, nearest_piece
from .mesh import Bools, Floats, Ints
from .neighbours import SHEET_TURN, Neighbours, tangent_axes
from .vectors import dots

# Smaller circles, in pitches, are no voids: three neighbours of a square are 0.71 from its middle.
LEAST = 0.72
# Half-way between two neighbours farther apart than this, in pitches, there may be a void as well.
WIDE = 1.2
# A place belongs to the void when it is at least this share of the first row's distance from the boundary.
CLEAR = 0.95
# Bubbles farther from the middle than the nearest by no more than this factor touch the void too, if it is
# LARGE, in pitches, by no more than the other; they surround it when no angle between two is wider than that.
TOUCHING, TOUCHING_LARGE, LARGE = 1.03, 1.4, 1.2
SURROUNDED = np.radians(190.0)
# So many of the nearest bubbles are asked who is nearest on the same sheet.
NEAREST = 12


def largest_void(
    position: Floats,
    normal: Floats,
    pitch: Floats,
    near: Neighbours,
    boundary_segments: Floats,
    rim: Floats,
) -> float:
    """Distance from the middle of the largest void to the nearest bubble, as a share of the mean pitch of the
    three that are nearest; nan where no two bubbles are neighbours.

    Voids are sought where three Voronoi cells meet and half-way between neighbours that are far apart, no
    nearer to the boundary than the first row, whose distances in pitches are `rim` (r,).

    position: (n, 3); normal: (n, 3) unit; pitch: (n,); near: their neighbours; boundary_segments: (S, 2, 3)
    """
    every_middle, every_owner = _middles(position, normal, pitch, near)
    beside = np.linalg.norm(every_middle - position[every_owner], axis=1) / pitch[every_owner]
    # Only what could be a void is worth a closer look, but there is always a largest.
    for least in (LEAST, 0.0):
        middle, owner = every_middle[beside > least], every_owner[beside > least]
        clear = CLEAR * float(rim.min(initial=0.5)) * pitch[owner]
        inside = _inside(middle, normal[owner], boundary_segments, clear)
        middle, owner = middle[inside], owner[inside]
        share = _emptiness(middle, position[owner], normal[owner], position, normal, pitch)
        if share.any():
            return float(share.max())
    return np.nan


def _middles(position: Floats, normal: Floats, pitch: Floats, near: Neighbours) -> tuple[Floats, Ints]:
    """Places (m, 3) that may be the middles of voids, and a bubble beside each, (m,)."""
    along = near.distance * np.exp(1j * near.angle)
    relative = near.distance / pitch[near.first]
    share = np.column_stack([near.ends, np.where(relative > WIDE, 0.0, np.inf)])
    pair, which = np.nonzero(np.isfinite(share))
    # The edge runs square to the way between both, through its middle.
    offset = along[pair] * (0.5 + 1j * share[pair, which])
    owner = near.first[pair]
    axes = tangent_axes(normal)[owner]
    flat = np.stack([offset.real, offset.imag], axis=1)
    return position[owner] + np.einsum("ma,mac->mc", flat, axes), owner


def _emptiness(
    places: Floats, beside: Floats, facing: Floats, position: Floats, normal: Floats, pitch: Floats
) -> Floats:
    """Distance from places (m, 3) on sheets that are `facing` (m, 3) to the nearest bubble there, as a share
    of the mean pitch of the three nearest, (m,); 0 for places that the nearest ones do not surround: from
    there a larger circle is farther on.

    No farther than to the bubble each is `beside` (m, 3), in whose tangent plane it is: where the surface
    bends or folds, others seem farther from there than they are.
    """
    if not len(places):
        return np.empty(0)
    count = min(NEAREST, len(position))
    distance, other = cKDTree(position).query(places, np.arange(1, count + 1))
    distance[np.einsum("mc,mkc->mk", facing, normal[other]) <= SHEET_TURN] = np.inf
    order = np.argsort(distance, axis=1, kind="stable")
    distance, other = np.take_along_axis(distance, order, axis=1), np.take_along_axis(other, order, axis=1)
    there = np.isfinite(distance)
    size = np.where(there, pitch[other], 0.0)[:, :3].sum(axis=1) / np.maximum(there[:, :3].sum(axis=1), 1)
    nearest = np.minimum(distance[:, 0], np.linalg.norm(places - beside, axis=1))
    # the neighbours across a large void are not known, and its middle only nearly
    reach = np.where(nearest > LARGE * size, TOUCHING_LARGE, TOUCHING)
    touching = there & (distance <= reach[:, None] * distance[:, :1])
    flat = np.einsum("mkc,mac->mka", position[other] - places[:, None], tangent_axes(facing))
    surrounded = _widest_gap(np.arctan2(flat[..., 1], flat[..., 0]), touching) < SURROUNDED
    return np.where(surrounded, nearest, 0.0) / np.maximum(size, 1e-300)


def _widest_gap(angle: Floats, counts: Bools) -> Floats:
    """Widest angle, (m,), between one of the directions `angle` (m, k) that count and the next one round."""
    last = np.max(np.where(counts, angle, -np.pi), axis=1)
    turn = np.sort(np.where(counts, angle, last[:, None]), axis=1)
    return np.maximum(np.diff(turn, axis=1).max(axis=1, initial=0.0), turn[:, 0] + 2 * np.pi - last)


def _inside(places: Floats, normal: Floats, segments: Floats, clear: Floats) -> Bools:
    """Which places (m, 3) are left of the boundary `segments` (S, 2, 3) and `clear` (m,) of it."""
    if not len(segments) or not len(places):
        return np.ones(len(places), dtype=bool)
    index = index_segments(segments)
    distance, piece = nearest_piece(index, places)
    start, end = index.pieces[piece].swapaxes(0, 1)
    inward = np.cross(normal, end - start)
    # Of two that meet at a corner either tells the side, as places nearest to the corner see both from one.
    return (dots(places - start, inward) > 0) & (distance >= clear)
