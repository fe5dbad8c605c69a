"""Bubble Pattern: fills faces of a part with a tight hexagonal pattern of holes that follows the boundary."""


def register() -> None:
    """Make the add-on's classes known to Blender."""
    from . import blender

    blender.register()


def unregister() -> None:
    """Take everything back that `register` did."""
    from . import blender

    blender.unregister()
