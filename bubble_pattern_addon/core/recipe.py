"""The whole of a designer's choices as one dataclass tree, read from TOML and written to it.

A recipe is checked once, at the door: `load_recipe` and `recipe_from_dict` for files, `check_recipe` for a
recipe that was put together in a program, such as the panel's. Behind the door nobody checks again.

Lengths are in the unit of the base (metres inside Blender), angles in degrees.
"""

from __future__ import annotations

import math
import tomllib
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import Any

from .blending import Fill
from .errors import RecipeError
from .field_tables import asks_for_pitch, field_from_toml, field_to_toml
from .isometries import OFF, check_symmetry
from .metric import Constant, Described
from .toml_values import (
    Point,
    check_above,
    check_at_least,
    check_finite,
    check_one_of,
    flag,
    nearest,
    number,
    point,
    show,
    spell,
    text,
    texts,
    whole,
)

INTEGRATORS = ("fire", "rk4")
ORIENTATIONS = ("edge", "best")
SOLVERS = ("direct", "iterate")
KINDS = ("hole",)
FORMATS = ("stl", "obj", "ply", "3mf", "glb")

FILL = 0.6  # a feature's diameter relative to the pitch where the recipe gives only one of them
FEATURES_WISHED = 500  # how many features a recipe that gives no length at all aims at
NEAT = (1, 1.1, 1.2, 1.4, 1.6, 1.8, 2, 2.2, 2.5, 2.8, 3, 3.5, 4, 4.5, 5, 5.5, 6, 7, 8, 9, 10)


@dataclass(frozen=True)
class RegionChoice:
    """Which faces of the base are the target region: exactly one of near, attribute, material and all.

    parts: face attributes or materials whose faces are sub-regions with a first row of their own along their
    border (what none of them names is one more); gap: what stays free between neighbouring sub-regions
    """

    near: Point | None = None
    max_angle: float = 20.0
    attribute: str | None = None
    material: str | None = None
    all: bool = False
    parts: tuple[str, ...] = ()
    gap: float = 0.0


@dataclass(frozen=True)
class Packing:
    """Step 1. pitch is the packing metric: the distance of neighbouring centres.

    orientation: where the rows of the arrangement run, "edge" (along the longest straight stretch of the
    boundary), a vector, or "best" (several directions are tried)
    symmetry: "off"; "auto", whichever the region has; "x", "xy" and so on, mirrored at planes square to these
    axes of the base; "rotate 3" or "rotate 3 z", turned into itself by thirds about an axis (see
    core.isometries); symmetry_centre: a point of the planes or the axis, None for the region's own middle
    """

    pitch: Described = Constant(3.0)
    edge_offset: float = 0.0
    integrator: str = "fire"
    orientation: str | Point = "edge"
    seed: int = 0
    iterations: int = 60
    tolerance: float = 1e-3
    symmetry: str = OFF
    symmetry_centre: Point | None = None


@dataclass(frozen=True)
class Seed:
    """A feature whose diameter the designer fixes: the one nearest to the point `at`."""

    at: Point
    diameter: float


@dataclass(frozen=True)
class Shaping:
    """Step 2.

    diameter: the shaping metric, a size; as a share of the local pitch it is a Fill, in TOML the key fill
    seeds: where there are any, only these features have a size of their own, and every other one that they
    reach takes the average of its neighbours (see core.averaging)
    solver: of the averages: "direct", or "iterate" as the paper does, until no diameter changes by more than
    the share `tolerance` of it, at most `iterations` times
    """

    diameter: Described = Constant(1.8)
    seeds: tuple[Seed, ...] = ()
    solver: str = "direct"
    tolerance: float = 1e-6
    iterations: int = 10_000


@dataclass(frozen=True)
class Feature:
    """What one feature is. depth None: through the near wall; facets by chord height, at least min_sides."""

    kind: str = "hole"
    depth: float | None = None
    sides: int | None = None
    tolerance: float | None = None


