"""Work under way in a window: a generator of progress steps, of which there is one at a time.

A run outlives the operator that drives it, which Blender may free at any time; and it can be ended from
outside: before undo, before another file is opened or this one is saved, when the add-on is switched off.
"""

from __future__ import annotations

import time
from typing import Any

from bpy.app.handlers import persistent

from ..core.progress import Progress, Steps
from . import handling


class Run:
    """Some work under way, on the object with the number `about`. `latest` is its latest step; `result` what
    it returned, once it has `ended`; `changed_at` when a setting has changed that it did not know of.
    """

    def __init__(self, steps: Steps[Any], about: int = 0) -> None:
        self.about = about
        self.renew(steps)

    def renew(self, steps: Steps[Any]) -> None:
        """Begin again with other steps; those before must have been closed."""
        self.steps = steps
        self.latest = Progress("Working", 0.0)
        self.result: Any = None
        self.ended = False
        self.changed_at: float | None = None

    @property
    def open(self) -> bool:
        """Whether nobody has stopped it."""
        return _under_way[0] is self

    def advance(self, seconds: float) -> None:
        """Take steps for `seconds`, at least one. Raises what a step raises."""
        until = time.perf_counter() + seconds
        try:
            while True:
                self.latest = next(self.steps)
                if time.perf_counter() >= until:
                    return
        except StopIteration as end:
            self.result, self.ended = end.value, True

    def stop(self) -> None:
        """End it; work that has not ended is given up, and closing its generator undoes what it began."""
        if self.open:
            _under_way[0] = None
        self.steps.close()


_under_way: list[Run | None] = [None]


def begin(steps: Steps[Any], about: int = 0) -> Run:
    """Begin a run; another one under way is stopped."""
    stop()
    run = Run(steps, about)
    _under_way[0] = run
    return run


def under_way() -> Run | None:
    """The run under way."""
    return _under_way[0]


def stop() -> None:
    """Stop the run under way, if there is one."""
    if _under_way[0] is not None:
        _under_way[0].stop()


@persistent
def stop_before(*_: Any) -> None:
    """What is about to happen would pull the data away from under the work, or save it half-done."""
    stop()


HANDLERS = tuple((name, stop_before) for name in ("undo_pre", "redo_pre", "load_pre", "save_pre"))


def register() -> None:
    """Have runs end before the data change."""
    handling.add(HANDLERS)


def unregister() -> None:
    """End the run under way."""
    stop()
    handling.remove(HANDLERS)
