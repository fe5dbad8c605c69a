"""What is written down of a pattern's results: figures in its settings, and at each point whether it breaks a
rule.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ..core.mesh import Ints
from ..core.pattern import Pattern
from ..core.quality import Quality
from ..core.results import UNKNOWN, Results, words_of
from .attributes import read_values, write_values
from .pattern_object import point_ids

RULES = ("hole", "slender", "web", "margin", "draft")
BROKEN = "broken"
"""The points' attribute: the sum of 1, 2, 4, ... for the first, second, ... RULES that the feature breaks."""


def known(value: float) -> float:
    """A figure, -1 where there was nothing to measure."""
    return float(value) if np.isfinite(value) else -1.0


def note_quality(settings: Any, quality: Quality) -> None:
    """Write down the figures of a packing, on which sizes have no bearing."""
    for name in ("six", "psi6", "gap_cv", "gap_min", "rim_cv", "void"):
        setattr(settings, name, known(getattr(quality, name)))
    settings.words = ";".join(f"{name},{word}" for name, word in words_of(quality).items() if word != UNKNOWN)


def noted_quality(settings: Any) -> Quality:
    """The figures of the packing as written down, nan where nothing was measured."""
    names = ("six", "psi6", "gap_cv", "gap_min", "rim_cv", "void")
    return Quality(*(value if (value := getattr(settings, name)) >= 0 else np.nan for name in names))


def note_results(settings: Any, pattern: Pattern, results: Results) -> None:
    """Write down the figures that depend on the features' sizes, and mark the points that break a rule."""
    settings.count = results.count
    web = results.smallest_web
    settings.web = -1.0 if web is None else web.length
    settings.web_ids = (-1, -1) if web is None else web.ids
    settings.web_between = [0.0] * 6 if web is None else web.between.ravel().tolist()
    settings.web_normal = (0.0, 0.0, 1.0) if web is None else pattern.normal[list(web.rows)].mean(axis=0)
    settings.mean_web = known(results.mean_web)
    settings.margin = known(results.min_margin)
    settings.smallest, settings.largest = known(results.smallest), known(results.largest)
    settings.open_area = results.open_area
    settings.removed = known(results.removed)
    settings.nominal = ";".join(f"{size:.9g},{count}" for size, count in results.sizes)
    settings.broken.clear()
    for one in results.broken:
        entry = settings.broken.add()
        entry.rule, entry.count, entry.worst, entry.least = one.rule, len(one.rows), one.worst, one.least
    write_broken(settings.id_data, results)


def write_broken(obj: Any, results: Results) -> None:
    """Give every point of the pattern's object the rules that its feature breaks."""
    ids = point_ids(obj)
    marks = np.zeros(len(ids), dtype=np.int32)
    for one in results.broken:
        marks[np.isin(ids, one.ids)] |= 1 << RULES.index(one.rule)
    write_values(obj.data, BROKEN, 'POINT', 'INT', marks)


def rows_of_rule(obj: Any, rule: str) -> Ints:
    """The object's points whose features break a rule, or any of them; or the two of the smallest web."""
    if rule == 'SMALLEST_WEB':
        return np.flatnonzero(np.isin(point_ids(obj), list(obj.bubble_pattern.web_ids)))
    attribute = obj.data.attributes.get(BROKEN)
    if attribute is None:
        return np.zeros(0, dtype=np.int64)
    marks = read_values(attribute.data, "value", np.int32)
    return np.flatnonzero(marks != 0 if rule == 'ANY' else marks & (1 << RULES.index(rule.lower())))
