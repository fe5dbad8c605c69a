"""Bases in, parts out: what a file places is what we get, and a failed write leaves nothing half-made."""

import errno
import zipfile
from pathlib import Path

import numpy as np
import pytest
import trimesh

from bubble_pattern_addon.core.errors import BaseError, OutputError
from bubble_pattern_addon.core.files import SUFFIXES, load_base, output_folder, write_mesh
from bubble_pattern_addon.core.mesh import Mesh
from bubble_pattern_addon.core.threemf import CORE, write_3mf

from .bases import as_mesh


def body(mesh: Mesh) -> trimesh.Trimesh:
    return trimesh.Trimesh(mesh.vertices, mesh.triangles, process=False)


TORUS = trimesh.creation.torus(major_radius=5, minor_radius=2)


@pytest.mark.parametrize("suffix", [s for s in SUFFIXES if s != ".gltf"])
def test_a_mesh_written_and_read_is_the_same_solid(suffix: str, tmp_path: Path) -> None:
    write_mesh(tmp_path / f"part{suffix}", as_mesh(TORUS))
    mesh = load_base(tmp_path / f"part{suffix}").mesh
    assert len(mesh.vertices) == len(TORUS.vertices)
    assert body(mesh).is_watertight
    assert body(mesh).euler_number == 0
    assert body(mesh).volume == pytest.approx(TORUS.volume, rel=1e-5)
    assert np.allclose(np.sort(mesh.vertices, axis=0), np.sort(TORUS.vertices, axis=0), atol=1e-5)


def test_a_scene_comes_with_everything_where_it_stands(tmp_path: Path) -> None:
    scene = trimesh.Scene()
    box = trimesh.creation.box((1, 2, 3))
    scene.add_geometry(box, transform=trimesh.transformations.translation_matrix((10, 0, 0)))
    scene.add_geometry(box, transform=np.diag([-2.0, 1, 1, 1]))  # mirrored and stretched
    scene.export(tmp_path / "two.glb")
    mesh = load_base(tmp_path / "two.glb").mesh
    assert body(mesh).bounds.tolist() == [[-1, -1, -1.5], [10.5, 1, 1.5]]
    assert body(mesh).volume == pytest.approx(6 + 12)  # the mirrored one is not inside out


OBJ = """mtllib lost.mtl
v 0 0 0
v 1 0 0
v 1 1 0
v 0 1 0
v 0 0 1
vn 0 0 1
usemtl Speaker grille
f 1//1 2//1 3//1 4//1
usemtl Body
f 1 2 5
"""


@pytest.mark.parametrize("newline", ["\n", "\r\n"])
def test_an_obj_keeps_its_materials_without_its_library(newline: str, tmp_path: Path) -> None:
    path = tmp_path / "base.obj"
    path.write_bytes(OBJ.replace("\n", newline).encode())
    base = load_base(path)
    assert set(base.materials) == {"Speaker grille", "Body"}
    grille = base.materials["Speaker grille"]
    assert np.linalg.norm(base.mesh.area_vectors[grille], axis=1).sum() / 2 == pytest.approx(1)  # the quad
    assert (base.mesh.area_vectors[grille][:, 2] > 0).all()
    assert len(base.mesh.vertices) == 5  # welded across the normals' seams


def test_a_ply_keeps_its_face_attributes(tmp_path: Path) -> None:
    wanted = np.arange(len(TORUS.faces)) % 3 == 0
    marked = TORUS.copy()
    marked.face_attributes["bubble_region"] = wanted.astype(np.uint8)
    for encoding in ("ascii", "binary"):
        path = tmp_path / f"{encoding}.ply"
        path.write_bytes(marked.export(file_type="ply", encoding=encoding))
        assert (load_base(path).attributes["bubble_region"] == wanted).all()


MODEL = f"""<?xml version="1.0" encoding="UTF-8"?>
<model unit="millimeter" xmlns="{CORE}"><resources>
<basematerials id="9"><base name="Body" displaycolor="#333333"/>
<base name="Grille" displaycolor="#555555"/></basematerials>
<object id="1" pid="9" pindex="0"><mesh>
<vertices><vertex x="0" y="0" z="0"/><vertex x="1" y="0" z="0"/>
<vertex x="0" y="1" z="0"/><vertex x="0" y="0" z="1"/></vertices>
<triangles><triangle v1="0" v2="2" v3="1"/><triangle v1="0" v2="1" v3="3"/>
<triangle v1="0" v2="3" v3="2"/><triangle v1="1" v2="2" v3="3" pid="9" p1="1"/></triangles></mesh></object>
<object id="2"><components><component objectid="1" transform="2 0 0 0 1 0 0 0 1 5 0 0"/>
<component objectid="1" transform="-1 0 0 0 1 0 0 0 1 0 0 0"/></components></object>
</resources><build><item objectid="2" transform="1 0 0 0 1 0 0 0 1 0 0 7"/></build></model>"""


def zipped(path: Path, model: str) -> Path:
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("3D/3dmodel.model", model)
    return path


def test_a_3mf_gives_components_and_materials(tmp_path: Path) -> None:
    base = load_base(zipped(tmp_path / "base.3mf", MODEL))
    assert body(base.mesh).bounds.tolist() == [[-1, 0, 7], [7, 1, 8]]
    assert body(base.mesh).volume == pytest.approx(1 / 3 + 1 / 6)
    assert base.materials["Grille"].sum() == 2
    assert base.materials["Body"].sum() == 6


