"""Images in a batch run, read by Blender: a halftone."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import bpy
import numpy as np
import pytest
import trimesh

from bubble_pattern_addon import batch
from bubble_pattern_addon.blender.pixels import read_image
from bubble_pattern_addon.core.errors import FieldError
from bubble_pattern_addon.core.recipe import load_recipe

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
