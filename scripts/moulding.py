"""Moulded covers to put patterns on: a top drawn in plan and raised by a height, an edge bent down, a foot.

A cover is drawn by its outline and by contours that the mesh shall follow; lengths in millimetres.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial import Delaunay, cKDTree

from bubble_pattern_addon.core.mesh import Bools, Floats, Ints, Mesh
from scripts.shapes import doubled_areas, inside_outline

THICKNESS = 2.5
STEP = 1.5
"""Distance of vertices along contours."""
CLEAR = 0.5
"""Vertices of different contours keep this distance."""


@dataclass(frozen=True)
class Contour:
    """A closed line (k, 2) that the mesh follows, counter-clockwise, and rings of vertices beside it, where
    the height changes quickly, by their distance outward (negative: inward).
    """

    line: Floats
    rings: Sequence[float] = (-2.4, -1.2, 1.2, 2.4)


@dataclass(frozen=True)
class Cover:
    """mesh: the solid; its first triangles are the top's, whose middles in plan are `middles` (t, 2)."""

    mesh: Mesh
    middles: Floats

    def within(self, line: Floats) -> Bools:
        """Mask (T,) of the triangles of the top inside a closed line (k, 2)."""
        mask = np.zeros(len(self.mesh.triangles), dtype=bool)
        mask[: len(self.middles)] = inside_outline(self.middles, [line])
        return mask


@dataclass(frozen=True)
class Edge:
    """radius of the bend round the outline; foot: the height at which the wall below it ends; draft: how far
    the wall leans outward per length.
    """

    radius: float = 6.0
    foot: float = -14.0
    draft: float = 0.04


def mould(
    outline: Floats,
    contours: Sequence[Contour],
    form: Callable[[Floats], Floats],
    detail: Callable[[Floats], Floats] | None = None,
    *,
    edge: Edge = Edge(),
    thickness: float = THICKNESS,
    fill: float = 4.0,
) -> Cover:
    """A closed shell of even thickness under a top with this outline (k, 2), counter-clockwise.

    form: heights (n,) over the plan (n, 2), gentle enough to be offset by the thickness
    detail: heights of small things on the visible side alone, such as keys
    fill: distance of vertices away from all contours
    """
    line = resampled(outline)
    flat = _plan(line, contours, fill)
    triangles = Delaunay(flat).simplices.astype(np.int64)
    # beyond the outline, and where rounding makes slivers out of three points of it
    triangles = triangles[~(triangles < len(line)).all(axis=1)]
    triangles = counter_clockwise(flat, triangles)
    plain = np.column_stack([flat, form(flat)])
    rows, start = _bend(line, form, edge), len(flat)
    strips = _strips(
        np.concatenate([[np.arange(len(line))], start + np.arange(rows[..., 0].size).reshape(rows.shape[:2])])
    )
    skin = np.concatenate([plain, rows.reshape(-1, 3)])
    faces = np.concatenate([triangles, strips])
    inner = skin - thickness * vertex_normals(skin, faces)
    last = len(skin) - len(line)
    inner[last:, 2] = edge.foot  # the wall ends flat, to stand on
    skin[: len(flat), 2] += 0 if detail is None else detail(flat)
    foot = np.arange(last, len(skin))
    rim = _strips(np.stack([foot, foot + len(skin)]))
    mesh = Mesh(
        np.concatenate([skin, inner]),
        np.concatenate([faces, faces[:, ::-1] + len(skin), rim]),
    )
    return Cover(mesh, flat[triangles].mean(axis=1))


def _plan(line: Floats, contours: Sequence[Contour], fill: float) -> Floats:
    """Vertices in the plane (n, 2), those of the outline first."""
    points = np.concatenate([line, *(resampled(contour.line) for contour in contours)])
    for loop, rings in [(line, (-1.2, -2.4, -3.6)), *((c.line, c.rings) for c in contours)]:
        even = resampled(loop)
        for ring in rings:
            points = _added(points, even + ring * outward(even), CLEAR, line)
    low, high = line.min(axis=0), line.max(axis=0)
    x, y = np.meshgrid(np.arange(low[0], high[0], fill), np.arange(low[1], high[1], fill * np.sqrt(0.75)))
    x[1::2] += fill / 2
    return _added(points, np.stack([x.ravel(), y.ravel()], axis=1), 0.65 * fill, line)


