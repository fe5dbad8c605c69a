"""Fields made larger or smaller by one factor everywhere, and still of the kind that they were."""

from __future__ import annotations

from dataclasses import replace

from .blending import Blend, Combined, Fill, Product, SubRegions
from .falloff import Graded
from .metric import Constant, Described
from .recipe import Seed, Shaping

DIGITS = 6
"""Significant digits that scaled lengths keep: as many as single precision gives back as they were typed."""


def scaled(field: Described, factor: float) -> Described:
    """The field with all its values times `factor`, in the shape that the designer knows it in: a linear one
    stays linear, with other ends.
    """
    if isinstance(field, Constant):
        return Constant(_times(field.value, factor))
    if isinstance(field, Fill):
        return Fill(scaled(field.share, factor))
    if isinstance(field, Graded):
        return replace(field, from_=_times(field.from_, factor), to=_times(field.to, factor))
    if isinstance(field, Blend):
        return replace(field, first=scaled(field.first, factor), second=scaled(field.second, factor))
    if isinstance(field, SubRegions):
        sets = tuple(replace(part, value=scaled(part.value, factor)) for part in field.sets)
        return replace(field, sets=sets, otherwise=scaled(field.otherwise, factor))
    if isinstance(field, Product):
        first, *others = field.of
        return replace(field, of=(scaled(first, factor), *others))
    if isinstance(field, Combined):  # the least or the most of several
        return replace(field, of=tuple(scaled(part, factor) for part in field.of))
    return Product(of=(Constant(_times(1.0, factor)), field))


def scaled_sizes(shaping: Shaping, factor: float) -> Shaping:
    """The shaping with all sizes that it asks for times `factor`, those of seeds too."""
    return replace(
        shaping,
        diameter=scaled(shaping.diameter, factor),
        seeds=tuple(Seed(seed.at, _times(seed.diameter, factor)) for seed in shaping.seeds),
    )


def _times(value: float, factor: float) -> float:
    return float(f"{value * factor:.{DIGITS}g}")
