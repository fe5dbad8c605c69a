"""From settings to points, and from points to a part: the pipeline of core between reading and writing
Blender's data.

Everything long is a generator of progress steps; Blender's data are written after its last step, in one go,
so a cancelled or failed run leaves nothing behind.
"""

from __future__ import annotations

import time
from dataclasses import dataclass, replace
from typing import Any

import bpy

from ..core.errors import PatternError
from ..core.pattern import Pattern
from ..core.pipeline import pattern_steps
from ..core.progress import Progress, Result, Steps, drive
from ..core.quality import Quality, measure
from ..core.recipe import Recipe, RegionChoice, default_recipe
from ..core.recipe_file import recipe_from_dict
from ..core.region import Region
from ..core.results import Results, results_of
from ..core.shaping import reshaped
from . import live
from .cut_preview import hide_cut
from .hand_state import by_hand, is_kept
from .noting import note_quality, note_results, noted_quality
from .pattern_object import read_pattern, write_pattern, write_sizes
from .preview_nodes import show_preview
from .properties import SETTINGS_VERSION, in_scene, pattern_objects
from .settings_recipe import packing_text, recipe_of, recipe_text, spoken, take_recipe
from .sources import Source, read_source

# Without a window, a pattern that took longer than this is not laid anew at every change of a setting.
LIVE_SECONDS = 1.0
HAND_MADE = (
    "The {} has changed since the features were settled by hand: update the pattern, which keeps only those "
    "that are pinned"
)


@dataclass(frozen=True)
class Laid:
    """A pattern with the figures that the panel shows."""

    pattern: Pattern
    quality: Quality
    results: Results
    seconds: float = 0.0


def fitting_recipe(
    region: Region, attribute: str, pitch: float | None = None, diameter: float | None = None
) -> Recipe:
    """A good recipe for `region`, the faces with this attribute: by its size alone where no length is given.

    Of pitch and diameter the one that is given alone takes the other along in proportion. Raises RecipeError
    where the two do not go together.
    """
    fitting = default_recipe(region.area, region.perimeter, RegionChoice(attribute=attribute))
    given: dict[str, dict[str, float]] = {}
    if pitch is not None:
        given["packing"] = {"pitch": pitch}
    if diameter is not None:
        given["shaping"] = {"diameter": diameter}
    return recipe_from_dict(given, fitting)


def laying_steps(source: Source, recipe: Recipe) -> Steps[Laid]:
    """Steps 1 and 2 and their figures."""
    packing = pattern_steps(source.region, recipe, source.surroundings)
    pattern, seconds = yield from timed(packing)
    yield Progress("Measuring", 1.0)
    laid = measured(pattern, source.region, recipe, measure(pattern, source.region))
    return replace(laid, seconds=seconds)


def timed(steps: Steps[Result]) -> Steps[tuple[Result, float]]:
    """Pass `steps` on; returns their result, and the seconds that they took without the pauses between."""
    seconds = 0.0
    while True:
        start = time.perf_counter()
        try:
            progress = next(steps)
        except StopIteration as end:
            return end.value, seconds + time.perf_counter() - start
        seconds += time.perf_counter() - start
        yield progress


def measured(pattern: Pattern, region: Region, recipe: Recipe, quality: Quality) -> Laid:
    """`pattern` with its figures."""
    return Laid(pattern, quality, results_of(pattern, region, recipe))


def put(obj: bpy.types.Object, source: Source, recipe: Recipe, laid: Laid) -> None:
    """Write what was laid to the pattern's object."""
    settings = obj.bubble_pattern
    write_pattern(obj, laid.pattern, settings.base, source.base)
    settings.hand_made = False
    note(settings, source, recipe, laid)
    note_quality(settings, laid.quality)
    settings.seconds = laid.seconds
    show_preview(obj, settings.show_bubbles)


def note(settings: Any, source: Source, recipe: Recipe, laid: Laid) -> None:
    """Write down what the points were made with, and the figures that depend on the features' sizes."""
    settings.made_with = recipe_text(recipe)
    settings.fingerprint = source.fingerprint
    settings.size_trace = source.size_trace
    settings.version = SETTINGS_VERSION
    settings.trouble = settings.cut_trouble = ""
    live.note_base(settings.id_data)
    settings.shrunk = len(laid.pattern.shrunk)
    settings.dropped = 0 if laid.pattern.dropped is None else len(laid.pattern.dropped)
    settings.notes = " ".join(laid.pattern.notes)
    note_results(settings, laid.pattern, laid.results)


