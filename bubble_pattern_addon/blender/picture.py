"""A studio picture of a part: Cycles on the CPU, which needs neither a window nor a graphics library."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import bpy
import numpy as np
from mathutils import Matrix, Vector

from ..core.errors import OutputError
from ..core.mesh import Floats
from ..core.pattern import Pattern
from .attributes import read_values

SIZE = (1000, 750)
SAMPLES = 24
SECONDS = 40.0
"""A slow machine stops here with fewer samples; the denoiser makes up for them."""
LENS = 70.0
"""Focal length in millimetres on a sensor 36 wide: long enough to keep the part's proportions."""
FLOOR = 60.0
"""Width of the ground relative to the part's radius."""


@dataclass(frozen=True)
class View:
    """How the picture is taken: axes (3, 3) in rows right, up, towards the camera; the part's own up (3,);
    the corners (n, 3) that must be in it.
    """

    axes: Floats
    ground: Floats
    corners: Floats

    @property
    def centre(self) -> Floats:
        """Middle of what is seen, (3,)."""
        return (self.corners.max(axis=0) + self.corners.min(axis=0)) / 2

    @property
    def radius(self) -> float:
        """Distance from the centre to the farthest corner."""
        return float(np.linalg.norm(self.corners - self.centre, axis=1).max())


def render_part(
    path: Path,
    mesh: bpy.types.Mesh,
    matrix: Floats,
    pattern: Pattern,
    size: tuple[int, int] = SIZE,
    up: Floats | None = None,
) -> None:
    """Render `mesh`, standing at `matrix` (4, 4), as a PNG at `path`: three-quarter view, the pattern on top.

    up: the way (3,) the part's own top looks; without, that of the pattern

    The studio is a scene of its own, which is taken down again. Raises OutputError where rendering fails.
    """
    facing = pattern.normal.sum(axis=0) if up is None else up * len(pattern)
    if np.linalg.norm(facing) < 0.3 * len(pattern):  # a pattern all round has no side of its own
        facing = np.array([0.0, 0.0, 1.0])
    local = read_values(mesh.attributes["position"].data, "vector", np.float32, 3).astype(np.float64)
    view = three_quarter_view(local @ matrix[:3, :3].T + matrix[:3, 3], facing)
    with studio(view) as scene:
        part = bpy.data.objects.new("Studio part", mesh)
        part.matrix_world = Matrix(matrix.tolist())
        scene.collection.objects.link(part)
        if not any(mesh.materials):
            mesh.materials.clear()
            mesh.materials.append(make_material("Moulded", (0.05, 0.053, 0.058), roughness=0.38))
        _camera(scene, view, size)
        _settings(scene, path, size)
        try:
            bpy.ops.render.render(write_still=True, scene=scene.name)
        except RuntimeError as error:
            reason = str(error).removeprefix("Error: ").strip()
            raise OutputError(f"{path.name} can't be rendered: {reason}") from None
    if not path.exists():
        raise OutputError(f"{path.name} can't be written: check the disk")


def three_quarter_view(corners: Floats, facing: Floats) -> View:
    """From above the front right of a part with these corners (n, 3), lying with `facing` (3,) up."""
    up = facing / np.linalg.norm(facing)
    # the front is the side of the world's -Y, or of -Z for a part that faces along Y
    front = np.array([0.0, -1.0, 0.0]) if abs(up[1]) < 0.7 else np.array([0.0, 0.0, -1.0])
    front = front - (front @ up) * up
    front /= np.linalg.norm(front)
    right = np.cross(up, -front)
    towards = 1.2 * up + 0.95 * front + 0.4 * right
    towards /= np.linalg.norm(towards)
    across = np.cross(up, towards)
    across /= np.linalg.norm(across)
    return View(np.stack([across, np.cross(towards, across), towards]), up, corners)


