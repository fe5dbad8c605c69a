"""The whole of a designer's choices as one dataclass tree, read from TOML and written to it.

A recipe is checked once, at the door: `load_recipe` and `recipe_from_dict` for files, `check_recipe` for a
recipe that was put together in a program, such as the panel's. Behind the door nobody checks again.

Lengths are in the unit of the base (metres inside Blender), angles in degrees.
"""

from __future__ import annotations

import difflib
import json
import math
import tomllib
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import Any

from .errors import RecipeError
from .metric import Constant, Field

INTEGRATORS = ("fire", "rk4")
KINDS = ("hole",)
FORMATS = ("stl", "obj", "ply", "3mf", "glb")

FILL = 0.6  # a feature's diameter relative to the pitch where the recipe gives only one of them
FEATURES_WISHED = 500  # how many features a recipe that gives no length at all aims at
NEAT = (1, 1.1, 1.2, 1.4, 1.6, 1.8, 2, 2.2, 2.5, 2.8, 3, 3.5, 4, 4.5, 5, 5.5, 6, 7, 8, 9, 10)


@dataclass(frozen=True)
class RegionChoice:
    """Which faces of the base are the target region: exactly one of near, attribute, material and all."""

    near: tuple[float, float, float] | None = None
    max_angle: float = 20.0
    attribute: str | None = None
    material: str | None = None
    all: bool = False


@dataclass(frozen=True)
class Packing:
    """Step 1. pitch is the packing metric: the distance of neighbouring centres."""

    pitch: Field = Constant(3.0)
    edge_offset: float = 0.0
    integrator: str = "fire"
    seed: int = 0
    iterations: int = 60
    tolerance: float = 1e-3


@dataclass(frozen=True)
class Shaping:
    """Step 2. diameter is the shaping metric."""

    diameter: Field = Constant(1.8)


@dataclass(frozen=True)
class Feature:
    """What one feature is. depth None: through the near wall; facets by chord height, at least min_sides."""

    kind: str = "hole"
    depth: float | None = None
    sides: int | None = None
    tolerance: float | None = None


@dataclass(frozen=True)
class Limits:
    """What must remain: min_web between two features, min_margin from a feature's edge to the boundary."""

    min_web: float = 0.0
    min_margin: float = 0.0


@dataclass(frozen=True)
class Output:
    """What a batch run leaves behind besides features.csv, report.json and part.stl.

    formats: the part in these formats too (see FORMATS); blend: the base with the editable pattern as
    pattern.blend; picture: a rendered view of the part as part.png
    """

    blend: bool = False
    picture: bool = False
    formats: tuple[str, ...] = ()


@dataclass(frozen=True)
class Recipe:
    """Everything that makes one pattern."""

    region: RegionChoice = field(default_factory=RegionChoice)
    packing: Packing = field(default_factory=Packing)
    shaping: Shaping = field(default_factory=Shaping)
    feature: Feature = field(default_factory=Feature)
    limits: Limits = field(default_factory=Limits)
    output: Output = field(default_factory=Output)


# -- defaults from the size of the region ------------------------------------------------------------------


def neat(length: float) -> float:
    """The length nearest by ratio that a designer would have typed: 2.8, 3, 3.5, ... times a power of ten."""
    exponent = math.floor(math.log10(length))
    mantissa = min(NEAT, key=lambda m: abs(math.log(m * 10.0**exponent / length)))
    return float(f"{mantissa}e{exponent}")


def default_recipe(area: float, perimeter: float = 0.0, choice: RegionChoice | None = None) -> Recipe:
    """A good recipe for a target region of this area and with boundary loops of this length in all, both in
    the unit of the base; pitch and diameter are lengths in it.

    About 500 features, in a hexagonal arrangement where one bubble takes sqrt(3)/2 pitch^2 of the surface; a
    narrow strip, about 2 area / perimeter wide, gets at least three rows. The diameter is 0.6 of the pitch.
    The panel starts from this recipe, and a recipe file that leaves lengths out is filled up from it.
    """
    if not area > 0:
        return Recipe(region=choice or RegionChoice())
    pitch = math.sqrt(area / FEATURES_WISHED * 2 / math.sqrt(3))
    if perimeter > 0:
        # three rows touching both boundaries are 1 + sqrt(3) pitches wide
        pitch = min(pitch, 2 * area / perimeter / (1 + math.sqrt(3)))
    pitch = neat(pitch)
    return Recipe(
        region=choice or RegionChoice(),
        packing=Packing(pitch=Constant(pitch)),
        shaping=Shaping(diameter=Constant(_round(FILL * pitch))),
    )


# -- from TOML ---------------------------------------------------------------------------------------------


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
            raise RecipeError(f"{section.name} = {_show(table)} must be a table: write [{section.name}]")
        values = {
            key: READERS[section.name][key](value, f"[{section.name}] {key}") for key, value in table.items()
        }
        result = replace(result, **{section.name: replace(getattr(result, section.name), **values)})
    result = _proportioned(result, "pitch" in data.get("packing", {}), "diameter" in data.get("shaping", {}))
    check_choice(result.region)
    check_recipe(result)
    return result


