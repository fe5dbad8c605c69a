"""Process, nominal sizes, density and target ⇄ the recipe: what the sidebar says of making the part."""

from __future__ import annotations

from typing import Any

import bpy

from ..core.errors import RecipeError
from ..core.nominal import SERIES
from ..core.processes import PROCESSES
from ..core.recipe import Limits, Output, Recipe, Solve
from ..core.units import Unit, unit_of
from .field_properties import typed
from .units import scene_millimetres

PROCESS_WORDS = {word.upper().replace(" ", "_"): word for word in PROCESSES}
SERIES_WORDS = {word.upper().replace(" ", "_").replace(".", ""): word for word in SERIES}

# The scene's units by the names that Blender reads in a text, and how many meters they are long.
UNITS = {
    'KILOMETERS': ("km", 1000.0),
    'METERS': ("m", 1.0),
    'CENTIMETERS': ("cm", 0.01),
    'MILLIMETERS': ("mm", 0.001),
    'MICROMETERS': ("um", 1e-6),
    'MILES': ("mi", 1609.344),
    'FEET': ("ft", 0.3048),
    'INCHES': ("in", 0.0254),
    'THOU': ("thou", 0.0000254),
}


def limits_of(settings: Any) -> Limits:
    """The recipe's limits."""
    return Limits(
        min_web=typed(settings.min_web),
        min_margin=typed(settings.min_margin),
        min_diameter=typed(settings.min_diameter),
        process=PROCESS_WORDS.get(settings.process),
        thickness=typed(settings.thickness) or None,
        check_only=settings.check_only,
    )


def take_limits(settings: Any, limits: Limits) -> None:
    """Set the settings of the limits."""
    settings.min_web = limits.min_web
    settings.min_margin = limits.min_margin
    settings.min_diameter = limits.min_diameter
    settings.process = _key(PROCESS_WORDS, limits.process) or 'NONE'
    settings.thickness = limits.thickness or 0.0
    settings.check_only = limits.check_only


def sizes_of(settings: Any) -> tuple[float, ...] | str | None:
    """The recipe's nominal sizes. RecipeError where the list is none."""
    if settings.sizes == 'LIST':
        words = settings.size_list.replace(";", ",").split(",")
        sizes = tuple(_length(word.strip()) for word in words if word.strip())
        if not sizes:
            raise RecipeError("The list of sizes is empty: give diameters, separated by commas")
        return sizes
    return SERIES_WORDS.get(settings.sizes)


def take_sizes(settings: Any, sizes: tuple[float, ...] | str | None) -> None:
    """Set the settings of the nominal sizes."""
    if isinstance(sizes, tuple):
        settings.sizes = 'LIST'
        settings.size_list = ", ".join(_spelled(size) for size in sizes)
    else:
        settings.sizes = _key(SERIES_WORDS, sizes) or 'ANY'


def output_of(settings: Any) -> Output:
    """What the recipe says of the material and, where something hangs on it, of the unit."""
    density = typed(settings.density) or None
    asks = density is not None or settings.process != 'NONE' or settings.sizes in SERIES_WORDS
    return Output(density=density, unit=scene_unit() if asks else None)


def shaping_output(recipe: Recipe) -> Output:
    """The part of it on which the features' sizes hang."""
    asks = recipe.limits.process is not None or isinstance(recipe.shaping.sizes, str)
    return Output(unit=recipe.output.unit if asks else None)


def solve_of(settings: Any) -> Solve:
    """The target that the fields of Solve For say."""
    if settings.solve_for == 'COUNT':
        return Solve(count=settings.solve_count)
    return Solve(open_area=typed(settings.solve_open_area) / 100, by=settings.solve_by.lower())


def scene_unit() -> Unit:
    """The unit of the scene's lengths, for the recipe."""
    return unit_of(scene_millimetres(bpy.context.scene) or 1.0)


def _reference() -> tuple[str, float]:
    """What a bare number in a text means: a unit's name, and its length in that of the scene."""
    units = bpy.context.scene.unit_settings
    fallback = 'FEET' if units.system == 'IMPERIAL' else 'METERS'
    name, metres = UNITS.get(units.length_unit, UNITS[fallback])
    return name, metres / units.scale_length


def _length(text: str) -> float:
    """A length as typed, with or without a unit. RecipeError for what is none."""
    units = bpy.context.scene.unit_settings
    try:
        if units.system == 'NONE':
            return float(text)
        value = bpy.utils.units.to_value(units.system, 'LENGTH', text, str_ref_unit=_reference()[0])
    except ValueError:
        raise RecipeError(
            f'"{text}" in the list of sizes is no length: give numbers, separated by commas'
        ) from None
    return typed(value / units.scale_length)


def _spelled(length: float) -> str:
    """A length in the unit in which bare numbers are taken."""
    if bpy.context.scene.unit_settings.system == 'NONE':
        return f"{length:.7g}"
    name, size = _reference()
    return f"{length / size:.7g} {name}"


def _key(words: dict[str, str], word: str | None) -> str | None:
    return next((key for key, known in words.items() if known == word), None)
