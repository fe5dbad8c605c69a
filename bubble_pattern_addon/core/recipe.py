"""The whole of a designer's choices as one dataclass tree.

A recipe is checked once, at the door: a file's where it is read (see core.recipe_file), one that was put
together in a program, such as the panel's, by core.recipe_checks. Behind the door nobody checks again.

Lengths are in the unit of the base (metres inside Blender), angles in degrees.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from .feature_recipe import Feature as Feature
from .isometries import OFF
from .metric import Constant, Described
from .nominal import Sizes
from .toml_values import Point
from .units import Unit, millimetres_in

INTEGRATORS = ("fire", "rk4")
ORIENTATIONS = ("edge", "best")
SOLVERS = ("direct", "iterate")
FORMATS = ("stl", "obj", "ply", "3mf", "glb")
DRAWINGS = ("dxf", "svg")
PROJECTIONS = ("flat", "normal")
ALIGNMENTS = ("base", "rows")

FILL = 0.6  # a feature's diameter relative to the pitch where the recipe gives only one of them
FEATURES_WISHED = 500  # how many features a recipe that gives no length at all aims at
NEAT = (1, 1.1, 1.2, 1.4, 1.6, 1.8, 2, 2.2, 2.5, 2.8, 3, 3.5, 4, 4.5, 5, 5.5, 6, 7, 8, 9, 10)


@dataclass(frozen=True)
class KeepOut:
    """What the pattern goes round: faces (a face attribute or material), bodies or a shape (exactly one).

    object, collection: of the .blend; file: a mesh file, seen from the recipe's folder
    sphere, cylinder, box: its centre; the first two have a diameter, a box its size along its three axes
    axis: the third axis of a cylinder or box, by default z; bodies are seen along it, by default along their
    own Z axis; along: where the first axis of a box points, by default x or as near to it as can be
    reach: how far along its axis beyond its own ends it counts; None: without end
    margin: what stays free round it
    """

    faces: str | None = None
    object: str | None = None
    collection: str | None = None
    file: str | None = None
    sphere: Point | None = None
    cylinder: Point | None = None
    box: Point | None = None
    diameter: float | None = None
    size: Point | None = None
    axis: Point | None = None
    along: Point | None = None
    reach: float | None = None
    margin: float = 0.0


@dataclass(frozen=True)
class RegionChoice:
    """Which faces of the base are the target region: exactly one of near, attribute, material and all.

    parts: face attributes or materials whose faces are sub-regions with a first row of their own along their
    border (what none of them names is one more); gap: what stays free between neighbouring sub-regions
    keep_out: what is taken out of it again (see core.keep_out)
    """

    near: Point | None = None
    max_angle: float = 20.0
    attribute: str | None = None
    material: str | None = None
    all: bool = False
    parts: tuple[str, ...] = ()
    gap: float = 0.0
    keep_out: tuple[KeepOut, ...] = ()


@dataclass(frozen=True)
class Packing:
    """Step 1. pitch is the packing metric: the distance of neighbouring centres.

    orientation: where the rows of the arrangement run, "edge" (along the longest straight stretch of the
    boundary), a vector, or "best" (several directions are tried)
    symmetry: "off"; "auto", whichever the region has; "x", "xy" and so on, mirrored at planes square to these
    axes of the base; "rotate 3" or "rotate 3 z", turned into itself by thirds about an axis (see
    core.isometries); symmetry_centre: a point of the planes or the axis, None for the region's own middle
    pins: where bubbles stay whatever becomes of the others
    """

    pitch: Described = Constant(3.0)
    edge_offset: float = 0.0
    integrator: str = "fire"
    orientation: str | Point = "edge"
    seed: int = 0
    iterations: int = 60
    tolerance: float = 1e-3
    symmetry: str = OFF
    symmetry_centre: Point | None = None
    pins: tuple[Point, ...] = ()


@dataclass(frozen=True)
class Seed:
    """A feature whose diameter the designer fixes: the one nearest to the point `at`."""

    at: Point
    diameter: float


@dataclass(frozen=True)
class Shaping:
    """Step 2.

    diameter: the shaping metric, a size; as a share of the local pitch it is a Fill, in TOML the key fill
    seeds: where there are any, only these features have a size of their own, and every other one that they
    reach takes the average of its neighbours (see core.averaging)
    sizes: the only diameters there are, each feature gets the nearest smaller one: a list of them or the name
    of a series (see core.nominal); None for any
    solver: of the averages: "direct", or "iterate" as the paper does, until no diameter changes by more than
    the share `tolerance` of it, at most `iterations` times
    """

    diameter: Described = Constant(1.8)
    seeds: tuple[Seed, ...] = ()
    solver: str = "direct"
    tolerance: float = 1e-6
    iterations: int = 10_000
    sizes: Sizes | None = None


@dataclass(frozen=True)
class Limits:
    """What holds after shaping, whatever the fields say (see core.limits).

    min_web: material between two features; min_margin: from a feature's edge to the region's boundary;
    min_diameter: a feature that would have to be smaller is left out
    process: whose rules hold too, one of PROCESSES (see core.processes); thickness: of the wall that they go
    by, None for the near wall as it is measured under each feature; check_only: they shape nothing, and it is
    only told who breaks them
    """

    min_web: float = 0.0
    min_margin: float = 0.0
    min_diameter: float = 0.0
    process: str | None = None
    thickness: float | None = None
    check_only: bool = False


@dataclass(frozen=True)
class Solve:
    """What a pattern shall come to, either open_area (a share of the region's) or count (of features), by
    changing the "pitch" or the "diameter" (see core.solving). Nothing given: the recipe is taken as it is.
    """

    open_area: float | None = None
    count: int | None = None
    by: str | None = None

    def __bool__(self) -> bool:
        return self.open_area is not None or self.count is not None


@dataclass(frozen=True)
class Output:
    """What a batch run leaves behind besides features.csv, report.json and part.stl.

    formats: the part in these formats too (see FORMATS); blend: the base with the editable pattern as
    pattern.blend; picture: a rendered view of the part as part.png
    density: of the part's material in g/cm3, for the mass of what is removed
    drawings: of the pattern, in these formats (see DRAWINGS), as pattern.dxf and so on; projection, align:
    how it is drawn, see drawing.make_drawing
    unit: that of the recipe's lengths (see core.units), and of the base where its file does not say; None:
    that of the base, or millimetres
    """

    blend: bool = False
    picture: bool = False
    formats: tuple[str, ...] = ()
    density: float | None = None
    drawings: tuple[str, ...] = ()
    projection: str | Point = "flat"
    align: str = "base"
    unit: Unit | None = None


@dataclass(frozen=True)
class Recipe:
    """Everything that makes one pattern."""

    region: RegionChoice = field(default_factory=RegionChoice)
    packing: Packing = field(default_factory=Packing)
    shaping: Shaping = field(default_factory=Shaping)
    feature: Feature = field(default_factory=Feature)
    limits: Limits = field(default_factory=Limits)
    solve: Solve = field(default_factory=Solve)
    output: Output = field(default_factory=Output)

    @property
    def millimetre(self) -> float:
        """Length of a millimetre in the unit of the base: what drills and the rules of processes go by."""
        return 1.0 / millimetres_in(self.output.unit or "mm")


def neat(length: float) -> float:
    """The length nearest by ratio that a designer would have typed: 2.8, 3, 3.5, ... times a power of ten."""
    exponent = math.floor(math.log10(length))
    mantissa = min(NEAT, key=lambda m: abs(math.log(m * 10.0**exponent / length)))
    return float(f"{mantissa}e{exponent}")


def default_recipe(area: float, perimeter: float = 0.0, choice: RegionChoice | None = None) -> Recipe:
    """A good recipe for a target region of this area and with boundary loops of this length in all, both in
    the unit of the base; pitch and diameter are lengths in it.

    About 500 features, in a hexagonal arrangement where one bubble takes sqrt(3)/2 pitch^2 of the surface; a
    narrow strip, about 2 area / perimeter wide, gets at least three rows. The diameter is 0.6 of the pitch.
    The panel starts from this recipe, and a recipe file that leaves lengths out is filled up from it.
    """
    if not area > 0:
        return Recipe(region=choice or RegionChoice())
    pitch = math.sqrt(area / FEATURES_WISHED * 2 / math.sqrt(3))
    if perimeter > 0:
        # three rows touching both boundaries are 1 + sqrt(3) pitches wide
        pitch = min(pitch, 2 * area / perimeter / (1 + math.sqrt(3)))
    pitch = neat(pitch)
    return Recipe(
        region=choice or RegionChoice(),
        packing=Packing(pitch=Constant(pitch)),
        shaping=Shaping(diameter=Constant(rounded(FILL * pitch))),
    )


def rounded(value: float) -> float:
    """`value` to six digits, as a recipe writes a length that was computed."""
    return float(f"{value:.6g}")
