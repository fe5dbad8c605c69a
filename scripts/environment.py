"""The project's own Python environments: made on first use, with nothing but the standard library.

`enter()` at the top of a script makes sure that the script runs in an environment with all it needs: `.venv`
beside this folder, with the newest Blender module (`bpy`) that the Pythons of this machine allow. The
environment is made on first use, brought up to date when pyproject.toml has changed, and the script is then
started anew inside. Other Blender versions live beside it: `.venv-4.5`, `.venv-5.0`, ...

    python3 scripts/environment.py                    make .venv and say where it is
    python3 scripts/environment.py --blender 4.5      the same for another Blender version
    python3 scripts/environment.py --system-packages  Debian packages that the Blender module needs on Linux
"""

from __future__ import annotations

import argparse
import contextlib
import hashlib
import json
import os
import re
import shutil
import subprocess
import sys
import threading
import time
from collections.abc import Iterator, Sequence
from importlib.util import find_spec
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
PYPROJECT = ROOT / "pyproject.toml"

# the Python that each Blender version's module is built for; newest last
BLENDERS = {"4.5": "3.11", "5.0": "3.11", "5.1": "3.13", "5.2": "3.13"}
CORE = ("numpy", "scipy", "trimesh", "manifold3d")  # the modules that the core runs on
GROUPS = ("scripts", "blender", "test", "lint")

# shared libraries that the Blender module asks of a Linux system, and the packages that bring them
LIBRARIES = {
    "libX11": ("libx11-6", "libX11"),
    "libXrender": ("libxrender1", "libXrender"),
    "libXxf86vm": ("libxxf86vm1", "libXxf86vm"),
    "libXfixes": ("libxfixes3", "libXfixes"),
    "libXi": ("libxi6", "libXi"),
    "libXext": ("libxext6", "libXext"),
    "libXt": ("libxt6", "libXt"),
    "libSM": ("libsm6", "libSM"),
    "libICE": ("libice6", "libICE"),
    "libxkbcommon": ("libxkbcommon0", "libxkbcommon"),
    "libGL": ("libgl1", "libglvnd-glx"),
}


class EnvironmentProblem(Exception):
    """Something about this machine that the user can mend: one sentence with what to do."""


# -- Pythons -------------------------------------------------------------------------------------------------


def find_python(version: str) -> Path | None:
    """A Python of this version ("3.13") on this machine that suits Blender's module, None for none."""
    for candidate in _candidates(version):
        found = _probe(candidate, version)
        if found:
            return found
    return None


def _candidates(version: str) -> Iterator[list[str]]:
    if sys.version_info[:2] == tuple(int(part) for part in version.split(".")):
        yield [getattr(sys, "_base_executable", None) or sys.executable]
    for name in (f"python{version}", "python3", "python"):
        path = shutil.which(name)
        if path:
            yield [path]
    pyenv = Path(os.environ.get("PYENV_ROOT") or Path.home() / ".pyenv")
    for folder in (pyenv / "versions", pyenv / "pyenv-win" / "versions"):
        for home in sorted(folder.glob(f"{version}.*"), reverse=True):
            yield from ([str(p)] for p in (home / "bin" / "python3", home / "python.exe") if p.exists())
    framework = Path(f"/Library/Frameworks/Python.framework/Versions/{version}/bin/python3")
    if framework.exists():
        yield [str(framework)]
    if shutil.which("py"):
        yield ["py", f"-{version}"]
    if shutil.which("uv"):
        answer = _answer(["uv", "python", "find", version])
        if answer:
            yield [answer]


PROBE = (
    "import sys, sysconfig; assert not sysconfig.get_config_var('Py_GIL_DISABLED') and sys.maxsize > 2**32; "
    "print('%d.%d' % sys.version_info[:2], getattr(sys, '_base_executable', None) or sys.executable)"
)


def _probe(command: Sequence[str], version: str) -> Path | None:
    """The interpreter behind `command` if it is of this version, 64-bit and not free-threaded."""
    answer = _answer([*command, "-c", PROBE])
    if answer and answer.split(" ", 1)[0] == version:
        return Path(answer.split(" ", 1)[1])
    return None


