"""The batch run: a base and a recipe in; a folder with the part, the hole table and the report out.

One implementation for `scripts/pattern_batch.py`, in Blender and in plain Python, and for the extension's own
command. What only Blender can do (a .blend as base, a .blend or a picture as output) is asked of
`blender.batch_base`, which is imported only then.
"""

from __future__ import annotations

import argparse
import shutil
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import nullcontext
from dataclasses import dataclass, replace
from importlib import import_module
from pathlib import Path
from typing import Any, NoReturn, Protocol, cast

import numpy as np

from .core.drawing import Drawing, make_drawing
from .core.drawing_files import drawing_report, write_drawing
from .core.drawn_shapes import drawn_shapes
from .core.errors import BaseError, FieldError, OutputError, PatternError
from .core.export import make_report, write_features, write_report
from .core.feature_recipe import nouns
from .core.field_tables import Wanted
from .core.files import LoadedBase, load_base, load_solids, output_folder, write_mesh
from .core.keep_out import region_with_keep_outs
from .core.mesh import Bools, Floats, Mesh
from .core.part import Part
from .core.pattern import Pattern
from .core.pipeline import pattern_steps
from .core.progress import Progress, Result, Steps, drive, within
from .core.recipe import KeepOut, Recipe, RegionChoice, default_recipe
from .core.recipe_file import load_recipe, recipe_to_toml
from .core.recipe_names import recipe_names, with_recipe_images
from .core.recipe_units import load_fitted_recipe
from .core.region import Region
from .core.selection import select, sub_regions
from .core.sides import check_one_side
from .core.solid import part_steps
from .core.solving import solving_steps
from .core.soundness import sound_base
from .core.surroundings import Surroundings
from .core.units import millimetres_in, unit_of
from .terminal import line_on, silenced

EXAMPLE = """\
example of a recipe:
  [region]
  near = [0.0, 12.5, 3.0]   # the face nearest to this point, grown over edges flatter than max_angle
  max_angle = 20
  [packing]
  pitch = 3.0
  [shaping]
  diameter = 1.8

example of a run:
  %(prog)s grille.toml --base panel.stl --out grille
"""


@dataclass(frozen=True)
class Run:
    """Everything a batch run knows when the part is made.

    selected: (T,) the target region's triangles; origin: the folder from which the recipe names its images;
    drawing: of the pattern, where the recipe asks for one; millimetres: in a unit of the base
    """

    recipe: Recipe
    base: LoadedBase
    selected: Bools
    region: Region
    pattern: Pattern
    part: Part
    report: Mapping[str, Any]
    origin: Path = Path()
    drawing: Drawing | None = None
    millimetres: float = 1.0


class BlenderSide(Protocol):
    """What `blender.batch_base` does for a batch run."""

    def read_base(self, path: Path | None, names: Wanted, keep_outs: Sequence[KeepOut]) -> LoadedBase:
        """The base in a .blend file, in world coordinates, with what `names` and `keep_outs` ask for; None:
        in the file that is open.
        """
        ...

    def read_image(self, name: str, folder: Path) -> Floats:
        """The pixels of an image file, or of the open file's image of that name."""
        ...

    def read_stamp(self, name: str) -> Mesh:
        """The object of the open file with that name, in its own coordinates."""
        ...

    def write_blend(self, path: Path, run: Run) -> None:
        """A .blend that opens with the base, the editable pattern and the part."""
        ...

    def write_picture(self, path: Path, run: Run) -> None:
        """A rendered view of the part as PNG."""
        ...


# -- the work ------------------------------------------------------------------------------------------------


