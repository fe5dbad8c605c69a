"""Fields in recipe files: a number, or a table such as { kind = "linear", from = 2.0, to = 6.0, ... }."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import MISSING, Field, dataclass, fields, is_dataclass, replace
from typing import Any

from .blending import Blend, FaceSet, Fill, Least, Most, Product, SubRegions
from .errors import RecipeError
from .fields import Distance, Edge, Linear, Radial
from .metric import Constant, Described
from .painted import Attribute, Image
from .toml_values import (
    flag,
    nearest,
    number,
    pairs,
    point,
    points,
    polylines,
    show,
    spell,
    text,
    texts,
    whole,
)

KINDS: Mapping[str, type[Described]] = {
    "constant": Constant,
    "linear": Linear,
    "radial": Radial,
    "boundary": Edge,
    "distance": Distance,
    "attribute": Attribute,
    "image": Image,
    "faces": SubRegions,
    "multiply": Product,
    "min": Least,
    "max": Most,
    "blend": Blend,
    "fill": Fill,
}
KIND_OF = {cls: kind for kind, cls in KINDS.items()}


def field_from_toml(value: object, where: str) -> Described:
    """The field that a recipe's value describes: a number, which is the same everywhere, or a table.

    Raises RecipeError, which names the key, for anything else. Whether the values make sense is left to the
    description's own check.
    """
    if not isinstance(value, Mapping):
        if isinstance(value, (bool, str)) or not isinstance(value, (int, float)):
            raise RecipeError(
                f"{where} = {show(value)} must be a number, or a field's table such as "
                '{ kind = "linear", from = 2.0, to = 6.0, direction = [1, 0, 0] }'
            )
        return Constant(number(value, where))
    known = ", ".join(KINDS)
    if "kind" not in value:
        raise RecipeError(f"{where}: a field's table must say its kind: {known}")
    kind = text(value["kind"], f"{where}: kind")
    if kind not in KINDS:
        advice = nearest(kind, KINDS, [show(name) for name in KINDS])
        raise RecipeError(f"{where}: kind = {show(kind)} is not known: {advice}")
    table = {key: entry for key, entry in value.items() if key != "kind"}
    if kind == "constant":
        return _read(Constant, table, where, 'kind = "constant"', {"value": number})
    if "curve" in table:
        table.setdefault("falloff", "curve")
    return _read(KINDS[kind], table, where, f'kind = "{kind}"', READERS)


def field_to_toml(field: Described) -> str:
    """TOML's spelling of a field, such that field_from_toml gives the field again."""
    return spell(_plain(field))


def _read(
    cls: type[Any],
    table: Mapping[str, object],
    where: str,
    what: str,
    readers: Mapping[str, Callable[[object, str], Any]],
) -> Any:
    """A `cls` from the table that holds its fields."""
    known = {_key(entry): entry for entry in fields(cls)}
    for key in table:
        if key not in known:
            raise RecipeError(f"{where}: {what} has no key {show(key)}: {nearest(key, known)}")
    for key, entry in known.items():
        if key not in table and entry.default is MISSING and entry.default_factory is MISSING:
            raise RecipeError(f"{where}: {what} lacks {key}: give it")
    return cls(**{known[key].name: readers[key](entry, f"{where}: {key}") for key, entry in table.items()})


def _key(entry: Field[Any]) -> str:
    """The key in TOML: from_ is from, which Python keeps for itself."""
    return entry.name.rstrip("_")


def _axis(value: object, where: str) -> Any:
    return text(value, where) if isinstance(value, str) else point(value, where)


def _fields(value: object, where: str) -> tuple[Described, ...]:
    if not isinstance(value, list):
        raise RecipeError(f"{where} = {show(value)} must be a list of fields: [3.0, {{ kind = ... }}]")
    return tuple(field_from_toml(entry, f"{where}, field {n}") for n, entry in enumerate(value, 1))


def _face_sets(value: object, where: str) -> tuple[FaceSet, ...]:
    if not isinstance(value, list) or not all(isinstance(entry, Mapping) for entry in value):
        raise RecipeError(f'{where} must be a list of tables: [{{ attribute = "centre", value = 2.0 }}, ...]')
    return tuple(
        _read(FaceSet, entry, f"{where}, sub-region {n}", "a sub-region", READERS)
        for n, entry in enumerate(value, 1)
    )


