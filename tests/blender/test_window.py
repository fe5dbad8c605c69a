"""The zip in a real Blender with a window: panel drawn, buttons pressed, part checked, Esc obeyed."""

from __future__ import annotations

import json
import os
import subprocess
import tempfile
import tomllib
from pathlib import Path

import pytest

pytest.importorskip("bpy", reason="needs the bpy module's extension builder")

from scripts import build_extension

ROOT = Path(__file__).resolve().parents[2]
TOOL = ROOT.parent / "shared" / "tools" / "real-blender"
SCRIPT = Path(__file__).with_name("in_window.py")

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not TOOL.exists(), reason="no ../shared/tools/real-blender beside the repository"),
]


def real_blender(*arguments: str, seconds: float = 600) -> str:
    """Run the tool and return what it and Blender said."""
    environment = {
        **os.environ,
        "REAL_BLENDER_HOME": "/home/bubble_pattern",
        "REAL_BLENDER_BIND": tempfile.gettempdir(),
    }
    for name in ("BLENDER_USER_RESOURCES", "BLENDER_USER_EXTENSIONS"):
        environment.pop(name, None)
    done = subprocess.run(
        [str(TOOL), *arguments],
        cwd=ROOT,
        env=environment,
        capture_output=True,
        text=True,
        timeout=seconds,
        check=False,
    )
    assert done.returncode == 0, done.stdout[-2000:] + done.stderr[-2000:]
    return done.stdout + done.stderr


@pytest.fixture(scope="module")
def installed(tmp_path_factory: pytest.TempPathFactory) -> None:
    """The extension, built for that Blender's own Python, installed from its zip."""
    real_blender("install", seconds=1500)
    said = real_blender("python", "--", "-c", "import sys; print('cp%d%d' % sys.version_info[:2])")
    tag = next(line for line in said.splitlines() if line.startswith("cp"))
    folder = tmp_path_factory.mktemp("window")
    manifest = tomllib.loads((ROOT / "blender_manifest.toml").read_text(encoding="utf-8"))
    wheels = build_extension.chosen_wheels(manifest, ["linux-x64"], [tag])
    staged = build_extension.stage(wheels, ["linux-x64"], folder / "stage")
    (made,) = build_extension.build(staged, folder / "zip", build_extension.builder_command(None))
    install = ["--command", "extension", "install-file", "-r", "user_default", "-e", str(made)]
    assert "nstalled" in real_blender("run", "--", "-b", *install)


def test_a_designer_s_first_minute(installed: None, tmp_path: Path) -> None:
    picture, answer = tmp_path / "window.png", tmp_path / "found.json"
    said = real_blender(
        "shot",
        str(picture),
        "-s",
        "150",
        "--",
        "--enable-event-simulate",
        "-P",
        str(SCRIPT),
        "--",
        str(picture),
        str(answer),
    )
    assert answer.exists(), said[-3000:]
    found = json.loads(answer.read_text())
    assert "error" not in found, found["error"]
    assert "Python script error" not in said
    assert found["drawn"] > 0
    assert found["features"] > 200
    assert found["long apply"] == ["RUNNING_MODAL"]
    assert found["objects after Esc"] == ["Grid", "Grid Pattern"]
    assert found["base after Esc"]
    assert found["closed"]
    assert found["euler"] == 2 - 2 * found["holes"]
    assert found["verdict"] == ""
    assert picture.stat().st_size > 50_000
