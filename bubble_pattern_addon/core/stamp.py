"""Any closed mesh as a feature: scaled to each diameter, and set into the surface or onto it.

A mesh stands on its own plane z = 0, which comes to lie on the surface: a bump is what it has above, a hole
what it has below. What is on the other side is left out: there the outline on the plane goes on straight,
into the wall or out into the air, until it is clear of the surface, however that is curved.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import manifold3d
import numpy as np

from .closed import edge_keys, measure
from .cutters import Cutters, composed
from .errors import RecipeError
from .feature_recipe import Feature
from .feature_sizes import FeatureSizes
from .loft import frames
from .mesh import Bools, Ints, Mesh
from .pattern import Pattern
from .section import Extent

ON_PLANE = 1e-9


@dataclass(frozen=True)
class Stamp:
    """One side of a closed mesh whose farthest corner is at a distance of 1 from the z axis.

    mesh: closed by caps on the plane z = 0, whose corners are there twice, with a wall of no height between
    beyond: (V,) corners of the caps, which are to be drawn out; reach: how far it goes along z, above 0
    euler, cap_euler: Euler characteristics of the mesh and of its caps
    """

    mesh: Mesh
    beyond: Bools
    reach: float
    euler: int
    cap_euler: int


def make_stamp(mesh: Mesh, feature: Feature) -> Stamp:
    """The mesh ready to be stamped: what it has above its plane for a bump, below it for a hole. RecipeError
    where it is not closed, or has nothing there.
    """
    found = measure(mesh)
    name = f'[feature] mesh = "{feature.mesh}"'
    if not found.closed or not (found.volumes > 0).all():
        raise RecipeError(f"{name} is not a closed mesh with its faces outward: repair it, or use another")
    sign = 1 if feature.adds else -1
    half = _one_side(mesh, sign)
    if half is None or not np.ptp(half.vertices[:, 2]) > ON_PLANE * np.ptp(mesh.vertices):
        side, do = ("above", "stand on") if feature.adds else ("below", "hang under")
        raise RecipeError(
            f"{name} has nothing {side} its own plane z = 0: let a {feature.kind}'s mesh {do} that plane"
        )
    wide = float(np.linalg.norm(half.vertices[:, :2], axis=1).max())
    vertices = half.vertices / wide
    vertices[np.abs(vertices[:, 2]) <= ON_PLANE, 2] = 0.0
    on_plane = vertices[:, 2] == 0
    cap = on_plane[half.triangles].all(axis=1)
    if not cap.any():
        raise RecipeError(f"{name} does not cross its own plane z = 0: let it stand on that plane")
    whole, beyond = _doubled(Mesh(vertices, half.triangles), cap)
    euler = len(np.unique(half.triangles)) - len(half.triangles) // 2
    return Stamp(whole, beyond, float(np.abs(vertices[:, 2]).max()), euler, _euler(half.triangles[cap]))


def footprint(stamp: Stamp) -> float:
    """The area that the mesh takes of the surface, as a share of the circle round it."""
    cap = stamp.mesh.triangles[stamp.beyond[stamp.mesh.triangles].all(axis=1)]
    a, b, c = stamp.mesh.vertices[cap, :2].transpose(1, 0, 2)
    (ux, uy), (vx, vy) = (b - a).T, (c - a).T
    return float(np.abs((ux * vy - uy * vx).sum()) / (2 * np.pi))


def _one_side(mesh: Mesh, sign: int) -> Mesh | None:
    """The part of a closed mesh above the plane z = 0, or below it, closed; None where there is none."""
    solid = manifold3d.Manifold(
        manifold3d.Mesh64(mesh.vertices, np.ascontiguousarray(mesh.triangles).astype(np.uint64))
    )
    if solid.status() != manifold3d.Error.NoError:
        return None
    out = solid.trim_by_plane((0, 0, sign), 0).to_mesh64()
    if not len(out.tri_verts):
        return None
    return Mesh(np.array(out.vert_properties)[:, :3], np.array(out.tri_verts).astype(np.int64))


def _doubled(mesh: Mesh, cap: Bools) -> tuple[Mesh, Bools]:
    """The mesh with its triangles `cap`, (T,), on corners of their own, and a wall between; which corners,
    (V',), are these.
    """
    count = len(mesh.vertices)
    triangles = mesh.triangles[cap]
    ours = np.unique(triangles)
    twin = np.zeros(count, dtype=np.int64)
    twin[ours] = count + np.arange(len(ours))
    edges = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    keys = edges[:, 0] * count + edges[:, 1]
    one, other = edges[~np.isin(keys, edges[:, 1] * count + edges[:, 0])].T
    walls = [np.stack([one, other, twin[other]], axis=1), np.stack([one, twin[other], twin[one]], axis=1)]
    return (
        Mesh(
            np.concatenate([mesh.vertices, mesh.vertices[ours]]),
            np.concatenate([mesh.triangles[~cap], twin[triangles], *walls]),
        ),
        np.arange(count + len(ours)) >= count,
    )


def _euler(triangles: Ints) -> int:
    edges = np.unique(edge_keys(triangles)[0] >> 1)
    return len(np.unique(triangles)) - len(edges) + len(triangles)


def stamp_sizes(feature: Feature, sizes: FeatureSizes, stamp: Stamp, pattern: Pattern) -> FeatureSizes:
    """The sizes with the mesh's own proportions where the recipe gives no depth or height."""
    own = stamp.reach * pattern.diameter / 2
    if feature.adds:
        return sizes if feature.height is not None else replace(sizes, height=own)
    return sizes if feature.depth is not None else replace(sizes, depth=own)


def make_stamps(
    pattern: Pattern, feature: Feature, sizes: FeatureSizes, stamp: Stamp, chosen: Ints, extent: Extent
) -> Cutters:
    """The mesh in place of the features `chosen`, (m,), drawn out as far as `extent` says."""
    unit = stamp.mesh.vertices
    size, beyond = (sizes.height, -extent.bottom) if feature.adds else (sizes.depth, extent.top)
    z = unit[:, 2] * (size[chosen, None] / stamp.reach)
    z = np.where(stamp.beyond, beyond[chosen, None], z)
    flat = unit[:, :2] * (pattern.diameter[chosen] / 2)[:, None, None]
    local = np.concatenate([flat, z[..., None]], axis=2)
    places = np.einsum("mvi,mij->mvj", local, frames(pattern.normal[chosen], pattern.tangent[chosen]))
    places += pattern.position[chosen, None]
    count = len(stamp.mesh.triangles)
    cap = np.zeros(count, dtype=np.int64)
    return composed([(places, stamp.mesh.triangles, np.arange(count), cap, chosen)])
