"""Who is too close to whom, and who gives way."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from ..mesh import Bools, Floats, Ints


def close_pairs(at: Floats, distance: Floats) -> Ints:
    """Pairs (m, 2) of the points `at` (n, k) that are closer than the mean of their `distance` (n,)."""
    # Searched for by the first three coordinates alone, which is quicker; the others tell sheets apart.
    tree = cKDTree(at[:, :3], balanced_tree=False, compact_nodes=False)
    pairs = tree.query_pairs(float(distance.max(initial=0.0)), output_type="ndarray")
    away = at[pairs[:, 0]] - at[pairs[:, 1]]
    return pairs[np.einsum("mk,mk->m", away, away) < distance[pairs].mean(axis=1) ** 2]


def uncrowded(pairs: Ints, rank: Ints) -> Bools:
    """Which of n bubbles stay, (n,), when of every close pair (m, 2) the one with the higher `rank` (n,)
    gives way.

    One that has given way troubles nobody any more: the result is that of going through all bubbles by rank.
    """
    kept = np.ones(len(rank), dtype=bool)
    while len(pairs):
        # In every round whoever ranks before all rivals stays for good and drives these out.
        best = np.full(len(rank), len(rank))
        np.minimum.at(best, pairs[:, 0], rank[pairs[:, 1]])
        np.minimum.at(best, pairs[:, 1], rank[pairs[:, 0]])
        winner = rank < best
        kept[pairs[winner[pairs[:, 0]], 1]] = False
        kept[pairs[winner[pairs[:, 1]], 0]] = False
        pairs = pairs[kept[pairs].all(axis=1)]
    return kept
