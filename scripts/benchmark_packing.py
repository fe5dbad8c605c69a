"""Packing beside its peers: flat, curved and graded."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from scipy.spatial import cKDTree

from bubble_pattern_addon.core.blending import Fill
from bubble_pattern_addon.core.distance import boundary_distance
from bubble_pattern_addon.core.fields import Linear, Radial
from bubble_pattern_addon.core.mesh import Floats
from bubble_pattern_addon.core.metric import Constant
from bubble_pattern_addon.core.pattern import Pattern
from bubble_pattern_addon.core.pipeline import pattern_steps
from bubble_pattern_addon.core.progress import drive
from bubble_pattern_addon.core.quality import Quality, measure, measure_points
from bubble_pattern_addon.core.recipe import Packing, Recipe, Shaping
from bubble_pattern_addon.core.region import Region, make_region
from scripts import peers
from scripts.measuring import in_turn, installed, number, own_peak, peak_memory, print_head
from scripts.shapes import (
    JAGGED_RADIUS,
    SHAPES,
    Shape,
    circle,
    curved_slab,
    pixel_disc,
    rectangle_outline,
    splinter_disc,
    trapezoid_outline,
)


@dataclass(frozen=True)
class Row:
    """One line of a packing table. known: seconds where the region has been read before; ratio, known_ratio:
    of either to a peer's; edge: least centre to boundary in pitches; mirror: see `mirrored`.
    """

    region: str
    method: str
    n: int
    seconds: float
    quality: Quality
    edge: float
    mirror: float
    ratio: float | None = None
    known: float = np.nan
    known_ratio: float | None = None


READING = "From the mesh and the selection to the finished pattern; known: the region has been read before."
FIGURES = "six | ψ6 | gap CV | gap min | rim CV | void"
HEAD = f"| region | method | n | seconds | ratio | known, s | ratio | {FIGURES} | edge | mirror |"


def print_rows(rows: Iterable[Row]) -> None:
    """Print packings as the lines of a table."""
    for row in rows:
        q = row.quality
        figures = [
            *(number(row.seconds, 3), "" if row.ratio is None else f"**{row.ratio:.2f}**"),
            *(number(row.known, 3), "" if row.known_ratio is None else f"**{row.known_ratio:.2f}**"),
            *(number(value, 3) for value in (q.six, q.psi6, q.gap_cv, q.gap_min)),
            *(number(q.rim_cv, 4), number(q.void, 3), number(row.edge, 4), number(row.mirror, 2)),
        ]
        print(f"| {row.region} | {row.method} | {row.n:,} | {' | '.join(figures)} |", flush=True)


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


def packing_seconds(shape: Shape, pitch: float) -> float:
    """How long `pack` takes."""
    return pack(shape, pitch)[2]


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
    runs: list[Callable[[], float]] = [
        partial(packing_seconds, shape, pitch),
        partial(packed_in, region, uniform(pitch)),
    ]
    if arrange is None:
        ours, known = in_turn(runs, repeats)
        print_rows([replace(our_row(name, pattern, region, pitch, ours), known=known)])
        return len(pattern)
    found = peers.at_count(arrange, pitch, len(pattern))
    runs.append(lambda: arrange(found.spacing).seconds)
    ours, known, theirs = in_turn(runs, repeats)
    row = our_row(name, pattern, region, pitch, ours)
    row = replace(row, ratio=ours / theirs, known=known, known_ratio=known / theirs)
    print_rows([row, peer_row(name, method, found, region, theirs)])
    return len(pattern)


def flat(repeats: int) -> None:
    """Flat regions against gmsh, the clipped grid and Lloyd's relaxation."""
    print(f"\n## Packing, flat\n\n{READING}")
    print("Our trapezoid is a coarse n-gon; gmsh is given true arcs, half a pitch in, before its clock runs.")
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
    print(f"\n## Packing, curved\n\n{READING}")
    print("Instant Meshes has its first row on the boundary, ours is half a pitch in; it reads the mesh too.")
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


def jagged(repeats: int) -> None:
    """How far the first row goes round discs of faces chosen from a grid or a scan."""
    print("\n## First rows along jagged boundaries\n")
    print("Discs of faces about 1 long (the panel's: 0.5); room: for so many at the pitch; gaps in pitches.")
    print_head("| region | pitch | n | first row | room | widest gap | mean gap | least edge | seconds |")
    panel = curved_slab(400)
    away = np.linalg.norm(panel.mesh.corners.mean(axis=1)[:, :2], axis=1)
    scan = replace(panel, selected=panel.selected & (away < 80))
    discs = [
        ("squares of a grid", pixel_disc(False), JAGGED_RADIUS, (3.0, 6.0, 12.0)),
        ("the same on a cap", pixel_disc(True), JAGGED_RADIUS, (3.0, 6.0, 12.0)),
        ("splinters", splinter_disc(False), JAGGED_RADIUS, (3.0, 6.0, 12.0)),
        ("the same on a cap", splinter_disc(True), JAGGED_RADIUS, (3.0, 6.0, 12.0)),
        ("panel, scan-fine", scan, 80.0, (2.05, 6.5)),
    ]
    for name, shape, radius, pitches in discs:
        for pitch in pitches:
            pattern, region, _ = pack(shape, pitch)
            (seconds,) = in_turn([partial(packing_seconds, shape, pitch)], repeats)
            x, y = pattern.position[pattern.row == 0, :2].T
            turn = np.sort(np.arctan2(y, x))
            gap = np.diff(turn, append=turn[0] + 2 * np.pi) * (radius - pitch / 2) / pitch
            edge = boundary_distance(pattern.position, region.boundary_segments).min() / pitch
            room = 2 * np.pi * (radius - pitch / 2) / pitch
            figures = [f"{room:.1f}", *(number(value, 2) for value in (gap.max(), gap.mean()))]
            figures += [number(edge, 3), number(seconds, 3)]
            print(f"| {name} | {pitch:g} | {len(pattern):,} | {len(x)} | {' | '.join(figures)} |", flush=True)


def pack_once(name: str, pitch: float) -> None:
    """Pack one shape and print the process's peak memory."""
    pattern, _, seconds = pack(SHAPES[name](), pitch)
    print(f"{own_peak():,.0f} MiB for {len(pattern):,} features in {seconds:.2f} s")
