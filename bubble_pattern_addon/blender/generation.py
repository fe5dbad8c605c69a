"""From settings to points, and from points to a part: the pipeline of core between reading and writing
Blender's data.

Everything long is a generator of progress steps; Blender's data are written after its last step, in one go,
so a cancelled or failed run leaves nothing behind.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import Any

import bpy
import numpy as np

from ..core.errors import BaseError, PatternError, RegionError
from ..core.mesh import Bools
from ..core.metric import Places
from ..core.pattern import Pattern
from ..core.pipeline import pattern_steps
from ..core.progress import Progress, Steps, drive
from ..core.quality import Quality, measure, min_margin, min_web, open_area
from ..core.recipe import Recipe, RegionChoice, default_recipe, recipe_from_dict
from ..core.region import Region, make_region
from ..core.selection import select
from ..core.sides import check_one_side
from ..core.solid import Part, part_steps
from .marked_side import on_marked_side
from .part_mesh import build_part_mesh
from .pattern_object import read_pattern, write_diameters, write_pattern
from .preview_nodes import show_preview
from .properties import (
    SETTINGS_VERSION,
    in_scene,
    is_outdated,
    packing_text,
    pattern_objects,
    recipe_of,
    recipe_text,
    spoken,
    take_recipe,
)
from .provenance import Original, read_original
from .reading import Base, evaluated_mesh, read_base

# A pattern that took longer than this is not laid anew at every change of a setting.
LIVE_SECONDS = 1.0


@dataclass(frozen=True)
class Laid:
    """A pattern with the figures that the panel shows."""

    pattern: Pattern
    quality: Quality
    web: float
    margin: float
    open_area: float
    seconds: float


@dataclass(frozen=True)
class Source:
    """A base as read for one pattern: geometry, region, the region's triangles as a mask (T,), and what tells
    whether any of them has changed.
    """

    base: Base
    region: Region
    selected: Bools
    fingerprint: str


@contextmanager
def shown(obj: bpy.types.Object, context: bpy.types.Context) -> Iterator[None]:
    """Let `obj` be visible for a while: Blender does not run the modifiers of hidden objects."""
    if obj.name not in context.view_layer.objects:
        raise BaseError(f'"{obj.name}" is not in this view layer: include its collection')
    was_hidden, was_disabled = obj.hide_get(), obj.hide_viewport
    if not was_hidden and not was_disabled:
        yield
        return
    obj.hide_set(False)
    obj.hide_viewport = False
    try:
        yield
    finally:
        obj.hide_set(was_hidden)
        obj.hide_viewport = was_disabled


def read_source(obj: bpy.types.Object, attribute: str, context: bpy.types.Context) -> Source:
    """Read the base `obj` with its modifiers, and its target region from the face attribute of that name.

    Raises RegionError where no face carries the attribute, BaseError where the object has no usable mesh.
    """
    with shown(obj, context), evaluated_mesh(obj, context.evaluated_depsgraph_get()) as mesh:
        base = read_base(obj, mesh)
    selected = select(base.mesh, RegionChoice(attribute=attribute), base.attributes)
    return source_of(base, on_marked_side(obj, base, attribute, selected))


def source_of(base: Base, selected: Bools) -> Source:
    """The source of a pattern on the triangles `selected` (T,) of `base`."""
    return Source(base, make_region(base.mesh, selected), selected, base.fingerprint(selected))


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
    start = time.perf_counter()
    pattern = yield from pattern_steps(source.region, recipe)
    yield Progress("Measuring", 1.0)
    return measured(pattern, source.region, measure(pattern, source.region), start)


def measured(pattern: Pattern, region: Region, quality: Quality, start: float) -> Laid:
    """`pattern` with its figures; `start` is when work on it began."""
    web, margin, share = min_web(pattern), min_margin(pattern, region), open_area(pattern, region)
    return Laid(pattern, quality, web, margin, share, time.perf_counter() - start)


def put(obj: bpy.types.Object, source: Source, recipe: Recipe, laid: Laid) -> None:
    """Write what was laid to the pattern's object."""
    settings = obj.bubble_pattern
    write_pattern(obj, laid.pattern, settings.base, source.base)
    note(settings, source, recipe, laid)
    settings.six = laid.quality.six if np.isfinite(laid.quality.six) else -1.0
    settings.gap_min = laid.quality.gap_min if np.isfinite(laid.quality.gap_min) else -1.0
    settings.seconds = laid.seconds
    show_preview(obj, settings.show_bubbles)


def note(settings: Any, source: Source, recipe: Recipe, laid: Laid) -> None:
    """Write down what the points were made with, and the figures that depend on the features' sizes."""
    settings.made_with = recipe_text(recipe)
    settings.fingerprint = source.fingerprint
    settings.version = SETTINGS_VERSION
    settings.trouble = ""
    settings.count = len(laid.pattern)
    settings.web = laid.web if np.isfinite(laid.web) else -1.0
    settings.margin = laid.margin if np.isfinite(laid.margin) else -1.0
    settings.open_area = laid.open_area


def update_steps(obj: bpy.types.Object, context: bpy.types.Context) -> Steps[None]:
    """Lay the pattern of `obj` anew by its settings, on its base as it is now."""
    settings = obj.bubble_pattern
    recipe = recipe_of(settings)
    yield Progress("Reading the base", 0.0)
    source = read_source(settings.base, settings.region, context)
    laid = yield from laying_steps(source, recipe)
    put(obj, source, recipe, laid)


