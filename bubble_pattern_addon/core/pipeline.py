"""From a target region and a recipe to a pattern: steps 1 and 2, for panel, batch run and tests alike."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import dijkstra

from .errors import RegionError
from .heading import square_to
from .links import Links, find_links
from .mesh import Bools, Floats, Ints
from .metric import Bound, Constant, Field
from .packing.bubbles import Bubbles, Ground
from .packing.pack import local_pitch, pack_steps
from .partners import alike, along_or_square, kin_of
from .pattern import Pattern
from .progress import Progress, Steps
from .recipe import Packing, Recipe, rounded
from .region import Region
from .shaping import bound, shaped
from .surface import Charts, Spots, on_base, smooth_normals, to_frame, to_space
from .surroundings import NOTHING, Surroundings
from .vectors import dots


def pattern_steps(region: Region, recipe: Recipe, surroundings: Surroundings = NOTHING) -> Steps[Pattern]:
    """Pattern of `recipe` in `region`: packs the bubbles (step 1) and shapes their features (step 2).

    surroundings: what the recipe's fields ask for beside the region itself (see field_tables.wanted)

    Raises RegionError where the pitch does not suit the region, RecipeError where the diameter does not suit
    the pitch, FieldError where the surroundings lack what a field asks for.
    """
    packing = bound_packing(region, recipe, surroundings)
    ground, bubbles = yield from pack_steps(region, packing)
    yield Progress("Shaping the features", 0.95)
    first = np.arange(len(bubbles)) < bubbles.fixed - bubbles.inner
    return laid(ground, bubbles, first, recipe, surroundings)


def bound_packing(region: Region, recipe: Recipe, surroundings: Surroundings) -> Packing:
    """The recipe's step 1 with the packing metric in its surroundings; for errors see pattern_steps."""
    metric = bound(recipe.packing.pitch, replace(surroundings, region=region), "[packing] pitch")
    _check_lengths(region, metric, "pitch")
    # a number stays one: there are quick ways to pack with the same pitch everywhere
    return replace(recipe.packing, pitch=metric if isinstance(metric, Constant) else Bound(metric))


def laid(
    ground: Ground,
    bubbles: Bubbles,
    first: Bools,
    recipe: Recipe,
    surroundings: Surroundings,
    ids: Ints | None = None,
    stretch: Floats | None = None,
) -> Pattern:
    """Pattern of the bubbles, those of the first row `first` (n,), shaped as the recipe says.

    ids: (n,) other than their numbers, rising; stretch: (n,) how much larger than the packing metric they are
    """
    spots, region = bubbles.spots, ground.charts.region
    pitch = local_pitch(ground, bubbles)
    if bubbles.partners is not None:
        # Partners are alike also where the metric is so only within the tolerance.
        pitch = pitch[bubbles.partners].min(axis=1)
    if stretch is not None:
        pitch = pitch * stretch
    places = on_base(region, spots)
    points = places.position
    links = find_links(ground.charts, points, spots.row, pitch)
    normal = smooth_normals(region, spots)
    packed = Pattern(
        places=places,
        normal=normal,
        tangent=_tangents(ground.charts, spots, points, links, normal),
        pitch=pitch,
        diameter=np.zeros(len(pitch)),
        row=_rows(links, first),
        packing_notes=(*region.notes, *ground.notes),
        symmetry=None if ground.symmetry is None else ground.symmetry.group.word,
        isometries=None if ground.symmetry is None else ground.symmetry.group,
        partners=bubbles.partners,
        bubble=ids,
    )
    kin = kin_of(packed)
    if kin is not None:
        tangent = square_to(
            normal, alike(kin, along_or_square(kin, packed.tangent, six=True)), packed.tangent
        )
        packed = replace(packed, tangent=tangent)
    return shaped(packed, links, region, recipe, replace(surroundings, region=region))


def _check_lengths(region: Region, field: Field, name: str) -> None:
    """RegionError where a field is no positive length at some corner of the region's triangles."""
    corners = np.tile(np.eye(3), (len(region.triangles), 1))
    places = on_base(region, Spots(np.repeat(np.arange(len(region.triangles)), 3), corners))
    values = field(places)
    bad = ~(np.isfinite(values) & (values > 0))
    if bad.any():
        x, y, z = (float(value) for value in places.position[bad][0])
        raise RegionError(
            f"The {name} is {{value}} at {{x}}, {{y}}, {{z}}: it must be a positive length everywhere in the "
            "target region",
            value=rounded(float(values[bad][0])),
            x=rounded(x),
            y=rounded(y),
            z=rounded(z),
        )


def _rows(links: Links, first: Bools) -> Ints:
    """Row of every bubble (n,): 0 for those that are `first` (n,) along the boundary, else the steps from
    there; -1 where no boundary can be reached.
    """
    n = len(first)
    if not first.any():
        return np.full(n, -1)
    graph = coo_array((np.ones(len(links.first)), links[:2]), shape=(n, n)).tocsr()
    steps = dijkstra(graph, directed=False, indices=np.flatnonzero(first), unweighted=True, min_only=True)
    return np.where(np.isfinite(steps), steps, -1).astype(np.int64)


def _tangents(charts: Charts, spots: Spots, points: Floats, links: Links, normal: Floats) -> Floats:
    """Unit vectors (n, 3) along a row of the arrangement: of its six directions the one nearest to the x
    axis.
    """
    n = len(points)
    six = np.zeros(n, dtype=np.complex128)
    for own, other in ((links.first, links.second), (links.second, links.first)):
        towards = to_frame(charts, spots.row[own], points[other] - points[own])
        towards = (towards / np.maximum(np.abs(towards), 1e-300)) ** 6
        six += np.bincount(own, towards.real, n) + 1j * np.bincount(own, towards.imag, n)
    reference = to_frame(charts, spots.row, np.tile([1.0, 1e-3, 1e-6], (n, 1)))
    angle = np.where(np.abs(six) > 1e-9, np.angle(six), 0.0) / 6
    turns = np.round((np.angle(reference) - angle) / (np.pi / 3))
    tangent = to_space(charts, spots.row, np.exp(1j * (angle + turns * np.pi / 3)))
    tangent -= dots(tangent, normal)[:, None] * normal
    return tangent / np.linalg.norm(tangent, axis=1, keepdims=True)