def _proportioned(recipe: Recipe, has_pitch: bool, has_diameter: bool) -> Recipe:
    pitch, diameter = recipe.packing.pitch, recipe.shaping.diameter
    if has_pitch and not has_diameter and isinstance(pitch, Constant):
        return replace(recipe, shaping=replace(recipe.shaping, diameter=Constant(_round(FILL * pitch.value))))
    if has_diameter and not has_pitch and isinstance(diameter, Constant):
        return replace(recipe, packing=replace(recipe.packing, pitch=Constant(_round(diameter.value / FILL))))
    return recipe


def _round(value: float) -> float:
    return float(f"{value:.6g}")


def _refuse_unknown(data: Mapping[str, Any]) -> None:
    """RecipeError for a table or key that no recipe has, with the nearest one that it has."""
    home = {key: section for section, keys in READERS.items() for key in keys}
    for section, table in data.items():
        if section not in READERS:
            if section in home:
                advice = f"it belongs under [{home[section]}]"
            else:
                advice = _nearest(section, [f"[{name}]" for name in READERS], [*READERS])
            raise RecipeError(f"Unknown table or key {_show(section)} at the top of the recipe: {advice}")
        for key in table if isinstance(table, Mapping) else ():
            if key not in READERS[section]:
                known = [*READERS[section]]
                elsewhere = home.get(key)
                advice = f"it belongs under [{elsewhere}]" if elsewhere else _nearest(key, known, known)
                raise RecipeError(f"[{section}] has no key {_show(key)}: {advice}")


def _nearest(word: str, shown: list[str], known: list[str]) -> str:
    match = difflib.get_close_matches(word.lower(), known, 1, cutoff=0.5)
    return f"did you mean {shown[known.index(match[0])]}?" if match else f"known are {', '.join(shown)}"


def _show(value: object) -> str:
    """A value as it may stand in a message: in TOML's spelling, cut where it is long."""
    if isinstance(value, (bool, str)):
        text = json.dumps(value, ensure_ascii=False)
    elif isinstance(value, Mapping):
        text = "{...}"
    else:
        text = str(value)
    return text if len(text) <= 60 else text[:57] + "..."


# -- readers: the right type or a RecipeError that names the key ---------------------------------------------


def _number(value: object, where: str) -> float:
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise RecipeError(f"{where} = {_show(value)} must be a number")
    if not math.isfinite(value):
        raise RecipeError(f"{where} = {_show(value)} must be a finite number")
    return float(value)


def _whole(value: object, where: str) -> int:
    if isinstance(value, bool) or not isinstance(value, int):
        raise RecipeError(f"{where} = {_show(value)} must be a whole number")
    return value


def _text(value: object, where: str) -> str:
    if not isinstance(value, str) or not value:
        raise RecipeError(f'{where} = {_show(value)} must be a name in quotes, such as "Grille"')
    return value


def _flag(value: object, where: str) -> bool:
    if not isinstance(value, bool):
        raise RecipeError(f"{where} = {_show(value)} must be true or false")
    return value


def _point(value: object, where: str) -> tuple[float, float, float]:
    if not isinstance(value, list) or len(value) != 3:
        raise RecipeError(f"{where} = {_show(value)} must be a point, three numbers in brackets: [x, y, z]")
    x, y, z = (_number(coordinate, where) for coordinate in value)
    return x, y, z


def _texts(value: object, where: str) -> tuple[str, ...]:
    if not isinstance(value, list):
        raise RecipeError(f'{where} = {_show(value)} must be a list of names, such as ["3mf", "glb"]')
    return tuple(_text(item, where) for item in value)


def field_from_toml(value: object, where: str) -> Field:
    """The field that a recipe's value describes: a number is the same everywhere.

    where: how a message names the value, such as "[packing] pitch". Raises RecipeError for anything else.
    """
    return Constant(_number(value, where))


def field_to_toml(value: Field) -> str:
    """TOML's spelling of a field, such that field_from_toml gives the field again. TypeError where there is
    none.
    """
    if isinstance(value, Constant):
        return repr(float(value.value))
    raise TypeError(f"no TOML spelling for a field of type {type(value).__name__}")


READERS: dict[str, dict[str, Callable[[object, str], Any]]] = {
    "region": {"near": _point, "max_angle": _number, "attribute": _text, "material": _text, "all": _flag},
    "packing": {
        "pitch": field_from_toml,
        "edge_offset": _number,
        "integrator": _text,
        "seed": _whole,
        "iterations": _whole,
        "tolerance": _number,
    },
    "shaping": {"diameter": field_from_toml},
    "feature": {"kind": _text, "depth": _number, "sides": _whole, "tolerance": _number},
    "limits": {"min_web": _number, "min_margin": _number},
    "output": {"blend": _flag, "picture": _flag, "formats": _texts},
}


