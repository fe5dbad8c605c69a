"""A recipe in another unit of length: the same pattern on a base that is measured otherwise."""

from __future__ import annotations

from dataclasses import fields, replace
from typing import Any

from .blending import FaceSet, Fill, Product
from .falloff import Graded
from .metric import Constant, Described
from .recipe import Recipe, Seed
from .units import Unit, millimetres_in

# Keys whose numbers, points and fields are lengths; all other keys have no unit.
LENGTHS = {
    "region": ("near", "gap"),
    "packing": ("pitch", "edge_offset", "symmetry_centre"),
    "shaping": ("diameter", "seeds"),
    "feature": ("depth", "tolerance"),
    "limits": ("min_web", "min_margin", "min_diameter"),
    "output": (),
}
# The same of fields, besides their values, which are lengths where the field is one.
PLACES = {"start", "end", "centre", "near", "points", "lines", "inner", "radius", "distance", "width"}


def recipe_in(recipe: Recipe, unit: Unit, given: Unit) -> Recipe:
    """The recipe whose lengths are `given` in one unit, with its lengths in another: `unit`."""
    factor = millimetres_in(given) / millimetres_in(unit)
    return replace(scaled_recipe(recipe, factor), output=replace(recipe.output, unit=unit))


def scaled_recipe(recipe: Recipe, factor: float) -> Recipe:
    """The recipe that makes, on a base that is `factor` times as large, the same pattern as large."""
    if factor == 1:
        return recipe
    tables = {}
    for section, keys in LENGTHS.items():
        table = getattr(recipe, section)
        values: dict[str, Any] = {key: _scaled(getattr(table, key), factor, True) for key in keys}
        # fields that have no unit still have places
        values |= {
            entry.name: _scaled(getattr(table, entry.name), factor, False)
            for entry in fields(table)
            if entry.name not in keys and isinstance(getattr(table, entry.name), Described)
        }
        tables[section] = replace(table, **values)
    return replace(recipe, **tables)


def _scaled(value: Any, factor: float, is_length: bool) -> Any:
    """A value with its lengths multiplied: a number, points, seeds, or a field whose values are lengths or
    not.
    """
    if isinstance(value, float):
        # to twelve digits: 1.2 mm are 0.0012 m, not 0.0011999999999999999
        return float(f"{value * factor:.12g}") if is_length else value
    if isinstance(value, tuple):
        return tuple(_scaled(entry, factor, is_length) for entry in value)
    if isinstance(value, Seed):
        return Seed(_scaled(value.at, factor, True), _scaled(value.diameter, factor, True))
    if isinstance(value, (Described, FaceSet)):
        return _scaled_field(value, factor, is_length)
    return value


def _scaled_field(value: Any, factor: float, is_length: bool) -> Any:
    if isinstance(value, Constant):
        return Constant(_scaled(value.value, factor, is_length))
    if isinstance(value, Fill):
        return Fill(_scaled(value.share, factor, False))
    if isinstance(value, Product):
        # a length times shares
        first, *others = value.of
        return replace(
            value,
            of=(_scaled(first, factor, is_length), *(_scaled(other, factor, False) for other in others)),
        )
    parts = {}
    for entry in fields(value):
        content = getattr(value, entry.name)
        if entry.name in PLACES and not isinstance(content, str):
            parts[entry.name] = _scaled(content, factor, True)
        elif isinstance(value, Graded):
            if entry.name in ("from_", "to"):
                parts[entry.name] = _scaled(content, factor, is_length)
        elif entry.name == "mask":
            parts[entry.name] = _scaled(content, factor, False)
        elif isinstance(content, (Described, tuple)):
            parts[entry.name] = _scaled(content, factor, is_length)
    return replace(value, **parts)
