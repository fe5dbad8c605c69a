"""Which keep-outs of a recipe make sense."""

from __future__ import annotations

import math

from .errors import RecipeError
from .recipe import KeepOut, RegionChoice
from .toml_values import Point, check_above, check_at_least

# what a keep-out can be: which keys it needs then, and which it may have besides its margin
KEEP_OUT_NEEDS: dict[str, tuple[tuple[str, ...], tuple[str, ...]]] = {
    "faces": ((), ()),
    "object": ((), ("axis", "reach")),
    "collection": ((), ("axis", "reach")),
    "file": ((), ("axis", "reach")),
    "sphere": (("diameter",), ()),
    "cylinder": (("diameter",), ("axis", "reach")),
    "box": (("size",), ("axis", "along", "reach")),
}


def parallel(one: Point, other: Point) -> bool:
    """Whether two directions are the same or opposite, as nearly as a box's sides can be told by."""
    cosine = sum(a * b for a, b in zip(one, other, strict=True)) / (math.hypot(*one) * math.hypot(*other))
    return abs(cosine) > 1 - 1e-9


def check_keep_outs(choice: RegionChoice) -> None:
    """RecipeError unless every keep-out is one thing with what that needs."""
    for count, keep_out in enumerate(choice.keep_out, 1):
        _check_keep_out(keep_out, f"[region] keep_out, entry {count}")


def _check_keep_out(keep_out: KeepOut, where: str) -> None:
    """RecipeError, which names the entry by `where`, unless it is one thing with what that needs."""
    named = [key for key in KEEP_OUT_NEEDS if getattr(keep_out, key) is not None]
    if len(named) != 1:
        said = f"names {len(named)} things ({', '.join(named)})" if named else "names nothing"
        raise RecipeError(f"{where} {said}: give one of {', '.join(KEEP_OUT_NEEDS)}")
    needed, allowed = KEEP_OUT_NEEDS[named[0]]
    for key in ("diameter", "size", "axis", "along", "reach"):
        value = getattr(keep_out, key)
        if value is None and key in needed:
            raise RecipeError(f"{where}: a {named[0]} lacks {key}: give it")
        if value is not None and key not in needed and key not in allowed:
            raise RecipeError(f"{where}: {key} does not go with {named[0]}: leave it out")
    if keep_out.diameter is not None:
        check_above(keep_out.diameter, f"{where}: diameter")
    for coordinate in keep_out.size or ():
        check_above(coordinate, f"{where}: size")
    for key in ("axis", "along"):
        way = getattr(keep_out, key)
        if way is not None and not any(way):
            raise RecipeError(f"{where}: {key} = [0, 0, 0] is no direction: give a vector")
    if keep_out.along is not None and parallel(keep_out.along, keep_out.axis or (0.0, 0.0, 1.0)):
        raise RecipeError(f"{where}: along and axis of the box are parallel: give two directions")
    if keep_out.reach is not None:
        check_at_least(keep_out.reach, 0, f"{where}: reach")
    check_at_least(keep_out.margin, 0, f"{where}: margin")
