"""Bases of the gallery, one function each, modelled after those of the paper's results; in millimetres.

All are shells of 2.5 mm, rounded and closed, standing on z's lower side with the visible one up.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from bubble_pattern_addon.core.mesh import Bools, Floats, Mesh
from scripts.moulding import Contour, Cover, Edge, beyond, grown, mould, smooth
from scripts.shapes import circle, closed_sheet, flipped, grid_sheet, joined, rounded

BEAD = (-1.2, 1.2, 2.2, 3.2, 4.2, 5.4, 6.6, 8, 10, 12, 14, 16)
"""Rings of vertices outside a region that carry its bead."""
STEEP = (-2.8, -2.1, -1.4, -0.7, 0.7)
"""Rings of vertices inside a button that carry its rounded edge."""

FINISHES: Mapping[str, Mapping[str, Any]] = {
    "Black plastic": {"color": (0.018, 0.019, 0.021), "roughness": 0.42, "grain": 0.03, "grain_size": 0.5},
    "Anthracite": {"color": (0.045, 0.048, 0.054), "roughness": 0.40},
    "Light plastic": {"color": (0.56, 0.57, 0.57), "roughness": 0.45, "grain": 0.02, "grain_size": 0.5},
    "Aluminium": {"color": (0.36, 0.37, 0.39), "metallic": 0.8, "roughness": 0.42},
    "Bronze": {"color": (0.34, 0.27, 0.21), "metallic": 0.8, "roughness": 0.52},
    "Chrome": {"color": (0.62, 0.63, 0.65), "metallic": 1.0, "roughness": 0.2},
    "Display": {"color": (0.004, 0.005, 0.007), "roughness": 0.12},
    "Keys": {"color": (0.20, 0.21, 0.225), "roughness": 0.5},
}


@dataclass(frozen=True)
class GalleryBase:
    """A base with its target region (T,), sub-regions by name, and the faces of each finish but the first.

    body: the finish of all other faces
    """

    mesh: Mesh
    region: Bools
    body: str
    finishes: Mapping[str, Bools]
    sub_regions: Mapping[str, Bools] = field(default_factory=dict)
    bodies: int = 1


def _bead(away: Floats, height: float = 2.6) -> Floats:
    """A soft bead from the boundary of a region outward, over distances (n,) from it."""
    return height * smooth((away - 0.4) / 6.5) - 0.4 * height * smooth((away - 8.5) / 9)


def _button(points: Floats, line: Floats, height: float) -> Floats:
    """A key of this height with a rounded edge, slightly crowned."""
    inward = -beyond(points, line)
    return height * smooth(inward / 2.8)


def _flat(points: Floats) -> Floats:
    return np.zeros(len(points))


def _all(*masks: Bools) -> Bools:
    return np.asarray(np.any(masks, axis=0))


# -- car door speakers ---------------------------------------------------------------------------------------


def _speaker(
    region: Floats,
    contours: Sequence[Contour] = (),
    rise: Callable[[Floats], Floats] = _flat,
    detail: Callable[[Floats], Floats] = _flat,
) -> Cover:
    """A cover curved both ways with the region sunk behind a bead; rise is added to its form (see mould)."""

    def form(flat: Floats) -> Floats:
        x, y = flat.T
        return -(x**2) / 900 - y**2 / 620 + _bead(beyond(flat, region)) + rise(flat)

    return mould(grown(region, 17), [Contour(region, BEAD), *contours], form, detail, edge=Edge(7, -30))


def sedan_speaker() -> GalleryBase:
    """Result 1: a long grille with a slanted end, as in the door of a large sedan, and a maker's badge."""
    region = rounded(np.array([[-96.0, -40.0], [82.0, -52.0], [104.0, 44.0], [-72.0, 50.0]]), 34.0)
    badge = rounded(np.array([[-66.0, -22], [-34.0, -24], [-34.0, -15], [-66.0, -13]]), 3.5, 16)
    cover = _speaker(
        region, [Contour(badge, (1.2, -0.8, -1.6, -2.4))], detail=lambda flat: _button(flat, badge, 1.0)
    )
    inside, on_badge = cover.within(region), cover.within(badge)
    grille = inside & ~on_badge
    return GalleryBase(cover.mesh, grille, "Black plastic", {"Aluminium": grille, "Chrome": on_badge})


