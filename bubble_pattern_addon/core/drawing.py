"""Drawings of a pattern: laid flat and true to length, or projected along a direction.

Features keep their true size when laid flat. Projected they look as they are seen: a round one that leans is
an ellipse.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from .cycles import members
from .errors import RegionError
from .flattening import Flat, flatten
from .mesh import Bools, Floats, Ints
from .pattern import Pattern, take
from .region import Region, boundary_loops, region_of
from .surface import Charts, Complex, make_charts, on_region, to_frame
from .toml_values import Point

# Of the drawing's size: what stays free between parts that are laid flat side by side.
GAP = 0.05
# Mean of unit normals below which a part, such as a tube, faces no way in particular.
FACING = 0.1
# A round feature whose short axis is this share of its long one is drawn as a circle.
ROUND = 1 - 1e-9


class Line(NamedTuple):
    """A line of straight pieces: points (k, 2), and whether the last is joined to the first."""

    points: Floats
    closed: bool


@dataclass(frozen=True)
class Drawing:
    """A pattern in the plane, in millimetres, x to the right and y up, seen from outside.

    ids: (n,) of the features drawn; centre: (n, 2); diameter: (n,)
    major: (n, 2) unit direction of the long axis of a round feature; ratio: (n,) of its short over its long
    one
    outlines: (n, k, 2) closed outlines of features that are not round; None: all are
    boundary: of the target region; cuts: where it was cut open to be laid flat, from both sides
    stretch: the largest factor by which a length of the region is longer or shorter; nan where it is
    projected
    hidden: how many features face away and are not drawn; across: how many reach over a cut
    """

    ids: Ints
    centre: Floats
    diameter: Floats
    major: Floats
    ratio: Floats
    outlines: Floats | None
    boundary: tuple[Line, ...]
    cuts: tuple[Line, ...]
    stretch: float
    hidden: int
    across: int

    @property
    def extent(self) -> tuple[Floats, Floats]:
        """Lowest and highest x and y of all that is drawn, each (2,)."""
        points = [line.points for line in (*self.boundary, *self.cuts)]
        reach = self.diameter[:, None] / 2
        points += [self.centre - reach, self.centre + reach]
        if self.outlines is not None:
            points.append(self.outlines.reshape(-1, 2))
        every = np.concatenate(points)
        return every.min(axis=0), every.max(axis=0)


class Shapes(NamedTuple):
    """Features in space. axis, heading: (n, 3) unit vectors; outlines: (n, k, 2) in the frame of heading,
    axis x heading; None for circles.
    """

    axis: Floats
    heading: Floats
    outlines: Floats | None = None


def make_drawing(
    region: Region,
    pattern: Pattern,
    projection: str | Point = "flat",
    align: str = "base",
    millimetres: float = 1.0,
    shapes: Shapes | None = None,
) -> Drawing:
    """The drawing of a pattern on its region.

    projection: "flat", laid flat, its lower left corner at 0; "normal", projected along the region's mean
    normal; or a direction towards the viewer. align: the drawing is upright as the "base" stands (z is up, or
    y where z is square to the paper), or its x axis runs along the "rows". millimetres: in a unit of the base
    shapes: what the features look like; None: circles square to their axes

    Raises RegionError where the region can't be laid flat, or faces all ways.
    """
    if shapes is None:
        shapes = Shapes(axes_of(pattern), headings_of(pattern))
    if not isinstance(projection, str):
        drawing = _projected(region, pattern, np.array(projection, dtype=np.float64), align, shapes)
    elif projection == "normal":
        drawing = _projected(region, pattern, _mean_normal(region), align, shapes)
    else:
        drawing = _laid_flat(region, pattern, align, shapes)
    return _scaled(drawing, millimetres)


def axes_of(pattern: Pattern) -> Floats:
    """The directions in which the features stand, (n, 3)."""
    return pattern.normal if pattern.axis is None else pattern.axis


def headings_of(pattern: Pattern) -> Floats:
    """The features' x axes, (n, 3)."""
    return pattern.tangent if pattern.heading is None else pattern.heading


def _mean_normal(region: Region) -> Floats:
    total = region.area_vectors.sum(axis=0)
    if np.linalg.norm(total) < FACING * np.linalg.norm(region.area_vectors, axis=1).sum():
        raise RegionError(
            "The target region faces all ways, so it has no front to be drawn from: give a direction as "
            'projection, or lay it flat with projection = "flat"'
        )
    return np.asarray(total)


def view_axes(sight: Floats) -> tuple[Floats, Floats, Floats]:
    """Unit vectors to the right, up and towards the viewer, as CAD views have them: z is up where it can be,
    y where the paper is nearly square to z.
    """
    sight = sight / np.linalg.norm(sight)
    up = np.array([0.0, 1.0, 0.0] if abs(sight[2]) > np.sqrt(0.5) else [0.0, 0.0, 1.0])
    right = np.cross(up, sight)
    right /= np.linalg.norm(right)
    return right, np.cross(sight, right), sight


# -- projected -----------------------------------------------------------------------------------------------


