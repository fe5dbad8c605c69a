"""Measure packing and adding against their peers in one run and print markdown tables.

Ours and its peer run in turn, so that a busy machine slows both; a ratio is ours by the peer's. Seconds are
medians in packing, and the least in adding, whose peers work on all cores and suffer most from a busy one.
Peers come with the extra `benchmark`; one that is not installed is left out with a line that says so.

Example: python scripts/benchmark.py --only flat curved
"""

from __future__ import annotations

import argparse
import statistics
import subprocess
import sys
import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from functools import partial
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import manifold3d
import numpy as np
from scipy.spatial import cKDTree

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

from bubble_pattern_addon.core.blending import Fill
from bubble_pattern_addon.core.distance import boundary_distance
from bubble_pattern_addon.core.fields import Linear, Radial
from bubble_pattern_addon.core.mesh import Floats, Mesh
from bubble_pattern_addon.core.metric import Constant
from bubble_pattern_addon.core.part import Part
from bubble_pattern_addon.core.pattern import Pattern
from bubble_pattern_addon.core.pipeline import pattern_steps
from bubble_pattern_addon.core.plan import plan_steps
from bubble_pattern_addon.core.progress import drive
from bubble_pattern_addon.core.quality import Quality, measure, measure_points
from bubble_pattern_addon.core.recipe import Feature, Packing, Recipe, Shaping
from bubble_pattern_addon.core.region import Region, make_region
from bubble_pattern_addon.core.solid import part_steps
from bubble_pattern_addon.core.soundness import forget_base
from scripts import peers
from scripts.shapes import SHAPES, Shape, circle, curved_slab, plate, rectangle_outline, trapezoid_outline

ENOUGH = 12.0
"""Seconds of one measurement after which it is not repeated any more."""
STEADY = 2.0
"""Seconds that measurements in turn go on for in all, at least."""
HOLE = Feature(kind="hole", sides=32)


@dataclass(frozen=True)
class Row:
    """One line of a packing table. edge: least centre to boundary in pitches; mirror: see `mirrored`."""

    region: str
    method: str
    n: int
    seconds: float
    quality: Quality
    edge: float
    mirror: float
    ratio: float | None = None


FIGURES = "six | ψ6 | gap CV | gap min | rim CV | void"
HEAD = f"| region | method | n | seconds | ratio | {FIGURES} | edge | mirror |"


def print_rows(rows: Iterable[Row]) -> None:
    """Print packings as the lines of a table."""
    for row in rows:
        q = row.quality
        figures = [
            *(_number(row.seconds, 3), "" if row.ratio is None else f"**{row.ratio:.2f}**"),
            *(_number(value, 3) for value in (q.six, q.psi6, q.gap_cv, q.gap_min)),
            *(_number(q.rim_cv, 4), _number(q.void, 3), _number(row.edge, 4), _number(row.mirror, 2)),
        ]
        print(f"| {row.region} | {row.method} | {row.n:,} | {' | '.join(figures)} |", flush=True)


def print_head(head: str) -> None:
    """Print a table's head."""
    print(f"\n{head}\n|{' --- |' * (head.count('|') - 1)}", flush=True)


def _number(value: float, digits: int) -> str:
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


def uniform(pitch: float) -> Recipe:
    """One pitch everywhere, holes of six tenths of it."""
    return replace(
        Recipe(), packing=Packing(pitch=Constant(pitch)), shaping=Shaping(diameter=Constant(0.6 * pitch))
    )


def pack(shape: Shape, pitch: float) -> tuple[Pattern, Region, float]:
    """Our packing, and its seconds from the mesh and the selection to the finished pattern."""
    start = time.perf_counter()
    region = make_region(shape.mesh, shape.selected)
    pattern = drive(pattern_steps(region, uniform(pitch)))
    return pattern, region, time.perf_counter() - start


def mirrored(position: Floats, pitch: float) -> float:
    """Largest distance, in pitches, from a point mirrored at the plane x = 0 to the nearest point."""
    return float(cKDTree(position).query(position * [-1, 1, 1])[0].max() / pitch)


def our_row(name: str, pattern: Pattern, region: Region, pitch: float, seconds: float) -> Row:
    """Measure our packing; the seconds come from elsewhere."""
    edge = boundary_distance(pattern.position, region.boundary_segments).min() / pitch
    quality = measure(pattern, region)
    mirror = mirrored(pattern.position, pitch) if name in SYMMETRIC else np.nan
    return Row(name, "bubble pattern", len(pattern), seconds, quality, edge, mirror)


