"""A recipe in another unit of length: the same pattern on a base that is measured otherwise."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

from .blending import FaceSet, Fill, Product
from .errors import RecipeError
from .falloff import Graded
from .metric import Constant, Described
from .recipe import KeepOut, Recipe, Seed
from .recipe_file import load_toml, recipe_from_dict
from .units import Unit, millimetres_in, read_unit, unit_of

Scale = Callable[[float], float]

# Keys whose numbers, points and fields are lengths; all other keys have no unit.
LENGTHS = {
    "region": ("near", "gap", "keep_out"),
    "packing": ("pitch", "edge_offset", "symmetry_centre", "pins"),
    "shaping": ("diameter", "seeds", "sizes"),
    "feature": ("depth", "height", "tolerance", "rim_size", "turn_point"),
    "limits": ("min_web", "min_margin", "min_diameter", "thickness"),
    "solve": (),
    "output": (),
}
# To so many digits: 1.2 mm are 0.0012 m, not 0.0011999999999999999.
DIGITS = 12
# The same of keep-outs.
AROUND = ("sphere", "cylinder", "box", "diameter", "size", "reach", "margin")
# The same of fields, besides their values, which are lengths where the field is one.
PLACES = {"start", "end", "centre", "near", "points", "lines", "inner", "radius", "distance", "width"}


def fitted_recipe(data: Mapping[str, Any], fitting: Recipe, millimetres: float | None) -> Recipe:
    """The recipe of these TOML tables in the unit of the base, of so many millimetres where that is known.

    fitting: what stands where the tables are silent, in the unit of the base. Where the tables do not say
    their unit, or the base does not, the lengths are taken as they are. RecipeError: see recipe_file.
    """
    output = data.get("output", {})
    if millimetres is None or not isinstance(output, Mapping):
        return recipe_from_dict(data, fitting)
    if "unit" not in output:
        recipe = recipe_from_dict(data, fitting)
        return replace(recipe, output=replace(recipe.output, unit=unit_of(millimetres)))
    given, unit = read_unit(output["unit"], "[output] unit"), unit_of(millimetres)
    return recipe_in(recipe_from_dict(data, recipe_in(fitting, given, unit, 17)), unit, given)


def load_fitted_recipe(path: Path, fitting: Recipe, millimetres: float | None) -> Recipe:
    """The recipe in a TOML file, see fitted_recipe. RecipeError names the file."""
    data = load_toml(path)
    try:
        return fitted_recipe(data, fitting, millimetres)
    except RecipeError as error:
        raise RecipeError(f"{path.name}: {error}") from None


def recipe_in(recipe: Recipe, unit: Unit, given: Unit, digits: int = DIGITS) -> Recipe:
    """The recipe whose lengths are `given` in one unit, with its lengths in another: `unit`."""
    factor = millimetres_in(given) / millimetres_in(unit)
    return replace(scaled_recipe(recipe, factor, digits), output=replace(recipe.output, unit=unit))


def scaled_recipe(recipe: Recipe, factor: float, digits: int = DIGITS) -> Recipe:
    """The recipe that makes, on a base that is `factor` times as large, the same pattern as large."""
    if factor == 1:
        return recipe

    def scale(length: float) -> float:
        """The length, so many times as large."""
        return float(f"{length * factor:.{digits}g}")

    tables = {}
    for section, keys in LENGTHS.items():
        table = getattr(recipe, section)
        values: dict[str, Any] = {key: _scaled(getattr(table, key), scale, True) for key in keys}
        # fields that have no unit still have places
        values |= {
            entry.name: _scaled(getattr(table, entry.name), scale, False)
            for entry in fields(table)
            if entry.name not in keys and isinstance(getattr(table, entry.name), Described)
        }
        tables[section] = replace(table, **values)
    return replace(recipe, **tables)


def _scaled(value: Any, scale: Scale, is_length: bool) -> Any:
    """A value with its lengths multiplied: a number, points, seeds, or a field whose values are lengths or
    not.
    """
    if isinstance(value, float):
        return scale(value) if is_length else value
    if isinstance(value, tuple):
        return tuple(_scaled(entry, scale, is_length) for entry in value)
    if isinstance(value, Seed):
        return Seed(_scaled(value.at, scale, True), _scaled(value.diameter, scale, True))
    if isinstance(value, KeepOut):
        return replace(value, **{key: _scaled(getattr(value, key), scale, True) for key in AROUND})
    if isinstance(value, (Described, FaceSet)):
        return _scaled_field(value, scale, is_length)
    return value


def _scaled_field(value: Any, scale: Scale, is_length: bool) -> Any:
    if isinstance(value, Constant):
        return Constant(_scaled(value.value, scale, is_length))
    if isinstance(value, Fill):
        return Fill(_scaled(value.share, scale, False))
    if isinstance(value, Product):
        # a length times shares
        first, *others = value.of
        return replace(
            value,
            of=(_scaled(first, scale, is_length), *(_scaled(other, scale, False) for other in others)),
        )
    parts = {}
    for entry in fields(value):
        content = getattr(value, entry.name)
        if entry.name in PLACES and not isinstance(content, str):
            parts[entry.name] = _scaled(content, scale, True)
        elif isinstance(value, Graded):
            if entry.name in ("from_", "to"):
                parts[entry.name] = _scaled(content, scale, is_length)
        elif entry.name == "mask":
            parts[entry.name] = _scaled(content, scale, False)
        elif isinstance(content, (Described, tuple)):
            parts[entry.name] = _scaled(content, scale, is_length)
    return replace(value, **parts)
