"""A pattern's recipe as TOML text, and a pattern by such a text: what copy and paste, files and presets
share.
"""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import bpy
import numpy as np

from ..core.errors import PatternError, RecipeError, RegionError
from ..core.moving import moved_recipe
from ..core.progress import Progress, Steps
from ..core.recipe import Output, Recipe, RegionChoice, default_recipe
from ..core.recipe_file import recipe_to_toml
from ..core.recipe_units import fitted_recipe, recipe_in
from ..core.units import unit_of
from .reading import world_frame
from .settings_recipe import recipe_of, take_recipe
from .solving import target_steps
from .units import scene_millimetres

# A recipe that would lay more features than this is taken for one in another unit.
MOST_FEATURES = 200_000
# Fewer features than this are no pattern.
FEWEST_FEATURES = 3
# What a recipe says of which faces it is for: a pattern has its own.
CHOICES = ("near", "max_angle", "attribute", "material", "all")
LINE = "# Recipe of a Bubble Pattern; lengths are in {unit}, places in coordinates of the world.\n"


def recipe_to_share(obj: bpy.types.Object, context: bpy.types.Context) -> str:
    """The recipe of the pattern `obj` as TOML, by which a batch run on the saved file makes the same pattern.

    Lengths are in units of the scene, which the head of the text and [output] unit name. Raises RecipeError
    where the settings contradict one another.
    """
    settings = obj.bubble_pattern
    recipe = recipe_of(settings)
    frame = world_frame(settings.base)
    if not np.array_equal(frame, np.eye(4)):
        from .sources import read_source

        region = read_source(settings.base, settings.region, context, recipe).region
        recipe = moved_recipe(recipe, frame, region)
    millimetres = scene_millimetres(context.scene)
    unit = None if millimetres is None else unit_of(millimetres)
    spelled = (
        "units of Blender" if unit is None else unit if isinstance(unit, str) else f"units of {unit:g} mm"
    )
    return LINE.format(unit=spelled) + recipe_to_toml(
        replace(recipe, output=replace(recipe.output, unit=unit))
    )


def preset_text(obj: bpy.types.Object, context: bpy.types.Context) -> str:
    """The recipe of the pattern `obj` in millimetres, without what belongs to its part alone: the region,
    fixed sizes and pins, the rows' direction, a point of symmetry.
    """
    recipe = recipe_of(obj.bubble_pattern)
    packing = recipe.packing
    given = isinstance(packing.orientation, str)
    packing = replace(
        packing, orientation=packing.orientation if given else "edge", symmetry_centre=None, pins=()
    )
    recipe = replace(
        recipe,
        region=RegionChoice(),
        packing=packing,
        shaping=replace(recipe.shaping, seeds=()),
        output=Output(),
    )
    unit = unit_of(scene_millimetres(context.scene) or 1.0)
    text = recipe_to_toml(recipe_in(recipe, "mm", unit))
    return text[text.index("[packing]") :]


def tables_of(text: str, source: str) -> dict[str, Any]:
    """The tables of a recipe's text. RecipeError, which names the source, where it is no TOML."""
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise RecipeError(f"{source} holds no recipe: {error}") from None


def tables_in(path: Path) -> dict[str, Any]:
    """The tables of a recipe file. RecipeError where it can't be read."""
    from ..core.recipe_file import load_toml

    return load_toml(path)


def adopt_steps(
    obj: bpy.types.Object, context: bpy.types.Context, tables: Mapping[str, Any], whole: bool
) -> Steps[bpy.types.Object]:
    """Lay the pattern `obj` by a recipe, on the faces that it has.

    whole: the recipe is a whole one, whose places are in coordinates of the world; else a preset, beside
    which the direction of the rows, the symmetry and how the packing is solved stay as they are

    Raises PatternError where the recipe is none or does not suit the region; then, or closed early, the
    settings are as they were.
    """
    from . import generation
    from .sources import read_source

    yield Progress("Reading the base", 0.0)
    settings = obj.bubble_pattern
    source = read_source(settings.base, settings.region, context)
    recipe = _fitting(obj, context, tables, source.region, whole)
    check_number(recipe, source.region)
    before = _present(settings)
    laid = False
    try:
        take_recipe(obj.bubble_pattern, recipe)
        if recipe.solve:
            yield from target_steps(obj, context, replace(recipe_of(obj.bubble_pattern), solve=recipe.solve))
        else:
            yield from generation.update_steps(obj, context)
        laid = True
    finally:
        if not laid and before is not None:
            take_recipe(obj.bubble_pattern, before)
    if obj.bubble_pattern.count < FEWEST_FEATURES:
        if before is not None:
            take_recipe(obj.bubble_pattern, before)
            yield from generation.update_steps(obj, context)
        raise RegionError(
            "The target region is too small for this recipe, whose pitch is up to {pitch}: choose another "
            "one, or a larger region",
            pitch=recipe.packing.pitch.bounds()[1],
        )
    return obj


def _present(settings: Any) -> Recipe | None:
    try:
        return recipe_of(settings)
    except PatternError:
        return None


def _fitting(
    obj: bpy.types.Object, context: bpy.types.Context, tables: Mapping[str, Any], region: Any, whole: bool
) -> Recipe:
    """The recipe that these tables describe for the pattern, in the scene's unit and the base's frame."""
    settings = obj.bubble_pattern
    fitting = default_recipe(region.area, region.perimeter, RegionChoice(attribute=settings.region))
    present = _present(settings)
    if not whole and present is not None:
        packing = replace(present.packing, pitch=fitting.packing.pitch, edge_offset=0.0)
        fitting = replace(fitting, region=present.region, packing=packing)
    data = {name: table for name, table in tables.items() if name != "region"}
    if whole and isinstance(chosen := tables.get("region", {}), Mapping):
        data["region"] = {key: value for key, value in chosen.items() if key not in CHOICES}
    recipe = fitted_recipe(data, fitting, scene_millimetres(context.scene))
    frame = world_frame(settings.base)
    return moved_recipe(recipe, np.linalg.inv(frame), region) if whole else recipe


def check_number(recipe: Recipe, region: Any) -> None:
    """RecipeError for a pitch that would fill the region with far too many features."""
    low, _ = recipe.packing.pitch.bounds()
    number = region.area / (np.sqrt(3) / 2 * low**2) if low > 0 else 0.0
    if np.isfinite(number) and number > MOST_FEATURES:
        raise RecipeError(
            f"This would be about {number:,.0f} features on a region {{extent}} across: choose a recipe with "
            "a larger pitch, or look whether the part has its true size and the scene its unit",
            extent=region.extent,
        )
