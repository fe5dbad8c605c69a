"""Values of a recipe file: read as the right type or refused by a RecipeError that names the key; and
written.
"""

from __future__ import annotations

import difflib
import json
import math
from collections.abc import Iterable, Mapping, Sequence

from .errors import RecipeError

Point = tuple[float, float, float]


def show(value: object) -> str:
    """A value as it may stand in a message: in TOML's spelling, cut where it is long."""
    if isinstance(value, (bool, str)):
        text = json.dumps(value, ensure_ascii=False)
    elif isinstance(value, Mapping):
        text = "{...}"
    else:
        text = str(value)
    return text if len(text) <= 60 else text[:57] + "..."


def nearest(word: str, known: Iterable[str], shown: Sequence[str] | None = None) -> str:
    """What to write instead of `word`: the nearest of the `known` names (as `shown`), or all of them."""
    known = [*known]
    shown = known if shown is None else shown
    match = difflib.get_close_matches(word.lower(), known, 1, cutoff=0.5)
    return f"did you mean {shown[known.index(match[0])]}?" if match else f"known are {', '.join(shown)}"


# -- readers -------------------------------------------------------------------------------------------------


def number(value: object, where: str) -> float:
    """A finite number."""
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise RecipeError(f"{where} = {show(value)} must be a number")
    if not math.isfinite(value):
        raise RecipeError(f"{where} = {show(value)} must be a finite number")
    return float(value)


def whole(value: object, where: str) -> int:
    """A whole number."""
    if isinstance(value, bool) or not isinstance(value, int):
        raise RecipeError(f"{where} = {show(value)} must be a whole number")
    return value


def text(value: object, where: str) -> str:
    """A name, not empty."""
    if not isinstance(value, str) or not value:
        raise RecipeError(f'{where} = {show(value)} must be a name in quotes, such as "Grille"')
    return value


def flag(value: object, where: str) -> bool:
    """true or false."""
    if not isinstance(value, bool):
        raise RecipeError(f"{where} = {show(value)} must be true or false")
    return value


def point(value: object, where: str) -> Point:
    """Three numbers."""
    if not isinstance(value, list) or len(value) != 3:
        raise RecipeError(f"{where} = {show(value)} must be a point, three numbers in brackets: [x, y, z]")
    x, y, z = (number(coordinate, where) for coordinate in value)
    return x, y, z


def points(value: object, where: str) -> tuple[Point, ...]:
    """Points, at least one."""
    if not isinstance(value, list) or not value:
        raise RecipeError(f"{where} = {show(value)} must be a list of points: [[x, y, z], ...]")
    return tuple(point(entry, where) for entry in value)


def polylines(value: object, where: str) -> tuple[tuple[Point, ...], ...]:
    """Polylines of two points or more, at least one polyline."""
    advice = "must be a list of lines, each of two points or more: [[[x, y, z], [x, y, z]], ...]"
    if not isinstance(value, list) or not value:
        raise RecipeError(f"{where} = {show(value)} {advice}")
    lines = tuple(points(entry, where) for entry in value)
    if min(len(line) for line in lines) < 2:
        raise RecipeError(f"{where} = {show(value)} {advice}")
    return lines


def pairs(value: object, where: str) -> tuple[tuple[float, float], ...]:
    """Pairs of numbers."""
    if not isinstance(value, list) or any(not isinstance(p, list) or len(p) != 2 for p in value):
        raise RecipeError(f"{where} = {show(value)} must be a list of pairs: [[x, y], [x, y], ...]")
    return tuple((number(x, where), number(y, where)) for x, y in value)


def texts(value: object, where: str) -> tuple[str, ...]:
    """Names."""
    if not isinstance(value, list):
        raise RecipeError(f'{where} = {show(value)} must be a list of names, such as ["3mf", "glb"]')
    return tuple(text(item, where) for item in value)


# -- values that make sense ----------------------------------------------------------------------------------


def check_finite(value: float, where: str) -> None:
    """RecipeError unless `value` is a finite number."""
    if not math.isfinite(value):
        raise RecipeError(f"{where} = {value} must be a finite number")


def check_above(value: float, where: str) -> None:
    """RecipeError unless `value` is a finite number above 0."""
    if not (math.isfinite(value) and value > 0):
        raise RecipeError(f"{where} = {value:g} must be a number above 0")


def check_at_least(value: float, low: float, where: str) -> None:
    """RecipeError unless `value` is a finite number and at least `low`."""
    if not (math.isfinite(value) and value >= low):
        raise RecipeError(f"{where} = {value:g} must be at least {low:g}")


def check_one_of(value: str, known: Sequence[str], where: str) -> None:
    """RecipeError unless `value` is one of the `known` words."""
    if value not in known:
        advice = nearest(value, known, [show(word) for word in known])
        raise RecipeError(f"{where} = {show(value)} is not known: {advice}")


# -- written -------------------------------------------------------------------------------------------------


def spell(value: object) -> str:
    """TOML's spelling of a value: what the readers take."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, (int, float)):
        return repr(value)
    if isinstance(value, str):
        # TOML's basic strings are JSON's, but for DEL, which TOML wants escaped
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
    if isinstance(value, (tuple, list)):
        return "[" + ", ".join(spell(item) for item in value) + "]"
    if isinstance(value, Mapping):
        return "{ " + ", ".join(f"{key} = {spell(entry)}" for key, entry in value.items()) + " }"
    raise TypeError(f"no TOML spelling for a {type(value).__name__}")
