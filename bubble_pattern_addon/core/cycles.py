"""Rows that follow each other round, and rows that lie one after the other."""

from __future__ import annotations

import numpy as np

from .mesh import Ints


def followed(following: Ints, first: Ints, total: Ints) -> Ints:
    """The `total`, (n,), rows that follow each other from each `first`, (n,), end to end.

    following: the row that comes after each one
    """
    start = np.cumsum(total) - total
    rows = np.empty(total.sum(), dtype=np.int64)
    under_way, row, step = np.arange(len(first)), first, 0
    while len(under_way):
        rows[start[under_way] + step] = row
        step += 1
        more = total[under_way] > step
        under_way, row = under_way[more], following[row[more]]
    return rows


def members(number: Ints) -> tuple[Ints, Ints]:
    """Of groups of `number` members, (n,), which lie one after the other: the group of each member and its
    place there, from 0.
    """
    owner = np.repeat(np.arange(len(number)), number)
    return owner, np.arange(len(owner)) - np.repeat(np.cumsum(number) - number, number)


def next_round(number: Ints) -> Ints:
    """The member that comes after each one of such groups; after the last one of a group its first."""
    number = number[number > 0]
    end = np.cumsum(number)
    following = np.arange(1, number.sum() + 1)
    following[end - 1] = end - number
    return following


def ranges(start: Ints, number: Ints) -> Ints:
    """`number`, (n,), whole numbers from each `start`, (n,), on, end to end."""
    before = np.cumsum(number) - number
    return np.arange(number.sum()) + np.repeat(start - before, number)


def unrolled(following: Ints, first: Ints, total: Ints) -> Ints:
    """The same as `followed` where every row is on one of these ways: in few rounds however long they are.

    Each round every row looks twice as far ahead (J. C. Wyllie's list ranking, The complexity of parallel
    computations, 1979).
    """
    before = np.empty(len(following), dtype=np.int64)
    before[following] = np.arange(len(following))
    end = before[first]
    ahead = following.copy()
    ahead[end] = end
    left = np.ones(len(following), dtype=np.int64)
    left[end] = 0
    for _ in range(int(total.max(initial=1)).bit_length()):
        left += left[ahead]
        ahead = ahead[ahead]
    way = np.empty(len(following), dtype=np.int64)
    way[end] = np.arange(len(first))
    way = way[ahead]
    rows = np.empty(len(following), dtype=np.int64)
    rows[np.cumsum(total)[way] - 1 - left] = np.arange(len(following))
    return rows
