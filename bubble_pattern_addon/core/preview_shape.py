"""What stands for a feature before it is made: its shape for a diameter of 1, light enough for thousands."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from .feature_recipe import Feature
from .feature_sizes import FeatureSizes, chord_height, sides
from .loft import local_solids
from .mesh import Ints, Mesh
from .profile import outlines
from .section import Extent, ring_counts
from .stamp import make_stamp

# A hole is shown as a plate this thick, which stands a little proud of a curved surface, seen from either
# side; what is inside its rim stands out of that.
THICKNESS = 0.16
RAISED = 0.02
# A bump's foot goes this deep.
FOOT = 0.1
SIDES = 32
DARK, LIGHT = 0, 1


def preview_shape(feature: Feature, sizes: FeatureSizes, stamp: Mesh | None = None) -> tuple[Mesh, Ints]:
    """The shape of a feature for a diameter of 1, x along its heading, z along its axis, and how its
    triangles are shown, (T,): DARK where it goes into the wall, LIGHT where it is a rim, a dimple or a bump.

    sizes: of one feature, relative to its diameter
    """
    if stamp is not None:
        shape = _stamped(feature, sizes, stamp)
        return shape, np.full(len(shape.triangles), LIGHT if feature.adds else DARK)
    if feature.adds:
        count = int(sides(feature, np.ones(1))[0]) if feature.sides else SIDES
        extent = Extent(sizes.height, np.full(1, FOOT), np.zeros(1))
        rings = ring_counts(
            feature, sizes, extent, np.full(1, 0.5), chord_height(np.ones(1), np.full(1, count))
        )
        solid = local_solids(feature, np.ones(1), sizes, extent, count, int(rings[0]))
        triangles = solid.triangles if solid.triangles.ndim == 2 else solid.triangles[0]
        return Mesh(solid.corners[0], triangles), np.full(len(triangles), LIGHT)
    count = feature.sides or SIDES
    plate = _plate(feature, sizes, count, 0.0, THICKNESS)
    light = feature.kind == "dimple" or feature.rim != "sharp"
    inset = float(sizes.rim[0])
    room = float(outlines(feature, np.ones(1), sizes.aspect, count).room[0])
    if inset == 0 or inset >= 0.95 * room:
        return plate, np.full(len(plate.triangles), LIGHT if light else DARK)
    throat = _plate(feature, sizes, count, inset, THICKNESS + RAISED)
    return (
        Mesh(
            np.concatenate([plate.vertices, throat.vertices]),
            np.concatenate([plate.triangles, throat.triangles + len(plate.vertices)]),
        ),
        np.repeat([LIGHT, DARK], [len(plate.triangles), len(throat.triangles)]),
    )


def _plate(feature: Feature, sizes: FeatureSizes, count: int, inset: float, thickness: float) -> Mesh:
    """The profile moved inward by `inset` as a flat plate."""
    plain = replace(feature, kind="hole", depth=None, form="dome", height=None, rim="sharp", draft=0.0)
    half = np.full(1, thickness / 2)
    none = replace(sizes, rim=np.zeros(1), draft=np.zeros(1))
    solid = local_solids(plain, np.ones(1), none, Extent(half, half, np.zeros(1)), count, 0)
    corners = solid.corners[0].copy()
    if inset:
        outline = outlines(plain, np.ones(1), sizes.aspect, count).at(np.full((1, 1), inset))[0, 0]
        corners[:, :2] = np.tile(outline, (2, 1))
    return Mesh(corners, solid.triangles if solid.triangles.ndim == 2 else solid.triangles[0])


def _stamped(feature: Feature, sizes: FeatureSizes, stamp: Mesh) -> Mesh:
    """The mesh, what a hole takes away as it is seen from outside: its outline, flat."""
    made = make_stamp(stamp, feature)
    corners = made.mesh.vertices / 2
    size = sizes.height[0] if feature.adds else np.nan_to_num(sizes.depth[0])
    if feature.adds:
        corners[:, 2] *= (size or 0.5 * made.reach) / (0.5 * made.reach)
        corners[made.beyond, 2] = -FOOT
    else:
        corners[:, 2] = np.where(made.beyond, THICKNESS / 2, -THICKNESS / 2 * (made.mesh.vertices[:, 2] < 0))
    return Mesh(corners, made.mesh.triangles)
