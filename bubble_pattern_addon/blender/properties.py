# mypy: disable-error-code="valid-type"
"""The pattern's settings: a property here for every field of the recipe that the sidebar shows."""

from __future__ import annotations

import re
from dataclasses import replace
from typing import Any

import bpy
from bpy.props import (
    BoolProperty,
    EnumProperty,
    FloatProperty,
    IntProperty,
    PointerProperty,
    StringProperty,
)

from ..core.errors import PatternError, RecipeError
from ..core.metric import Constant, Field
from ..core.recipe import (
    Feature,
    Limits,
    Packing,
    Recipe,
    RegionChoice,
    Shaping,
    check_recipe,
    recipe_to_toml,
)

# Raised when a property changes its meaning; see upgrade.
SETTINGS_VERSION = 1


def reshape(settings: bpy.types.PropertyGroup, context: bpy.types.Context) -> None:
    """A size changed: the bubbles stay where they are."""
    from . import generation  # here, because Blender's start need not wait for scipy

    generation.react(settings, context, repack=False)


def repack(settings: bpy.types.PropertyGroup, context: bpy.types.Context) -> None:
    """A setting of the packing changed: the bubbles move."""
    from . import generation

    generation.react(settings, context, repack=True)


def redraw_preview(settings: bpy.types.PropertyGroup, _context: bpy.types.Context) -> None:
    """A setting of the preview alone changed."""
    from .preview_nodes import show_preview

    if settings.base is not None:
        show_preview(settings.id_data, settings.show_bubbles)


def is_on(settings: bpy.types.PropertyGroup, obj: bpy.types.Object) -> bool:
    """Whether `obj` is a pattern on the object that has these settings."""
    return obj.bubble_pattern.base == settings.id_data and in_scene(obj)


def is_mesh(_settings: bpy.types.PropertyGroup, obj: bpy.types.Object) -> bool:
    """Whether `obj` can be a base."""
    return obj.type == 'MESH'


def length_property(name: str, description: str, default: float = 0.0, **options: Any) -> Any:
    """A length in the scene's unit, fine enough for fractions of a millimeter."""
    return FloatProperty(
        name=name,
        description=description,
        subtype='DISTANCE',
        default=default,
        step=1,
        precision=4,
        **options,
    )


# A length that something stands for cannot be nothing.
SIZE = {"min": 1e-6, "soft_max": 10.0}


class BubblePatternSettings(bpy.types.PropertyGroup):
    """Settings and results of one pattern, kept on its object. An object without a base is no pattern."""

    # Named as the recipe's sections and fields are.
    base: PointerProperty(
        name="Base",
        description="Object whose faces carry the pattern",
        type=bpy.types.Object,
        poll=is_mesh,
    )
    part: PointerProperty(
        name="Part", description="Finished part made of this pattern", type=bpy.types.Object
    )
    pattern: PointerProperty(
        name="Pattern",
        description="Pattern on this base that the sidebar shows; for a part, the one it was made of",
        type=bpy.types.Object,
        poll=is_on,
    )
    region: StringProperty(
        name="Region",
        description="Face attribute of the base that marks the target region",
    )
    pitch: length_property(
        name="Pitch",
        description="Distance between the centers of neighboring features",
        default=0.003,
        **SIZE,
        update=repack,
    )
    edge_offset: length_property(
        name="Edge Offset",
        description="Extra distance between the first row of features and the boundary of the region",
        default=0.0,
        update=repack,
    )
    integrator: EnumProperty(
        name="Integrator",
        description="How the bubbles find their equilibrium",
        items=(
            ('FIRE', "Fast", "Fast inertial relaxation, to the same equilibrium in fewer steps"),
            ('RK4', "Runge-Kutta", "Equation of motion, integrated by the fourth-order Runge-Kutta method"),
        ),
        default='FIRE',
        update=repack,
    )
    seed: IntProperty(
        name="Seed",
        description="Choose another arrangement of the same quality",
        default=0,
        min=0,
        update=repack,
    )
    iterations: IntProperty(
        name="Iterations",
        description="Most steps the bubbles may take to their equilibrium",
        default=Packing().iterations,
        min=1,
        soft_max=2000,
        update=repack,
    )
    tolerance: FloatProperty(
        name="Tolerance",
        description="Stop when no bubble moves farther than this share of its pitch in one step",
        default=Packing().tolerance,
        min=1e-9,
        max=1.0,
        precision=5,
        update=repack,
    )
    diameter: length_property(
        name="Diameter",
        description="Diameter of the features",
        default=0.0018,
        **SIZE,
        update=reshape,
    )
    depth_mode: EnumProperty(
        name="Depth",
        description="How deep the holes go",
        items=(
            ('THROUGH', "Through", "Through the near wall, however thick it is there"),
            ('BLIND', "Blind", "To a given depth below the surface"),
        ),
        default='THROUGH',
    )
    depth: length_property(
        name="Depth",
        description="Depth of the holes below the surface",
        default=0.001,
        **SIZE,
    )
    sides: IntProperty(
        name="Sides",
        description="Corners of a hole's profile, or 0 to choose them by the hole's size",
        default=0,
        min=0,
        soft_max=128,
        max=1024,
    )
    min_web: length_property(
        name="Min Web",
        description="Material that must remain between two features",
        default=0.0,
        min=0.0,
        update=reshape,
    )
    min_margin: length_property(
        name="Min Margin",
        description="Material that must remain between a feature and the boundary of the region",
        default=0.0,
        min=0.0,
        update=reshape,
    )
    wall_material: PointerProperty(
        name="Wall Material",
        description="Material of the walls of the holes, or that of the base where none is chosen",
        type=bpy.types.Material,
    )
    live: BoolProperty(
        name="Live Update",
        description="Lay the pattern anew with every change, as long as that takes less than half a second",
        default=True,
    )
    show_bubbles: BoolProperty(
        name="Show Bubbles",
        description="Draw the territory of every feature as a ring",
        default=False,
        update=redraw_preview,
    )

    # What came out of the last generation. -1 where nothing could be measured.
    made_with: StringProperty(options={'HIDDEN'})
    fingerprint: StringProperty(options={'HIDDEN'})
    size_trace: StringProperty(options={'HIDDEN'})
    trouble: StringProperty(options={'HIDDEN'})
    version: IntProperty(options={'HIDDEN'})
    seconds: FloatProperty(options={'HIDDEN'})
    count: IntProperty(name="Features", description="Number of features", options={'HIDDEN'})
    shrunk: IntProperty(options={'HIDDEN'})
    dropped: IntProperty(options={'HIDDEN'})
    notes: StringProperty(options={'HIDDEN'})
    six: FloatProperty(name="Order", subtype='FACTOR', min=-1.0, max=1.0, options={'HIDDEN'})
    gap_min: FloatProperty(name="Smallest Gap", options={'HIDDEN'})
    web: FloatProperty(name="Smallest Web", subtype='DISTANCE', options={'HIDDEN'})
    margin: FloatProperty(name="Smallest Margin", subtype='DISTANCE', options={'HIDDEN'})
    open_area: FloatProperty(name="Open Area", options={'HIDDEN'})
    verdict: StringProperty(options={'HIDDEN'})


