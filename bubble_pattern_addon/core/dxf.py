"""DXF, the exchange format of CAD and of laser and punching machines: a drawing as ASCII of AutoCAD 2000
(AC1015).

After Autodesk's "DXF Reference": what a strict reader asks for, with handles and owners throughout, and
nothing else. Round features are CIRCLE entities, those that lean ELLIPSE, others closed LWPOLYLINE.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import count
from pathlib import Path

import numpy as np

from .drawing import ROUND, Drawing, Line
from .mesh import Floats

FEATURES, BOUNDARY, CENTRES, CUTS = "FEATURES", "BOUNDARY", "CENTERS", "CUTS"
# name -> AutoCAD's colour index: white or black, blue, grey, magenta
LAYERS = {FEATURES: 7, BOUNDARY: 5, CENTRES: 8, CUTS: 6}
# Half a centre mark's arm, of the diameter.
MARK = 0.1
MILLIMETRES = 4

# Handles that others refer to.
VIEWPORTS, LINETYPES, LAYER_TABLE, STYLES, VIEWS, FRAMES, APPLICATIONS, DIMENSIONS, BLOCKS = range(1, 10)
MODEL, PAPER, ROOT, GROUPS, PLOT_STYLES, PLOT_NORMAL = range(16, 22)
FIRST_FREE = 32

Pair = tuple[int, object]


def write_dxf(path: Path, drawing: Drawing) -> None:
    """Write the drawing in millimetres. OSError where the file can't be written."""
    handles = count(FIRST_FREE)
    tables = [*_tables(handles)]
    blocks = [*_blocks(handles)]
    entities = "".join(_entities(drawing, handles))
    parts = [
        _text(_header(drawing, next(handles))),
        _text(_section("CLASSES", _classes())),
        _text(_section("TABLES", tables)),
        _text(_section("BLOCKS", blocks)),
        "0\nSECTION\n2\nENTITIES\n",
        entities,
        "0\nENDSEC\n",
        _text(_section("OBJECTS", [*_objects()])),
        "0\nEOF\n",
    ]
    path.write_bytes("".join(parts).encode("ascii"))


def _text(pairs: list[Pair]) -> str:
    return "".join(f"{code}\n{value}\n" for code, value in pairs)


def _section(name: str, content: list[Pair]) -> list[Pair]:
    return [(0, "SECTION"), (2, name), *content, (0, "ENDSEC")]


def _hex(handle: int) -> str:
    return f"{handle:X}"


def _number(value: float) -> str:
    """To a billionth, and never -0."""
    return f"{round(value, 9) + 0.0:.9f}"


def _header(drawing: Drawing, free: int) -> list[Pair]:
    low, high = drawing.extent
    content: list[Pair] = [
        (9, "$ACADVER"),
        (1, "AC1015"),
        (9, "$DWGCODEPAGE"),
        (3, "ANSI_1252"),
        (9, "$INSBASE"),
        *_point(0.0, 0.0),
        (9, "$EXTMIN"),
        *_point(*low),
        (9, "$EXTMAX"),
        *_point(*high),
        (9, "$MEASUREMENT"),
        (70, 1),
        (9, "$INSUNITS"),
        (70, MILLIMETRES),
        (9, "$HANDSEED"),
        (5, _hex(free)),
    ]
    return _section("HEADER", content)


def _point(x: float, y: float, code: int = 10) -> list[Pair]:
    return [(code, _number(x)), (code + 10, _number(y)), (code + 20, _number(0.0))]


def _classes() -> list[Pair]:
    """Two kinds of objects that a reader need not know: how layers are plotted."""
    return [
        pair
        for name, cpp in (
            ("ACDBDICTIONARYWDFLT", "AcDbDictionaryWithDefault"),
            ("ACDBPLACEHOLDER", "AcDbPlaceHolder"),
        )
        for pair in (
            (0, "CLASS"),
            (1, name),
            (2, cpp),
            (3, "ObjectDBX Classes"),
            (90, 0),
            (280, 0),
            (281, 0),
        )
    ]


# -- tables and blocks ---------------------------------------------------------------------------------------


def _table(name: str, handle: int, records: list[list[Pair]]) -> Iterator[Pair]:
    yield from [(0, "TABLE"), (2, name), (5, _hex(handle)), (330, 0), (100, "AcDbSymbolTable")]
    yield (70, len(records))
    if name == "DIMSTYLE":
        yield (100, "AcDbDimStyleTable")
    for record in records:
        yield from record
    yield (0, "ENDTAB")


def _record(kind: str, cls: str, handle: int, owner: int, *content: Pair) -> list[Pair]:
    return [
        (0, kind),
        (105 if kind == "DIMSTYLE" else 5, _hex(handle)),
        (330, _hex(owner)),
        (100, "AcDbSymbolTableRecord"),
        (100, f"AcDb{cls}TableRecord"),
        *content,
    ]


