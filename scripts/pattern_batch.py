"""Make a part with a pattern unattended, in Blender or in plain Python.

blender -b [FILE.blend] -P scripts/pattern_batch.py -- RECIPE.toml [--base MODEL] --out DIR
python3 scripts/pattern_batch.py RECIPE.toml --base MODEL --out DIR

In plain Python the libraries come from the environment the script is started in, or else from .venv, which is
made on first use. In Blender they come with the extension; where it is not installed they are taken from an
environment beside this folder, made with Blender's own Python on first use.
"""

from __future__ import annotations

import sys
from importlib.util import find_spec
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))

from scripts import environment  # noqa: E402
from scripts.progress_bar import progress_bar  # noqa: E402

LIBRARIES = ("numpy", "scipy", "trimesh", "manifold3d")


def in_blender() -> bool:
    """Whether this runs inside a Blender program (the bpy module in a Python has no binary)."""
    bpy: Any = sys.modules.get("bpy")
    return bpy is not None and bool(bpy.app.binary_path)


def own_arguments() -> list[str]:
    """The arguments that are meant for this script: in Blender those after --."""
    if not in_blender():
        return sys.argv[1:]
    return sys.argv[sys.argv.index("--") + 1 :] if "--" in sys.argv else []


def find_libraries(arguments: list[str]) -> None:
    """Make sure that the core can be imported, and bpy where the base is a .blend."""
    missing = [name for name in LIBRARIES if find_spec(name) is None]
    if in_blender():
        if missing:
            environment.borrow(missing)
        return
    if missing or (find_spec("bpy") is None and _asks_for_blender(arguments)):
        environment.enter()


def _asks_for_blender(arguments: list[str]) -> bool:
    """Whether the base is a .blend, or the recipe wants one or a picture, or has an image to be read; a
    broken recipe is told of later.
    """
    import tomllib

    if any(argument.lower().endswith(".blend") for argument in arguments):
        return True
    for argument in arguments:
        if argument.lower().endswith(".toml"):
            try:
                tables = tomllib.loads(Path(argument).read_text("utf-8"))
                output = tables.get("output", {})
                return bool(output.get("blend") or output.get("picture")) or _has_image(tables)
            except (OSError, ValueError, AttributeError):
                return False
    return False


def _has_image(value: object) -> bool:
    """Whether there is a field of the kind image somewhere in these tables."""
    if isinstance(value, dict):
        return value.get("kind") == "image" or any(map(_has_image, value.values()))
    return isinstance(value, list) and any(map(_has_image, value))


def main() -> int:
    """Run the batch and return its exit code."""
    arguments = own_arguments()
    if not {"-h", "--help"} & set(arguments):
        find_libraries(arguments)
    elif any(find_spec(name) is None for name in LIBRARIES):
        print(__doc__)
        return 0
    from bubble_pattern_addon import batch

    quiet = "--quiet" in arguments
    return batch.main(arguments, "pattern_batch.py", None if quiet else progress_bar(), in_blender())


if __name__ == "__main__":
    code = main()
    sys.stdout.flush()
    sys.exit(code)
