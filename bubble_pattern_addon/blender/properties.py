# mypy: disable-error-code="valid-type"
"""The pattern's settings: a property here for every field of the recipe that the sidebar shows."""

from __future__ import annotations

import re
from dataclasses import replace
from typing import Any

import bpy
from bpy.props import (
    BoolProperty,
    CollectionProperty,
    EnumProperty,
    FloatProperty,
    FloatVectorProperty,
    IntProperty,
    PointerProperty,
    StringProperty,
)

from ..core.blending import Fill
from ..core.errors import PatternError, RecipeError
from ..core.metric import Constant, Described
from ..core.recipe import (
    FILL,
    Feature,
    Limits,
    Packing,
    Recipe,
    RegionChoice,
    Seed,
    Shaping,
    check_recipe,
    recipe_to_toml,
)
from .field_properties import SIZE, BubblePatternField, length_property, point_of, typed
from .field_recipe import described, take

# Raised when a property changes its meaning; see upgrade.
SETTINGS_VERSION = 2


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


class BubblePatternSeed(bpy.types.PropertyGroup):
    """A feature whose diameter the user has fixed, by its place in the frame of the base."""

    at: FloatVectorProperty(
        name="Place", description="Where the feature is", size=3, subtype='TRANSLATION', precision=6
    )
    diameter: length_property("Diameter", "Diameter that the feature keeps", 0.001, **SIZE)


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
    parts: StringProperty(
        name="Sub-Regions",
        description="Face attributes or materials, separated by commas, whose faces get their own first row",
        update=repack,
    )
    gap: length_property(
        name="Gap",
        description="What stays free between neighboring sub-regions",
        default=0.0,
        min=0.0,
        update=repack,
    )
    pitch: length_property(
        name="Pitch",
        description="Distance between the centers of neighboring features",
        default=0.003,
        **SIZE,
        update=repack,
    )
    pitch_field: PointerProperty(
        name="Pitch Field", description="How the pitch varies over the region", type=BubblePatternField
    )
    edge_offset: length_property(
        name="Edge Offset",
        description="Extra distance between the first row of features and the boundary of the region",
        default=0.0,
        update=repack,
    )
    orientation: EnumProperty(
        name="Rows",
        description="Where the rows of the arrangement run",
        items=(
            ('EDGE', "Along Edge", "Along the longest straight edge of the region"),
            ('BEST', "Best of Four", "In the best of four directions, which takes four times as long"),
            ('GIVEN', "Direction", "Along a direction"),
        ),
        default='EDGE',
        update=repack,
    )
    rows_along: FloatVectorProperty(
        name="Row Direction",
        description="Direction of the rows in the coordinates of the base",
        size=3,
        subtype='XYZ',
        default=(1.0, 0.0, 0.0),
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
    diameter_mode: EnumProperty(
        name="Diameter As",
        description="How the size of the features is given",
        items=(
            ('SIZE', "Size", "As a diameter"),
            ('SHARE', "Share", "Relative to the pitch there: large features where it is wide"),
        ),
        default='SIZE',
        update=reshape,
    )
    fill: FloatProperty(
        name="Diameter / Pitch",
        description="Diameter of the features relative to the pitch where they are",
        subtype='FACTOR',
        default=FILL,
        min=0.01,
        max=0.99,
        update=reshape,
    )
    diameter_field: PointerProperty(
        name="Diameter Field",
        description="How the diameter varies over the region",
        type=BubblePatternField,
    )
    seeds: CollectionProperty(
        name="Fixed Sizes",
        description="Features that keep the size they were given, while the others level out between them",
        type=BubblePatternSeed,
    )
    solver: EnumProperty(
        name="Averages",
        description="How the sizes between fixed ones are found",
        items=(
            ('DIRECT', "Direct", "Solved at once"),
            ('ITERATE', "Iterate", "Averaged again and again, until sizes no longer change"),
        ),
        default='DIRECT',
        update=reshape,
    )
    shaping_tolerance: FloatProperty(
        name="Size Tolerance",
        description="Stop averaging when no size changes by more than this share",
        default=Shaping().tolerance,
        min=1e-12,
        max=1.0,
        precision=6,
        update=reshape,
    )
    shaping_iterations: IntProperty(
        name="Size Iterations",
        description="Most times that sizes are averaged",
        default=Shaping().iterations,
        min=1,
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
    facet_tolerance: length_property(
        name="Facet Tolerance",
        description="Most that the facets of a hole may stray from its circle, or 0 to choose it by the size",
        min=0.0,
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
    min_diameter: length_property(
        name="Min Diameter",
        description="Leave out features that would have to be smaller than this",
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


def recipe_of(settings: Any) -> Recipe:
    """The recipe that `settings` stand for. Raises RecipeError where they contradict one another."""
    through = settings.depth_mode == 'THROUGH'
    recipe = Recipe(
        region=RegionChoice(
            attribute=settings.region or None,
            parts=(parts := tuple(name.strip() for name in settings.parts.split(",") if name.strip())),
            gap=typed(settings.gap) if parts else 0.0,
        ),
        packing=Packing(
            pitch=described(settings.pitch_field, settings.pitch, False, "[packing] pitch"),
            edge_offset=typed(settings.edge_offset),
            orientation=(
                point_of(settings.rows_along)
                if settings.orientation == 'GIVEN'
                else settings.orientation.lower()
            ),
            integrator=settings.integrator.lower(),
            seed=settings.seed,
            iterations=settings.iterations,
            tolerance=typed(settings.tolerance),
        ),
        shaping=Shaping(
            diameter=diameter_of(settings),
            seeds=tuple(Seed(point_of(seed.at), typed(seed.diameter)) for seed in settings.seeds),
            solver=settings.solver.lower(),
            tolerance=typed(settings.shaping_tolerance),
            iterations=settings.shaping_iterations,
        ),
        feature=Feature(
            depth=None if through else typed(settings.depth),
            sides=settings.sides or None,
            tolerance=typed(settings.facet_tolerance) or None,
        ),
        limits=Limits(
            min_web=typed(settings.min_web),
            min_margin=typed(settings.min_margin),
            min_diameter=typed(settings.min_diameter),
        ),
    )
    check_recipe(recipe)
    return recipe


def diameter_of(settings: Any) -> Described:
    """The shaping metric: a size, or a share of the pitch."""
    if settings.diameter_mode == 'SHARE':
        return Fill(described(settings.diameter_field, settings.fill, True, "[shaping] fill"))
    return described(settings.diameter_field, settings.diameter, False, "[shaping] diameter")


def take_recipe(settings: Any, recipe: Recipe) -> None:
    """Set `settings` to what `recipe` says."""
    live, settings.live = settings.live, False  # one change after the other would lay a pattern each time
    settings.parts = ", ".join(recipe.region.parts)
    settings.gap = recipe.region.gap
    take_packing(settings, recipe.packing)
    take_shaping(settings, recipe.shaping)
    feature = recipe.feature
    settings.depth_mode = 'THROUGH' if feature.depth is None else 'BLIND'
    if feature.depth is not None:
        settings.depth = feature.depth
    settings.sides = feature.sides or 0
    settings.facet_tolerance = feature.tolerance or 0.0
    settings.min_web = recipe.limits.min_web
    settings.min_margin = recipe.limits.min_margin
    settings.min_diameter = recipe.limits.min_diameter
    settings.live = live


def take_packing(settings: Any, packing: Packing) -> None:
    """Set the settings of step 1."""
    if isinstance(packing.pitch, Constant):
        settings.pitch_field.kind = 'CONSTANT'
        settings.pitch = packing.pitch.value
    else:
        take(settings.pitch_field, packing.pitch, False)
    settings.edge_offset = packing.edge_offset
    if isinstance(packing.orientation, str):
        settings.orientation = packing.orientation.upper()
    else:
        settings.orientation = 'GIVEN'
        settings.rows_along = packing.orientation
    settings.integrator = packing.integrator.upper()
    settings.seed = packing.seed
    settings.iterations = packing.iterations
    settings.tolerance = packing.tolerance


def take_shaping(settings: Any, shaping: Shaping) -> None:
    """Set the settings of step 2."""
    share = isinstance(shaping.diameter, Fill)
    size = shaping.diameter.share if isinstance(shaping.diameter, Fill) else shaping.diameter
    settings.diameter_mode = 'SHARE' if share else 'SIZE'
    if isinstance(size, Constant):
        settings.diameter_field.kind = 'CONSTANT'
        setattr(settings, "fill" if share else "diameter", size.value)
    else:
        take(settings.diameter_field, size, share)
    settings.seeds.clear()
    for seed in shaping.seeds:
        entry = settings.seeds.add()
        entry.at, entry.diameter = seed.at, seed.diameter
    settings.solver = shaping.solver.upper()
    settings.shaping_tolerance = shaping.tolerance
    settings.shaping_iterations = shaping.iterations


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


CLASSES = (BubblePatternField, BubblePatternSeed, BubblePatternSettings)
_register, _unregister = bpy.utils.register_classes_factory(CLASSES)


def register() -> None:
    """Give every object its settings."""
    _register()
    bpy.types.Object.bubble_pattern = PointerProperty(type=BubblePatternSettings)


def unregister() -> None:
    """Take the settings back."""
    del bpy.types.Object.bubble_pattern
    _unregister()
