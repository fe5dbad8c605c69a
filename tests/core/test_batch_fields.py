"""The batch run with graded recipes: field tables, what a base has painted on it, seeds, limits, images."""

from __future__ import annotations

import csv
import json
import sys
from pathlib import Path

import numpy as np
import pytest
import trimesh

from bubble_pattern_addon import batch
from bubble_pattern_addon.core.files import load_base
from bubble_pattern_addon.core.paint import COLOUR, UV_MAP
from bubble_pattern_addon.core.recipe_file import load_recipe
from scripts.pattern_batch import _asks_for_blender

TOP = "[region]\nnear = [0, 0, 2]\n"


def fine_plate() -> trimesh.Trimesh:
    """60 x 40 x 4 about the origin, its top and bottom in small triangles."""
    body = trimesh.creation.box((60, 40, 4))
    for _ in range(3):
        body = body.subdivide()
    return body


def run(folder: Path, recipe: str, base: Path, capsys) -> tuple[int, str, Path]:
    (folder / "recipe.toml").write_text(recipe)
    out = folder / "out"
    code = batch.main([str(folder / "recipe.toml"), "--base", str(base), "--out", str(out), "--quiet"])
    said = capsys.readouterr()
    return code, said.out + said.err, out


def features(out: Path) -> dict[str, np.ndarray]:
    with (out / "features.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    return {key: np.array([float(row[key]) for row in rows]) for key in rows[0]}


@pytest.fixture
def plate(tmp_path: Path) -> Path:
    path = tmp_path / "plate.stl"
    path.write_bytes(trimesh.creation.box((60, 40, 4)).export(file_type="stl"))
    return path


GRADED = (
    TOP + '[packing]\npitch = { kind = "linear", from = 3.0, to = 6.0, direction = [1, 0, 0] }\n'
    '[shaping]\nfill = { kind = "boundary", from = 0.4, to = 0.7, distance = 8, falloff = "smooth" }\n'
    "[limits]\nmin_web = 1.0\nmin_margin = 0.8\nmin_diameter = 1.2\n"
)


def test_a_recipe_of_field_tables_makes_a_good_part(plate: Path, tmp_path: Path, capsys) -> None:
    code, said, out = run(tmp_path, GRADED, plate, capsys)
    assert code == 0, said
    table, report = features(out), json.loads((out / "report.json").read_text())
    assert np.allclose(table["pitch"], 4.5 + table["x"] / 20)
    edge = np.minimum(30 - np.abs(table["x"]), 20 - np.abs(table["y"]))
    t = np.clip(edge / 8, 0, 1)
    wished = table["pitch"] * (0.4 + 0.3 * (3 * t**2 - 2 * t**3))
    shrunk = report["limits"]["shrunk_ids"]
    free = ~np.isin(table["id"], shrunk)
    assert np.allclose(table["diameter"][free], wished[free])
    assert (table["diameter"][~free] < wished[~free]).all()
    assert report["features"] == report["genus"] == len(table["id"]) > 50
    assert report["watertight"]
    assert report["min_web"] >= 1.0
    assert report["min_margin"] >= 0.8
    assert table["diameter"].min() >= 1.2
    again = tmp_path / "again"
    again.mkdir()
    code, said, second = run(again, (out / "recipe.toml").read_text(), plate, capsys)
    assert code == 0, said
    assert (second / "features.csv").read_bytes() == (out / "features.csv").read_bytes()


def test_what_the_limits_did_is_reported_with_ids_and_places(plate: Path, tmp_path: Path, capsys) -> None:
    recipe = (
        TOP + '[packing]\npitch = 4\n[shaping]\ndiameter = { kind = "linear", from = 0.5, to = 5, '
        "direction = [1, 0, 0] }\n[limits]\nmin_diameter = 1.5\nmin_web = 0.5\n"
    )
    code, said, out = run(tmp_path, recipe, plate, capsys)
    assert code == 0, said
    table, limits = features(out), json.loads((out / "report.json").read_text())["limits"]
    assert f"{limits['shrunk']} shrunk, {limits['dropped']} dropped" in said
    assert limits["shrunk"] == len(limits["shrunk_ids"]) > 0
    assert limits["dropped"] == len(limits["dropped_ids"]) == len(limits["dropped_at"]) > 0
    assert set(limits["shrunk_ids"]) <= set(table["id"])
    # with the dropped ones the ids are those of all bubbles
    assert sorted([*table["id"], *limits["dropped_ids"]]) == list(range(len(table["id"]) + limits["dropped"]))
    assert (np.array(limits["dropped_at"])[:, 0] < -10).all()
    assert 0 < limits["smallest_share"] < 1


def test_seeds_in_a_recipe(plate: Path, tmp_path: Path, capsys) -> None:
    recipe = (
        TOP + "[packing]\npitch = 4\n[shaping]\ndiameter = 2\nseeds = [{ at = [-25, 0, 2], diameter = 1 }, "
        "{ at = [25, 0, 2], diameter = 3 }]\n"
    )
    code, said, out = run(tmp_path, recipe, plate, capsys)
    assert code == 0, said
    table = features(out)
    for x, size in ((-25, 1), (25, 3)):
        nearest = np.argmin(np.hypot(table["x"] - x, table["y"]))
        assert table["diameter"][nearest] == size
    assert np.corrcoef(table["x"], table["diameter"])[0, 1] > 0.8
    assert load_recipe(out / "recipe.toml").shaping.seeds[1].diameter == 3


@pytest.mark.parametrize("encoding", ["binary", "ascii"])
def test_a_recipe_may_ask_for_what_a_base_has_painted_on_it(encoding: str, tmp_path: Path, capsys) -> None:
    body = fine_plate()
    middle = body.triangles_center
    body.vertex_attributes["weight"] = (body.vertices[:, 0] + 30) / 60
    body.face_attributes["zone"] = (1 + (middle[:, 1] > 0)).astype(np.int32)
    (tmp_path / "base.ply").write_bytes(body.export(file_type="ply", encoding=encoding))
    recipe = (
        TOP + '[packing]\npitch = 4\n[shaping.diameter]\nkind = "faces"\notherwise = 3\n'
        'sets = [{ attribute = "zone", equals = 2, value = { kind = "attribute", name = "weight", from = 1, '
        "to = 3 } }]\n"
    )
    code, said, out = run(tmp_path, recipe, tmp_path / "base.ply", capsys)
    assert code == 0, said
    table = features(out)
    upper = table["y"] > 0.01
    assert np.allclose(table["diameter"][upper], 2 + table["x"][upper] / 30, atol=1e-6)
    assert np.allclose(table["diameter"][table["y"] < -0.01], 3)


def test_colours_and_uv_maps_of_files_are_read_at_the_corners(tmp_path: Path) -> None:
    body = fine_plate()
    colours = np.random.default_rng(0).integers(0, 256, (len(body.vertices), 4)).astype(np.uint8)
    body.visual = trimesh.visual.ColorVisuals(body, vertex_colors=colours)
    (tmp_path / "coloured.ply").write_bytes(body.export(file_type="ply"))
    base = load_base(tmp_path / "coloured.ply")
    assert np.allclose(base.values[COLOUR], colours[body.faces] / 255)
    (tmp_path / "coloured.glb").write_bytes(body.export(file_type="glb"))
    assert np.allclose(load_base(tmp_path / "coloured.glb").values[COLOUR], colours[body.faces] / 255)
    lines = [f"v {x} {y} {z}\nvt {x / 60 + 0.5} {y / 40 + 0.5}" for x, y, z in body.vertices]
    lines += [f"f {a}/{a} {b}/{b} {c}/{c}" for a, b, c in body.faces + 1]
    (tmp_path / "mapped.obj").write_text("\n".join(lines))
    check_mapped(tmp_path / "mapped.obj")


def check_mapped(path: Path) -> None:
    base = load_base(path)
    wanted = base.mesh.corners[:, :, :2] / [60, 40] + 0.5
    assert np.allclose(base.uv_maps[UV_MAP], wanted, atol=1e-5)


def test_uv_maps_of_gltf_stand_upright(tmp_path: Path) -> None:
    pytest.importorskip("PIL")  # without it trimesh writes no texture, which it needs to write a UV map
    body = fine_plate()
    body.visual = trimesh.visual.TextureVisuals(uv=body.vertices[:, :2] / [60, 40] + 0.5)
    (tmp_path / "mapped.glb").write_bytes(body.export(file_type="glb"))
    check_mapped(tmp_path / "mapped.glb")


def test_a_mirrored_piece_keeps_its_paint_and_a_bare_one_has_none(tmp_path: Path) -> None:
    body = fine_plate()
    colours = np.full((len(body.vertices), 4), 255, dtype=np.uint8)
    colours[:, 0] = np.round(body.vertices[:, 0] + 30) * 4
    body.visual = trimesh.visual.ColorVisuals(body, vertex_colors=colours)
    mirror = np.diag([-1.0, 1, 1, 1])
    mirror[:3, 3] = (100, 0, 0)
    scene = trimesh.Scene()
    scene.add_geometry(body, transform=mirror)
    scene.add_geometry(trimesh.creation.box((10, 10, 10)))
    (tmp_path / "both.glb").write_bytes(scene.export(file_type="glb"))
    base = load_base(tmp_path / "both.glb")
    red = base.values[COLOUR][..., 0]
    bare = np.isnan(red).all(axis=1)
    assert bare.sum() == 12
    wanted = (130 - base.mesh.corners[~bare][..., 0]) * 4 / 255
    assert np.allclose(red[~bare], wanted, atol=4.1 / 255)


HALFTONE = (
    TOP + '[packing]\npitch = 4\n[shaping.fill]\nkind = "image"\nimage = "a.png"\nfrom = 0.2\nto = 0.8\n'
)


def test_without_blender_an_image_can_t_be_read(plate: Path, tmp_path: Path, capsys, monkeypatch) -> None:
    monkeypatch.setitem(sys.modules, "bpy", None)
    code, said, out = run(tmp_path, HALFTONE, plate, capsys)
    assert code == 1
    assert said.startswith('pattern_batch.py: Image "a.png" needs Blender to be read')
    assert said.count("\n") == 1
    assert not out.exists()


def test_the_program_knows_from_the_recipe_that_it_needs_blender(tmp_path: Path) -> None:
    (tmp_path / "a.toml").write_text(HALFTONE)
    assert _asks_for_blender([str(tmp_path / "a.toml")])
    (tmp_path / "a.toml").write_text(GRADED)
    assert not _asks_for_blender([str(tmp_path / "a.toml")])
