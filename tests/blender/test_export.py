"""Export: files for other programs, in millimetres by the scene's unit, and in the coordinates of the
world.
"""

from __future__ import annotations

from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest

bpy = pytest.importorskip("bpy", reason="needs the bpy module: python scripts/test.py --blender VERSION")

from bubble_pattern_addon.blender import exporting  # noqa: E402
from bubble_pattern_addon.core.files import load_base  # noqa: E402

from .parts import activate, add_on_top, panel, plate, points  # noqa: E402

export = bpy.ops.bubble_pattern.export
CIRCLE = "{http://www.w3.org/2000/svg}circle"


def a_pattern(size: float = 0.1, thickness: float = 0.01) -> bpy.types.Object:
    """A pattern on the top of a plate, in Object Mode."""
    base = plate(size, thickness)
    pattern = add_on_top(base)
    bpy.ops.object.mode_set(mode='OBJECT')
    activate(base)
    return pattern


@pytest.mark.parametrize("suffix", ["stl", "3mf", "obj", "ply", "glb"])
def test_the_part_in_millimetres(tmp_path: Path, suffix: str) -> None:
    pattern = a_pattern()
    pattern.bubble_pattern.pitch = 0.02
    bpy.ops.bubble_pattern.apply()
    part = pattern.bubble_pattern.part
    part.location = (0.05, 0.0, 0.2)
    path = tmp_path / f"part.{suffix}"
    assert export(filepath=str(path)) == {'FINISHED'}
    assert [*tmp_path.iterdir()] == [path]
    base = load_base(path)
    low, high = base.mesh.vertices.min(axis=0), base.mesh.vertices.max(axis=0)
    if suffix == "glb":  # metres, y up
        assert low == pytest.approx([0.0, 0.195, -0.05], abs=1e-6)
        assert high == pytest.approx([0.1, 0.205, 0.05], abs=1e-6)
    else:
        assert low == pytest.approx([0, -50, 195], abs=1e-3)
        assert high == pytest.approx([100, 50, 205], abs=1e-3)
    if suffix == "3mf":
        assert base.millimetres == 1.0


@pytest.mark.parametrize(
    ("scale", "system"), [(1.0, 'METRIC'), (0.001, 'METRIC'), (1.0, 'NONE'), (0.0254, 'IMPERIAL')]
)
def test_the_hole_table_in_millimetres(tmp_path: Path, scale: float, system: str) -> None:
    bpy.context.scene.unit_settings.system = system
    bpy.context.scene.unit_settings.scale_length = scale
    pattern = a_pattern()
    assert export(filepath=str(tmp_path / "holes.csv")) == {'FINISHED'}
    table = np.genfromtxt(tmp_path / "holes.csv", delimiter=",", names=True)
    factor = 1.0 if system == 'NONE' else 1000 * scale
    assert table["diameter"] == pytest.approx(np.full(len(table), pattern.bubble_pattern.diameter * factor))
    places = np.stack([table[name] for name in ("x", "y", "z")], axis=1)
    assert places == pytest.approx(points(pattern) * factor, abs=1e-4 * factor)


def test_a_part_that_is_turned_and_scaled_is_exported_where_it_is(tmp_path: Path) -> None:
    base = panel()
    base.scale, base.rotation_euler, base.location = (1.0, 1.5, 1.0), (0.3, 0.2, 1.0), (0.1, 0.2, 0.3)
    bpy.context.view_layer.update()
    pattern = add_on_top(base)
    bpy.ops.object.mode_set(mode='OBJECT')
    activate(base)
    export(filepath=str(tmp_path / "holes.csv"))
    table = np.genfromtxt(tmp_path / "holes.csv", delimiter=",", names=True)
    places = np.stack([table[name] for name in ("x", "y", "z")], axis=1)
    assert places == pytest.approx(1000 * points(pattern), abs=1e-2)
    normals = np.stack([table[name] for name in ("nx", "ny", "nz")], axis=1)
    assert normals == pytest.approx(points(pattern, "normal"), abs=1e-5)


