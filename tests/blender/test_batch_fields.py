"""Images in a batch run, read by Blender: a halftone."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import bpy
import numpy as np
import pytest
import trimesh
from mathutils import Euler, Matrix

from bubble_pattern_addon import batch
from bubble_pattern_addon.blender import settings_recipe
from bubble_pattern_addon.blender.pixels import read_image
from bubble_pattern_addon.core.errors import FieldError
from bubble_pattern_addon.core.recipe_file import load_recipe

from .parts import plate, points

HALFTONE = (
    '[region]\nnear = [0, 0, 2]\n[packing]\npitch = 4\n[shaping.fill]\nkind = "image"\n'
    'image = "pictures/ramp.png"\nfrom = 0.2\nto = 0.8\n'
)


def save_image(path: Path, pixels: np.ndarray) -> None:
    """Grey `pixels` (height, width), bottom row first, as a PNG of 8 bits."""
    image = bpy.data.images.new("made", pixels.shape[1], pixels.shape[0])
    colours = np.ones((*pixels.shape, 4), dtype=np.float32)
    colours[..., :3] = pixels[..., None]
    image.pixels.foreach_set(colours.ravel())
    image.file_format = 'PNG'
    image.filepath_raw = str(path)
    path.parent.mkdir(exist_ok=True)
    image.save()
    bpy.data.images.remove(image)


def ramp() -> np.ndarray:
    """Brightness u / 2 + v / 4 at the middles of 60 x 40 pixels."""
    u, v = np.meshgrid((np.arange(60) + 0.5) / 60, (np.arange(40) + 0.5) / 40)
    return u / 2 + v / 4


def test_pixels_are_those_of_the_file_bottom_row_first(tmp_path: Path) -> None:
    save_image(tmp_path / "ramp.png", ramp())
    before = len(bpy.data.images)
    pixels = read_image("ramp.png", tmp_path)
    assert pixels.shape == (40, 60, 4)
    assert np.allclose(pixels[..., 0], ramp(), atol=1 / 255)
    assert len(bpy.data.images) == before


def test_an_image_of_the_open_file_will_do(tmp_path: Path) -> None:
    image = bpy.data.images.new("Dots", 3, 2)
    try:
        assert read_image("Dots", tmp_path).shape == (2, 3, 4)
    finally:
        bpy.data.images.remove(image)


def test_what_is_no_image_is_refused(tmp_path: Path) -> None:
    with pytest.raises(FieldError, match="does not exist"):
        read_image("nowhere.png", tmp_path)
    (tmp_path / "text.png").write_text("no image")
    with pytest.raises(FieldError, match="save it as PNG"):
        read_image("text.png", tmp_path)


def test_a_halftone_from_recipe_to_part(tmp_path: Path, capsys) -> None:
    save_image(tmp_path / "pictures" / "ramp.png", ramp())
    (tmp_path / "recipe.toml").write_text(HALFTONE)
    (tmp_path / "plate.stl").write_bytes(trimesh.creation.box((60, 40, 4)).export(file_type="stl"))

    def run(recipe: Path, out: Path) -> None:
        arguments = [str(recipe), "--base", str(tmp_path / "plate.stl"), "--out", str(out), "--quiet"]
        assert batch.main(arguments) == 0, capsys.readouterr().err

    run(tmp_path / "recipe.toml", tmp_path / "out")
    with (tmp_path / "out" / "features.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    x, y, size = (np.array([float(row[key]) for row in rows]) for key in ("x", "y", "diameter"))
    light = (x / 60 + 0.5) / 2 + (y / 40 + 0.5) / 4
    wished = 4 * (0.2 + 0.6 * light)
    shrunk = json.loads((tmp_path / "out" / "report.json").read_text())["limits"]["shrunk"]
    assert shrunk < len(rows) / 10
    assert np.median(np.abs(size - wished)) < 0.02
    # the image lies beside the recipe that is left behind, which makes the same part
    assert load_recipe(tmp_path / "out" / "recipe.toml").shaping.diameter.share.image == "image_1.png"
    run(tmp_path / "out" / "recipe.toml", tmp_path / "again")
    table = (tmp_path / "out" / "features.csv").read_bytes()
    assert (tmp_path / "again" / "features.csv").read_bytes() == table


FIELDS = """
[region]
attribute = "front"
[packing]
pitch = { kind = "distance", from = 0.006, to = 0.01, distance = 0.05, objects = ["Target"] }
[shaping]
fill = { kind = "attribute", from = 0.3, to = 0.7, name = "Weight", falloff = "smooth" }
[limits]
min_diameter = 0.0035
[output]
blend = true
"""


def pattern_in(folder: Path) -> bpy.types.Object:
    """The pattern in the .blend that a run left behind, up to date."""
    bpy.ops.wm.open_mainfile(filepath=str(folder / "pattern.blend"))
    (pattern,) = [obj for obj in bpy.data.objects if obj.bubble_pattern.base is not None]
    assert not settings_recipe.is_outdated(pattern.bubble_pattern)
    return pattern


def lay_anew(pattern: bpy.types.Object) -> None:
    """Update the pattern by its own settings; nothing it depends on has changed."""
    settings = pattern.bubble_pattern
    prints = (settings.fingerprint, settings.size_trace)
    assert settings.size_trace
    bpy.ops.bubble_pattern.edit()
    assert bpy.ops.bubble_pattern.update() == {'FINISHED'}
    assert (settings.fingerprint, settings.size_trace) == prints


def check_fields(at: np.ndarray, pitch: np.ndarray, size: np.ndarray) -> None:
    """The values of FIELDS at places in the coordinates of the plate."""
    away = np.linalg.norm(at - [0.02, 0.01, 0.005], axis=1)
    assert np.allclose(pitch, 0.006 + 0.004 * np.clip(away / 0.05, 0, 1), rtol=0.06)
    t = at[:, 0] / 0.1 + 0.5
    assert np.allclose(size, pitch * (0.3 + 0.4 * t * t * (3 - 2 * t)), rtol=1e-3)


def test_fields_of_a_blend_that_stands_askew(tmp_path: Path, capsys) -> None:
    base = plate()
    group = base.vertex_groups.new(name="Weight")
    for vertex in base.data.vertices:
        group.add([vertex.index], vertex.co.x / 0.1 + 0.5, 'REPLACE')
    mark = base.data.attributes.new("front", 'BOOLEAN', 'FACE')
    mark.data.foreach_set("value", [face.normal.z > 0.7 for face in base.data.polygons])
    base.matrix_world = Matrix.LocRotScale((0.3, -0.2, 0.7), Euler((0.3, 1.2, -2.0)), (1, 1, 1))
    target = bpy.data.objects.new("Target", None)
    bpy.context.collection.objects.link(target)
    target.matrix_world = base.matrix_world @ Matrix.Translation((0.02, 0.01, 0.005))
    to_base = np.linalg.inv(np.array(base.matrix_world))
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "base.blend"))
    (tmp_path / "recipe.toml").write_text(FIELDS)
    arguments = [str(tmp_path / "recipe.toml"), "--base", str(tmp_path / "base.blend")]
    assert batch.main([*arguments, "--out", str(tmp_path / "out"), "--quiet"]) == 0, capsys.readouterr().err
    with (tmp_path / "out" / "features.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    x, y, z, size, pitch = (
        np.array([float(r[k]) for r in rows]) for k in ("x", "y", "z", "diameter", "pitch")
    )
    at = np.stack([x, y, z], axis=1) @ to_base[:3, :3].T + to_base[:3, 3]
    check_fields(at, pitch, size)
    report = json.loads((tmp_path / "out" / "report.json").read_text())["limits"]
    assert report["dropped"] > 0
    pattern = pattern_in(tmp_path / "out")
    settings = pattern.bubble_pattern
    assert settings.pitch_field.kind == 'DISTANCE'
    assert settings.pitch_field.object.name == "Target"
    assert (settings.diameter_field.kind, settings.diameter_mode) == ('ATTRIBUTE', 'SHARE')
    assert (settings.count, settings.dropped) == (len(rows), report["dropped"])
    # the frame is another one, in which the same square may be packed otherwise
    lay_anew(pattern)
    assert settings.count + settings.dropped == pytest.approx(len(rows) + report["dropped"], rel=0.03)
    at = np.array([item.vector for item in pattern.data.attributes["position"].data])
    check_fields(at, points(pattern, "pitch"), points(pattern, "wished"))


def test_names_that_a_blend_lacks_are_told_with_the_nearest(tmp_path: Path, capsys) -> None:
    base = plate()
    base.vertex_groups.new(name="Weights")
    mark = base.data.attributes.new("front", 'BOOLEAN', 'FACE')
    mark.data.foreach_set("value", [face.normal.z > 0.7 for face in base.data.polygons])
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "base.blend"))
    (tmp_path / "recipe.toml").write_text(
        FIELDS.replace("objects", "points").replace('["Target"]', "[[0,0,0]]")
    )
    arguments = [str(tmp_path / "recipe.toml"), "--base", str(tmp_path / "base.blend")]
    assert batch.main([*arguments, "--out", str(tmp_path / "out"), "--quiet"]) == 1
    assert 'did you mean "Weights"?' in capsys.readouterr().err


def test_paint_and_pictures_of_other_files_go_into_the_blend(tmp_path: Path, capsys) -> None:
    save_image(tmp_path / "pictures" / "ramp.png", ramp())
    colours = np.full((8, 4), 255, dtype=np.uint8)
    body = trimesh.creation.box((60, 40, 4))
    colours[:, 0] = np.where(body.vertices[:, 0] > 0, 200, 100)
    body.visual.vertex_colors = colours
    (tmp_path / "plate.ply").write_bytes(body.export(file_type="ply"))
    text = HALFTONE.replace(
        "pitch = 4",
        'pitch = { kind = "attribute", from = 3, to = 5, name = "Color", channel = "red" }',
    )
    (tmp_path / "recipe.toml").write_text(text + "[output]\nblend = true\n")
    arguments = [str(tmp_path / "recipe.toml"), "--base", str(tmp_path / "plate.ply")]
    assert batch.main([*arguments, "--out", str(tmp_path / "out"), "--quiet"]) == 0, capsys.readouterr().err
    pattern = pattern_in(tmp_path / "out")
    settings = pattern.bubble_pattern
    assert settings.diameter_field.kind == 'IMAGE'
    assert settings.diameter_field.image.packed_file is not None
    assert settings.pitch_field.kind == 'ATTRIBUTE'
    pitch, x = points(pattern, "pitch"), points(pattern)[:, 0]
    assert np.allclose(pitch, 3 + 2 * (150 + 100 * x / 60) / 255, rtol=0.05)
    names = ("position", "id", "diameter", "wished")
    before = [points(pattern, name) for name in names]
    lay_anew(pattern)
    # places and paint have 32 bits in the file
    after = [points(pattern, name) for name in names]
    assert all(np.allclose(a, b, atol=1e-3) for a, b in zip(after, before, strict=True))
