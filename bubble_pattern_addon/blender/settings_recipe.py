"""From a pattern's settings to the recipe, and back; and what is told of it in the sidebar's words."""

from __future__ import annotations

import re
from dataclasses import replace
from typing import Any

import bpy

from ..core.blending import Fill
from ..core.errors import PatternError, RecipeError
from ..core.keep_out_checks import check_keep_outs
from ..core.metric import Constant, Described
from ..core.recipe import Packing, Recipe, RegionChoice, Seed, Shaping
from ..core.recipe_checks import check_recipe
from ..core.recipe_file import recipe_to_toml
from .feature_settings import feature_of, placing, take_feature
from .field_properties import point_of, typed
from .field_recipe import described, take
from .keep_out_properties import is_given, keep_out_of, take_keep_out
from .making_recipe import limits_of, output_of, shaping_output, sizes_of, take_limits, take_sizes
from .properties import BubblePatternSettings
from .symmetry_settings import symmetry_axes, symmetry_centre, symmetry_word, take_symmetry


def recipe_of(settings: Any) -> Recipe:
    """The recipe that `settings` stand for. Raises RecipeError where they contradict one another."""
    recipe = Recipe(
        region=RegionChoice(
            attribute=settings.region or None,
            parts=(parts := tuple(name.strip() for name in settings.parts.split(",") if name.strip())),
            gap=typed(settings.gap) if parts else 0.0,
            keep_out=tuple(keep_out_of(entry) for entry in settings.keep_out if is_given(entry)),
        ),
        packing=Packing(
            pitch=described(settings.pitch_field, settings.pitch, "size", "[packing] pitch"),
            edge_offset=typed(settings.edge_offset),
            orientation=(
                point_of(settings.rows_along)
                if settings.orientation == 'GIVEN'
                else settings.orientation.lower()
            ),
            symmetry=symmetry_word(settings),
            symmetry_centre=symmetry_centre(settings),
            symmetry_axes=symmetry_axes(settings),
            integrator=settings.integrator.lower(),
            seed=settings.seed,
            iterations=settings.iterations,
            tolerance=typed(settings.tolerance),
            pins=tuple(point_of(pin.at) for pin in settings.pins),
        ),
        shaping=Shaping(
            diameter=diameter_of(settings),
            seeds=tuple(Seed(point_of(seed.at), typed(seed.diameter)) for seed in settings.seeds),
            solver=settings.solver.lower(),
            tolerance=typed(settings.shaping_tolerance),
            iterations=settings.shaping_iterations,
            sizes=sizes_of(settings),
        ),
        feature=feature_of(settings),
        limits=limits_of(settings),
        output=output_of(settings),
    )
    check_keep_outs(recipe.region)
    check_recipe(recipe)
    return recipe


def diameter_of(settings: Any) -> Described:
    """The shaping metric: a size, or a share of the pitch."""
    if settings.diameter_mode == 'SHARE':
        return Fill(described(settings.diameter_field, settings.fill, "share", "[shaping] fill"))
    return described(settings.diameter_field, settings.diameter, "size", "[shaping] diameter")


def take_recipe(settings: Any, recipe: Recipe) -> None:
    """Set `settings` to what `recipe` says."""
    live, settings.live = settings.live, False  # one change after the other would lay a pattern each time
    settings.parts = ", ".join(recipe.region.parts)
    settings.gap = recipe.region.gap
    settings.keep_out.clear()
    for keep_out in recipe.region.keep_out:
        take_keep_out(settings.keep_out.add(), keep_out)
    take_packing(settings, recipe.packing)
    take_shaping(settings, recipe.shaping)
    take_feature(settings, recipe.feature)
    take_limits(settings, recipe.limits)
    settings.density = recipe.output.density or 0.0
    settings.live = live


