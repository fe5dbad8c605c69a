"""Run the tests: python3 scripts/test.py [--blender 4.5] [pytest's arguments]

The environment is made on first use (see environment.py). The default is the newest Blender that the Pythons
of this machine allow; --blender takes another one. Everything else goes through to pytest:

    python3 scripts/test.py                           all tests
    python3 scripts/test.py tests/core -k recipe      some of them
    python3 scripts/test.py --blender 4.5             all tests with Blender 4.5's module and its Python
    python3 scripts/test.py --lint                    formatting, lint and types instead of tests
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))

from scripts import environment  # noqa: E402

TIME_LIMIT = 40 * 60  # seconds; a Blender module that hangs at its exit must not hang its caller
# The systems that are solved are small: threads for them cost a busy machine far more than they save.
SURROUNDINGS = {"PYTHONDONTWRITEBYTECODE": "1", "OPENBLAS_NUM_THREADS": "1"}
LINTERS = (["ruff", "format", "--check", "."], ["ruff", "check", "."], ["mypy"])


def main() -> int:
    """Run pytest, or the linters, in the environment of one Blender version; returns the exit code."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter, allow_abbrev=False
    )
    parser.add_argument("--blender", metavar="VERSION", help=", ".join(environment.BLENDERS))
    parser.add_argument("--if-possible", action="store_true", help="pass where there is no Python for it")
    parser.add_argument("--lint", action="store_true", help="ruff and mypy instead of the tests")
    options, arguments = parser.parse_known_args()
    if options.if_possible and options.blender not in environment.available_blenders():
        need = environment.BLENDERS.get(options.blender, "of that version")
        print(f"Blender {options.blender}: not tested here, this machine has no Python {need}", flush=True)
        return 0
    try:
        version, _ = environment.choose_blender(options.blender)
        python = environment.prepare(version)
    except environment.EnvironmentProblem as problem:
        sys.exit(f"test.py: {problem}")
    print(f"Blender {version} module, Python {environment.BLENDERS[version]}", flush=True)
    if options.lint:
        return max(_run([str(python), "-m", *linter]) for linter in LINTERS)
    return _run([str(python), "-m", "pytest", *arguments])


def _run(command: list[str]) -> int:
    with subprocess.Popen(command, cwd=ROOT, env={**os.environ, **SURROUNDINGS}) as process:
        try:
            return process.wait(TIME_LIMIT)
        except subprocess.TimeoutExpired:
            process.kill()
            print(f"test.py: ended after {TIME_LIMIT // 60} minutes without an end", file=sys.stderr)
            return 1
        except KeyboardInterrupt:
            process.wait()
            return 130


if __name__ == "__main__":
    sys.exit(main())
