"""How long a millimetre is in the unit of the base: what drills, nozzles and densities are given in."""

from __future__ import annotations

from .errors import RecipeError
from .toml_values import check_above, nearest, number, show

MILLIMETRES = {"mm": 1.0, "cm": 10.0, "m": 1000.0, "in": 25.4, "ft": 304.8}

Unit = str | float
"""One of MILLIMETRES, or how many millimetres long the unit is."""


def millimetre(unit: Unit | None) -> float:
    """Length of a millimetre in the unit of the base; a base whose unit is not given is in millimetres."""
    if unit is None:
        return 1.0
    return 1.0 / (MILLIMETRES[unit] if isinstance(unit, str) else unit)


def unit_from_toml(value: object, where: str) -> Unit:
    """A unit's name or its length in millimetres. RecipeError for anything else."""
    return value if isinstance(value, str) else number(value, where)


def check_unit(unit: Unit, where: str) -> None:
    """RecipeError for a unit that nobody knows, or one without length."""
    if not isinstance(unit, str):
        check_above(unit, where)
    elif unit not in MILLIMETRES:
        advice = nearest(unit, MILLIMETRES, [show(name) for name in MILLIMETRES])
        raise RecipeError(f"{where} = {show(unit)} is not known: {advice}")
