"""Base geometry in from files, parts out to files."""

from __future__ import annotations

import contextlib
import errno
import io
import os
import re
import shutil
import tempfile
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import trimesh

from .errors import BaseError, OutputError
from .mesh import Bools, Floats, Mesh
from .paint import painted
from .region import weld
from .surroundings import Solid, Solids, Thing
from .threemf import Piece, read_3mf, write_3mf

SUFFIXES = (".stl", ".obj", ".ply", ".3mf", ".glb", ".gltf")
SHOWN = "STL, OBJ, PLY, 3MF or GLB"
# glTF measures in metres.
METRE = 1000.0


@dataclass(frozen=True)
class LoadedBase:
    """Base geometry as a file gives it.

    mesh: triangles on vertices welded by position, in the file's own unit and axes
    attributes, materials: name -> mask (T,) of the triangles that carry it
    values: name -> what is painted on the base, (T,) on faces, (T, 3) or (T, 3, channels) at corners
    uv_maps: name -> (T, 3, 2)
    objects: name -> what stands beside the base; solids: bodies there that keep-outs name
    millimetres: how many of them its unit is long, None where the file does not say
    """

    mesh: Mesh
    attributes: Mapping[str, Bools] = field(default_factory=dict)
    materials: Mapping[str, Bools] = field(default_factory=dict)
    values: Mapping[str, Floats] = field(default_factory=dict, kw_only=True)
    uv_maps: Mapping[str, Floats] = field(default_factory=dict, kw_only=True)
    objects: Mapping[str, Thing] = field(default_factory=dict, kw_only=True)
    solids: Solids = field(default_factory=dict, kw_only=True)
    millimetres: float | None = field(default=None, kw_only=True)


# -- in ------------------------------------------------------------------------------------------------------


def load_base(path: Path) -> LoadedBase:
    """The base geometry in an STL, OBJ, PLY, 3MF or GLB file: all its objects, each where the file places it.

    Raises BaseError where the file is missing, no mesh, empty, or has coordinates that are not numbers.
    """
    if not path.exists():
        raise BaseError(f"Base {path} does not exist: check the path")
    if path.is_dir():
        raise BaseError(f"Base {path} is a folder: give a file")
    if path.suffix.lower() not in SUFFIXES:
        raise BaseError(f"Base {path.name} has a suffix that is not known: save it as {SHOWN}")
    try:
        pieces, millimetres = _read(path)
    except OSError as error:
        raise BaseError(f"Base {path} can't be read: {error.strerror or error}") from None
    except Exception as error:  # whatever a parser does on a file that breaks its format's rules
        reason = str(error).strip().splitlines()[0] if str(error).strip() else type(error).__name__
        raise BaseError(
            f"Base {path.name} is no {path.suffix[1:].upper()} mesh ({reason}): save it anew as {SHOWN}"
        ) from None
    if not any(len(piece.mesh.triangles) for piece in pieces):
        raise BaseError(f"Base {path.name} holds no faces: save it as a mesh ({SHOWN})")
    mesh = _joined(pieces)
    _check_numbers(mesh, path)
    names = np.concatenate([piece.material for piece in pieces])
    materials = {str(name): names == name for name in np.unique(names) if name}
    values = _laid_end_to_end([piece.values for piece in pieces], pieces)
    masks = {name: column != 0 for name, column in values.items() if column.ndim == 1}
    uv_maps = _laid_end_to_end([piece.uv_maps for piece in pieces], pieces)
    return LoadedBase(weld(mesh), masks, materials, values=values, uv_maps=uv_maps, millimetres=millimetres)


def load_solids(names: Iterable[str], folder: Path) -> Solids:
    """The bodies in mesh files, named as seen from `folder`, upright. BaseError as load_base."""
    upright = np.array([0.0, 0.0, 1.0])
    return {("file", name): [Solid(load_base(folder / name).mesh, upright)] for name in sorted(set(names))}