def test_drawings_in_millimetres(tmp_path: Path) -> None:
    pattern = a_pattern()
    for name in ("dxf", "svg"):
        assert export(filepath=str(tmp_path / f"a.{name}")) == {'FINISHED'}
    root = ElementTree.parse(tmp_path / "a.svg").getroot()
    circles = [*root.iter(CIRCLE)]
    assert len(circles) == pattern.bubble_pattern.count
    radius = 500 * pattern.bubble_pattern.diameter
    assert [float(circle.attrib["r"]) for circle in circles] == pytest.approx([radius] * len(circles))
    ezdxf = pytest.importorskip("ezdxf", reason="ezdxf reads the drawing back: pip install ezdxf")
    document = ezdxf.readfile(tmp_path / "a.dxf")
    assert not document.audit().has_errors
    assert document.header["$INSUNITS"] == 4
    circles = document.modelspace().query("CIRCLE")
    assert [circle.dxf.radius for circle in circles] == pytest.approx([radius] * len(circles))
    (outline,) = document.modelspace().query('LWPOLYLINE[layer=="BOUNDARY"]')
    assert np.ptp(np.array(outline.get_points("xy")), axis=0) == pytest.approx([100, 100], abs=1e-4)


def test_a_drawing_along_a_direction(tmp_path: Path) -> None:
    pattern = a_pattern()
    path = str(tmp_path / "a.svg")
    assert export(filepath=path, projection='GIVEN', direction=(0.0, 0.0, 2.0), align='ROWS') == {'FINISHED'}
    assert len([*ElementTree.parse(path).getroot().iter(CIRCLE)]) == pattern.bubble_pattern.count
    with pytest.raises(RuntimeError, match="face away"):
        export(filepath=path, projection='GIVEN', direction=(0.0, 0.0, -1.0))
    assert len([*ElementTree.parse(path).getroot().iter(CIRCLE)]) == pattern.bubble_pattern.count


def test_the_recipe(tmp_path: Path) -> None:
    a_pattern()
    export(filepath=str(tmp_path / "a.toml"))
    assert (tmp_path / "a.toml").read_text(encoding="utf-8").startswith("# Recipe of a Bubble Pattern")


def test_a_chosen_format_gives_the_name_its_suffix(tmp_path: Path) -> None:
    a_pattern()
    export(filepath=str(tmp_path / "v1.2"), format='CSV')
    assert [path.name for path in tmp_path.iterdir()] == ["v1.2.csv"]


def test_what_cannot_be_exported_says_why(tmp_path: Path) -> None:
    pattern = a_pattern()
    for name, words in (
        ("a.doc", "no suffix that is known"),
        ("a.stl", "press Apply first"),
        ("none/a.csv", "does not exist"),
    ):
        with pytest.raises(RuntimeError, match=words):
            export(filepath=str(tmp_path / name))
    settings = pattern.bubble_pattern
    settings.live = False
    settings.pitch *= 2
    for name in ("a.csv", "a.dxf"):
        with pytest.raises(RuntimeError, match="press Update first"):
            export(filepath=str(tmp_path / name))
    settings.pitch /= 2
    export(filepath=str(tmp_path / "a.csv"))
    settings.base.data.vertices[0].co.x *= 1.1
    settings.base.data.update()
    with pytest.raises(RuntimeError, match="press Update first"):
        export(filepath=str(tmp_path / "a.csv"))
    assert {path.name for path in tmp_path.iterdir()} == {"a.csv"}


def test_what_there_is_to_know_of_a_drawing_is_told() -> None:
    assert exporting.told(0, 0, 1.0, 1200) == "drawing of 1,200 features"
    said = exporting.told(3, 2, 1.034, 10)
    assert "3 that face away" in said
    assert "2 reach over" in said
    assert "3.4%" in said


def test_the_entry_in_the_menu() -> None:
    entries = bpy.types.TOPBAR_MT_file_export._dyn_ui_initialize()
    assert [entry for entry in entries if getattr(entry, "__name__", "") == "draw_entry"]