def run_steps(base: LoadedBase, recipe_file: Path) -> Steps[Run]:
    """From a base and a recipe file to a good part; a generator of Progress.

    Raises PatternError of every kind, also where the finished part is not good.
    """
    clock = Clock()
    yield Progress("Reading the region", 0.0)
    choice = recipe_for(base, recipe_file).region
    selected = select(base.mesh, choice, base.attributes, base.materials)
    parts = sub_regions(choice, base.attributes, base.materials)
    masks = {**base.materials, **base.attributes}
    files = [keep_out.file for keep_out in choice.keep_out if keep_out.file is not None]
    solids = {**base.solids, **load_solids(files, recipe_file.parent)}
    region = region_with_keep_outs(base.mesh, selected, parts, choice.gap, choice.keep_out, masks, solids)
    recipe = recipe_for(base, recipe_file, region)
    millimetres = base.millimetres or millimetres_in(recipe.output.unit or "mm")
    sound_base(base.mesh)  # step 3 looks again; but nobody shall wait for a packing to be told of a hole
    if recipe.feature.through:
        check_one_side(base.mesh, selected)
    stamp, solved = read_stamp(recipe, recipe_file.parent), None
    surroundings = surroundings_of(base, read_images(recipe, recipe_file.parent))
    if stamp is not None and recipe.feature.mesh is not None:
        surroundings = replace(surroundings, meshes={recipe.feature.mesh: stamp})
    clock.stop("region")
    if recipe.solve:
        solved = yield from clock.timed(within(solving_steps(region, recipe, surroundings), 0.0, 0.5))
        recipe, pattern = solved.recipe, solved.pattern
    else:
        pattern = yield from clock.timed(within(pattern_steps(region, recipe, surroundings), 0.0, 0.5))
    drawing = draw(region, pattern, recipe, millimetres) if recipe.output.drawings else None
    part = yield from within(part_steps(base.mesh, pattern, recipe.feature, stamp), 0.5, 1.0)
    clock.stop("add")
    report = make_report(region, pattern, part, clock.seconds, recipe, solved) | drawing_report(drawing)
    if part.check.problems:
        raise BaseError(f"The part is not good: {' '.join(part.check.problems)}")
    origin = recipe_file.parent
    return Run(recipe, base, selected, region, pattern, part, report, origin, drawing, millimetres)


def recipe_for(base: LoadedBase, recipe_file: Path, region: Region | None = None) -> Recipe:
    """The recipe in a file, in the unit of the base where both say theirs, with what it leaves out fitted to
    the region.
    """
    fitting = Recipe() if region is None else default_recipe(region.area, region.perimeter)
    recipe = load_fitted_recipe(recipe_file, fitting, base.millimetres)
    if recipe.output.unit is None and base.millimetres is not None:
        # drills and the rules of processes go by the millimetre
        recipe = replace(recipe, output=replace(recipe.output, unit=unit_of(base.millimetres)))
    return recipe


def draw(region: Region, pattern: Pattern, recipe: Recipe, millimetres: float) -> Drawing:
    """The drawing that the recipe asks for. RegionError where the region can't be drawn so."""
    shapes = drawn_shapes(pattern, recipe.feature)
    return make_drawing(region, pattern, recipe.output.projection, recipe.output.align, millimetres, shapes)


def read_images(recipe: Recipe, folder: Path) -> dict[str, Floats]:
    """The images that the recipe's fields ask for, by name, seen from `folder`.

    Raises FieldError where one cannot be read, or this Python has no Blender in it.
    """
    names = sorted(recipe_names(recipe).images)
    if not names:
        return {}
    try:
        side = blender_side()
    except OutputError as error:
        raise FieldError(
            f'Image "{names[0]}" needs Blender to be read ({error.__cause__}): run this in Blender, with '
            "`blender -b -P scripts/pattern_batch.py -- ...`"
        ) from None
    return {name: side.read_image(name, folder) for name in names}


def read_stamp(recipe: Recipe, folder: Path) -> Mesh | None:
    """The mesh that the recipe's features are, None where they are none: a file seen from `folder`, or else
    an object of the .blend that is open.

    Raises BaseError where there is neither.
    """
    name = recipe.feature.mesh
    if name is None:
        return None
    if (folder / name).is_file():
        return load_base(folder / name).mesh
    try:
        side = blender_side()
    except OutputError:
        raise BaseError(f"[feature] mesh: {folder / name} does not exist: check the path") from None
    return side.read_stamp(name)