def _answer(command: Sequence[str]) -> str | None:
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=30, check=False)
    except (OSError, subprocess.TimeoutExpired):
        return None
    return done.stdout.strip() if done.returncode == 0 else None


def available_blenders() -> dict[str, Path]:
    """Blender versions for which this machine has a Python, newest first: version -> Python."""
    pythons = {version: find_python(version) for version in dict.fromkeys(BLENDERS.values())}
    found = {blender: pythons[python] for blender, python in reversed(BLENDERS.items())}
    return {blender: python for blender, python in found.items() if python is not None}


def choose_blender(wanted: str | None = None) -> tuple[str, Path]:
    """The Blender version to use (the newest possible one if none is wanted) and its Python."""
    if wanted is not None and wanted not in BLENDERS:
        raise EnvironmentProblem(f"Blender {wanted} is not supported: choose one of {', '.join(BLENDERS)}")
    available = available_blenders()
    if wanted is None and available:
        return next(iter(available.items()))
    if wanted in available:
        return wanted, available[wanted]
    need = f"Python {BLENDERS[wanted]}" if wanted else "Python 3.11 or 3.13"
    reason = f"Blender {wanted} needs it" if wanted else f"this is Python {sys.version.split()[0]}"
    raise EnvironmentProblem(
        f"{need} is not on this machine ({reason}): install it from python.org or your system's packages, "
        "64-bit and not free-threaded"
    )


# -- environments --------------------------------------------------------------------------------------------


def folder_of(blender: str, newest: bool) -> Path:
    """Where the environment of a Blender version is."""
    return ROOT / (".venv" if newest else f".venv-{blender}")


def python_in(folder: Path) -> Path:
    """The interpreter of a virtual environment."""
    return folder / ("Scripts/python.exe" if os.name == "nt" else "bin/python")


def prepare(blender: str | None = None, groups: Sequence[str] = ()) -> Path:
    """The interpreter of an environment with this Blender's module (None: the newest) and all `groups`.

    Raises EnvironmentProblem where it can't be made.
    """
    newest, _ = choose_blender()
    version, python = choose_blender(blender)
    folder = folder_of(version, version == newest)
    wanted = sorted({*GROUPS, *groups})
    with _lock(folder):
        _bring_up_to_date(folder, python, version, wanted)
    return python_in(folder)


def _bring_up_to_date(folder: Path, python: Path, blender: str, groups: Sequence[str]) -> None:
    stamp_file = folder / "bubble-pattern.json"
    stamp = {
        "pyproject": hashlib.sha256(PYPROJECT.read_bytes()).hexdigest(),
        "python": BLENDERS[blender],
        "blender": blender,
    }
    try:
        old = json.loads(stamp_file.read_text("utf-8"))
    except (OSError, ValueError):
        old = {}
    installed = old.pop("groups", [])
    if old == stamp and set(groups) <= set(installed) and python_in(folder).exists():
        return
    if {**old, "pyproject": ""} != {**stamp, "pyproject": ""} or not python_in(folder).exists():
        _make_venv(folder, python)
        installed = []
    stamp_file.unlink(missing_ok=True)
    groups = sorted({*groups, *installed})
    _install(folder, requirements(blender, groups))
    _check_blender(folder)
    stamp_file.write_text(json.dumps({**stamp, "groups": groups}), "utf-8")


def requirements(blender: str, groups: Sequence[str]) -> list[str]:
    """What pip is to install: the core's dependencies and those of the groups, as pyproject.toml has them."""
    import tomllib

    project = tomllib.loads(PYPROJECT.read_text("utf-8"))["project"]
    wanted = [*project["dependencies"]]
    for group in groups:
        wanted += project["optional-dependencies"][group]
    return [f"bpy=={blender}.*" if entry == "bpy" else entry for entry in wanted]


