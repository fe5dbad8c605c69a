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


def ranges(start: Ints, number: Ints) -> Ints:
    """`number`, (n,), whole numbers from each `start`, (n,), on, end to end."""
    before = np.cumsum(number) - number
    return np.arange(number.sum()) + np.repeat(start - before, number)
