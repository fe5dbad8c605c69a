"""A drawing in the file format that is asked for, and what a report says of it."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

from .drawing import Drawing
from .dxf import write_dxf
from .svg import write_svg

WRITERS = {".dxf": write_dxf, ".svg": write_svg}


def write_drawing(path: Path, drawing: Drawing) -> None:
    """The drawing in the format of the path's suffix (one of recipe.DRAWINGS). OSError where the file can't
    be written.
    """
    WRITERS[path.suffix.lower()](path, drawing)


def drawing_report(drawing: Drawing | None) -> dict[str, Any]:
    """The entry "drawing" of a run's report, none without a drawing.

    features: how many are drawn; hidden: how many face away; across_cuts: how many reach over a line where
    the region was cut open; stretch: the largest factor between a length on the base and on paper, None
    where it is projected
    """
    if drawing is None:
        return {}
    figures = {
        "features": len(drawing.ids),
        "hidden": drawing.hidden,
        "across_cuts": drawing.across,
        "stretch": None if math.isnan(drawing.stretch) else drawing.stretch,
    }
    return {"drawing": figures}
