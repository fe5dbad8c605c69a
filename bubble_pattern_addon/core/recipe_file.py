"""Recipes as TOML: read with the key named in every complaint, and written out whole."""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Mapping
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

from .blending import Fill
from .errors import RecipeError
from .feature_recipe import READERS as FEATURE_READERS
from .field_tables import field_from_toml, field_to_toml
from .metric import Constant, Described
from .nominal import sizes_from_toml
from .recipe import FILL, KeepOut, Recipe, Seed, rounded
from .recipe_checks import check_choice, check_recipe
from .toml_values import Point, flag, nearest, number, point, points, show, spell, text, texts, whole
from .units import read_unit


def load_toml(path: Path) -> dict[str, Any]:
    """The tables of a recipe file. RecipeError: file missing or unreadable, not TOML (with line)."""
    try:
        return tomllib.loads(path.read_bytes().decode("utf-8"))
    except FileNotFoundError:
        raise RecipeError(f"Recipe {path} does not exist: check the path") from None
    except OSError as error:
        raise RecipeError(f"Recipe {path} can't be read: {error.strerror}") from None
    except UnicodeDecodeError as error:
        raise RecipeError(
            f"Recipe {path} is no text in UTF-8 (byte {error.start}): save it as UTF-8"
        ) from None
    except tomllib.TOMLDecodeError as error:
        raise RecipeError(f"Recipe {path} is not valid TOML: {error}") from None


def load_recipe(path: Path, defaults: Recipe | None = None) -> Recipe:
    """The recipe in a TOML file; see recipe_from_dict. RecipeError names the file."""
    data = load_toml(path)
    try:
        return recipe_from_dict(data, defaults)
    except RecipeError as error:
        raise RecipeError(f"{path.name}: {error}") from None


def recipe_from_dict(data: Mapping[str, Any], defaults: Recipe | None = None) -> Recipe:
    """The recipe that these TOML tables describe, checked.

    Where the tables are silent, `defaults` speaks. Pitch and diameter depend on the size of the region, so a
    caller that knows it gives `default_recipe(area)`; if only one of the two is given, the other keeps the
    proportion diameter = 0.6 pitch.
    """
    result = defaults or Recipe()
    _refuse_unknown(data)
    for section in fields(Recipe):
        table = data.get(section.name, {})
        if not isinstance(table, Mapping):
            raise RecipeError(f"{section.name} = {show(table)} must be a table: write [{section.name}]")
        values = {
            key: READERS[section.name][key](value, f"[{section.name}] {key}") for key, value in table.items()
        }
        if "fill" in values:
            if "diameter" in values:
                raise RecipeError("[shaping] gives both diameter and fill: keep one of them")
            values["diameter"] = values.pop("fill")
        result = replace(result, **{section.name: replace(getattr(result, section.name), **values)})
    result = _proportioned(result, "pitch" in data.get("packing", {}), data.get("shaping", {}))
    check_choice(result.region)
    check_recipe(result)
    return result


def _proportioned(recipe: Recipe, has_pitch: bool, shaping: Mapping[str, Any]) -> Recipe:
    pitch, diameter = recipe.packing.pitch, recipe.shaping.diameter
    sized = {"diameter", "fill"} & set(shaping)
    if recipe.solve.count is not None and not sized:
        # the pitch will be another one
        return replace(recipe, shaping=replace(recipe.shaping, diameter=Fill(Constant(FILL))))
    if has_pitch and not sized:
        size = Constant(rounded(FILL * pitch.value)) if isinstance(pitch, Constant) else Fill(Constant(FILL))
        return replace(recipe, shaping=replace(recipe.shaping, diameter=size))
    if "diameter" in shaping and not has_pitch and isinstance(diameter, Constant):
        return replace(
            recipe, packing=replace(recipe.packing, pitch=Constant(rounded(diameter.value / FILL)))
        )
    return recipe


def _refuse_unknown(data: Mapping[str, Any]) -> None:
    """RecipeError for a table or key that no recipe has, with the nearest one that it has."""
    home = {key: section for section, keys in READERS.items() for key in keys}
    for section, table in data.items():
        if section not in READERS:
            if section in home:
                advice = f"it belongs under [{home[section]}]"
            else:
                advice = nearest(section, READERS, [f"[{name}]" for name in READERS])
            raise RecipeError(f"Unknown table or key {show(section)} at the top of the recipe: {advice}")
        for key in table if isinstance(table, Mapping) else ():
            if key not in READERS[section]:
                elsewhere = home.get(key)
                advice = f"it belongs under [{elsewhere}]" if elsewhere else nearest(key, READERS[section])
                raise RecipeError(f"[{section}] has no key {show(key)}: {advice}")


# -- readers: the right type or a RecipeError that names the key ---------------------------------------------


def _word_or_vector(value: object, where: str) -> str | Point:
    return point(value, where) if isinstance(value, list) else text(value, where)