def _tables(handles: Iterator[int]) -> Iterator[Pair]:
    view = [(2, "*Active"), (70, 0), (10, 0.0), (20, 0.0), (11, 1.0), (21, 1.0), (12, 0.0), (22, 0.0)]
    view += [(40, 1000.0), (41, 1.34)]
    yield from _table("VPORT", VIEWPORTS, [_record("VPORT", "Viewport", next(handles), VIEWPORTS, *view)])
    line = ((70, 0), (3, ""), (72, 65), (73, 0), (40, 0.0))
    yield from _table(
        "LTYPE",
        LINETYPES,
        [
            _record("LTYPE", "Linetype", next(handles), LINETYPES, (2, name), *line)
            for name in ("ByBlock", "ByLayer", "Continuous")
        ],
    )
    yield from _table(
        "LAYER",
        LAYER_TABLE,
        [
            _record(
                "LAYER",
                "Layer",
                next(handles),
                LAYER_TABLE,
                *[(2, name), (70, 0), (62, colour), (6, "Continuous"), (370, -3), (390, _hex(PLOT_NORMAL))],
            )
            for name, colour in {"0": 7, **LAYERS}.items()
        ],
    )
    style = [
        (2, "Standard"),
        (70, 0),
        (40, 0.0),
        (41, 1.0),
        (50, 0.0),
        (71, 0),
        (42, 2.5),
        (3, "txt"),
        (4, ""),
    ]
    yield from _table("STYLE", STYLES, [_record("STYLE", "TextStyle", next(handles), STYLES, *style)])
    yield from _table("VIEW", VIEWS, [])
    yield from _table("UCS", FRAMES, [])
    yield from _table(
        "APPID",
        APPLICATIONS,
        [_record("APPID", "RegApp", next(handles), APPLICATIONS, (2, "ACAD"), (70, 0))],
    )
    dimension = _record("DIMSTYLE", "DimStyle", next(handles), DIMENSIONS, (2, "Standard"), (70, 0))
    yield from _table("DIMSTYLE", DIMENSIONS, [dimension])
    yield from _table(
        "BLOCK_RECORD",
        BLOCKS,
        [
            _record("BLOCK_RECORD", "Block", handle, BLOCKS, (2, name))
            for handle, name in ((MODEL, "*Model_Space"), (PAPER, "*Paper_Space"))
        ],
    )


def _blocks(handles: Iterator[int]) -> Iterator[Pair]:
    for owner, name in ((MODEL, "*Model_Space"), (PAPER, "*Paper_Space")):
        yield from [(0, "BLOCK"), (5, _hex(next(handles))), (330, _hex(owner)), (100, "AcDbEntity"), (8, "0")]
        yield from [(100, "AcDbBlockBegin"), (2, name), (70, 0), *_point(0.0, 0.0), (3, name), (1, "")]
        yield from [
            (0, "ENDBLK"),
            (5, _hex(next(handles))),
            (330, _hex(owner)),
            (100, "AcDbEntity"),
            (8, "0"),
        ]
        yield (100, "AcDbBlockEnd")


def _objects() -> Iterator[Pair]:
    def dictionary(kind: str, handle: int, owner: int, *entries: tuple[str, int]) -> Iterator[Pair]:
        """A dictionary object with its entries, each a name and a handle."""
        yield from [(0, kind), (5, _hex(handle)), (330, _hex(owner)), (100, "AcDbDictionary"), (281, 1)]
        for name, entry in entries:
            yield from [(3, name), (350, _hex(entry))]

    yield from dictionary("DICTIONARY", ROOT, 0, ("ACAD_GROUP", GROUPS), ("ACAD_PLOTSTYLENAME", PLOT_STYLES))
    yield from dictionary("DICTIONARY", GROUPS, ROOT)
    yield from dictionary("ACDBDICTIONARYWDFLT", PLOT_STYLES, ROOT, ("Normal", PLOT_NORMAL))
    yield from [(100, "AcDbDictionaryWithDefault"), (340, _hex(PLOT_NORMAL))]
    yield from [(0, "ACDBPLACEHOLDER"), (5, _hex(PLOT_NORMAL)), (330, _hex(PLOT_STYLES))]


# -- what is drawn -------------------------------------------------------------------------------------------


def _entities(drawing: Drawing, handles: Iterator[int]) -> Iterator[str]:
    yield from _features(drawing, handles)
    for layer, lines in ((BOUNDARY, drawing.boundary), (CUTS, drawing.cuts)):
        for line in lines:
            yield _polyline(line, layer, next(handles))
    arm = MARK * drawing.diameter
    for (x, y), half in zip(drawing.centre.tolist(), arm.tolist(), strict=True):
        for dx, dy in ((half, 0.0), (0.0, half)):
            ends = [*_point(x - dx, y - dy), *_point(x + dx, y + dy, 11)]
            yield _entity("LINE", "Line", CENTRES, next(handles)) + _text(ends)


def _entity(kind: str, cls: str, layer: str, handle: int) -> str:
    return f"0\n{kind}\n5\n{handle:X}\n330\n{MODEL:X}\n100\nAcDbEntity\n8\n{layer}\n100\nAcDb{cls}\n"


def _features(drawing: Drawing, handles: Iterator[int]) -> Iterator[str]:
    if drawing.outlines is not None:
        for outline in drawing.outlines:
            yield _polyline(Line(outline, True), FEATURES, next(handles))
        return
    table = np.column_stack([drawing.centre, drawing.diameter / 2, drawing.major, drawing.ratio])
    for x, y, radius, right, up, ratio in table.tolist():
        if ratio >= ROUND:
            yield _entity("CIRCLE", "Circle", FEATURES, next(handles))
            yield _text([*_point(x, y), (40, _number(radius))])
        else:
            yield _entity("ELLIPSE", "Ellipse", FEATURES, next(handles))
            axis = _point(right * radius, up * radius, 11)
            # AutoCAD knows no ellipse that is flatter than a millionth
            flat = (40, f"{max(ratio, 1e-6):.12f}")
            yield _text([*_point(x, y), *axis, flat, (41, "0.0"), (42, f"{2 * np.pi:.15f}")])


def _polyline(line: Line, layer: str, handle: int) -> str:
    points: Floats = line.points
    corners = "".join(f"10\n{_number(x)}\n20\n{_number(y)}\n" for x, y in points.tolist())
    head = _entity("LWPOLYLINE", "Polyline", layer, handle)
    return f"{head}90\n{len(points)}\n70\n{int(line.closed)}\n{corners}"
