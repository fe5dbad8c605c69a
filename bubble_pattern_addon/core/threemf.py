"""3MF, the 3D printing format: a zip archive with a model in XML, read and written with the standard library.

After the 3MF core specification 1.3: meshes, components and build items with their transforms, the base
materials of objects and triangles, and parts of the model in files of their own (production extension).
"""

from __future__ import annotations

import posixpath
import zipfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import NamedTuple
from xml.etree import ElementTree
from xml.sax.saxutils import quoteattr

import numpy as np

from .mesh import Floats, Mesh

CORE = "http://schemas.microsoft.com/3dmanufacturing/core/2015/02"
PATH_KEY = "{http://schemas.microsoft.com/3dmanufacturing/production/2015/06}path"
MODEL_TYPE = "http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"
START = "3D/3dmodel.model"


class Piece(NamedTuple):
    """Part of a base file: a mesh and, per triangle, the name of its material ("" for none), (T,) str; what
    is painted on it by name, (T,), (T, 3) or (T, 3, channels), and UV maps, (T, 3, 2).
    """

    mesh: Mesh
    material: np.ndarray[tuple[int], np.dtype[np.str_]]
    values: Mapping[str, Floats] = MappingProxyType({})
    uv_maps: Mapping[str, Floats] = MappingProxyType({})


@dataclass(frozen=True)
class _Model:
    """One model file: its objects and base materials by id."""

    objects: dict[str, ElementTree.Element]
    materials: dict[str, list[str]]
    build: list[ElementTree.Element]
    unit: str


# Units of the specification, in millimetres.
UNITS = {"micron": 0.001, "millimeter": 1.0, "centimeter": 10.0, "inch": 25.4, "foot": 304.8, "meter": 1000.0}


def read_3mf(path: Path) -> tuple[list[Piece], float]:
    """The pieces that the file's build section places, each where it is placed, and how many millimetres its
    unit is long.

    Raises whatever zipfile, ElementTree and KeyError say of a broken file; files.load_base puts it in words.
    """
    with zipfile.ZipFile(path) as archive:
        names = {name.lower().lstrip("/"): name for name in archive.namelist()}
        models: dict[str, _Model] = {}

        def model(name: str) -> _Model:
            """The model file of this name in the archive, read once. KeyError where there is none."""
            key = posixpath.normpath(name.lstrip("/")).lower()
            if key not in models:
                models[key] = _parse(archive.read(names[key]))
            return models[key]

        start = START if START.lower() in names else next(n for n in names if n.endswith(".model"))
        pieces: list[Piece] = []
        no_parents: frozenset[tuple[str, str]] = frozenset()
        stack = [(start, item, np.eye(4), no_parents) for item in model(start).build]
        while stack:
            name, place, outer, parents = stack.pop(0)
            name = place.get(PATH_KEY, name)
            here = (name, place.attrib["objectid"])
            if here in parents:
                raise ValueError("its components contain one another")
            matrix = outer @ _matrix(place.get("transform"))
            body = model(name).objects[here[1]]
            mesh = body.find(f"{{{CORE}}}mesh")
            if mesh is not None:
                pieces.append(_piece(body, mesh, matrix, model(name).materials))
            parents = parents | {here}
            stack += [(name, inner, matrix, parents) for inner in body.iter(f"{{{CORE}}}component")]
        return pieces, UNITS[model(start).unit]


def _parse(text: bytes) -> _Model:
    root = ElementTree.fromstring(text)
    return _Model(
        objects={body.attrib["id"]: body for body in root.iter(f"{{{CORE}}}object")},
        materials={
            group.attrib["id"]: [base.get("name", "") for base in group.iter(f"{{{CORE}}}base")]
            for group in root.iter(f"{{{CORE}}}basematerials")
        },
        build=[item for build in root.iter(f"{{{CORE}}}build") for item in build.iter(f"{{{CORE}}}item")],
        unit=root.get("unit", "millimeter"),
    )


def _matrix(text: str | None) -> Floats:
    """The affine map of a transform attribute, (4, 4) for column vectors; the file holds its columns."""
    matrix = np.eye(4)
    if text:
        matrix[:3] = np.array(text.split(), dtype=np.float64).reshape(4, 3).T
    return matrix


def _piece(
    body: ElementTree.Element, mesh: ElementTree.Element, matrix: Floats, materials: dict[str, list[str]]
) -> Piece:
    points = [(v.attrib["x"], v.attrib["y"], v.attrib["z"]) for v in mesh.iter(f"{{{CORE}}}vertex")]
    faces = [*mesh.iter(f"{{{CORE}}}triangle")]
    vertices = np.array(points, dtype=np.float64).reshape(-1, 3) @ matrix[:3, :3].T + matrix[:3, 3]
    triangles = np.array([(t.attrib["v1"], t.attrib["v2"], t.attrib["v3"]) for t in faces], dtype=np.int64)
    triangles = triangles.reshape(-1, 3)
    if np.linalg.det(matrix[:3, :3]) < 0:  # a mirrored piece would be inside out
        triangles = triangles[:, ::-1]
    group, index = body.get("pid", ""), body.get("pindex", "0")
    named = [
        _material_name(materials, t.get("pid", group), t.get("p1", index if "pid" not in t.attrib else "0"))
        for t in faces
    ]
    return Piece(Mesh(vertices, triangles), np.array(named, dtype=np.str_))


def _material_name(materials: dict[str, list[str]], group: str, index: str) -> str:
    names = materials.get(group, [])
    return names[int(index)] if int(index) < len(names) else ""


def write_3mf(path: Path, mesh: Mesh, name: str = "part") -> None:
    """One mesh, given in millimetres, as a 3MF file. OSError where it can't be written."""
    vertices = "".join(f'<vertex x="{x:.9g}" y="{y:.9g}" z="{z:.9g}"/>' for x, y, z in mesh.vertices.tolist())
    triangles = "".join(f'<triangle v1="{a}" v2="{b}" v3="{c}"/>' for a, b, c in mesh.triangles.tolist())
    declaration = '<?xml version="1.0" encoding="UTF-8"?>\n'
    model = (
        f'{declaration}<model unit="millimeter" xmlns="{CORE}"><resources>'
        f'<object id="1" type="model" name={quoteattr(name)}><mesh>'
        f"<vertices>{vertices}</vertices><triangles>{triangles}</triangles></mesh></object>"
        f'</resources><build><item objectid="1"/></build></model>'
    )
    package = "http://schemas.openxmlformats.org/package/2006"
    types = (
        f'{declaration}<Types xmlns="{package}/content-types">'
        '<Default Extension="rels" ContentType="application/vnd.openxmlformats-package.relationships+xml"/>'
        '<Default Extension="model" ContentType="application/vnd.ms-package.3dmanufacturing-3dmodel+xml"/>'
        "</Types>"
    )
    relations = (
        f'{declaration}<Relationships xmlns="{package}/relationships">'
        f'<Relationship Id="model" Target="/{START}" Type="{MODEL_TYPE}"/></Relationships>'
    )
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("[Content_Types].xml", types)
        archive.writestr("_rels/.rels", relations)
        archive.writestr(START, model)