def coupe_speaker() -> GalleryBase:
    """Result 2: a round centre over the cone, and surroundings to its left and right."""
    region = rounded(np.array([[-108.0, -50.0], [100.0, -58.0], [112.0, 52.0], [-92.0, 58.0]]), 44.0)
    centre = circle(42.0, (4.0, 0.0))
    rings = (-16.5, -15.0, -13.5, -12.0, -10.5, -9.0, -7.5, -6.0, -4.5, -3.0, -1.5, 1.5, 3.0)
    cover = _speaker(
        region,
        [Contour(centre, rings)],
        lambda flat: 2.8 * smooth((44 - np.linalg.norm(flat - [4.0, 0.0], axis=1)) / 16),
    )
    grille, inner = cover.within(region), cover.within(centre)
    left = np.zeros_like(grille)
    left[: len(cover.middles)] = cover.middles[:, 0] < 4.0
    around = grille & ~inner
    return GalleryBase(
        cover.mesh,
        grille,
        "Black plastic",
        {"Bronze": grille},
        {"centre": inner, "left": around & left, "right": around & ~left},
    )


def roadster_speaker() -> GalleryBase:
    """Result 3: a drop-shaped grille, wide at one end."""
    turn = np.linspace(0, 2 * np.pi, 720, endpoint=False)
    region = np.stack([88 * np.cos(turn) + 10, (45 + 17 * np.cos(turn)) * np.sin(turn)], axis=1)
    cover = _speaker(region)
    grille = cover.within(region)
    return GalleryBase(cover.mesh, grille, "Black plastic", {"Aluminium": grille})


# -- telephones ----------------------------------------------------------------------------------------------


def conference_station() -> GalleryBase:
    """Result 4: three lobes with a panel each, a round one in the middle, and three buttons between."""
    turn = np.linspace(0, 2 * np.pi, 1440, endpoint=False) - np.pi / 2
    reach = 104 + 36 * np.cos(3 * (turn + np.pi / 2))
    outline = np.stack([reach * np.cos(turn), reach * np.sin(turn)], axis=1)
    panel = rounded(np.array([[46.0, -34], [126, -29], [126, 29], [46, 34]]), 18.0)
    panels = [_turned(panel, angle) for angle in (-90, 30, 150)]
    middle = circle(31.0)
    buttons = [_turned(circle(5.5, (55.0, 0)), angle) for angle in (-30, 90, 210)]
    regions = [*panels, middle]

    def form(flat: Floats) -> Floats:
        away = np.min([beyond(flat, line) for line in regions], axis=0)
        dome = -26 * (np.linalg.norm(flat, axis=1) / 140) ** 2
        return dome + 1.6 * smooth((away - 0.3) / 5)

    def detail(flat: Floats) -> Floats:
        return np.sum([_button(flat, line, 1.4) for line in buttons], axis=0)

    contours = [Contour(line, (-1.2, 1.2, 2.2, 3.2, 4.2, 5.4, 6.6)) for line in regions]
    contours += [Contour(line, STEEP) for line in buttons]
    cover = mould(outline, contours, form, detail, edge=Edge(8, -52, -0.15), fill=3.6)
    names = ("front", "right", "left", "middle")
    parts = dict(zip(names, map(cover.within, regions), strict=True))
    region = _all(*parts.values())
    return GalleryBase(
        cover.mesh,
        region,
        "Black plastic",
        {"Aluminium": region, "Keys": _all(*map(cover.within, buttons))},
        parts,
    )


def _turned(line: Floats, degrees: float) -> Floats:
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    return line @ np.array([[c, s], [-s, c]])


def _box(x: float, y: float, width: float, height: float, radius: float) -> Floats:
    """A rounded rectangle about (x, y)."""
    half = np.array([width, height]) / 2
    return rounded(half * np.array([[-1.0, -1], [1, -1], [1, 1], [-1, 1]]), radius, 16) + [x, y]


