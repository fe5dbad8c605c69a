"""From patterns to the part: step 3 between reading and writing Blender's data."""

from __future__ import annotations

import bpy

from ..core.errors import RegionError
from ..core.feature_recipe import Feature
from ..core.metric import end_to_end
from ..core.part import Part
from ..core.pattern import Pattern, joined
from ..core.plan import Plan
from ..core.progress import Progress, Steps
from ..core.several import Layer, layered_steps
from ..core.sides import check_one_side
from ..core.solid import cutting_seconds
from .feature_objects import stamp_of
from .generation import renewing_steps, show_part
from .hand_state import check_settled
from .live import has_window
from .part_mesh import build_part_mesh
from .pattern_object import read_pattern
from .properties import in_scene, pattern_objects
from .provenance import Original, read_original
from .reading import Base, evaluated_mesh, read_base, shown
from .settings_recipe import is_outdated, part_text, recipe_of
from .sources import read_source
from .stepping import PATIENCE


def apply_steps(obj: bpy.types.Object, context: bpy.types.Context) -> Steps[tuple[bpy.types.Object, Part]]:
    """Make the part: the base with the features of all its patterns, as an object in the base's place.

    A pattern whose settings or base have changed since is laid anew first.

    Raises PatternError, BaseError where the base is not fit for a solid.
    """
    base_object = obj.bubble_pattern.base
    owners = applied_with(obj)
    for owner in owners:
        settings = owner.bubble_pattern
        check_settled(owner)
        recipe = recipe_of(settings)
        source = read_source(base_object, settings.region, context, recipe)
        if recipe.feature.through:
            check_one_side(source.base.mesh, source.selected)
        now = (source.fingerprint, source.size_trace)
        if now != (settings.fingerprint, settings.size_trace) or is_outdated(settings):
            yield from renewing_steps(owner, context)
    base, original = read_whole(base_object, context)
    layers = layers_of(owners, base, context)
    places = end_to_end([layer.pattern.places for layer in layers])
    if not len(places):
        raise RegionError("The pattern has no features: make the pitch smaller or the region larger")
    part = yield from layered_steps(base.mesh, layers, is_long if has_window() else None)
    yield Progress("Building the part", 1.0)
    mesh = build_part_mesh(
        f"{base_object.name} Part", part, places, base, original, obj.bubble_pattern.wall_material
    )
    for owner in owners:
        owner.bubble_pattern.part_removed = part.check.removed_volume
        owner.bubble_pattern.part_made_with = part_text(owner.bubble_pattern)
    return place_part(base_object, owners, mesh, verdict_of(part), context), part


def layers_of(owners: list[bpy.types.Object], base: Base, context: bpy.types.Context) -> list[Layer]:
    """The patterns of all owners, those with the same features as one, in the order of the owners."""
    alike: dict[Feature, list[Pattern]] = {}
    for owner in owners:
        feature = recipe_of(owner.bubble_pattern).feature
        alike.setdefault(feature, []).append(read_pattern(owner, base.mesh))
    return [
        Layer(joined(patterns), feature, stamp_of(feature, context)) for feature, patterns in alike.items()
    ]


def applied_with(obj: bpy.types.Object) -> list[bpy.types.Object]:
    """The patterns that are applied when `obj` is: one for each region of its base, in the order of names.

    A duplicate of a pattern is a variant, in the same region: `obj` stands for its own, the first that is
    shown for another.
    """
    on_base = pattern_objects(obj.bubble_pattern.base)
    chosen: dict[str, bpy.types.Object] = {}
    for other in sorted(on_base, key=lambda other: (other != obj, other.hide_get(), other.name)):
        chosen.setdefault(other.bubble_pattern.region, other)
    return sorted(chosen.values(), key=lambda other: other.name)


def is_long(plan: Plan) -> bool:
    """Whether a designer would take Blender for dead while this is cut."""
    return cutting_seconds(plan) > PATIENCE


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
