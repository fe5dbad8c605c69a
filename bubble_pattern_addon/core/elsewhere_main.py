"""The other end of elsewhere, as a program: python elsewhere_main.py GIVEN ANSWER.

The package that it works for may be an extension of Blender, with a name and libraries that only that Blender
knows. So GIVEN.json says where modules are found, and the package's parents are stood in for by empty ones.
"""

from __future__ import annotations

import json
import pickle
import sys
from pathlib import Path
from types import ModuleType


def stand_in(package: str, folder: str) -> None:
    """Let `package`, the core in `folder`, be importable under its full name, without its parents' code."""
    parts = package.split(".")
    place = Path(folder)
    for depth in range(len(parts), 0, -1):
        name = ".".join(parts[:depth])
        module = ModuleType(name)
        module.__path__ = [str(place)]
        sys.modules[name] = module
        place = place.parent


def main(given: Path, answer: Path) -> None:
    """Do what is asked in `given`, and write (result, None) or (None, error) to `answer`."""
    about = json.loads(given.with_suffix(".json").read_text(encoding="utf-8"))
    sys.path[:] = about["path"]
    stand_in(about["package"], about["folder"])
    function, arguments = pickle.loads(given.read_bytes())
    said: tuple[object, Exception | None]
    try:
        said = (function(*arguments), None)
    except Exception as error:  # raised again at the other end
        said = (None, error)
    half = answer.with_suffix(".half")
    half.write_bytes(pickle.dumps(said, protocol=5))
    half.replace(answer)


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]))
