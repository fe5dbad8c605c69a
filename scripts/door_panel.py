"""A base geometry to show the method on: the speaker panel of a car door, with an island for the tweeter.

A shell of 2.5 mm, curved both ways, with a flange turned down all round. The target region is a rounded
trapezoid, sunk behind a soft bead, less a round island. All contours are offsets of the region's outline or
circles round the island, so that the mesh follows them; lengths in millimetres.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import Delaunay, cKDTree

from bubble_pattern_addon.core.mesh import Bools, Floats, Ints, Mesh
from scripts.moulding import counter_clockwise, smooth, vertex_normals

THICKNESS = 2.5
CORNERS = np.array([[-84.0, -50.0], [78.0, -46.0], [88.0, 38.0], [-62.0, 52.0]])
ROUNDING = (30.0, 24.0, 30.0, 36.0)
"""Corners of the region's outline, counter-clockwise, and the radii that round them."""
ISLAND = (46.0, -4.0)
ISLAND_RADIUS = 19.0
STEP = 1.5
"""Distance of vertices along the outline."""
FILL = 3.6
"""Distance of vertices inside the region."""
FILLET, FLANGE = 6.0, 7.0
"""The outer edge: radius of its bend and depth of the flange below it."""
RIM_WIDTH = 21.0


@dataclass(frozen=True)
class DoorPanel:
    """The base with masks (T,) of the triangles that are the target region and the island's face."""

    mesh: Mesh
    region: Bools
    island: Bools


def make_door_panel() -> DoorPanel:
    """The panel, centred on the origin, its visible side up."""
    flat, offset, edge = _layout()
    triangles = Delaunay(flat).simplices.astype(np.int64)
    # along the straight sides rounding makes slivers out of three points of the outermost ring
    triangles = triangles[~np.isin(triangles, edge).all(axis=1)]
    middle = flat[triangles].mean(axis=1)
    triangles = counter_clockwise(flat, triangles)
    on_island = np.linalg.norm(middle - ISLAND, axis=1) < ISLAND_RADIUS
    # a triangle lies inside the outline when all its corners do
    inside = (offset[triangles] <= 1e-9).all(axis=1)
    top = _in_space(flat, offset)
    bottom = top - THICKNESS * vertex_normals(top, triangles)
    count = len(top)
    following = np.roll(edge, -1)
    wall = np.concatenate(
        [
            np.stack([edge, edge + count, following + count], axis=1),
            np.stack([edge, following + count, following], axis=1),
        ]
    )
    mesh = Mesh(np.concatenate([top, bottom]), np.concatenate([triangles, triangles[:, ::-1] + count, wall]))
    others = np.zeros(len(triangles) + len(wall), dtype=bool)
    return DoorPanel(
        mesh, np.concatenate([inside & ~on_island, others]), np.concatenate([on_island & inside, others])
    )


def outline(step: float = STEP) -> tuple[Floats, Floats]:
    """Points (n, 2) evenly along the region's outline, and the outward unit normals there."""
    pieces, normals = [], []
    for i, radius in enumerate(ROUNDING):
        corner = CORNERS[i]
        before, after = CORNERS[i - 1] - corner, CORNERS[(i + 1) % 4] - corner
        before, after = before / np.linalg.norm(before), after / np.linalg.norm(after)
        half = np.arccos(np.clip(before @ after, -1, 1)) / 2
        bisector = (before + after) / np.linalg.norm(before + after)
        centre = corner + bisector * radius / np.sin(half)
        start = np.arctan2(*_across(before)[::-1])
        turn = np.linspace(0, np.pi - 2 * half, 200) + start
        normal = np.stack([np.cos(turn), np.sin(turn)], axis=1)
        pieces.append(centre + radius * normal)
        normals.append(normal)
    points, normal = np.concatenate(pieces), np.concatenate(normals)
    closed = np.concatenate([points, points[:1]])
    along = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(closed, axis=0), axis=1))])
    places = np.linspace(0, along[-1], round(along[-1] / step), endpoint=False)
    angle = np.unwrap(np.arctan2(normal[:, 1], normal[:, 0]))
    angle = np.interp(places, along, np.append(angle, angle[0] + 2 * np.pi))
    place = np.stack([np.interp(places, along, closed[:, k]) for k in (0, 1)], axis=1)
    return place, np.stack([np.cos(angle), np.sin(angle)], axis=1)


