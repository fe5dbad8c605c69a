"""Adding beside the bare boolean, and inside Blender beside its Boolean modifier."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import manifold3d
import numpy as np

from bubble_pattern_addon.core.mesh import Mesh
from bubble_pattern_addon.core.part import Part
from bubble_pattern_addon.core.pattern import Pattern
from bubble_pattern_addon.core.plan import plan_steps
from bubble_pattern_addon.core.progress import drive
from bubble_pattern_addon.core.recipe import Feature
from bubble_pattern_addon.core.solid import part_steps
from bubble_pattern_addon.core.soundness import forget_base
from scripts.benchmark_packing import pack
from scripts.measuring import Taken, installed, least, own_peak, peak_memory, print_head, timed
from scripts.shapes import Shape, curved_slab, plate

HOLE = Feature(kind="hole", sides=32)


def adding(repeats: int) -> None:
    """`part_steps` with everything it does against the bare subtraction of the same cutters."""
    print(
        "\n## Adding\n\n32-sided through-holes. Ours: everything, the base looked through for the first "
        "time; again: the same base once\nmore, known to be sound. Bare: the subtraction alone, both solids "
        "built beforehand; built: with their building.\nSeconds are the least of several runs in turn; "
        "ratio: ours by bare; cores: the same in seconds of all cores together."
    )
    print_head(
        "| base | triangles | holes | ours, s | again, s | bare, s | built, s | ratio | cores "
        "| again by bare | ours by built | peak, ours | peak, built | watertight | genus | problems |"
    )
    for name, shape, pitch in adding_cases():
        add(name, shape, pitch, repeats)


def adding_cases() -> list[tuple[str, Shape, float]]:
    """Bases for adding, with the pitch that gives about 1,000 holes or 10,000."""
    return [
        ("curved slab", curved_slab(), 6.5),
        ("curved slab", curved_slab(), 2.15),
        ("flat plate, two-triangle faces", plate(300.0, 300.0, 3.0, 3.22), 3.22),
        ("curved slab, scan-fine", curved_slab(400), 6.5),
    ]


def cutters_of(shape: Shape, pattern: Pattern) -> Mesh:
    """What is cut out of a base."""
    return drive(plan_steps(shape.mesh, pattern, HOLE)).cutters.mesh


def add(name: str, shape: Shape, pitch: float, repeats: int) -> None:
    """One line of the table of adding."""
    pattern = pack(shape, pitch)[0]
    cutters = cutters_of(shape, pattern)
    parts: list[Part] = []

    def again() -> None:
        parts[:] = [drive(part_steps(shape.mesh, pattern, HOLE))]

    def first() -> Taken:
        forget_base()
        return timed(again)

    def bare() -> Taken:
        solids = as_manifold(shape.mesh), as_manifold(cutters)
        return timed(lambda: (solids[0] - solids[1]).to_mesh64())

    def built() -> Taken:
        return timed(lambda: (as_manifold(shape.mesh) - as_manifold(cutters)).to_mesh64())

    ours, known, alone, whole = least([first, lambda: timed(again), bare, built], repeats)
    check = parts[0].check
    seconds = (one.clock for one in (ours, known, alone, whole))
    ratios = (
        ours.clock / alone.clock,
        ours.cores / alone.cores,
        known.clock / alone.clock,
        ours.clock / whole.clock,
    )
    figures = [*(f"{value:.2f}" for value in seconds), *(f"**{value:.2f}**" for value in ratios)]
    peaks = [peak_memory("--add-once", name, str(pitch), way) for way in ("ours", "bare")]
    print(
        f"| {name} | {len(shape.mesh.triangles):,} | {check.through:,} of {len(pattern):,} "
        f"| {' | '.join(figures)} | {' | '.join(peaks)} | {check.watertight} | {check.genus:,} "
        f"| {len(check.problems)} |",
        flush=True,
    )


def blender(repeats: int) -> None:
    """Adding in Blender from object to mesh against the Boolean modifier with the MANIFOLD solver."""
    if not installed("bpy"):
        return
    from scripts import peers_blender as inside

    print(
        f"\n## Adding in Blender {inside.version()}\n\nFrom the object to the new mesh, same cutters; ours "
        "with the base looked through for the first time; again:\nthe same base once more, known sound, "
        "as when Apply is pressed a second time.\nSeconds are the least of several runs in turn; cores: the "
        "ratio in seconds of all cores together."
    )
    print_head(
        "| base | holes | ours, s | again, s | modifier, s | ratio | cores | again by modifier "
        "| faces, ours | faces, modifier |"
    )
    for name, shape, pitch in adding_cases():
        inside.clear()
        base_object = inside.place(shape.mesh, "base")
        assert inside.unchanged(base_object, shape.mesh)
        read = Shape(inside.read(base_object).mesh, shape.selected, pitch)
        pattern = pack(read, pitch)[0]
        cutter_object = inside.place(cutters_of(read, pattern), "cutters")
        faces = [0, 0]

        def again(given: tuple[Any, ...] = (base_object, pattern, HOLE), faces: list[int] = faces) -> Taken:
            return timed(lambda: faces.__setitem__(0, inside.ours(*given)))

        def ours(again: Callable[[], Taken] = again) -> Taken:
            forget_base()
            return again()

        def theirs(given: tuple[Any, ...] = (base_object, cutter_object), faces: list[int] = faces) -> Taken:
            return timed(lambda: faces.__setitem__(1, inside.modifier(*given)))

        mine, known, other = least([ours, again, theirs], repeats)
        print(
            f"| {name} | {len(pattern):,} | {mine.clock:.2f} | {known.clock:.2f} | {other.clock:.2f} "
            f"| **{mine.clock / other.clock:.2f}** | **{mine.cores / other.cores:.2f}** "
            f"| **{known.clock / other.clock:.2f}** | {faces[0]:,} | {faces[1]:,} |",
            flush=True,
        )
    inside.clear()


def as_manifold(mesh: Mesh) -> manifold3d.Manifold:
    """A mesh as it is, as a manifold."""
    return manifold3d.Manifold(
        manifold3d.Mesh64(np.ascontiguousarray(mesh.vertices), mesh.triangles.astype(np.uint64))
    )


def add_once(name: str, pitch: float, ours: bool) -> None:
    """Add one pattern, or subtract its cutters barely, and print the process's peak memory."""
    shape = next(shape for known, shape, size in adding_cases() if (known, size) == (name, pitch))
    pattern = pack(shape, pitch)[0]
    if ours:
        drive(part_steps(shape.mesh, pattern, HOLE))
    else:
        (as_manifold(shape.mesh) - as_manifold(cutters_of(shape, pattern))).to_mesh64()
    print(f"{own_peak():,.0f} MiB")
