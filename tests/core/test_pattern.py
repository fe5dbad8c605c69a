"""Patterns taken apart and put together: ids, wishes and what was left out go along."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from bubble_pattern_addon.core.metric import Places
from bubble_pattern_addon.core.pattern import Pattern, all_bubbles, joined, split, take


def numbered(n: int, first: float = 0.0) -> Pattern:
    """Bubbles in a row whose columns all tell which one they are."""
    number = first + np.arange(n)
    triple = np.repeat(number[:, None], 3, axis=1)
    places = Places(triple, number.astype(np.int64), triple)
    columns = (triple + 0.1, triple + 0.2, number + 0.3, number + 0.4, number.astype(np.int64))
    return Pattern(places, *columns, wished=number + 0.5)


def check_rows(pattern: Pattern, number: np.ndarray) -> None:
    """Every column of the rows is that of these bubbles."""
    assert np.array_equal(pattern.position[:, 0], number)
    assert np.array_equal(pattern.places.triangle, number)
    assert np.array_equal(pattern.normal[:, 0], number + 0.1)
    assert np.array_equal(pattern.pitch, number + 0.3)
    assert np.array_equal(pattern.diameter, number + 0.4)
    assert pattern.wished is not None
    assert np.array_equal(pattern.wished, number + 0.5)


masks = st.lists(st.booleans(), min_size=1, max_size=12)


@given(st.lists(masks, min_size=1, max_size=3))
@settings(derandomize=True)
def test_joined_patterns_keep_ids_wishes_and_what_was_left_out(kept: list[list[bool]]) -> None:
    ends = np.cumsum([0] + [len(mask) for mask in kept])
    parts = [
        split(numbered(len(mask), first), np.array(mask))
        for mask, first in zip(kept, ends.tolist(), strict=False)
    ]
    whole = joined(parts)
    chosen = np.concatenate([np.array(mask) for mask in kept])
    check_rows(whole, np.flatnonzero(chosen))
    assert np.array_equal(whole.ids, np.flatnonzero(chosen))
    left = np.flatnonzero(~chosen)
    assert (whole.dropped is None) == (not len(left))
    if whole.dropped is not None:
        check_rows(whole.dropped, left)
        assert np.array_equal(whole.dropped.ids, left)
    everything = all_bubbles(whole)
    check_rows(everything, np.arange(len(chosen)))
    assert np.array_equal(everything.ids, np.arange(len(chosen)))


@given(masks, st.data())
@settings(derandomize=True)
def test_bubbles_that_are_gone_leave_their_ids_behind(there: list[bool], data: st.DataObject) -> None:
    bubbles = take(numbered(len(there)), np.array(there))
    mask = data.draw(st.lists(st.booleans(), min_size=len(bubbles), max_size=len(bubbles)))
    again = all_bubbles(split(bubbles, np.array(mask, dtype=bool)))
    check_rows(again, np.flatnonzero(there))
    assert np.array_equal(again.ids, np.flatnonzero(there))


def test_notes_of_joined_patterns_are_told_once_and_unknown_wishes_are_the_sizes() -> None:
    one = replace(numbered(2), notes=("a", "b"))
    other = replace(numbered(2), notes=("b",), wished=None)
    whole = joined([one, other])
    assert whole.notes == ("a", "b")
    assert whole.wished is not None
    assert np.array_equal(whole.wished, [0.5, 1.5, 0.4, 1.4])
