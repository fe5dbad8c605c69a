"""How long a designer waits for the pattern to follow a setting, in Blender: from the change of the property
to the evaluated instances, with everything in between. Counted beside the seconds: what was worked out anew.

Needs the Blender module (`bpy`).
"""

from __future__ import annotations

import os
import statistics
import tempfile
import time
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from typing import Any
from unittest.mock import patch

os.environ.setdefault("BLENDER_USER_EXTENSIONS", tempfile.mkdtemp(prefix="bubble_pattern_"))

import bpy
import numpy as np

import bubble_pattern_addon
from bubble_pattern_addon.blender import generation, sources
from bubble_pattern_addon.blender.properties import pattern_of
from bubble_pattern_addon.blender.target_region import ATTRIBUTE, store
from bubble_pattern_addon.core import solid
from bubble_pattern_addon.core.metric import Bound, Constant
from bubble_pattern_addon.core.packing import relax
from scripts import peers_blender
from scripts.shapes import Shape

WORK: dict[str, tuple[tuple[Any, str], ...]] = {
    "base reads": ((sources, "read_base"),),
    "regions built": ((sources, "make_region"),),
    "force evaluations": ((relax, "pull_on"),),
    "field evaluations": ((Constant, "__call__"), (Bound, "__call__")),
    "boolean calls": ((solid, "cut"),),
}
"""What is counted: calls of these functions."""


def counting(real: Callable[..., Any], name: str, calls: Counter[str]) -> Callable[..., Any]:
    """The function `real`, whose calls are counted under `name`."""

    def counted(*arguments: Any, **named: Any) -> Any:
        calls[name] += 1
        return real(*arguments, **named)

    return counted


@contextmanager
def counted_work() -> Iterator[Counter[str]]:
    """Count the WORK done meanwhile."""
    calls: Counter[str] = Counter()
    with ExitStack() as stack:
        for name, places in WORK.items():
            for owner, function in places:
                real = getattr(owner, function)
                stack.enter_context(patch.object(owner, function, counting(real, name, calls)))
        yield calls


def panel(shape: Shape, pitch: float) -> Any:
    """Settings of a pattern on the shape in Blender, of about as many features as fit at this pitch."""
    base = peers_blender.place(shape.mesh, "base")
    store(base, ATTRIBUTE, np.asarray(shape.selected, dtype=bool))
    bpy.context.view_layer.objects.active = base
    bpy.ops.bubble_pattern.add(pitch=pitch, diameter=0.55 * pitch)
    pattern = pattern_of(base)
    assert pattern is not None
    return pattern.bubble_pattern


def shown() -> int:
    """Number of instances, once Blender has worked all out."""
    graph = bpy.context.evaluated_depsgraph_get()
    return sum(instance.is_instance for instance in graph.object_instances)


def latency(settings: Any, name: str, values: list[float]) -> tuple[list[float], list[float], Counter[str]]:
    """Seconds on the clock and of the processor for each of the `values`, and the work of all together."""
    clock, cores = [], []
    with counted_work() as calls:
        for value in values:
            began, before = time.perf_counter(), time.process_time()
            setattr(settings, name, value)
            bpy.context.evaluated_depsgraph_get()
            clock.append(time.perf_counter() - began)
            cores.append(time.process_time() - before)
            assert not settings.trouble, settings.trouble
            assert shown() == settings.count
    return clock, cores, calls


def preview(cases: list[tuple[str, Shape, float]], repeats: int) -> None:
    """A table: seconds and work of a change of packing and of one of shaping."""
    print(
        f"\n## Preview in Blender {peers_blender.version()}\n\nFrom the change of a setting to the evaluated "
        "instances; the work is that of one change."
    )
    print(
        f"\n| base | triangles | features | change | least, s | median, s | cores, s | {' | '.join(WORK)} |"
    )
    print(f"|{' --- |' * (7 + len(WORK))}")
    bubble_pattern_addon.register()
    try:
        generation.LIVE_SECONDS = float("inf")  # however long it takes, it is measured
        for name, shape, pitch in cases:
            peers_blender.clear()
            settings = panel(shape, pitch)
            factors = 1 + 0.002 * np.arange(1, repeats + 1)
            changes = (
                ("packing", "pitch", pitch * factors),
                ("shaping", "diameter", 0.5 * pitch * factors),
            )
            for change, setting, values in changes:
                setattr(settings, setting, float(values[0] * 1.001))
                clock, cores, calls = latency(settings, setting, values.tolist())
                work = (f"{calls[kind] / repeats:g}" for kind in WORK)
                print(
                    f"| {name} | {len(shape.mesh.triangles):,} | {settings.count:,} | {change} "
                    f"| {min(clock):.3f} | {statistics.median(clock):.3f} | {min(cores):.3f} "
                    f"| {' | '.join(work)} |",
                    flush=True,
                )
    finally:
        peers_blender.clear()
        bubble_pattern_addon.unregister()
