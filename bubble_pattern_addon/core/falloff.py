"""Falloffs: how a field goes from one value to the other."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from .errors import RecipeError
from .mesh import Floats
from .metric import Bounds, Described, Field, Places
from .surroundings import Surroundings
from .toml_values import check_finite, check_one_of

Shape = Callable[[Floats], Floats]

# Blender's own, as in proportional editing, over the share of the way
SHAPES: Mapping[str, Shape] = {
    "linear": lambda t: t,
    "smooth": lambda t: t * t * (3 - 2 * t),
    "sphere": lambda t: np.sqrt(t * (2 - t)),
    "root": np.sqrt,
    "sharp": lambda t: t * t,
}
FALLOFFS = (*SHAPES, "curve")


@dataclass(frozen=True, kw_only=True)
class Graded(Described):
    """A field that goes from one value to another, over a share t of the way that each kind measures.

    The value is from_ + (to - from_) * f(t), with the falloff f: [0, 1] -> [0, 1].

    from_, to: the values at t = 0 and t = 1
    falloff: one of FALLOFFS
    curve: for the falloff "curve": control points (t, f), t from 0 to 1 and rising; between them a monotone
    cubic (scipy's PchipInterpolator, after Fritsch and Carlson, 1980), which never leaves the range of f
    invert: the way is gone backwards: 1 - t takes the place of t
    clamp: the value stays that of the end beyond it; without, a linear falloff goes on
    """

    from_: float
    to: float
    falloff: str = "linear"
    curve: tuple[tuple[float, float], ...] = ()
    invert: bool = False
    clamp: bool = True

    @abstractmethod
    def share(self, surroundings: Surroundings) -> Field:
        """The share of the way t at places, 0 where it starts and 1 where it ends. FieldError as in bind."""

    def bind(self, surroundings: Surroundings) -> Field:
        """The field in these surroundings. FieldError where they lack what it asks for."""
        share, shape = self.share(surroundings), self.shape()

        def graded(places: Places) -> Floats:
            """Values (n,) at n places, between from_ and to."""
            return self.from_ + (self.to - self.from_) * shape(share(places))

        return graded

    def shape(self) -> Shape:
        """What becomes of t: clamped, inverted, through the falloff."""
        falloff = _through(self.curve) if self.falloff == "curve" else SHAPES[self.falloff]

        def shape(t: Floats) -> Floats:
            """What becomes of shares (n,)."""
            t = np.clip(t, 0.0, 1.0) if self.clamp else t
            return falloff(1 - t if self.invert else t)

        return shape

    def bounds(self) -> Bounds:
        """The least and the largest value."""
        if not self.clamp and self.from_ != self.to:
            return -np.inf, np.inf
        heights = [y for _, y in self.curve] if self.falloff == "curve" else [0.0, 1.0]
        ends = [self.from_ + (self.to - self.from_) * y for y in heights]
        return min(ends), max(ends)

    def check(self, where: str) -> None:
        """RecipeError for a falloff that is none, or a curve that does not rise along t."""
        check_finite(self.from_, f"{where}: from")
        check_finite(self.to, f"{where}: to")
        check_one_of(self.falloff, FALLOFFS, f"{where}: falloff")
        if self.curve and self.falloff != "curve":
            raise RecipeError(f'{where}: a curve goes with falloff = "curve": leave one of the two out')
        if not self.clamp and self.falloff != "linear":
            raise RecipeError(
                f'{where}: clamp = false goes with falloff = "linear" only, for "{self.falloff}" ends at the '
                "ends: leave clamp out"
            )
        if self.falloff == "curve":
            points = np.array(self.curve, dtype=np.float64).reshape(-1, 2)
            t = points[:, 0]
            if len(t) < 2 or not np.isfinite(points).all() or (np.diff(t) <= 0).any():
                raise RecipeError(
                    f"{where}: curve must have two control points [t, f] or more, t rising from one to the "
                    "next"
                )
            if t[0] < 0 or t[-1] > 1:
                raise RecipeError(f"{where}: curve must have its control points [t, f] at t from 0 to 1")


def _through(curve: tuple[tuple[float, float], ...]) -> Shape:
    from scipy.interpolate import PchipInterpolator  # here, so that a recipe can be read without scipy

    t, height = np.array(curve).T
    between = PchipInterpolator(t, height)
    return lambda share: between(np.clip(share, t[0], t[-1]))