def _across(direction: Floats) -> Floats:
    return np.array([-direction[1], direction[0]])


def _layout() -> tuple[Floats, Floats, Ints]:
    """Vertices in the plane (n, 2), their offset from the outline (n,), and the rows of the outermost ring.

    Outside the outline the offset is the length along the section, bend and flange unrolled.
    """
    line, normal = outline()
    end = RIM_WIDTH + FILLET * np.pi / 2 + FLANGE
    rings = [*np.arange(-3, RIM_WIDTH, 1.0), *np.linspace(RIM_WIDTH, RIM_WIDTH + FILLET * np.pi / 2, 9)]
    rings += [*np.linspace(rings[-1], end, 5)[1:]]
    parts = [line + normal * ring for ring in rings]
    offsets = [np.full(len(line), ring) for ring in rings]
    around = round(2 * np.pi * ISLAND_RADIUS / STEP)
    for radius in np.concatenate([np.arange(ISLAND_RADIUS + 3, 2.0, -1.0)]):
        turn = np.linspace(0, 2 * np.pi, max(6, min(around, round(2 * np.pi * radius / 1.2))), endpoint=False)
        parts.append(ISLAND + radius * np.stack([np.cos(turn), np.sin(turn)], axis=1))
        offsets.append(np.full(len(turn), -np.inf))
    fill = _fill(line, normal)
    parts += [np.array([ISLAND]), fill]
    offsets += [np.full(1, -np.inf), np.full(len(fill), -np.inf)]
    edge = np.arange(len(line)) + len(line) * (len(rings) - 1)
    return np.concatenate(parts), np.concatenate(offsets), edge


def _fill(line: Floats, normal: Floats) -> Floats:
    """A hexagonal grid inside the outline, clear of its rings and those of the island."""
    low, high = line.min(axis=0), line.max(axis=0)
    x, y = np.meshgrid(np.arange(low[0], high[0], FILL), np.arange(low[1], high[1], FILL * np.sqrt(0.75)))
    x[1::2] += FILL / 2
    grid = np.stack([x.ravel(), y.ravel()], axis=1)
    _, nearest = cKDTree(line).query(grid)
    depth = ((line[nearest] - grid) * normal[nearest]).sum(axis=1)
    clear = np.linalg.norm(grid - ISLAND, axis=1) > ISLAND_RADIUS + 3 + 0.6 * FILL
    return grid[(depth > 3 + 0.6 * FILL) & clear]


def _in_space(flat: Floats, offset: Floats) -> Floats:
    """The visible surface over the unrolled plane: crown, bead round the region, island, bend and flange."""
    arc = np.clip((offset - RIM_WIDTH) / FILLET, 0, np.pi / 2)
    down = np.clip(offset - RIM_WIDTH - FILLET * np.pi / 2, 0, None)
    beyond = np.clip(offset - RIM_WIDTH, 0, None)
    shrink = np.where(beyond > 0, FILLET * np.sin(arc) + 0.05 * down - beyond, 0)  # flange with draft
    x, y = (flat + shrink[:, None] * _outward(flat)).T
    crown = -(x**2) / (2 * 400) - y**2 / (2 * 260) - 0.0004 * x * y
    bead = 2.6 * smooth((offset - 0.4) / 6.5) - 1.0 * smooth((offset - 8.5) / 11)
    r = np.linalg.norm(flat - ISLAND, axis=1)
    # gentle enough to be offset by the thickness: the quintic's sharpest radius is width^2 / (5.8 height)
    cap = 1.9 * smooth((ISLAND_RADIUS - r) / 5.5) - 1.0 * smooth((13 - r) / 4.5) + 0.4 * smooth((8 - r) / 8)
    z = crown + bead + cap - FILLET * (1 - np.cos(arc)) - down
    return np.stack([x, y, z], axis=1)


def _outward(flat: Floats) -> Floats:
    line, normal = outline()
    return normal[cKDTree(line).query(flat)[1]]
