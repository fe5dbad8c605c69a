"""Patterns with different features on one base: one kind after the other, and a part that knows of all."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from .feature_recipe import Feature
from .mesh import Mesh
from .part import Part
from .pattern import Pattern
from .plan import Plan
from .progress import Steps, within
from .solid import part_steps


@dataclass(frozen=True)
class Layer:
    """A pattern and what its features are; stamp: the mesh that a feature with the profile "mesh" names."""

    pattern: Pattern
    feature: Feature
    stamp: Mesh | None = None


def layered_steps(
    base: Mesh, layers: Sequence[Layer], apart: Callable[[Plan], bool] | None = None
) -> Steps[Part]:
    """Add the features of all layers, at least one, to `base`, each layer to what those before it left; a
    generator of Progress that returns the Part.

    Features are numbered through all layers, those of the first one first. Those of a later layer that an
    earlier one has taken the ground from are reported as left out. Raises like solid.part_steps, which says
    what `apart` is.
    """
    part: Part | None = None
    for number, layer in enumerate(layers):
        ground = base if part is None else part.mesh
        steps = part_steps(ground, layer.pattern, layer.feature, layer.stamp, apart)
        added = yield from within(steps, number / len(layers), (number + 1) / len(layers))
        part = added if part is None else onto(part, added)
    assert part is not None
    return part


def onto(first: Part, second: Part) -> Part:
    """The part `second`, made on the part `first`, as one made on the base of the first."""
    count = len(first.thickness)
    below = second.source >= 0
    at = np.where(below, second.source, 0)
    source = np.where(below, first.source[at], second.source - count)
    facets = int(first.facet.max(initial=-1)) + 1
    facet = np.where(below, first.facet[at], second.facet + facets)
    known = second.vertex >= 0
    vertex = np.where(known, first.vertex[np.where(known, second.vertex, 0)], -1)
    check = replace(
        second.check,
        base_euler=first.check.base_euler,
        base_bodies=first.check.base_bodies,
        base_volume=first.check.base_volume,
        removed_volume=first.check.base_volume - second.check.volume,
        through=first.check.through + second.check.through,
        unchanged=first.check.unchanged and second.check.unchanged,
        problems=first.check.problems + second.check.problems,
        notes=first.check.notes + second.check.notes,
    )
    return replace(
        second,
        source=source,
        facet=facet,
        vertex=vertex,
        untouched=second.untouched & first.untouched[at] & below,
        thickness=np.concatenate([first.thickness, second.thickness]),
        pierced=np.concatenate([first.pierced, second.pierced]),
        failures=first.failures + tuple((which + count, text) for which, text in second.failures),
        check=check,
        undercut=np.concatenate([first.undercut, second.undercut]),
        kind=first.kind if first.kind == second.kind else "feature",
    )
