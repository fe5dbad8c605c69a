"""Everything that touches Blender: mesh in and out, settings, operators, panels, preview, command line."""

from __future__ import annotations

from . import (
    command,
    export_operator,
    fixed_sizes,
    live,
    operators,
    panels,
    presets,
    properties,
    recipe_operators,
    runs,
    versioning,
    watching,
)

MODULES = (
    properties,
    watching,
    runs,
    live,
    operators,
    fixed_sizes,
    recipe_operators,
    export_operator,
    presets,
    panels,
    versioning,
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
