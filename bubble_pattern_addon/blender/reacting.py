"""What a change of a setting sets off; see generation.react."""

from __future__ import annotations

import bpy


def reshape(settings: bpy.types.PropertyGroup, context: bpy.types.Context) -> None:
    """A size changed: the bubbles stay where they are."""
    from . import generation  # here, because Blender's start need not wait for scipy

    generation.react(settings, context, repack=False)


def reshape_feature(settings: bpy.types.PropertyGroup, context: bpy.types.Context) -> None:
    """What a feature is, or how it stands, changed."""
    reshape(settings, context)
    if settings.made_with:  # else there are no points yet
        redraw_preview(settings, context)


def repack(settings: bpy.types.PropertyGroup, context: bpy.types.Context) -> None:
    """A setting of the packing changed: the bubbles move."""
    from . import generation

    generation.react(settings, context, repack=True)


def redraw_preview(settings: bpy.types.PropertyGroup, _context: bpy.types.Context) -> None:
    """A setting of the preview alone changed."""
    from .preview_nodes import show_preview

    if settings.base is not None:
        show_preview(settings.id_data, settings.show_bubbles)


def show_cut(settings: bpy.types.PropertyGroup, context: bpy.types.Context) -> None:
    """The cut shall be shown, or no longer."""
    from .cut_preview import toggle_cut

    if settings.base is not None:
        toggle_cut(settings, context)
