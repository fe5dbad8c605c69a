"""SVG: a drawing for browsers, vector programs and laser cutters, in true size, one group for each layer."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path

import numpy as np

from .drawing import ROUND, Drawing, Line
from .mesh import Floats

# Free paper round the drawing, of its larger side.
PAPER = 0.02
# Of the larger side, at least HAIRLINE millimetres.
STROKE, HAIRLINE = 0.0005, 0.05
COLOURS = {"boundary": "#0050d0", "cuts": "#c000c0", "features": "#000000", "centers": "#808080"}
# Half a centre mark's arm, of the diameter.
MARK = 0.1


def write_svg(path: Path, drawing: Drawing) -> None:
    """Write the drawing; a unit is a millimetre, and x and y are the drawing's but for y pointing down.
    OSError where the file can't be written.
    """
    low, high = drawing.extent
    size = float((high - low).max())
    edge = PAPER * size
    width, height = high - low + 2 * edge
    box = (low[0] - edge, -high[1] - edge, width, height)
    groups = "".join(
        f'<g id="{name}" stroke="{COLOURS[name]}" inkscape:groupmode="layer" inkscape:label="{name}">\n'
        f"{''.join(content)}</g>\n"
        for name, content in _layers(drawing).items()
    )
    path.write_text(
        '<?xml version="1.0" encoding="UTF-8"?>\n'
        '<svg xmlns="http://www.w3.org/2000/svg" '
        'xmlns:inkscape="http://www.inkscape.org/namespaces/inkscape" '
        f'version="1.1" width="{_number(width)}mm" height="{_number(height)}mm" '
        f'viewBox="{" ".join(_number(value) for value in box)}" fill="none" '
        f'stroke-width="{_number(max(STROKE * size, HAIRLINE))}">\n{groups}</svg>\n',
        encoding="utf-8",
        newline="\n",
    )


def _number(value: float) -> str:
    """To a millionth, without what says nothing, and never -0."""
    return f"{round(value, 6) + 0.0:.6f}".rstrip("0").rstrip(".")


def _layers(drawing: Drawing) -> dict[str, Iterator[str]]:
    layers = {
        "boundary": _paths(drawing.boundary),
        "features": _features(drawing),
        "centers": _marks(drawing),
    }
    if drawing.cuts:
        layers["cuts"] = _paths(drawing.cuts)
    return layers


def _paths(lines: Iterable[Line]) -> Iterator[str]:
    for line in lines:
        yield f'<path d="{_path(line.points, line.closed)}"/>\n'


def _path(points: Floats, closed: bool) -> str:
    steps = " ".join(f"{_number(x)},{_number(-y)}" for x, y in points.tolist())
    return f"M{steps}{'Z' if closed else ''}"


def _features(drawing: Drawing) -> Iterator[str]:
    if drawing.outlines is not None:
        for name, outline in zip(drawing.ids.tolist(), drawing.outlines, strict=True):
            yield f'<path id="feature-{name}" d="{_path(outline, True)}"/>\n'
        return
    angle = -np.degrees(np.arctan2(drawing.major[:, 1], drawing.major[:, 0]))
    table = np.column_stack([drawing.centre, drawing.diameter / 2, angle, drawing.ratio])
    for name, (x, y, radius, turn, ratio) in zip(drawing.ids.tolist(), table.tolist(), strict=True):
        where = f'id="feature-{name}" cx="{_number(x)}" cy="{_number(-y)}"'
        if ratio >= ROUND:
            yield f'<circle {where} r="{_number(radius)}"/>\n'
        else:
            yield (
                f'<ellipse {where} rx="{_number(radius)}" ry="{_number(ratio * radius)}" '
                f'transform="rotate({_number(turn)} {_number(x)} {_number(-y)})"/>\n'
            )


def _marks(drawing: Drawing) -> Iterator[str]:
    for (x, y), half in zip(drawing.centre.tolist(), (MARK * drawing.diameter).tolist(), strict=True):
        arm, across = _number(2 * half), _number(-half)
        yield f'<path d="M{_number(x - half)},{_number(-y)}h{arm}m{across},{across}v{arm}"/>\n'