def take_packing(settings: Any, packing: Packing) -> None:
    """Set the settings of step 1."""
    if isinstance(packing.pitch, Constant):
        settings.pitch_field.kind = 'CONSTANT'
        settings.pitch = packing.pitch.value
    else:
        take(settings.pitch_field, packing.pitch, "size")
    settings.edge_offset = packing.edge_offset
    if isinstance(packing.orientation, str):
        settings.orientation = packing.orientation.upper()
    else:
        settings.orientation = 'GIVEN'
        settings.rows_along = packing.orientation
    take_symmetry(settings, packing)
    settings.integrator = packing.integrator.upper()
    settings.seed = packing.seed
    settings.iterations = packing.iterations
    settings.tolerance = packing.tolerance
    settings.pins.clear()
    for pin in packing.pins:
        settings.pins.add().at = pin


def take_shaping(settings: Any, shaping: Shaping) -> None:
    """Set the settings of step 2."""
    share = isinstance(shaping.diameter, Fill)
    size = shaping.diameter.share if isinstance(shaping.diameter, Fill) else shaping.diameter
    settings.diameter_mode = 'SHARE' if share else 'SIZE'
    if isinstance(size, Constant):
        settings.diameter_field.kind = 'CONSTANT'
        setattr(settings, "fill" if share else "diameter", size.value)
    else:
        take(settings.diameter_field, size, "share" if share else "size")
    settings.seeds.clear()
    for seed in shaping.seeds:
        entry = settings.seeds.add()
        entry.at, entry.diameter = seed.at, seed.diameter
    settings.solver = shaping.solver.upper()
    settings.shaping_tolerance = shaping.tolerance
    settings.shaping_iterations = shaping.iterations
    take_sizes(settings, shaping.sizes)


def packing_text(recipe: Recipe) -> str:
    """What the places of the bubbles depend on, as text: equal texts give equal places."""
    return recipe_to_toml(Recipe(packing=recipe.packing, region=recipe.region))


def recipe_text(recipe: Recipe) -> str:
    """What the pattern's points depend on, as text; how the features are cut is left out."""
    feature = placing(recipe.feature)
    if recipe.limits.process is not None:
        # its rules depend on how deep and how steep a feature is
        feature = replace(feature, depth=recipe.feature.depth, draft=recipe.feature.draft)
    return recipe_to_toml(replace(recipe, feature=feature, output=shaping_output(recipe)))


def part_text(settings: Any) -> str:
    """What a part made of this pattern depends on, as text; nothing where the settings make no sense."""
    try:
        recipe = recipe_of(settings)
    except RecipeError:
        return ""
    shape = recipe_to_toml(replace(recipe, output=shaping_output(recipe)))
    return "\n".join([shape, settings.made_with, settings.fingerprint, settings.size_trace])


def is_outdated(settings: Any) -> bool:
    """Whether the settings say something else than the points that stand there."""
    try:
        return settings.made_with != recipe_text(recipe_of(settings))
    except RecipeError:
        return True


def contradict(settings: Any) -> bool:
    """Whether the settings make no sense together, or something is not chosen yet."""
    try:
        recipe_of(settings)
    except RecipeError:
        return True
    return False


def length_text(context: bpy.types.Context, value: float) -> str:
    """A length in the scene's unit."""
    units = context.scene.unit_settings
    return (
        bpy.utils.units.to_string(units.system, 'LENGTH', value * units.scale_length, precision=4)
        if (units.system != 'NONE')
        else f"{value:.4g}"
    )


def spoken(error: PatternError, context: bpy.types.Context) -> str:
    """What `error` says, with the recipe's keys under their names in the sidebar and its lengths in the
    scene's unit.
    """
    known = BubblePatternSettings.bl_rna.properties

    def name_of(key: re.Match[str]) -> str:
        """The sidebar's name of a key such as [packing] pitch; the key itself where the sidebar has none."""
        return known[key[1]].name if key[1] in known else key[0]

    return re.sub(r"\[\w+\] (\w+)", name_of, error.told(lambda value: length_text(context, value)))
