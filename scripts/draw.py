"""Draw a pattern: bubbles coloured by number of neighbours, the first row outlined, the region's boundary.

Example: python scripts/draw.py trapezoid --pitch 3 -o trapezoid.png
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

from scripts import environment

if __name__ == "__main__":
    environment.enter_for_lack_of(environment.CORE, "benchmark")

import numpy as np

from bubble_pattern_addon.core.distance import boundary_distance
from bubble_pattern_addon.core.mesh import Floats, Ints
from bubble_pattern_addon.core.neighbours import neighbours
from bubble_pattern_addon.core.quality import Quality, measure_points
from scripts.benchmark_packing import pack
from scripts.shapes import SHAPES

COLOURS = ["#08306b", "#08519c", "#2171b5", "#4292c6", "#6baed6", "#9ecae1", "#d9d9d9", "#fb6a4a", "#a50f15"]
"""By number of neighbours, 0 to 8 and more: six is grey, fewer blue, more red."""


def draw(
    position: Floats,
    path: str | Path,
    *,
    pitch: float | Floats,
    normal: Floats | None = None,
    row: Ints | None = None,
    diameter: Floats | None = None,
    boundary_segments: Floats | None = None,
    view: tuple[float, float, float] = (0.0, 0.0, 1.0),
    title: str = "",
    pixels: int = 1600,
    labels: bool = False,
) -> Quality:
    """Picture of bubbles seen along `view`, written to `path`; returns what was measured on them.

    position: (n, 3), or (n, 2) in the plane z = 0; pitch: number or (n,); normal: (n, 3), up when None;
    row: (n,), none in the first row when None; diameter: (n,), the pitch when None; boundary_segments:
    (S, 2, 3). Bubbles facing away from the viewer are left out. pixels: the picture's longer side.
    labels: write the bubbles' numbers.
    """
    from matplotlib.figure import Figure

    if position.shape[1] == 2:
        position = np.column_stack([position, np.zeros(len(position))])
    n = len(position)
    pitch = np.broadcast_to(np.asarray(pitch, float), n)
    normal = np.tile([0.0, 0.0, 1.0], (n, 1)) if normal is None else normal
    row = np.full(n, -1) if row is None else row
    diameter = pitch if diameter is None else diameter
    segments = np.zeros((0, 2, 3)) if boundary_segments is None else boundary_segments
    quality = measure_points(position, normal, pitch, row, segments)
    count = np.bincount(neighbours(position, normal, pitch).first, minlength=n)
    interior = boundary_distance(position, segments) > 1.25 * pitch

    right, up, towards = _camera(np.asarray(view, float))
    shown = np.flatnonzero(normal @ towards > 0.02)
    shown = shown[np.argsort(position[shown] @ towards)]
    figure = Figure(figsize=(10, 10), layout="constrained")
    axes = figure.subplots()
    flat = np.stack([segments @ right, segments @ up], axis=-1)
    _add_bubbles(axes, position, normal, diameter, (right, up), shown, count, interior, row)
    _add_lines(axes, flat)
    if labels:
        for i in shown:
            axes.annotate(
                str(i), (position[i] @ right, position[i] @ up), ha="center", va="center", fontsize=4
            )
    axes.set_aspect("equal")
    axes.autoscale_view()
    axes.set_title(f"{title} {_words(n, quality)}".strip(), fontsize=10)
    _fit(figure, axes)
    figure.savefig(path, dpi=pixels / 10)
    return quality


def _camera(view: Floats) -> tuple[Floats, Floats, Floats]:
    towards = view / np.linalg.norm(view)
    upright = np.array([0.0, 1.0, 0.0]) if abs(towards[2]) > 0.99 else np.array([0.0, 0.0, 1.0])
    right = np.cross(upright, towards)
    right /= np.linalg.norm(right)
    return right, np.cross(towards, right), towards


def _add_bubbles(
    axes: Any,
    position: Floats,
    normal: Floats,
    diameter: Floats,
    screen: tuple[Floats, Floats],
    shown: Ints,
    count: Ints,
    interior: Any,
    row: Ints,
) -> None:
    """Discs in their tangent planes; pale where not interior, as their number of neighbours means nothing."""
    from matplotlib.collections import PolyCollection
    from matplotlib.colors import to_rgba

    right, up = screen
    angle = np.linspace(0, 2 * np.pi, 25)[:-1]
    first = np.cross(normal, np.eye(3)[np.abs(normal).argmin(axis=1)])
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    second = np.cross(normal, first)
    ring = np.cos(angle)[:, None] * first[:, None] + np.sin(angle)[:, None] * second[:, None]
    rings = position[:, None] + ring * diameter[:, None, None] / 2
    polygons = np.stack([rings @ right, rings @ up], axis=-1)[shown]
    faces = np.array([to_rgba(colour) for colour in COLOURS])[np.minimum(count, 8)]
    faces[~interior] = [0.95, 0.95, 0.88, 1.0]
    edge = np.where((row == 0)[:, None], [0.0, 0.35, 0.0, 1.0], [1.0, 1.0, 1.0, 1.0])
    size = np.where(row == 0, 0.9, 0.3)
    axes.add_collection(
        PolyCollection(
            list(polygons), facecolors=faces[shown], edgecolors=edge[shown], linewidths=size[shown]
        )
    )
    middle = np.stack([position[shown] @ right, position[shown] @ up], axis=1)
    axes.scatter(*middle.T, s=0.3, c="#444444", linewidths=0, zorder=3)


def _add_lines(axes: Any, segments: Floats) -> None:
    from matplotlib.collections import LineCollection

    axes.add_collection(LineCollection(list(segments), colors="black", linewidths=0.8))


def _fit(figure: Any, axes: Any) -> None:
    """Give the figure the drawing's own shape, ten inches on its longer side."""
    (left, right), (bottom, top) = axes.get_xlim(), axes.get_ylim()
    ratio = (top - bottom) / (right - left)
    figure.set_size_inches(10 * min(1, 1 / ratio) + 0.5, 10 * min(1, ratio) + 0.7)
    axes.tick_params(labelsize=6)


