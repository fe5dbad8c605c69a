"""`blender --command bubble_pattern ...`: the batch run as a command of the extension."""

from __future__ import annotations

from typing import Any

import bpy

COMMAND = "bubble_pattern"
_handles: list[Any] = []


def run(arguments: list[str]) -> int:
    """Run the batch with these arguments and return the exit code."""
    from .. import batch

    return batch.main(arguments, prog=f"blender --command {COMMAND}", in_blender=True)


def register() -> None:
    """Make the command known to Blender."""
    _handles.append(bpy.utils.register_cli_command(COMMAND, run))


def unregister() -> None:
    """Take the command back."""
    bpy.utils.unregister_cli_command(_handles.pop())