def surroundings_of(base: LoadedBase, images: Mapping[str, Floats]) -> Surroundings:
    """What the recipe's fields may ask for beside the region."""
    masks = {name: mask.astype(np.float64) for name, mask in base.attributes.items()}
    return Surroundings(
        attributes=masks | dict(base.values),
        materials=base.materials,
        uv_maps=base.uv_maps,
        images=images,
        objects=base.objects,
    )


class Clock:
    """Seconds that the stages of a run take: region, pack, shape, add."""

    def __init__(self) -> None:
        self.seconds: dict[str, float] = {}
        self.last = time.perf_counter()

    def stop(self, stage: str) -> None:
        """Book the time since the last stop on this stage."""
        now = time.perf_counter()
        self.seconds[stage] = self.seconds.get(stage, 0.0) + now - self.last
        self.last = now

    def timed(self, steps: Steps[Result]) -> Steps[Result]:
        """Pass steps 1 and 2 on, and book what follows a "Shaping" on the stage shape, all else on pack."""
        stage = "pack"
        while True:
            try:
                progress = next(steps)
            except StopIteration as end:
                self.stop(stage)
                self.seconds.setdefault("shape", 0.0)
                return end.value  # type: ignore[no-any-return]
            self.stop(stage)
            stage = "shape" if progress.stage.startswith("Shaping") else "pack"
            yield progress


def write_run(run: Run, folder: Path, blender: Callable[[], BlenderSide]) -> None:
    """All files of a run, into a folder that is there (see files.output_folder)."""
    write_mesh(folder / "part.stl", run.part.mesh)
    for name in run.recipe.output.formats:
        write_mesh(folder / f"part.{name}", run.part.mesh, run.millimetres)
    for name in run.recipe.output.drawings:
        assert run.drawing is not None
        write_drawing(folder / f"pattern.{name}", run.drawing)
    write_features(folder / "features.csv", run.pattern)
    write_report(folder / "report.json", run.report)
    recipe = with_copied_files(run, folder)
    (folder / "recipe.toml").write_text(recipe_to_toml(recipe), encoding="utf-8")
    if run.recipe.output.blend:
        blender().write_blend(folder / "pattern.blend", run)
    if run.recipe.output.picture:
        blender().write_picture(folder / "part.png", run)


def with_copied_files(run: Run, folder: Path) -> Recipe:
    """The recipe with the files that it names, images and meshes, copied beside it: there it makes the same
    part.
    """
    names: dict[str, str] = {}
    for number, name in enumerate(sorted(recipe_names(run.recipe).images), 1):
        if (run.origin / name).is_file():  # else it is in the .blend
            names[name] = f"image_{number}{Path(name).suffix}"
            shutil.copyfile(run.origin / name, folder / names[name])
    recipe = with_recipe_images(run.recipe, names)
    mesh = recipe.feature.mesh
    if mesh is not None and (run.origin / mesh).is_file():
        shutil.copyfile(run.origin / mesh, folder / f"feature{Path(mesh).suffix}")
        recipe = replace(recipe, feature=replace(recipe.feature, mesh=f"feature{Path(mesh).suffix}"))
    return replace(recipe, region=with_copied_keep_outs(recipe.region, run.origin, folder))


def with_copied_keep_outs(choice: RegionChoice, origin: Path, folder: Path) -> RegionChoice:
    """The choice with the mesh files of its keep-outs, as seen from `origin`, copied into the folder."""
    entries = []
    for number, entry in enumerate(choice.keep_out, 1):
        copied = entry.file
        if copied is not None:
            copied = f"keep_out_{number}{Path(copied).suffix}"
            shutil.copyfile(origin / str(entry.file), folder / copied)
        entries.append(replace(entry, file=copied))
    return replace(choice, keep_out=tuple(entries))


def blender_side() -> BlenderSide:
    """Blender's part in a batch run. OutputError where this Python has no Blender in it."""
    try:
        import bpy  # noqa: F401
    except ImportError as error:
        raise OutputError(
            f"A .blend file or a picture needs Blender ({error}): run this in Blender, with "
            "`blender -b -P scripts/pattern_batch.py -- ...`"
        ) from error
    # by name, because the two rooms know each other's types and a checker loses its way in the circle
    return cast(BlenderSide, import_module(".blender.batch_base", __package__))


