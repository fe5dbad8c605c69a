"""The force between two bubbles (paper, Eq. 1) and who feels whom."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from ..mesh import Floats, Ints
from ..surface import Charts
from ..vectors import dots

# Bubbles farther apart than this many stable distances do not feel each other.
REACH = 1.5
# How many times stiffer than the law's own the contact is in the last phase.
STIFFNESS = 12.0
# The last phase pushes pairs apart that are closer than this share of their stable distance.
EVEN = 0.985
# Bubbles whose pitches differ by no more than this factor are of one size class.
CLASS = 1.4
# No bubble has more others near: on a crowded spot a dozen have room within 1.66 pitches, and as many on the
# other side of a thin wall.
MOST_NEAR = 28


Law = Callable[[Floats], Floats]


class Pairs(NamedTuple):
    """Pairs of bubbles that may feel each other: first, second (m,); stable (m,) their stable distance l0."""

    first: Ints
    second: Ints
    stable: Floats


NO_PAIRS = Pairs(np.empty(0, dtype=np.int64), np.empty(0, dtype=np.int64), np.empty(0))


def force_law(w: Floats) -> Floats:
    """l0/k0 times the force at the relative distance w = d/l0, (m,): repulsive when positive.

    The bounded cubic 5/4 w^3 - 19/8 w^2 + 9/8 for 0 <= w < 1.5, else 0: the only cubic with f(1) = 0, f(1.5)
    = 0, f'(0) = 0 whose slope at contact is -1 (Shimada and Gossard, "Bubble Mesh", 1995; the paper's Eq. 1).
    """
    w = np.minimum(w, REACH)
    return (1.25 * w - 2.375) * (w * w) + 1.125


def stiff_law(w: Floats) -> Floats:
    """l0/k0 times the law's own force, with a stiff contact on top where two bubbles overlap by more than
    EVEN allows.

    It widens the smallest gaps, which decide how large a uniform hole can be, and leaves the rest of the
    balance alone.
    """
    return force_law(w) + STIFFNESS * np.maximum(EVEN - w, 0.0)


def find_pairs(charts: Charts, points: Floats, row: Ints, pitch: Floats, skin: float) -> Pairs:
    """Pairs closer than 1.5 stable distances plus `skin` pitches, on one sheet of the region.

    points: (n, 3) positions; row: (n,) region rows; pitch: (n,)
    """
    region, reach = charts.region, REACH + skin
    least, most = float(pitch.min(initial=np.inf)), float(pitch.max(initial=0.0))
    if most < CLASS * least:
        tree = cKDTree(points, balanced_tree=False, compact_nodes=False)
        first, second = tree.query_pairs(reach * most, output_type="ndarray").T
        if most == least and region.single_sheet:
            # all that the tree finds are near enough
            return Pairs(first, second, np.full(len(first), most))
    else:
        # Bubbles are searched for in classes of like size, so that small ones among large list no hundreds.
        size = np.floor(np.log(pitch / pitch.min()) / np.log(CLASS)).astype(np.int64)
        found = [_pairs_of_class(points, pitch, size, number, reach) for number in np.unique(size)]
        first, second = np.concatenate(found, axis=1)
    pairs = within_reach(Pairs(first, second, (pitch[first] + pitch[second]) / 2), points, skin)
    if region.single_sheet:
        return pairs
    same = region.same_side(row[pairs.first], row[pairs.second])
    return Pairs(pairs.first[same], pairs.second[same], pairs.stable[same])


def within_reach(pairs: Pairs, points: Floats, skin: float) -> Pairs:
    """Those of the pairs that are closer now than 1.5 stable distances plus `skin` pitches."""
    away = points.take(pairs.first, axis=0)
    away -= points.take(pairs.second, axis=0)
    close = dots(away, away) < ((REACH + skin) * pairs.stable) ** 2
    return Pairs(pairs.first[close], pairs.second[close], pairs.stable[close])


def _pairs_of_class(at: Floats, pitch: Floats, size: Ints, number: int, reach: float) -> Ints:
    """Pairs (2, m) of bubbles of the class `number` of sizes with one another and with all smaller ones."""
    own, smaller = np.flatnonzero(size == number), np.flatnonzero(size < number)
    widest = reach * float(pitch[own].max())
    tree = cKDTree(at[own], balanced_tree=False, compact_nodes=False)
    among = own[tree.query_pairs(widest, output_type="ndarray").T]
    if not len(smaller):
        return among
    others = cKDTree(at[smaller], balanced_tree=False, compact_nodes=False)
    across = tree.sparse_distance_matrix(others, widest, output_type="ndarray")
    return np.concatenate([among, [own[across["i"]], smaller[across["j"]]]], axis=1)


def renewed_pairs(
    pairs: Pairs, stale: Ints, charts: Charts, points: Floats, row: Ints, pitch: Floats, skin: float
) -> Pairs:
    """The same list where only the bubbles `stale` have moved by more than the skin allows."""
    n = len(points)
    moved = np.zeros(n, dtype=bool)
    moved[stale] = True
    kept = ~(moved[pairs.first] | moved[pairs.second])
    tree = cKDTree(points, balanced_tree=False, compact_nodes=False)
    first, second = _nearest_pairs(tree, points, stale, pitch, REACH + skin)
    same = charts.region.same_side(row[first], row[second])
    first, second = first[same], second[same]
    stable = (pitch[first] + pitch[second]) / 2
    return Pairs(
        np.concatenate([pairs.first[kept], first]),
        np.concatenate([pairs.second[kept], second]),
        np.concatenate([pairs.stable[kept], stable]),
    )


def _nearest_pairs(tree: cKDTree, at: Floats, asked: Ints, pitch: Floats, reach: float) -> tuple[Ints, Ints]:
    """Pairs with one of the bubbles `asked`, from the nearest of each, so that small ones among large list no
    hundreds.
    """
    n = len(at)
    count = min(MOST_NEAR, n)
    distance, near = tree.query(at[asked], k=count, distance_upper_bound=reach * float(pitch.max()))
    own, near, distance = np.repeat(asked, count), near.reshape(-1), distance.reshape(-1)
    found = (near < n) & (near != own)
    own, near, distance = own[found], near[found], distance[found]
    close = distance < reach * (pitch[own] + pitch[near]) / 2
    low, high = np.minimum(own, near)[close], np.maximum(own, near)[close]
    code = np.unique(low * n + high)
    return code // n, code % n
