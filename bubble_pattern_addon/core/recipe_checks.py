"""Which values of a recipe make sense, and which contradict one another."""

from __future__ import annotations

import math

from .blending import Fill
from .errors import RecipeError
from .feature_checks import check_feature
from .field_tables import asks_for_pitch
from .isometries import check_symmetry
from .keep_out_checks import check_keep_outs
from .metric import Constant, Described
from .nominal import check_sizes
from .processes import PROCESSES
from .recipe import (
    ALIGNMENTS,
    DRAWINGS,
    FORMATS,
    INTEGRATORS,
    ORIENTATIONS,
    PROJECTIONS,
    SOLVERS,
    Limits,
    Output,
    Recipe,
    RegionChoice,
    Shaping,
)
from .toml_values import check_above, check_at_least, check_finite, check_one_of

# Share of the plane that a hexagonal arrangement of touching circles covers: pi / (2 sqrt 3).
DENSEST = math.pi / (2 * math.sqrt(3))


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
    _check_limits(limits)
    _check_solve(recipe)
    _check_output(recipe.output)
    _check_room(recipe)


def _check_output(output: Output) -> None:
    if output.density is not None:
        check_above(output.density, "[output] density")
    for name in output.formats:
        check_one_of(name, FORMATS, "[output] formats")
    for name in output.drawings:
        check_one_of(name, DRAWINGS, "[output] drawings")
    if isinstance(output.projection, str):
        check_one_of(output.projection, PROJECTIONS, "[output] projection")
    elif not any(output.projection):
        raise RecipeError("[output] projection = [0, 0, 0] is no direction: give one towards the viewer")
    check_one_of(output.align, ALIGNMENTS, "[output] align")


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
    if shaping.sizes is not None:
        check_sizes(shaping.sizes, "[shaping] sizes")


def _check_limits(limits: Limits) -> None:
    check_at_least(limits.min_web, 0, "[limits] min_web")
    check_at_least(limits.min_margin, 0, "[limits] min_margin")
    check_at_least(limits.min_diameter, 0, "[limits] min_diameter")
    if limits.process is not None:
        check_one_of(limits.process, tuple(PROCESSES), "[limits] process")
    if limits.thickness is not None:
        check_above(limits.thickness, "[limits] thickness")


def _check_solve(recipe: Recipe) -> None:
    """RecipeError for a target that is none, or that cannot be reached the way that is asked for."""
    solve = recipe.solve
    if not solve:
        if solve.by is not None:
            raise RecipeError("[solve] has no target: give open_area or count, or leave the table out")
        return
    if solve.open_area is not None and solve.count is not None:
        raise RecipeError("[solve] gives both open_area and count: keep one of them")
    if solve.by is not None:
        check_one_of(solve.by, ("diameter", "pitch"), "[solve] by")
    if solve.count is not None:
        check_at_least(solve.count, 1, "[solve] count")
        if solve.by == "diameter":
            raise RecipeError(
                '[solve] count does not hang on the diameter: solve by = "pitch", or leave by out'
            )
    elif solve.open_area is not None and not 0 < solve.open_area < DENSEST:
        raise RecipeError(
            f"[solve] open_area = {solve.open_area:g} must be a share above 0 and below {DENSEST:.4g}, which "
            "touching circles take"
        )
    if solve.open_area is not None and solve.by == "pitch" and isinstance(recipe.shaping.diameter, Fill):
        raise RecipeError(
            "[shaping] fill lets the diameter follow the pitch, so that the open area hangs on fill alone: "
            'solve by = "diameter", or give a diameter'
        )


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
