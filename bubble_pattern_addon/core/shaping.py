"""Step 2: the size of the feature in every bubble, from the shaping metric, within the limits."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from .averaging import averaged
from .errors import FieldError, RecipeError
from .floors import Floors, floors_for
from .heading import headed
from .limits import limited_by
from .links import Links, links_of
from .mesh import Floats
from .metric import Described, Field
from .nominal import nominal_sizes
from .partners import partner_rows
from .pattern import Pattern, all_bubbles
from .recipe import Recipe, Shaping
from .region import Region
from .surroundings import Surroundings
from .toml_values import show


def bound(described: Described, surroundings: Surroundings, where: str) -> Field:
    """The field in its surroundings. FieldError, which names the recipe's key by `where`, for what they
    lack.
    """
    try:
        return described.bind(surroundings)
    except FieldError as error:
        raise FieldError(f"{where}: {error}") from None


def shaped(
    bubbles: Pattern, links: Links, region: Region, recipe: Recipe, surroundings: Surroundings
) -> Pattern:
    """The bubbles with a feature in each, as the recipe's shaping and limits want it; what their diameters
    were before does not matter.

    Raises RecipeError where a diameter is no positive length, a seed does not fit or no feature is left,
    FieldError where the surroundings lack something.
    """
    surroundings = replace(surroundings, region=region)
    wished, notes = diameters(recipe.shaping, bubbles, links, surroundings)
    bubbles = headed(bubbles, links, recipe.feature, surroundings)
    floors = floors_for(bubbles, region, recipe)
    pattern = limited_by(
        replace(bubbles, diameter=wished, notes=(*bubbles.packing_notes, *notes, *floors.notes)),
        region,
        floors,
        nominal_sizes(recipe.shaping.sizes, recipe.millimetre),
    )
    if len(bubbles) and not len(pattern):
        refuse_process(recipe, floors, wished)
        raise RecipeError(
            "No feature is left: diameters up to {widest} do not go with [limits] min_web = {web}, "
            "min_margin = {margin} and min_diameter = {least}; make one of these smaller or the pitch larger",
            widest=float(wished.max()),
            web=recipe.limits.min_web,
            margin=recipe.limits.min_margin,
            least=recipe.limits.min_diameter,
        )
    return pattern


def refuse_process(recipe: Recipe, floors: Floors, wished: Floats) -> None:
    """RecipeError where it is the process or the nominal sizes that leave no feature."""
    if recipe.shaping.sizes is not None:
        raise RecipeError(
            "No feature is left: none of [shaping] sizes is within the limits and not above the diameters, "
            "which go up to {widest}; add smaller sizes or make the diameter larger",
            widest=float(wished.max()),
        )
    if recipe.limits.process is not None:
        raise RecipeError(
            f'No feature is left: {show(recipe.limits.process)} asks for diameters from {{hole}}, webs from '
            "{web} and margins from {margin}, and the diameters go up to {widest}; make pitch and diameter "
            "larger, or choose another process",
            hole=float(floors.diameter.min()),
            web=float(floors.web.min()),
            margin=float(floors.margin.min()),
            widest=float(wished.max()),
        )


def reshaped(pattern: Pattern, region: Region, recipe: Recipe, surroundings: Surroundings) -> Pattern:
    """The pattern with its features shaped anew on the bubbles that are there; see shaped."""
    bubbles = all_bubbles(pattern)
    return shaped(bubbles, links_of(bubbles, region), region, recipe, surroundings)


def diameters(
    shaping: Shaping, bubbles: Pattern, links: Links, surroundings: Surroundings
) -> tuple[Floats, tuple[str, ...]]:
    """Diameters (n,) that the shaping metric asks for, and what a designer should know of them."""
    pitch = bubbles.pitch
    here = replace(surroundings, pitch=lambda places: pitch)
    field = bound(shaping.diameter, here, "[shaping] diameter")
    wished = field(bubbles.places)
    if not (np.isfinite(wished).all() and wished.min(initial=np.inf) > 0):
        raise RecipeError("The diameter must be a positive length everywhere in the target region: raise it.")
    if not shaping.seeds or not len(bubbles):
        return wished, ()
    wished, reached = averaged(shaping, wished, links, bubbles.position, pitch, partner_rows(bubbles))
    alone = int((~reached).sum())
    if not alone:
        return wished, ()
    features = "One feature is" if alone == 1 else f"{alone:,} features are"
    return wished, (f"{features} linked to no seed and as large as without seeds.",)