def _words(n: int, quality: Quality) -> str:
    return (
        f"n {n}  six {quality.six:.3f}  psi6 {quality.psi6:.3f}  gap cv {quality.gap_cv:.4f}  "
        f"gap min {quality.gap_min:.3f}  rim cv {quality.rim_cv:.5f}  void {quality.void:.3f}"
    )


def main() -> None:
    """Run the pipeline on one of the shapes and draw its pattern."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("shape", choices=sorted(SHAPES))
    parser.add_argument("--pitch", type=float, help="the shape's own when not given")
    parser.add_argument(
        "--view", type=float, nargs=3, default=(0.0, 0.0, 1.0), help="from where to look: x y z"
    )
    parser.add_argument(
        "--features", action="store_true", help="draw the features' diameters, not the bubbles"
    )
    parser.add_argument("--labels", action="store_true", help="write the features' ids")
    parser.add_argument("--pixels", type=int, default=1600)
    parser.add_argument("-o", "--output", type=Path, required=True)
    chosen = parser.parse_args()
    environment.enter_for_lack_of(["matplotlib"], "benchmark")
    shape = SHAPES[chosen.shape]()
    pitch = chosen.pitch or shape.pitch
    pattern, region, seconds = pack(shape, pitch)
    quality = draw(
        pattern.position,
        chosen.output,
        pitch=pattern.pitch,
        normal=pattern.normal,
        row=pattern.row,
        diameter=pattern.diameter if chosen.features else None,
        boundary_segments=region.boundary_segments,
        view=tuple(chosen.view),
        title=f"{chosen.shape}, pitch {pitch:g}, {seconds:.2f} s\n",
        pixels=chosen.pixels,
        labels=chosen.labels,
    )
    print(f"{chosen.shape}: {_words(len(pattern), quality)}  {seconds:.3f} s -> {chosen.output}")


if __name__ == "__main__":
    main()