def _points(value: object, where: str) -> tuple[Point, ...]:
    return points(value, where) if value != [] else ()


def _fill(value: object, where: str) -> Fill:
    return Fill(field_from_toml(value, where))


def _seeds(value: object, where: str) -> tuple[Seed, ...]:
    tables = _tables(value, where, "{ at = [x, y, z], diameter = 2.5 }")
    return tuple(_seed(entry, f"{where}, seed {count}") for count, entry in enumerate(tables, 1))


def _tables(value: object, where: str, example: str) -> list[Mapping[str, object]]:
    if not isinstance(value, list) or not all(isinstance(entry, Mapping) for entry in value):
        raise RecipeError(f"{where} = {show(value)} must be a list of tables: [{example}, ...]")
    return value


def _keep_outs(value: object, where: str) -> tuple[KeepOut, ...]:
    tables = _tables(value, where, "{ sphere = [x, y, z], diameter = 8.0, margin = 1.0 }")
    return tuple(_keep_out(entry, f"{where}, entry {count}") for count, entry in enumerate(tables, 1))


def _keep_out(table: Mapping[str, object], where: str) -> KeepOut:
    readers: dict[str, Callable[[object, str], Any]] = (
        dict.fromkeys(("faces", "object", "collection", "file"), text)
        | dict.fromkeys(("sphere", "cylinder", "box", "size", "axis", "along"), point)
        | dict.fromkeys(("diameter", "reach", "margin"), number)
    )
    for key in table:
        if key not in readers:
            raise RecipeError(f"{where} has no key {show(key)}: {nearest(key, readers)}")
    return KeepOut(**{key: readers[key](entry, f"{where}: {key}") for key, entry in table.items()})


def _seed(table: Mapping[str, object], where: str) -> Seed:
    readers: dict[str, Callable[[object, str], Any]] = {"at": point, "diameter": number}
    for key in table:
        if key not in readers:
            raise RecipeError(f"{where} has no key {show(key)}: {nearest(key, readers)}")
    for key in readers:
        if key not in table:
            raise RecipeError(f"{where} lacks {key}: give it")
    return Seed(**{key: readers[key](entry, f"{where}: {key}") for key, entry in table.items()})


READERS: dict[str, dict[str, Callable[[object, str], Any]]] = {
    "region": {
        "near": point,
        "max_angle": number,
        "attribute": text,
        "material": text,
        "all": flag,
        "parts": texts,
        "gap": number,
        "keep_out": _keep_outs,
    },
    "packing": {
        "pitch": field_from_toml,
        "edge_offset": number,
        "orientation": _word_or_vector,
        "integrator": text,
        "seed": whole,
        "iterations": whole,
        "tolerance": number,
        "symmetry": text,
        "symmetry_centre": point,
        "pins": _points,
    },
    "shaping": {
        "diameter": field_from_toml,
        "fill": _fill,
        "seeds": _seeds,
        "solver": text,
        "tolerance": number,
        "iterations": whole,
        "sizes": sizes_from_toml,
    },
    "feature": FEATURE_READERS,
    "limits": {
        **dict.fromkeys(("min_web", "min_margin", "min_diameter", "thickness"), number),
        "process": text,
        "check_only": flag,
    },
    "solve": {"open_area": number, "count": whole, "by": text},
    "output": {
        "blend": flag,
        "picture": flag,
        "formats": texts,
        "density": number,
        "drawings": texts,
        "projection": _word_or_vector,
        "align": text,
        "unit": read_unit,
    },
}


# -- to TOML -------------------------------------------------------------------------------------------------


def recipe_to_toml(recipe: Recipe) -> str:
    """The recipe as TOML text, every value written out: recipe_from_dict(tomllib.loads(text)) == recipe."""
    lines: list[str] = []
    for section in fields(recipe):
        table = getattr(recipe, section.name)
        if section.name == "solve" and not table:
            continue
        lines += [f"[{section.name}]"]
        lines += [
            _line(entry.name, getattr(table, entry.name))
            for entry in fields(table)
            if getattr(table, entry.name) is not None
            and (getattr(table, entry.name) or entry.name != "points")
        ]
        lines += [""]
    return "\n".join(lines)


def _line(key: str, value: object) -> str:
    if key == "diameter" and isinstance(value, Fill):
        return f"fill = {field_to_toml(value.share)}"
    if isinstance(value, Described):
        return f"{key} = {field_to_toml(value)}"
    if key == "seeds":
        assert isinstance(value, tuple)
        return f"seeds = {spell([{'at': seed.at, 'diameter': seed.diameter} for seed in value])}"
    if key == "keep_out":
        assert isinstance(value, tuple)
        given = [{k: v for k, v in vars(entry).items() if v is not None} for entry in value]
        return f"keep_out = {spell(given)}"
    return f"{key} = {spell(value)}"
