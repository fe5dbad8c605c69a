"""What a pattern comes to, for a designer: sizes, webs, margins, open area, what is removed, and in words how
good the packing is.

The words go by the figures of core.quality. Their thresholds lie between what is known of other
arrangements: one crystal with its defects in the rim has a share of bubbles with six neighbours, and a psi6,
above 0.9 (a clipped grid 0.96 and 1); a mesh generator's points 0.83, several grains; Lloyd's relaxation 0.7;
random points with a least distance 0.5. Nearest distances vary by 2 to 3 per cent in an even packing, by 5 in
the method's paper, by 6 to 10 in meshes; the smallest is 0.9 of the pitch at best, 0.77 in the paper, 0.6 in
meshes, and a first row that follows the boundary varies by less than 1 per cent, one that is cut out of a
grid by 18.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from .distance import boundary_distance
from .feature_recipe import Feature
from .feature_sizes import depths, feature_sizes
from .floors import Broken, broken_rules, floors_for
from .mesh import Floats, Ints, digest
from .neighbours import Neighbours, neighbours
from .pattern import Pattern, all_bubbles
from .processes import PROCESSES
from .quality import Quality, open_area
from .recipe import Recipe
from .region import Region
from .thickness import near_thickness

WORDS = ("excellent", "good", "fair", "poor")
UNKNOWN = "unknown"

_known: dict[bytes, Neighbours] = {}
"""The neighbours found last, by the digest of their places: a designer tries many sizes on one packing."""

# From which figure on a word may be said, best first; the last word needs none.
ORDER = (0.9, 0.8, 0.65)
EVEN = (0.03, 0.06, 0.1)
CLOSEST = (0.85, 0.75, 0.6)
ROW = (0.01, 0.03, 0.1)


@dataclass(frozen=True)
class Web:
    """The smallest web: its length, below 0 where two features overlap, the ids and rows of the two features,
    and the two points, (2, 3), on their edges between which it lies.
    """

    length: float
    ids: tuple[int, int]
    rows: tuple[int, int]
    between: Floats


@dataclass(frozen=True)
class Results:
    """Lengths in the unit of the base; nan or None where there is nothing to measure.

    count: of features; smallest_web; mean_web: mean over the features of the web to the nearest neighbour
    min_margin: from a feature's edge to the region's boundary; smallest, largest: diameters
    open_area: share of the region's area; removed: volume, exact once there is a part, else estimated from
    each feature's area and the near wall or depth, and nan where that is not known
    sizes: how many features have which diameter, where these are nominal
    broken: rules that features break
    """

    count: int
    smallest_web: Web | None
    mean_web: float
    min_margin: float
    smallest: float
    largest: float
    open_area: float
    removed: float
    sizes: tuple[tuple[float, int], ...]
    broken: tuple[Broken, ...]


def results_of(pattern: Pattern, region: Region, recipe: Recipe, removed: float | None = None) -> Results:
    """Results of a pattern that `recipe` made, or that shall keep its limits and its process.

    removed: volume that is known exactly, from the part; None: it is estimated from the near wall
    """
    bubbles = all_bubbles(pattern)
    kept = np.searchsorted(bubbles.ids, pattern.ids)
    deep = depths(recipe.feature, bubbles)
    checked = replace(recipe, limits=replace(recipe.limits, check_only=False))
    floors = floors_for(bubbles, region, checked).take(kept)
    if removed is None:
        removed = _estimated(pattern, region, recipe.feature, deep[kept])
    process = recipe.limits.process
    edge = boundary_distance(pattern.position, region.boundary_segments)
    least_draft = 0.0 if process is None else PROCESSES[process].draft
    draft = np.degrees(np.arctan(feature_sizes(recipe.feature, pattern).draft))
    broken = broken_rules(pattern, region, floors, edge, draft, least_draft)
    web, mean = webs(pattern)
    diameter = pattern.diameter
    some = len(pattern) > 0
    nominal = recipe.shaping.sizes is not None
    sizes, count = np.unique(diameter, return_counts=True) if nominal else ((), ())
    return Results(
        count=len(pattern),
        smallest_web=web,
        mean_web=mean,
        min_margin=float((edge - diameter / 2).min(initial=np.inf)),
        smallest=float(diameter.min()) if some else np.nan,
        largest=float(diameter.max()) if some else np.nan,
        open_area=open_area(pattern, region),
        removed=removed,
        sizes=tuple((float(size), int(number)) for size, number in zip(sizes, count, strict=True)),
        broken=broken,
    )


def _estimated(pattern: Pattern, region: Region, feature: Feature, deep: Floats) -> float:
    """Volume that straight features of these depths (n,) take away; nan for other kinds, whose part alone
    tells it.
    """
    if feature.kind != "hole" or feature.profile == "mesh":
        return np.nan
    through = np.isnan(deep)
    if through.any():
        deep = np.where(through, near_thickness(pattern, region), deep)
    share = 1.0 if pattern.share is None else pattern.share
    return float((np.pi / 4 * pattern.diameter**2 * share * deep).sum())


def webs(pattern: Pattern) -> tuple[Web | None, float]:
    """The smallest web, and the mean over the features of the web to the nearest neighbour; None and nan
    where no two features are neighbours.
    """
    near = _neighbours(pattern)
    if not len(near.first):
        return None, np.nan
    width = near.distance - (pattern.diameter[near.first] + pattern.diameter[near.second]) / 2
    own = np.full(len(pattern), np.inf)
    np.minimum.at(own, near.first, width)
    # of equals the one with the lowest ids, whichever way round it was found
    low, high = np.minimum(near.first, near.second), np.maximum(near.first, near.second)
    at = np.lexsort((high, low, width))[0]
    return web_between(pattern, int(low[at]), int(high[at])), float(own[np.isfinite(own)].mean())


def _neighbours(pattern: Pattern) -> Neighbours:
    key = digest(pattern.position, pattern.normal, pattern.pitch)
    if key not in _known:
        _known.clear()
        _known[key] = neighbours(pattern.position, pattern.normal, pattern.pitch)
    return _known[key]


def web_between(pattern: Pattern, one: int, other: int) -> Web:
    """The web between the features of two rows."""
    ends, radius = pattern.position[[one, other]], pattern.diameter[[one, other]] / 2
    along = ends[1] - ends[0]
    distance = float(np.linalg.norm(along))
    along = along / distance if distance > 0 else pattern.tangent[one]
    between = ends + np.array([[1.0], [-1.0]]) * radius[:, None] * along
    ids = (int(pattern.ids[one]), int(pattern.ids[other]))
    return Web(distance - float(radius.sum()), ids, (one, other), between)


def words_of(quality: Quality) -> dict[str, str]:
    """The figures of a packing in words: order, gaps (how even), smallest_gap and first_row."""
    return {
        "order": _word(np.array([quality.six, quality.psi6]).min(), ORDER, 1),
        "gaps": _word(quality.gap_cv, EVEN, -1),
        "smallest_gap": _word(quality.gap_min, CLOSEST, 1),
        "first_row": _word(quality.rim_cv, ROW, -1),
    }


def _word(figure: float, thresholds: tuple[float, ...], better: int) -> str:
    """The word for a figure; better: 1 where more is better, -1 where less is."""
    if not np.isfinite(figure):
        return UNKNOWN
    good = [better * figure >= better * threshold for threshold in thresholds]
    return WORDS[good.index(True) if True in good else len(thresholds)]


def offenders(broken: Sequence[Broken]) -> Ints:
    """Rows of the features that break any rule, ascending."""
    rows = [one.rows for one in broken]
    return np.unique(np.concatenate(rows)) if rows else np.zeros(0, dtype=np.int64)
