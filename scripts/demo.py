"""The main job, start to end: a speaker grille on a curved door panel with an island.

    python3 scripts/demo.py [--out DIR] [--pitch 3.4] [--diameter 2.1] [--no-picture]

Makes its own environment on first use, models the panel (see door_panel.py), writes it as a .blend with the
target region marked, and runs the batch on it. DIR (default: out/demo) then holds

    door_panel.blend   the base, its target region as the face attribute "bubble_region"
    grille.toml        the recipe
    pattern.blend      opens with the pattern editable, and the part
    part.stl           the part
    features.csv       the hole table
    report.json        the figures
    part.png           a rendered picture
"""

from __future__ import annotations

import argparse
import os
import sys
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))

from scripts import environment  # noqa: E402
from scripts.progress_bar import follow_rendering, progress_bar  # noqa: E402

if TYPE_CHECKING:
    from scripts.door_panel import DoorPanel

RECIPE = """\
[region]
attribute = "bubble_region"

[packing]
pitch = {pitch}

[shaping]
diameter = {diameter}

[limits]
min_web = 0.6

[output]
blend = true
picture = {picture}
"""
MOULDED = {"color": (0.018, 0.019, 0.021), "roughness": 0.42, "grain": 0.04, "grain_size": 0.5}
GRILLE = {"color": (0.20, 0.208, 0.224), "metallic": 0.75, "roughness": 0.42}
BADGE = {"color": (0.62, 0.63, 0.65), "metallic": 1.0, "roughness": 0.22}
FILES = {
    "pattern.blend": "opens with the pattern editable",
    "part.stl": "the part",
    "features.csv": "the hole table",
    "report.json": "the figures",
    "part.png": "a rendered picture",
}


def parse() -> argparse.Namespace:
    """The command line."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--out", type=Path, default=ROOT / "out" / "demo", help="folder for the results")
    parser.add_argument("--pitch", type=float, default=3.4, help="distance of the holes' centres in mm")
    parser.add_argument("--diameter", type=float, default=2.1, help="diameter of the holes in mm")
    parser.add_argument("--no-picture", action="store_true", help="leave the rendering out")
    return parser.parse_args()


def write_panel(path: Path, panel: DoorPanel) -> None:
    """The panel as a .blend with the target region marked."""
    import numpy as np

    from scripts.base_file import write_base

    everywhere = np.ones(len(panel.region), dtype=bool)
    write_base(
        path,
        "Door panel",
        panel.mesh,
        {"bubble_region": panel.region},
        {
            "Moulded plastic": (MOULDED, everywhere),
            "Grille": (GRILLE, panel.region),
            "Badge": (BADGE, panel.island),
        },
    )


def main() -> int:
    """Build the panel and run the batch on it; returns the exit code."""
    options = parse()
    environment.enter()
    # nothing of the user's own Blender is read or touched
    with tempfile.TemporaryDirectory() as home:
        os.environ["BLENDER_USER_RESOURCES"] = home
        return make(options)


def make(options: argparse.Namespace) -> int:
    """The demo itself, inside the environment."""
    from bubble_pattern_addon import batch
    from bubble_pattern_addon.core.progress import Progress
    from bubble_pattern_addon.terminal import line_on, silenced
    from scripts.door_panel import make_door_panel

    out: Path = options.out.resolve()
    show = progress_bar() or line_on(sys.stderr)
    show(Progress("Modelling the panel", 0.0))
    try:
        out.mkdir(parents=True, exist_ok=True)
        recipe = out / "grille.toml"
        recipe.write_text(
            RECIPE.format(
                pitch=options.pitch,
                diameter=options.diameter,
                picture=str(not options.no_picture).lower(),
            ),
            encoding="utf-8",
        )
        with silenced():
            write_panel(out / "door_panel.blend", make_door_panel())
    except OSError as error:
        sys.exit(f"demo.py: {out} can't be written ({error.strerror}): give another folder with --out")
    with silenced(), follow_rendering(show):
        code = batch.main(
            [str(recipe), "--base", str(out / "door_panel.blend"), "--out", str(out)], "demo.py", show
        )
    if code == 0:
        print_result(out, options.no_picture)
    return code


def print_result(out: Path, no_picture: bool) -> None:
    """Where everything is, and the key figures."""
    import json

    report = json.loads((out / "report.json").read_text("utf-8"))
    quality, seconds = report["quality"], report["seconds"]
    for name, what in FILES.items():
        if name != "part.png" or not no_picture:
            print(f"  {out / name}  {what}")
    print(
        f"  {report['features']:,} holes, {100 * report['open_area']:.1f} % open area, "
        f"smallest web {report['min_web']:.2f} mm, wall {report['wall']['min']:.2f} mm and up\n"
        f"  watertight: {'yes' if report['watertight'] else 'no'}, genus {report['genus']}; "
        f"order {quality['psi6']:.3f}, six neighbours {100 * quality['six']:.1f} %, "
        f"smallest gap {quality['gap_min']:.3f} pitch\n"
        f"  packed in {seconds['pack']:.2f} s, added in {seconds['add']:.2f} s"
    )


if __name__ == "__main__":
    sys.exit(main())