def peer_row(name: str, method: str, found: peers.Arrangement, region: Region, seconds: float) -> Row:
    """Measure a peer's points; its pitch is the spacing asked for, its first row what is nearest the rim."""
    n = len(found.position)
    distance = boundary_distance(found.position, region.boundary_segments)
    first = distance < distance.min() + 0.35 * found.spacing
    row = np.where(first & (distance.min() > 0.1 * found.spacing), 0, 1)
    pitch = np.full(n, found.spacing)
    quality = measure_points(found.position, found.normal, pitch, row, region.boundary_segments)
    mirror = mirrored(found.position, found.spacing) if name in SYMMETRIC else np.nan
    return Row(name, method, n, seconds, quality, distance.min() / found.spacing, mirror)


SYMMETRIC = ("disc", "square", "panel")


def against(
    name: str,
    shape: Shape,
    pitch: float,
    method: str,
    arrange: Callable[[float], peers.Arrangement] | None,
    repeats: int,
) -> int:
    """Our packing and a peer at the same count in turn; prints both rows, returns our count."""
    pattern, region, _ = pack(shape, pitch)
    runs = [lambda: pack(shape, pitch)[2]]
    if arrange is None:
        print_rows([our_row(name, pattern, region, pitch, in_turn(runs, repeats)[0])])
        return len(pattern)
    found = peers.at_count(arrange, pitch, len(pattern))
    runs.append(lambda: arrange(found.spacing).seconds)
    ours, theirs = in_turn(runs, repeats)
    row = our_row(name, pattern, region, pitch, ours)
    print_rows([replace(row, ratio=ours / theirs), peer_row(name, method, found, region, theirs)])
    return len(pattern)


def flat(repeats: int) -> None:
    """Flat regions against gmsh, the clipped grid and Lloyd's relaxation."""
    print("\n## Packing, flat\n\nOur trapezoid is a coarse n-gon; gmsh has true arcs, half a pitch in.")
    print_head(HEAD)
    gmsh = installed("gmsh")
    trapezoid = SHAPES["trapezoid"]()
    region = make_region(trapezoid.mesh, trapezoid.selected)
    for pitch in (3.0, 0.95, 0.295):
        arrange = (lambda size, pitch=pitch: peers.gmsh_trapezoid(pitch, size)) if gmsh else None
        count = against("trapezoid", trapezoid, pitch, "gmsh frontal-Delaunay", arrange, repeats)
        grid = peers.clipped_grid(trapezoid_outline(), pitch)
        print_rows([peer_row("trapezoid", "clipped hexagonal grid", grid, region, grid.seconds)])
        if count < 2000:
            cells = peers.lloyd(trapezoid_outline(), pitch, count)
            print_rows([peer_row("trapezoid", "Lloyd, 100 rounds", cells, region, cells.seconds)])
    outlines = {"disc": [circle(4.147)], "square": rectangle_outline(8.294, 8.294)}
    for name in ("disc", "square", "l", "trapezoid-fine", "mixed", "strip"):
        shape = SHAPES[name]()
        against(name, shape, shape.pitch, "", None, repeats)
        if name in outlines:
            grid = peers.clipped_grid(outlines[name], shape.pitch)
            region = make_region(shape.mesh, shape.selected)
            print_rows([peer_row(name, "clipped hexagonal grid", grid, region, grid.seconds)])
    peak = peak_memory("--pack-once", "trapezoid", "0.295")
    print(f"\nPeak memory of a process that packs the trapezoid finely: {peak}")


def curved(repeats: int) -> None:
    """Curved regions against Instant Meshes."""
    print(
        "\n## Packing, curved\n\nInstant Meshes has its first row on the boundary, ours is half a pitch in."
    )
    print_head(HEAD)
    there = installed("pynanoinstantmeshes")
    for name, pitch in (("panel", 6.5), ("panel", 2.05), ("sphere", 6.0)):
        shape = SHAPES[name]()
        arrange = (lambda spacing, mesh=shape.mesh: peers.instant_meshes(mesh, spacing)) if there else None
        against(name, shape, pitch, "Instant Meshes", arrange, repeats)
        if there and name != "sphere":
            free = peers.instant_meshes(shape.mesh, pitch, follow_boundary=False)
            region = make_region(shape.mesh, shape.selected)
            print_rows([peer_row(name, "Instant Meshes, ragged rim", free, region, free.seconds)])
    for name in ("torus", "tube", "capsule", "fold", "thin-wall"):
        shape = SHAPES[name]()
        against(name, shape, shape.pitch, "", None, repeats)


GRADED = (
    ("trapezoid", "linear 2 to 6", Linear(from_=2.0, to=6.0, direction=(1.0, 0.0, 0.0))),
    ("trapezoid", "radial 1 to 4", Radial(from_=1.0, to=4.0, centre=(-20.0, -10.0, 0.0))),
    ("panel", "linear 4 to 12", Linear(from_=4.0, to=12.0, direction=(1.0, 0.0, 0.0))),
    ("panel", "radial 2.5 to 10", Radial(from_=2.5, to=10.0, centre=(-30.0, -20.0, 20.0))),
)


