"""The extension as users get it: the built zip, installed and enabled in a Blender of its own."""

from __future__ import annotations

import json
import os
import platform
import subprocess
import sys
import tomllib
import zipfile
from pathlib import Path

import pytest

pytest.importorskip("bpy", reason="needs the bpy module: python scripts/test.py --blender VERSION")

from scripts import build_extension

ROOT = Path(__file__).resolve().parents[2]
PLATFORMS = {
    ("Linux", "x86_64"): "linux-x64",
    ("Windows", "AMD64"): "windows-x64",
    ("Darwin", "arm64"): "macos-arm64",
}
PYTHON_TAG = f"cp{sys.version_info.major}{sys.version_info.minor}"

# Run in a Blender that has never seen this repository: only what the zip holds may be needed.
ENABLE = """
import json, sys
from pathlib import Path
import bpy, addon_utils, numpy
beside = str(Path(numpy.__file__).parents[1])
sys.path[:] = [place for place in sys.path if place != beside]  # not what lies beside the module
addon_utils.extensions_refresh(ensure_wheels=True)
name = "bl_ext.user_default.bubble_pattern"
assert addon_utils.enable(name, default_set=True) is not None, "not enabled"
warnings = addon_utils._extensions_warnings_get()
bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
bpy.ops.mesh.primitive_cube_add(size=0.1)
cube = bpy.context.object.data
for vertex in cube.vertices:
    vertex.co.z *= 0.05
marked = cube.attributes.new("bubble_region", 'BOOLEAN', 'FACE')
marked.data.foreach_set("value", [face.normal.z > 0.7 for face in cube.polygons])
bpy.ops.bubble_pattern.add()
bpy.ops.bubble_pattern.apply()
part = bpy.context.object.data
import manifold3d, scipy, trimesh
places = [module.__file__ for module in (manifold3d, scipy, trimesh)]
holes = bpy.data.objects["Cube Pattern"].bubble_pattern.count
addon_utils.disable(name, default_set=True)
print("FOUND", json.dumps({"warnings": str(warnings or ""), "faces": len(part.polygons), "holes": holes,
    "places": places, "left": [t for t in dir(bpy.types) if "BUBBLE" in t.upper()]}))
"""


@pytest.fixture(scope="session")
def zip_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The zip for this machine, with the wheels for this Python only."""
    system = PLATFORMS.get((platform.system(), platform.machine()))
    if system is None:
        pytest.skip("the extension is not built for this kind of machine")
    folder = tmp_path_factory.mktemp("extension")
    manifest = tomllib.loads((ROOT / "blender_manifest.toml").read_text(encoding="utf-8"))
    wheels = build_extension.chosen_wheels(manifest, [system], [PYTHON_TAG])
    staged = build_extension.stage(wheels, [system], folder / "stage")
    (made,) = build_extension.build(staged, folder / "zip", build_extension.builder_command(None))
    return made


def test_the_zip_holds_the_package_and_its_wheels(zip_file: Path) -> None:
    with zipfile.ZipFile(zip_file) as archive:
        names = archive.namelist()
        manifest = tomllib.loads(archive.read("blender_manifest.toml").decode())
    assert "__init__.py" in names
    assert "core/solid.py" in names
    assert "blender/operators.py" in names
    wheels = sorted(f"./{name}" for name in names if name.endswith(".whl"))
    assert wheels == sorted(manifest["wheels"])
    assert {Path(wheel).name.split("-")[0] for wheel in wheels} == {"manifold3d", "scipy", "trimesh"}
    assert not [name for name in names if "__pycache__" in name or name.startswith(("tests", "scripts"))]


def test_the_installed_zip_works_without_warnings(zip_file: Path, tmp_path: Path) -> None:
    extensions = tmp_path / "extensions"
    with zipfile.ZipFile(zip_file) as archive:
        archive.extractall(extensions / "user_default" / "bubble_pattern")
    script = tmp_path / "enable.py"
    script.write_text(ENABLE, encoding="utf-8")
    environment = {
        **os.environ,
        "BLENDER_USER_RESOURCES": str(tmp_path / "user"),
        "BLENDER_USER_EXTENSIONS": str(extensions),
        "PYTHONPATH": "",
    }
    done = subprocess.run(
        [sys.executable, str(script)],
        cwd=tmp_path,
        env=environment,
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )
    lines = [line for line in done.stdout.splitlines() if line.startswith("FOUND ")]
    assert lines, done.stdout[-2000:] + done.stderr[-2000:]
    found = json.loads(lines[0].removeprefix("FOUND "))
    assert found["warnings"] == ""
    assert found["holes"] > 100
    assert found["faces"] > 6 * found["holes"]
    assert found["left"] == []
    assert [place for place in found["places"] if str(extensions) not in place] == []


def test_wheels_are_those_a_blender_may_have() -> None:
    manifest = tomllib.loads((ROOT / "blender_manifest.toml").read_text(encoding="utf-8"))
    wheels = build_extension.listed_wheels(manifest)
    for system in manifest["platforms"]:
        for tag in ("cp311",) if system == "macos-x64" else ("cp311", "cp313"):
            names = {w.name for w in wheels if w.runs_on(system) and (w.pure or w.python == tag)}
            assert names == {"scipy", "trimesh", "manifold3d"}, (system, tag)


@pytest.mark.parametrize(
    "wheel",
    [
        "./wheels/numpy-2.2.0-cp313-cp313-win_amd64.whl",
        "./wheels/scipy-1.17.1-cp313-cp313t-manylinux_2_27_x86_64.whl",
        "./wheels/scipy-1.17.1-cp313-cp313-musllinux_1_2_x86_64.whl",
        "./wheels/scipy.whl",
    ],
)
def test_wheels_that_must_not_be_bundled_are_refused(wheel: str) -> None:
    with pytest.raises(build_extension.BuildError):
        build_extension.listed_wheels({"wheels": [wheel]})


def test_a_missing_builder_is_one_clear_line(capsys: pytest.CaptureFixture[str]) -> None:
    assert build_extension.main(["--blender", "no-such-blender"]) == 1
    assert "no-such-blender was not found" in capsys.readouterr().err
