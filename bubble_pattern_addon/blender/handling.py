"""Functions that Blender calls when something happens: undo, a file, a change in the scene."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any

import bpy

# Name of a list in bpy.app.handlers, and the function that it gets.
Handlers = Iterable[tuple[str, Callable[..., Any]]]


def add(handlers: Handlers) -> None:
    """Have Blender call these functions."""
    for name, handler in handlers:
        getattr(bpy.app.handlers, name).append(handler)


def remove(handlers: Handlers) -> None:
    """Have Blender call them no more."""
    for name, handler in handlers:
        getattr(bpy.app.handlers, name).remove(handler)
