"""Straight features as columns: an outline that runs along its axis, from above the surface to its end."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .cycles import next_round
from .feature_recipe import Feature
from .feature_sizes import FeatureSizes, sides
from .loft import frames, lids
from .mesh import Floats, Ints
from .pattern import Pattern
from .profile import outlines
from .section import Extent


@dataclass(frozen=True)
class Columns:
    """m straight holes with K corners in all, those of one after those of the other.

    feature: (m,) ids, rising; centre: (m, 3); frame: (m, 3, 3) rows x, y and z, z along the axis
    top, bottom: (m,) how far each reaches above its centre and below
    start: (m + 1,) where the corners of each begin; outline: (K, 2) places of the corners in the frame,
        counter-clockwise seen from above
    lid: (L, 3) corners of the triangles that cover the outlines; lid_owner: (L,) whose they are
    through: they pierce the wall; otherwise they end in floors
    """

    feature: Ints
    centre: Floats
    frame: Floats
    top: Floats
    bottom: Floats
    start: Ints
    outline: Floats
    lid: Ints
    lid_owner: Ints
    through: bool

    def __len__(self) -> int:
        return len(self.feature)

    @property
    def count(self) -> Ints:
        """How many corners each has, (m,)."""
        return np.diff(self.start)

    @property
    def owner(self) -> Ints:
        """Whose each corner is, (K,)."""
        return np.repeat(np.arange(len(self)), self.count)

    @property
    def side_facet(self) -> Ints:
        """Number of the facet from each corner to the next, (K,)."""
        return np.arange(len(self.outline)) + self.owner

    @property
    def floor_facet(self) -> Ints:
        """Number of the facet at the end of each, (m,)."""
        return self.start[1:] + np.arange(len(self))

    @property
    def facet_feature(self) -> Ints:
        """The feature each facet belongs to, (K + m,)."""
        return np.repeat(self.feature, self.count + 1)

    @property
    def following(self) -> Ints:
        """The next corner round, (K,)."""
        return next_round(np.diff(self.start))

    @property
    def reach(self) -> Floats:
        """How far the outlines go from their axes, (m,)."""
        return np.sqrt(np.maximum.reduceat((self.outline**2).sum(axis=1), self.start[:-1]))

    @property
    def core(self) -> Floats:
        """How near the outlines come to their axes, (m,); 0 where an axis is outside."""
        x, y = self.outline.T
        along, across = (self.outline[self.following] - self.outline).T
        apart = (x * across - y * along) / np.hypot(along, across)
        return np.maximum(np.minimum.reduceat(apart, self.start[:-1]), 0)

    def raised(self, corner: Ints, height: Floats) -> Floats:
        """Places in space, (k, 3), of `corner`, (k,), at the heights (k,) above their centres."""
        owner = self.owner[corner]
        local = np.column_stack([self.outline[corner], height])
        return np.einsum("ki,kij->kj", local, self.frame[owner]) + self.centre[owner]


def straight(feature: Feature) -> bool:
    """Is it a hole with the same outline from end to end?"""
    return (
        feature.kind == "hole" and feature.profile != "mesh" and feature.rim == "sharp" and feature.draft == 0
    )


def columns_of(
    pattern: Pattern, feature: Feature, sizes: FeatureSizes, chosen: Ints, extent: Extent
) -> Columns:
    """The columns of the `straight` features `chosen`, (m,); sizes, extent: for all n features.

    pattern: with the features' axes as normals and their headings as tangents. Facets are numbered feature by
    feature: the sides round, then the floor.
    """
    asked = sides(feature, pattern.diameter)[chosen] if len(chosen) else chosen
    groups = []
    corners = np.zeros(len(chosen), dtype=np.int64)
    for number in np.unique(asked):
        mine = np.flatnonzero(asked == number)
        outline = outlines(feature, pattern.diameter[chosen[mine]], sizes.aspect[chosen[mine]], int(number))
        flat = outline.corners
        corners[mine] = flat.shape[1]
        groups.append((mine, flat, lids(flat, outline.convex)))
    start = np.concatenate([[0], np.cumsum(corners)])
    place = np.zeros((start[-1], 2))
    lid, owner = [np.zeros((0, 3), dtype=np.int64)], [chosen[:0]]
    for mine, flat, shape in groups:
        place[start[mine][:, None] + np.arange(flat.shape[1])] = flat
        lid.append((shape + start[mine][:, None, None]).reshape(-1, 3))
        owner.append(np.repeat(mine, shape.shape[-2]))
    return Columns(
        feature=chosen,
        centre=pattern.position[chosen],
        frame=frames(pattern.normal[chosen], pattern.tangent[chosen]),
        top=extent.top[chosen],
        bottom=extent.bottom[chosen],
        start=start,
        outline=place,
        lid=np.concatenate(lid),
        lid_owner=np.concatenate(owner),
        through=feature.through,
    )
