"""The batch run: a good part and its files, or one line that says what to do, and nothing left behind."""

import csv
import errno
import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import trimesh

from bubble_pattern_addon import batch
from bubble_pattern_addon.core import files
from bubble_pattern_addon.core.export import COLUMNS
from bubble_pattern_addon.core.progress import Progress
from bubble_pattern_addon.core.recipe_file import load_recipe
from scripts import pattern_batch

ROOT = Path(__file__).resolve().parents[2]
SCRIPT = ROOT / "scripts" / "pattern_batch.py"
DATA = ROOT.parent / "shared" / "data"
TOP = "[region]\nnear = [0, 0, 2]\n"
GRILLE = TOP + "[packing]\npitch = 4\n[shaping]\ndiameter = 2\n"


def plate() -> trimesh.Trimesh:
    return trimesh.creation.box((40, 30, 4))


def joined(*bodies: trimesh.Trimesh) -> trimesh.Trimesh:
    return trimesh.util.concatenate(bodies)


def without_faces(body: trimesh.Trimesh, *rows: int) -> trimesh.Trimesh:
    kept = np.setdiff1d(np.arange(len(body.faces)), rows)
    return trimesh.Trimesh(body.vertices, body.faces[kept], process=False)


def with_fin(body: trimesh.Trimesh) -> trimesh.Trimesh:
    """One more triangle on an edge that has two."""
    a, b = body.faces[0][:2]
    vertices = np.vstack([body.vertices, [0, 0, 30]])
    return trimesh.Trimesh(vertices, np.vstack([body.faces, [a, b, len(body.vertices)]]), process=False)


def with_flat_face(body: trimesh.Trimesh) -> trimesh.Trimesh:
    """A vertex on an edge of the top that only one of its two faces knows: a face of three points in line."""
    top = np.flatnonzero(body.face_normals[:, 2] > 0.9)[0]
    a, b, c = body.faces[top]
    middle = len(body.vertices)
    vertices = np.vstack([body.vertices, (body.vertices[a] + body.vertices[b]) / 2])
    faces = np.delete(body.faces, top, axis=0)
    return trimesh.Trimesh(
        vertices, np.vstack([faces, [a, middle, c], [middle, b, c], [a, b, middle]]), process=False
    )


def obj_with_nan() -> str:
    text = plate().export(file_type="obj")
    assert isinstance(text, str)
    first = next(line for line in text.splitlines() if line.startswith("v "))
    return text.replace(first, "v nan 0 0", 1)


@pytest.fixture
def run(tmp_path: Path, capsys: pytest.CaptureFixture):
    """Run the batch in this process: (exit code, standard output, standard error, output folder)."""

    def run(recipe: str, base: trimesh.Trimesh | Path | None, *more: str) -> tuple[int, str, str, Path]:
        (tmp_path / "recipe.toml").write_text(recipe)
        if isinstance(base, trimesh.Trimesh):
            path = tmp_path / "base.ply"
            path.write_bytes(base.export(file_type="ply"))
            base = path
        out = tmp_path / "results" / "out"
        arguments = [str(tmp_path / "recipe.toml"), "--out", str(out), "--quiet", *more]
        code = batch.main(arguments + (["--base", str(base)] if base else []))
        said = capsys.readouterr()
        return code, said.out, said.err, out

    return run


def check_refusal(result: tuple[int, str, str, Path], words: str) -> None:
    code, out, err, folder = result
    assert code == 1
    assert out == ""
    assert err.startswith("pattern_batch.py: ")
    assert err.count("\n") == 1, err
    assert words in err
    assert not folder.parent.exists()


def test_a_good_part_with_its_files(run) -> None:
    code, out, err, folder = run(GRILLE + '[output]\nformats = ["3mf", "glb"]\n', plate())
    assert (code, err) == (0, "")
    assert "watertight" in out
    names = {"part.stl", "part.3mf", "part.glb", "features.csv", "report.json", "recipe.toml"}
    assert {file.name for file in folder.iterdir()} == names
    report = json.loads((folder / "report.json").read_text())
    for name in ("stl", "3mf", "glb"):
        part = files.load_base(folder / f"part.{name}").mesh
        body = trimesh.Trimesh(part.vertices, part.triangles, process=False)
        assert body.is_watertight
        assert 2 - body.euler_number == 2 * report["features"]
        assert body.volume == pytest.approx(report["volume"], rel=1e-5)
    assert report["watertight"] is True
    assert report["genus"] == report["features"] > 20
    assert report["volume"] < plate().volume
    assert 0.05 < report["open_area"] < 0.25
    assert report["min_web"] > 1.5
    assert report["min_margin"] > 0.9
    assert set(report["quality"]) == {"six", "psi6", "gap_cv", "gap_min", "rim_cv", "void"}
    assert set(report["seconds"]) == {"region", "pack", "shape", "add"}
    assert report["wall"] == {"min": pytest.approx(4), "max": pytest.approx(4)}
    assert report["problems"] == []


