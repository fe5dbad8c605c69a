"""Figures of a pattern: its order, gaps, first row and voids, its webs, margins and open area.

All figures of `Quality` are relative to the local pitch: neither the unit nor the size of the part matters.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from .distance import boundary_distance
from .mesh import Bools, Floats, Ints
from .neighbours import neighbours
from .voids import largest_void

if TYPE_CHECKING:
    from .pattern import Pattern
    from .region import Region

INTERIOR = 1.25
"""A bubble farther than this many pitches from the region's boundary is interior: from the second row on."""


@dataclass(frozen=True)
class Quality:
    """How good a packing is. A figure with nothing to measure (no interior bubble, no first row) is nan.

    six: share of interior bubbles with exactly six neighbours
    psi6: mean over interior bubbles of |sum of exp(6 i angle)| / number of neighbours; 1 on a perfect lattice
    gap_cv: standard deviation / mean of the distance to the nearest bubble relative to the pitch, all bubbles
    gap_min: smallest of these relative distances
    rim_cv: standard deviation / mean of the first row's distances to the boundary relative to the pitch
    void: the largest of the distances from a place between bubbles to the nearest one, as a share of their
    pitch (see core/voids.py): 0.58 on a perfect lattice, about 0.8 where rows meet at odds, from 1 on there
    is room for another bubble
    """

    six: float
    psi6: float
    gap_cv: float
    gap_min: float
    rim_cv: float
    void: float = np.nan


def measure(pattern: Pattern, region: Region) -> Quality:
    """Quality of a pattern on its target region."""
    return measure_points(
        pattern.position, pattern.normal, pattern.pitch, pattern.row, region.boundary_segments
    )


def measure_points(
    position: Floats, normal: Floats, pitch: Floats, row: Ints, boundary_segments: Floats
) -> Quality:
    """Quality of any points, so that other programs' arrangements are measured by the same rule.

    position: (n, 3); normal: (n, 3) unit; pitch: (n,) local centre distance; row: (n,) 0 for the first row
    along the boundary; boundary_segments: (S, 2, 3), none for a closed surface
    """
    n = len(position)
    to_boundary = boundary_distance(position, boundary_segments) / pitch
    interior = to_boundary > INTERIOR
    near = neighbours(position, normal, pitch)
    count = np.bincount(near.first, minlength=n)
    star = np.bincount(near.first, np.cos(6 * near.angle), n) + 1j * np.bincount(
        near.first, np.sin(6 * near.angle), n
    )
    order = np.abs(star) / np.maximum(count, 1)
    gap = np.full(n, np.inf)
    np.minimum.at(gap, near.first, near.distance / pitch[near.first])
    gap = gap[np.isfinite(gap)]
    rim = to_boundary[(row == 0) & np.isfinite(to_boundary)]
    return Quality(
        six=_mean(count[interior] == 6),
        psi6=_mean(order[interior]),
        gap_cv=_variation(gap),
        gap_min=float(gap.min()) if len(gap) else np.nan,
        rim_cv=_variation(rim),
        void=largest_void(position, normal, pitch, near, boundary_segments, rim),
    )


def min_web(pattern: Pattern) -> float:
    """Least material between features of one sheet, |xi - xj| - (di + dj) / 2, a length in the unit of the
    base, below 0 where they overlap; inf without neighbours.
    """
    near = neighbours(pattern.position, pattern.normal, pattern.pitch)
    if not len(near.first):
        return np.inf
    web = near.distance - (pattern.diameter[near.first] + pattern.diameter[near.second]) / 2
    return float(web.min())


def min_margin(pattern: Pattern, region: Region) -> float:
    """Least distance from a feature's edge to the region's boundary, in the unit of the base, below 0 where
    it is crossed; inf when there is no such pair.
    """
    if not len(pattern) or not len(region.boundary_segments):
        return np.inf
    distance = boundary_distance(pattern.position, region.boundary_segments)
    return float((distance - pattern.diameter / 2).min())


def open_area(pattern: Pattern, region: Region) -> float:
    """Share of the region's area, 0 to 1, that the features take at the surface, rim and draft included."""
    share = 1.0 if pattern.share is None else pattern.share
    return float(np.pi / 4 * (share * pattern.diameter**2).sum() / region.area)


def _mean(values: Floats | Bools) -> float:
    return float(values.mean()) if len(values) else np.nan


def _variation(values: Floats) -> float:
    return float(values.std() / values.mean()) if values.any() else np.nan
