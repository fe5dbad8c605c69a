"""Units of length that files are in."""

from __future__ import annotations

from .errors import RecipeError
from .toml_values import check_above, nearest, number, show

# How many millimetres each is.
UNITS = {"um": 0.001, "mm": 1.0, "cm": 10.0, "m": 1000.0, "in": 25.4, "ft": 304.8}

Unit = str | float
"""A unit by its name in UNITS, or by its length in millimetres."""


def millimetres_in(unit: Unit) -> float:
    """How many millimetres the unit is long."""
    return UNITS[unit] if isinstance(unit, str) else unit


def unit_of(millimetres: float) -> Unit:
    """The unit of this length, by its name where it has one."""
    for name, length in UNITS.items():
        if abs(millimetres / length - 1) < 1e-6:
            return name
    return millimetres


def read_unit(value: object, where: str) -> Unit:
    """A unit in a recipe: its name, or how many millimetres it is long. RecipeError for what is none."""
    if not isinstance(value, str):
        length = number(value, where)
        check_above(length, where)
        return length
    if value not in UNITS:
        raise RecipeError(f"{where} = {show(value)} is no unit: {nearest(value, UNITS)}, or give millimetres")
    return value
