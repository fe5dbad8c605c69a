"""What a volume weighs."""

from __future__ import annotations


def mass(volume: float, density: float, millimetre: float) -> float:
    """Grams of a volume in the unit of the base cubed.

    density: in g/cm3; millimetre: its length in the unit of the base
    """
    return volume / millimetre**3 / 1000.0 * density
