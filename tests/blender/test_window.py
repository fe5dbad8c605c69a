"""The zip in a real Blender with a window: panel drawn, buttons pressed, part checked, Esc obeyed."""

from __future__ import annotations

import json
import os
import select
import shutil
import signal
import subprocess
import tempfile
import threading
import time
import tomllib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

pytest.importorskip("bpy", reason="needs the bpy module's extension builder")

import bpy

from scripts import build_extension

ROOT = Path(__file__).resolve().parents[2]
TOOL = ROOT.parent / "shared" / "tools" / "real-blender"
STORY = ("in_window.py", "parts.py")
"""What that Blender runs, and what it imports."""

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not TOOL.exists(), reason="no ../shared/tools/real-blender beside the repository"),
    pytest.mark.skipif(getattr(os, "geteuid", int)() != 0, reason="real-blender must be run as root"),
    pytest.mark.skipif(bpy.app.version < (5, 1), reason="one drive is enough: with the newest bpy module"),
]
INSTALLING, RUNNING, SHOT = 420, 180, 300
"""Seconds after which the tool, which installs, runs or shows a Blender, is taken to hang."""


def real_blender(*arguments: str, seconds: float = RUNNING) -> tuple[int | None, str]:
    """Run the tool: its exit code, None where it took too long and was ended; what it and Blender said."""
    environment = {**os.environ, "REAL_BLENDER_HOME": "/home/bubble_pattern"}
    for name in ("BLENDER_USER_RESOURCES", "BLENDER_USER_EXTENSIONS"):
        environment.pop(name, None)
    # to a file and as a group of its own: a pipe would stay open as long as any grandchild lives
    with tempfile.TemporaryFile() as said:
        process = subprocess.Popen(
            [str(TOOL), *arguments],
            # that Blender sees the folder it is started in, and keeps seeing it as it was when first used: a
            # clone made anew where another was deleted is not there for it, the temporary folder always is
            cwd=tempfile.gettempdir(),
            env=environment,
            stdin=subprocess.DEVNULL,
            stdout=said,
            stderr=subprocess.STDOUT,
            start_new_session=True,
        )
        try:
            code = process.wait(seconds)
        except subprocess.TimeoutExpired:
            code = None
        finally:
            end_group(process)
        said.seek(0)
        return code, said.read().decode(errors="replace")


def end_group(process: subprocess.Popen) -> None:
    """End the tool with its Blender and its screen."""
    for how in (signal.SIGTERM, signal.SIGKILL):
        try:
            os.killpg(process.pid, how)
        except ProcessLookupError:
            break
        time.sleep(0.5)
    process.wait()


def succeeded(*arguments: str) -> str:
    """What a run of the tool said that must not fail."""
    code, said = real_blender(*arguments)
    assert code == 0, f"real-blender {arguments[0]}: exit code {code}\n{said[-3000:]}"
    return said


@pytest.fixture(scope="module")
def installed(tmp_path_factory: pytest.TempPathFactory) -> None:
    """The extension, built for that Blender's own Python, installed from its zip."""
    code, said = real_blender("install", seconds=INSTALLING)
    if code != 0:
        pytest.skip(f"no real Blender could be installed here: {last_line(said)}")
    said = succeeded("python", "--", "-c", "import sys; print('cp%d%d' % sys.version_info[:2])")
    tag = next(line for line in said.splitlines() if line.startswith("cp"))
    folder = tmp_path_factory.mktemp("window")
    manifest = tomllib.loads((ROOT / "blender_manifest.toml").read_text(encoding="utf-8"))
    wheels = build_extension.chosen_wheels(manifest, ["linux-x64"], [tag])
    staged = build_extension.stage(wheels, ["linux-x64"], folder / "stage")
    (made,) = build_extension.build(staged, folder / "zip", build_extension.builder_command(None))
    install = ["--command", "extension", "install-file", "-r", "user_default", "-e", str(made)]
    assert "nstalled" in succeeded("run", "--", "-b", *install)


def last_line(text: str) -> str:
    lines = [line for line in text.splitlines() if line.strip()]
    return lines[-1].strip() if lines else "it said nothing"


@pytest.fixture
def screen(installed: None) -> None:
    """A virtual screen that comes up."""
    server = shutil.which("Xvfb")
    if server is None:
        pytest.skip("no virtual screen: Xvfb is not there")
    # the server tells the number of a display on this descriptor as soon as it can be used
    reading, writing = os.pipe()
    command = [server, "-displayfd", str(writing), "-screen", "0", "1600x1000x24"]
    process = subprocess.Popen(
        command,
        pass_fds=[writing],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        start_new_session=True,
    )
    os.close(writing)
    try:
        ready, _, _ = select.select([reading], [], [], 30)
        up = bool(ready and os.read(reading, 16))
    finally:
        os.close(reading)
        end_group(process)
    if not up:
        pytest.skip("no virtual screen: Xvfb does not come up")


@contextmanager
def taking_photos(folder: Path) -> Iterator[None]:
    """Take the pictures that a story asks for by a file NAME.wanted, which says on which display."""
    over = threading.Event()

    def look() -> None:
        while not over.wait(0.2):
            for wanted in folder.glob("*.wanted"):
                display, target = wanted.read_text(encoding="utf-8"), wanted.with_suffix(".png")
                if display:
                    subprocess.run(
                        ["import", "-display", display, "-window", "root", str(target)], check=False
                    )
                    wanted.unlink()

    photographer = threading.Thread(target=look)
    photographer.start()
    try:
        yield
    finally:
        over.set()
        photographer.join()


def test_a_designer_s_first_hour(screen: None, tmp_path: Path) -> None:
    picture, answer = tmp_path / "window.png", tmp_path / "found.json"
    for name in STORY:
        shutil.copy(Path(__file__).with_name(name), tmp_path)
    with taking_photos(tmp_path):
        _, said = real_blender(
            "shot",
            str(picture),
            "-s",
            str(SHOT),
            "--",
            "--enable-event-simulate",
            "-P",
            str(tmp_path / STORY[0]),
            "--",
            str(picture),
            str(answer),
            seconds=SHOT + RUNNING,
        )
    assert answer.exists(), said[-3000:]
    found = json.loads(answer.read_text())
    assert "error" not in found, found["error"]
    assert "Python script error" not in said
    assert found["drawn"] > 0
    assert found["features"] > 200
    assert found["after undo"] == ["CIRCLE", True]
    assert found["laid in the burst"] <= 1
    assert found["laid after the burst"] <= 2
    assert found["points after the burst"]
    assert found["long update"] == ["RUNNING_MODAL"]
    assert found["still packing"]
    assert found["after the right click"] == [True, True, "Grid Pattern"]
    assert found["undo and redo of a long change"], found["states"]
    assert found["asked"] == ["RUNNING_MODAL"]
    assert found["moved after Esc"] == 1
    assert found["long apply"] == ["RUNNING_MODAL"]
    assert found["objects after Esc"] == ["Grid", "Grid Pattern"]
    assert found["base after Esc"]
    assert found["closed"]
    assert found["euler"] == 2 - 2 * found["holes"]
    assert found["verdict"] == ""
    assert min(found[suffix] for suffix in ("stl", "csv", "dxf")) > 10_000
    for name in ("1-select", "2-add", "3-settling", "3-asked", "4-wider", "5-slots", "6-cancelled", "7-part"):
        assert (tmp_path / f"{name}.png").stat().st_size > 50_000
    assert picture.stat().st_size > 50_000
