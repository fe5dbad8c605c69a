"""A base as read for one pattern: geometry, target region, and what its fields ask for.

What was read last is remembered for as long as the base does not change (see watching), and with it all that
the region works out about itself: a change of a size reads nothing, one of the packing builds no region.
"""

from __future__ import annotations

from collections import OrderedDict
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import bpy

from ..core.errors import BaseError
from ..core.field_tables import Wanted
from ..core.mesh import Bools, Ints, digest
from ..core.recipe import Recipe, RegionChoice
from ..core.recipe_names import both, packing_names, shaping_names
from ..core.region import Region, make_region
from ..core.selection import select, sub_regions
from ..core.surroundings import Surroundings
from .cut_preview import hide_cut
from .feature_objects import read_stamp
from .keep_outs import cut_to_choice
from .marked_side import on_marked_side
from .reading import Base, evaluated_mesh, read_base, shown
from .surroundings import images_of, read_painted, trace, with_things
from .watching import Stamp, forgetters, stamp_of

# So many readings are kept: those of the patterns on one part.
KEPT = 3


@dataclass(frozen=True)
class Source:
    """A base as read for one pattern: geometry, region, the region's triangles as a mask (T,), what fields
    ask for, and what tells whether any of them has changed: for the bubbles' places, and for their sizes.
    """

    base: Base
    region: Region
    selected: Bools
    surroundings: Surroundings
    fingerprint: str
    size_trace: str


class Reading(NamedTuple):
    """What is read of the base itself; of other things nothing is remembered."""

    base: Base
    region: Region
    selected: Bools
    painted: Surroundings
    fingerprint: str
    parts: Ints | None


_remembered: OrderedDict[Any, tuple[Stamp, Reading]] = OrderedDict()


forgetters.append(_remembered.clear)


def read_source(
    obj: bpy.types.Object, attribute: str, context: bpy.types.Context, recipe: Recipe | None = None
) -> Source:
    """The base `obj` with its modifiers, its target region from the face attribute of that name, and what
    the fields of `recipe` ask for.

    Raises RegionError where no face carries the attribute, BaseError where the object has no usable mesh.
    """
    pitch_names, size_names = (Wanted(), Wanted()) if recipe is None else names_of(recipe)
    names = both(pitch_names, size_names)
    choice = RegionChoice(attribute=attribute) if recipe is None else recipe.region
    reading = reading_of(obj, attribute, replace(choice, keep_out=()), names, context)
    if choice.keep_out:
        reading = less_keep_outs(reading, choice, context)
    painted = replace(reading.painted, images=images_of(names.images))
    surroundings = with_things(painted, names, reading.base.frame, context)
    name = None if recipe is None else recipe.feature.mesh
    meshes = {} if name is None else {name: read_stamp(name, context)}
    surroundings = replace(surroundings, meshes=meshes)
    features = "".join(digest(mesh.vertices, mesh.triangles).hex() for mesh in meshes.values())
    return Source(
        reading.base,
        reading.region,
        reading.selected,
        surroundings,
        reading.fingerprint + trace(surroundings, pitch_names),
        trace(surroundings, size_names) + features,
    )


def names_of(recipe: Recipe) -> tuple[Wanted, Wanted]:
    """What the packing metric asks its surroundings for, and what shaping the features does."""
    return packing_names(recipe), shaping_names(recipe)


def reading_of(
    obj: bpy.types.Object, attribute: str, choice: RegionChoice, names: Wanted, context: bpy.types.Context
) -> Reading:
    """What `read` gives, as remembered where the base has not changed."""
    if obj.name not in context.view_layer.objects:
        raise BaseError(f'"{obj.name}" is not in this view layer: include its collection')
    hide_cut(obj)
    context.evaluated_depsgraph_get()  # so that every change so far is in the stamp
    on_base = replace(names, objects=frozenset(), images=frozenset())
    materials = tuple(slot.material.name if slot.material else "" for slot in obj.material_slots)
    key = (obj.session_uid, context.scene.session_uid, attribute, choice, on_base, materials)
    stamp = stamp_of(obj)
    known = _remembered.get(key)
    if known is not None and known[0] == stamp:
        _remembered.move_to_end(key)
        return known[1]
    reading = read(obj, attribute, choice, on_base, context)
    stamp = stamp_of(obj)
    if stamp is not None:
        _remembered[key] = (stamp, reading)
        _remembered.move_to_end(key)
        while len(_remembered) > KEPT:
            _remembered.popitem(last=False)
    return reading


def read(
    obj: bpy.types.Object, attribute: str, choice: RegionChoice, names: Wanted, context: bpy.types.Context
) -> Reading:
    """Read the base with its modifiers, and build its target region. Raises like read_source."""
    with shown(obj, context), evaluated_mesh(obj, context.evaluated_depsgraph_get()) as mesh:
        base = read_base(obj, mesh)
        painted = read_painted(obj, mesh, base, names)
    selected = select(base.mesh, RegionChoice(attribute=attribute), base.attributes)
    selected = on_marked_side(obj, base, attribute, selected)
    parts = sub_regions(choice, base.attributes, base.materials)
    region = make_region(base.mesh, selected, parts, choice.gap)
    return Reading(base, region, selected, painted, base.fingerprint(selected, parts), parts)


def less_keep_outs(reading: Reading, choice: RegionChoice, context: bpy.types.Context) -> Reading:
    """The reading with what the choice keeps out cut out of its region; what that is counts for the
    fingerprint.
    """
    base, selected, parts = reading.base, reading.selected, reading.parts
    region, trace = cut_to_choice(base, selected, parts, choice, reading.fingerprint, context)
    return reading._replace(region=region, fingerprint=reading.fingerprint + trace)
