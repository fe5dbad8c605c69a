"""The results of the method's paper, rebuilt on bases of our own, and the kinds of features on six products.

    python3 scripts/gallery.py [--out DIR] [--only NAME] [--quick]

Makes its own environment on first use. Every result gets a folder in DIR (default: out/gallery) with

    base.blend      the base, its target region and sub-regions marked
    recipe.toml     the recipe (from scripts/gallery), every value written out
    pattern.blend   opens with the pattern editable
    part.stl, features.csv, report.json, part.png

Beside the folders stand small pictures, NAME.jpg, and sheets of them: contact_sheet.jpg has the paper's
results, features.jpg the kinds of features.
"""

from __future__ import annotations

import argparse
import os
import sys
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))

from scripts import environment  # noqa: E402

if TYPE_CHECKING:
    from bubble_pattern_addon.batch import BlenderSide, Run
    from bubble_pattern_addon.core.mesh import Floats
    from bubble_pattern_addon.core.progress import Progress

RECIPES = ROOT / "scripts" / "gallery"
RESULTS = (
    "speaker-uniform",
    "speaker-round-centre",
    "speaker-graded",
    "conference-station",
    "desk-phone",
    "printer-panel",
)
FEATURES = ("countersunk", "slots", "drops", "dimples", "bosses", "grip")
NAMES = RESULTS + FEATURES
SHEETS = {"contact_sheet": RESULTS, "features": FEATURES}
SIZE, QUICK_SIZE = (900, 675), (320, 240)
SMALL = (640, 480)
TILE, COLUMNS = (420, 315), 3
"""Sizes of the small pictures and of those on a sheet."""


class _Parser(argparse.ArgumentParser):
    def error(self, message: str) -> None:  # type: ignore[override]
        """One line instead of usage and message."""
        self.exit(2, f"{self.prog}: {message}; see --help\n")


