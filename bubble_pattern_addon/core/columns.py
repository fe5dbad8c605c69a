"""Straight features as columns: an outline that runs along its axis, from above the surface to its end."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .cutters import Cutters
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
    wall, floor: (m,) number of the facet between the first corner and the second, those of the other sides
        follow; and of the facet at the bottom
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
    wall: Ints
    floor: Ints
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
    def following(self) -> Ints:
        """The next corner round, (K,)."""
        following = np.arange(1, len(self.outline) + 1)
        following[self.start[1:] - 1] = self.start[:-1]
        return following

    @property
    def reach(self) -> Floats:
        """How far the outlines go from their axes, (m,)."""
        return np.sqrt(np.maximum.reduceat((self.outline**2).sum(axis=1), self.start[:-1]))

    def raised(self, corner: Ints, height: Floats) -> Floats:
        """Places in space, (k, 3), of `corner`, (k,), at the heights (k,) above their centres."""
        owner = self.owner[corner]
        local = np.column_stack([self.outline[corner], height])
        return np.einsum("ki,kij->kj", local, self.frame[owner]) + self.centre[owner]


def straight(feature: Feature) -> bool:
    """Is it a hole with the same outline from end to end?"""
    return feature.kind == "hole" and feature.profile != "mesh" and feature.rim == "sharp" and feature.draft == 0


def columns_of(
    pattern: Pattern, feature: Feature, sizes: FeatureSizes, cutters: Cutters, extent: Extent
) -> Columns:
    """The `straight` features of which `cutters` are the solids.

    pattern: with the features' axes as normals and their headings as tangents; sizes, extent: for all n
    features
    """
    facets = np.bincount(cutters.feature, minlength=len(pattern))
    chosen = np.flatnonzero(facets)
    count = sides(feature, pattern.diameter)[chosen]
    flat, triangles, owners = [], [], []
    for number in np.unique(count):
        mine = np.flatnonzero(count == number)
        which = chosen[mine]
        outline = outlines(feature, pattern.diameter[which], sizes.aspect[which], int(number))
        flat.append((mine, outline.corners))
        lid = lids(outline.corners, outline.convex)
        triangles.append(np.broadcast_to(lid, (len(mine), *lid.shape[-2:])))
        owners.append(mine)
    corners = np.zeros(len(chosen), dtype=np.int64)
    for mine, outline in flat:
        corners[mine] = outline.shape[1]
    start = np.concatenate([[0], np.cumsum(corners)])
    places = np.empty((start[-1], 2))
    for mine, outline in flat:
        places[start[mine][:, None] + np.arange(outline.shape[1])] = outline
    first = np.empty(len(pattern), dtype=np.int64)
    first[cutters.feature[::-1]] = np.arange(len(cutters.feature))[::-1]
    ends = np.flatnonzero(cutters.cap < 0)
    floor = np.empty(len(pattern), dtype=np.int64)
    floor[cutters.feature[ends]] = ends
    return Columns(
        feature=chosen,
        centre=pattern.position[chosen],
        frame=frames(pattern.normal[chosen], pattern.tangent[chosen]),
        top=extent.top[chosen],
        bottom=extent.bottom[chosen],
        start=start,
        outline=places,
        wall=first[chosen],
        floor=floor[chosen],
        lid=np.concatenate(
            [(lid + start[mine][:, None, None]).reshape(-1, 3) for lid, mine in zip(triangles, owners, strict=True)]
        ),
        lid_owner=np.concatenate(
            [np.repeat(mine, lid.shape[1]) for lid, mine in zip(triangles, owners, strict=True)]
        ),
        through=feature.through,
    )
