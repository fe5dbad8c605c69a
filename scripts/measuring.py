"""How the benchmark measures: runs in turn, seconds of clock and cores, memory, tables in markdown."""

from __future__ import annotations

import statistics
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path

import numpy as np

ENOUGH = 12.0
"""Seconds of one measurement after which it is not repeated any more."""
STEADY = 2.0
"""Seconds that measurements in turn go on for in all, at least."""


def print_head(head: str) -> None:
    """Print a table's head."""
    print(f"\n{head}\n|{' --- |' * (head.count('|') - 1)}", flush=True)


def number(value: float, digits: int) -> str:
    """A figure of a table; a dash where there is none."""
    return f"{value:.{digits}f}" if np.isfinite(value) else "-"


def in_turn(runs: list[Callable[[], float]], repeats: int) -> list[float]:
    """Median of the seconds that each run returns; they take turns, `repeats` times or for ENOUGH seconds,
    but quick ones so often that chance has no say: for STEADY seconds in all.
    """
    seconds: list[list[float]] = [[] for _ in runs]
    while len(seconds[0]) < repeats or sum(map(sum, seconds)) < STEADY:
        before = sum(map(len, seconds))
        for run, taken in zip(runs, seconds, strict=True):
            if sum(taken) < ENOUGH:
                taken.append(run())
        if sum(map(len, seconds)) == before:
            break
    return [statistics.median(taken) for taken in seconds]


@dataclass(frozen=True)
class Taken:
    """Seconds on the clock, and of all cores together."""

    clock: float
    cores: float


def timed(run: Callable[[], object]) -> Taken:
    """What one run takes."""
    clock, cores = time.perf_counter(), time.process_time()
    run()
    return Taken(time.perf_counter() - clock, time.process_time() - cores)


def least(runs: list[Callable[[], Taken]], repeats: int) -> list[Taken]:
    """The least that each run takes; they take turns, `repeats` times or until one has taken ENOUGH."""
    found: list[list[Taken]] = [[] for _ in runs]
    for _ in range(repeats):
        for run, taken in zip(runs, found, strict=True):
            taken.append(run())
        if max(sum(one.clock for one in taken) for taken in found) > ENOUGH:
            break
    return [Taken(min(one.clock for one in taken), min(one.cores for one in taken)) for taken in found]


def peak_memory(*arguments: str) -> str:
    """Largest resident size of a process of its own in which the benchmark does one thing."""
    if find_spec("resource") is None:
        return "not measured (this system does not tell)"
    command = [sys.executable, str(Path(__file__).resolve().with_name("benchmark.py")), *arguments]
    return subprocess.run(command, check=True, capture_output=True, text=True).stdout.strip()


def own_peak() -> float:
    """Largest resident size of this process so far, in MiB."""
    status = Path("/proc/self/status")
    if status.is_file():
        # Linux lets a process start with the size of the one that started it, but not here
        return int(status.read_text().split("VmHWM:")[1].split()[0]) / 2**10
    import resource

    unit = 1 if sys.platform == "darwin" else 1024
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * unit / 2**20


def installed(module: str) -> bool:
    """Whether a peer is there; says so when it is not."""
    there = find_spec(module) is not None
    if not there:
        print(f"\n{module} is not installed: its rows are left out (the extra benchmark)", file=sys.stderr)
    return there