def desk_phone() -> GalleryBase:
    """Result 5: a wedge with display, keys and a loudspeaker's grille, and a receiver beside them."""
    outline = _box(0, 0, 196, 196, 20)
    grille = _box(34, -66, 108, 44, 16)
    display = _box(34, 60, 108, 46, 5)
    keys = [_box(2 + 32 * column, 20 - 17 * row, 26, 11.5, 4) for row in range(4) for column in range(3)]
    keys = [key + [0.0, 2.0] for key in keys]
    rise = np.tan(np.radians(11))

    def form(flat: Floats) -> Floats:
        return rise * flat[:, 1] - flat[:, 1] ** 2 / 2600 + 1.2 * smooth((beyond(flat, grille) - 0.3) / 5)

    def detail(flat: Floats) -> Floats:
        sunk = -0.5 * smooth(-beyond(flat, display) / 2.0)
        return sunk + np.sum([_button(flat, key, 1.8) for key in keys], axis=0)

    contours = [
        Contour(grille, (-1.2, 1.2, 2.2, 3.2, 4.2, 5.4, 6.6)),
        Contour(display, (-2.1, -1.4, -0.7, 0.8)),
    ]
    contours += [Contour(key, STEEP) for key in keys]
    cover = mould(outline, contours, form, detail, edge=Edge(9, -42, 0.02), fill=4.5)
    region = cover.within(grille)
    receiver = _receiver(-60.0, form)
    extra = np.zeros(len(receiver.triangles), dtype=bool)
    finishes = {
        "Aluminium": region,
        "Display": cover.within(display),
        "Keys": _all(*map(cover.within, keys)),
    }
    finishes = {name: np.concatenate([mask, extra]) for name, mask in finishes.items()}
    mesh = joined(cover.mesh, receiver)
    return GalleryBase(mesh, np.concatenate([region, extra]), "Anthracite", finishes, bodies=2)


def _receiver(x: float, form: Callable[[Floats], Floats]) -> Mesh:
    """A receiver that lies along the y axis at x: a bow with two wide ends, just above the body."""
    length = 206.0

    def surface(u: Floats, v: Floats) -> Floats:
        along = -np.cos(np.pi * v)  # from end to end, finer there
        end = np.sqrt(np.clip(1 - along**8, 0, 1))
        waist = smooth((np.abs(along) - 0.35) / 0.35)
        across, up = (19 + 6 * waist) * end, (11 + 3 * waist) * end
        bow = 14 * (1 - smooth((np.abs(along) - 0.3) / 0.45))
        c, s = np.cos(u), np.sin(u)
        y = along * length / 2
        ground = form(np.stack([np.full_like(y, x), np.clip(y, -98, 98)], axis=1))
        return np.stack(
            [
                x + across * np.sign(c) * np.abs(c) ** 0.7,
                y,
                ground + 15.5 + bow + up * np.sign(s) * np.abs(s) ** 0.7,
            ],
            axis=1,
        )

    return flipped(closed_sheet(grid_sheet(np.linspace(0, 2 * np.pi, 73), np.linspace(0, 1, 91), surface)))


# -- a printer -----------------------------------------------------------------------------------------------


def printer_panel() -> GalleryBase:
    """Result 6: the side of a laser printer, with vents over the fuser and a grip sunk below them."""
    outline = _box(0, 0, 380, 270, 24)
    vents = rounded(np.array([[-152.0, -22.0], [150.0, -22.0], [150.0, 100.0], [-96.0, 100.0]]), 22.0)
    grip = _box(84, -84, 130, 40, 19)
    badge = rounded(np.array([[-150.0, -102], [-96.0, -102], [-96.0, -92], [-150.0, -92]]), 3.0, 16)

    def form(flat: Floats) -> Floats:
        x, y = flat.T
        crown = -(x**2) / 5200 - y**2 / 3400
        return crown + _bead(beyond(flat, vents), 2.2) - 8 * smooth((-beyond(flat, grip) + 1) / 14)

    def detail(flat: Floats) -> Floats:
        return 0.9 * smooth(-beyond(flat, badge) / 2.2)

    contours = [
        Contour(vents, BEAD),
        Contour(grip, (-15, -13, -11, -9, -7, -5, -3, -1.5, 1.5)),
        Contour(badge, (-2.2, -1.5, -0.8, 1.2)),
    ]
    cover = mould(outline, contours, form, detail, edge=Edge(10, -34), fill=5)
    region = cover.within(vents)
    return GalleryBase(
        cover.mesh, region, "Light plastic", {"Anthracite": region, "Chrome": cover.within(badge)}
    )


BASES: Mapping[str, Callable[[], GalleryBase]] = {
    "speaker-uniform": sedan_speaker,
    "speaker-round-centre": coupe_speaker,
    "speaker-graded": roadster_speaker,
    "conference-station": conference_station,
    "desk-phone": desk_phone,
    "printer-panel": printer_panel,
}
