"""Long work as a generator of progress steps.

One generator serves every caller: a script drives it to its end, a modal operator takes one step per timer
event and can stop between two steps, which cancels the work.
"""

from __future__ import annotations

from collections.abc import Callable, Generator
from typing import NamedTuple, TypeVar

from .mesh import Floats


class Snapshot(NamedTuple):
    """Bubbles at a moment of their packing: position (n, 3) of their centres, normal (n, 3) of the surface
    there, pitch (n,), the diameters of the bubbles.
    """

    position: Floats
    normal: Floats
    pitch: Floats


class Progress(NamedTuple):
    """Where the work stands: the stage's name (a present participle) and its share done, 0 to 1.

    snapshot: gives the bubbles as they are until the next step is taken; None where there is nothing to see
    """

    stage: str
    fraction: float
    snapshot: Callable[[], Snapshot] | None = None


Result = TypeVar("Result")
Steps = Generator[Progress, None, Result]


def within(steps: Steps[Result], low: float, high: float) -> Steps[Result]:
    """Pass `steps` on as a part of longer work: their fractions 0 to 1 become `low` to `high`."""
    while True:
        try:
            progress = next(steps)
        except StopIteration as end:
            return end.value
        yield progress._replace(fraction=low + (high - low) * progress.fraction)


def drive(steps: Steps[Result], report: Callable[[Progress], None] | None = None) -> Result:
    """Run `steps` to the end, telling `report` of each one, and return its result."""
    while True:
        try:
            progress = next(steps)
        except StopIteration as end:
            return end.value
        if report is not None:
            report(progress)
