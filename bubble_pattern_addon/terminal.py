"""What a run says on the terminal, and what it keeps from being said there."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager, redirect_stdout
from pathlib import Path
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
    """Send what is written to the standard output to nowhere: by Python, and by libraries straight to it."""
    with Path(os.devnull).open("w", encoding="utf-8") as nowhere, redirect_stdout(nowhere):
        try:
            kept = os.dup(1)
        except OSError:  # a program with windows and no terminal may have none
            yield
            return
        try:
            os.dup2(nowhere.fileno(), 1)
            yield
        finally:
            os.dup2(kept, 1)
            os.close(kept)
