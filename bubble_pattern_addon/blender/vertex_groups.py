"""Vertex groups ⇄ numpy arrays.

They are no attributes, and Blender hands them out vertex by vertex only: about two microseconds each, spent
where a base has any.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import bpy
import numpy as np

from ..core.mesh import Ints
from .attributes import Array


@dataclass(frozen=True)
class VertexGroup:
    """Vertices of a mesh with weights: members (m,) and weights (m,), 0 to 1."""

    name: str
    members: Ints
    weights: Array
    locked: bool = False
    active: bool = False


def read_groups(obj: bpy.types.Object, mesh: bpy.types.Mesh) -> tuple[VertexGroup, ...]:
    """The vertex groups of `obj`, as they are on `mesh`, its evaluated mesh; in their order."""
    groups = obj.vertex_groups
    if not groups:
        return ()
    found = [(vertex.index, entry.group, entry.weight) for vertex in mesh.vertices for entry in vertex.groups]
    vertex, owner, weight = np.array(found, dtype=np.float64).reshape(-1, 3).T
    return tuple(
        VertexGroup(
            group.name,
            vertex[owner == group.index].astype(np.int64),
            weight[owner == group.index].astype(np.float32),
            group.lock_weight,
            group == groups.active,
        )
        for group in groups
    )


def write_groups(mesh: bpy.types.Mesh, groups: Sequence[VertexGroup]) -> None:
    """Give `mesh`, which has none, these vertex groups. They are the mesh's own, but reached by an object."""
    holder = bpy.data.objects.new(mesh.name, mesh)
    try:
        for group in groups:
            made = holder.vertex_groups.new(name=group.name)
            weights, rank = np.unique(group.weights, return_inverse=True)
            order = np.argsort(rank, kind="stable")
            ends = np.cumsum(np.bincount(rank, minlength=len(weights)))[:-1]
            for weight, members in zip(weights.tolist(), np.split(group.members[order], ends), strict=False):
                made.add(members.tolist(), weight, 'REPLACE')
            made.lock_weight = group.locked
        for group in groups:  # a new one makes itself active
            if group.active:
                holder.vertex_groups.active = holder.vertex_groups[group.name]
    finally:
        bpy.data.objects.remove(holder)
