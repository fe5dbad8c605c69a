"""The least that every feature and its surroundings must measure, and which features fall short of it.

What the recipe's limits give and what the process asks for by the thickness of the wall go together: the
larger counts. Where the recipe gives no thickness, each feature goes by the near wall that is measured under
it, so that a hole on a rib obeys the rib.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from .distance import boundary_distance
from .feature_sizes import depths, narrowness
from .mesh import Floats, Ints
from .pattern import Pattern
from .processes import PROCESSES
from .recipe import Limits, Recipe
from .region import Region
from .thickness import near_thickness
from .webs import narrow_pairs

# What falls short by a smaller share keeps the rule: points in Blender are of single precision.
SLACK = 1e-5


@dataclass(frozen=True)
class Floors:
    """Least lengths at every feature, (n,) each, in the unit of the base.

    hole: diameter; slender: diameter too, because of the feature's depth; web: to any neighbour; margin: from
    the feature's edge to the region's boundary
    unknown: how many features have a wall of unknown thickness, to which no rule applies that hangs on it
    """

    hole: Floats
    slender: Floats
    web: Floats
    margin: Floats
    unknown: int = 0

    def take(self, rows: Ints) -> Floors:
        """Those of the features of these rows."""
        return replace(
            self,
            hole=self.hole[rows],
            slender=self.slender[rows],
            web=self.web[rows],
            margin=self.margin[rows],
        )

    @property
    def notes(self) -> tuple[str, ...]:
        """What a designer should know of them."""
        if not self.unknown:
            return ()
        one = (
            "the wall under one feature" if self.unknown == 1 else f"the wall under {self.unknown:,} features"
        )
        return (
            f"No far side was found of {one}: the rules of the process hold there as far as they do "
            "without a thickness. Give the thickness.",
        )

    @property
    def diameter(self) -> Floats:
        """Least diameter for whichever reason, (n,)."""
        return np.maximum(self.hole, self.slender)


def floors_for(bubbles: Pattern, region: Region, recipe: Recipe) -> Floors:
    """Floors of these bubbles with the features that the recipe puts there; see floors_of."""
    feature = recipe.feature
    depth, narrow = depths(feature, bubbles), narrowness(feature, bubbles)
    return floors_of(bubbles, region, recipe.limits, depth, recipe.millimetre, narrow)


def floors_of(
    bubbles: Pattern,
    region: Region,
    limits: Limits,
    depth: Floats | float | None = None,
    millimetre: float = 1.0,
    narrow: Floats | float = 1.0,
) -> Floors:
    """Floors of these bubbles, whatever diameters they have; of the limits alone where the process shall only
    be checked.

    depth: how deep the features go, (n,) or one for all; nan or None: through the near wall; millimetre: in
    the unit of the base; narrow: a feature's width where it is narrowest relative to its diameter, (n,) or
    one for all: a process makes a slot with a tool as wide as that
    """
    n = len(bubbles)
    lengths = (limits.min_diameter, limits.min_web, limits.min_margin)
    hole, web, margin = (np.full(n, max(least, 0.0)) for least in lengths)
    if limits.process is None or limits.check_only:
        return Floors(hole, np.zeros(n), web, margin)
    process = PROCESSES[limits.process]
    known = limits.thickness
    thickness = near_thickness(bubbles, region) if known is None else np.full(n, known)
    given = np.broadcast_to(np.nan if depth is None else depth, n).astype(np.float64)
    deep = np.where(np.isnan(given), thickness / process.through, given / process.blind)
    return Floors(
        np.fmax(hole, process.hole.at(thickness, millimetre) / narrow),
        np.nan_to_num(deep) / narrow,
        np.fmax(web, process.web.at(thickness, millimetre)),
        np.fmax(margin, process.margin.at(thickness, millimetre)),
        int(np.isnan(thickness).sum()),
    )


@dataclass(frozen=True)
class Broken:
    """A rule that features break.

    rule: "hole" (too small), "slender" (too deep for its diameter), "web", "margin" or "draft"
    rows: rows of the features in the pattern, ascending; ids: theirs
    worst: the measure that falls shortest, and least, what it would have to be; both lengths but for a
    draft's degrees
    """

    rule: str
    rows: Ints
    ids: Ints
    worst: float
    least: float


def broken_rules(
    pattern: Pattern,
    region: Region,
    floors: Floors,
    edge: Floats | None = None,
    draft: Floats | float = 0.0,
    least_draft: float = 0.0,
) -> tuple[Broken, ...]:
    """What the pattern as it stands breaks of its `floors`; nothing of what it keeps.

    edge: (n,) distances of the features' centres from the region's boundary, where they are known already
    draft, least_draft: of the features' walls, (n,) or one for all, and what the process asks for, in degrees
    """
    n, diameter = len(pattern), pattern.diameter
    if edge is None:
        edge = boundary_distance(pattern.position, region.boundary_segments)
    rules = (
        ("hole", diameter, floors.hole),
        ("slender", diameter, floors.slender),
        ("web", *_webs(pattern, region, floors.web)),
        ("margin", edge - diameter / 2, floors.margin),
        ("draft", np.broadcast_to(draft, n).astype(np.float64), np.full(n, least_draft)),
    )
    found = (_broken(pattern, *rule) for rule in rules)
    return tuple(broken for broken in found if broken is not None)


def _webs(pattern: Pattern, region: Region, least: Floats) -> tuple[Floats, Floats]:
    """The web of every feature that falls shortest of what it and its neighbour ask for, and that, (n,)."""
    web, asked = np.full(len(pattern), np.inf), np.zeros(len(pattern))
    diameter, everyone = pattern.diameter, np.ones(len(pattern), dtype=bool)
    pairs, _ = narrow_pairs(pattern, region, diameter, everyone, least)
    first, second = pattern.position[pairs].swapaxes(0, 1)
    found = np.linalg.norm(second - first, axis=1) - diameter[pairs].mean(axis=1)
    wanted = least[pairs].max(axis=1)
    worst = np.argsort(found - wanted, kind="stable")[::-1]  # the last to be written stays
    for side in pairs[worst].T:
        better = found[worst] - wanted[worst] < web[side] - asked[side]
        web[side[better]], asked[side[better]] = found[worst][better], wanted[worst][better]
    return web, asked


def _broken(pattern: Pattern, rule: str, measured: Floats, least: Floats) -> Broken | None:
    """The features whose measure (n,) is short of the least (n,); None where there is none."""
    slack = SLACK * np.maximum(least, pattern.diameter)
    rows = np.flatnonzero(measured < least - slack)
    if not len(rows):
        return None
    worst = rows[np.argmax(least[rows] - measured[rows])]
    return Broken(rule, rows, pattern.ids[rows], float(measured[worst]), float(least[worst]))
