"""Any closed mesh as a feature: scaled to each diameter, and set into the surface or onto it.

A mesh stands on its own plane z = 0, which comes to lie on the surface: what a bump shows is above, what a
hole takes is below. Where the surface is curved, the other side is drawn out along the axis until it is clear
of the surface, and so is a bump that ends on its plane.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from .closed import measure
from .cutters import Cutters, composed
from .errors import RecipeError
from .feature_recipe import Feature
from .feature_sizes import FeatureSizes
from .loft import frames
from .mesh import Floats, Ints, Mesh
from .pattern import Pattern
from .section import Extent

ON_PLANE = 1e-9


@dataclass(frozen=True)
class Stamp:
    """A closed mesh whose farthest corner is at a distance of 1 from the z axis.

    euler: its Euler characteristic; shells: its separate pieces; low, high: where it ends along z
    """

    mesh: Mesh
    euler: int
    shells: int
    low: float
    high: float


def make_stamp(mesh: Mesh, feature: Feature) -> Stamp:
    """The mesh ready to be stamped. RecipeError where it is not closed, or has nothing on the side of its
    plane z = 0 that matters.
    """
    found = measure(mesh)
    name = f'[feature] mesh = "{feature.mesh}"'
    if not found.closed or not (found.volumes > 0).all():
        raise RecipeError(f"{name} is not a closed mesh with its faces outward: repair it, or use another")
    reach = float(np.linalg.norm(mesh.vertices[:, :2], axis=1).max())
    low, high = float(mesh.vertices[:, 2].min()) / reach, float(mesh.vertices[:, 2].max()) / reach
    if (high if feature.adds else -low) <= ON_PLANE:
        side, do = ("above", "stand on") if feature.adds else ("below", "hang under")
        raise RecipeError(
            f"{name} has nothing {side} its own plane z = 0: let a {feature.kind}'s mesh {do} that plane"
        )
    return Stamp(Mesh(mesh.vertices / reach, mesh.triangles), found.euler, len(found.volumes), low, high)


def stamp_sizes(feature: Feature, sizes: FeatureSizes, stamp: Stamp, pattern: Pattern) -> FeatureSizes:
    """The sizes with the mesh's own proportions where the recipe gives no depth or height."""
    radius = pattern.diameter / 2
    if feature.adds:
        return sizes if feature.height is not None else replace(sizes, height=stamp.high * radius)
    return sizes if feature.depth is not None else replace(sizes, depth=-stamp.low * radius)


def stamp_extent(
    feature: Feature, sizes: FeatureSizes, stamp: Stamp, pattern: Pattern, extent: Extent
) -> Extent:
    """The extent that the mesh has beyond the plain one, on the side away from where it shows."""
    stretch = _stretch(feature, sizes, stamp)
    if feature.adds:
        return replace(extent, bottom=extent.bottom + np.maximum(-stamp.low, 0) * stretch)
    return replace(extent, top=extent.top + np.maximum(stamp.high, 0) * stretch)


def _stretch(feature: Feature, sizes: FeatureSizes, stamp: Stamp) -> Floats:
    """Length along the axis for each unit of the stamp, (n,)."""
    return sizes.height / stamp.high if feature.adds else sizes.depth / -stamp.low


def make_stamps(
    pattern: Pattern, feature: Feature, sizes: FeatureSizes, stamp: Stamp, chosen: Ints, extent: Extent
) -> Cutters:
    """The mesh in place of the features `chosen`, (m,); extent: see stamp_extent."""
    unit = stamp.mesh.vertices
    z = unit[:, 2] * _stretch(feature, sizes, stamp)[chosen, None]
    if feature.adds:
        beyond = (extent.bottom - np.maximum(-stamp.low, 0) * _stretch(feature, sizes, stamp))[chosen]
        z = np.where(unit[:, 2] <= ON_PLANE, z - beyond[:, None], z)
    else:
        beyond = (extent.top - np.maximum(stamp.high, 0) * _stretch(feature, sizes, stamp))[chosen]
        z = np.where(unit[:, 2] >= -ON_PLANE, z + beyond[:, None], z)
    flat = unit[:, :2] * (pattern.diameter[chosen] / 2)[:, None, None]
    local = np.concatenate([flat, z[..., None]], axis=2)
    places = np.einsum("mvi,mij->mvj", local, frames(pattern.normal[chosen], pattern.tangent[chosen]))
    places += pattern.position[chosen, None]
    count = len(stamp.mesh.triangles)
    cap = np.zeros(count, dtype=np.int64)
    return composed([(places, stamp.mesh.triangles, np.arange(count), cap, chosen)])