@dataclass(frozen=True)
class Limits:
    """What holds after shaping, whatever the fields say (see core.limits).

    min_web: material between two features; min_margin: from a feature's edge to the region's boundary;
    min_diameter: a feature that would have to be smaller is left out
    """

    min_web: float = 0.0
    min_margin: float = 0.0
    min_diameter: float = 0.0


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
    if has_pitch and not {"diameter", "fill"} & set(shaping):
        size = Constant(_round(FILL * pitch.value)) if isinstance(pitch, Constant) else Fill(Constant(FILL))
        return replace(recipe, shaping=replace(recipe.shaping, diameter=size))
    if "diameter" in shaping and not has_pitch and isinstance(diameter, Constant):
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
                advice = nearest(section, READERS, [f"[{name}]" for name in READERS])
            raise RecipeError(f"Unknown table or key {show(section)} at the top of the recipe: {advice}")
        for key in table if isinstance(table, Mapping) else ():
            if key not in READERS[section]:
                elsewhere = home.get(key)
                advice = f"it belongs under [{elsewhere}]" if elsewhere else nearest(key, READERS[section])
                raise RecipeError(f"[{section}] has no key {show(key)}: {advice}")


# -- readers: the right type or a RecipeError that names the key ---------------------------------------------


def _orientation(value: object, where: str) -> str | Point:
    return point(value, where) if isinstance(value, list) else text(value, where)


def _fill(value: object, where: str) -> Fill:
    return Fill(field_from_toml(value, where))


def _seeds(value: object, where: str) -> tuple[Seed, ...]:
    if not isinstance(value, list) or not all(isinstance(entry, Mapping) for entry in value):
        raise RecipeError(
            f"{where} = {show(value)} must be a list of tables: [{{ at = [x, y, z], diameter = 2.5 }}, ...]"
        )
    return tuple(_seed(entry, f"{where}, seed {count}") for count, entry in enumerate(value, 1))


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
    },
    "packing": {
        "pitch": field_from_toml,
        "edge_offset": number,
        "orientation": _orientation,
        "integrator": text,
        "seed": whole,
        "iterations": whole,
        "tolerance": number,
        "symmetry": text,
        "symmetry_centre": point,
    },
    "shaping": {
        "diameter": field_from_toml,
        "fill": _fill,
        "seeds": _seeds,
        "solver": text,
        "tolerance": number,
        "iterations": whole,
    },
    "feature": {"kind": text, "depth": number, "sides": whole, "tolerance": number},
    "limits": {"min_web": number, "min_margin": number, "min_diameter": number},
    "output": {"blend": flag, "picture": flag, "formats": texts},
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
    check_at_least(choice.gap, 0, "[region] gap")
    if choice.gap and not choice.parts:
        raise RecipeError("[region] gap goes between parts: name these too, or leave gap out")


def check_recipe(recipe: Recipe) -> None:
    """RecipeError for a value out of its range, or for values that contradict one another.

    The region's choice is left to check_choice: a caller that holds the faces already needs none.
    """
    packing, feature, limits = recipe.packing, recipe.feature, recipe.limits
    _check_length(packing.pitch, "[packing] pitch")
    if asks_for_pitch(packing.pitch):
        raise RecipeError("[packing] pitch is given as a share of itself: fill goes with diameters")
    _check_shaping(recipe.shaping)
    if isinstance(packing.orientation, str):
        check_one_of(packing.orientation, ORIENTATIONS, "[packing] orientation")
    elif not any(packing.orientation):
        raise RecipeError("[packing] orientation = [0, 0, 0] is no direction: give a vector along the rows")
    check_one_of(packing.integrator, INTEGRATORS, "[packing] integrator")
    check_at_least(packing.seed, 0, "[packing] seed")
    check_at_least(packing.iterations, 1, "[packing] iterations")
    check_above(packing.tolerance, "[packing] tolerance")
    check_symmetry(packing.symmetry, "[packing] symmetry")
    for coordinate in packing.symmetry_centre or ():
        check_finite(coordinate, "[packing] symmetry_centre")
    check_one_of(feature.kind, KINDS, "[feature] kind")
    if feature.depth is not None:
        check_above(feature.depth, "[feature] depth")
    if feature.sides is not None:
        check_at_least(feature.sides, 3, "[feature] sides")
    if feature.tolerance is not None:
        check_above(feature.tolerance, "[feature] tolerance")
    check_at_least(limits.min_web, 0, "[limits] min_web")
    check_at_least(limits.min_margin, 0, "[limits] min_margin")
    check_at_least(limits.min_diameter, 0, "[limits] min_diameter")
    for name in recipe.output.formats:
        check_one_of(name, FORMATS, "[output] formats")
    _check_room(recipe)