def _read(path: Path) -> tuple[list[Piece], float | None]:
    """The pieces in a file, and how many millimetres its unit is long."""
    if path.suffix.lower() == ".3mf":
        return read_3mf(path)
    scene = _obj_scene(path) if path.suffix.lower() == ".obj" else trimesh.load_scene(path, process=False)
    pieces: list[Piece] = []
    for node in sorted(scene.graph.nodes_geometry):
        matrix, geometry_name = scene.graph[node]
        geometry = scene.geometry[geometry_name]
        if isinstance(geometry, trimesh.Trimesh):  # points and curves have no faces
            pieces.append(_placed(geometry, np.asarray(matrix, dtype=np.float64)))
    return pieces, METRE if path.suffix.lower() in (".glb", ".gltf") else None


def _obj_scene(path: Path) -> trimesh.Scene:
    """An OBJ file by material. Names are taken from the file itself, for its .mtl is often lost."""
    content = path.read_bytes()
    names = dict.fromkeys(re.findall(rb"^usemtl[ \t]+(.+?)[ \t]*\r?$", content, re.MULTILINE))
    library = b"".join(b"newmtl " + name + b"\n" for name in names)
    return trimesh.load_scene(
        io.BytesIO(b"mtllib names.mtl\n" + content),
        file_type="obj",
        resolver={"names.mtl": library},
        process=False,
    )


def _placed(geometry: trimesh.Trimesh, matrix: np.ndarray[Any, np.dtype[np.float64]]) -> Piece:
    vertices = np.asarray(geometry.vertices, dtype=np.float64) @ matrix[:3, :3].T + matrix[:3, 3]
    triangles = np.asarray(geometry.faces, dtype=np.int64)
    values, uv_maps = painted(geometry)
    if np.linalg.det(matrix[:3, :3]) < 0:  # a mirrored piece would be inside out
        triangles = triangles[:, ::-1]
        values = {name: column[:, ::-1] if column.ndim > 1 else column for name, column in values.items()}
        uv_maps = {name: column[:, ::-1] for name, column in uv_maps.items()}
    name = getattr(getattr(geometry.visual, "material", None), "name", None) or ""
    return Piece(Mesh(vertices, triangles), np.full(len(triangles), str(name)), values, uv_maps)


def _laid_end_to_end(columns: list[Mapping[str, Floats]], pieces: list[Piece]) -> dict[str, Floats]:
    """Values of all pieces by name; nan where a piece has none of that name, 0 on its faces."""
    found: dict[str, Floats] = {}
    for name in dict.fromkeys(name for column in columns for name in column):
        like = next(column[name] for column in columns if name in column)
        parts = [
            column[name]
            if name in column and column[name].shape[1:] == like.shape[1:]
            else np.full((len(piece.mesh.triangles), *like.shape[1:]), np.nan if like.ndim > 1 else 0.0)
            for column, piece in zip(columns, pieces, strict=True)
        ]
        found[name] = np.concatenate(parts)
    return found


def _joined(pieces: list[Piece]) -> Mesh:
    shifts = np.cumsum([0] + [len(piece.mesh.vertices) for piece in pieces[:-1]])
    return Mesh(
        np.concatenate([piece.mesh.vertices for piece in pieces]),
        np.concatenate([piece.mesh.triangles + shift for piece, shift in zip(pieces, shifts, strict=True)]),
    )


def _check_numbers(mesh: Mesh, path: Path) -> None:
    if mesh.triangles.min() < 0 or mesh.triangles.max() >= len(mesh.vertices):
        raise BaseError(f"Base {path.name} has faces on vertices that are not there: save it anew")
    used = np.unique(mesh.triangles)
    bad = used[~np.isfinite(mesh.vertices[used]).all(axis=1)]
    if len(bad):
        raise BaseError(
            f"Base {path.name} has {len(bad)} of {len(used)} vertices whose coordinates are not numbers "
            f"(NaN or infinite; first: vertex {bad[0]}): repair it where it was made"
        )


# -- out -----------------------------------------------------------------------------------------------------


