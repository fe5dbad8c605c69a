"""Step 2 from seeds (paper, Eq. 4): some features have a fixed size, every other one the weighted average of
its neighbours.

The paper weights a neighbour by d / d_max, the ratio of its distance to the largest one in the cluster, which
favours those far away, although its words say "based on feature proximity". Here the weight is 1 - d / d_max.
With d_max the distance of the outermost neighbour itself, that one would have no say; d_max is therefore the
largest distance up to which any of the cluster's features still counts as its neighbour (`Links.reach`, 1.35
pitches), which lies beyond all of them: in a perfect hexagonal arrangement all six weigh the same, 0.26.

A cluster is a feature with those linked to it; the links are the pattern's own.
"""

from __future__ import annotations

import numpy as np
from scipy.sparse import csr_array, diags_array
from scipy.sparse.csgraph import connected_components
from scipy.sparse.linalg import spsolve
from scipy.spatial import cKDTree

from .errors import RecipeError
from .links import Links
from .mesh import Bools, Floats, Ints
from .recipe import Seed, Shaping

# A seed farther than this many pitches from every feature is not on the pattern.
ASTRAY = 2.0


def averaged(
    shaping: Shaping,
    base: Floats,
    links: Links,
    position: Floats,
    pitch: Floats,
    partners: Ints | None = None,
) -> tuple[Floats, Bools]:
    """Diameters (n,) from the shaping's seeds, and which features they reach, (n,).

    base: (n,) diameters of the features that no seed reaches over links, as on another part of the region;
    they keep them. The iteration starts from them. partners: (n, k) rows of the features that are each one's
    images, which a seed fixes as well

    Raises RecipeError where a seed is off the pattern or two fix the same feature.
    """
    fixed, sizes = seeded(shaping.seeds, position, pitch)
    if partners is not None:
        fixed, sizes = _with_partners(fixed, sizes, partners)
    weights = weight_matrix(links, len(base))
    _, cluster = connected_components(weights, directed=False)
    reached = np.isin(cluster, cluster[fixed])
    free = reached.copy()
    free[fixed] = False
    result = base.copy()
    result[fixed] = sizes
    solve = solved if shaping.solver == "direct" else iterated
    return solve(weights, result, free, shaping.tolerance, shaping.iterations), reached


def seeded(seeds: tuple[Seed, ...], position: Floats, pitch: Floats) -> tuple[Ints, Floats]:
    """The features that the seeds fix, (k,), and their diameters, (k,). RecipeError as in averaged."""
    at = np.array([seed.at for seed in seeds])
    distance, feature = cKDTree(position).query(at)
    astray = np.flatnonzero(distance > ASTRAY * pitch[feature])
    if len(astray):
        number = astray[0]
        raise RecipeError(
            f"[shaping] seeds, seed {number + 1} is {distance[number]:.4g} away from the nearest feature: "
            "place it on the pattern"
        )
    order = np.argsort(feature, kind="stable")
    twice = np.flatnonzero(np.diff(feature[order]) == 0)
    if len(twice):
        one, other = sorted(order[[twice[0], twice[0] + 1]] + 1)
        raise RecipeError(
            f"[shaping] seeds, seeds {one} and {other} fix the same feature: leave one of them out"
        )
    return feature.astype(np.int64), np.array([seed.diameter for seed in seeds])


def _with_partners(fixed: Ints, sizes: Floats, partners: Ints) -> tuple[Ints, Floats]:
    """The features `fixed` (k,) and their partners, and their `sizes`; those with seeds have these."""
    everyone = np.concatenate([fixed, partners[fixed].ravel()])
    found, first = np.unique(everyone, return_index=True)
    return found, np.concatenate([sizes, np.repeat(sizes, partners.shape[1])])[first]


def weight_matrix(links: Links, n: int) -> csr_array:
    """(n, n): row i has the weights of i's neighbours, summing to 1; no entries for one without any."""
    own = np.concatenate([links.first, links.second])
    other = np.concatenate([links.second, links.first])
    distance, reach = np.tile(links.distance, 2), np.tile(links.reach, 2)
    widest = np.zeros(n)
    np.maximum.at(widest, own, reach)
    weight = 1 - distance / widest[own]
    total = np.bincount(own, weight, n)
    return csr_array((weight / total[own], (own, other)), shape=(n, n))


def solved(weights: csr_array, start: Floats, free: Bools, tolerance: float, iterations: int) -> Floats:
    """Where the averages come to rest: the diameters (n,) that are what their neighbours' average is.

    That is a sparse linear problem in the `free` (n,) ones; the others stay as in `start` (n,).
    """
    result = start.copy()
    rows = weights[free]
    system = diags_array(np.ones(int(free.sum()))) - rows[:, free]
    if free.any():
        result[free] = spsolve(system.tocsc(), rows[:, ~free] @ start[~free])
    return result


def iterated(weights: csr_array, start: Floats, free: Bools, tolerance: float, iterations: int) -> Floats:
    """The averages taken again and again, all at once, as the paper defines them.

    Ends when no diameter changes by more than the share `tolerance` of it, or after so many `iterations`.
    """
    result = start.copy()
    rows = weights[free]
    for _ in range(iterations):
        new = rows @ result
        change = np.abs(new - result[free])
        result[free] = new
        if not (change > tolerance * np.abs(new)).any():
            break
    return result
