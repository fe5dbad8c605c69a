"""A bar on the terminal that follows a run of the batch."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any

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


@contextmanager
def follow_rendering(show: Callable[[Progress], None]) -> Iterator[None]:
    """Tell `show` of the samples of all pictures that Blender renders meanwhile."""
    import re

    import bpy

    from bubble_pattern_addon.core.progress import Progress

    @bpy.app.handlers.persistent  # it shall outlive the files that are opened
    def rendering(stats: Any, *_: Any) -> None:
        sample = re.search(r"Sample (\d+)/(\d+)", str(stats))
        if sample:
            show(Progress("Rendering", int(sample[1]) / int(sample[2])))

    bpy.app.handlers.render_stats.append(rendering)
    try:
        yield
    finally:
        bpy.app.handlers.render_stats.remove(rendering)
