"""Which values of a recipe make sense, and which contradict one another."""

from __future__ import annotations

import math

from .blending import Fill
from .errors import RecipeError
from .feature_checks import check_feature
from .field_tables import asks_for_pitch
from .isometries import check_symmetry
from .metric import Constant, Described
from .recipe import FORMATS, INTEGRATORS, ORIENTATIONS, SOLVERS, KeepOut, Recipe, RegionChoice, Shaping
from .toml_values import Point, check_above, check_at_least, check_finite, check_one_of

# what a keep-out can be: which keys it needs then, and which it may have besides its margin
KEEP_OUT_NEEDS: dict[str, tuple[tuple[str, ...], tuple[str, ...]]] = {
    "faces": ((), ()),
    "object": ((), ("axis", "reach")),
    "collection": ((), ("axis", "reach")),
    "file": ((), ("axis", "reach")),
    "sphere": (("diameter",), ()),
    "cylinder": (("diameter",), ("axis", "reach")),
    "box": (("size",), ("axis", "along", "reach")),
}


def parallel(one: Point, other: Point) -> bool:
    """Whether two directions are the same or opposite, as nearly as a box's sides can be told by."""
    cosine = sum(a * b for a, b in zip(one, other, strict=True)) / (math.hypot(*one) * math.hypot(*other))
    return abs(cosine) > 1 - 1e-9


def check_choice(choice: RegionChoice) -> None:
    """RecipeError unless exactly one way of choosing the target region is used."""
    ways = [name for name in ("near", "attribute", "material") if getattr(choice, name) is not None]
    ways += ["all"] if choice.all else []
    if not ways:
        raise RecipeError(
            "[region] chooses no faces: give one of near = [x, y, z], attribute, material or all = true"
        )
    if len(ways) > 1:
        raise RecipeError(f"[region] chooses faces in {len(ways)} ways ({', '.join(ways)}): keep one of them")
    if not 0 <= choice.max_angle <= 180:
        raise RecipeError(f"[region] max_angle = {choice.max_angle:g} must be from 0 to 180 degrees")
    check_at_least(choice.gap, 0, "[region] gap")
    if choice.gap and not choice.parts:
        raise RecipeError("[region] gap goes between parts: name these too, or leave gap out")
    check_keep_outs(choice)


def check_keep_outs(choice: RegionChoice) -> None:
    """RecipeError unless every keep-out is one thing with what that needs."""
    for count, keep_out in enumerate(choice.keep_out, 1):
        _check_keep_out(keep_out, f"[region] keep_out, entry {count}")


def _check_keep_out(keep_out: KeepOut, where: str) -> None:
    """RecipeError, which names the entry by `where`, unless it is one thing with what that needs."""
    named = [key for key in KEEP_OUT_NEEDS if getattr(keep_out, key) is not None]
    if len(named) != 1:
        said = f"names {len(named)} things ({', '.join(named)})" if named else "names nothing"
        raise RecipeError(f"{where} {said}: give one of {', '.join(KEEP_OUT_NEEDS)}")
    needed, allowed = KEEP_OUT_NEEDS[named[0]]
    for key in ("diameter", "size", "axis", "along", "reach"):
        value = getattr(keep_out, key)
        if value is None and key in needed:
            raise RecipeError(f"{where}: a {named[0]} lacks {key}: give it")
        if value is not None and key not in needed and key not in allowed:
            raise RecipeError(f"{where}: {key} does not go with {named[0]}: leave it out")
    if keep_out.diameter is not None:
        check_above(keep_out.diameter, f"{where}: diameter")
    for coordinate in keep_out.size or ():
        check_above(coordinate, f"{where}: size")
    for key in ("axis", "along"):
        way = getattr(keep_out, key)
        if way is not None and not any(way):
            raise RecipeError(f"{where}: {key} = [0, 0, 0] is no direction: give a vector")
    if keep_out.along is not None and parallel(keep_out.along, keep_out.axis or (0.0, 0.0, 1.0)):
        raise RecipeError(f"{where}: along and axis of the box are parallel: give two directions")
    if keep_out.reach is not None:
        check_at_least(keep_out.reach, 0, f"{where}: reach")
    check_at_least(keep_out.margin, 0, f"{where}: margin")