def update_steps(obj: bpy.types.Object, context: bpy.types.Context) -> Steps[None]:
    """Lay the pattern of `obj` anew by its settings, on its base as it is now."""
    recipe = recipe_of(obj.bubble_pattern)
    yield Progress("Reading the base", 0.0)
    settings = obj.bubble_pattern  # asked for anew after every pause: what stood there may be elsewhere
    source = read_source(settings.base, settings.region, context, recipe)
    laid = yield from laying_steps(source, recipe)
    put(obj, source, recipe, laid)


def renewing_steps(obj: bpy.types.Object, context: bpy.types.Context) -> Steps[None]:
    """Bring the pattern up to date by itself. Raises PatternError where hand work would be lost by it."""
    settings = obj.bubble_pattern
    if not is_kept(obj):
        yield from update_steps(obj, context)
    elif is_only_shape(settings):
        reshape(obj, context)
    else:
        raise PatternError(HAND_MADE.format("packing"))


def react(settings: Any, context: bpy.types.Context, repack: bool) -> None:
    """Answer a change of a setting in the panel: lay or shape the pattern anew; see live."""
    obj = settings.id_data
    if settings.cut_preview and in_scene(settings.base):
        hide_cut(settings.base)
    if not answers(settings, context) or live.is_taken_up(obj):
        return
    if is_kept(obj) and (by_hand(obj).unsettled or repack or not is_only_shape(settings)):
        return  # hand work is not thrown away without being asked; the sidebar says so
    try:
        if not repack and is_only_shape(settings):
            reshape(obj, context)
        elif live.has_window():
            live.lay(obj, context, update_steps(obj, context), settings.seconds)
        elif settings.seconds <= LIVE_SECONDS:
            drive(update_steps(obj, context))
    except PatternError as error:
        settings.trouble = spoken(error, context)


def answers(settings: Any, context: bpy.types.Context) -> bool:
    """Whether the pattern follows its settings, and can."""
    obj, base = settings.id_data, settings.base
    return (
        settings.live
        and bool(settings.made_with)
        and in_scene(base)
        and in_scene(obj)
        and obj.is_editable
        and base.name in context.view_layer.objects
        and 'EDIT' not in base.mode
        and 'EDIT' not in obj.mode
    )


def is_only_shape(settings: Any) -> bool:
    """Whether the bubbles are where the settings want them, whatever the features' sizes."""
    return settings.made_with.startswith(packing_text(recipe_of(settings)).split("[shaping]")[0])


def reshape(obj: bpy.types.Object, context: bpy.types.Context) -> None:
    """Give the features the sizes that the settings want, on the bubbles that are there."""
    settings = obj.bubble_pattern
    recipe = recipe_of(settings)
    source = read_source(settings.base, settings.region, context, recipe)
    if source.fingerprint != settings.fingerprint:
        if is_kept(obj):
            raise PatternError(HAND_MADE.format("base"))
        drive(update_steps(obj, context))
        return
    pattern = reshaped(read_pattern(obj, source.base.mesh), source.region, recipe, source.surroundings)
    laid = measured(pattern, source.region, recipe, noted_quality(settings))
    write_sizes(obj, pattern)
    note(settings, source, recipe, laid)


def show_part(obj: bpy.types.Object, context: bpy.types.Context, applied: bool) -> None:
    """Show the part and hide the base with its patterns, or the other way round, and select what is shown.

    The base is selected rather than the pattern, whose every feature would be outlined.
    """
    settings = obj.bubble_pattern
    for other in [settings.base, *pattern_objects(settings.base)]:
        other.hide_set(applied)
        other.hide_render = applied
    part = settings.part
    if in_scene(part):
        part.hide_set(not applied)
        part.hide_render = not applied
    settings.base.bubble_pattern.pattern = obj
    make_active(part if applied else settings.base, context)


def make_active(obj: bpy.types.Object, context: bpy.types.Context) -> None:
    """Select `obj` alone and make it active."""
    context.view_layer.update()
    for other in context.view_layer.objects:
        other.select_set(other == obj)
    context.view_layer.objects.active = obj


def fill_settings(obj: bpy.types.Object, base: bpy.types.Object, region: str, recipe: Recipe) -> None:
    """Let `obj` be a pattern on `base` with the target region and the settings given."""
    settings = obj.bubble_pattern
    settings.live = False
    settings.base = base
    settings.region = region
    take_recipe(settings, recipe)
    settings.live = True
