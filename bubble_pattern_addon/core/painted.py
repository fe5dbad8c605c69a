"""Fields that are painted: attributes of the base, and images laid on it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from .errors import FieldError, RecipeError
from .falloff import Graded
from .mesh import Floats
from .metric import Field, Places
from .surroundings import Surroundings
from .toml_values import Point, check_above, check_finite, check_one_of

if TYPE_CHECKING:
    from .region import Region

CHANNELS = ("light", "red", "green", "blue", "alpha")
# how light red, green and blue are (ITU-R BT.709)
LIGHT = np.array([0.2126, 0.7152, 0.0722])


@dataclass(frozen=True, kw_only=True)
class Attribute(Graded):
    """By a value painted on the base: a vertex weight, a colour, any attribute of numbers.

    name: of the attribute, or of the vertex group
    channel: of a colour: its light, or one of its components
    low, high: the values where t is 0 and 1
    """

    name: str
    channel: str = "light"
    low: float = 0.0
    high: float = 1.0

    def check(self, where: str) -> None:
        """RecipeError for a channel that is none, or where low and high are the same."""
        super().check(where)
        check_one_of(self.channel, CHANNELS, f"{where}: channel")
        check_finite(self.low, f"{where}: low")
        check_finite(self.high, f"{where}: high")
        if self.low == self.high:
            raise RecipeError(f"{where}: low and high are both {self.low:g}: give two different values")

    def share(self, surroundings: Surroundings) -> Field:
        """t is 0 at the value `low` and 1 at `high`."""
        values = np.asarray(surroundings.attribute(self.name), dtype=np.float64)
        if values.ndim == 3:
            values = component(values, self.channel, f'name = "{self.name}"')
        region = surroundings.region
        seen = values if region is None else values[region.triangles]
        if not np.isfinite(seen).all():
            raise FieldError(
                f'name = "{self.name}" has no value on a part of the target region: paint it everywhere there'
            )
        low, way = self.low, self.high - self.low
        return lambda places: (painted(values, places) - low) / way


def component(values: Floats, channel: str, where: str) -> Floats:
    """One channel of colours (..., 1 to 4). FieldError for an alpha that they do not have."""
    count = values.shape[-1]
    if channel == "alpha":
        if count not in (2, 4):
            raise FieldError(f"{where} has no alpha: use another channel")
        return values[..., -1]
    if count < 3:
        return values[..., 0]
    if channel == "light":
        return np.asarray(values[..., :3] @ LIGHT)
    return values[..., CHANNELS.index(channel) - 1]


def painted(values: Floats, places: Places) -> Floats:
    """Values at places: of the face for `values` (T,), between its corners for (T, 3) or (T, 3, k)."""
    if values.ndim == 1:
        return values[places.triangle]
    return np.asarray(np.einsum("nk,nk...->n...", places.barycentric, values[places.triangle]))


@dataclass(frozen=True, kw_only=True)
class Image(Graded):
    """By an image, as for a halftone: t is 0 where it is black and 1 where it is white.

    image: its name, for a batch run the file's, seen from the recipe
    uv: the UV map by which it lies on the base; it repeats outside the unit square
    or from a plane: looking against `project`, with `up` upward, its middle at `centre`, `width` wide; its
    last pixels go on outside. Without `project` that is the region's mean normal, without `up` the z axis
    (the y axis where one looks along z), without `centre` the middle of the region's extent, and without
    `width` the least width that covers the region
    channel: its light, or one of its components
    """

    image: str
    uv: str | None = None
    project: Point | None = None
    up: Point | None = None
    centre: Point | None = None
    width: float | None = None
    channel: str = "light"

    def check(self, where: str) -> None:
        """RecipeError for an image laid in two ways, or a plane that is none."""
        super().check(where)
        check_one_of(self.channel, CHANNELS, f"{where}: channel")
        planar = [key for key in ("project", "up", "centre", "width") if getattr(self, key) is not None]
        if self.uv is not None and planar:
            raise RecipeError(f"{where}: give either uv or {planar[0]}")
        for key in ("project", "up"):
            if getattr(self, key) is not None and not np.any(getattr(self, key)):
                raise RecipeError(f"{where}: {key} = [0, 0, 0] leads nowhere: give another")
        if self.width is not None:
            check_above(self.width, f"{where}: width")
        if self.project is not None and self.up is not None and not np.any(np.cross(self.project, self.up)):
            raise RecipeError(f"{where}: project and up are parallel: give another up")

    def share(self, surroundings: Surroundings) -> Field:
        """t is the image's brightness."""
        pixels = np.asarray(surroundings.image(self.image), dtype=np.float64)
        if pixels.ndim == 2:
            pixels = pixels[..., None]
        if not pixels.size:
            raise FieldError(f'image = "{self.image}" has no pixels: choose another')
        pixels = component(pixels, self.channel, f'image = "{self.image}"')
        if self.uv is not None:
            uv = np.asarray(surroundings.uv_map(self.uv), dtype=np.float64)
            return lambda places: bilinear(pixels, painted(uv, places), repeat=True)
        to_plane, shift = self._plane(surroundings, pixels.shape[1] / pixels.shape[0])

        def share(places: Places) -> Floats:
            return bilinear(pixels, places.position @ to_plane + shift, repeat=False)

        return share

    def _plane(self, surroundings: Surroundings, aspect: float) -> tuple[Floats, Floats]:
        """The map from space to the image's unit square: uv = x @ (3, 2) + (2,)."""
        sight = mean_normal(surroundings.target()) if self.project is None else np.array(self.project)
        right, up = _upright(sight / np.linalg.norm(sight), self.up)
        axes = np.stack([right, up], axis=1)
        if self.centre is None or self.width is None:
            flat = surroundings.target().corners.reshape(-1, 3) @ axes
            low, high = flat.min(axis=0), flat.max(axis=0)
        centre = (low + high) / 2 if self.centre is None else np.array(self.centre) @ axes
        width = self.width
        if width is None:
            # as wide as to cover the region on both sides of the centre
            reach = 2 * np.maximum(high - centre, centre - low)
            width = float(max(reach[0], reach[1] * aspect))
        size = np.array([width, width / aspect])
        return axes / size, 0.5 - centre / size


