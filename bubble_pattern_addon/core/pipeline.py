"""From a target region and a recipe to a pattern: steps 1 and 2, for panel, batch run and tests alike."""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import dijkstra

from .mesh import Floats, Ints
from .metric import Places
from .packing.force import find_pairs
from .packing.pack import local_pitch, pack_steps
from .pattern import Pattern
from .progress import Progress, Steps
from .recipe import Recipe
from .region import Region
from .shaping import diameters
from .surface import Charts, Spots, positions, smooth_normals, to_frame, to_space

# Bubbles closer than this many stable distances are in neighbouring rows, or in the same.
TOUCHING = 1.35


def pattern_steps(region: Region, recipe: Recipe) -> Steps[Pattern]:
    """Pattern of `recipe` in `region`: packs the bubbles (step 1) and shapes their features (step 2).

    Raises RegionError where the pitch does not suit the region, RecipeError where the diameter does not suit
    the pitch.
    """
    ground, bubbles = yield from pack_steps(region, recipe.packing)
    yield Progress("Shaping the features", 0.95)
    spots = bubbles.spots
    pitch = local_pitch(ground, bubbles)
    points = positions(ground.charts, spots)
    places = Places(points, region.triangles[spots.row], spots.barycentric)
    links = _links(ground.charts, spots, points, pitch)
    normal = smooth_normals(region, spots)
    return Pattern(
        places=places,
        normal=normal,
        tangent=_tangents(ground.charts, spots, points, links, normal),
        pitch=pitch,
        diameter=diameters(recipe.shaping, places, pitch),
        row=_rows(links, len(pitch), bubbles.fixed),
    )


def _links(charts: Charts, spots: Spots, points: Floats, pitch: Floats) -> tuple[Ints, Ints]:
    pairs = find_pairs(charts, points, spots.row, pitch, 0.0)
    distance = np.linalg.norm(points[pairs.first] - points[pairs.second], axis=1)
    near = distance < TOUCHING * pairs.stable
    return pairs.first[near], pairs.second[near]


def _rows(links: tuple[Ints, Ints], n: int, first: int) -> Ints:
    """Row of every bubble (n,): 0 for the `first` bubbles along the boundary, else the steps from there; -1
    where no boundary can be reached.
    """
    if not first:
        return np.full(n, -1)
    graph = coo_array((np.ones(len(links[0])), links), shape=(n, n)).tocsr()
    steps = dijkstra(graph, directed=False, indices=np.arange(first), unweighted=True, min_only=True)
    return np.where(np.isfinite(steps), steps, -1).astype(np.int64)


def _tangents(
    charts: Charts, spots: Spots, points: Floats, links: tuple[Ints, Ints], normal: Floats
) -> Floats:
    """Unit vectors (n, 3) along a row of the arrangement: of its six directions the one nearest to the x
    axis.
    """
    n = len(points)
    six = np.zeros(n, dtype=np.complex128)
    for own, other in (links, links[::-1]):
        towards = to_frame(charts, spots.row[own], points[other] - points[own])
        towards = (towards / np.maximum(np.abs(towards), 1e-300)) ** 6
        six += np.bincount(own, towards.real, n) + 1j * np.bincount(own, towards.imag, n)
    reference = to_frame(charts, spots.row, np.tile([1.0, 1e-3, 1e-6], (n, 1)))
    angle = np.where(np.abs(six) > 1e-9, np.angle(six), 0.0) / 6
    turns = np.round((np.angle(reference) - angle) / (np.pi / 3))
    tangent = to_space(charts, spots.row, np.exp(1j * (angle + turns * np.pi / 3)))
    tangent -= np.einsum("nc,nc->n", tangent, normal)[:, None] * normal
    return tangent / np.linalg.norm(tangent, axis=1, keepdims=True)
