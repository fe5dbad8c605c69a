"""Keep-outs: places on the target region, such as screw bosses or a logo, that the pattern goes round.

What a keep-out covers, with its margin, is cut out of the region, so that the first row of bubbles follows
its outline as it follows any boundary. An object covers what lies in its shadow along an axis, its own Z
axis unless the recipe gives another: a boss below a wall is avoided on the wall, and so is a logo that floats
above it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from manifold3d import CrossSection, FillRule

from .boundary import Boundary, make_boundary, nearest_boundary, signature
from .cutting import Function, Level, cut_region
from .distance import distance_to, index_segments
from .errors import RegionError
from .mesh import Bools, Floats, Ints, Mesh
from .recipe import KeepOut
from .region import Region, make_region
from .selection import face_set
from .surroundings import Solid, Solids
from .vectors import dots

# How fine outlines are followed, relative to their extent: chords by height, edges by length.
CHORD, COARSEST, FINEST = 4e-4, 1 / 12, 1e-3
FACES = "faces"
# Faces whose normals have a cosine below this are on both sides of a wall.
BEHIND = -0.5
# Points and segments that are compared at a time.
BLOCK = 4_000_000


@dataclass(frozen=True)
class Footprint:
    """What one keep-out covers: places nearer than `margin` by `distance`, which tells of points (n, 3) on
    the region's triangles (n,) how far they are from it, negative where it covers them; extent: its width
    """

    distance: Callable[[Floats, Ints], Floats]
    margin: float
    extent: float
    name: str


def region_with_keep_outs(
    base: Mesh,
    selected: Bools,
    parts: Ints | None,
    gap: float,
    keep_outs: Sequence[KeepOut],
    masks: Mapping[str, Bools],
    solids: Solids,
) -> Region:
    """The region of the `selected` (T,) triangles less what the `keep_outs` cover, as any region where there
    are none.

    masks: (T,) triangles with each face attribute and material; see make_region for parts and gap

    Raises RegionError where a keep-out names what is not there, is flat along its axis or nothing is left.
    """
    if not keep_outs:
        return make_region(base, selected, parts, gap)
    taken = [face_set(keep_out.faces, masks) for keep_out in keep_outs if keep_out.faces is not None]
    covered = np.any([np.zeros(len(selected), dtype=bool), *taken], axis=0)
    if (covered & selected).any() and not (selected & ~covered).any():
        raise RegionError("The keep-outs cover all faces of the target region: take some faces out of them.")
    region = make_region(base, selected & ~covered, parts, gap)
    footprints: list[Footprint] = []
    for keep_out in keep_outs:
        if keep_out.faces is None:
            footprints += footprints_of(keep_out, solids)
        elif keep_out.margin > 0:
            footprints += round_faces(region, face_set(keep_out.faces, masks), keep_out.margin)
    cut = cut_region(region, _together(footprints)) if footprints else region
    before = np.linalg.norm(base.area_vectors[selected], axis=1).sum() / 2
    notes = _idle(cut, [footprint for footprint in footprints if footprint.name != FACES])
    return replace(cut, notes=notes, kept_out=max(float(before) - cut.area, 0.0))


def _together(footprints: Sequence[Footprint]) -> Function:
    """Distance to the nearest footprint with its margin, as fine as that one wants its outline."""
    extent = np.array([footprint.extent for footprint in footprints])

    def function(points: Floats, row: Ints) -> Level:
        """Distances (n,) and how fine to be there, for points on the triangles `row` (n,)."""
        value, nearest = np.full(len(points), np.inf), np.zeros(len(points), dtype=np.int64)
        for number, footprint in enumerate(footprints):
            distance = footprint.distance(points, row) - footprint.margin
            nearer = distance < value
            value[nearer], nearest[nearer] = distance[nearer], number
        width = extent[nearest]
        return Level(value, CHORD * width, COARSEST * width, FINEST * width)

    return function


def _idle(cut: Region, footprints: Sequence[Footprint]) -> tuple[str, ...]:
    """A sentence on the keep-outs whose outlines are no boundary of the `cut` region, where there are any."""
    corners = cut.boundary_segments[:, 0]
    idle = [
        footprint.name
        for footprint in footprints
        if (footprint.distance(corners, cut.rim[:, 0]) - footprint.margin > CHORD * footprint.extent).all()
    ]
    if not idle:
        return ()
    names = ", ".join(dict.fromkeys(idle))
    one = len(idle) == 1
    return (f"{'A keep-out takes' if one else 'Keep-outs take'} nothing from the target region: {names}.",)


# -- faces ---------------------------------------------------------------------------------------------------


def round_faces(region: Region, faces: Bools, margin: float) -> list[Footprint]:
    """What is nearer than `margin` to those of the `faces` (T,) that `region` borders on, if any."""
    sides = np.sort(_sides(region.base.triangles[faces]), axis=1)
    row, corner = region.rim.T
    rim = np.sort(_sides(region.base.triangles[region.triangles[row]]).reshape(-1, 3, 2), axis=2)
    rim = rim[np.arange(len(row)), corner]
    count = len(region.base.vertices)
    borders = np.isin(rim[:, 0] * count + rim[:, 1], sides[:, 0] * count + sides[:, 1])
    if not borders.any():
        return []
    border = replace(region, rim=region.rim[borders], reserve=np.zeros(int(borders.sum())))
    spacing = max(margin / 2, border.perimeter / 20_000)
    boundary = make_boundary(border, spacing)
    assert boundary is not None
    return [Footprint(_distance_to(boundary), margin, 2 * margin / (3 * COARSEST), FACES)]


def _distance_to(boundary: Boundary) -> Callable[[Floats, Ints], Floats]:
    """Distance to a boundary for places that face its way: what is behind a thin wall is far from it."""
    region = boundary.region
    towards = region.normals[region.rim[:, 0]]

    def distance(points: Floats, row: Ints) -> Floats:
        """Of points on the triangles `row` (n,)."""
        found, _ = nearest_boundary(boundary, points, row)
        _, sample = boundary.tree.query(signature(region, points, row, boundary.reach))
        cosine = dots(region.normals[row], towards[boundary.owner[sample]])
        return np.where(cosine > BEHIND, found, region.extent + found)

    return distance


def _sides(triangles: Ints) -> Ints:
    """Vertices of the sides opposite to the corners, (3 M, 2)."""
    return np.stack([np.roll(triangles, -1, axis=1), np.roll(triangles, -2, axis=1)], axis=2).reshape(-1, 2)


# -- shapes and objects --------------------------------------------------------------------------------------


def footprints_of(keep_out: KeepOut, solids: Solids) -> list[Footprint]:
    """What a shape covers, or every one of the bodies that the keep-out names.

    Raises RegionError where a body is not there or has no face across its axis.
    """
    axis = None if keep_out.axis is None else np.array(keep_out.axis)
    upright = np.array([0.0, 0.0, 1.0]) if axis is None else axis
    if keep_out.sphere is not None:
        return [_ball(np.array(keep_out.sphere), _diameter(keep_out), keep_out.margin)]
    if keep_out.cylinder is not None:
        centre, radius = np.array(keep_out.cylinder), _diameter(keep_out) / 2
        shadow = _Shadow(centre, frame_along(upright), keep_out.reach)
        across = lambda flat: np.hypot(flat[:, 0], flat[:, 1]) - radius  # noqa: E731
        return [shadow.footprint(across, keep_out.margin, 2 * radius, "a cylinder")]
    if keep_out.box is not None:
        assert keep_out.size is not None  # check_keep_outs has seen to it
        width, depth, height = keep_out.size
        half = np.array([width, depth]) / 2
        frame = frame_along(upright, None if keep_out.along is None else np.array(keep_out.along))
        shadow = _Shadow(np.array(keep_out.box), frame, keep_out.reach, -height / 2, height / 2)
        return [shadow.footprint(_rectangle(half), keep_out.margin, float(2 * half.max()), "a box")]
    key = next(key for key in ("object", "collection", "file") if getattr(keep_out, key) is not None)
    name = getattr(keep_out, key)
    if (key, name) not in solids:
        raise RegionError(f'Keep-out {key} = "{name}" is not there: choose another one, or take it out.')
    return [
        _shadow_of(solid, solid.axis if axis is None else axis, keep_out, name) for solid in solids[key, name]
    ]


def _diameter(keep_out: KeepOut) -> float:
    assert keep_out.diameter is not None  # check_keep_outs has seen to it
    return keep_out.diameter


def frame_along(axis: Floats, along: Floats | None = None) -> Floats:
    """Three orthonormal rows (3, 3), the last along `axis` (3,), the first as near to `along` (3,) as can be,
    by default x, or y where the axis is about along x.
    """
    axis = axis / np.linalg.norm(axis)
    across = np.array([0.0, 1.0, 0.0]) if abs(axis[0]) > 0.9 else np.array([1.0, 0.0, 0.0])
    helper = across if along is None else along / np.linalg.norm(along)
    first = helper - (helper @ axis) * axis
    first /= np.linalg.norm(first)
    return np.stack([first, np.cross(axis, first), axis])


def _ball(centre: Floats, diameter: float, margin: float) -> Footprint:
    def distance(points: Floats, row: Ints) -> Floats:
        """From the sphere, negative inside, (n,)."""
        return np.linalg.norm(points - centre, axis=1) - diameter / 2

    return Footprint(distance, margin, diameter + 2 * margin, "a sphere")


def _rectangle(half: Floats) -> Callable[[Floats], Floats]:
    """Signed distance to a rectangle round the origin of half the widths `half` (2,)."""

    def across(flat: Floats) -> Floats:
        """Of points (n, 2), negative inside."""
        over = np.abs(flat) - half
        return np.hypot(*np.maximum(over, 0).T) + np.minimum(over.max(axis=1), 0)

    return across


@dataclass(frozen=True)
class _Shadow:
    """What a flat outline sweeps along an axis: the last row of `frame` (3, 3), from `low` - reach to
    `high` + reach as seen from `origin`; without end where reach is None.
    """

    origin: Floats
    frame: Floats
    reach: float | None
    low: float = 0.0
    high: float = 0.0

    def footprint(
        self, across: Callable[[Floats], Floats], margin: float, extent: float, name: str
    ) -> Footprint:
        """Footprint of the outline whose signed distance in the plane `across` tells of points (n, 2)."""

        def distance(points: Floats, row: Ints) -> Floats:
            """From the body that the outline makes along the axis, negative inside, (n,)."""
            seen = (points - self.origin) @ self.frame.T
            flat = across(seen[:, :2])
            if self.reach is None:
                return flat
            over = np.maximum(self.low - seen[:, 2], seen[:, 2] - self.high) - self.reach
            outside = np.hypot(np.maximum(flat, 0), np.maximum(over, 0))
            return outside + np.minimum(np.maximum(flat, over), 0)

        return Footprint(distance, margin, extent + 2 * margin, name)


def _shadow_of(solid: Solid, axis: Floats, keep_out: KeepOut, name: str) -> Footprint:
    """What a body covers that is seen along `axis`. RegionError where it has no face across that."""
    frame = frame_along(axis)
    origin = solid.mesh.vertices.mean(axis=0) if len(solid.mesh.vertices) else np.zeros(3)
    seen = (solid.mesh.corners - origin) @ frame.T
    outline = _outline(seen[:, :, :2])
    if not len(outline):
        raise RegionError(
            f'Keep-out "{name}" has no face across its axis: turn it so that its Z axis points at the '
            "region, or give another axis."
        )
    extent = float(np.ptp(outline.reshape(-1, 2), axis=0).max())
    low, high = float(seen[:, :, 2].min()), float(seen[:, :, 2].max())
    shadow = _Shadow(origin, frame, keep_out.reach, low, high)
    return shadow.footprint(_polygons(outline, keep_out.margin), keep_out.margin, extent, f'"{name}"')


def _outline(corners: Floats) -> Floats:
    """Outline (S, 2, 2) of all that the flat triangles (M, 3, 2) cover together, counter-clockwise."""
    size = float(np.abs(corners).max(initial=0.0))
    if size == 0:
        return np.empty((0, 2, 2))
    unit = corners / size
    one, two = unit[:, 1] - unit[:, 0], unit[:, 2] - unit[:, 0]
    area = one[:, 0] * two[:, 1] - one[:, 1] * two[:, 0]
    unit = np.where(area[:, None, None] < 0, unit[:, ::-1], unit)[np.abs(area) > 1e-12]
    if not len(unit):
        return np.empty((0, 2, 2))
    loops = CrossSection(list(unit), FillRule.NonZero).simplify(1e-7).to_polygons()
    return size * np.concatenate([np.stack([loop, np.roll(loop, -1, axis=0)], axis=1) for loop in loops])


def _polygons(outline: Floats, margin: float) -> Callable[[Floats], Floats]:
    """Signed distance to the polygons of an `outline` (S, 2, 2); less than that far beyond the `margin`."""
    segments = index_segments(np.concatenate([outline, np.zeros((len(outline), 2, 1))], axis=2))
    (x0, y0), (x1, y1) = outline.transpose(1, 2, 0)
    low, high = outline.reshape(-1, 2).min(axis=0), outline.reshape(-1, 2).max(axis=0)
    slope = (x1 - x0) / np.where(y1 == y0, 1.0, y1 - y0)

    def across(flat: Floats) -> Floats:
        """Of points (n, 2), negative inside."""
        over = np.maximum(np.maximum(low - flat, flat - high), 0)
        away = np.hypot(*over.T)
        # far from an outline it does not matter how far: the box round it is near enough
        near = np.flatnonzero(away <= margin + (high - low).max() / 4)
        away[near] = distance_to(segments, np.column_stack([flat[near], np.zeros(len(near))]))
        boxed = near[(over[near] == 0).all(axis=1)]
        step = max(1, BLOCK // len(outline))
        for start in range(0, len(boxed), step):
            rows = boxed[start : start + step]
            x, y = flat[rows].T[:, :, None]
            # segments that a line from the point to the right crosses
            crosses = ((y0 <= y) != (y1 <= y)) & (x < x0 + (y - y0) * slope)
            inside = crosses.sum(axis=1) % 2 == 1
            away[rows[inside]] *= -1
        return away

    return across