@contextmanager
def studio(view: View) -> Iterator[bpy.types.Scene]:
    """A scene with ground and lights, gone after the block with all objects and lights made meanwhile."""
    kinds: tuple[Any, ...] = (bpy.data.scenes, bpy.data.objects, bpy.data.lights, bpy.data.cameras)
    kinds += (bpy.data.worlds,)
    before = [{item.as_pointer() for item in kind} for kind in kinds]
    scene = bpy.data.scenes.new("Bubble Pattern Studio")
    ground = _ground(view)
    sheet, cover = ground.data, ground.data.materials[0]
    try:
        scene.world = _world()
        scene.collection.objects.link(ground)
        for light in _lights(view):
            scene.collection.objects.link(light)
        yield scene
    finally:
        for kind, known in zip(kinds, before, strict=True):
            for item in [item for item in kind if item.as_pointer() not in known]:
                kind.remove(item)
        bpy.data.meshes.remove(sheet)
        bpy.data.materials.remove(cover)


def _world() -> bpy.types.World:
    world = bpy.data.worlds.new("Studio")
    if bpy.app.version < (5, 0, 0):  # from 5.0 on every world has nodes
        world.use_nodes = True
    background = next(node for node in world.node_tree.nodes if node.type == 'BACKGROUND')
    background.inputs["Color"].default_value = (0.75, 0.82, 0.92, 1)
    background.inputs["Strength"].default_value = 0.3
    return world


def _ground(view: View) -> bpy.types.Object:
    """A wide sheet under the part, bent up behind it in a large sweep so that there is no horizon."""
    right, up = view.axes[0], view.ground
    back = np.cross(up, right)
    below = view.corners @ up
    origin = view.centre + (below.min() - view.centre @ up - 0.002 * view.radius) * up
    reach = FLOOR / 2 * view.radius
    # the sweep starts some way behind the part
    turn = np.linspace(0, np.pi / 2, 24)
    start, bend = 2.2 * view.radius, 4 * view.radius
    profile = [(-reach, 0.0), *zip(start + bend * np.sin(turn), bend * (1 - np.cos(turn)), strict=True)]
    profile.append((start + bend, reach))
    points = [
        origin + side * reach * right + depth * back + height * up
        for depth, height in profile
        for side in (-1, 1)
    ]
    faces = [(2 * i, 2 * i + 1, 2 * i + 3, 2 * i + 2) for i in range(len(profile) - 1)]
    mesh = bpy.data.meshes.new("Ground")
    mesh.from_pydata([tuple(point) for point in points], [], faces)
    mesh.shade_smooth()
    mesh.materials.append(make_material("Ground", (0.30, 0.31, 0.33), roughness=0.55))
    return bpy.data.objects.new("Ground", mesh)


def _lights(view: View) -> list[bpy.types.Object]:
    """A large soft key from the upper left, a strip from behind that draws the edges, a weak fill."""
    right, up = view.axes[0], view.ground
    back = np.cross(up, right)
    # where from (right, back, up), width, height, brightness
    plan = {
        "Key": ((-1.7, 1.2, 2.4), 2.8, 2.0, 1.0),
        "Strip": ((1.6, 2.8, 1.3), 0.5, 3.4, 1.1),
        "Fill": ((1.6, -3.0, 1.6), 3.0, 1.6, 0.5),
    }
    lights = []
    for name, ((aside, behind, above), width, height, brightness) in plan.items():
        data = bpy.data.lights.new(name, 'AREA')
        data.shape = 'RECTANGLE'
        data.size, data.size_y = width * view.radius, height * view.radius
        # the light that arrives falls with the square of the distance, which grows with the part
        data.energy = 62.0 * brightness * view.radius**2
        light = bpy.data.objects.new(name, data)
        place = view.centre + view.radius * (aside * right + behind * back + above * up)
        turned = Vector(view.centre - place).to_track_quat('-Z', 'Y').to_matrix().to_4x4()
        light.matrix_world = Matrix.Translation(Vector(place)) @ turned
        lights.append(light)
    return lights


