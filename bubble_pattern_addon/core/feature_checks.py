"""Which values of a recipe's [feature] make sense, and which contradict one another."""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np

from .errors import RecipeError
from .feature_recipe import (
    ACROSS,
    ASPECTS,
    FORMS,
    KINDS,
    PROFILES,
    RIMS,
    ROUNDED,
    TURNS,
    Feature,
    Size,
    without_defaults,
)
from .metric import Described
from .profile import largest_inset, outlines
from .toml_values import check_above, check_at_least, check_finite, check_one_of, show

FEWEST_FLAT_SIDES = 12
STEEPEST_DRAFT = 75.0

# which key goes with which values of which other key
BELONGS: dict[str, tuple[str, tuple[str, ...]]] = {
    "depth": ("kind", ("hole", "dimple")),
    "form": ("kind", ("bump",)),
    "height": ("kind", ("bump",)),
    "draft": ("kind", ("hole", "bump")),
    "rim": ("kind", ("hole", "bump")),
    "rim_size": ("rim", ("chamfer", "fillet")),
    "rim_angle": ("rim", ("chamfer",)),
    "across": ("profile", ("circle",)),
    "aspect": ("profile", tuple(ASPECTS)),
    "corners": ("profile", ("polygon",)),
    "rounding": ("profile", ROUNDED),
    "points": ("profile", ("curve",)),
    "mesh": ("profile", ("mesh",)),
    "turn_direction": ("turn", ("fixed",)),
    "turn_point": ("turn", ("towards", "around")),
    "turn_attribute": ("turn", ("attribute",)),
    "turn_seed": ("turn", ("random",)),
}
NEEDED = ("points", "mesh", "turn_direction", "turn_point", "turn_attribute")


def check_feature(feature: Feature, diameter: float | None) -> None:
    """RecipeError for a value out of its range, or for values that contradict one another.

    diameter: of all features, None where it depends on the place; then sizes that do not fit it are told
    feature by feature, when they are added
    """
    _check_words(feature)
    _check_together(feature)
    _check_sizes(feature)
    _check_profile(feature)
    _check_axis(feature)
    if diameter is not None:
        _check_fit(feature, diameter)


def _check_words(feature: Feature) -> None:
    for key, known in (
        ("kind", KINDS),
        ("form", FORMS),
        ("rim", RIMS),
        ("profile", PROFILES),
        ("across", ACROSS),
        ("turn", TURNS),
    ):
        check_one_of(getattr(feature, key), known, f"[feature] {key}")


def _check_together(feature: Feature) -> None:
    """RecipeError for a key that says nothing about such a feature, or for one that is missing."""
    given = set(without_defaults(feature))
    for key, (other, values) in BELONGS.items():
        fits = getattr(feature, other) in values
        if key in given and not fits:
            raise RecipeError(
                f"[feature] {key} goes with {other} = {_either(values)}, "
                f"not with {show(getattr(feature, other))}: leave it out"
            )
        if fits and key in NEEDED and key not in given:
            raise RecipeError(f"[feature] {other} = {show(getattr(feature, other))} needs {key}: give it")
    pointed = feature.kind == "bump" and feature.form != "boss"
    for key in ("draft", "rim"):
        if pointed and key in given:
            raise RecipeError(f'[feature] {key} goes with form = "boss", not with {show(feature.form)}')
    if feature.profile == "mesh":
        if feature.kind == "dimple":
            raise RecipeError('[feature] kind = "dimple" has no mesh: use a hole or a bump')
        for key in ("draft", "rim", "form", "sides", "tolerance"):
            if key in given:
                raise RecipeError(f'[feature] {key} says nothing about profile = "mesh": leave it out')


def _either(values: Iterable[str]) -> str:
    return " or ".join(show(value) for value in values)


def _check_sizes(feature: Feature) -> None:
    for key in ("depth", "height"):
        size = getattr(feature, key)
        if size is not None:
            _check_range(size, f"[feature] {key}", 0, math.inf)
    _check_range(feature.draft, "[feature] draft", 0, STEEPEST_DRAFT, closed=True)
    if feature.aspect is not None:
        _check_range(feature.aspect, "[feature] aspect", 0, 1)
    _check_range(feature.angle, "[feature] angle", -math.inf, math.inf)
    if feature.rim_size is not None:
        check_above(feature.rim_size, "[feature] rim_size")
    if not 10 <= feature.rim_angle <= 170:
        raise RecipeError(f"[feature] rim_angle = {feature.rim_angle:g} must be from 10 to 170 degrees")
    if feature.sides is not None:
        check_at_least(feature.sides, 3, "[feature] sides")
    if feature.tolerance is not None:
        check_above(feature.tolerance, "[feature] tolerance")


