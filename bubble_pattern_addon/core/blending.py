"""Fields made of fields: products, limits, blends, one field for each part of the region."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from .errors import FieldError, RecipeError
from .mesh import Bools, Floats
from .metric import Bounds, Described, Field, Places
from .surroundings import Surroundings


@dataclass(frozen=True, kw_only=True)
class Combined(Described):
    """Several fields taken together at every place."""

    of: tuple[Described, ...]

    def check(self, where: str) -> None:
        """RecipeError unless there are two fields at least, each of which makes sense."""
        if len(self.of) < 2:
            raise RecipeError(f"{where}: of must have two fields or more")
        for number, part in enumerate(self.of, 1):
            part.check(f"{where}: of, field {number}")

    def together(self, surroundings: Surroundings, fold: Callable[[Floats, Floats], Floats]) -> Field:
        """The fields folded from the first to the last."""
        parts = [part.bind(surroundings) for part in self.of]

        def combined(places: Places) -> Floats:
            """The values (n,) of all fields at n places, folded."""
            result = parts[0](places)
            for part in parts[1:]:
                result = fold(result, part(places))
            return result

        return combined


@dataclass(frozen=True, kw_only=True)
class Product(Combined):
    """The fields multiplied."""

    def bind(self, surroundings: Surroundings) -> Field:
        """The product."""
        return self.together(surroundings, np.multiply)

    def bounds(self) -> Bounds:
        """The least and the largest product of values the fields can take."""
        low, high = self.of[0].bounds()
        for part in self.of[1:]:
            # 0 times without bounds is 0 here: the field that is 0 decides
            ends = [0.0 if 0.0 in (a, b) else a * b for a in (low, high) for b in part.bounds()]
            low, high = min(ends), max(ends)
        return low, high


@dataclass(frozen=True, kw_only=True)
class Least(Combined):
    """The least of the fields."""

    def bind(self, surroundings: Surroundings) -> Field:
        """The least."""
        return self.together(surroundings, np.minimum)

    def bounds(self) -> Bounds:
        """The least of the least and of the largest values."""
        lows, highs = zip(*(part.bounds() for part in self.of), strict=True)
        return min(lows), min(highs)


@dataclass(frozen=True, kw_only=True)
class Most(Combined):
    """The largest of the fields."""

    def bind(self, surroundings: Surroundings) -> Field:
        """The largest."""
        return self.together(surroundings, np.maximum)

    def bounds(self) -> Bounds:
        """The largest of the least and of the largest values."""
        lows, highs = zip(*(part.bounds() for part in self.of), strict=True)
        return max(lows), max(highs)


@dataclass(frozen=True, kw_only=True)
class Blend(Described):
    """`first` where the mask is 0, `second` where it is 1, and in proportion between; the mask is clamped."""

    first: Described
    second: Described
    mask: Described

    def bind(self, surroundings: Surroundings) -> Field:
        """The blend."""
        first, second, mask = (part.bind(surroundings) for part in (self.first, self.second, self.mask))

        def blend(places: Places) -> Floats:
            """Values (n,) at n places, the second field's by the share that the mask says."""
            share = np.clip(mask(places), 0.0, 1.0)
            return (1 - share) * first(places) + share * second(places)

        return blend

    def bounds(self) -> Bounds:
        """Those of the two fields together."""
        return _hull([self.first.bounds(), self.second.bounds()])

    def check(self, where: str) -> None:
        """RecipeError for a part that makes no sense."""
        self.first.check(f"{where}: first")
        self.second.check(f"{where}: second")
        self.mask.check(f"{where}: mask")


@dataclass(frozen=True, kw_only=True)
class FaceSet:
    """A sub-region and the field in it: the faces that carry a boolean or whole-numbered face attribute (with
    the value `equals`; without, any but 0), or a material.
    """

    value: Described
    attribute: str | None = None
    material: str | None = None
    equals: int | None = None

    def faces(self, surroundings: Surroundings) -> Bools:
        """Which triangles of the base belong to it, (T,)."""
        if self.material is not None:
            return np.asarray(surroundings.material(self.material), dtype=bool)
        assert self.attribute is not None  # check has seen to it
        values = surroundings.face_values(self.attribute)
        return np.asarray(values != 0 if self.equals is None else values == self.equals)

    def check(self, where: str) -> None:
        """RecipeError unless it names either an attribute or a material."""
        if (self.attribute is None) == (self.material is None):
            raise RecipeError(f"{where}: give either attribute or material")
        if self.material is not None and self.equals is not None:
            raise RecipeError(f"{where}: equals goes with attribute: leave it out")
        self.value.check(f"{where}: value")


@dataclass(frozen=True, kw_only=True)
class SubRegions(Described):
    """A field for each sub-region; where several lie over one another the first counts. otherwise: the field
    outside all of them.
    """

    sets: tuple[FaceSet, ...]
    otherwise: Described

    def bind(self, surroundings: Surroundings) -> Field:
        """The field, which asks each of its parts where that counts."""
        region = surroundings.target()
        part_of = np.full(len(region.base.triangles), len(self.sets))
        for number in reversed(range(len(self.sets))):
            faces = self.sets[number].faces(surroundings)
            if not faces[region.triangles].any():
                name = self.sets[number].attribute or self.sets[number].material
                raise FieldError(
                    f'sets: no face of the target region is in "{name}": give it some, or leave it out'
                )
            part_of[faces] = number
        fields = [part.value.bind(surroundings) for part in self.sets]
        fields.append(self.otherwise.bind(surroundings))

        def choose(places: Places) -> Floats:
            """Values (n,) at n places, each of the field of its sub-region."""
            number = part_of[places.triangle]
            result = np.empty(len(places))
            for at, field in enumerate(fields):
                here = np.flatnonzero(number == at)
                if len(here):
                    result[here] = field(
                        Places(places.position[here], places.triangle[here], places.barycentric[here])
                    )
            return result

        return choose

    def bounds(self) -> Bounds:
        """Those of all parts together."""
        return _hull([part.value.bounds() for part in self.sets] + [self.otherwise.bounds()])

    def check(self, where: str) -> None:
        """RecipeError where there is no set, or one that makes no sense."""
        if not self.sets:
            raise RecipeError(f"{where}: sets must have one sub-region at least")
        for number, part in enumerate(self.sets, 1):
            part.check(f"{where}: sets, sub-region {number}")
        self.otherwise.check(f"{where}: otherwise")


@dataclass(frozen=True)
class Fill(Described):
    """A share of the local pitch: for diameters that keep their proportion whatever the pitch does."""

    share: Described

    def bind(self, surroundings: Surroundings) -> Field:
        """The share times the pitch. FieldError where the surroundings have no pitch."""
        if surroundings.pitch is None:
            raise FieldError("fill is a share of the pitch, and there is no pitch here: give a size")
        share, pitch = self.share.bind(surroundings), surroundings.pitch
        return lambda places: share(places) * pitch(places)

    def bounds(self) -> Bounds:
        """Any length: all that is known is whether it can be one."""
        low, high = self.share.bounds()
        least = np.finfo(np.float64).tiny
        return (least if low > 0 else -np.inf), (-least if high < 0 else np.inf)

    def check(self, where: str) -> None:
        """RecipeError for a share that makes no sense."""
        self.share.check(where)


def _hull(bounds: list[Bounds]) -> Bounds:
    lows, highs = zip(*bounds, strict=True)
    return min(lows), max(highs)