def typed(value: float) -> float:
    """The number that was typed, of the 32 bits that Blender keeps of it: 0.0018, not 0.00179999996."""
    return float(f"{value:.7g}")


def recipe_of(settings: Any) -> Recipe:
    """The recipe that `settings` stand for. Raises RecipeError where they contradict one another."""
    through = settings.depth_mode == 'THROUGH'
    recipe = Recipe(
        region=RegionChoice(attribute=settings.region or None),
        packing=Packing(
            pitch=Constant(typed(settings.pitch)),
            edge_offset=typed(settings.edge_offset),
            integrator=settings.integrator.lower(),
            seed=settings.seed,
            iterations=settings.iterations,
            tolerance=typed(settings.tolerance),
        ),
        shaping=Shaping(diameter=Constant(typed(settings.diameter))),
        feature=Feature(depth=None if through else typed(settings.depth), sides=settings.sides or None),
        limits=Limits(min_web=typed(settings.min_web), min_margin=typed(settings.min_margin)),
    )
    check_recipe(recipe)
    return recipe


def take_recipe(settings: Any, recipe: Recipe) -> None:
    """Set `settings` to what `recipe` says. Raises RecipeError for what the sidebar cannot show."""
    live, settings.live = settings.live, False  # one change after the other would lay a pattern each time
    packing, feature = recipe.packing, recipe.feature
    settings.pitch = number(packing.pitch, "[packing] pitch")
    settings.edge_offset = packing.edge_offset
    settings.integrator = packing.integrator.upper()
    settings.seed = packing.seed
    settings.iterations = packing.iterations
    settings.tolerance = packing.tolerance
    settings.diameter = number(recipe.shaping.diameter, "[shaping] diameter")
    settings.depth_mode = 'THROUGH' if feature.depth is None else 'BLIND'
    if feature.depth is not None:
        settings.depth = feature.depth
    settings.sides = feature.sides or 0
    settings.min_web = recipe.limits.min_web
    settings.min_margin = recipe.limits.min_margin
    settings.live = live


def number(field: Field, where: str) -> float:
    """The value of a field that is the same everywhere."""
    if isinstance(field, Constant):
        return field.value
    raise RecipeError(f"{where} is a field that the sidebar cannot show: give a number")


def packing_text(recipe: Recipe) -> str:
    """What the places of the bubbles depend on, as text: equal texts give equal places."""
    return recipe_to_toml(Recipe(packing=recipe.packing, region=recipe.region))


def recipe_text(recipe: Recipe) -> str:
    """What the pattern's points depend on, as text; how the features are cut is left out."""
    return recipe_to_toml(replace(recipe, feature=Feature()))


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


def is_outdated(settings: Any) -> bool:
    """Whether the settings say something else than the points that stand there."""
    try:
        return settings.made_with != recipe_text(recipe_of(settings))
    except RecipeError:
        return True


def in_scene(obj: bpy.types.Object | None) -> bool:
    """Whether `obj` stands in some collection; a deleted object that something points at does not."""
    return obj is not None and bool(obj.users_collection)


def is_pattern(obj: bpy.types.Object | None) -> bool:
    """Whether `obj` is the object of a pattern."""
    return obj is not None and obj.bubble_pattern.base is not None


def pattern_objects(base: bpy.types.Object) -> list[bpy.types.Object]:
    """The patterns on `base`, in the order of their names."""
    return sorted((o for o in base.children if o.bubble_pattern.base == base), key=lambda o: o.name)


def pattern_of(obj: bpy.types.Object | None) -> bpy.types.Object | None:
    """The pattern that `obj` is, or carries (of several the one it names), or was made of."""
    if obj is None or is_pattern(obj):
        return obj
    named = obj.bubble_pattern.pattern
    if in_scene(named) and obj in (named.bubble_pattern.base, named.bubble_pattern.part):
        return named
    on_base = pattern_objects(obj)
    return on_base[0] if on_base else None


def register() -> None:
    """Give every object its settings."""
    bpy.utils.register_class(BubblePatternSettings)
    bpy.types.Object.bubble_pattern = PointerProperty(type=BubblePatternSettings)


def unregister() -> None:
    """Take the settings back."""
    del bpy.types.Object.bubble_pattern
    bpy.utils.unregister_class(BubblePatternSettings)