def write_mesh(path: Path, mesh: Mesh, millimetres: float = 1.0) -> None:
    """The mesh in the format of the path's suffix (one of SUFFIXES); STL is binary.

    Coordinates are written as they are, in the unit of the base; but in a 3MF, which says its unit, in
    millimetres, `millimetres` for each. OSError where the file can't be written.
    """
    if path.suffix.lower() == ".3mf":
        write_3mf(path, Mesh(mesh.vertices * millimetres, mesh.triangles), path.stem)
        return
    body = trimesh.Trimesh(mesh.vertices, mesh.triangles, process=False)
    content: Any = body.export(file_type=path.suffix[1:].lower())
    path.write_bytes(content.encode("utf-8") if isinstance(content, str) else content)


@contextlib.contextmanager
def output_folder(target: Path) -> Iterator[Path]:
    """A working folder beside `target` whose files take their places in `target` only when all went well.

    Whatever goes wrong inside, or while the files take their places, leaves `target` as it was, which may be
    not there at all. Other files in `target` stay. Raises OutputError for a target that can't be written.
    """
    made: list[Path] = []
    work: Path | None = None
    try:
        try:
            if target.exists() and not target.is_dir():
                raise OutputError(f"Output {target} is a file: give a folder")
            made = _make_folders(target.resolve().parent)
            work = Path(tempfile.mkdtemp(prefix=f".{target.name}-", dir=target.resolve().parent))
            yield work
            _move_in(work, target)
            made = []
        except OSError as error:
            raise _in_words(error, target) from None
    finally:
        if work is not None:
            shutil.rmtree(work, ignore_errors=True)
        for folder in reversed(made):
            with contextlib.suppress(OSError):
                folder.rmdir()


@contextlib.contextmanager
def output_file(target: Path) -> Iterator[Path]:
    """A working file beside `target`, with its suffix, that takes its place only when all went well.

    Raises OutputError for a target that can't be written.
    """
    work: Path | None = None
    try:
        if target.is_dir():
            raise OutputError(f"Output {target} is a folder: give a file")
        if not target.parent.is_dir():
            raise OutputError(f"Folder {target.parent} does not exist: choose another one")
        handle, name = tempfile.mkstemp(prefix=f".{target.stem}-", suffix=target.suffix, dir=target.parent)
        os.close(handle)
        work = Path(name)
        yield work
        # a file made for us alone is for all whom the folder lets see
        work.chmod(0o666 & ~_umask())
        work.replace(target)
    except OSError as error:
        raise _in_words(error, target) from None
    finally:
        if work is not None:
            work.unlink(missing_ok=True)


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask


def _make_folders(folder: Path) -> list[Path]:
    """Make the folder and its parents; those that were not there, outermost first."""
    missing = [place for place in (folder, *folder.parents) if not place.exists()][::-1]
    folder.mkdir(parents=True, exist_ok=True)
    return missing


def _move_in(work: Path, target: Path) -> None:
    files = sorted(work.iterdir())
    fresh = not target.exists()
    target.mkdir(exist_ok=True)
    displaced = Path(tempfile.mkdtemp(dir=work))
    done: list[str] = []
    try:
        for file in files:
            if (target / file.name).exists():
                (target / file.name).replace(displaced / file.name)
            done.append(file.name)
            file.replace(target / file.name)
    except OSError:
        for name in done:
            (target / name).unlink(missing_ok=True)
            if (displaced / name).exists():
                (displaced / name).replace(target / name)
        if fresh:
            target.rmdir()
        raise


def _in_words(error: OSError, target: Path) -> OutputError:
    advice = {
        errno.ENOSPC: "free some disk space or give another folder",
        errno.EDQUOT if hasattr(errno, "EDQUOT") else errno.ENOSPC: "free some of your disk quota",
        errno.EACCES: "give a folder you may write to",
        errno.EPERM: "give a folder you may write to",
        errno.EROFS: "give a folder you may write to",
    }.get(error.errno or 0, "give another folder")
    return OutputError(f"Output {target} can't be written ({error.strerror or error}): {advice}")
