"""Which objects have changed, as Blender's dependency graph tells: a stamp per object that grows.

Objects are known by their session's number, never by a pointer, and undo, redo and the opening of a file
make every stamp another: so nothing that was learnt under an older stamp is ever taken for current.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from typing import Any, NamedTuple

import bpy
from bpy.app.handlers import persistent

from . import handling


class Stamp(NamedTuple):
    """What an object was like: `era` counts undo, redo and opened files, `changes` those of the object."""

    era: int
    changes: int


class Watch:
    """What is watched and what was seen of it: plain numbers, without a reference to Blender's data."""

    def __init__(self) -> None:
        self.era = 0
        self.changes: Counter[int] = Counter()
        self.watched: set[int] = set()
        self.unseen: set[int] = set()

    def forget(self) -> None:
        """Begin another era, in which nothing is known yet."""
        self.era += 1
        self.unseen |= self.watched


_watch = Watch()
# Called after every change of an object that is watched.
listeners: list[Callable[[], None]] = []
# Called when all that was learnt of objects is of no use any more: what keeps some of it frees it.
forgetters: list[Callable[[], None]] = []


def stamp_of(obj: bpy.types.Object) -> Stamp | None:
    """The stamp of `obj`, which is watched from now on; None while the add-on is not registered.

    What Blender has not worked out yet is no change so far: ask for the dependency graph first.
    """
    if noted not in bpy.app.handlers.depsgraph_update_post:
        return None
    _watch.watched.add(obj.session_uid)
    return Stamp(_watch.era, _watch.changes[obj.session_uid])


def take_unseen() -> set[int]:
    """Numbers of the watched objects that have changed since this was last asked."""
    unseen, _watch.unseen = _watch.unseen, set()
    return unseen


def put_back(numbers: set[int]) -> None:
    """Let these objects be asked for again: they could not be looked at."""
    _watch.unseen |= numbers


def any_unseen() -> bool:
    """Whether a watched object has changed since take_unseen."""
    return bool(_watch.unseen)


@persistent
def noted(_scene: Any, depsgraph: bpy.types.Depsgraph) -> None:
    """Take note of what has changed."""
    if not _watch.watched:
        return
    for update in depsgraph.updates:
        if update.is_updated_geometry or update.is_updated_transform:
            number = update.id.original.session_uid
            if number in _watch.watched:
                _watch.changes[number] += 1
                _watch.unseen.add(number)
    if _watch.unseen:
        for listener in listeners:
            listener()


@persistent
def another_state(*_: Any) -> None:
    """Undo, redo: whatever was known may be otherwise."""
    _watch.forget()
    for forget in forgetters:
        forget()
    for listener in listeners:
        listener()


@persistent
def another_file(*_: Any) -> None:
    """A file has been opened: other objects, other numbers."""
    _watch.forget()
    _watch.watched.clear()
    _watch.unseen.clear()
    _watch.changes.clear()
    for forget in forgetters:
        forget()


HANDLERS = (
    ("depsgraph_update_post", noted),
    ("undo_post", another_state),
    ("redo_post", another_state),
    ("load_post", another_file),
)


def register() -> None:
    """Begin to watch."""
    handling.add(HANDLERS)


def unregister() -> None:
    """Watch no more, and forget all."""
    handling.remove(HANDLERS)
    another_file()