def _projected(region: Region, pattern: Pattern, sight: Floats, align: str, shapes: Shapes) -> Drawing:
    right, up, sight = view_axes(sight)
    facing = shapes.axis @ sight > 1e-6
    if not facing.any():
        raise RegionError(
            "All features face away from the drawing's viewer: turn the direction of projection round"
        )
    if align == "rows":
        along = (pattern.tangent @ right + 1j * (pattern.tangent @ up))[facing]
        turn = _row_angle(along)
        right, up = np.cos(turn) * right + np.sin(turn) * up, np.cos(turn) * up - np.sin(turn) * right
    paper = np.stack([right, up], axis=1)
    seen = take(pattern, facing)
    axis, heading = shapes.axis[facing], shapes.heading[facing]
    outlines = None
    if shapes.outlines is not None:
        across = np.cross(axis, heading)
        frame = np.stack([heading, across], axis=1) @ paper
        outlines = (seen.position @ paper)[:, None] + shapes.outlines[facing] @ frame
    long = np.cross(sight, axis) @ paper
    length = np.linalg.norm(long, axis=1, keepdims=True)
    major = np.where(length > 1e-9, long / np.maximum(length, 1e-300), [1.0, 0.0])
    corners = (region.corners @ paper) @ np.array([1.0, 1j])
    boundary, _ = _lines(region, corners, np.zeros(corners.shape, dtype=bool))
    return Drawing(
        seen.ids,
        seen.position @ paper,
        seen.diameter,
        major,
        np.minimum(axis @ sight, 1.0),
        outlines,
        boundary,
        (),
        np.nan,
        int((~facing).sum()),
        0,
    )


def _row_angle(along: Complex) -> float:
    """The angle, within 30 degrees either way, by which the rows of an arrangement lie off the x axis."""
    return float(np.angle((along**6).sum()) / 6)


# -- laid flat -----------------------------------------------------------------------------------------------


def _laid_flat(region: Region, pattern: Pattern, align: str, shapes: Shapes) -> Drawing:
    # without the borders between its sub-regions
    whole = region_of(region.base, region.mesh, region.triangles, None, 0.0, region.within)
    charts = make_charts(whole)
    flat = flatten(whole)
    row, barycentric = on_region(whole, pattern.places)
    turn = _turns(charts, flat.corners)
    heading = to_frame(charts, row, shapes.heading) * turn[row]
    heading /= np.maximum(np.abs(heading), 1e-300)
    rows = to_frame(charts, row, pattern.tangent) * turn[row]
    upright = _upright(whole, charts, flat, turn)
    if align == "rows":
        upright = upright * np.exp(
            -1j * _row_angles(rows * upright[flat.part[row]], flat.part[row], len(upright))
        )
    corners = _side_by_side(flat.corners * upright[flat.part][:, None], flat.part)
    centre = np.einsum("nk,nk->n", barycentric, corners[row])
    _refuse_overlap(centre, pattern)
    heading = heading * upright[flat.part[row]]
    outlines = None
    if shapes.outlines is not None:
        turned = (shapes.outlines @ np.array([1.0, 1j])) * heading[:, None]
        outlines = _plane(centre[:, None] + turned)
    boundary, cuts = _lines(region, corners, flat.cuts)
    middle = _plane(centre)
    return Drawing(
        pattern.ids,
        middle,
        pattern.diameter,
        _plane(heading),
        np.ones(len(pattern)),
        outlines,
        boundary,
        cuts,
        flat.stretch,
        0,
        _reaching(middle, pattern.diameter, cuts),
    )


def _plane(points: Complex) -> Floats:
    return np.stack([points.real, points.imag], axis=-1)


def _turns(charts: Charts, corners: Complex) -> Complex:
    """Unit rotations (R,) from the triangles' frames to the flat map."""
    was, is_ = (np.roll(c, -1, axis=1) - c for c in (charts.corners, corners))
    turn = (was.conj() * is_).sum(axis=1)
    return turn / np.abs(turn)


def _upright(region: Region, charts: Charts, flat: Flat, turn: Complex) -> Complex:
    """Unit rotations, one for each part, that let its flat map stand as the base stands."""
    parts = int(flat.part.max()) + 1
    area = np.linalg.norm(region.area_vectors, axis=1)
    weight = turn * area
    rows = np.arange(len(area))

    def seen(axis: Floats) -> Complex:
        """Where an axis of the base points on the flat map of every part, (parts,), as long as it is seen."""
        values = to_frame(charts, rows, np.broadcast_to(axis, (len(rows), 3))) * weight
        return np.bincount(flat.part, values.real, parts) + 1j * np.bincount(flat.part, values.imag, parts)

    x, y, z = (seen(axis) for axis in np.eye(3))
    total = np.bincount(flat.part, area, parts)
    upright = np.empty(parts, dtype=np.complex128)
    for part in range(parts):
        normal = region.area_vectors[flat.part == part].sum(axis=0)
        axes = np.array([x[part], y[part], z[part]])
        if np.linalg.norm(normal) > FACING * total[part]:
            right, up, _ = view_axes(normal)
            direction = axes @ right - 1j * (axes @ up)
        else:
            # x to the right, y or z up, whichever is seen best: along a tube
            best = int(np.round(np.abs(axes) / total[part], 6).argmax())
            direction = axes[best] * (1.0, -1j, -1j)[best]
        upright[part] = direction.conjugate() / abs(direction) if abs(direction) > 0 else 1.0
    return upright


