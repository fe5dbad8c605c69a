"""Everything that touches Blender: mesh in and out, settings, operators, panels, preview, command line."""

from __future__ import annotations

from . import (
    command,
    export_operator,
    fixed_sizes,
    following,
    hand_work,
    keep_outs,
    live,
    offenders,
    operators,
    overlay,
    panels,
    presets,
    properties,
    recipe_operators,
    runs,
    solving,
    versioning,
    watching,
)

MODULES = (
    properties,
    watching,
    runs,
    live,
    operators,
    following,
    fixed_sizes,
    hand_work,
    keep_outs,
    solving,
    offenders,
    recipe_operators,
    export_operator,
    presets,
    panels,
    versioning,
    overlay,
    command,
)


def register() -> None:
    """Register the parts, each after what it needs."""
    for module in MODULES:
        module.register()


def unregister() -> None:
    """Unregister them the other way round."""
    for module in reversed(MODULES):
        module.unregister()