# -- the command ---------------------------------------------------------------------------------------------


class _Parser(argparse.ArgumentParser):
    def error(self, message: str) -> NoReturn:
        """One line instead of usage and message."""
        self.exit(2, f"{self.prog}: {message}; see --help\n")


def parse(arguments: Sequence[str], prog: str) -> argparse.Namespace:
    """The command line as a namespace: recipe, base, out, quiet."""
    parser = _Parser(
        prog=prog,
        description="Fill faces of a part with a tight hexagonal pattern of holes, as a recipe says.",
        epilog=EXAMPLE,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("recipe", type=Path, metavar="RECIPE.toml", help="what to make, see README.md")
    parser.add_argument(
        "--base",
        type=Path,
        metavar="MODEL",
        help="the part: STL, OBJ, PLY, 3MF, GLB or .blend (default in Blender: the open file)",
    )
    parser.add_argument("--out", type=Path, metavar="DIR", required=True, help="folder for the results")
    parser.add_argument("--quiet", action="store_true", help="no progress, errors only")
    return parser.parse_args(arguments)


def read_base(path: Path | None, in_blender: bool, names: Wanted, keep_outs: Sequence[KeepOut]) -> LoadedBase:
    """The base that the command line names, with what `names` and `keep_outs` ask for; None is the file open
    in Blender.
    """
    if path is None:
        if not in_blender:
            raise BaseError("No base is given: add --base MODEL")
        return blender_side().read_base(None, names, keep_outs)
    if path.suffix.lower() == ".blend":
        if not path.exists():
            raise BaseError(f"Base {path} does not exist: check the path")
        return blender_side().read_base(path, names, keep_outs)
    return load_base(path)


def main(
    arguments: Sequence[str],
    prog: str = "pattern_batch.py",
    report: Callable[[Progress], None] | None = None,
    in_blender: bool = False,
) -> int:
    """Run the batch with these arguments; the exit code is 0 only when the part is good.

    report: told of every progress step; by default a line on stderr. in_blender: a file may be open
    """
    try:
        options = parse(arguments, prog)
    except SystemExit as end:  # --help or a wrong command line: said already
        return int(end.code or 0)
    show = None if options.quiet else report or line_on(sys.stderr)
    hushed = silenced if options.quiet else nullcontext  # Blender tells of every file it reads and saves
    try:
        recipe = load_recipe(options.recipe)  # nonsense is told before a long read
        with hushed():
            names = recipe_names(recipe)
            base = read_base(options.base, in_blender, names, recipe.region.keep_out)
        with output_folder(options.out) as folder:
            run = drive(run_steps(base, options.recipe), show)
            with hushed():
                write_run(run, folder, blender_side)
    except PatternError as error:
        return _failed(prog, str(error), show)
    except MemoryError:
        return _failed(prog, "Out of memory: use a larger pitch or a coarser base", show)
    except KeyboardInterrupt:
        return _failed(prog, "Stopped, nothing was written", show, 130)
    if show is not None:
        show(Progress("Done", 1.0))
    print(summary(run, options.out))
    return 0


def _failed(prog: str, message: str, show: Callable[[Progress], None] | None, code: int = 1) -> int:
    if show is not None:
        show(Progress("Done", 1.0))
    print(f"{prog}: {' '.join(message.split())}", file=sys.stderr)
    return code


def summary(run: Run, out: Path) -> str:
    """One line on what was made."""
    figures = run.report
    webs = "" if figures["min_web"] is None else f", smallest web {figures['min_web']:.3g}"
    limits = figures["limits"]
    cut = "".join(f", {limits[key]:,} {key}" for key in ("shrunk", "dropped") if limits[key])
    share = "open" if figures["kind"] == "hole" else "covered"
    rules = "".join(
        f", {len(rule['ids']):,} break{'s' if len(rule['ids']) == 1 else ''} the {rule['rule']} rule"
        for rule in figures["broken"]
    )
    return (
        f"{nouns(figures['kind'], figures['features'])}, {100 * figures['open_area']:.1f} % {share}"
        f"{webs}{cut}{rules}; "
        f"watertight part in {out / 'part.stl'}"
    )
