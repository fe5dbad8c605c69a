"""The batch run's drawings and units."""

from __future__ import annotations

import json
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
import trimesh

from bubble_pattern_addon import batch
from bubble_pattern_addon.core import files
from bubble_pattern_addon.core.errors import OutputError
from bubble_pattern_addon.core.threemf import CORE, write_3mf

from .bases import as_mesh

TOP = "[region]\nnear = [0, 0, 2]\n[packing]\npitch = 4\n[shaping]\ndiameter = 2\n"
CIRCLE = "{http://www.w3.org/2000/svg}circle"


def run(folder: Path, recipe: str, base: Path) -> tuple[int, Path]:
    (folder / "recipe.toml").write_text(recipe)
    out = folder / "results" / "out"
    return batch.main([str(folder / "recipe.toml"), "--base", str(base), "--out", str(out), "--quiet"]), out


@pytest.fixture
def plate(tmp_path: Path) -> Path:
    path = tmp_path / "base.stl"
    path.write_bytes(trimesh.creation.box((40, 30, 4)).export(file_type="stl"))
    return path


@pytest.mark.parametrize(("unit", "factor"), [("", 1.0), ('unit = "in"\n', 25.4), ("unit = 2.5\n", 2.5)])
def test_drawings_and_3mf_are_in_millimetres(tmp_path: Path, plate: Path, unit: str, factor: float) -> None:
    wish = '[output]\ndrawings = ["svg", "dxf"]\nformats = ["3mf"]\n'
    code, out = run(tmp_path, TOP + wish + unit, plate)
    assert code == 0
    assert {"pattern.dxf", "pattern.svg", "part.3mf"} <= {file.name for file in out.iterdir()}
    report = json.loads((out / "report.json").read_text())
    assert report["drawing"]["features"] == report["features"]
    assert report["drawing"]["stretch"] == pytest.approx(1)
    circles = [*ElementTree.parse(out / "pattern.svg").getroot().iter(CIRCLE)]
    assert len(circles) == report["features"]
    assert {float(circle.attrib["r"]) for circle in circles} == {factor}
    part = files.load_base(out / "part.3mf")
    assert part.millimetres == 1.0
    assert np.ptp(part.mesh.vertices, axis=0) == pytest.approx(np.array([40, 30, 4]) * factor)


def test_another_library_reads_the_3mf_with_its_unit(tmp_path: Path, plate: Path) -> None:
    pytest.importorskip("lxml", reason="trimesh reads 3MF with lxml only")
    code, out = run(tmp_path, TOP + '[output]\nformats = ["3mf"]\nunit = "cm"\n', plate)
    assert code == 0
    theirs = trimesh.load_scene(out / "part.3mf")
    assert theirs.units == "millimeter"
    assert theirs.extents == pytest.approx(np.array([400, 300, 40]))


def test_another_library_reads_the_batch_runs_dxf(tmp_path: Path, plate: Path) -> None:
    ezdxf = pytest.importorskip("ezdxf", reason="ezdxf reads the drawing back: pip install ezdxf")
    code, out = run(tmp_path, TOP + '[output]\ndrawings = ["dxf"]\nprojection = [0, 0, 1]\n', plate)
    assert code == 0
    document = ezdxf.readfile(out / "pattern.dxf")
    circles = document.modelspace().query("CIRCLE")
    assert {round(circle.dxf.radius, 9) for circle in circles} == {1.0}
    table = np.genfromtxt(out / "features.csv", delimiter=",", names=True)
    # projected, a drawing keeps the base's coordinates
    places = np.array([list(circle.dxf.center)[:2] for circle in circles])
    assert places == pytest.approx(np.stack([table["x"], table["y"]], axis=1), abs=1e-8)


def test_a_recipe_in_millimetres_suits_a_base_in_inches(tmp_path: Path) -> None:
    """A 3MF says its unit; so does this recipe."""
    body = as_mesh(trimesh.creation.box((40 / 25.4, 30 / 25.4, 4 / 25.4)))
    write_3mf(tmp_path / "base.3mf", body)
    archive = tmp_path / "base.3mf"
    _in_inches(archive)
    code, out = run(tmp_path, TOP + '[output]\nunit = "mm"\ndrawings = ["svg"]\nformats = ["3mf"]\n', archive)
    assert code == 0
    report = json.loads((out / "report.json").read_text())
    assert report["volume"] < 40 * 30 * 4 / 25.4**3
    circles = [*ElementTree.parse(out / "pattern.svg").getroot().iter(CIRCLE)]
    assert [float(circle.attrib["r"]) for circle in circles] == pytest.approx([1.0] * report["features"])
    assert np.ptp(files.load_base(out / "part.3mf").mesh.vertices, axis=0) == pytest.approx(
        [40, 30, 4], rel=1e-6
    )
    # what was written down makes the same on the same base
    (tmp_path / "again").mkdir()
    code, again = run(tmp_path / "again", (out / "recipe.toml").read_text(), archive)
    assert code == 0
    assert (again / "features.csv").read_bytes() == (out / "features.csv").read_bytes()


def _in_inches(path: Path) -> None:
    import zipfile

    with zipfile.ZipFile(path) as archive:
        contents = {name: archive.read(name) for name in archive.namelist()}
    with zipfile.ZipFile(path, "w") as archive:
        for name, content in contents.items():
            archive.writestr(name, content.replace(b'unit="millimeter"', b'unit="inch"'))
    assert CORE in contents["3D/3dmodel.model"].decode()


def test_a_drawing_that_cannot_be_made_leaves_nothing(
    tmp_path: Path, plate: Path, capsys: pytest.CaptureFixture
) -> None:
    code, out = run(tmp_path, TOP + '[output]\ndrawings = ["dxf"]\nprojection = [0, 0, -1]\n', plate)
    assert code == 1
    assert "face away" in capsys.readouterr().err
    assert not out.parent.exists()


def test_a_file_takes_its_place_only_when_all_is_well(tmp_path: Path) -> None:
    target = tmp_path / "a.txt"
    target.write_text("old")

    def interrupted() -> None:
        with files.output_file(target) as work:
            work.write_text("half")
            raise ValueError("trouble")

    with pytest.raises(ValueError, match="trouble"):
        interrupted()
    assert [*tmp_path.iterdir()] == [target]
    assert target.read_text() == "old"
    with files.output_file(target) as work:
        assert work.suffix == ".txt"
        work.write_text("new")
    assert target.read_text() == "new"
    assert [*tmp_path.iterdir()] == [target]
    for bad, words in ((tmp_path, "is a folder"), (tmp_path / "none" / "a.txt", "does not exist")):
        with pytest.raises(OutputError, match=words), files.output_file(bad):
            pass