# -- values that make sense ----------------------------------------------------------------------------------


def check_choice(choice: RegionChoice) -> None:
    """RecipeError unless exactly one way of choosing the target region is used."""
    ways = [name for name in ("near", "attribute", "material") if getattr(choice, name) is not None]
    ways += ["all"] if choice.all else []
    if not ways:
        raise RecipeError(
            "[region] chooses no faces: give one of near = [x, y, z], attribute, material or all = true"
        )
    if len(ways) > 1:
        raise RecipeError(f"[region] chooses faces in {len(ways)} ways ({', '.join(ways)}): keep one of them")
    if not 0 <= choice.max_angle <= 180:
        raise RecipeError(f"[region] max_angle = {choice.max_angle:g} must be from 0 to 180 degrees")


def check_recipe(recipe: Recipe) -> None:
    """RecipeError for a value out of its range, or for values that contradict one another.

    The region's choice is left to check_choice: a caller that holds the faces already needs none.
    """
    packing, feature, limits = recipe.packing, recipe.feature, recipe.limits
    _above(packing.pitch, "[packing] pitch")
    _above(recipe.shaping.diameter, "[shaping] diameter")
    _one_of(packing.integrator, INTEGRATORS, "[packing] integrator")
    _at_least(packing.seed, 0, "[packing] seed")
    _at_least(packing.iterations, 1, "[packing] iterations")
    _above(packing.tolerance, "[packing] tolerance")
    _one_of(feature.kind, KINDS, "[feature] kind")
    if feature.depth is not None:
        _above(feature.depth, "[feature] depth")
    if feature.sides is not None:
        _at_least(feature.sides, 3, "[feature] sides")
    if feature.tolerance is not None:
        _above(feature.tolerance, "[feature] tolerance")
    _at_least(limits.min_web, 0, "[limits] min_web")
    _at_least(limits.min_margin, 0, "[limits] min_margin")
    for name in recipe.output.formats:
        _one_of(name, FORMATS, "[output] formats")
    _check_room(recipe)


def _check_room(recipe: Recipe) -> None:
    """Features must not touch their neighbours, nor cross the boundary. Graded fields are judged in place."""
    pitch, diameter = recipe.packing.pitch, recipe.shaping.diameter
    offset = recipe.packing.edge_offset
    if not math.isfinite(offset):
        raise RecipeError(f"[packing] edge_offset = {offset} must be a finite number")
    if not (isinstance(pitch, Constant) and isinstance(diameter, Constant)):
        return
    if diameter.value >= pitch.value:
        raise RecipeError(
            "[shaping] diameter = {diameter} leaves no web at pitch {pitch}: "
            "make the diameter smaller than the pitch",
            diameter=diameter.value,
            pitch=pitch.value,
        )
    margin = (pitch.value - diameter.value) / 2 + offset
    if margin < 0:
        raise RecipeError(
            "[packing] edge_offset = {offset} would push features {over} over the boundary: "
            "give at least {least}",
            offset=offset,
            over=-margin,
            least=(diameter.value - pitch.value) / 2,
        )
    web = pitch.value - diameter.value
    if recipe.limits.min_web > web:
        raise RecipeError(
            "[limits] min_web = {limit} is more than pitch - diameter = {web}: "
            "make the diameter at most {most}",
            limit=recipe.limits.min_web,
            web=web,
            most=pitch.value - recipe.limits.min_web,
        )


def _above(value: float | Field, where: str) -> None:
    number = value.value if isinstance(value, Constant) else value
    if isinstance(number, (int, float)) and not (math.isfinite(number) and number > 0):
        raise RecipeError(f"{where} = {number:g} must be a number above 0")


def _at_least(value: float, low: float, where: str) -> None:
    if not (math.isfinite(value) and value >= low):
        raise RecipeError(f"{where} = {value:g} must be at least {low:g}")


def _one_of(value: str, known: tuple[str, ...], where: str) -> None:
    if value not in known:
        raise RecipeError(
            f"{where} = {_show(value)} is not known: {_nearest(value, [_show(k) for k in known], [*known])}"
        )


# -- to TOML -------------------------------------------------------------------------------------------------


def recipe_to_toml(recipe: Recipe) -> str:
    """The recipe as TOML text, every value written out: recipe_from_dict(tomllib.loads(text)) == recipe."""
    lines: list[str] = []
    for section in fields(recipe):
        table = getattr(recipe, section.name)
        lines += [f"[{section.name}]"]
        lines += [
            f"{entry.name} = {_spell(getattr(table, entry.name))}"
            for entry in fields(table)
            if getattr(table, entry.name) is not None
        ]
        lines += [""]
    return "\n".join(lines)


def _spell(value: object) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, (int, float)):
        return repr(value)
    if isinstance(value, str):
        # TOML's basic strings are JSON's, but for DEL, which TOML wants escaped
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
    if isinstance(value, tuple):
        return "[" + ", ".join(_spell(item) for item in value) + "]"
    return field_to_toml(value)  # type: ignore[arg-type]
