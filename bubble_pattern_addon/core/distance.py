"""Straight distances from places to a set of line segments, exact and quick for many of both."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from .cycles import members
from .mesh import Floats, Ints

if TYPE_CHECKING:
    from scipy.spatial import cKDTree


@dataclass(frozen=True)
class Segments:
    """Line segments, ready to be asked for distances.

    pieces: (P, 2, 3) the same lines in short pieces; tree: their middles; half: half the longest piece
    """

    pieces: Floats
    tree: cKDTree
    half: float


def index_segments(segments: Floats) -> Segments:
    """Index of `segments` (S, 2, 3), at least one; a segment may be a point."""
    from scipy.spatial import cKDTree  # here, so that a recipe can be read without scipy

    pieces = _short_pieces(segments)
    half = float(np.linalg.norm(pieces[:, 1] - pieces[:, 0], axis=1).max()) / 2
    return Segments(pieces, cKDTree(pieces.mean(axis=1)), half)


def distance_to(segments: Segments, points: Floats, within: float = np.inf) -> Floats:
    """Distance of every one of `points` (n, 3) to the nearest segment, (n,); those farther than `within` may
    be told as infinitely far.
    """
    return nearest_piece(segments, points, within)[0]


def nearest_piece(segments: Segments, points: Floats, within: float = np.inf) -> tuple[Floats, Ints]:
    """Distance of every one of `points` (n, 3) to the nearest piece, (n,), and which that is, (n,); those
    farther than `within` may be told as infinitely far from any, -1.

    Exact: the pieces with the nearest middles are measured, more of them until none left out can be nearer.
    """
    best = np.full(len(points), np.inf)
    which = np.full(len(points), -1)
    open_rows = np.arange(len(points))
    if np.isfinite(within):
        bound = (within + segments.half) * (1 + 1e-9)
        open_rows = np.flatnonzero(np.isfinite(segments.tree.query(points, distance_upper_bound=bound)[0]))
    k = min(4, len(segments.pieces))
    while len(open_rows):
        step = max(1, 1_000_000 // k)
        beyond = np.empty(len(open_rows))
        for start in range(0, len(open_rows), step):
            rows = open_rows[start : start + step]
            reach, piece = segments.tree.query(points[rows], np.arange(1, k + 1))
            away = _point_segment(points[rows, None], segments.pieces[piece])
            nearest, pick = away.argmin(axis=1), np.arange(len(rows))
            best[rows], which[rows] = away[pick, nearest], piece[pick, nearest]
            beyond[start : start + step] = reach[:, -1] - segments.half
        open_rows = open_rows[beyond < best[open_rows]] if k < len(segments.pieces) else open_rows[:0]
        k = min(2 * k, len(segments.pieces))
    return best, which


def boundary_distance(points: Floats, segments: Floats, within: float = np.inf) -> Floats:
    """Distance of every one of `points` (n, 3) to the nearest of the `segments` (S, 2, 3), (n,); inf when
    there are none. Those farther than `within` may be told as infinitely far.
    """
    if not len(segments) or not len(points):
        return np.full(len(points), np.inf)
    return distance_to(index_segments(segments), points, within)


def _short_pieces(segments: Floats) -> Floats:
    """The same line in pieces of about even length, (P, 2, 3), at most about twice as many as segments."""
    a, b = segments[:, 0], segments[:, 1]
    length = np.linalg.norm(b - a, axis=1)
    longest = length.sum() / max(len(segments), 64)
    count = np.maximum(np.ceil(length / longest), 1).astype(int) if longest > 0 else np.ones(len(a), int)
    owner, index = members(count)
    start = (index / count[owner])[:, None]
    end = ((index + 1) / count[owner])[:, None]
    along = (b - a)[owner]
    return np.stack([a[owner] + start * along, a[owner] + end * along], axis=1)


def _point_segment(points: Floats, segments: Floats) -> Floats:
    """Distances of points (..., 3) to segments (..., 2, 3), broadcast."""
    a = segments[..., 0, :]
    along = segments[..., 1, :] - a
    to = points - a
    squared = np.einsum("...c,...c->...", along, along)
    share = np.einsum("...c,...c->...", to, along) / np.where(squared > 0, squared, 1.0)
    return np.linalg.norm(to - np.clip(share, 0.0, 1.0)[..., None] * along, axis=-1)