def react(settings: Any, context: bpy.types.Context, repack: bool) -> None:
    """Answer a change of a setting in the panel: lay or shape the pattern anew where that is quick.

    It happens within the change, so that one undo takes back both.
    """
    obj = settings.id_data
    if (
        not settings.live
        or not in_scene(settings.base)
        or settings.base.mode == 'EDIT'
        or not settings.made_with
    ):
        return
    try:
        if not repack and is_only_shape(settings):
            reshape(obj, context)
        elif settings.seconds <= LIVE_SECONDS:
            drive(update_steps(obj, context))
    except PatternError as error:
        settings.trouble = spoken(error, context)


def is_only_shape(settings: Any) -> bool:
    """Whether the bubbles are where the settings want them, whatever the features' sizes."""
    return settings.made_with.startswith(packing_text(recipe_of(settings)).split("[shaping]")[0])


def reshape(obj: bpy.types.Object, context: bpy.types.Context) -> None:
    """Give the features the sizes that the settings want, on the bubbles that are there."""
    settings = obj.bubble_pattern
    recipe = recipe_of(settings)
    start = time.perf_counter()
    source = read_source(settings.base, settings.region, context)
    if source.fingerprint != settings.fingerprint:
        drive(update_steps(obj, context))
        return
    pattern = read_pattern(obj, source.base.mesh)
    pattern = replace(pattern, diameter=recipe.shaping.diameter(pattern.places))
    quality = Quality(settings.six, 0.0, 0.0, settings.gap_min, 0.0)
    laid = measured(pattern, source.region, quality, start)
    write_diameters(obj, pattern.diameter)
    note(settings, source, recipe, laid)


# -- the part ----------------------------------------------------------------------------------------------


def joined(patterns: list[Pattern]) -> Pattern:
    """Several patterns on one base as one; ids go on from one to the next."""
    if len(patterns) == 1:
        return patterns[0]

    def all_of(values: list[Any]) -> Any:
        """A column of every pattern, (n,) or (n, w) each, one after the other."""
        return np.concatenate(values)

    places = [pattern.places for pattern in patterns]
    return Pattern(
        Places(
            all_of([p.position for p in places]),
            all_of([p.triangle for p in places]),
            all_of([p.barycentric for p in places]),
        ),
        normal=all_of([p.normal for p in patterns]),
        tangent=all_of([p.tangent for p in patterns]),
        pitch=all_of([p.pitch for p in patterns]),
        diameter=all_of([p.diameter for p in patterns]),
        row=all_of([p.row for p in patterns]),
    )


def apply_steps(obj: bpy.types.Object, context: bpy.types.Context) -> Steps[tuple[bpy.types.Object, Part]]:
    """Make the part: the base with the features of all its patterns, as an object in the base's place.

    A pattern whose settings or base have changed since is laid anew first.

    Raises PatternError, BaseError where the base is not fit for a solid.
    """
    settings = obj.bubble_pattern
    base_object = settings.base
    owners = pattern_objects(base_object)
    feature = recipe_of(settings).feature
    if any(recipe_of(owner.bubble_pattern).feature != feature for owner in owners):
        raise PatternError(
            f'The patterns on "{base_object.name}" have holes of different kinds: give them the same depth '
            "and sides, or apply one, and add the other to the part"
        )
    for owner in owners:
        source = read_source(base_object, owner.bubble_pattern.region, context)
        if feature.depth is None:
            check_one_side(source.base.mesh, source.selected)
        if source.fingerprint != owner.bubble_pattern.fingerprint or is_outdated(owner.bubble_pattern):
            yield from update_steps(owner, context)
    base, original = read_whole(base_object, context)
    pattern = joined([read_pattern(owner, base.mesh) for owner in owners])
    if not len(pattern):
        raise RegionError("The pattern has no features: make the pitch smaller or the region larger")
    part = yield from part_steps(base.mesh, pattern, feature)
    yield Progress("Building the part", 1.0)
    mesh = build_part_mesh(
        f"{base_object.name} Part", part, pattern.places, base, original, settings.wall_material
    )
    return place_part(base_object, owners, mesh, verdict_of(part), context), part


def read_whole(obj: bpy.types.Object, context: bpy.types.Context) -> tuple[Base, Original]:
    """The base `obj` with its modifiers, and all that a part of it inherits."""
    with shown(obj, context), evaluated_mesh(obj, context.evaluated_depsgraph_get()) as mesh:
        return read_base(obj, mesh), read_original(obj, mesh)


def verdict_of(part: Part) -> str:
    """What the check of the part found, in a few words for the panel."""
    return " ".join(part.check.problems)


def place_part(
    base: bpy.types.Object,
    owners: list[bpy.types.Object],
    mesh: bpy.types.Mesh,
    verdict: str,
    context: bpy.types.Context,
) -> bpy.types.Object:
    """Let the object of the part stand where the base is, with this mesh; base and patterns are hidden."""
    part = owners[0].bubble_pattern.part
    if in_scene(part) and part.type == 'MESH':
        old, part.data = part.data, mesh
        if not old.users:
            name = old.name
            bpy.data.meshes.remove(old)
            mesh.name = name
    else:
        part = bpy.data.objects.new(f"{base.name} Part", mesh)
        for collection in base.users_collection:
            collection.objects.link(part)
    part.parent, part.parent_type, part.parent_bone = base.parent, base.parent_type, base.parent_bone
    part.matrix_parent_inverse = base.matrix_parent_inverse
    context.view_layer.update()
    part.matrix_world = base.matrix_world
    part.bubble_pattern.pattern = owners[0]
    for owner in owners:
        owner.bubble_pattern.part = part
        owner.bubble_pattern.verdict = verdict
    show_part(owners[0], context, True)
    return part


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
