"""From the settings of symmetry to the recipe's, and back."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from ..core.mesh import Floats
from ..core.recipe import Packing
from ..core.toml_values import Point
from .field_properties import point_of
from .field_recipe import in_degrees
from .reading import world_frame

# Axes nearer than this to those of the base are these.
SAME = 1e-7


def symmetry_word(settings: Any) -> str:
    """The recipe's word for the symmetry of the settings."""
    if settings.symmetry != 'ROTATE':
        return str(settings.symmetry.lower())
    axis = "" if settings.symmetry_axis == 'REGION' else f" {settings.symmetry_axis.lower()}"
    return f"rotate {settings.symmetry_fold}{axis}"


def symmetry_centre(settings: Any) -> Point | None:
    """The point of the planes or the axis in the frame of the base; None for the region's own middle."""
    return point_of(settings.symmetry_centre) if settings.use_symmetry_centre else None


def symmetry_axes(settings: Any) -> tuple[Point, ...]:
    """What the symmetry calls x, y and z, in the frame of the base; none for the axes of the base."""
    if not settings.use_symmetry_axes:
        return ()
    if settings.symmetry_object is None:
        turn = rotation([math.radians(in_degrees(angle)) for angle in settings.symmetry_rotation])
    else:
        turn = world_frame(settings.base)[:3, :3].T @ world_frame(settings.symmetry_object)[:3, :3]
    if np.abs(turn - np.eye(3)).max() < SAME:
        return ()
    return tuple((x, y, z) for x, y, z in turn.T.tolist())


def take_symmetry(settings: Any, packing: Packing) -> None:
    """Set the settings of symmetry."""
    kind, *turn = packing.symmetry.split()
    settings.symmetry = kind.upper()
    if turn:
        settings.symmetry_fold = int(turn[0])
        settings.symmetry_axis = turn[1].upper() if len(turn) > 1 else 'REGION'
    settings.use_symmetry_centre = packing.symmetry_centre is not None
    if packing.symmetry_centre is not None:
        settings.symmetry_centre = packing.symmetry_centre
    if packing.symmetry_axes == symmetry_axes(settings):
        return  # as an object has them, which may stay
    settings.symmetry_object = None
    settings.use_symmetry_axes = bool(packing.symmetry_axes)
    if packing.symmetry_axes:
        settings.symmetry_rotation = angles(np.array(packing.symmetry_axes).T)


def rotation(turned: list[float]) -> Floats:
    """(3, 3) rotation about X, then Y, then Z by these angles in radians, as Blender's order XYZ has it."""
    (cx, cy, cz), (sx, sy, sz) = np.cos(turned), np.sin(turned)
    return np.array(
        [
            [cy * cz, sx * sy * cz - cx * sz, cx * sy * cz + sx * sz],
            [cy * sz, sx * sy * sz + cx * cz, cx * sy * sz - sx * cz],
            [-sy, sx * cy, cx * cy],
        ]
    )


def angles(turn: Floats) -> tuple[float, float, float]:
    """The angles whose rotation has the columns of `turn` (3, 3), square to one another, for its axes.

    Of left-handed axes the third is taken the other way round, which makes no other symmetry.
    """
    x, y = turn[:, 0], turn[:, 1]
    z = np.cross(x, y)
    across = math.hypot(y[2], z[2])
    if across < 1e-9:  # X points up or down: a turn about it is one about Z as well
        return 0.0, math.copysign(math.pi / 2, -x[2]), math.atan2(-y[0], y[1])
    return math.atan2(y[2], z[2]), math.atan2(-x[2], across), math.atan2(x[1], x[0])
