"""Fields that depend on where a place is: along a direction, about a point, from the boundary or from things.

All distances are straight ones, as a designer reads them off a drawing.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from .distance import distance_to, index_segments
from .errors import FieldError, RecipeError
from .falloff import Graded
from .mesh import Bools, Floats, Ints
from .metric import Field, Places
from .surroundings import Surroundings, Thing
from .toml_values import Point, check_above, check_at_least, check_one_of

if TYPE_CHECKING:
    from .region import Region

LOOPS = ("all", "outer", "islands")
AXES = ("x", "y", "z")
# A region this flat along a direction, relative to its extent, has no way from one end to the other.
FLAT = 1e-9


@dataclass(frozen=True, kw_only=True)
class Linear(Graded):
    """Along a direction: from the first to the last place of the region that way (direction), or between two
    points (start, end).
    """

    direction: Point | None = None
    start: Point | None = None
    end: Point | None = None

    def check(self, where: str) -> None:
        """RecipeError unless there is either a direction or two points apart."""
        super().check(where)
        given = (self.direction is not None, self.start is not None, self.end is not None)
        if given not in ((True, False, False), (False, True, True)):
            raise RecipeError(f"{where}: give either direction = [x, y, z], or both start and end")
        if self.direction is not None and not np.any(self.direction):
            raise RecipeError(f"{where}: direction = [0, 0, 0] leads nowhere: give another")
        if self.start is not None and self.start == self.end:
            raise RecipeError(f"{where}: start and end are the same point: move one of them")

    def share(self, surroundings: Surroundings) -> Field:
        """t is 0 at the start and 1 at the end."""
        if self.direction is None:
            start, end = (np.array(ends, dtype=np.float64) for ends in (self.start, self.end))
            along = (end - start) / ((end - start) @ (end - start))
            low, high = float(start @ along), float(start @ along) + 1.0
        else:
            along = np.array(self.direction) / np.linalg.norm(self.direction)
            region = surroundings.target()
            reach = region.corners @ along
            low, high = float(reach.min()), float(reach.max())
            if high - low <= FLAT * region.extent:
                raise FieldError(
                    f"direction = {list(self.direction)} is square to the target region, which has no extent "
                    "that way: give a direction along it"
                )

        def share(places: Places) -> Floats:
            """How far along the way places are, (n,)."""
            return (places.position @ along - low) / (high - low)

        return share


@dataclass(frozen=True, kw_only=True)
class Radial(Graded):
    """By the distance from a point or an axis: t is 0 up to the distance `inner`, 1 at `radius`.

    centre: the point; or object: a Thing whose origin it is; without, the middle of the region's area
    axis: the distance is from the line through the centre along this direction; the letter of one of the
    object's own axes will do as well
    radius: without, that of the farthest place of the region
    """

    centre: Point | None = None
    object: str | None = None
    axis: Point | str | None = None
    inner: float = 0.0
    radius: float | None = None

    def check(self, where: str) -> None:
        """RecipeError for two centres, an axis that is none, or radii that leave no way between them."""
        super().check(where)
        if self.centre is not None and self.object is not None:
            raise RecipeError(f"{where}: give either centre or object")
        if isinstance(self.axis, str):
            check_one_of(self.axis, AXES, f"{where}: axis")
            if self.object is None:
                raise RecipeError(f'{where}: axis = "{self.axis}" is an object\'s: give object, or [x, y, z]')
        elif self.axis is not None and not np.any(self.axis):
            raise RecipeError(f"{where}: axis = [0, 0, 0] leads nowhere: give another")
        check_at_least(self.inner, 0, f"{where}: inner")
        if self.radius is not None and not self.radius > self.inner:
            raise RecipeError(f"{where}: radius = {self.radius:g} must be above inner = {self.inner:g}")

    def share(self, surroundings: Surroundings) -> Field:
        """t is 0 up to the inner radius and 1 at the outer one."""
        centre, axis = self._about(surroundings)

        def distance(points: Floats) -> Floats:
            """From the centre, or from the axis through it, (n,)."""
            away = points - centre
            if axis is not None:
                away = away - (away @ axis)[:, None] * axis
            return np.linalg.norm(away, axis=1)

        # a distance is convex: over a triangle it is largest at a corner
        radius = self.radius
        if radius is None:
            radius = float(distance(surroundings.target().corners.reshape(-1, 3)).max())
            if radius <= self.inner:
                raise FieldError(
                    f"inner = {self.inner:g} is beyond the farthest place of the target region, "
                    f"{radius:.4g} away: make it smaller, or give radius"
                )
        inner, way = self.inner, radius - self.inner
        return lambda places: (distance(places.position) - inner) / way

    def _about(self, surroundings: Surroundings) -> tuple[Floats, Floats | None]:
        thing = None if self.object is None else surroundings.thing(self.object)
        if thing is not None:
            centre = thing.frame[:3, 3]
        elif self.centre is not None:
            centre = np.array(self.centre)
        else:
            centre = middle(surroundings.target())
        if self.axis is None:
            return centre, None
        if isinstance(self.axis, str):
            assert thing is not None  # check has seen to it
            axis = thing.frame[:3, AXES.index(self.axis)]
        else:
            axis = np.array(self.axis)
        return centre, axis / np.linalg.norm(axis)


def middle(region: Region) -> Floats:
    """Centroid of the region's area, (3,)."""
    area = np.linalg.norm(region.area_vectors, axis=1)
    return np.asarray(area @ region.corners.mean(axis=1) / area.sum())


