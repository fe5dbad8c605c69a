"""The button that finds the diameter or the pitch for a target; see core.solving."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import bpy

from ..core.progress import Progress, Steps, within
from ..core.recipe import Recipe
from .laying import AnewOperator
from .making_recipe import solve_of
from .operators import OnPattern, current_pattern
from .settings_recipe import length_text, recipe_of, take_packing, take_shaping


def target_steps(obj: bpy.types.Object, context: bpy.types.Context, recipe: Recipe) -> Steps[Any]:
    """Lay the pattern `obj` so that it meets the target of `recipe`, which its settings say but for the
    target; what was found, as core.solving tells it.
    """
    from ..core.quality import measure
    from ..core.solving import solving_steps
    from . import generation
    from .sources import read_source

    yield Progress("Reading the base", 0.0)
    settings = obj.bubble_pattern
    source = read_source(settings.base, settings.region, context, recipe)
    solving = solving_steps(source.region, recipe, source.surroundings)
    solved, seconds = yield from generation.timed(within(solving, 0.0, 0.95))
    yield Progress("Measuring", 0.95)
    pattern, region = solved.pattern, source.region
    laid = generation.measured(pattern, region, solved.recipe, measure(pattern, region))
    laid = replace(laid, seconds=seconds / solved.packings)
    settings = obj.bubble_pattern  # asked for anew after the pauses
    take_found(settings, solved)
    generation.put(obj, source, recipe_of(settings), laid)
    return solved


class BUBBLE_PATTERN_OT_solve(OnPattern, AnewOperator, bpy.types.Operator):
    """Find the diameter or the pitch at which the pattern comes to the target"""

    bl_idname = "bubble_pattern.solve"
    bl_label = "Solve"
    bl_options = {'REGISTER', 'UNDO'}

    def steps(self, context: bpy.types.Context) -> Steps[Any]:
        obj = current_pattern(context)
        settings = obj.bubble_pattern
        solved = yield from target_steps(obj, context, replace(recipe_of(settings), solve=solve_of(settings)))
        return obj, solved

    def done(self, context: bpy.types.Context, result: Any) -> None:
        """Say what was found."""
        obj, solved = result
        settings = obj.bubble_pattern
        counted = settings.solve_for == 'COUNT'
        reached = f"{solved.reached:,.0f} features" if counted else f"{solved.reached:.1%} open"
        packings = "one packing" if solved.packings == 1 else f"{solved.packings} packings"
        length, kind = found_length(settings, solved.by)
        found = f"{kind} {length_text(context, length)}" if length else f"{kind} times {solved.factor:.4g}"
        level = 'INFO' if solved.met else 'WARNING'
        nearest = "" if solved.met else ", the nearest that was found"
        self.report({level}, f"{reached} with {found}{nearest}, after {packings}")


def take_found(settings: Any, solved: Any) -> None:
    """Set the settings that were found, and no others."""
    live, settings.live = settings.live, False
    if solved.by == "pitch":
        take_packing(settings, solved.recipe.packing)
    else:
        take_shaping(settings, solved.recipe.shaping)
    settings.live = live


def found_length(settings: Any, by: str) -> tuple[float, str]:
    """The length that was found, 0 where it varies over the region, and its name."""
    if by == "pitch":
        return (settings.pitch if settings.pitch_field.kind == 'CONSTANT' else 0.0), "pitch"
    same = settings.diameter_field.kind == 'CONSTANT' and settings.diameter_mode == 'SIZE'
    return (settings.diameter if same else 0.0), "diameter"


CLASSES = (BUBBLE_PATTERN_OT_solve,)

register, unregister = bpy.utils.register_classes_factory(CLASSES)