def test_a_3mf_reads_in_an_independent_reader(tmp_path: Path) -> None:
    pytest.importorskip("lxml", reason="trimesh reads 3MF with lxml only")
    pytest.importorskip("networkx", reason="trimesh reads 3MF with networkx only")
    write_3mf(tmp_path / "part.3mf", as_mesh(TORUS))
    read = trimesh.load_mesh(tmp_path / "part.3mf")
    assert read.volume == pytest.approx(TORUS.volume)


NAN_OBJ = "v 0 0 0\nv 1 0 0\nv nan 1 0\nf 1 2 3\n"
CIRCLE = MODEL.replace('<component objectid="1"', '<component objectid="2"')
BAD = {
    "missing.stl": (None, "does not exist"),
    "part.step": (b"ISO-10303-21;", "suffix that is not known: save it as STL"),
    "words.stl": (b"this is no mesh at all, only words", "words.stl"),
    "short.stl": (bytes(80) + b"\xff\x00\x00\x00" + bytes(50), "short.stl"),
    "empty.stl": (b"", "empty.stl"),
    "solid.stl": (b"solid nothing\nendsolid nothing\n", "solid.stl"),
    "words.obj": (b"this is no mesh at all", "holds no faces"),
    "points.obj": (b"v 0 0 0\nv 1 0 0\nv 0 1 0\n", "holds no faces"),
    "nan.obj": (NAN_OBJ.encode(), "1 of 3 vertices whose coordinates are not numbers .*first: vertex 2"),
    "words.ply": (b"not a ply", "no PLY mesh"),
    "words.glb": (b"not a glb", "no GLB mesh"),
    "words.3mf": (b"not a zip", "no 3MF mesh"),
}


@pytest.mark.parametrize("name", BAD)
def test_a_file_that_is_no_mesh_is_refused_in_one_line(name: str, tmp_path: Path) -> None:
    content, message = BAD[name]
    if content is not None:
        (tmp_path / name).write_bytes(content)
    with pytest.raises(BaseError, match=message) as caught:
        load_base(tmp_path / name)
    assert "\n" not in str(caught.value)


def test_broken_3mf_models_are_refused(tmp_path: Path) -> None:
    with pytest.raises(BaseError, match="contain one another"):
        load_base(zipped(tmp_path / "circle.3mf", CIRCLE))
    with pytest.raises(BaseError, match="vertices that are not there"):
        load_base(zipped(tmp_path / "index.3mf", MODEL.replace('v1="0"', 'v1="9"')))
    with pytest.raises(BaseError, match="no 3MF mesh"):
        load_base(zipped(tmp_path / "cut.3mf", MODEL[:500]))
    with pytest.raises(BaseError, match="holds no faces"):
        load_base(zipped(tmp_path / "unused.3mf", MODEL.replace('<item objectid="2"', "<item_ ")))
    (tmp_path / "folder.stl").mkdir()
    with pytest.raises(BaseError, match="is a folder"):
        load_base(tmp_path / "folder.stl")


def test_output_takes_its_place_only_when_all_went_well(tmp_path: Path) -> None:
    target = tmp_path / "deep" / "out"
    with output_folder(target) as work:
        (work / "part.stl").write_text("new")
        assert not target.exists()
    assert [p.name for p in target.iterdir()] == ["part.stl"]
    assert [p.name for p in target.parent.iterdir()] == ["out"]
    (target / "notes.txt").write_text("mine")
    with output_folder(target) as work:
        (work / "part.stl").write_text("newer")
    assert (target / "part.stl").read_text() == "newer"
    assert (target / "notes.txt").read_text() == "mine"


def write_and_fail(target: Path, failure: Exception) -> None:
    with output_folder(target) as work:
        (work / "part.stl").write_text("half")
        raise failure


def test_a_failure_inside_leaves_no_trace(tmp_path: Path) -> None:
    target = tmp_path / "a" / "b" / "out"
    with pytest.raises(OutputError, match=r"No space left .*: free some disk space"):
        write_and_fail(target, OSError(errno.ENOSPC, "No space left on device"))
    assert not any(tmp_path.iterdir())
    with pytest.raises(ValueError, match="a bug"):
        write_and_fail(target, ValueError("a bug"))
    assert not any(tmp_path.iterdir())


def write(target: Path, names: str, content: str) -> None:
    with output_folder(target) as work:
        for name in names:
            (work / name).write_text(content)


def test_a_failure_while_moving_restores_what_was_there(tmp_path: Path, monkeypatch) -> None:
    target = tmp_path / "out"
    write(target, "ab", "old")
    replace = Path.replace

    def failing(self: Path, to: Path) -> Path:
        if self.name == "b" and self.read_text() == "new":
            raise PermissionError(errno.EACCES, "Permission denied")
        return replace(self, to)

    monkeypatch.setattr(Path, "replace", failing)
    with pytest.raises(OutputError, match="may write to"):
        write(target, "abc", "new")
    assert {p.name: p.read_text() for p in target.iterdir()} == {"a": "old", "b": "old"}
    assert [p.name for p in tmp_path.iterdir()] == ["out"]


def test_places_that_cannot_be_written(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(OutputError, match="is a file"):
        write(tmp_path / "file", "a", "")
    with pytest.raises(OutputError, match="can't be written"):
        write(tmp_path / "file" / "out", "a", "")