def _check_range(size: Size, where: str, low: float, high: float, closed: bool = False) -> None:
    """RecipeError unless the size lies between `low`, itself only where `closed`, and `high`, everywhere.

    A field without bounds is judged in place.
    """
    if isinstance(size, Described):
        size.check(where)
        least, most = size.bounds()
    else:
        check_finite(size, where)
        least = most = size
    if math.isfinite(least) and (least < low or (least == low and not closed)):
        raise RecipeError(
            f"{where} can become {least:g}: it must be {'at least' if closed else 'above'} {low:g}"
        )
    if math.isfinite(most) and most > high:
        raise RecipeError(f"{where} can become {most:g}: it must be at most {high:g}")


def _check_profile(feature: Feature) -> None:
    if feature.profile == "polygon":
        check_at_least(feature.corners, 3, "[feature] corners")
    if not 0 <= feature.rounding <= 1:
        raise RecipeError(f"[feature] rounding = {feature.rounding:g} must be from 0 to 1")
    few = feature.sides is not None and feature.sides < FEWEST_FLAT_SIDES
    if feature.across == "flats" and few:
        raise RecipeError(
            f'[feature] across = "flats" wants {FEWEST_FLAT_SIDES} sides or more, for its corners stand out: '
            'raise sides, or use profile = "polygon"'
        )
    if feature.profile == "curve":
        _check_outline(feature.points)


def _check_outline(points: tuple[tuple[float, float], ...]) -> None:
    if len(points) < 3:
        raise RecipeError("[feature] points must be three or more: [[x, y], [x, y], [x, y], ...]")
    corners = np.array(points)
    if not np.isfinite(corners).all():
        raise RecipeError("[feature] points must be finite numbers")
    if not largest_inset(corners) > 0:
        raise RecipeError(
            "[feature] points run across themselves or enclose nothing: give a plain outline, each point once"
        )


def _check_axis(feature: Feature) -> None:
    if not 0 <= feature.axis <= 1:
        raise RecipeError(f"[feature] axis = {feature.axis:g} must be from 0 (normal) to 1 (pull)")
    if feature.axis and feature.pull is None:
        raise RecipeError("[feature] axis leads towards the pull direction: give pull = [x, y, z] too")
    for key in ("pull", "turn_direction", "turn_point"):
        vector = getattr(feature, key)
        for coordinate in vector or ():
            check_finite(coordinate, f"[feature] {key}")
        if key != "turn_point" and vector is not None and not any(vector):
            raise RecipeError(f"[feature] {key} = [0, 0, 0] is no direction: give another")
    check_at_least(feature.turn_seed, 0, "[feature] turn_seed")


def _check_fit(feature: Feature, diameter: float) -> None:
    """RecipeError for sizes that no feature of this diameter can have."""
    if feature.kind == "dimple" and isinstance(feature.depth, float | int) and feature.depth > diameter / 2:
        raise RecipeError(
            "[feature] depth = {depth} is more than half the diameter {diameter}, which no dimple can be: "
            "make it shallower",
            depth=float(feature.depth),
            diameter=diameter,
        )
    if feature.rim == "sharp" or feature.rim_size is None or isinstance(feature.aspect, Described):
        return
    most = diameter / 2 * _room(feature)
    if feature.rim_size >= most:
        raise RecipeError(
            "[feature] rim_size = {size} leaves nothing of a feature that measures {most} from its middle to "
            "its side: make it smaller",
            size=feature.rim_size,
            most=most,
        )
    depth = feature.depth if feature.kind == "hole" else feature.height
    deep = feature.rim_size
    if feature.rim == "chamfer":
        deep /= math.tan(math.radians(feature.rim_angle / 2))
    if isinstance(depth, float | int) and deep >= depth:
        raise RecipeError(
            "[feature] the rim is {deep} deep, the feature only {depth}: make rim_size smaller",
            deep=deep,
            depth=float(depth),
        )


def _room(feature: Feature) -> float:
    """How far the sides of the profile can move inward, for a circle of radius 1 round it."""
    aspect = feature.aspect if isinstance(feature.aspect, float | int) else ASPECTS.get(feature.profile, 1.0)
    return float(outlines(feature, np.full(1, 2.0), np.full(1, aspect), 32).room[0])
