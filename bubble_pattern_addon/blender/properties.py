# mypy: disable-error-code="valid-type"
"""The pattern's settings: a property for every field of the recipe that the sidebar shows, by the recipe's
sections, and what stands on which object.
"""

from __future__ import annotations

import bpy
from bpy.props import BoolProperty, PointerProperty

from .feature_properties import FeatureSettings
from .field_properties import BubblePatternField
from .keep_out_properties import BubblePatternKeepOut
from .limit_properties import LimitSettings
from .packing_properties import BubblePatternPin, PackingSettings
from .reacting import redraw_preview, show_cut
from .region_properties import RegionSettings
from .result_properties import BubblePatternBroken, ResultSettings
from .shaping_properties import BubblePatternSeed, ShapingSettings
from .solve_properties import SolveSettings

# Raised when a property changes its meaning; see upgrade.
SETTINGS_VERSION = 3


def is_on(settings: bpy.types.PropertyGroup, obj: bpy.types.Object) -> bool:
    """Whether `obj` is a pattern on the object that has these settings."""
    return obj.bubble_pattern.base == settings.id_data and in_scene(obj)


def is_mesh(_settings: bpy.types.PropertyGroup, obj: bpy.types.Object) -> bool:
    """Whether `obj` can be a base."""
    return obj.type == 'MESH'


class BubblePatternSettings(
    RegionSettings,
    PackingSettings,
    ShapingSettings,
    FeatureSettings,
    LimitSettings,
    SolveSettings,
    ResultSettings,
    bpy.types.PropertyGroup,
):
    """Settings and results of one pattern, kept on its object. An object without a base is no pattern."""

    # Named as the recipe's sections and fields are.
    base: PointerProperty(
        name="Base",
        description="Object whose faces carry the pattern",
        type=bpy.types.Object,
        poll=is_mesh,
    )
    part: PointerProperty(
        name="Part", description="Finished part made of this pattern", type=bpy.types.Object
    )
    pattern: PointerProperty(
        name="Pattern",
        description="Pattern on this base that the sidebar shows; for a part, the one it was made of",
        type=bpy.types.Object,
        poll=is_on,
    )
    live: BoolProperty(
        name="Live Update",
        description="Lay the pattern anew with every change of a setting",
        default=True,
    )
    cut_preview: BoolProperty(
        name="Cut Preview",
        description="Show the base with its features before they are made, until a setting changes",
        default=False,
        options={'SKIP_SAVE'},
        update=show_cut,
    )
    show_bubbles: BoolProperty(
        name="Show Bubbles",
        description="Draw the territory of every feature as a ring",
        default=False,
        update=redraw_preview,
    )


def in_scene(obj: bpy.types.Object | None) -> bool:
    """Whether `obj` stands in some collection; a deleted object that something points at does not."""
    return obj is not None and bool(obj.users_collection)


def is_pattern(obj: bpy.types.Object | None) -> bool:
    """Whether `obj` is the object of a pattern."""
    return obj is not None and obj.bubble_pattern.base is not None


def pattern_objects(base: bpy.types.Object) -> list[bpy.types.Object]:
    """The patterns on `base`, in the order of their names."""
    return sorted((o for o in base.children if is_on(base.bubble_pattern, o)), key=lambda o: o.name)


def pattern_of(obj: bpy.types.Object | None) -> bpy.types.Object | None:
    """The pattern that `obj` is, or carries (of several the one it names), or was made of."""
    if obj is None or is_pattern(obj):
        return obj
    named = obj.bubble_pattern.pattern
    if in_scene(named) and obj in (named.bubble_pattern.base, named.bubble_pattern.part):
        return named
    on_base = pattern_objects(obj)
    return on_base[0] if on_base else None


CLASSES = (
    BubblePatternField,
    BubblePatternKeepOut,
    BubblePatternPin,
    BubblePatternSeed,
    BubblePatternBroken,
    BubblePatternSettings,
)
_register, _unregister = bpy.utils.register_classes_factory(CLASSES)


def register() -> None:
    """Give every object its settings."""
    _register()
    bpy.types.Object.bubble_pattern = PointerProperty(type=BubblePatternSettings)


def unregister() -> None:
    """Take the settings back."""
    del bpy.types.Object.bubble_pattern
    _unregister()
