"""What of a pattern was done by hand: what is not settled yet, and what is lost when it is laid anew."""

from __future__ import annotations

from typing import Any, NamedTuple

import bpy
import numpy as np

from ..core.errors import PatternError
from . import watching
from .attributes import read_values
from .point_marks import laid_places

# A point farther than this from where it was laid, in pitches, has been moved.
MOVED = 1e-3


class ByHand(NamedTuple):
    """How many points were moved, added and deleted since the pattern was laid or settled."""

    moved: int = 0
    added: int = 0
    deleted: int = 0

    @property
    def unsettled(self) -> bool:
        """Whether some points are not where their features would be made; deleted ones simply are no more."""
        return self.moved + self.added > 0

    def __str__(self) -> str:
        counts = ((self.moved, "moved"), (self.added, "added"), (self.deleted, "deleted"))
        return listed([f"{count:,} {what}" for count, what in counts if count])


def listed(words: list[str]) -> str:
    """Words as a sentence lists them: "a, b and c"."""
    *others, last = words or [""]
    return f"{', '.join(others)} and {last}" if others else last


_known: dict[int, tuple[watching.Stamp, ByHand]] = {}
watching.forgetters.append(_known.clear)


def by_hand(obj: bpy.types.Object) -> ByHand:
    """What has become of the points of the pattern `obj` by hand, in Object Mode; nothing is known of files
    that do not say where points were laid.
    """
    if obj.mode == 'EDIT':
        return ByHand()
    points = obj.data.attributes
    laid_ids, laid_at = laid_places(obj)
    if not len(laid_ids) or "id" not in points or "pitch" not in points:
        return ByHand()
    ids = read_values(points["id"].data, "value", np.int32).astype(np.int64)
    pitch = read_values(points["pitch"].data, "value", np.float32).astype(np.float64)
    position = read_values(obj.data.vertices, "co", np.float32, 3).astype(np.float64)
    row = np.minimum(np.searchsorted(laid_ids, ids), len(laid_ids) - 1)
    away = np.linalg.norm(position - laid_at[row], axis=1)
    own = (laid_ids[row] == ids) & (pitch > 0)
    there = len(np.unique(ids[own]))
    # of points with the same id, as copies have, the one nearest to where it was laid is the bubble
    order = np.lexsort((away, ids, ~own))
    ids, own, moved = ids[order], own[order], (away > MOVED * pitch)[order]
    first = own & np.concatenate([[True], np.diff(ids) != 0])
    return ByHand(int((first & moved).sum()), len(ids) - there, len(laid_ids) - there)


def by_hand_now(obj: bpy.types.Object) -> ByHand:
    """The same for drawing: counted again only where the pattern has changed since."""
    stamp = watching.stamp_of(obj)
    if stamp is None:
        return by_hand(obj)
    if obj.session_uid not in _known or _known[obj.session_uid][0] != stamp:
        _known[obj.session_uid] = stamp, by_hand(obj)
    return _known[obj.session_uid][1]


def check_settled(obj: bpy.types.Object) -> None:
    """PatternError where points of the pattern `obj` were moved or added and not settled yet: their features
    would be made where they were, not where they are to be seen.
    """
    found = by_hand(obj)
    if found.unsettled:
        raise PatternError(
            f'Features of "{obj.name}" were placed by hand ({found}) and are not settled yet: press Settle '
            "to take them as they are, or Update to lay the pattern anew"
        )


def at_stake(obj: bpy.types.Object, pins: bool = False, sizes: bool = False) -> str:
    """What was done by hand and would be lost if the pattern `obj` were laid anew, as a list in words;
    nothing where all stays.

    pins, sizes: whether pins and fixed sizes, which settings keep, are replaced as well
    """
    settings: Any = obj.bubble_pattern
    words = ["features settled by hand"] if settings.hand_made else []
    found = by_hand(obj)
    if any(found):
        words.append(f"{found} point{'s' if sum(found) > 1 else ''}")
    if pins and len(settings.pins):
        words.append(f"{len(settings.pins):,} pinned")
    if sizes and len(settings.seeds):
        words.append(f"{len(settings.seeds):,} of fixed size")
    return listed(words)


def is_kept(obj: bpy.types.Object) -> bool:
    """Whether the pattern `obj` is laid anew only when the user says so."""
    return bool(obj.bubble_pattern.hand_made) or any(by_hand(obj))
