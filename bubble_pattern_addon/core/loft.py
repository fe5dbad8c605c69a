"""Features of every kind as solids: outlines lofted from section to section, all features at once.

One template of corners and triangles is made per distinct number of facets; which kind, profile, rim and
draft it is only shows in where the corners go.
"""

from __future__ import annotations

from dataclasses import dataclass

import manifold3d
import numpy as np

from .cutters import Cutters, alternating, composed
from .feature_recipe import Feature
from .feature_sizes import FeatureSizes, chord_height, sides
from .mesh import Bools, Floats, Ints
from .pattern import Pattern
from .profile import outlines, signed_area
from .section import Extent, Sections, ring_counts, sections

AS_GOOD_AS_FLAT = 1e-12


def make_solids(
    pattern: Pattern, feature: Feature, sizes: FeatureSizes, chosen: Ints, extent: Extent
) -> Cutters:
    """Solids of the features `chosen`, (m,), as far as `extent` says; sizes, extent: for all n features.

    pattern: with the features' axes as normals and their headings as tangents. A profile's circle measures
    the diameter exactly: see profile.outlines.
    """
    diameter, sizes, extent = pattern.diameter[chosen], sizes.take(chosen), extent.take(chosen)
    count = sides(feature, pattern.diameter)[chosen] if len(chosen) else np.zeros(0, dtype=np.int64)
    chord = chord_height(diameter, count)
    ring = ring_counts(feature, sizes, extent, diameter / 2, chord)
    frame = frames(pattern.normal[chosen], pattern.tangent[chosen])
    groups = []
    for number, turns in np.unique(np.stack([count, ring], axis=1), axis=0):
        mine = np.flatnonzero((count == number) & (ring == turns))
        local = local_solids(feature, diameter[mine], sizes.take(mine), extent.take(mine), number, turns)
        places = np.einsum("mvi,mij->mvj", local.corners, frame[mine])
        places += pattern.position[chosen[mine], None]
        groups.append((places, local.triangles, local.facet, local.cap, chosen[mine]))
    return composed(groups)


def frames(normal: Floats, tangent: Floats) -> Floats:
    """Rows x, y and z of features with these axes and headings, (n, 3, 3)."""
    x = tangent - np.einsum("ij,ij->i", tangent, normal)[:, None] * normal
    x /= np.linalg.norm(x, axis=1)[:, None]
    return np.stack([x, np.cross(normal, x), normal], axis=1)


@dataclass(frozen=True)
class LocalSolids:
    """Solids of m features that are alike in their facets, in their own frames.

    corners: (m, v, 3); triangles: (t, 3) or, where the features' caps are split in different ways, (m, t, 3)
    facet: (t,) flat facet each triangle is of; cap: (facets,) 1 for the top, -1 for the bottom, else 0
    """

    corners: Floats
    triangles: Ints
    facet: Ints
    cap: Ints


def local_solids(
    feature: Feature, diameter: Floats, sizes: FeatureSizes, extent: Extent, count: int, turns: int
) -> LocalSolids:
    """Solids of features, all (m,), with `count` facets round and `turns` along their roundings."""
    outline = outlines(feature, diameter, sizes.aspect, int(count))
    stack = sections(feature, sizes, extent, diameter / 2, int(turns))
    flat = outline.at(stack.inset) * stack.scale[:, :, None, None]
    number, levels, k, _ = flat.shape
    corners = np.concatenate(
        [flat, np.broadcast_to(stack.height[:, :, None, None], (number, levels, k, 1))], axis=3
    )
    first, last = int(stack.low_tip), levels - int(stack.high_tip)
    tips = [corners[:, at, :1] * [0, 0, 1] for at, tip in ((0, stack.low_tip), (-1, stack.high_tip)) if tip]
    points = np.concatenate([corners[:, first:last].reshape(number, -1, 3), *tips], axis=1)
    bent = feature.profile == "ellipse" and bool(stack.inset.any())
    triangles, facet, facets = _walls(last - first, k, stack, bent)
    parts, faces, cap = [triangles], [facet], [np.zeros(facets, dtype=np.int64)]
    for at, tip, side in ((first, stack.low_tip, -1), (last - 1, stack.high_tip, 1)):
        if tip:
            continue
        lid = lids(flat[:, at], outline.convex) + (at - first) * k
        parts.append(lid if side > 0 else lid[..., ::-1])
        faces.append(np.full(lid.shape[-2], facets))
        cap.append(np.array([side]))
        facets += 1
    return LocalSolids(points, _side_by_side(parts), np.concatenate(faces), np.concatenate(cap))


def _side_by_side(parts: list[Ints]) -> Ints:
    """Triangles of all parts: (t, 3) where all are the same for every feature, else (m, t, 3)."""
    number = max((part.shape[0] for part in parts if part.ndim == 3), default=0)
    if number:
        parts = [np.broadcast_to(part, (number, *part.shape[-2:])) for part in parts]
    return np.concatenate(parts, axis=-2)


def _walls(levels: int, k: int, stack: Sections, bent: bool) -> tuple[Ints, Ints, int]:
    """Triangles of the wall over `levels` rings of k corners, and over the tips that come after all rings;
    their facets and how many these are. bent: the two triangles between four corners are not one facet.
    """
    here = np.arange(k)
    there = np.roll(here, -1)
    parts, facets, number = [], [], 0
    for level in range(levels - 1):
        low, high = level * k, (level + 1) * k
        parts += [
            np.stack([here + low, there + low, there + high], axis=1),
            np.stack([here + low, there + high, here + high], axis=1),
        ]
        facets += [number + here, number + here + (k if bent else 0)]
        number += 2 * k if bent else k
    fans = []
    if stack.low_tip:
        fans.append(np.stack([there, here], axis=1))
    if stack.high_tip:
        fans.append(np.stack([here, there], axis=1) + (levels - 1) * k)
    for point, fan in enumerate(fans, levels * k):
        parts.append(np.column_stack([fan, np.full(k, point)]))
        facets.append(number + here)
        number += k
    return np.concatenate(parts), np.concatenate(facets), number


def lids(outline: Floats, convex: bool) -> Ints:
    """Triangles over outlines (m, k, 2), wound like them: (k - 2, 3), or (m, k - 2, 3) where one way does not
    do for all of them.
    """
    number, k, _ = outline.shape
    if convex:
        return alternating(k)
    found = np.zeros((number, k - 2, 3), dtype=np.int64)
    left = np.arange(number)
    while len(left):
        # most often what does for one does for all
        lid = np.asarray(manifold3d.triangulate([outline[left[0]]]), dtype=np.int64)
        good = fits(outline[left], lid)
        good[0] = True
        found[left[good]] = lid
        left = left[~good]
    return found[0] if (found == found[0]).all() else found


def fits(outline: Floats, lid: Ints) -> Bools:
    """Do the triangles `lid`, (t, 3), cover the outlines (m, k, 2) without folds? (m,)."""
    areas = signed_area(outline[:, lid])
    return np.asarray(areas.min(axis=1) >= -AS_GOOD_AS_FLAT * np.abs(areas).sum(axis=1))
