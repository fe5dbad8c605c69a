"""What a run leaves for people and programs to read: the hole table and the report."""

from __future__ import annotations

import csv
import json
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from .isometries import OFF
from .mesh import Floats, Ints
from .part import Part
from .pattern import Pattern, aimed
from .quality import Quality, measure, min_margin, min_web, open_area
from .recipe import Recipe
from .region import Region
from .results_report import results_report
from .solving import Solved

COLUMNS = ("id", "x", "y", "z", "nx", "ny", "nz", "diameter", "pitch", "row")
PARTNER = "partner"


def write_features(path: Path, pattern: Pattern) -> None:
    """The hole table as CSV, one line per feature in the order of ids, with the columns COLUMNS.

    An id is the number of the feature's bubble: it stays when the limits leave out other features.
    x, y, z is the centre on the surface, nx, ny, nz the unit normal there, outward; lengths in the unit of
    the base. Numbers are written so that they read back as the same double. A symmetric pattern has one
    column more, PARTNER: the ids of the bubbles that the isometries take this one to, separated by spaces;
    its own for those that leave it where it is. Where features have axes or headings other than normal and
    tangent, or sizes that vary over the region, their columns come last: ax, ay, az, the axis; hx, hy, hz,
    the profile's x axis; and each size under the recipe's name. OSError where the file can't be written.
    """
    partner = [[]] * len(pattern) if pattern.partners is None else _partner_column(pattern.partners)
    numbers = np.column_stack([pattern.position, pattern.normal, pattern.diameter, pattern.pitch])
    names, form = form_columns(pattern)
    with path.open("w", newline="", encoding="utf-8") as file:
        table = csv.writer(file)
        table.writerow([*COLUMNS, *(() if pattern.partners is None else (PARTNER,)), *names])
        table.writerows(
            [number, *values, row, *others, *shape]
            for number, values, row, others, shape in zip(
                pattern.ids.tolist(),
                numbers.tolist(),
                pattern.row.tolist(),
                partner,
                form.tolist(),
                strict=True,
            )
        )


def form_columns(pattern: Pattern) -> tuple[list[str], Floats]:
    """Names and values, (n, k), of what makes features of the pattern differ beside their diameters."""
    names: list[str] = []
    columns = [np.empty((len(pattern), 0))]
    if pattern.axis is not None or pattern.heading is not None:
        stands = aimed(pattern)
        names += ["ax", "ay", "az", "hx", "hy", "hz"]
        columns += [stands.normal, stands.tangent]
    for name, values in pattern.sizes.items():
        names.append(name)
        columns.append(values[:, None])
    return names, np.concatenate(columns, axis=1)


def _partner_column(partners: Ints) -> list[list[str]]:
    """For every feature the one entry of the column PARTNER."""
    return [[" ".join(map(str, ids[1:]))] for ids in partners.tolist()]


def make_report(
    region: Region,
    pattern: Pattern,
    part: Part,
    seconds: Mapping[str, float],
    recipe: Recipe | None = None,
    solved: Solved | None = None,
) -> dict[str, Any]:
    """The figures of a run in the unit of the base, ready for JSON; one with nothing to measure is None.

    kind (of the features), features, watertight, genus, volume, open_area, min_web, min_margin, quality{six,
    psi6, gap_cv, gap_min, rim_cv, void} and seconds{region, pack, shape, add}; further symmetry, the
    recipe's word for the one that the pattern has, or "off", kept_out_area, what keep-outs have taken from
    the region, wall{min, max}, the near wall's thickness at the features, limits (see limits_report),
    undercut and undercut_ids, features that cannot be drawn off along the pull, problems, one sentence each,
    empty when the part is good, and notes, likewise, on what does no harm; with the recipe, what
    results_report adds.
    """
    figures: Quality = measure(pattern, region)
    thickness = part.thickness[np.isfinite(part.thickness)]
    report = {
        "kind": part.kind,
        "features": len(pattern),
        "through": part.check.through,
        "watertight": part.check.watertight,
        "genus": part.check.genus,
        "bodies": part.check.bodies,
        "volume": part.check.volume,
        "removed_volume": part.check.removed_volume,
        "region_area": region.area,
        "kept_out_area": region.kept_out,
        "open_area": open_area(pattern, region),
        "min_web": min_web(pattern),
        "min_margin": min_margin(pattern, region),
        "limits": limits_report(pattern),
        "undercut": int(part.undercut.sum()),
        "undercut_ids": pattern.ids[part.undercut].tolist(),
        "symmetry": pattern.symmetry or OFF,
        "wall": {
            "min": float(thickness.min()) if len(thickness) else math.nan,
            "max": float(thickness.max()) if len(thickness) else math.nan,
        },
        "quality": {
            "six": figures.six,
            "psi6": figures.psi6,
            "gap_cv": figures.gap_cv,
            "gap_min": figures.gap_min,
            "rim_cv": figures.rim_cv,
            "void": figures.void,
        },
        "seconds": {stage: round(value, 4) for stage, value in seconds.items()},
        "problems": list(part.check.problems),
        "notes": [*part.check.notes, *pattern.notes],
    }
    if recipe is not None:
        report |= results_report(pattern, region, part, recipe, figures, solved)
    cleaned = _without_nonsense(report)
    assert isinstance(cleaned, dict)
    return cleaned


def limits_report(pattern: Pattern) -> dict[str, Any]:
    """What the limits did: how many features they made smaller (shrunk) and left out (dropped), the ids of
    both, the smallest share that is left of a shrunk one's diameter, and where the dropped ones would be.
    """
    shrunk = pattern.shrunk
    dropped = pattern.dropped
    wished = pattern.diameter if pattern.wished is None else pattern.wished
    return {
        "shrunk": len(shrunk),
        "dropped": 0 if dropped is None else len(dropped),
        "smallest_share": float((pattern.diameter[shrunk] / wished[shrunk]).min(initial=1.0)),
        "shrunk_ids": pattern.ids[shrunk].tolist(),
        "dropped_ids": [] if dropped is None else dropped.ids.tolist(),
        "dropped_at": [] if dropped is None else dropped.position.tolist(),
    }


def _without_nonsense(value: Any) -> Any:
    """JSON knows neither nan nor inf: they become None."""
    if isinstance(value, dict):
        return {key: _without_nonsense(entry) for key, entry in value.items()}
    if isinstance(value, list):
        return [_without_nonsense(entry) for entry in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value


def write_report(path: Path, report: Mapping[str, Any]) -> None:
    """The report as JSON. OSError where the file can't be written."""
    path.write_text(json.dumps(report, indent=2) + "\n", encoding="utf-8")
