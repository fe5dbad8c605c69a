"""Scalar fields over the target region: the packing metric M_p and the shaping metric M_s are made of these.

A number is one case of a field (`Constant`); whatever takes a size takes a field.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from .mesh import Floats, Ints


@dataclass(frozen=True)
class Places:
    """Places on the target region where a field is evaluated.

    position: (n, 3); triangle: (n,) index into the base's triangles; barycentric: (n, 3), rows summing to 1
    """

    position: Floats
    triangle: Ints
    barycentric: Floats

    def __len__(self) -> int:
        return len(self.position)


class Field(Protocol):
    """A scalar field over the target region."""

    def __call__(self, places: Places) -> Floats:
        """Values at `places`, (n,)."""
        ...


@dataclass(frozen=True)
class Constant:
    """The same value everywhere."""

    value: float

    def __call__(self, places: Places) -> Floats:
        return np.full(len(places), self.value)
