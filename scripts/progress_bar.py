"""A bar on the terminal that follows a run of the batch."""

from __future__ import annotations

import sys
from collections.abc import Callable
from importlib.util import find_spec
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from bubble_pattern_addon.core.progress import Progress


def progress_bar() -> Callable[[Progress], None] | None:
    """A reporter for batch.main that draws a bar; None where stderr is no terminal or tqdm is missing."""
    if find_spec("tqdm") is None or not sys.stderr.isatty():
        return None
    from tqdm import tqdm

    bar = tqdm(total=100, leave=False, bar_format="{desc:<24}{percentage:3.0f}% |{bar}| {elapsed}")

    def show(progress: Progress) -> None:
        if progress.stage == "Done":
            bar.close()
            return
        bar.set_description_str(progress.stage, refresh=False)
        bar.n = round(100 * progress.fraction)
        bar.refresh()

    return show
