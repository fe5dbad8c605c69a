"""Keys sorted together with their places."""

from __future__ import annotations

import numpy as np

from .mesh import Ints


def ranked(key: Ints, bits: int) -> tuple[Ints, np.ndarray]:
    """The keys, (n,) from 0 to 2**bits - 1, by rising key, and where each stood, (n,), of equal ones the
    first one first. The array that is given is used up; places are of 32 bits where these are enough.
    """
    below = len(key).bit_length()
    if bits + below > 63:
        order = np.argsort(key, kind="stable")
        return key[order], order
    # numbers that carry their places with them are sorted in a third of the time
    key <<= below
    key |= np.arange(len(key))
    key.sort()
    place = np.empty(len(key), dtype=np.int32 if below < 32 else np.int64)
    np.bitwise_and(key, (1 << below) - 1, out=place, casting="unsafe")
    key >>= below
    return key, place


def numbered(key: Ints, bits: int) -> tuple[Ints, Ints]:
    """The different keys, rising, and the row of each key among them, (n,); for the rest see `ranked`."""
    key, place = ranked(key, bits)
    new = np.ones(len(key), dtype=bool)
    np.not_equal(key[1:], key[:-1], out=new[1:])
    row = np.empty(len(key), dtype=np.int64)
    row[place] = np.cumsum(new) - 1
    return key[new], row