def mean_normal(region: Region) -> Floats:
    """Mean of the region's normals weighted by area, (3,). FieldError where they cancel, as on a sphere."""
    total = region.area_vectors.sum(axis=0)
    if np.linalg.norm(total) < 1e-6 * np.linalg.norm(region.area_vectors, axis=1).sum():
        raise FieldError("The target region faces all ways: give project = [x, y, z] for the image")
    return np.asarray(total)


def upward(sight: Floats) -> Floats:
    """What is up, (3,), for one who looks against the unit vector `sight`: z, or y where that is z."""
    return np.array([0.0, 1.0, 0.0] if abs(sight[2]) > 0.999 else [0.0, 0.0, 1.0])


def _upright(sight: Floats, up: Point | None) -> tuple[Floats, Floats]:
    """Unit vectors to the right and up as seen against `sight`."""
    ahead = upward(sight) if up is None else np.array(up)
    right = np.cross(ahead, sight)
    length = np.linalg.norm(right)
    if length <= 1e-9 * np.linalg.norm(ahead):
        raise FieldError(f"up = {ahead.tolist()} points at the viewer: give a direction across project")
    right = right / length
    return right, np.cross(sight, right)


def bilinear(pixels: Floats, uv: Floats, repeat: bool) -> Floats:
    """Values (n,) of an image (height, width), bottom row first, at `uv` (n, 2) in its unit square.

    Pixels have their values at their middles. Outside the square the image repeats, or its last pixels go on.
    """
    height, width = pixels.shape
    x, y = uv[:, 0] * width - 0.5, uv[:, 1] * height - 0.5
    left, below = np.floor(x), np.floor(y)
    a, b = x - left, y - below

    def at(column: Floats, row: Floats) -> Floats:
        if repeat:
            column, row = column % width, row % height
        else:
            column, row = np.clip(column, 0, width - 1), np.clip(row, 0, height - 1)
        return pixels[row.astype(np.int64), column.astype(np.int64)]

    low = (1 - a) * at(left, below) + a * at(left + 1, below)
    high = (1 - a) * at(left, below + 1) + a * at(left + 1, below + 1)
    return (1 - b) * low + b * high
