"""Pinned bubbles: they stay where the designer wants them, the others are packed round them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.spatial import cKDTree

from ..boundary import signature
from ..errors import RegionError
from ..mesh import Bools, Floats, Ints
from ..snapping import snapped
from ..surface import Charts, Spots, positions
from ..vectors import dots
from .bubbles import Ground, joined
from .crowding import close_pairs
from .rim import Lengths, Track, spots_on_track

# A point farther than this from the region, in pitches, is not meant for it.
OFF_REGION = 1.0
# Pins nearer to one another than this, in pitches, have no room for a feature each.
TOO_NEAR = 0.5
# A pin this near to the first row's track, in pitches, is of the first row.
ON_TRACK = 0.25
# Bubbles of the first row, and corners of its track, give way to a pin nearer than this.
GIVES_WAY = 0.8
# So do bubbles of the lattice; whoever is farther off is pushed aside.
PUSHED = 0.6


def on_surface(charts: Charts, points: Floats, pitch: Lengths, what: str) -> Spots:
    """The places of `points` (n, 3) on the region. RegionError, which calls them `what`, where some are far
    from it.
    """
    if not len(points):
        return Spots(np.empty(0, dtype=np.int64), np.empty((0, 3)))
    spots, distance = snapped(charts.region, points)
    off = np.flatnonzero(distance > OFF_REGION * pitch(spots))
    if len(off):
        x, y, z = points[off[0]]
        are = f"One {what} is" if len(off) == 1 else f"{len(off):,} {what}s are"
        raise RegionError(
            f"{are} off the target region (first: near {x:.6g}, {y:.6g}, {z:.6g}): move back onto it or "
            "delete what is there."
        )
    return spots


def check_apart(charts: Charts, pins: Spots, local: Floats) -> None:
    """RegionError where two pins (n,), of these local pitches (n,), are too near to one another."""
    if len(local) < 2:
        return
    points = positions(charts, pins)
    where = signature(charts.region, points, pins.row, float(local.max()))
    pairs = close_pairs(where, TOO_NEAR * local)
    if len(pairs):
        one, other = pairs[0]
        x, y, z = points[one]
        raise RegionError(
            f"Two pinned features near {x:.6g}, {y:.6g}, {z:.6g} are {{distance}} apart, less than half the "
            "pitch of {pitch}: move one of them, or unpin it.",
            distance=float(np.linalg.norm(points[one] - points[other])),
            pitch=float(local[one]),
        )


def track_through(track: Track, charts: Charts, pins: Spots, local: Floats) -> tuple[Track, Bools]:
    """The first row's track with a corner at every pin near it, so that the row is even between the pins;
    and which of the pins (n,) these are.
    """
    on = np.zeros(len(local), dtype=bool)
    if not len(track.arc) or not len(local):
        return track, on
    points = positions(charts, pins)
    knot, share, away = _nearest_on(track, points, local)
    on = away < ON_TRACK * local
    if not on.any():
        return track, on
    knot, share = knot[on], share[on]
    arc = track.arc[knot] + share * (track.arc[knot + 1] - track.arc[knot])
    at = spots_on_track(charts, track, arc)
    near = cKDTree(arc[:, None]).query(track.arc[:, None])[0] < GIVES_WAY
    order = np.argsort(np.concatenate([track.arc, arc]), kind="stable")

    spots = joined(track.spots, at)
    return replace(
        track,
        spots=spots.take(order),
        points=np.concatenate([track.points, positions(charts, at)])[order],
        arc=np.concatenate([track.arc, arc])[order],
        chain=np.concatenate([track.chain, track.chain[knot]])[order],
        sharp=np.concatenate([track.sharp & ~near, np.ones(len(arc), dtype=bool)])[order],
    ), on


def _nearest_on(track: Track, points: Floats, local: Floats) -> tuple[Ints, Floats, Floats]:
    """The piece of the track nearest to each of `points` (n, 3): the knot that it begins with (n,), the share
    of the way to the next (n,), and how far it is (n,).
    """
    start, end = track.points[:-1], track.points[1:]
    along = end - start
    square = np.maximum(dots(along, along), 1e-300)
    offset = points[:, None] - start
    share = np.clip(np.einsum("nkc,kc->nk", offset, along) / square, 0, 1)
    away = np.linalg.norm(offset - share[..., None] * along, axis=2)
    away[:, np.diff(track.chain) > 0] = np.inf
    knot, pick = away.argmin(axis=1), np.arange(len(points))
    return knot, share[pick, knot], away[pick, knot]


def with_pins(ground: Ground, along: Spots, between: Spots) -> tuple[Spots, int]:
    """All that stays where it is: the first row `along` the boundary and `between` narrow places, less what
    is in the way of the ground's pins, and these; and how many of them, the last, are of no first row.
    """
    pins = ground.pins
    if pins is None:
        return joined(along, between), 0
    row = [clear_of(ground, spots, pins.spots, GIVES_WAY) for spots in (along, between)]
    inner = pins.spots.take(~pins.on_track)
    return joined(*row, pins.spots.take(pins.on_track), inner), len(inner.row)


def clear_of(ground: Ground, spots: Spots, others: Spots, pitches: float) -> Spots:
    """The places that are farther than so many local pitches from the `others`."""
    if not len(others.row) or not len(spots.row):
        return spots
    charts, local = ground.charts, ground.pitch(spots)
    reach = float(local.max())
    tree = cKDTree(signature(charts.region, positions(charts, others), others.row, reach))
    distance, _ = tree.query(signature(charts.region, positions(charts, spots), spots.row, reach))
    return spots.take(distance > pitches * local)