def _camera(scene: bpy.types.Scene, view: View, size: tuple[int, int]) -> None:
    """A camera that just sees all corners, with a little air around them."""
    data = bpy.data.cameras.new("Camera")
    data.lens, data.sensor_width = LENS, 36.0
    slope = np.array([18.0 / LENS, 18.0 / LENS * size[1] / size[0]]) * 0.90
    seen = (view.corners - view.centre) @ view.axes.T
    # with the camera at `far` along its axis, a corner is in the picture if |x - x0| <= slope (far - z)
    low = (seen[:, :2] + slope * seen[:, 2:]).max(axis=0)
    high = (-seen[:, :2] + slope * seen[:, 2:]).max(axis=0)
    far = float(((low + high) / 2 / slope).max())
    place = view.centre + (low - high) / 2 @ view.axes[:2] + far * view.axes[2]
    data.clip_start, data.clip_end = far / 100, far + 2 * FLOOR * view.radius
    camera = bpy.data.objects.new("Camera", data)
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = view.axes.T, place
    camera.matrix_world = Matrix(matrix.tolist())
    scene.collection.objects.link(camera)
    scene.camera = camera


def _settings(scene: bpy.types.Scene, path: Path, size: tuple[int, int]) -> None:
    """Cycles on the CPU, a PNG at `path`."""
    scene.render.engine = 'CYCLES'
    scene.cycles.device = 'CPU'
    scene.cycles.samples = SAMPLES
    scene.cycles.use_adaptive_sampling = True
    scene.cycles.adaptive_threshold = 0.03
    scene.cycles.use_denoising = _can_denoise()
    scene.cycles.max_bounces = 4
    scene.cycles.time_limit = SECONDS
    scene.render.resolution_x, scene.render.resolution_y = size
    scene.render.resolution_percentage = 100
    scene.render.image_settings.file_format = 'PNG'
    scene.render.image_settings.color_mode = 'RGB'
    scene.render.image_settings.compression = 90
    scene.render.filepath = str(path.resolve())
    scene.view_settings.view_transform = 'AgX'
    scene.view_settings.look = 'AgX - Medium High Contrast'


def _can_denoise() -> bool:
    """Whether this Blender was built with a denoiser; the list that the setting offers does not tell."""
    try:
        import _cycles
    except ImportError:
        return False
    return bool(getattr(_cycles, "with_openimagedenoise", False))


def make_material(
    name: str,
    color: tuple[float, float, float],
    metallic: float = 0.0,
    roughness: float = 0.4,
    grain: float = 0.0,
    grain_size: float = 1.0,
) -> bpy.types.Material:
    """A material of one colour; grain: height of a fine moulded texture, its size in the object's unit."""
    material = bpy.data.materials.new(name)
    if bpy.app.version < (5, 0, 0):  # from 5.0 on every material has nodes
        material.use_nodes = True
    material.diffuse_color = (*color, 1)
    material.metallic, material.roughness = metallic, roughness
    tree = material.node_tree
    surface = next(node for node in tree.nodes if node.type == 'BSDF_PRINCIPLED')
    surface.inputs["Base Color"].default_value = (*color, 1)
    surface.inputs["Metallic"].default_value = metallic
    surface.inputs["Roughness"].default_value = roughness
    if grain > 0:
        place = tree.nodes.new("ShaderNodeTexCoord")
        noise = tree.nodes.new("ShaderNodeTexNoise")
        bump = tree.nodes.new("ShaderNodeBump")
        noise.inputs["Scale"].default_value = 1 / grain_size
        noise.inputs["Detail"].default_value = 2.0
        bump.inputs["Distance"].default_value = grain
        tree.links.new(place.outputs["Object"], noise.inputs["Vector"])
        tree.links.new(noise.outputs[0], bump.inputs["Height"])
        tree.links.new(bump.outputs["Normal"], surface.inputs["Normal"])
    return material
