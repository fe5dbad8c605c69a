"""Build the Blender extension: one zip per platform, wheels included.

    python scripts/build_extension.py                       # every platform, into dist/
    python scripts/build_extension.py --platform linux-x64  # this one only
    python scripts/build_extension.py --python-tag cp314    # for a Blender with another Python
    python scripts/build_extension.py --validate            # stage and validate, build nothing

The wheels are those that blender_manifest.toml lists; pip fetches what wheels/ lacks. Then the package's
files, the manifest and the wheels are staged into one folder (the builder wants `__init__.py` beside the
manifest), and Blender's own builder makes the zips. The builder is `--blender PROGRAM`, or else the one in
the `bpy` module of this Python.
"""

from __future__ import annotations

import argparse
import importlib.util
import shutil
import subprocess
import sys
import tempfile
import tomllib
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

ROOT = Path(__file__).resolve().parent.parent
PACKAGE = ROOT / "bubble_pattern_addon"
MANIFEST = ROOT / "blender_manifest.toml"
WHEELS = ROOT / "wheels"
STAGE = ROOT / "build" / "extension"
# What a wheel's platform tag must contain, per platform of the manifest.
WHEEL_PLATFORMS = {
    "linux-x64": ("manylinux", "x86_64"),
    "windows-x64": ("win_amd64", ""),
    "macos-arm64": ("macosx", "arm64"),
    "macos-x64": ("macosx", "x86_64"),
}


class BuildError(Exception):
    """A build that cannot go on: one sentence that says why, and what to do."""


class Wheel(NamedTuple):
    """A wheel's file name taken apart (PEP 427)."""

    name: str
    version: str
    python: str
    abi: str
    platform: str

    @property
    def file_name(self) -> str:
        return "-".join(self) + ".whl"

    @property
    def pure(self) -> bool:
        return self.platform == "any"

    def runs_on(self, platform: str) -> bool:
        """Whether this wheel is one for `platform`, a name of the manifest."""
        system, machine = WHEEL_PLATFORMS[platform]
        return self.pure or (system in self.platform and machine in self.platform)


def listed_wheels(manifest: dict[str, Any]) -> list[Wheel]:
    """The wheels of the manifest, refused where one must not be bundled."""
    wheels = []
    for path in manifest["wheels"]:
        parts = Path(path).name.removesuffix(".whl").split("-")
        if len(parts) != 5:
            raise BuildError(f"{path} in {MANIFEST.name} is no wheel's name: list the file as pip names it.")
        wheel = Wheel(*parts)
        if wheel.name == "numpy" or "musllinux" in wheel.platform or wheel.abi.endswith("t"):
            raise BuildError(
                f"{path} must not be bundled (Blender brings numpy, and runs neither musl nor free threads)."
            )
        wheels.append(wheel)
    return wheels


def chosen_wheels(manifest: dict[str, Any], platforms: Sequence[str], tags: Sequence[str]) -> list[Wheel]:
    """The listed wheels for `platforms` and for the Pythons `tags`.

    A tag that the manifest does not know gets each package's listed version for that Python, as pip finds it.
    """
    listed = [
        wheel for wheel in listed_wheels(manifest) if any(wheel.runs_on(platform) for platform in platforms)
    ]
    known = {wheel.python for wheel in listed if not wheel.pure}
    chosen = [wheel for wheel in listed if wheel.pure or not tags or wheel.python in tags]
    for tag in set(tags) - known:
        patterns = {(w.name, w.version, p) for w in listed if not w.pure for p in platforms if w.runs_on(p)}
        chosen += [found_wheel(name, version, tag, platform) for name, version, platform in sorted(patterns)]
    return chosen


def pip_download(wheel_arguments: Sequence[str], folder: Path) -> None:
    """Run pip's download of one wheel, without its dependencies, into `folder`."""
    command = [sys.executable, "-m", "pip", "download", "--quiet", "--disable-pip-version-check", "--no-deps"]
    command += ["--only-binary=:all:", "--dest", str(folder), *wheel_arguments]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        reason = [line for line in done.stderr.splitlines() if line.startswith("ERROR")] or ["pip failed"]
        wanted = next((word for word in wheel_arguments if "==" in word), "a wheel")
        raise BuildError(
            f"{wanted} could not be downloaded ({reason[-1]}): check the network and the manifest."
        )


def tag_arguments(python: str, platforms: Sequence[str]) -> list[str]:
    """Pip's arguments for a Python tag such as cp313 and for the platform tags of a wheel."""
    digits = python.removeprefix("cp")
    arguments = ["--implementation", "cp", "--abi", python, "--python-version", f"{digits[0]}.{digits[1:]}"]
    for platform in platforms:
        arguments += ["--platform", platform]
    return arguments


def fetch_wheel(wheel: Wheel) -> Path:
    """The file of `wheel` in wheels/, downloaded where it is not there yet."""
    path = WHEELS / wheel.file_name
    if path.exists():
        return path
    print(f"Downloading {wheel.file_name}")
    WHEELS.mkdir(exist_ok=True)
    tags = [] if wheel.pure else tag_arguments(wheel.python, wheel.platform.split("."))
    with tempfile.TemporaryDirectory(dir=WHEELS) as folder:  # a broken download never lies in wheels/
        pip_download([*tags, f"{wheel.name}=={wheel.version}"], Path(folder))
        got = Path(folder) / wheel.file_name
        if not got.exists():
            others = ", ".join(sorted(other.name for other in Path(folder).iterdir()))
            raise BuildError(
                f"pip brought {others} for {wheel.file_name}: correct the name in {MANIFEST.name}."
            )
        got.replace(path)
    return path