def parse(arguments: Sequence[str]) -> argparse.Namespace:
    """The command line."""
    parser = _Parser(
        prog="gallery.py", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--out", type=Path, default=ROOT / "out" / "gallery", help="folder for the results")
    parser.add_argument("--only", choices=NAMES, metavar="NAME", help=f"one result: {', '.join(NAMES)}")
    parser.add_argument("--quick", action="store_true", help="small pictures")
    return parser.parse_args(arguments)


def main() -> int:
    """Make the results; returns the exit code."""
    options = parse(sys.argv[1:])
    environment.enter()
    # nothing of the user's own Blender is read or touched
    with tempfile.TemporaryDirectory() as home:
        os.environ["BLENDER_USER_RESOURCES"] = home
        return make_all(options)


def make_all(options: argparse.Namespace) -> int:
    """The gallery, inside the environment."""
    from bubble_pattern_addon.core.errors import PatternError
    from bubble_pattern_addon.core.progress import Progress
    from bubble_pattern_addon.terminal import line_on, silenced
    from scripts.progress_bar import progress_bar

    out: Path = options.out.resolve()
    names = [options.only] if options.only else list(NAMES)
    show = progress_bar() or line_on(sys.stderr)
    lines = []
    try:
        for done, name in enumerate(names):
            with silenced():
                lines.append(
                    make(
                        name,
                        out / name,
                        QUICK_SIZE if options.quick else SIZE,
                        part_of(show, name, done, len(names)),
                    )
                )
    except PatternError as error:
        show(Progress("Done", 1.0))
        sys.exit(f"gallery.py: {name}: {error}")
    except OSError as error:
        show(Progress("Done", 1.0))
        sys.exit(f"gallery.py: {out} can't be written ({error.strerror}): give another folder with --out")
    with silenced():
        write_small_pictures(out, names)
    show(Progress("Done", 1.0))
    print("\n".join(lines))
    return 0


def part_of(show: Callable[[Progress], None], name: str, done: int, count: int) -> Callable[[Progress], None]:
    """A reporter of one result that shows how far all of them are."""

    def report(progress: Progress) -> None:
        show(
            progress._replace(stage=f"{name}: {progress.stage}", fraction=(done + progress.fraction) / count)
        )

    return report


def make(name: str, folder: Path, size: tuple[int, int], show: Callable[[Progress], None]) -> str:
    """One result in `folder`; returns a line on it.

    Raises PatternError and OSError.
    """
    from bubble_pattern_addon import batch
    from bubble_pattern_addon.blender import batch_base
    from bubble_pattern_addon.core.files import output_folder
    from bubble_pattern_addon.core.progress import Progress, drive, within
    from bubble_pattern_addon.core.recipe_file import load_recipe
    from bubble_pattern_addon.core.recipe_names import recipe_names
    from scripts.progress_bar import follow_rendering

    show(Progress("Modelling", 0.0))
    with output_folder(folder) as files:
        write_base_of(name, files / "base.blend")
        recipe = load_recipe(RECIPES / f"{name}.toml")
        base = batch_base.read_base(files / "base.blend", recipe_names(recipe))
        steps = within(batch.run_steps(base, RECIPES / f"{name}.toml"), 0.05, 0.4)
        run = drive(steps, show)
        output = replace(run.recipe.output, blend=True, picture=True)
        run = replace(run, recipe=replace(run.recipe, output=output))
        with follow_rendering(lambda at: show(at._replace(fraction=0.4 + 0.6 * at.fraction))):
            batch.write_run(run, files, lambda: taking_pictures(size))
    return f"{name + ':':<22}{batch.summary(run, folder)}"


def write_base_of(name: str, path: Path) -> None:
    """The base of a result as a .blend, its target region and sub-regions marked."""
    import numpy as np

    from scripts.base_file import write_base
    from scripts.feature_bases import FEATURE_BASES
    from scripts.gallery_bases import BASES, FINISHES

    base = {**BASES, **FEATURE_BASES}[name]()
    masks = {base.body: np.ones(len(base.region), dtype=bool), **base.finishes}
    finishes = {finish: (FINISHES[finish], mask) for finish, mask in masks.items()}
    write_base(path, name, base.mesh, {"bubble_region": base.region, **base.sub_regions}, finishes)


def taking_pictures(size: tuple[int, int]) -> BlenderSide:
    """Blender's part in a batch run, which takes pictures of this size with the part standing on its foot."""
    from types import SimpleNamespace
    from typing import cast

    import numpy as np

    from bubble_pattern_addon.blender import batch_base

    def write_picture(path: Path, run: Run) -> None:
        batch_base.write_picture(path, run, size, up=np.array([0.0, 0.0, 1.0]))

    side = SimpleNamespace(write_blend=batch_base.write_blend, write_picture=write_picture)
    return cast("BlenderSide", side)


def write_small_pictures(out: Path, names: Sequence[str]) -> None:
    """NAME.jpg beside each result's folder, and of all results that are there the sheets."""
    for name in names:
        write_jpeg(out / f"{name}.jpg", read_picture(out / name / "part.png", SMALL), quality=82)
    for sheet, members in SHEETS.items():
        pictures = [out / name / "part.png" for name in members]
        pictures = [picture for picture in pictures if picture.exists()]
        if pictures:
            write_sheet(out / f"{sheet}.jpg", pictures)


def write_sheet(path: Path, pictures: Sequence[Path]) -> None:
    """Several pictures in one, row after row."""
    import numpy as np

    tiles = [read_picture(picture, TILE) for picture in pictures]
    tiles += [np.zeros_like(tiles[0])] * (-len(tiles) % COLUMNS)
    # Blender's pictures have their first row at the bottom
    rows = [np.concatenate(tiles[at : at + COLUMNS], axis=1) for at in range(0, len(tiles), COLUMNS)]
    write_jpeg(path, np.concatenate(rows[::-1]), quality=82)


def read_picture(path: Path, size: tuple[int, int]) -> Floats:
    """A picture scaled to size (width, height): (height, width, 4), the lowest row first."""
    import bpy
    import numpy as np

    image = bpy.data.images.load(str(path))
    try:
        image.scale(*size)
        pixels = np.empty(4 * size[0] * size[1], dtype=np.float32)
        image.pixels.foreach_get(pixels)
    finally:
        bpy.data.images.remove(image)
    return pixels.reshape(size[1], size[0], 4).astype(np.float64)


def write_jpeg(path: Path, pixels: Floats, quality: int) -> None:
    """Write pixels (height, width, 4), the lowest row first."""
    import bpy

    height, width = pixels.shape[:2]
    image = bpy.data.images.new(path.stem, width, height)
    try:
        image.pixels.foreach_set(pixels.astype("f4").ravel())
        image.file_format = 'JPEG'
        image.save(filepath=str(path), quality=quality)
    finally:
        bpy.data.images.remove(image)


if __name__ == "__main__":
    sys.exit(main())