def check_recipe(recipe: Recipe) -> None:
    """RecipeError for a value out of its range, or for values that contradict one another.

    The region's choice is left to check_choice: a caller that holds the faces already needs none.
    """
    packing, limits = recipe.packing, recipe.limits
    _check_length(packing.pitch, "[packing] pitch")
    if asks_for_pitch(packing.pitch):
        raise RecipeError("[packing] pitch is given as a share of itself: fill goes with diameters")
    _check_shaping(recipe.shaping)
    if isinstance(packing.orientation, str):
        check_one_of(packing.orientation, ORIENTATIONS, "[packing] orientation")
    elif not any(packing.orientation):
        raise RecipeError("[packing] orientation = [0, 0, 0] is no direction: give a vector along the rows")
    check_one_of(packing.integrator, INTEGRATORS, "[packing] integrator")
    check_at_least(packing.seed, 0, "[packing] seed")
    check_at_least(packing.iterations, 1, "[packing] iterations")
    check_above(packing.tolerance, "[packing] tolerance")
    check_symmetry(packing.symmetry, "[packing] symmetry")
    for coordinate in packing.symmetry_centre or ():
        check_finite(coordinate, "[packing] symmetry_centre")
    for pin in packing.pins:
        for coordinate in pin:
            check_finite(coordinate, "[packing] pins")
    check_feature(recipe.feature, uniform_diameter(recipe))
    check_at_least(limits.min_web, 0, "[limits] min_web")
    check_at_least(limits.min_margin, 0, "[limits] min_margin")
    check_at_least(limits.min_diameter, 0, "[limits] min_diameter")
    for name in recipe.output.formats:
        check_one_of(name, FORMATS, "[output] formats")
    _check_room(recipe)


def _check_length(described: Described, where: str) -> None:
    """RecipeError for a field that makes no sense or can become 0 or less; one without bounds is judged in
    place.
    """
    described.check(where)
    low, _ = described.bounds()
    if isinstance(described, Constant):
        check_above(low, where)
    elif math.isfinite(low) and low <= 0:
        raise RecipeError(f"{where} can become {low:g}: a field of lengths must stay above 0 everywhere")


def _check_shaping(shaping: Shaping) -> None:
    size = shaping.diameter
    if isinstance(size, Fill):
        _check_length(size.share, "[shaping] fill")
        _, most = size.share.bounds()
        if math.isfinite(most) and most >= 1:
            raise RecipeError(f"[shaping] fill can become {most:g}, which leaves no web: keep it below 1")
    else:
        _check_length(size, "[shaping] diameter")
    for count, seed in enumerate(shaping.seeds, 1):
        for coordinate in seed.at:
            check_finite(coordinate, f"[shaping] seeds, seed {count}: at")
        check_above(seed.diameter, f"[shaping] seeds, seed {count}: diameter")
    check_one_of(shaping.solver, SOLVERS, "[shaping] solver")
    check_above(shaping.tolerance, "[shaping] tolerance")
    check_at_least(shaping.iterations, 1, "[shaping] iterations")


def uniform_diameter(recipe: Recipe) -> float | None:
    """The diameter of all features where it is one and the same; None where it depends on the place."""
    pitch, size = recipe.packing.pitch, recipe.shaping.diameter
    if recipe.shaping.seeds:
        return None
    if isinstance(size, Fill):
        if isinstance(size.share, Constant) and isinstance(pitch, Constant):
            return size.share.value * pitch.value
        return None
    return size.value if isinstance(size, Constant) else None


def _check_room(recipe: Recipe) -> None:
    """Features must not touch their neighbours, nor cross the boundary. Graded ones are limited in place."""
    pitch, diameter = recipe.packing.pitch, uniform_diameter(recipe)
    offset = recipe.packing.edge_offset
    check_finite(offset, "[packing] edge_offset")
    if diameter is None:
        return
    if recipe.limits.min_diameter > diameter:
        raise RecipeError(
            "[limits] min_diameter = {least} is more than the diameter {diameter}, which leaves no feature: "
            "make it smaller",
            least=recipe.limits.min_diameter,
            diameter=diameter,
        )
    if not isinstance(pitch, Constant):
        return
    if diameter >= pitch.value:
        raise RecipeError(
            "[shaping] diameter = {diameter} leaves no web at pitch {pitch}: "
            "make the diameter smaller than the pitch",
            diameter=diameter,
            pitch=pitch.value,
        )
    margin = (pitch.value - diameter) / 2 + offset
    if margin < 0:
        raise RecipeError(
            "[packing] edge_offset = {offset} would push features {over} over the boundary: "
            "give at least {least}",
            offset=offset,
            over=-margin,
            least=(diameter - pitch.value) / 2,
        )
    web = pitch.value - diameter
    if recipe.limits.min_web > web:
        raise RecipeError(
            "[limits] min_web = {limit} is more than pitch - diameter = {web}: "
            "make the diameter at most {most}",
            limit=recipe.limits.min_web,
            web=web,
            most=pitch.value - recipe.limits.min_web,
        )
