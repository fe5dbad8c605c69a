"""What a run says on the terminal, and what it keeps from being said there."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import IO

from .core.progress import Progress


def line_on(stream: IO[str]) -> Callable[[Progress], None]:
    """A reporter that keeps one line of `stream` up to date; where that is no terminal, a line per stage."""
    said = ""
    terminal = stream.isatty()

    def show(progress: Progress) -> None:
        """Say where the work stands; the stage "Done" takes the line away."""
        nonlocal said
        if terminal:
            text = "" if progress.stage == "Done" else f"{progress.stage} {100 * progress.fraction:.0f} %"
            print(f"\r{text:<60}", end="\r" if not text else "", file=stream, flush=True)
        elif progress.stage not in (said, "Done"):
            print(f"{progress.stage} ...", file=stream, flush=True)
        said = progress.stage

    return show


@contextmanager
def silenced() -> Iterator[None]:
    """Send what libraries write straight to the process's standard output to nowhere, Python's prints too."""
    sys.stdout.flush()
    kept = os.dup(1)
    nowhere = os.open(os.devnull, os.O_WRONLY)
    try:
        os.dup2(nowhere, 1)
        yield
    finally:
        sys.stdout.flush()
        os.dup2(kept, 1)
        os.close(kept)
        os.close(nowhere)