def _check_length(described: Described, where: str) -> None:
    """RecipeError for a field that makes no sense or can become 0 or less; one without bounds is judged in
    place.
    """
    described.check(where)
    low, _ = described.bounds()
    if isinstance(described, Constant):
        check_above(low, where)
    elif math.isfinite(low) and low <= 0:
        raise RecipeError(f"{where} can become {low:g}: a field of lengths must stay above 0 everywhere")


def _check_shaping(shaping: Shaping) -> None:
    size = shaping.diameter
    if isinstance(size, Fill):
        _check_length(size.share, "[shaping] fill")
        _, most = size.share.bounds()
        if math.isfinite(most) and most >= 1:
            raise RecipeError(f"[shaping] fill can become {most:g}, which leaves no web: keep it below 1")
    else:
        _check_length(size, "[shaping] diameter")
    for count, seed in enumerate(shaping.seeds, 1):
        for coordinate in seed.at:
            check_finite(coordinate, f"[shaping] seeds, seed {count}: at")
        check_above(seed.diameter, f"[shaping] seeds, seed {count}: diameter")
    check_one_of(shaping.solver, SOLVERS, "[shaping] solver")
    check_above(shaping.tolerance, "[shaping] tolerance")
    check_at_least(shaping.iterations, 1, "[shaping] iterations")


def uniform_diameter(recipe: Recipe) -> float | None:
    """The diameter of all features where it is one and the same; None where it depends on the place."""
    pitch, size = recipe.packing.pitch, recipe.shaping.diameter
    if recipe.shaping.seeds:
        return None
    if isinstance(size, Fill):
        if isinstance(size.share, Constant) and isinstance(pitch, Constant):
            return size.share.value * pitch.value
        return None
    return size.value if isinstance(size, Constant) else None


def _check_room(recipe: Recipe) -> None:
    """Features must not touch their neighbours, nor cross the boundary. Graded ones are limited in place."""
    pitch, diameter = recipe.packing.pitch, uniform_diameter(recipe)
    offset = recipe.packing.edge_offset
    check_finite(offset, "[packing] edge_offset")
    if diameter is None:
        return
    if recipe.limits.min_diameter > diameter:
        raise RecipeError(
            "[limits] min_diameter = {least} is more than the diameter {diameter}, which leaves no feature: "
            "make it smaller",
            least=recipe.limits.min_diameter,
            diameter=diameter,
        )
    if not isinstance(pitch, Constant):
        return
    if diameter >= pitch.value:
        raise RecipeError(
            "[shaping] diameter = {diameter} leaves no web at pitch {pitch}: "
            "make the diameter smaller than the pitch",
            diameter=diameter,
            pitch=pitch.value,
        )
    margin = (pitch.value - diameter) / 2 + offset
    if margin < 0:
        raise RecipeError(
            "[packing] edge_offset = {offset} would push features {over} over the boundary: "
            "give at least {least}",
            offset=offset,
            over=-margin,
            least=(diameter - pitch.value) / 2,
        )
    web = pitch.value - diameter
    if recipe.limits.min_web > web:
        raise RecipeError(
            "[limits] min_web = {limit} is more than pitch - diameter = {web}: "
            "make the diameter at most {most}",
            limit=recipe.limits.min_web,
            web=web,
            most=pitch.value - recipe.limits.min_web,
        )


# -- to TOML -------------------------------------------------------------------------------------------------


def recipe_to_toml(recipe: Recipe) -> str:
    """The recipe as TOML text, every value written out: recipe_from_dict(tomllib.loads(text)) == recipe."""
    lines: list[str] = []
    for section in fields(recipe):
        table = getattr(recipe, section.name)
        lines += [f"[{section.name}]"]
        lines += [
            _line(entry.name, getattr(table, entry.name))
            for entry in fields(table)
            if getattr(table, entry.name) is not None
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
    return f"{key} = {spell(value)}"