def _make_venv(folder: Path, python: Path) -> None:
    if folder.exists():
        shutil.rmtree(folder)
    done = subprocess.run(
        [str(python), "-m", "venv", str(folder)], capture_output=True, text=True, check=False
    )
    if done.returncode:
        shutil.rmtree(folder, ignore_errors=True)
        output = done.stdout + done.stderr
        if "ensurepip" in output or "No module named venv" in output:
            version = re.sub(r".*?(3\.\d+).*", r"\1", python.name) if "3." in python.name else "3"
            raise EnvironmentProblem(
                f"{python} can't make virtual environments: install them with "
                f"`sudo apt install python{version}-venv`"
            )
        raise EnvironmentProblem(f"{folder} could not be made: {_last_line(output)}")


def _install(folder: Path, packages: Sequence[str]) -> None:
    command = [str(python_in(folder)), "-m", "pip", "install", "--disable-pip-version-check", "--no-input"]
    command += ["--progress-bar", "off", "--upgrade-strategy", "only-if-needed", *packages]
    lines: list[str] = []
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, errors="replace"
    ) as pip:
        assert pip.stdout is not None
        with _Ticker(f"Setting up {folder.name}") as ticker:
            for line in pip.stdout:
                lines.append(line)
                match = re.match(r"Collecting (\S+)|(Installing) collected|\s+(Downloading) (\S+)", line)
                if match:
                    ticker.say(" ".join(part for part in match.groups() if part))
    if pip.returncode:
        raise EnvironmentProblem(_why_pip_failed("".join(lines), folder))


NO_NETWORK = (
    "connection broken|Failed to establish|Name or service not known|name resolution|getaddrinfo|"
    "Network is unreachable|NewConnectionError|ProxyError|Connection refused"
)


def _why_pip_failed(output: str, folder: Path) -> str:
    """One sentence out of pip's many."""
    if re.search(NO_NETWORK, output):
        return f"{folder.name} could not be set up without a network: connect this machine once and try again"
    if "No space left" in output:
        return f"{folder.name} could not be set up, the disk is full: free about 3 GB and try again"
    missing = re.search(r"No matching distribution found for (\S+)", output)
    if missing:
        return f"{missing[1]} is not offered for this machine and Python: see README.md for what is supported"
    errors = [line for line in output.splitlines() if line.startswith("ERROR:")]
    return f"{folder.name} could not be set up: {errors[0][7:] if errors else _last_line(output)}"


def _check_blender(folder: Path) -> None:
    """Import bpy once, to name the system library that is missing rather than fail in the middle of work."""
    code = "import bpy; print(bpy.app.version_string)"
    environment = {**os.environ, "BLENDER_USER_RESOURCES": str(folder / "blender-user")}
    with _Ticker("Trying Blender's module"):
        done = subprocess.run(
            [str(python_in(folder)), "-c", code],
            capture_output=True,
            text=True,
            check=False,
            env=environment,
        )
    if done.returncode:
        raise EnvironmentProblem(why_no_blender(done.stdout + done.stderr))


def why_no_blender(output: str) -> str:
    """One sentence for a failed `import bpy`, with the package to install where a library is missing."""
    missing = re.search(r"(lib[\w+.-]+?)\.so[.\d]*: cannot open shared object", output)
    if not missing:
        return f"Blender's Python module does not start here: {_last_line(output)}"
    apt, dnf = LIBRARIES.get(missing[1], (None, None))
    if apt is None:
        return f"Blender's Python module needs the system library {missing[1]}: install its package"
    every = " ".join(package for package, _ in LIBRARIES.values())
    return (
        f"Blender's Python module needs the system library {missing[1]}: "
        f"`sudo apt install {apt}` or `sudo dnf install {dnf}` (all it may need: `sudo apt install {every}`)"
    )


def _last_line(text: str) -> str:
    lines = [line for line in text.splitlines() if line.strip()]
    return lines[-1].strip() if lines else "no reason was given"


@contextlib.contextmanager
def _lock(folder: Path) -> Iterator[None]:
    """Only one process works on an environment at a time; the lock goes with the process that holds it."""
    with folder.with_name(f"{folder.name}.lock").open("w") as file:
        if sys.platform == "win32":
            import msvcrt

            while True:
                try:
                    msvcrt.locking(file.fileno(), msvcrt.LK_LOCK, 1)  # gives up after ten seconds
                    break
                except OSError:
                    continue
        else:
            import fcntl

            fcntl.flock(file, fcntl.LOCK_EX)
        yield


