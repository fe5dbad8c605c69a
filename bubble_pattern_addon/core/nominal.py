"""Nominal sizes: features of the diameters that a shop has tools for, each the nearest smaller one.

Named series, in millimetres:

- "drills 0.1", "drills 0.5", "drills 1": twist drills in steps of 0.1 mm (0.2 to 14), 0.5 mm (0.5 to 25) and
  1 mm (1 to 50), as DIN 338 and ISO 235 have them.
- "tap drills": the holes of metric coarse threads M1 to M24 before tapping, after ISO 2306.
- "R10", "R20": the preferred numbers of ISO 3, ten or twenty to a decade, 0.1 to 100; for tools made to order
  and for steps that look even.
"""

from __future__ import annotations

import numpy as np

from .errors import RecipeError
from .mesh import Floats
from .toml_values import check_above, check_one_of, number, show

Sizes = tuple[float, ...] | str
"""Diameters in the unit of the base, or the name of a series."""

_R10 = (1.0, 1.25, 1.6, 2.0, 2.5, 3.15, 4.0, 5.0, 6.3, 8.0)
_R20 = (
    1.0,
    1.12,
    1.25,
    1.4,
    1.6,
    1.8,
    2.0,
    2.24,
    2.5,
    2.8,
    3.15,
    3.55,
    4.0,
    4.5,
    5.0,
    5.6,
    6.3,
    7.1,
    8.0,
    9.0,
)
_TAP_DRILLS: tuple[float, ...] = (
    0.75,
    0.85,
    0.95,
    1.1,
    1.25,
    1.45,
    1.6,
    1.75,
    2.05,
    2.5,
    2.9,
    3.3,
    3.7,
    4.2,
    5.0,
    6.0,
    6.8,
    7.8,
)
_TAP_DRILLS += (8.5, 9.5, 10.2, 12.0, 14.0, 15.5, 17.5, 19.5, 21.0)


def _steps(step: float, first: int, last: int) -> tuple[float, ...]:
    return tuple(round(step * count, 3) for count in range(first, last + 1))


def _decades(numbers: tuple[float, ...]) -> tuple[float, ...]:
    return tuple(float(f"{one * ten:.4g}") for ten in (0.1, 1.0, 10.0) for one in numbers) + (100.0,)


SERIES: dict[str, tuple[float, ...]] = {
    "drills 0.1": _steps(0.1, 2, 140),
    "drills 0.5": _steps(0.5, 1, 50),
    "drills 1": _steps(1.0, 1, 50),
    "tap drills": _TAP_DRILLS,
    "R10": _decades(_R10),
    "R20": _decades(_R20),
}

# A diameter short of a nominal size by this share is meant to be of that size: what rounding costs.
SAME = 1e-7


def nominal_sizes(sizes: Sizes | None, millimetre: float) -> Floats | None:
    """The diameters to choose from in the unit of the base, rising; None where every one will do.

    millimetre: its length in the unit of the base
    """
    if sizes is None:
        return None
    lengths = np.array(SERIES[sizes]) * millimetre if isinstance(sizes, str) else np.array(sizes, dtype=float)
    return np.unique(lengths)


def snapped(diameter: Floats, sizes: Floats) -> Floats:
    """For every diameter (n,) the nearest of the `sizes` (k,), rising, that is not larger; 0 for those below
    the smallest.
    """
    below = np.searchsorted(sizes, diameter * (1 + SAME), side="right")
    return np.where(below > 0, sizes[below - 1], 0.0)


def next_above(lengths: Floats, sizes: Floats) -> Floats:
    """For every length (n,) the nearest of the `sizes` (k,), rising, that is not smaller; inf above all."""
    above = np.searchsorted(sizes, lengths * (1 - SAME), side="left")
    return np.append(sizes, np.inf)[above]


def sizes_from_toml(value: object, where: str) -> Sizes:
    """A series' name or a list of diameters. RecipeError for anything else."""
    if isinstance(value, str):
        return value
    if not isinstance(value, list) or not value:
        raise RecipeError(
            f"{where} = {show(value)} must be a list of diameters, or the name of a series such as "
            '"drills 0.5"'
        )
    return tuple(number(size, where) for size in value)


def check_sizes(sizes: Sizes, where: str) -> None:
    """RecipeError for a series that nobody knows, or a diameter that is no length."""
    if isinstance(sizes, str):
        check_one_of(sizes, tuple(SERIES), where)
    else:
        for size in sizes:
            check_above(size, where)
