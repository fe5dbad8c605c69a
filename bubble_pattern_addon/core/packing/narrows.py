"""Where the region is too narrow for two rows: one row in the middle."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from ..boundary import nearest_boundary, signature
from ..mesh import Bools, Floats, Ints
from ..surface import Spots, positions, to_frame, walk
from .bubbles import Ground
from .crowding import close_pairs, uncrowded
from .rim import CLOSEST, FirstRow, on_track, spots_on_track

# Two rows of a hexagonal arrangement are this far apart, in pitches; nearer lines have room for one row.
ROW_DISTANCE = 0.85
# Knots within this stretch of the line belong to a bubble's own side.
OWN_SIDE = 0.45
# How many knots round a bubble are searched for one of the other side.
KNOTS = 48
# A closed line of fewer pitches has no room for two bubbles across.
SMALL_LOOP = 2.6


def in_the_narrows(ground: Ground, row: FirstRow) -> tuple[FirstRow, Spots]:
    """The first row without those in narrow places, and places in the middle for these.

    A place is narrow where the inset line comes back, in the other direction, nearer than two rows are apart.
    A single row runs along the middle there; a bubble alone in its part of the region stands in that middle.
    """
    nobody = Spots(np.empty(0, dtype=np.int64), np.empty((0, 3)))
    if not len(row.arc):
        return row, nobody
    spots = spots_on_track(ground.charts, ground.track, row.arc)
    aside = _to_the_middle(ground, row, spots)
    narrow = ~np.isnan(aside[:, 0])
    if not narrow.any():
        return row, nobody
    start = spots.take(narrow)
    middle = walk(ground.charts, start, to_frame(ground.charts, start.row, aside[narrow])).arrived
    clear = _keeps_clear(ground, middle)
    if not clear.any():
        return row, nobody
    narrow[narrow] = clear
    middle = middle.take(clear)
    pitch = ground.pitch(middle)
    where = signature(ground.charts.region, positions(ground.charts, middle), middle.row, float(pitch.max()))
    kept = uncrowded(close_pairs(where, CLOSEST * pitch), np.arange(len(pitch)))
    return row.take(~narrow), middle.take(kept)


def _keeps_clear(ground: Ground, spots: Spots) -> Bools:
    """Whether bubbles at these places would stay inside the boundary: beside an acute corner they may not."""
    if ground.boundary is None:
        return np.ones(len(spots.row), dtype=bool)
    distance, _ = nearest_boundary(ground.boundary, positions(ground.charts, spots), spots.row)
    return distance > 0.499 * ground.pitch(spots) + ground.edge_offset


def _to_the_middle(ground: Ground, row: FirstRow, spots: Spots) -> Floats:
    """Way (n, 3) from each bubble to the middle between both sides, nan where the place is not narrow."""
    track, charts = ground.track, ground.charts
    points, _, knot = on_track(track, row.arc)
    pitch = ground.pitch(spots)
    reach = float(pitch.max())
    tree = cKDTree(signature(charts.region, track.points, track.spots.row, reach))
    count = min(KNOTS, len(track.arc))
    at = signature(charts.region, points, spots.row, reach)
    distance, near = tree.query(at, k=count, distance_upper_bound=ROW_DISTANCE * reach)
    near = near.reshape(len(points), count)
    found = (near < len(track.arc)) & (distance.reshape(near.shape) < ROW_DISTANCE * pitch[:, None])
    near = np.minimum(near, len(track.arc) - 1)
    along = _directions(ground)
    before = np.where(track.chain[np.maximum(knot - 1, 0)] == track.chain[knot], knot - 1, knot)
    # A corner's bubble stands at the end of one direction and at the start of the next.
    against = np.minimum(
        np.einsum("nc,nkc->nk", along[knot], along[near]),
        np.einsum("nc,nkc->nk", along[np.maximum(before, 0)], along[near]),
    )
    found &= (against < -0.5) & (_apart(ground, row, knot, near) > OWN_SIDE)
    first = found.argmax(axis=1)
    pick = np.arange(len(points))
    other = near[pick, first]
    across = track.points[other] - points
    across -= np.einsum("nc,nc->n", across, along[other])[:, None] * along[other]
    way = np.where(found[pick, first][:, None], across / 2, np.nan)
    return _alone(ground, knot, points, way)


def _directions(ground: Ground) -> Floats:
    """Unit direction (K, 3) of the track from every knot; a line's last knot has that of the one before."""
    track = ground.track
    along = np.diff(track.points, axis=0, append=track.points[-1:])
    last = np.flatnonzero(np.append(np.diff(track.chain) > 0, True))
    along[last] = along[last - 1]
    return along / np.maximum(np.linalg.norm(along, axis=1, keepdims=True), 1e-300)


def _apart(ground: Ground, row: FirstRow, knot: Ints, near: Ints) -> Floats:
    """Length of line (n, k), in pitches, between bubbles and knots; infinite between different lines."""
    track = ground.track
    apart = np.abs(track.arc[near] - row.arc[:, None])
    around = row.around[:, None]
    apart = np.where(around > 0, np.minimum(apart, np.abs(around - apart)), apart)
    return np.where(track.chain[near] == track.chain[knot][:, None], apart, np.inf)


def _alone(ground: Ground, knot: Ints, points: Floats, way: Floats) -> Floats:
    """The same ways, to the middle of its line for a bubble that has a small closed line to itself."""
    track = ground.track
    lines = len(track.closed)
    first = np.searchsorted(track.chain, np.arange(lines))
    last = np.searchsorted(track.chain, np.arange(lines), side="right") - 1
    small = track.closed & (track.arc[last] - track.arc[first] < SMALL_LOOP)
    small &= np.bincount(track.chain[knot], minlength=lines) == 1
    size = np.bincount(track.chain, minlength=lines)
    centre = (
        np.stack([np.bincount(track.chain, axis, lines) for axis in track.points.T], axis=1) / size[:, None]
    )
    line = track.chain[knot]
    return np.where(small[line][:, None], centre[line] - points, way)
