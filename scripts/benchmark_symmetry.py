"""What a symmetry costs: order and time of symmetric packings beside those without, on the same regions."""

from __future__ import annotations

from functools import partial

import numpy as np

from bubble_pattern_addon.core.mesh import Floats
from bubble_pattern_addon.core.metric import Constant
from bubble_pattern_addon.core.pipeline import pattern_steps
from bubble_pattern_addon.core.progress import drive
from bubble_pattern_addon.core.quality import measure
from bubble_pattern_addon.core.recipe import Packing, Recipe, Shaping
from bubble_pattern_addon.core.region import Region, make_region
from scripts.benchmark_packing import packed_in
from scripts.measuring import in_turn, print_head
from scripts.shapes import SHAPES, Shape, circle, coarse_sheet, rectangle_outline

CASES = (
    ("square", "xy"),
    ("disc", "x"),
    ("disc", "xy"),
    ("disc", "rotate 6"),
    ("islands", "x"),
    ("islands", "xy"),
    ("panel", "x"),
    ("panel", "xy"),
    ("tube", "xy"),
    ("torus", "x"),
    ("capsule", "x"),
    ("sphere", "x"),
    ("sphere", "xy"),
)
SCALES = (1.0, 0.93, 1.07, 0.97, 1.03)
"""Each is packed at so many pitches: a single one says more of chance than of the method."""


def symmetric(repeats: int) -> None:
    """Symmetric packings and the same without."""
    print(
        "\n## Packing, symmetric\n\nMeans over five pitches, the smallest gap of all; ratio: time with the "
        "symmetry by time without."
    )
    print_head(
        "| region | symmetry | n | six without | with | ψ6 without | with | gap min without | with "
        "| s without | with | ratio |"
    )
    for name, symmetry in CASES:
        shape = two_islands() if name == "islands" else SHAPES[name]()
        region = make_region(shape.mesh, shape.selected)
        recipes = [
            (recipe(shape.pitch * scale, "off"), recipe(shape.pitch * scale, symmetry)) for scale in SCALES
        ]
        found = np.array([[figures(region, one) for one in both] for both in recipes])
        taken = np.array(
            [in_turn([partial(packed_in, region, one) for one in both], repeats) for both in recipes]
        )
        (count, six, psi6, _), least, seconds = (
            found.mean(axis=0).T,
            found[..., 3].min(axis=0),
            taken.mean(axis=0),
        )
        columns = [*(f"{value:.3f}" for value in (*six, *psi6, *least, *seconds))]
        ratio = seconds[1] / seconds[0]
        print(
            f"| {name} | {symmetry} | {count[0]:,.0f} | {' | '.join(columns)} | **{ratio:.2f}** |", flush=True
        )


def two_islands() -> Shape:
    """A plate with two round islands."""
    islands = [circle(7.0, (side, 0.0))[::-1] for side in (20.0, -20.0)]
    mesh = coarse_sheet([*rectangle_outline(80.0, 50.0), *islands])
    return Shape(mesh, np.ones(len(mesh.triangles), dtype=bool), 3.0)


def recipe(pitch: float, symmetry: str) -> Recipe:
    """One pitch everywhere, packed symmetrically."""
    return Recipe(
        packing=Packing(pitch=Constant(pitch), symmetry=symmetry), shaping=Shaping(Constant(0.6 * pitch))
    )


def figures(region: Region, asked: Recipe) -> Floats:
    """Count, order, sixfold order and smallest gap, (4,)."""
    pattern = drive(pattern_steps(region, asked))
    if asked.packing.symmetry != "off" and pattern.symmetry is None:
        raise SystemExit(f"The region is not symmetric: {pattern.notes}")
    quality = measure(pattern, region)
    return np.array([len(pattern), quality.six, quality.psi6, quality.gap_min])
