"""Scalar fields over the target region: the packing metric M_p and the shaping metric M_s are made of these.

A field comes in two steps. The recipe holds a `Described` field: plain values that compare equal, go to TOML
and back. Bound to its surroundings (the region, what is painted on the base, images, objects) it becomes a
`Field` that gives values at places. A number is one case (`Constant`); whatever takes a size takes a field.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

import numpy as np

from .mesh import Floats, Ints
from .toml_values import check_finite

if TYPE_CHECKING:
    from .surroundings import Surroundings

Bounds = tuple[float, float]


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


def end_to_end(parts: Sequence[Places]) -> Places:
    """Places one after the other."""
    return Places(
        *(
            np.concatenate([getattr(part, name) for part in parts])
            for name in ("position", "triangle", "barycentric")
        )
    )


class Field(Protocol):
    """A scalar field over the target region."""

    def __call__(self, places: Places) -> Floats:
        """Values at `places`, (n,)."""
        ...


class Described(ABC):
    """A field as a recipe describes it. Subclasses are frozen dataclasses, equal by value."""

    @abstractmethod
    def bind(self, surroundings: Surroundings) -> Field:
        """The field in these surroundings. FieldError where they lack what it asks for."""

    @abstractmethod
    def bounds(self) -> Bounds:
        """The least and the largest value that the field can take, wherever it is laid."""

    @abstractmethod
    def check(self, where: str) -> None:
        """RecipeError, which names the key by `where`, for a description that makes no sense."""

    def __call__(self, places: Places) -> Floats:
        """Values at `places`, (n,), of a field that needs no surroundings, such as a distance from points.

        FieldError for one that does.
        """
        from .surroundings import NOTHING

        return self.bind(NOTHING)(places)


@dataclass(frozen=True)
class Constant(Described):
    """The same value everywhere."""

    value: float

    def bind(self, surroundings: Surroundings) -> Field:
        """Itself."""
        return self

    def bounds(self) -> Bounds:
        """Its value, twice."""
        return self.value, self.value

    def check(self, where: str) -> None:
        """Any finite number is a value; whether it is a length, who uses it decides."""
        check_finite(self.value, where)

    def __call__(self, places: Places) -> Floats:
        """The value, (n,)."""
        return np.full(len(places), self.value, dtype=np.float64)


@dataclass(frozen=True)
class Bound(Described):
    """A field that has its surroundings, where a description is asked for; `field` is what was bound."""

    field: Field

    def bind(self, surroundings: Surroundings) -> Field:
        """The field, bound once and for all."""
        return self.field

    def bounds(self) -> Bounds:
        """Nothing is known of its values."""
        return -np.inf, np.inf

    def check(self, where: str) -> None:
        """Whatever was bound made sense."""

    def __call__(self, places: Places) -> Floats:
        """Values at `places`, (n,)."""
        return self.field(places)