def graded(repeats: int) -> None:
    """Graded packings, beside uniform ones at the same count on the same region."""
    print("\n## Packing, graded\n\nFigures are relative to the local pitch; ratio: to uniform at that count.")
    print_head(f"| region | pitch | n | seconds | ratio | {FIGURES} | gap mean |")
    for name, words, field in GRADED:
        shape = SHAPES[name]()
        region = make_region(shape.mesh, shape.selected)
        recipe = Recipe(packing=Packing(pitch=field), shaping=Shaping(diameter=Fill(Constant(0.6))))
        pattern = drive(pattern_steps(region, recipe))
        even = uniform(float(np.sqrt(region.area / (np.sqrt(0.75) * len(pattern)))))
        ours, plain = in_turn([partial(packed_in, region, recipe), partial(packed_in, region, even)], repeats)
        gap = cKDTree(pattern.position).query(pattern.position, 2)[0][:, 1] / pattern.pitch
        q = measure(pattern, region)
        print(
            f"| {name} | {words} | {len(pattern):,} | {ours:.3f} | **{ours / plain:.2f}** | {q.six:.3f} "
            f"| {q.psi6:.3f} | {q.gap_cv:.3f} | {q.gap_min:.3f} | {q.rim_cv:.4f} | {q.void:.3f} "
            f"| {gap.mean():.3f} |",
            flush=True,
        )


def packed_in(region: Region, recipe: Recipe) -> float:
    """Seconds of packing and shaping `recipe` in `region`."""
    start = time.perf_counter()
    drive(pattern_steps(region, recipe))
    return time.perf_counter() - start


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
        "with the base looked through for the first time.\nSeconds are the least of several runs in turn; "
        "cores: the ratio in seconds of all cores together."
    )
    print_head("| base | holes | ours, s | modifier, s | ratio | cores | faces, ours | faces, modifier |")
    for name, shape, pitch in adding_cases():
        inside.clear()
        base_object = inside.place(shape.mesh, "base")
        assert inside.unchanged(base_object, shape.mesh)
        read = Shape(inside.read(base_object).mesh, shape.selected, pitch)
        pattern = pack(read, pitch)[0]
        cutter_object = inside.place(cutters_of(read, pattern), "cutters")
        faces = [0, 0]

        def ours(given: tuple[Any, ...] = (base_object, pattern, HOLE), faces: list[int] = faces) -> Taken:
            forget_base()
            return timed(lambda: faces.__setitem__(0, inside.ours(*given)))

        def theirs(given: tuple[Any, ...] = (base_object, cutter_object), faces: list[int] = faces) -> Taken:
            return timed(lambda: faces.__setitem__(1, inside.modifier(*given)))

        mine, other = least([ours, theirs], repeats)
        print(
            f"| {name} | {len(pattern):,} | {mine.clock:.2f} | {other.clock:.2f} "
            f"| **{mine.clock / other.clock:.2f}** | **{mine.cores / other.cores:.2f}** "
            f"| {faces[0]:,} | {faces[1]:,} |",
            flush=True,
        )
    inside.clear()


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


def as_manifold(mesh: Mesh) -> manifold3d.Manifold:
    """A mesh as it is, as a manifold."""
    return manifold3d.Manifold(
        manifold3d.Mesh64(np.ascontiguousarray(mesh.vertices), mesh.triangles.astype(np.uint64))
    )


def peak_memory(*arguments: str) -> str:
    """Largest resident size of a process of its own that does one thing."""
    if find_spec("resource") is None:
        return "not measured (this system does not tell)"
    command = [sys.executable, str(Path(__file__).resolve()), *arguments]
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


def pack_once(name: str, pitch: float) -> None:
    """Pack one shape and print the process's peak memory."""
    pattern, _, seconds = pack(SHAPES[name](), pitch)
    print(f"{own_peak():,.0f} MiB for {len(pattern):,} features in {seconds:.2f} s")


def add_once(name: str, pitch: float, ours: bool) -> None:
    """Add one pattern, or subtract its cutters barely, and print the process's peak memory."""
    shape = next(shape for known, shape, size in adding_cases() if (known, size) == (name, pitch))
    pattern = pack(shape, pitch)[0]
    if ours:
        drive(part_steps(shape.mesh, pattern, HOLE))
    else:
        (as_manifold(shape.mesh) - as_manifold(cutters_of(shape, pattern))).to_mesh64()
    print(f"{own_peak():,.0f} MiB")


def installed(module: str) -> bool:
    """Whether a peer is there; says so when it is not."""
    there = find_spec(module) is not None
    if not there:
        print(f"\n{module} is not installed: its rows are left out (the extra benchmark)", file=sys.stderr)
    return there


SECTIONS: dict[str, Callable[[int], None]] = {
    "flat": flat,
    "curved": curved,
    "graded": graded,
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
