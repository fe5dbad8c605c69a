"""From the properties of a field to the recipe's description, and back."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Callable, Iterator, Mapping
from dataclasses import fields, is_dataclass
from typing import Any

import bpy
import numpy as np

from ..core.errors import RecipeError
from ..core.field_tables import field_from_toml, field_to_toml
from ..core.fields import Distance, Edge, Linear, Radial
from ..core.metric import Constant, Described
from ..core.painted import Attribute, Image
from ..core.toml_values import Point
from .field_properties import QUARTERS, BubblePatternField, beside, point_of, typed, uv_names
from .reading import transformed, world_frame

# Blender keeps 32 bits of a number: this is how far it may be from the one in a recipe, relative to it.
SINGLE = 1e-6

# -- to the recipe -------------------------------------------------------------------------------------------


def described(field: Any, constant: float, unit: str, where: str) -> Described:
    """The field that the properties stand for; `constant` is the number beside them.

    unit: of its values, "size", "share" (of the pitch or of another size) or "angle", in the recipe in
    degrees. Raises RecipeError, which names the key by `where`, where something is not chosen yet or a
    recipe's text makes no sense.
    """
    if field.kind == 'CONSTANT':
        return Constant(VALUE[unit](constant))
    if field.kind == 'RECIPE':
        return from_text(field.text, where)
    graded = {
        "from_": VALUE[unit](getattr(field, f"start_{unit}")),
        "to": VALUE[unit](getattr(field, f"end_{unit}")),
        "falloff": field.falloff.lower(),
        "curve": curve_of(field) if field.falloff == 'CURVE' else (),
        "invert": field.invert,
        "clamp": field.clamp or field.falloff != 'LINEAR',
    }
    return DESCRIBED[field.kind](field, graded, where)


def in_degrees(angle: float) -> float:
    """The degrees that were typed, of the 32 bits that Blender keeps of their radians."""
    return float(f"{math.degrees(angle):.6g}")


# The recipe's number for a property's, by the unit of a field.
VALUE: Mapping[str, Callable[[float], float]] = {"size": typed, "share": typed, "angle": in_degrees}


def from_text(text: str, where: str) -> Described:
    """The field in a line of TOML. RecipeError where it is none."""
    try:
        table = tomllib.loads(f"field = {text}")
    except tomllib.TOMLDecodeError as error:
        raise RecipeError(
            f'{where}: "{text[:40]}" is no field: write {{ kind = "linear", ... }} ({error})'
        ) from None
    return field_from_toml(table["field"], where)


def curve_of(field: Any) -> tuple[tuple[float, float], ...]:
    """The control points of the curve that a falloff goes through."""
    return tuple((t, typed(height)) for t, height in zip(QUARTERS, field.heights, strict=True))


def chosen(value: Any, where: str, what: str) -> Any:
    """The value. RecipeError where it is none, which asks to choose `what`."""
    if not value:
        raise RecipeError(f"{where} follows {what}: choose it")
    return value


def _linear(field: Any, graded: dict[str, Any], _where: str) -> Described:
    if field.along == 'DIRECTION':
        return Linear(**graded, direction=point_of(field.direction))
    start = _origin(field, field.start_object) if field.start_object else point_of(field.start)
    end = _origin(field, field.end_object) if field.end_object else point_of(field.end)
    return Linear(**graded, start=start, end=end)


def _origin(field: Any, obj: bpy.types.Object) -> Point:
    """Where an object is, in the frame of the base."""
    frame = world_frame(field.id_data.bubble_pattern.base)
    at = np.array(obj.matrix_world.translation, dtype=np.float64)
    return point_of(transformed(at[None], np.linalg.inv(frame))[0])


def _radial(field: Any, graded: dict[str, Any], where: str) -> Described:
    about = field.about
    axis: Any = None
    if field.axis != 'NONE':
        letter = field.axis.lower()
        x, y, z = (float(letter == name) for name in "xyz")
        axis = letter if about == 'OBJECT' else (x, y, z)
    return Radial(
        **graded,
        centre=point_of(field.centre) if about == 'POINT' else None,
        object=chosen(field.object, where, "an object").name if about == 'OBJECT' else None,
        axis=axis,
        inner=typed(field.inner),
        radius=typed(field.radius) or None,
    )


def _edge(field: Any, graded: dict[str, Any], _where: str) -> Described:
    return Edge(**graded, distance=typed(field.distance), loops=field.loops.lower())


def _distance(field: Any, graded: dict[str, Any], where: str) -> Described:
    names = [] if field.object is None else [field.object.name]
    if field.objects is not None:
        names += sorted(obj.name for obj in field.objects.all_objects if beside(field, obj))
    names = list(dict.fromkeys(names))
    return Distance(
        **graded,
        distance=typed(field.distance),
        objects=tuple(chosen(names, where, "the distance from an object")),
    )


def _attribute(field: Any, graded: dict[str, Any], where: str) -> Described:
    return Attribute(
        **graded,
        name=chosen(field.attribute, where, "an attribute"),
        channel=field.channel.lower(),
        low=typed(field.low),
        high=typed(field.high),
    )


def _image(field: Any, graded: dict[str, Any], where: str) -> Described:
    image = chosen(field.image, where, "an image").name
    channel = field.channel.lower()
    if field.mapping == 'FLAT':
        return Image(**graded, image=image, channel=channel, width=typed(field.width) or None)
    first = next(iter(uv_names(field, bpy.context, "")), "")
    uv = chosen(field.uv or first, where, "a UV map, which the base has none of")
    return Image(**graded, image=image, channel=channel, uv=uv)


DESCRIBED: Mapping[str, Callable[[Any, dict[str, Any], str], Described]] = {
    'LINEAR': _linear,
    'RADIAL': _radial,
    'EDGE': _edge,
    'DISTANCE': _distance,
    'ATTRIBUTE': _attribute,
    'IMAGE': _image,
}
KIND_OF = {
    Linear: 'LINEAR',
    Radial: 'RADIAL',
    Edge: 'EDGE',
    Distance: 'DISTANCE',
    Attribute: 'ATTRIBUTE',
    Image: 'IMAGE',
}


# -- from the recipe -----------------------------------------------------------------------------------------


def take(field: Any, wanted: Described, unit: str) -> None:
    """Set the properties to a field that is not constant; what they cannot show is kept as text."""
    field.begun = True
    kind = KIND_OF.get(type(wanted))
    if kind is not None:
        for name, value in _shown(wanted, unit):
            setattr(field, name, value)
        field.kind = kind
        try:
            if same(described(field, 0.0, unit, ""), wanted):
                return
        except RecipeError:
            pass  # an object or an image that is not there
    field.text = field_to_toml(wanted)
    field.kind = 'RECIPE'


def _shown(wanted: Described, unit: str) -> Iterator[tuple[str, Any]]:
    """Properties with values that show as much of a field as they can."""
    renamed = {"from_": f"start_{unit}", "to": f"end_{unit}", "name": "attribute"}
    for entry in fields(wanted):  # type: ignore[arg-type]
        value = getattr(wanted, entry.name)
        turns = unit == "angle" and entry.name in ("from_", "to")
        yield from _property(renamed.get(entry.name, entry.name), math.radians(value) if turns else value)
    if isinstance(wanted, Linear):
        yield "along", 'POINTS' if wanted.direction is None else 'DIRECTION'
        yield "start_object", None
        yield "end_object", None
    elif isinstance(wanted, Radial):
        yield "about", 'OBJECT' if wanted.object else 'POINT' if wanted.centre else 'MIDDLE'
    elif isinstance(wanted, Image):
        yield "mapping", 'FLAT' if wanted.uv is None else 'UV'


def _property(name: str, value: Any) -> Iterator[tuple[str, Any]]:
    """The property that shows a value of a field, where there is one."""
    properties = BubblePatternField.bl_rna.properties
    if name == "objects":
        yield "object", bpy.data.objects.get(value[0]) if len(value) == 1 else None
        yield "objects", None
    elif name == "curve":
        if tuple(t for t, _ in value) == QUARTERS:
            yield "heights", tuple(height for _, height in value)
    elif name == "object":
        yield name, bpy.data.objects.get(value or "")
    elif name == "image":
        yield name, bpy.data.images.get(value)
    elif name == "axis":
        letter = value if isinstance(value, str) else AXES.get(value or ())
        yield name, (letter or 'none').upper()
    elif value is None:
        if name in {"radius", "width"}:
            yield name, 0.0
    elif name in properties:
        items = getattr(properties[name], "enum_items", ())
        if not items:
            yield name, value
        elif value.upper() in items:
            yield name, value.upper()


AXES: Mapping[Any, str] = {(1.0, 0.0, 0.0): 'x', (0.0, 1.0, 0.0): 'y', (0.0, 0.0, 1.0): 'z'}


def same(one: Any, other: Any) -> bool:
    """Whether two descriptions are equal, but for what 32 bits leave of a number."""
    if isinstance(one, float) and isinstance(other, float):
        return math.isclose(one, other, rel_tol=SINGLE)
    if type(one) is not type(other):
        return False
    if isinstance(one, tuple):
        return len(one) == len(other) and all(map(same, one, other))
    if is_dataclass(one):
        return all(same(getattr(one, entry.name), getattr(other, entry.name)) for entry in fields(one))
    return bool(one == other)
