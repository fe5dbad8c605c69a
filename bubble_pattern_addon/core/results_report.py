"""Results, broken rules and what was solved for, as they stand in report.json."""

from __future__ import annotations

from typing import Any

from .density import mass
from .floors import Broken
from .part import Part
from .pattern import Pattern
from .quality import Quality
from .recipe import Recipe
from .region import Region
from .results import Web, results_of, words_of
from .solving import Solved


def results_report(
    pattern: Pattern, region: Region, part: Part, recipe: Recipe, quality: Quality, solved: Solved | None
) -> dict[str, Any]:
    """Figures of a finished part beside those of make_report, lengths in the unit of the base.

    smallest_web{length, ids, between}, where it is; mean_web; diameter{min, max}; removed_mass in grams, None
    without a density; in_words, the quality (see results.words_of); nominal, how many features have each
    nominal diameter; process; broken, one entry for each rule that features break (see floors.Broken); solve,
    what was asked for and found, None where nothing was
    """
    results = results_of(pattern, region, recipe, part.check.removed_volume)
    density = recipe.output.density
    return {
        "mean_web": results.mean_web,
        "smallest_web": _web(results.smallest_web),
        "diameter": {"min": results.smallest, "max": results.largest},
        "removed_mass": None if density is None else mass(results.removed, density, recipe.millimetre),
        "in_words": words_of(quality),
        "nominal": [{"diameter": size, "features": count} for size, count in results.sizes],
        "process": recipe.limits.process,
        "broken": [_broken(rule) for rule in results.broken],
        "solve": None if solved is None else _solved(solved),
    }


def _web(web: Web | None) -> dict[str, Any] | None:
    if web is None:
        return None
    return {"length": web.length, "ids": list(web.ids), "between": web.between.tolist()}


def _broken(broken: Broken) -> dict[str, Any]:
    return {"rule": broken.rule, "worst": broken.worst, "least": broken.least, "ids": broken.ids.tolist()}


def _solved(solved: Solved) -> dict[str, Any]:
    return {
        "by": solved.by,
        "wanted": solved.wanted,
        "reached": solved.reached,
        "factor": solved.factor,
        "packings": solved.packings,
        "shapings": solved.shapings,
        "met": solved.met,
    }