# a key means the same in every kind
READERS: Mapping[str, Callable[[object, str], Any]] = (
    dict.fromkeys(("from", "to", "inner", "radius", "distance", "low", "high", "width"), number)
    | dict.fromkeys(("direction", "start", "end", "centre", "project", "up"), point)
    | dict.fromkeys(("falloff", "loops", "name", "channel", "image", "uv", "object"), text)
    | dict.fromkeys(("attribute", "material"), text)
    | dict.fromkeys(("invert", "clamp"), flag)
    | dict.fromkeys(("near", "points"), points)
    | dict.fromkeys(("value", "otherwise", "first", "second", "mask", "share"), field_from_toml)
    | {"curve": pairs, "axis": _axis, "lines": polylines, "objects": texts, "equals": whole}
    | {"of": _fields, "sets": _face_sets}
)


def _plain(value: object) -> object:
    """Descriptions as tables, what equals its default left out; all else as it is."""
    if isinstance(value, Constant):
        return float(value.value)
    if isinstance(value, tuple):
        return [_plain(entry) for entry in value]
    if not is_dataclass(value) or isinstance(value, type):
        return value
    table: dict[str, object] = {}
    if isinstance(value, Described):
        table["kind"] = KIND_OF[type(value)]
    for entry in fields(value):
        content = getattr(value, entry.name)
        if entry.default is MISSING or content != entry.default:
            table[_key(entry)] = _plain(content)
    return table


# -- what a field asks for -----------------------------------------------------------------------------------


@dataclass(frozen=True)
class Wanted:
    """Names that fields ask their surroundings for."""

    attributes: frozenset[str] = frozenset()
    materials: frozenset[str] = frozenset()
    uv_maps: frozenset[str] = frozenset()
    images: frozenset[str] = frozenset()
    objects: frozenset[str] = frozenset()
    vectors: frozenset[str] = frozenset()


NO_NAMES = Wanted()


def wanted(*described: Described) -> Wanted:
    """All names that these fields ask for, so that a caller fetches these and no others."""
    parts = [part for field in described for part in _parts(field)]

    def names(cls: type[Any], key: str) -> frozenset[str]:
        """What the parts of this class have under `key`."""
        found = [getattr(part, key) for part in parts if isinstance(part, cls)]
        return frozenset(name for name in found if name is not None)

    objects = [name for part in parts if isinstance(part, Distance) for name in part.objects]
    return Wanted(
        attributes=names(Attribute, "name") | names(FaceSet, "attribute"),
        materials=names(FaceSet, "material"),
        uv_maps=names(Image, "uv"),
        images=names(Image, "image"),
        objects=names(Radial, "object") | frozenset(objects),
    )


def asks_for_pitch(described: Described) -> bool:
    """Whether a share of the pitch is part of this field."""
    return any(isinstance(part, Fill) for part in _parts(described))


def with_images(described: Described, names: Mapping[str, str]) -> Described:
    """The same field with its images called by other names."""
    changed = _with_images(described, names)
    assert isinstance(changed, Described)
    return changed


def _with_images(value: object, names: Mapping[str, str]) -> object:
    if isinstance(value, tuple):
        return tuple(_with_images(entry, names) for entry in value)
    if isinstance(value, Image):
        return replace(value, image=names.get(value.image, value.image))
    if isinstance(value, (Described, FaceSet)):
        parts = {f.name: _with_images(getattr(value, f.name), names) for f in fields(value)}  # type: ignore[arg-type]
        return replace(value, **parts)  # type: ignore[type-var]
    return value


def _parts(value: object) -> Iterator[object]:
    """A description and all that it is made of."""
    if isinstance(value, tuple):
        for entry in value:
            yield from _parts(entry)
    elif isinstance(value, (Described, FaceSet)):
        yield value
        for field in fields(value):  # type: ignore[arg-type]
            yield from _parts(getattr(value, field.name))