def test_the_hole_table_says_where_the_holes_are(run) -> None:
    _, _, _, folder = run(GRILLE, plate())
    with (folder / "features.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert tuple(rows[0]) == COLUMNS
    assert [int(row["id"]) for row in rows] == list(range(len(rows)))
    place = np.array([[float(row[key]) for key in "xyz"] for row in rows])
    assert np.allclose(place[:, 2], 2, atol=1e-9)
    assert (np.abs(place[:, :2]) <= [18 + 1e-6, 13 + 1e-6]).all()  # half a pitch inside
    normal = np.array([[float(row[key]) for key in ("nx", "ny", "nz")] for row in rows])
    assert np.allclose(normal, [0, 0, 1], atol=1e-12)
    assert {(row["diameter"], row["pitch"]) for row in rows} == {("2.0", "4.0")}
    assert "0" in {row["row"] for row in rows}


def test_the_recipe_left_behind_makes_the_same_part(run, tmp_path: Path) -> None:
    _, _, _, folder = run(TOP, plate())
    recipe = load_recipe(folder / "recipe.toml")
    table = (folder / "features.csv").read_bytes()
    count = len(table.splitlines()) - 1
    assert 300 < count < 700  # no length was given: about 500 features
    assert recipe.shaping.diameter.value == pytest.approx(0.6 * recipe.packing.pitch.value)
    code, _, _, again = run((folder / "recipe.toml").read_text(), plate())
    assert code == 0
    assert (again / "features.csv").read_bytes() == table


def test_material_and_attribute_choose_the_region(run, tmp_path: Path) -> None:
    body = plate()
    top = body.face_normals[:, 2] > 0.9
    body.face_attributes["bubble_region"] = top.astype(np.uint8)
    code, _, _, folder = run("[region]\nattribute = 'bubble_region'\n[packing]\npitch = 4\n", body)
    assert code == 0
    by_attribute = (folder / "features.csv").read_bytes()
    lines = [f"v {x} {y} {z}" for x, y, z in body.vertices]
    for name, rows in (("Grille", np.flatnonzero(top)), ("Body", np.flatnonzero(~top))):
        lines += [f"usemtl {name}"] + [f"f {a} {b} {c}" for a, b, c in body.faces[rows] + 1]
    (tmp_path / "base.obj").write_text("\n".join(lines))
    code, _, _, folder = run("[region]\nmaterial = 'Grille'\n[packing]\npitch = 4\n", tmp_path / "base.obj")
    assert code == 0
    assert len((folder / "features.csv").read_bytes().splitlines()) == len(by_attribute.splitlines())


LIMITS = "[limits]\nmin_margin = 1.5\nmin_diameter = 1.9\n"
BAD = {
    "missing base": (GRILLE, Path("nowhere.stl"), "does not exist"),
    "no base": (GRILLE, None, "add --base MODEL"),
    "no mesh": (GRILLE, SCRIPT, "suffix that is not known"),
    "missing .blend": (GRILLE, Path("nowhere.blend"), "does not exist"),
    "nonsense in the recipe": (TOP + "[packing]\npich = 4\n", plate(), "did you mean pitch?"),
    "not TOML": ("[region\n", plate(), "not valid TOML"),
    "diameter over pitch": (GRILLE.replace("= 2\n", "= 4\n"), plate(), "smaller than the pitch"),
    "unknown material": ("[region]\nmaterial = 'Grille'\n", plate(), 'no material "Grille"'),
    "open base": (GRILLE, without_faces(plate(), 0), "not a closed solid"),
    "three faces on an edge": (GRILLE, with_fin(plate()), "more than two faces"),
    "face without area": (GRILLE, with_flat_face(plate()), "area"),
    "pitch over region": (TOP + "[packing]\npitch = 90\n", plate(), "pitch"),
    "a million features": (TOP + "[packing]\npitch = 0.01\n", plate(), "more than 1,000,000"),
    "no feature left": (GRILLE + LIMITS.replace("1.5", "15"), plate(), "No feature is left"),
    "an attribute that is not there": (
        TOP + '[packing]\npitch = { kind = "attribute", name = "x", from = 1, to = 2 }\n',
        plate(),
        '[packing] pitch: name = "x": the base has no attribute',
    ),
    "too thick": (GRILLE.replace("2]", "100]"), trimesh.creation.box((40, 30, 200)), "too thick to pierce"),
}


@pytest.mark.parametrize("name", BAD)
def test_bad_input_gets_one_line_and_leaves_nothing(name: str, run) -> None:
    recipe, base, words = BAD[name]
    check_refusal(run(recipe, base), words)


def test_only_blind_holes_may_start_from_both_sides_of_a_wall(run) -> None:
    body = plate()
    body.face_attributes["both"] = (np.abs(body.face_normals[:, 2]) > 0.9).astype(np.uint8)
    recipe = GRILLE.replace("near = [0, 0, 2]", "attribute = 'both'")
    check_refusal(run(recipe, body), "keep one side")
    code, _, err, folder = run(recipe + "[feature]\ndepth = 0.5\n", body)
    assert (code, err) == (0, "")
    assert json.loads((folder / "report.json").read_text())["genus"] == 0


def test_a_base_that_passes_through_itself_is_refused(run) -> None:
    shifted = plate().apply_translation((10, 10, 1))
    check_refusal(run(GRILLE, joined(plate(), shifted)), "reach through one another")


def test_coordinates_that_are_no_numbers_are_refused(run, tmp_path: Path) -> None:
    (tmp_path / "nan.obj").write_text(obj_with_nan())
    check_refusal(run(GRILLE, tmp_path / "nan.obj"), "not numbers")


def test_a_full_disk_leaves_nothing(run, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(path: Path, mesh: object) -> None:
        path.write_bytes(b"half")
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(batch, "write_mesh", full)
    check_refusal(run(GRILLE, plate()), "free some disk space")


def test_an_output_that_is_a_file_is_refused(run, tmp_path: Path) -> None:
    (tmp_path / "results").write_text("")
    code, _, err, _ = run(GRILLE, plate())
    assert code == 1
    assert err.count("\n") == 1
    assert (tmp_path / "results").read_text() == ""


def test_stopping_by_hand_leaves_nothing(run, monkeypatch: pytest.MonkeyPatch) -> None:
    def stopped(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(batch, "write_features", stopped)
    code, _, err, folder = run(GRILLE, plate())
    assert code == 130
    assert "Stopped" in err
    assert not folder.parent.exists()


def test_progress_goes_from_stage_to_stage(run, capsys, tmp_path: Path) -> None:
    told: list[Progress] = []
    (tmp_path / "recipe.toml").write_text(GRILLE)
    (tmp_path / "base.stl").write_bytes(plate().export(file_type="stl"))
    arguments = [
        str(tmp_path / "recipe.toml"),
        "--base",
        str(tmp_path / "base.stl"),
        "--out",
        str(tmp_path / "o"),
    ]
    assert batch.main(arguments, report=told.append) == 0
    assert told[-1].stage == "Done"
    assert len({step.stage for step in told}) > 4
    fractions = [step.fraction for step in told]
    assert fractions == sorted(fractions)
    assert 0 <= fractions[0] <= fractions[-1] <= 1
    assert batch.main(arguments) == 0  # without a reporter of its own: lines on stderr
    assert "Cutting" in capsys.readouterr().err


# -- as a program of its own ---------------------------------------------------------------------------------


def test_the_program_makes_a_part(tmp_path: Path) -> None:
    (tmp_path / "grille.toml").write_text(GRILLE)
    (tmp_path / "base.stl").write_bytes(plate().export(file_type="stl"))
    command = [sys.executable, SCRIPT, "grille.toml", "--base", "base.stl", "--out", "out", "--quiet"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, timeout=120, check=False)
    assert (done.returncode, done.stderr) == (0, "")
    assert (tmp_path / "out" / "part.stl").exists()


def test_a_recipe_of_bumps_says_what_it_made(run) -> None:
    feature = (
        '[feature]\nkind = "bump"\nprofile = "slot"\nturn = "boundary"\nheight = 0.5\npull = [0, 0, 1]\n'
    )
    code, out, err, folder = run(GRILLE + feature, plate())
    assert (code, err) == (0, "")
    assert "bumps" in out
    report = json.loads((folder / "report.json").read_text())
    assert report["kind"] == "bump"
    assert report["through"] == report["undercut"] == 0
    assert report["removed_volume"] < 0
    with (folder / "features.csv").open() as file:
        assert next(csv.reader(file))[-6:] == ["ax", "ay", "az", "hx", "hy", "hz"]


def test_a_mesh_as_a_feature_is_seen_from_the_recipe_and_goes_along(run, tmp_path: Path) -> None:
    feature = '[feature]\nkind = "bump"\nprofile = "mesh"\nmesh = "cone.stl"\n'
    check_refusal(run(GRILLE + feature, plate()), "cone.stl")
    trimesh.creation.cone(1.0, 1.5, sections=6).export(tmp_path / "cone.stl")
    code, _out, err, folder = run(GRILLE + feature, plate())
    assert (code, err) == (0, "")
    assert (folder / load_recipe(folder / "recipe.toml").feature.mesh).is_file()


@pytest.fixture
def program(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture):
    """The program's `main` in this process, in a folder with a recipe: (exit code, output, error)."""
    (tmp_path / "grille.toml").write_text(GRILLE)
    monkeypatch.chdir(tmp_path)

    def run(*arguments: str) -> tuple[int, str, str]:
        monkeypatch.setattr(sys, "argv", [str(SCRIPT), *arguments])
        code = pattern_batch.main()
        said = capsys.readouterr()
        return code, said.out, said.err

    return run


def test_the_program_refuses_in_one_line(program, tmp_path: Path) -> None:
    code, _, err = program("grille.toml", "--base", "nowhere.stl", "--out", "out")
    assert code == 1
    assert err == "pattern_batch.py: Base nowhere.stl does not exist: check the path\n"
    assert not (tmp_path / "out").exists()
    code, _, err = program("grille.toml")
    assert code == 2
    assert err.count("\n") == 1
    assert "--out" in err


def test_help_shows_an_example(program) -> None:
    code, out, _ = program("--help")
    assert code == 0
    assert "--base panel.stl --out grille" in out
    assert "pitch = 3.0" in out


# -- real parts ----------------------------------------------------------------------------------------------

PARTS = {
    # round the display's window: the near wall only
    "LCD-cover-ORIGINAL-MK3.stl": "[region]\nnear = [0, 20, 26]\n[packing]\npitch = 4\n",
    # dimples under the knob
    "LCD-knob.stl": "[region]\nnear = [2.4, 4.9, 1]\n[packing]\npitch = 2\n[feature]\ndepth = 0.5\n",
    # a row of dimples along a narrow chamfer
    "heatbed-cable-cover.stl": "[region]\nnear = [0, 0.8, -7.3]\n[packing]\npitch = 1.5\n"
    "[feature]\ndepth = 0.4\n",
}
needs_data = pytest.mark.skipif(not DATA.is_dir(), reason="the real parts of ../shared/data are not here")


@needs_data
@pytest.mark.parametrize("name", PARTS)
def test_real_parts_get_good_patterns(name: str, run) -> None:
    code, _, err, folder = run(PARTS[name], DATA / name)
    assert code == 0, err
    report = json.loads((folder / "report.json").read_text())
    assert report["features"] > 10
    assert report["watertight"]
    base = files.load_base(DATA / name).mesh
    part = files.load_base(folder / "part.stl").mesh
    before = trimesh.Trimesh(base.vertices, base.triangles, process=False)
    after = trimesh.Trimesh(part.vertices, part.triangles, process=False)
    assert after.is_watertight
    assert 2 * report["through"] == before.euler_number - after.euler_number
    assert 0 < before.volume - after.volume == pytest.approx(report["removed_volume"], rel=1e-2)
    assert np.allclose(before.bounds, after.bounds, atol=1e-4)


@needs_data
@pytest.mark.parametrize(
    ("name", "point", "words"),
    [
        ("raspberry_cover.stl", [50, 50, 3.5], "not a closed solid"),
        ("suzanne.obj", [-2.5, 1.2, 5], "not a closed solid"),
        ("suzanne.obj", None, "not a closed solid"),
    ],
)
def test_a_real_part_that_is_no_solid_is_refused(
    name: str, point: list[float] | None, words: str, run
) -> None:
    choice = f"near = {point}" if point else "all = true"
    check_refusal(run(f"[region]\n{choice}\n", DATA / name), words)
