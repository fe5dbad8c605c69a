"""Measure packing and adding against their peers in one run and print markdown tables.

Ours and its peer run in turn, so that a busy machine slows both; a ratio is ours by the peer's. Seconds are
medians in packing, and the least in adding, whose peers work on all cores and suffer most from a busy one.
Peers come with the extra `benchmark`; one that is not installed is left out with a line that says so. Where
this Python lacks what the core needs, the project's own environment is taken, peers and all.

Example: python scripts/benchmark.py --only flat curved
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

from scripts import environment

if __name__ == "__main__":
    environment.enter_for_lack_of(environment.CORE, "benchmark")

from scripts.benchmark_adding import add_once, adding, blender
from scripts.benchmark_packing import curved, flat, graded, jagged, pack_once
from scripts.benchmark_symmetry import symmetric
from scripts.measuring import installed
from scripts.shapes import curved_slab


def preview(repeats: int) -> None:
    """How long the pattern takes to follow a setting in Blender."""
    if not installed("bpy"):
        return
    from scripts import benchmark_preview

    cases = [
        ("curved panel", curved_slab(), 6.5),
        ("curved panel", curved_slab(), 2.15),
        ("curved panel, scan-fine", curved_slab(400), 6.5),
    ]
    benchmark_preview.preview(cases, 2 * repeats + 1)


SECTIONS: dict[str, Callable[[int], None]] = {
    "flat": flat,
    "curved": curved,
    "graded": graded,
    "jagged": jagged,
    "symmetric": symmetric,
    "adding": adding,
    "blender": blender,
    "preview": preview,
}


def main() -> None:
    """Run the chosen sections."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument(
        "--only", nargs="+", choices=list(SECTIONS), default=list(SECTIONS), metavar="SECTION"
    )
    parser.add_argument("--repeats", type=int, default=5, help="runs of each (default 5)")
    parser.add_argument("--pack-once", nargs=2, metavar=("SHAPE", "PITCH"), help=argparse.SUPPRESS)
    parser.add_argument("--add-once", nargs=3, metavar=("BASE", "PITCH", "WAY"), help=argparse.SUPPRESS)
    chosen = parser.parse_args()
    if chosen.pack_once:
        pack_once(chosen.pack_once[0], float(chosen.pack_once[1]))
        return
    if chosen.add_once:
        add_once(chosen.add_once[0], float(chosen.add_once[1]), chosen.add_once[2] == "ours")
        return
    for section in chosen.only:
        SECTIONS[section](chosen.repeats)


if __name__ == "__main__":
    main()
