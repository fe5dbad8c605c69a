"""A rendered view of a part, by Cycles on the CPU: that needs neither a window nor a graphics library."""

from __future__ import annotations

from pathlib import Path

import bpy
import numpy as np
from mathutils import Matrix, Vector

from ..core.errors import OutputError
from ..core.mesh import Floats
from ..core.pattern import Pattern

SIZE = (1600, 1200)
SAMPLES = 64
LENS = 60.0  # mm
SENSOR = 36.0  # mm
PLASTIC = (0.42, 0.44, 0.46, 1.0)
ROOM = 1.12  # how much wider than the part the picture is
# The camera looks at the pattern from this far beside its normal, towards the part's longer side.
ASIDE = 0.55


def render_part(path: Path, mesh: bpy.types.Mesh, matrix: Floats, pattern: Pattern) -> None:
    """Render the part `mesh`, placed by `matrix` (4, 4), so that `pattern` (in world coordinates) is seen.

    Raises OutputError where the picture cannot be written.
    """
    scene = bpy.data.scenes.new("Picture")
    try:
        part = bpy.data.objects.new("Part", mesh)
        part.matrix_world = Matrix(matrix.tolist())
        scene.collection.objects.link(part)
        if not any(mesh.materials):
            mesh.materials.clear()
            mesh.materials.append(plastic())
        corners = np.array([list(part.matrix_world @ Vector(corner)) for corner in part.bound_box])
        place_camera(scene, corners, pattern)
        light(scene)
        set_up(scene, path)
        bpy.ops.render.render(write_still=True, scene=scene.name)
    except RuntimeError as error:
        raise OutputError(f"{path.name} can't be rendered: {str(error).removeprefix('Error: ')}") from None
    finally:
        bpy.data.scenes.remove(scene)
    if not path.exists():
        raise OutputError(f"{path.name} can't be written: check the disk")


def set_up(scene: bpy.types.Scene, path: Path) -> None:
    """Cycles on the CPU, a PNG at `path`."""
    render = scene.render
    render.engine = 'CYCLES'
    render.resolution_x, render.resolution_y = SIZE
    render.resolution_percentage = 100
    render.filepath = str(path.resolve())
    render.image_settings.file_format = 'PNG'
    scene.cycles.device = 'CPU'
    scene.cycles.samples = SAMPLES
    denoisers = scene.cycles.bl_rna.properties["denoiser"].enum_items
    scene.cycles.use_denoising = 'OPENIMAGEDENOISE' in denoisers


def plastic() -> bpy.types.Material:
    """A plain satin plastic, for parts without a material."""
    material = bpy.data.materials.new("Plastic")
    if bpy.app.version < (5, 0, 0):  # from 5.0 on every material has nodes
        material.use_nodes = True
    shader = material.node_tree.nodes["Principled BSDF"]
    shader.inputs["Base Color"].default_value = PLASTIC
    shader.inputs["Roughness"].default_value = 0.4
    return material


def view_direction(corners: Floats, pattern: Pattern) -> tuple[Floats, Floats]:
    """From the part to the camera, and what is up in the picture: unit vectors."""
    normal = pattern.normal.mean(axis=0)
    size = np.linalg.norm(normal)
    normal = normal / size if size > 0.3 else np.array([0.0, 0.0, 1.0])  # all round: look from above
    extent = np.ptp(corners, axis=0)
    axis = np.eye(3)[np.argsort(extent)]  # from the shortest side of the part to the longest
    aside = next(a for a in axis[::-1] if abs(a @ normal) < 0.8)
    below = np.cross(aside, normal)
    below /= np.linalg.norm(below)
    if below[2] > 1e-6 or (abs(below[2]) <= 1e-6 and below[1] > 0):
        below = -below
    direction = normal + ASIDE * (0.45 * aside + below)
    direction /= np.linalg.norm(direction)
    up = -below - direction * (-below @ direction)
    return direction, up / np.linalg.norm(up)


def place_camera(scene: bpy.types.Scene, corners: Floats, pattern: Pattern) -> None:
    """A camera that sees all of the box `corners` (8, 3)."""
    direction, up = view_direction(corners, pattern)
    right = np.cross(up, direction)
    center = corners.mean(axis=0)
    across, high, near = ((corners - center) @ np.stack([right, up, direction], axis=1)).T
    half = SENSOR / (2 * LENS)
    ratio = SIZE[1] / SIZE[0]
    distance = float(np.max(near + ROOM * np.maximum(np.abs(across) / half, np.abs(high) / (half * ratio))))
    data = bpy.data.cameras.new("Camera")
    data.lens, data.sensor_width = LENS, SENSOR
    data.clip_start, data.clip_end = distance * 1e-3, distance * 10
    camera = bpy.data.objects.new("Camera", data)
    matrix = np.eye(4)
    matrix[:3, 0], matrix[:3, 1], matrix[:3, 2] = right, up, direction
    matrix[:3, 3] = center + direction * distance
    camera.matrix_world = Matrix(matrix.tolist())
    scene.collection.objects.link(camera)
    scene.camera = camera


def light(scene: bpy.types.Scene) -> None:
    """A large soft light beside the camera, a weaker one from behind, and a bright room."""
    world = bpy.data.worlds.new("World")
    if bpy.app.version < (5, 0, 0):
        world.use_nodes = True
    background = world.node_tree.nodes["Background"]
    background.inputs["Color"].default_value = (0.8, 0.85, 0.9, 1.0)
    background.inputs["Strength"].default_value = 0.35
    scene.world = world
    view = np.array(scene.camera.matrix_world)[:3, :3]
    for name, along, strength in (("Key", (-0.7, 0.8, 0.5), 3.0), ("Rim", (0.9, 0.6, -0.2), 1.5)):
        sun = bpy.data.lights.new(name, 'SUN')
        sun.energy, sun.angle = strength, 0.3
        lamp = bpy.data.objects.new(name, sun)
        towards = Vector(view @ np.array(along))
        lamp.matrix_world = towards.to_track_quat('Z', 'Y').to_matrix().to_4x4()
        scene.collection.objects.link(lamp)
