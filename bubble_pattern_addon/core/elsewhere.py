"""One function of the core in a process of its own, so that a window goes on living meanwhile, and so that
the work can be given up at any moment.

It is for what holds the interpreter from its beginning to its end, as manifold3d's boolean does: neither a
thread nor a timer gets a word in. The other process runs the very same function on the same arrays; where
none can be started, the function runs here.
"""

from __future__ import annotations

import json
import pickle
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

from .progress import Progress, Steps

Result = TypeVar("Result")

MAIN = Path(__file__).with_name("elsewhere_main.py")
# Looked at so often, in seconds.
LOOK = 0.02
# Nothing is ever taken for almost done that may go on for long.
MOST = 0.95
# No window comes up with the process; only Windows needs to be told.
NO_WINDOW = getattr(subprocess, "CREATE_NO_WINDOW", 0)


def elsewhere(
    function: Callable[..., Result], *arguments: Any, stage: str, seconds: float, python: str | None = None
) -> Steps[Result]:
    """Call `function`, one of a module of this package, with `arguments` in a process of its own.

    stage, seconds: what it is called and how long it is expected to take, for the progress that is told;
    python: the interpreter; by default the one that runs this

    Closing the generator ends the process. Raises what the function raises.
    """
    yield Progress(stage, 0.0)
    with tempfile.TemporaryDirectory(prefix="bubble_pattern_", ignore_cleanup_errors=True) as folder:
        given, answer = Path(folder, "given.pickle"), Path(folder, "answer.pickle")
        given.write_bytes(pickle.dumps((function, arguments), protocol=5))
        process = _started(python or sys.executable, given, answer)
        if process is None:
            return function(*arguments)
        start = time.perf_counter()
        try:
            while process.poll() is None:
                yield Progress(stage, min((time.perf_counter() - start) / max(seconds, LOOK), MOST))
                _waited(process)
        finally:
            process.kill()
            process.wait()
        if not answer.exists():  # it could not run there, or was ended: memory, a guard against viruses
            return function(*arguments)
        result, error = pickle.loads(answer.read_bytes())
    if error is not None:
        raise error
    return result


def _started(python: str, given: Path, answer: Path) -> subprocess.Popen[bytes] | None:
    """The process at work; None where it cannot be started."""
    package = __name__.rpartition(".")[0]
    about = {"path": sys.path, "package": package, "folder": str(Path(__file__).parent)}
    given.with_suffix(".json").write_text(json.dumps(about), encoding="utf-8")
    try:
        return subprocess.Popen(
            [python, "-s", "-B", str(MAIN), str(given), str(answer)],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            creationflags=NO_WINDOW,
        )
    except OSError:
        return None


def _waited(process: subprocess.Popen[bytes]) -> None:
    """Wait a moment for the process."""
    try:
        process.wait(LOOK)
    except subprocess.TimeoutExpired:
        return
