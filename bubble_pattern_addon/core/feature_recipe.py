"""What one feature is, as a designer chooses it: the recipe's table [feature], and how TOML spells it.

One definition serves both signs: what a bump adds, a hole or a dimple of the same profile takes away.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import Any

from .errors import RecipeError
from .field_tables import field_from_toml
from .metric import Constant, Described
from .toml_values import Point, number, pairs, point, show, text, whole

KINDS = ("hole", "dimple", "bump")
FORMS = ("dome", "boss", "cone")
RIMS = ("sharp", "chamfer", "fillet")
PROFILES = ("circle", "ellipse", "slot", "rectangle", "polygon", "drop", "cross", "curve", "mesh")
ACROSS = ("corners", "flats")
TURNS = ("row", "fixed", "towards", "around", "boundary", "attribute", "curvature", "random")
AXES = {"normal": 0.0, "pull": 1.0}

# Narrow over long side where the recipe does not say.
ASPECTS = {"ellipse": 0.6, "slot": 0.4, "rectangle": 0.6, "drop": 0.6, "cross": 0.35}
ROUNDED = ("rectangle", "polygon", "drop", "cross")

# Relative to the diameter, where the recipe does not say.
DIMPLE_DEPTH = 0.15
BUMP_HEIGHT = 0.25
RIM_SIZE = 0.1

Size = float | Described
SIZES = ("depth", "height", "draft", "aspect", "angle")
"""Keys that may vary over the region: a number, or a field."""


@dataclass(frozen=True)
class Feature:
    """One feature, in its own frame: z along its axis outward, x along its heading, 0 on the surface.

    kind: "hole", "dimple" (a spherical cap taken away) or "bump"; depth: of a hole's floor below the surface
    at its centre, None for through the near wall; of a dimple there, None for 0.15 of its diameter
    form: of a bump, "dome" (a spherical cap), "boss" (a flat top) or "cone" (a tip); height: of its top above
    the surface at its centre, None for a quarter of its diameter
    draft: angle of a hole's or boss's wall to its axis: a hole widens outward, a boss narrows
    rim: of a hole at the surface, of a boss at its top: "sharp", "chamfer" (for a hole, a countersink) or
    "fillet"; rim_size: width of the chamfer seen along the axis or radius of the fillet, None for a tenth of
    the diameter; rim_angle: of a chamfer, between its opposite sides, as countersinks are named

    profile: the outline square to the axis. The diameter is that of the circle round it about the axis, rim
    and draft included: no feature reaches beyond its circle, whatever its profile and heading, so webs and
    margins hold for all. A polygon given by `points` and a mesh are scaled to that
    aspect: narrow over long side, None for the profile's own; corners: of a polygon; rounding: of the
    corners, 1 for as round as can be; points: of the profile "curve", about the axis; mesh: of the profile
    "mesh", a file's or object's name, see core.stamp
    sides, tolerance: facets of a full turn, or chord height of a facet, for arcs, fillets and domes; without
    either, as fine as gives the widest feature 32 sides
    across: a circle measures its diameter across the corners of its facets, which no facet leaves, or across
    their flats, as for a shaft to pass: then the corners stand out by 1/cos(pi/sides), below 4 per cent

    axis: 0 along the surface normal, 1 along `pull`, or between; pull: direction in which a tool is drawn
    off the part; where it is given, undercuts are told, whatever the axis
    turn: where the profile's x axis heads: "row" (of the arrangement), "fixed" (turn_direction), "towards" or
    "around" turn_point, "boundary" (along the nearest), "attribute" (turn_attribute, vectors), "curvature"
    (across the strongest bend), "random" (turn_seed); angle: added to that, counter-clockwise seen from
    outside
    """

    kind: str = "hole"
    depth: Size | None = None
    sides: int | None = None
    tolerance: float | None = None
    form: str = "dome"
    height: Size | None = None
    draft: Size = 0.0
    rim: str = "sharp"
    rim_size: float | None = None
    rim_angle: float = 90.0
    profile: str = "circle"
    across: str = "corners"
    aspect: Size | None = None
    corners: int = 6
    rounding: float = 0.0
    points: tuple[tuple[float, float], ...] = ()
    mesh: str | None = None
    axis: float = 0.0
    pull: Point | None = None
    turn: str = "row"
    turn_direction: Point | None = None
    turn_point: Point | None = None
    turn_attribute: str | None = None
    turn_seed: int = 0
    angle: Size = 0.0

    @property
    def through(self) -> bool:
        """It pierces the near wall; of a mesh, nobody knows before it is cut."""
        return self.kind == "hole" and self.depth is None and self.profile != "mesh"

    @property
    def plain(self) -> bool:
        """A straight round hole along the normal, which the quick way makes."""
        shape = (self.kind, self.profile, self.rim, self.across) == ("hole", "circle", "sharp", "corners")
        return shape and self.draft == 0

    @property
    def adds(self) -> bool:
        """It adds material."""
        return self.kind == "bump"

    @property
    def fields(self) -> tuple[Described, ...]:
        """The sizes that vary over the region."""
        sizes = (getattr(self, name) for name in SIZES)
        return tuple(size for size in sizes if isinstance(size, Described))

    def with_fields(self, change: Callable[[Described], Described]) -> Feature:
        """The feature with each of its fields changed."""
        sizes = {name: getattr(self, name) for name in SIZES}
        changed: dict[str, Any] = {
            name: change(size) for name, size in sizes.items() if isinstance(size, Described)
        }
        return replace(self, **changed)


def nouns(kind: str, count: int) -> str:
    """What `count` features of a kind are called: "1 hole", "1,200 bumps"."""
    return f"{count:,} {kind}" + ("" if count == 1 else "s")


# -- from TOML ---------------------------------------------------------------------------------------------


def _size(value: object, where: str) -> Size:
    """A number as it is, or a field."""
    size = field_from_toml(value, where)
    return size.value if isinstance(size, Constant) else size


def _axis(value: object, where: str) -> float:
    if not isinstance(value, str):
        return number(value, where)
    if value not in AXES:
        raise RecipeError(f'{where} = {show(value)} must be "normal", "pull" or a number between: 0 to 1')
    return AXES[value]


READERS: dict[str, Callable[[object, str], Any]] = (
    dict.fromkeys(("kind", "form", "rim", "profile", "across", "turn", "mesh", "turn_attribute"), text)
    | dict.fromkeys(SIZES, _size)
    | dict.fromkeys(("tolerance", "rim_size", "rim_angle", "rounding"), number)
    | dict.fromkeys(("sides", "corners", "turn_seed"), whole)
    | dict.fromkeys(("pull", "turn_direction", "turn_point"), point)
    | {"points": pairs, "axis": _axis}
)


def without_defaults(feature: Feature) -> Iterator[str]:
    """Names of the keys that differ from their defaults."""
    plain = Feature()
    return (name for name in Feature.__dataclass_fields__ if getattr(feature, name) != getattr(plain, name))