def _row_angles(along: Complex, part: Ints, parts: int) -> Floats:
    six = along**6
    return np.angle(np.bincount(part, six.real, parts) + 1j * np.bincount(part, six.imag, parts)) / 6


def _side_by_side(corners: Complex, part: Ints) -> Complex:
    """The parts from left to right, standing on the x axis, from x = 0."""
    x, y = corners.real.copy(), corners.imag.copy()
    parts = [part == label for label in range(int(part.max()) + 1)]
    gap = GAP * max(max(float(np.ptp(x[mine])), float(np.ptp(y[mine]))) for mine in parts)
    at = 0.0
    for mine in parts:
        width = float(np.ptp(x[mine]))
        x[mine] += at - x[mine].min()
        y[mine] -= y[mine].min()
        at += width + gap
    result: Complex = x + 1j * y
    return result


def _refuse_overlap(centre: Complex, pattern: Pattern) -> None:
    """RegionError where features that are apart in space fall together on the flat map."""
    points, radius = _plane(centre), pattern.diameter / 2
    if not len(points):
        return
    one, two = cKDTree(points).query_pairs(2 * float(radius.max()), output_type="ndarray").T
    reach = radius[one] + radius[two]
    together = np.linalg.norm(points[one] - points[two], axis=1) < 0.9 * reach
    apart = np.linalg.norm(pattern.position[one] - pattern.position[two], axis=1) > reach
    if (together & apart).any():
        x, y, z = pattern.position[one[together & apart][0]]
        raise RegionError(
            f"The target region comes to lie over itself when it is laid flat (near {x:.4g}, {y:.4g}, "
            f"{z:.4g}): draw it projected, or divide it into smaller regions"
        )


def _reaching(centre: Floats, diameter: Floats, cuts: tuple[Line, ...]) -> int:
    """How many features reach over a cut."""
    if not cuts or not len(centre):
        return 0
    step = float(diameter.min()) / 8
    samples = []
    for line in cuts:
        ends = np.stack([line.points[:-1], line.points[1:]], axis=1)
        length = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
        number = np.ceil(length / step).astype(np.int64) + 1
        owner, place = members(number)
        share = place / (number[owner] - 1).clip(1)
        samples.append(ends[owner, 0] + share[:, None] * (ends[owner, 1] - ends[owner, 0]))
    distance, _ = cKDTree(np.concatenate(samples)).query(centre)
    return int((distance < diameter / 2 * (1 - 1e-3)).sum())


# -- lines ---------------------------------------------------------------------------------------------------


def _lines(region: Region, corners: Complex, cuts: Bools) -> tuple[tuple[Line, ...], tuple[Line, ...]]:
    """The boundary's lines, and those of the cuts, when the triangles' corners lie at `corners` (R, 3)."""
    neighbours, opposite = np.where(cuts, -1, region.neighbours), np.where(cuts, -1, region.opposite)
    loops, rim = boundary_loops(region.mesh.triangles, neighbours, opposite)
    row, corner = rim.T
    start, end = corners[row, (corner + 1) % 3], corners[row, (corner + 2) % 3]
    is_cut = cuts[row, corner]
    found: dict[bool, list[Line]] = {False: [], True: []}
    first = 0
    for loop in loops:
        here = slice(first, first + len(loop))
        first += len(loop)
        for kind, line in _runs(_plane(start[here]), _plane(end[here]), is_cut[here]):
            found[kind].append(line)
    return tuple(found[False]), tuple(found[True])


def _runs(start: Floats, end: Floats, is_cut: Bools) -> list[tuple[bool, Line]]:
    """The lines of a closed loop: one where all of it is of a kind, else one for each run of a kind."""
    changes = np.flatnonzero(is_cut != np.roll(is_cut, 1))
    if not len(changes):
        return [(bool(is_cut[0]), Line(start, True))]
    order = np.roll(np.arange(len(start)), -changes[0])
    bounds = np.append(changes - changes[0], len(start))
    runs = []
    for low, high in pairwise(bounds.tolist()):
        these = order[low:high]
        points = np.concatenate([start[these], end[these[-1:]]])
        runs.append((bool(is_cut[these[0]]), Line(points, False)))
    return runs


def _scaled(drawing: Drawing, factor: float) -> Drawing:
    def larger(lines: tuple[Line, ...]) -> tuple[Line, ...]:
        """The lines, `factor` times as large."""
        return tuple(Line(line.points * factor, line.closed) for line in lines)

    return replace(
        drawing,
        centre=drawing.centre * factor,
        diameter=drawing.diameter * factor,
        outlines=None if drawing.outlines is None else drawing.outlines * factor,
        boundary=larger(drawing.boundary),
        cuts=larger(drawing.cuts),
    )
