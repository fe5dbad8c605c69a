"""What a recipe asks for beside the region, by name, and under which other names its images go."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields, replace

from .feature_recipe import Feature
from .field_tables import Wanted, wanted, with_images
from .recipe import Recipe


def both(one: Wanted, other: Wanted) -> Wanted:
    """The names of both."""
    return Wanted(**{part.name: getattr(one, part.name) | getattr(other, part.name) for part in fields(one)})


def packing_names(recipe: Recipe) -> Wanted:
    """What the places of the bubbles depend on."""
    return wanted(recipe.packing.pitch)


def shaping_names(recipe: Recipe) -> Wanted:
    """What the sizes and the headings of the features depend on."""
    return both(wanted(recipe.shaping.diameter), feature_names(recipe.feature))


def feature_names(feature: Feature) -> Wanted:
    """What a feature's sizes and heading depend on."""
    vector = () if feature.turn_attribute is None else (feature.turn_attribute,)
    return replace(wanted(*feature.fields), vectors=frozenset(vector))


def recipe_names(recipe: Recipe) -> Wanted:
    """Everything that the recipe asks for."""
    return both(packing_names(recipe), shaping_names(recipe))


def with_recipe_images(recipe: Recipe, names: Mapping[str, str]) -> Recipe:
    """The same recipe with its images called by other names."""
    packing, shaping, feature = recipe.packing, recipe.shaping, recipe.feature
    return replace(
        recipe,
        packing=replace(packing, pitch=with_images(packing.pitch, names)),
        shaping=replace(shaping, diameter=with_images(shaping.diameter, names)),
        feature=feature.with_fields(lambda field: with_images(field, names)),
    )