class _Ticker:
    """A line on stderr that shows that work goes on: what, what now, and for how long."""

    def __init__(self, title: str) -> None:
        self.title = title
        self.now = ""
        self.start = time.monotonic()
        self.stop = threading.Event()
        self.thread = threading.Thread(target=self._tick, daemon=True)

    def say(self, now: str) -> None:
        self.now = now

    def _tick(self) -> None:
        if not sys.stderr.isatty():
            print(f"{self.title} ...", file=sys.stderr, flush=True)
            return
        for turn in range(10**9):
            seconds = time.monotonic() - self.start
            text = f"{self.title} {'|/-'[turn % 3]} {seconds:.0f} s  {self.now}"[:78]
            print(f"\r{text:<79}", end="", file=sys.stderr, flush=True)
            if self.stop.wait(0.3):
                print(f"\r{'':<79}\r", end="", file=sys.stderr, flush=True)
                return

    def __enter__(self) -> _Ticker:
        self.thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self.stop.set()
        self.thread.join()


# -- for scripts ---------------------------------------------------------------------------------------------


def enter(*groups: str, blender: str | None = None) -> None:
    """Return inside the environment, or start this script anew in it; on trouble say one line and exit 1."""
    try:
        inside = prepare(blender, groups)
    except EnvironmentProblem as problem:
        sys.exit(f"{Path(sys.argv[0]).name}: {problem}")
    except OSError as error:
        sys.exit(f"{Path(sys.argv[0]).name}: the environment could not be made: {error}")
    # a virtual environment is told by its prefix: its interpreter is a link to another one's
    if Path(sys.prefix).resolve() == inside.parent.parent.resolve():
        return
    command = [str(inside), *sys.argv]
    sys.stderr.flush()
    if os.name == "nt":  # os.exec there returns to the shell at once
        sys.exit(subprocess.call(command))
    os.execv(command[0], command)


def enter_for_lack_of(modules: Sequence[str], *groups: str) -> None:
    """`enter` with these groups where this Python lacks one of the modules; else go on in it."""
    if any(find_spec(module) is None for module in modules):
        enter(*groups)


def borrow(libraries: Sequence[str]) -> None:
    """Let the Blender that runs this script import libraries that it does not bring along.

    They are installed beside this folder with Blender's own Python on first use, to fit Blender's own numpy,
    which stays the one in use. On trouble say one line and exit 1.
    """
    import numpy

    version = f"{sys.version_info[0]}.{sys.version_info[1]}"
    folder = ROOT / f".venv-inside-{version}-numpy-{numpy.__version__}"
    marker = folder / "complete"
    try:
        with _lock(folder):
            if not marker.exists():
                _make_venv(folder, Path(sys.executable))
                _install(folder, [f"numpy=={numpy.__version__}", *libraries])
                marker.touch()
    except (EnvironmentProblem, OSError) as problem:
        sys.exit(
            f"pattern_batch.py: Blender lacks {', '.join(libraries)}, and they can't be installed "
            f"({problem}): install the Bubble Pattern extension in Blender, which brings them"
        )
    inside = "Lib/site-packages" if os.name == "nt" else f"lib/python{version}/site-packages"
    sys.path.append(str(folder / inside))


def main() -> None:
    """Make an environment by hand."""
    parser = argparse.ArgumentParser(description="Make the project's Python environment.")
    parser.add_argument(
        "--blender", help=f"Blender version: {', '.join(BLENDERS)} (default: the newest possible)"
    )
    parser.add_argument("--system-packages", action="store_true", help="list the Debian packages bpy needs")
    options = parser.parse_args()
    if options.system_packages:
        print(" ".join(apt for apt, _ in LIBRARIES.values()))
        return
    try:
        print(prepare(options.blender))
    except EnvironmentProblem as problem:
        sys.exit(f"environment.py: {problem}")


if __name__ == "__main__":
    main()
