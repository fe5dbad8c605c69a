"""The environments of the project: what goes wrong on a bare machine is said in one line that helps."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from scripts import environment
from scripts.environment import EnvironmentProblem


def test_a_fitting_python_is_found_and_others_are_not() -> None:
    version = f"{sys.version_info[0]}.{sys.version_info[1]}"
    found = environment.find_python(version)
    assert found is not None
    answer = subprocess.run([found, "--version"], capture_output=True, text=True, check=True)
    assert f"Python {version}." in answer.stdout
    assert environment.find_python("3.2") is None


def test_the_newest_blender_of_the_available_ones_is_chosen(monkeypatch: pytest.MonkeyPatch) -> None:
    pythons = {"3.11": Path("p311"), "3.13": None}
    monkeypatch.setattr(environment, "find_python", pythons.get)
    assert environment.choose_blender() == ("5.0", Path("p311"))
    assert environment.choose_blender("4.5") == ("4.5", Path("p311"))
    with pytest.raises(EnvironmentProblem, match=r"Python 3\.13 is not on this machine .*install it"):
        environment.choose_blender("5.2")
    with pytest.raises(EnvironmentProblem, match=r"Blender 3\.6 is not supported: choose one of 4\.5"):
        environment.choose_blender("3.6")


def test_an_unsuited_python_is_told_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(environment, "find_python", lambda version: None)
    with pytest.raises(
        EnvironmentProblem, match=r"Python 3\.11 or 3\.13 is not on this machine .*install it"
    ):
        environment.choose_blender()


def test_requirements_take_the_blender_version() -> None:
    wanted = environment.requirements("4.5", ["blender", "test"])
    assert "bpy==4.5.*" in wanted
    assert any(entry.startswith("manifold3d") for entry in wanted)
    assert any(entry.startswith("pytest") for entry in wanted)
    assert not any(entry.startswith("gmsh") for entry in wanted)


@pytest.mark.parametrize("library", environment.LIBRARIES)
def test_a_missing_system_library_is_named_with_its_package(library: str) -> None:
    said = f"ImportError: {library}.so.6: cannot open shared object file: No such file or directory"
    sentence = environment.why_no_blender(f"Traceback ...\n{said}\n")
    apt, dnf = environment.LIBRARIES[library]
    assert f"needs the system library {library}" in sentence
    assert f"`sudo apt install {apt}`" in sentence
    assert f"`sudo dnf install {dnf}`" in sentence
    assert "\n" not in sentence


def test_other_failures_of_the_module_say_their_last_line() -> None:
    assert environment.why_no_blender("Traceback\nImportError: DLL load failed\n").endswith("DLL load failed")
    unknown = environment.why_no_blender("ImportError: libfoo-2.so.1: cannot open shared object file")
    assert "needs the system library libfoo-2" in unknown


def test_without_a_network_one_line_says_so(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for name in [name for name in os.environ if name.upper().startswith("PIP_")]:
        monkeypatch.delenv(name)
    monkeypatch.setenv("PIP_CONFIG_FILE", os.devnull)
    monkeypatch.setenv("PIP_INDEX_URL", "http://127.0.0.1:9/simple")  # nobody listens there
    monkeypatch.setenv("PIP_RETRIES", "1")
    folder = tmp_path / "venv"
    environment._make_venv(folder, Path(getattr(sys, "_base_executable", None) or sys.executable))
    with pytest.raises(EnvironmentProblem, match="without a network: connect this machine") as caught:
        environment._install(folder, ["no-such-package-bubble-pattern"])
    assert "\n" not in str(caught.value)


def test_what_pip_says_becomes_one_sentence(tmp_path: Path) -> None:
    said = "ERROR: No matching distribution found for bpy==5.2.*\n"
    assert environment._why_pip_failed(said, tmp_path).startswith("bpy==5.2.* is not offered")
    said = "ERROR: Could not install packages due to an OSError: [Errno 28] No space left on device\n"
    assert "the disk is full" in environment._why_pip_failed(said, tmp_path)
    assert environment._why_pip_failed("ERROR: odd\n", tmp_path).endswith("could not be set up: odd")


def test_an_environment_is_made_once_and_renewed_with_pyproject(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    project = tmp_path / "pyproject.toml"
    project.write_text(environment.PYPROJECT.read_text("utf-8"), "utf-8")
    installs: list[Path] = []
    monkeypatch.setattr(environment, "ROOT", tmp_path)
    monkeypatch.setattr(environment, "PYPROJECT", project)
    monkeypatch.setattr(environment, "_install", lambda folder, packages: installs.append(folder))
    monkeypatch.setattr(environment, "_check_blender", lambda folder: None)
    python = environment.prepare()
    assert python.exists()
    assert environment.prepare() == python
    assert len(installs) == 1
    environment.prepare(groups=["benchmark"])
    environment.prepare()
    assert len(installs) == 2  # what is there already stays
    project.write_text(project.read_text("utf-8") + "\n# changed\n", "utf-8")
    environment.prepare()
    assert len(installs) == 3


def test_a_failed_set_up_is_tried_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def failing(folder: Path, packages: list[str]) -> None:
        raise EnvironmentProblem("no network")

    monkeypatch.setattr(environment, "ROOT", tmp_path)
    monkeypatch.setattr(environment, "_install", failing)
    monkeypatch.setattr(environment, "_check_blender", lambda folder: None)
    with pytest.raises(EnvironmentProblem):
        environment.prepare()
    done: list[Path] = []
    monkeypatch.setattr(environment, "_install", lambda folder, packages: done.append(folder))
    environment.prepare()
    assert done


def test_a_python_that_has_all_is_stayed_in(monkeypatch: pytest.MonkeyPatch) -> None:
    entered: list[tuple[str, ...]] = []
    monkeypatch.setattr(environment, "enter", lambda *groups: entered.append(groups))
    environment.enter_for_lack_of(environment.CORE, "benchmark")
    assert entered == []
    environment.enter_for_lack_of([*environment.CORE, "no_such_module"], "benchmark")
    assert entered == [("benchmark",)]
