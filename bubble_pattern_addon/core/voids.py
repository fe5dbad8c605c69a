"""Voids of an arrangement: the largest circle between the bubbles that holds none of their centres."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from .distance import index_segments, nearest_piece
from .mesh import Bools, Floats, Ints
from .neighbours import SHEET_TURN, Neighbours, tangent_axes

# Smaller circles, in pitches, are no voids: three neighbours of a square are 0.71 from its middle.
LEAST = 0.75
# Half-way between two neighbours farther apart than this, in pitches, there may be a void as well.
WIDE = 1.2
# A place belongs to the void when it is at least this share of the first row's distance from the boundary.
CLEAR = 0.95
# So many of the nearest bubbles are asked who is nearest on the same sheet.
NEAREST = 8


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
    middle, owner = _middles(position, normal, pitch, near)
    if not len(middle):
        return np.nan
    share = _emptiness(middle, normal[owner], position, normal, pitch)
    # Only what could be a void is worth asking whether it is inside, but there is always a largest.
    for least in (LEAST, 0.0):
        wide = np.flatnonzero(share > least)
        clear = CLEAR * float(rim.min(initial=0.5)) * pitch[owner[wide]]
        inside = _inside(middle[wide], normal[owner[wide]], boundary_segments, clear)
        if inside.any():
            return float(share[wide[inside]].max())
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


def _emptiness(places: Floats, facing: Floats, position: Floats, normal: Floats, pitch: Floats) -> Floats:
    """Distance from places (m, 3) on sheets that are `facing` (m, 3) to the nearest bubble there, as a share
    of the mean pitch of the three nearest, (m,).
    """
    count = min(NEAREST, len(position))
    distance, other = cKDTree(position).query(places, np.arange(1, count + 1))
    away = np.einsum("mc,mkc->mk", facing, normal[other]) <= SHEET_TURN
    distance[away] = np.inf
    order = np.argsort(distance, axis=1, kind="stable")[:, :3]
    nearest = np.take_along_axis(other, order, axis=1)
    there = np.isfinite(np.take_along_axis(distance, order, axis=1))
    size = np.where(there, pitch[nearest], 0.0).sum(axis=1) / np.maximum(there.sum(axis=1), 1)
    return np.where(there[:, 0], distance.min(axis=1), 0.0) / np.maximum(size, 1e-300)


def _inside(places: Floats, normal: Floats, segments: Floats, clear: Floats) -> Bools:
    """Which places (m, 3) are left of the boundary `segments` (S, 2, 3) and not nearer to it than `clear` (m,)."""
    if not len(segments) or not len(places):
        return np.ones(len(places), dtype=bool)
    index = index_segments(segments)
    distance, piece = nearest_piece(index, places)
    start, end = index.pieces[piece].swapaxes(0, 1)
    inward = np.cross(normal, end - start)
    # Of two that meet at a corner either tells the side, as places nearest to the corner see both from one.
    return (np.einsum("mc,mc->m", places - start, inward) > 0) & (distance >= clear)