def _added(points: Floats, more: Floats, clear: float, line: Floats) -> Floats:
    """The points with those of `more` that are inside the outline and clear of them."""
    more = more[inside_outline(more, [line])]
    return np.concatenate([points, more[cKDTree(points).query(more)[0] > clear]])


def _bend(line: Floats, form: Callable[[Floats], Floats], edge: Edge) -> Floats:
    """Rows of vertices (rows, k, 3) round the bend and down the wall; the bend goes on as the top slopes."""
    normal, height = outward(line), form(line)
    slope = (height - form(line - 0.2 * normal)) / 0.2
    rows = []
    for turn in np.linspace(0, np.pi / 2, 10)[1:]:
        out = edge.radius * np.sin(turn)
        rows.append(
            np.column_stack([line + out * normal, height + slope * out - edge.radius * (1 - np.cos(turn))])
        )
    top = rows[-1]
    for share in np.linspace(0, 1, 6)[1:]:
        down = share * (top[:, 2] - edge.foot)
        rows.append(np.column_stack([top[:, :2] + edge.draft * down[:, None] * normal, top[:, 2] - down]))
    return np.stack(rows)


def _strips(rows: Ints) -> Ints:
    """Triangles (T, 3) between rows (r, k) of a closed wall's vertices, from the top down, facing outward."""
    upper, lower = rows[:-1], rows[1:]
    upper_next, lower_next = np.roll(upper, -1, axis=1), np.roll(lower, -1, axis=1)
    first = np.stack([upper, lower, lower_next], axis=-1)
    second = np.stack([upper, lower_next, upper_next], axis=-1)
    return np.concatenate([first.reshape(-1, 3), second.reshape(-1, 3)])


# -- lines in plan -------------------------------------------------------------------------------------------


def resampled(line: Floats, step: float = STEP) -> Floats:
    """Points (n, 2) evenly along a closed line (k, 2), about `step` apart."""
    closed = np.concatenate([line, line[:1]])
    along = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(closed, axis=0), axis=1))])
    places = np.linspace(0, along[-1], round(along[-1] / step), endpoint=False)
    return np.stack([np.interp(places, along, closed[:, k]) for k in (0, 1)], axis=1)


def outward(line: Floats) -> Floats:
    """Unit normals (n, 2) of an even counter-clockwise line."""
    along = np.roll(line, -1, axis=0) - np.roll(line, 1, axis=0)
    normal = np.stack([along[:, 1], -along[:, 0]], axis=1)
    return normal / np.linalg.norm(normal, axis=1, keepdims=True)


def grown(line: Floats, distance: float) -> Floats:
    """A closed line (k, 2), resampled, `distance` outside this one."""
    even = resampled(line)
    return even + distance * outward(even)


def beyond(points: Floats, line: Floats) -> Floats:
    """Distance (n,) of points (n, 2) from a closed line (k, 2), below 0 inside."""
    start, way = line, np.roll(line, -1, axis=0) - line
    keep = (way**2).sum(axis=1) > 0
    start, way = start[keep], way[keep]
    distance = np.full(len(points), np.inf)
    for some in np.array_split(np.arange(len(points)), len(points) * len(way) // 1_000_000 + 1):
        to = points[some, None] - start
        share = np.clip((to * way).sum(axis=2) / (way**2).sum(axis=1), 0, 1)
        distance[some] = np.linalg.norm(to - share[..., None] * way, axis=2).min(axis=1)
    return np.where(inside_outline(points, [line]), -distance, distance)


# -- surfaces ------------------------------------------------------------------------------------------------


def smooth(x: Floats) -> Floats:
    """From 0 at x <= 0 to 1 at x >= 1, with flat ends and flat curvature there (Perlin's quintic)."""
    x = np.clip(x, 0, 1)
    return x**3 * (10 - 15 * x + 6 * x**2)


def counter_clockwise(flat: Floats, triangles: Ints) -> Ints:
    """The triangles (T, 3) on points (n, 2), those that run clockwise turned over."""
    turned = doubled_areas(flat, triangles) < 0
    triangles[turned] = triangles[turned][:, ::-1]
    return triangles


def vertex_normals(vertices: Floats, triangles: Ints) -> Floats:
    """Unit normals at the vertices, triangles weighted by area."""
    vectors = Mesh(vertices, triangles).area_vectors
    summed = np.zeros_like(vertices)
    for corner in range(3):
        np.add.at(summed, triangles[:, corner], vectors)
    return summed / np.linalg.norm(summed, axis=1, keepdims=True)
