"""The bubbles of a packing under way, drawn over the 3D View: the file does not hear of them."""

from __future__ import annotations

import bpy
import numpy as np

from ..core.mesh import Floats
from ..core.progress import Snapshot
from .reading import transformed

# Corners of a bubble's ring where there are few and where there are many of them.
CORNERS, CORNERS_OF_MANY = 20, 8
MANY = 8000
COLOR = (1.0, 0.55, 0.1, 0.9)
# A ring stands this far above the surface, in its diameters, or half of it would be hidden there.
LIFT = 0.05


class Drawing:
    """Rings on the screen; `show` gives others, `remove` takes all away."""

    def __init__(self) -> None:
        self.corners: Floats | None = None
        self.handle = bpy.types.SpaceView3D.draw_handler_add(self.draw, (), 'WINDOW', 'POST_VIEW')

    def show(self, bubbles: Snapshot, frame: Floats) -> None:
        """Draw these bubbles, which are in the frame (4, 4)."""
        self.corners = rings(bubbles, frame)

    def draw(self) -> None:
        """Draw the rings, as Blender asks for it."""
        if self.corners is None:
            return
        import gpu
        from gpu_extras.batch import batch_for_shader

        shader = gpu.shader.from_builtin('UNIFORM_COLOR')
        batch = batch_for_shader(shader, 'LINES', {"pos": self.corners})
        gpu.state.depth_test_set('LESS_EQUAL')
        gpu.state.blend_set('ALPHA')
        shader.bind()
        shader.uniform_float("color", COLOR)
        batch.draw(shader)
        gpu.state.blend_set('NONE')
        gpu.state.depth_test_set('NONE')

    def remove(self) -> None:
        """Draw no more."""
        bpy.types.SpaceView3D.draw_handler_remove(self.handle, 'WINDOW')


def rings(bubbles: Snapshot, frame: Floats) -> Floats:
    """Ends of the lines of the bubbles' rings, single precision in the world, (m, 3), two for each line."""
    n = len(bubbles.pitch)
    angle = np.linspace(0.0, 2 * np.pi, (CORNERS if n < MANY else CORNERS_OF_MANY) + 1)
    least = np.eye(3)[np.abs(bubbles.normal).argmin(axis=1)]
    across = np.cross(bubbles.normal, least)
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    along = np.cross(bubbles.normal, across)
    radius = bubbles.pitch[:, None, None] / 2
    ring = np.cos(angle)[:, None] * across[:, None] + np.sin(angle)[:, None] * along[:, None]
    ring = bubbles.position[:, None] + radius * (ring + 2 * LIFT * bubbles.normal[:, None])
    lines = np.stack([ring[:, :-1], ring[:, 1:]], axis=2).reshape(-1, 3)
    return transformed(lines, frame).astype(np.float32)
