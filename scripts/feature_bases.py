"""Bases that show the kinds of features, one function each; in millimetres, the visible side up."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from bubble_pattern_addon.core.mesh import Floats, Mesh
from scripts.gallery_bases import BEAD, STEEP, GalleryBase
from scripts.moulding import Contour, Edge, beyond, grown, mould, smooth
from scripts.shapes import circle, closed_sheet, flipped, grid_sheet, rounded, sphere_sheet


def vent_cover() -> GalleryBase:
    """A ventilated cover, curved both ways, whose plate lies behind a bead: for countersunk holes."""
    plate = rounded(np.array([[-60.0, -35.0], [58.0, -38.0], [62.0, 34.0], [-56.0, 37.0]]), 18.0)

    def form(flat: Floats) -> Floats:
        x, y = flat.T
        return -(x**2) / 900 - y**2 / 620 + 2.0 * smooth((beyond(flat, plate) - 0.4) / 6.5)

    cover = mould(grown(plate, 15), [Contour(plate, BEAD)], form, edge=Edge(7, -26))
    region = cover.within(plate)
    return GalleryBase(cover.mesh, region, "Black plastic", {"Aluminium": region})


def round_speaker() -> GalleryBase:
    """The top of a round loudspeaker with a button in its middle: a ring for slots."""
    outer, inner, button = circle(54.0), circle(34.5), circle(23.0)

    def form(flat: Floats) -> Floats:
        away = np.linalg.norm(flat, axis=1)
        return 1.6 * smooth((away - 54.4) / 6) + 1.6 * smooth((34.1 - away) / 5) - away**2 / 1500

    def detail(flat: Floats) -> Floats:
        return 1.4 * smooth(-beyond(flat, button) / 2.8)

    rings = [Contour(outer, BEAD[:8]), Contour(inner, [-ring for ring in BEAD[:6]]), Contour(button, STEEP)]
    cover = mould(circle(64.0), rings, form, detail, edge=Edge(7, -30))
    region = cover.within(outer) & ~cover.within(inner)
    return GalleryBase(
        cover.mesh, region, "Light plastic", {"Anthracite": region, "Chrome": cover.within(button)}
    )


def shower_head() -> GalleryBase:
    """A round plate, slightly domed, in a wide rim: for drops that point to its middle."""
    plate = circle(52.0)

    def form(flat: Floats) -> Floats:
        away = np.linalg.norm(flat, axis=1)
        return 1.8 * smooth((away - 52.4) / 6) - away**2 / 900

    cover = mould(circle(63.0), [Contour(plate, BEAD[:8])], form, edge=Edge(8, -26))
    region = cover.within(plate)
    return GalleryBase(cover.mesh, region, "Chrome", {"Light plastic": region})


def golf_ball() -> GalleryBase:
    """A ball all over which the pattern goes, without a boundary."""
    mesh = sphere_sheet(21.35, 6)
    return GalleryBase(mesh, np.ones(len(mesh.triangles), dtype=bool), "Light plastic", {})


def pedal() -> GalleryBase:
    """A pedal's pad, wider at its foot, bent along its length: for bosses that give hold."""
    pad = rounded(np.array([[-44.0, -27.0], [46.0, -35.0], [46.0, 35.0], [-44.0, 27.0]]), 13.0)

    def form(flat: Floats) -> Floats:
        return -(flat[:, 0] ** 2) / 420 + 1.2 * smooth((beyond(flat, pad) - 0.3) / 5)

    cover = mould(grown(pad, 10), [Contour(pad, BEAD[:7])], form, edge=Edge(6, -22))
    region = cover.within(pad)
    return GalleryBase(cover.mesh, region, "Aluminium", {"Anthracite": region})


def handle() -> GalleryBase:
    """A tool's handle, which lies along x: swelling in the middle, with a collar at one end."""
    length, around, along = 130.0, 144, 190

    def surface(u: Floats, v: Floats) -> Floats:
        x = length * v
        ends = np.sqrt(np.clip(1 - np.abs(2 * v - 1) ** 14, 0, 1))
        collar = 3.0 * smooth((x - 108) / 7) - smooth((x - 118) / 8)
        reach = (15.0 + 2.6 * np.sin(np.pi * v) ** 2 + collar) * ends
        return np.stack([x - length / 2, reach * np.cos(u), reach * np.sin(u)], axis=1)

    turn, way = np.linspace(0, 2 * np.pi, around + 1), (1 - np.cos(np.linspace(0, np.pi, along))) / 2
    mesh = _outward(closed_sheet(grid_sheet(turn, way, surface)))
    # between two rings of vertices, so that the boundary is smooth
    low, high = (length * (way[ring] - 0.5) for ring in (34, 130))
    x = mesh.corners[:, :, 0]
    region = np.all((x > low - 1e-6) & (x < high + 1e-6), axis=1)
    return GalleryBase(mesh, region, "Anthracite", {"Black plastic": region})


def _outward(mesh: Mesh) -> Mesh:
    """The closed mesh, facing outward."""
    volume = (mesh.corners.mean(axis=1) * mesh.area_vectors).sum()
    return mesh if volume > 0 else flipped(mesh)


FEATURE_BASES: Mapping[str, Callable[[], GalleryBase]] = {
    "countersunk": vent_cover,
    "slots": round_speaker,
    "drops": shower_head,
    "dimples": golf_ball,
    "bosses": pedal,
    "grip": handle,
}