@dataclass(frozen=True, kw_only=True)
class Edge(Graded):
    """By the distance from the region's boundary: t is 0 at the boundary and 1 from `distance` inward.

    loops: which of the boundary's loops count: all, the outer ones, or those round islands (the outer loop
    of each connected part is its longest)
    near: only the loops nearest to these points, one for each; loops are told by place, because a number
    would not survive the next edit of the base
    """

    distance: float
    loops: str = "all"
    near: tuple[Point, ...] = ()

    def check(self, where: str) -> None:
        """RecipeError for a distance of 0 and for loops chosen in two ways."""
        super().check(where)
        check_above(self.distance, f"{where}: distance")
        check_one_of(self.loops, LOOPS, f"{where}: loops")
        if self.near and self.loops != "all":
            raise RecipeError(f"{where}: give either loops or near")

    def share(self, surroundings: Surroundings) -> Field:
        """t is 0 at the boundary and 1 at the distance."""
        region = surroundings.target()
        if not len(region.rim):
            raise FieldError("The target region is closed and has no boundary: use another kind of field")
        chosen = self._chosen(region)
        if not chosen.any():
            raise FieldError(f'loops = "{self.loops}": the target region has none: use "all"')
        index = index_segments(region.boundary_segments[chosen])
        return lambda places: distance_to(index, places.position) / self.distance

    def _chosen(self, region: Region) -> Bools:
        """Which boundary segments count, (S,)."""
        loop = loop_of_segments(region)
        if self.near:
            wanted = np.array(
                [
                    [distance_to(index_segments(region.boundary_segments[loop == n]), np.array([at]))[0]
                     for n in range(len(region.loops))]
                    for at in self.near
                ]
            ).argmin(axis=1)  # fmt: skip
            return np.isin(loop, wanted)
        if self.loops == "all":
            return np.ones(len(loop), dtype=bool)
        outer = np.isin(loop, outer_loops(region))
        return outer if self.loops == "outer" else ~outer


def loop_of_segments(region: Region) -> Ints:
    """Number of the loop that each boundary segment belongs to, (S,)."""
    return np.repeat(np.arange(len(region.loops)), [len(loop) for loop in region.loops])


def outer_loops(region: Region) -> Ints:
    """The longest loop of each connected part that has a boundary."""
    segments = region.boundary_segments
    loop = loop_of_segments(region)
    length = np.bincount(loop, np.linalg.norm(segments[:, 1] - segments[:, 0], axis=1))
    first = np.searchsorted(loop, np.arange(len(region.loops)))
    sheet = region.sheet[region.rim[first, 0]]
    order = np.lexsort((np.arange(len(length)), -length, sheet))
    return np.asarray(order[np.concatenate([[True], np.diff(sheet[order]) != 0])])


@dataclass(frozen=True, kw_only=True)
class Distance(Graded):
    """By the distance from the nearest of some things, attractors or repellers: t is 0 there and 1 from
    `distance` away.

    points; lines: polylines; objects: names of Things
    """

    distance: float
    points: tuple[Point, ...] = ()
    lines: tuple[tuple[Point, ...], ...] = ()
    objects: tuple[str, ...] = ()

    def check(self, where: str) -> None:
        """RecipeError for a distance of 0 and where there is nothing to be distant from."""
        super().check(where)
        check_above(self.distance, f"{where}: distance")
        if not (self.points or self.lines or self.objects):
            raise RecipeError(f"{where}: give points, lines or objects to measure the distance from")
        if any(len(line) < 2 for line in self.lines):
            raise RecipeError(f"{where}: lines must be of two points or more each")

    def share(self, surroundings: Surroundings) -> Field:
        """t is 0 at the things and 1 at the distance."""
        things = [surroundings.thing(name) for name in self.objects]
        for name, thing in zip(self.objects, things, strict=True):
            if not len(thing.points) and not len(thing.segments):
                raise FieldError(f'objects: "{name}" has no points: give an empty, a curve or a mesh')
        points = Thing(np.array(self.points, dtype=np.float64).reshape(-1, 3))
        lines = [np.array(line) for line in self.lines]
        segments = [np.stack([line[:-1], line[1:]], axis=1) for line in lines]
        segments += [np.repeat(thing.points[:, None], 2, axis=1) for thing in (points, *things)]
        segments += [thing.segments for thing in things]
        index = index_segments(np.concatenate(segments))
        return lambda places: distance_to(index, places.position) / self.distance
