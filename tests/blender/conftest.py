"""Tests with Blender as a module: each starts from an empty file, with the add-on registered."""

from __future__ import annotations

import importlib.util
import os
import tempfile
from collections.abc import Iterator

import pytest

HAS_BPY = importlib.util.find_spec("bpy") is not None
if HAS_BPY:
    # Before bpy is imported: nothing of the user's own Blender is read, and none of it is touched.
    _home = tempfile.TemporaryDirectory(prefix="bubble_pattern_")
    os.environ["BLENDER_USER_RESOURCES"] = _home.name
    os.environ["BLENDER_USER_EXTENSIONS"] = os.path.join(_home.name, "extensions")  # noqa: PTH118


@pytest.fixture(scope="session")
def addon() -> Iterator[None]:
    """The add-on, registered for the session; a class that is still registered at exit hangs Blender 4.5."""
    import bubble_pattern_addon

    bubble_pattern_addon.register()
    yield
    bubble_pattern_addon.unregister()


@pytest.fixture(autouse=True)
def patience(monkeypatch: pytest.MonkeyPatch) -> None:
    """Patterns answer changes at once, however busy the machine is."""
    if HAS_BPY:
        from bubble_pattern_addon.blender import generation

        monkeypatch.setattr(generation, "LIVE_SECONDS", float("inf"))


@pytest.fixture(autouse=True)
def empty_file(addon: None) -> None:
    """An empty file."""
    import bpy

    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
