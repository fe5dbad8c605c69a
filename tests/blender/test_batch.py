"""The batch run with Blender in it: .blend in, .blend and picture out, and the command of the extension."""

from __future__ import annotations

import json
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

bpy = pytest.importorskip("bpy", reason="needs the bpy module: python scripts/test.py --blender VERSION")

from bubble_pattern_addon import batch  # noqa: E402
from bubble_pattern_addon.blender import batch_base, command, properties  # noqa: E402
from bubble_pattern_addon.core.files import write_mesh  # noqa: E402
from bubble_pattern_addon.core.mesh import Mesh  # noqa: E402

from .parts import euler, is_closed, panel, plate, points, sheet  # noqa: E402

RECIPE = """
[region]
{region}
[packing]
pitch = 0.008
[shaping]
diameter = 0.005
[output]
blend = true
"""


def recipe(folder: Path, region: str) -> str:
    path = folder / "recipe.toml"
    path.write_text(RECIPE.format(region=region), encoding="utf-8")
    return str(path)


def saved(folder: Path) -> str:
    path = str(folder / "base.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    return path


def run(folder: Path, region: str) -> tuple[Path, dict[str, Any]]:
    """Save what is there as the base and run the batch on it: the folder of its results, and the report."""
    out = folder / "out"
    assert batch.main([recipe(folder, region), "--base", saved(folder), "--out", str(out), "--quiet"]) == 0
    return out, json.loads((out / "report.json").read_text())


def opened(folder: Path) -> bpy.types.Object:
    """The pattern in the .blend that a run left behind."""
    bpy.ops.wm.open_mainfile(filepath=str(folder / "pattern.blend"))
    (pattern,) = [obj for obj in bpy.data.objects if properties.is_pattern(obj)]
    return pattern


def check_editable(pattern: bpy.types.Object, count: int) -> None:
    """The pattern is as it was made, can be edited, and gives the part again."""
    settings = pattern.bubble_pattern
    assert settings.count == count == len(pattern.data.vertices)
    assert not properties.is_outdated(settings)
    part = settings.part
    assert is_closed(part.data)
    assert part.visible_get()
    assert settings.base.hide_get()
    before = points(pattern)
    bpy.ops.bubble_pattern.edit()
    assert bpy.ops.bubble_pattern.apply() == {'FINISHED'}
    assert np.array_equal(points(pattern), before)
    assert euler(part.data) == 2 - 2 * count
    bpy.ops.bubble_pattern.edit()
    settings.pitch *= 1.5
    assert settings.count < count


def test_a_blend_in_and_out(tmp_path: Path) -> None:
    base = panel()
    base.location = (1, 2, 3)
    base.rotation_euler = (0.1, 0.2, 0.3)
    base.scale = (1, 1, -1)
    out, report = run(tmp_path, 'material = "Front"')
    assert report["watertight"]
    pattern = opened(out)
    check_editable(pattern, report["features"])
    assert [m.name for m in pattern.bubble_pattern.part.data.materials] == ["Body", "Front"]


def test_modifiers_are_part_of_the_base(tmp_path: Path) -> None:
    base = plate()
    base.modifiers.new("Bevel", 'BEVEL').width = 0.001
    out, report = run(tmp_path, "near = [0, 0, 0.005]")
    pattern = opened(out)
    assert np.allclose(points(pattern)[:, 2], 0.005, atol=1e-6)
    check_editable(pattern, report["features"])


def test_the_inner_side_of_a_solidified_base_is_left_out(tmp_path: Path) -> None:
    base = sheet()
    base.modifiers.new("Wall", 'SOLIDIFY').thickness = 0.003
    marked = base.data.attributes.new("Grille", 'BOOLEAN', 'FACE')
    marked.data.foreach_set("value", [face.center.length < 0.06 for face in base.data.polygons])
    out, report = run(tmp_path, 'attribute = "Grille"')
    assert report["genus"] == report["features"]
    pattern = opened(out)
    assert (points(pattern, "normal")[:, 2] > 0.5).all()
    check_editable(pattern, report["features"])


def test_the_open_file_is_the_base_of_the_command(tmp_path: Path) -> None:
    plate()
    out = tmp_path / "out"
    assert command.run([recipe(tmp_path, "near = [0, 0, 0.005]"), "--out", str(out), "--quiet"]) == 0
    assert (out / "part.stl").exists()


def test_a_mesh_file_becomes_an_editable_blend(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(batch_base, "write_picture", partial(batch_base.write_picture, size=(120, 90)))
    x, y, z = 80.0, 60.0, 4.0
    corners = np.array([[i, j, k] for k in (0, z) for j in (0, y) for i in (0, x)])
    quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]]
    triangles = np.array([t for a, b, c, d in quads for t in ([a, b, c], [a, c, d])])
    write_mesh(tmp_path / "box.stl", Mesh(corners, triangles))
    text = '[region]\nnear = [40, 30, 4]\n[output]\nblend = true\npicture = true\n'
    (tmp_path / "box.toml").write_text(text)
    out = tmp_path / "out"
    arguments = [
        str(tmp_path / "box.toml"),
        "--base",
        str(tmp_path / "box.stl"),
        "--out",
        str(out),
        "--quiet",
    ]
    capfd.readouterr()
    assert batch.main(arguments) == 0
    said = capfd.readouterr()
    assert said.err == ""
    assert said.out.count("\n") == 1  # nothing of what Blender says of saving and rendering
    assert "watertight part in" in said.out
    assert picture_has_dark_and_light(out / "part.png")
    check_editable(opened(out), json.loads((out / "report.json").read_text())["features"])
    assert bpy.context.scene.unit_settings.length_unit == 'MILLIMETERS'


def picture_has_dark_and_light(path: Path) -> bool:
    image = bpy.data.images.load(str(path))
    pixels = np.empty(len(image.pixels), dtype=np.float32)
    image.pixels.foreach_get(pixels)
    return float(pixels.reshape(-1, 4)[:, :3].std()) > 0.05


def test_which_object_is_the_base_must_be_clear(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    plate(name="One")
    plate(name="Two")
    bpy.context.view_layer.objects.active = None
    path = saved(tmp_path)
    out = tmp_path / "out"
    assert batch.main([recipe(tmp_path, "all = true"), "--base", path, "--out", str(out), "--quiet"]) == 1
    said = capsys.readouterr().err
    assert '"One"' in said
    assert "make the base active" in said
    assert not out.exists()


def test_a_file_that_is_no_blend(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "broken.blend").write_bytes(b"no blend")
    out = tmp_path / "out"
    arguments = [recipe(tmp_path, "all = true"), "--base", str(tmp_path / "broken.blend"), "--out", str(out)]
    assert batch.main([*arguments, "--quiet"]) == 1
    assert "broken.blend" in capsys.readouterr().err
    assert not out.exists()