def found_wheel(name: str, version: str, tag: str, platform: str) -> Wheel:
    """The wheel that pip finds for a Python that the manifest has none for; it is left in wheels/."""
    for path in sorted(WHEELS.glob(f"{name}-{version}-{tag}-*.whl")):
        wheel = Wheel(*path.stem.split("-"))
        if wheel.runs_on(platform):
            return wheel
    minors = {"linux-x64": [f"manylinux_2_{minor}_x86_64" for minor in range(17, 40)]}
    minors["windows-x64"] = ["win_amd64"]
    minors["macos-arm64"] = [f"macosx_{major}_0_arm64" for major in range(11, 16)]
    minors["macos-x64"] = [f"macosx_{major}_0_x86_64" for major in range(11, 16)]
    WHEELS.mkdir(exist_ok=True)
    with tempfile.TemporaryDirectory(dir=WHEELS) as folder:
        pip_download([*tag_arguments(tag, minors[platform]), f"{name}=={version}"], Path(folder))
        got = next(Path(folder).glob("*.whl"))
        got.replace(WHEELS / got.name)
    return Wheel(*got.stem.split("-"))


def manifest_text(wheels: Sequence[Wheel], platforms: Sequence[str]) -> str:
    """The manifest with its platforms and wheels narrowed to what is staged; all else word for word."""
    text = MANIFEST.read_text(encoding="utf-8")
    for key, values in (("platforms", platforms), ("wheels", [f"./wheels/{w.file_name}" for w in wheels])):
        start = text.index(f"\n{key} = [") + 1
        end = text.index("]", start) + 1
        text = text[:start] + f"{key} = [" + ", ".join(f'"{value}"' for value in values) + "]" + text[end:]
    return text


def stage(wheels: Sequence[Wheel], platforms: Sequence[str], folder: Path = STAGE) -> Path:
    """Lay package, manifest, licence and wheels into one fresh folder, and return it."""
    if folder.exists():
        shutil.rmtree(folder)
    shutil.copytree(PACKAGE, folder, ignore=shutil.ignore_patterns("__pycache__", "*.pyc"))
    (folder / MANIFEST.name).write_text(manifest_text(wheels, platforms), encoding="utf-8")
    if (ROOT / "LICENSE").exists():
        shutil.copy(ROOT / "LICENSE", folder)
    (folder / "wheels").mkdir()
    for wheel in wheels:
        shutil.copy(fetch_wheel(wheel), folder / "wheels")
    return folder


def builder_command(blender: str | None) -> list[str]:
    """The start of the command line of Blender's extension builder: a Blender's own, or the bpy module's."""
    if blender:
        program = shutil.which(blender)
        if program is None:
            raise BuildError(f"{blender} was not found: give --blender the path of a Blender 4.5 or later.")
        return [program, "--factory-startup", "--command", "extension"]
    module = importlib.util.find_spec("bpy")
    places = list(module.submodule_search_locations or []) if module else []
    for place in places:
        for script in Path(place).glob("*/scripts/addons_core/bl_pkg/cli/blender_ext.py"):
            return [sys.executable, str(script)]
    raise BuildError(
        "No Blender to build with: give --blender PROGRAM, or run this with a Python that has bpy."
    )


def run_builder(command: Sequence[str], *arguments: str) -> None:
    """Run one command of the builder; what it prints is shown only when it fails, as the reason."""
    done = subprocess.run([*command, *arguments], capture_output=True, text=True, check=False)
    if done.returncode:
        raise BuildError(f"Blender's builder refused the extension:\n{done.stdout}{done.stderr}")


def build(folder: Path, out: Path, command: Sequence[str]) -> list[Path]:
    """Build the staged `folder` into one zip per platform and return their paths."""
    out.mkdir(parents=True, exist_ok=True)
    for old in out.glob("*.zip"):
        old.unlink()
    tags = [] if "--command" in command else ["--valid-tags", ""]
    run_builder(command, "validate", *tags, str(folder))
    run_builder(
        command, "build", *tags, "--split-platforms", "--source-dir", str(folder), "--output-dir", str(out)
    )
    return sorted(out.glob("*.zip"))


def parse(arguments: Sequence[str] | None) -> argparse.Namespace:
    """Read the command line."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--out", type=Path, default=ROOT / "dist", help="folder for the zips (default: dist)")
    parser.add_argument(
        "--platform", action="append", choices=sorted(WHEEL_PLATFORMS), help="may be repeated"
    )
    parser.add_argument("--python-tag", action="append", default=[], help="such as cp313; may be repeated")
    parser.add_argument("--blender", help="a Blender to build with, instead of the bpy module's builder")
    parser.add_argument("--validate", action="store_true", help="only stage and validate")
    return parser.parse_args(arguments)


def main(arguments: Sequence[str] | None = None) -> int:
    """Build what the command line says; returns the exit code."""
    options = parse(arguments)
    try:
        manifest = tomllib.loads(MANIFEST.read_text(encoding="utf-8"))
        platforms = options.platform or manifest["platforms"]
        command = builder_command(options.blender)
        folder = stage(chosen_wheels(manifest, platforms, options.python_tag), platforms)
        if options.validate:
            run_builder(command, "validate", *([] if options.blender else ["--valid-tags", ""]), str(folder))
            print(f"{folder.relative_to(ROOT)} is a valid extension")
            return 0
        for path in build(folder, options.out, command):
            print(f"{path} ({path.stat().st_size / 1e6:.0f} MB)")
    except BuildError as error:
        print(f"build_extension: {error}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
