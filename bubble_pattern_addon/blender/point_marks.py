"""What is known of a pattern's points beside their attributes: which are pinned, and where they were laid."""

from __future__ import annotations

import base64
from typing import Any

import bpy
import numpy as np

from ..core.mesh import Bools, Floats, Ints
from .attributes import read_values, write_values

PINNED = "pinned"
# Where a point was laid, as it is kept: what is missing from the mesh has been deleted by hand.
LAID = np.dtype([("id", "<i4"), ("at", "<f4", 3)])


def remember(obj: bpy.types.Object, position: Floats, ids: Ints) -> None:
    """Keep where the points of `obj` were laid, (n, 3), by id (n,)."""
    kept = np.empty(len(ids), dtype=LAID)
    kept["id"], kept["at"] = ids, position
    obj.bubble_pattern.laid = base64.b64encode(kept.tobytes()).decode("ascii")


def laid_places(obj: bpy.types.Object) -> tuple[Ints, Floats]:
    """Ids (n,) and places (n, 3) of the points as they were laid; none where a file does not say."""
    kept = np.frombuffer(base64.b64decode(obj.bubble_pattern.laid), dtype=LAID)
    return kept["id"].astype(np.int64), kept["at"].astype(np.float64)


def mark_pins(obj: bpy.types.Object, position: Floats, pitch: Floats) -> None:
    """Mark the points at `position` (n, 3) that the settings pin."""
    from scipy.spatial import cKDTree

    pinned = np.zeros(len(position), dtype=bool)
    pins = obj.bubble_pattern.pins
    if len(pins) and len(position):
        distance, row = cKDTree(position).query(np.array([pin.at[:] for pin in pins]))
        pinned[row[distance < 0.5 * pitch[row]]] = True
    write_values(obj.data, PINNED, 'POINT', 'BOOLEAN', pinned)


def pinned_points(obj: bpy.types.Object) -> Bools:
    """Which points are pinned, (V,), in Object Mode."""
    layer = obj.data.attributes.get(PINNED)
    if layer is None:
        return np.zeros(len(obj.data.vertices), dtype=bool)
    return np.asarray(read_values(layer.data, "value", np.bool_))


def keep_pins(settings: Any, places: Floats) -> None:
    """Let the `places` (n, 3) be the pins of the pattern."""
    settings.pins.clear()
    for at in places:
        settings.pins.add().at = at
