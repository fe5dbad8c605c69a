"""Drawings: what is drawn is what is there, in millimetres, and other libraries read it so."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
import trimesh

from bubble_pattern_addon.core.drawing import Drawing, Shapes, make_drawing, view_axes
from bubble_pattern_addon.core.drawing_files import drawing_report, write_drawing
from bubble_pattern_addon.core.drawn_shapes import drawn_shapes
from bubble_pattern_addon.core.errors import RegionError
from bubble_pattern_addon.core.feature_recipe import Feature
from bubble_pattern_addon.core.keep_out import region_with_keep_outs
from bubble_pattern_addon.core.mesh import Floats, Mesh
from bubble_pattern_addon.core.metric import Constant
from bubble_pattern_addon.core.pattern import Pattern
from bubble_pattern_addon.core.pipeline import pattern_steps
from bubble_pattern_addon.core.progress import drive
from bubble_pattern_addon.core.recipe import KeepOut, Packing, Recipe, Shaping
from bubble_pattern_addon.core.region import Region, make_region

from .bases import as_mesh, slab
from .patterns import spread

SVG = "{http://www.w3.org/2000/svg}"
WANTED = "this Python has no ezdxf, which reads the drawings back: pip install ezdxf"


def packed(region: Region, pitch: float, diameter: float) -> Pattern:
    recipe = Recipe(packing=Packing(pitch=Constant(pitch)), shaping=Shaping(diameter=Constant(diameter)))
    return drive(pattern_steps(region, recipe))


@pytest.fixture(scope="module")
def plate() -> tuple[Region, Pattern]:
    """A plate with a round island, tilted in space."""
    body = trimesh.creation.annulus(6, 15, 2, sections=64)
    chosen = body.face_normals[:, 2] > 0.5
    body.apply_transform(trimesh.transformations.rotation_matrix(0.7, [1, 0, 0], [3, 2, 1]))
    region = make_region(as_mesh(body), chosen)
    return region, packed(region, 2.4, 1.5)


@pytest.fixture(scope="module")
def dome() -> tuple[Region, Pattern]:
    """The top of a panel curved both ways."""
    mesh = slab()
    region = make_region(mesh, np.arange(len(mesh.triangles)) < 288)
    return region, packed(region, 2.0, 1.2)


def sides_of(points: Floats) -> tuple[Floats, Floats]:
    return points, np.roll(points, -1, axis=0)


def clearance(drawing: Drawing) -> Floats:
    """Distance of every centre from the boundary, negative outside."""
    nearest = np.full(len(drawing.centre), np.inf)
    crossings = np.zeros(len(drawing.centre), dtype=int)
    for line in drawing.boundary:
        assert line.closed
        start, end = sides_of(line.points)
        along = end - start
        offset = drawing.centre[:, None] - start
        share = np.clip((offset * along).sum(2) / (along**2).sum(1), 0, 1)
        nearest = np.minimum(nearest, np.linalg.norm(offset - share[..., None] * along, axis=2).min(1))
        y = drawing.centre[:, None, 1]
        over = (start[:, 1] > y) != (end[:, 1] > y)
        with np.errstate(all="ignore"):
            x = start[:, 0] + (y - start[:, 1]) / along[:, 1] * along[:, 0]
        crossings += (over & (drawing.centre[:, None, 0] < x)).sum(1)
    return np.where(crossings % 2, nearest, -nearest)


@pytest.mark.parametrize("projection", ["flat", "normal"])
@pytest.mark.parametrize("align", ["base", "rows"])
def test_a_flat_region_is_drawn_as_it_is(plate: tuple[Region, Pattern], projection: str, align: str) -> None:
    region, pattern = plate
    drawing = make_drawing(region, pattern, projection, align, 10.0)
    assert np.array_equal(drawing.ids, pattern.ids)
    assert drawing.diameter == pytest.approx(pattern.diameter * 10)
    assert drawing.ratio == pytest.approx(1)
    was = np.linalg.norm(pattern.position[:, None] - pattern.position[None], axis=2)
    is_ = np.linalg.norm(drawing.centre[:, None] - drawing.centre[None], axis=2)
    assert is_ == pytest.approx(10 * was, abs=1e-6)
    assert len(drawing.boundary) == 2
    assert (clearance(drawing) - drawing.diameter / 2).min() > 3  # (2.4 - 1.5) / 2 all along, less the chords
    assert (drawing.hidden, drawing.across, drawing.cuts) == (0, 0, ())


def test_seen_from_outside_nothing_is_mirrored(plate: tuple[Region, Pattern]) -> None:
    region, pattern = plate
    for projection in ("flat", "normal"):
        centre = make_drawing(region, pattern, projection).centre
        one, two = pattern.position[1:] - pattern.position[0], centre[1:] - centre[0]
        was = np.einsum("nc,c->n", np.cross(one[:-1], one[1:]), pattern.normal[0])
        assert was == pytest.approx(two[:-1, 0] * two[1:, 1] - two[:-1, 1] * two[1:, 0], abs=1e-6)


@pytest.mark.parametrize(
    ("sight", "right", "up"),
    [
        ((0, 0, 1), (1, 0, 0), (0, 1, 0)),
        ((0, 0, -1), (-1, 0, 0), (0, 1, 0)),
        ((0, -1, 0), (1, 0, 0), (0, 0, 1)),
        ((0, 1, 0), (-1, 0, 0), (0, 0, 1)),
        ((1, 0, 0), (0, 1, 0), (0, 0, 1)),
        ((0, -2, 0), (1, 0, 0), (0, 0, 1)),
    ],
)
def test_views_are_upright(sight: tuple, right: tuple, up: tuple) -> None:
    found = view_axes(np.array(sight, dtype=float))
    assert found[0] == pytest.approx(right)
    assert found[1] == pytest.approx(up)


def test_rows_run_along_the_paper(plate: tuple[Region, Pattern]) -> None:
    region, pattern = plate
    for projection in ("flat", "normal"):
        drawing = make_drawing(region, pattern, projection, "rows")
        pairs = drawing.centre[:, None] - drawing.centre[None]
        near = (np.linalg.norm(pairs, axis=2) < 1.2 * 2.4) & ~np.eye(len(pattern), dtype=bool)
        six = ((pairs[near] @ [1, 1j]) / np.linalg.norm(pairs[near], axis=1)) ** 6
        assert abs(np.angle(six.sum())) < 0.3


def test_laid_flat_a_dome_keeps_sizes_and_margins(dome: tuple[Region, Pattern]) -> None:
    region, pattern = dome
    drawing = make_drawing(region, pattern)
    assert 1.001 < drawing.stretch < 1.05
    assert np.array_equal(drawing.diameter, pattern.diameter)
    assert (drawing.ratio == 1).all()
    assert (clearance(drawing) > drawing.diameter / 2).all()
    assert drawing.extent[0] == pytest.approx([0, 0], abs=1e-9)
    assert drawing_report(drawing)["drawing"]["stretch"] == drawing.stretch


def test_projected_leaning_circles_are_ellipses(dome: tuple[Region, Pattern]) -> None:
    region, pattern = dome
    sight = np.array([0.3, 0.2, 1.0])
    drawing = make_drawing(region, pattern, (0.3, 0.2, 1.0))
    cosine = pattern.normal @ (sight / np.linalg.norm(sight))
    assert drawing.ratio == pytest.approx(cosine)
    assert np.isnan(drawing.stretch)
    assert drawing_report(drawing)["drawing"]["stretch"] is None
    # the long axis is square to where the axis of the feature leans
    right, up, _ = view_axes(sight)
    leaning = np.stack([pattern.normal @ right, pattern.normal @ up], axis=1)
    assert np.einsum("nc,nc->n", leaning, drawing.major) == pytest.approx(0, abs=1e-9)
    assert (clearance(drawing) > 0).all()


def test_features_that_face_away_are_counted_and_left_out() -> None:
    body = trimesh.creation.icosphere(3, 10)
    region = make_region(as_mesh(body), np.ones(len(body.faces), dtype=bool))
    pattern = spread(region, 200, size=0.1)
    drawing = make_drawing(region, pattern, (1.0, 0.0, 0.0))
    facing = pattern.normal[:, 0] > 1e-6
    assert drawing.hidden == (~facing).sum() > 50
    assert np.array_equal(drawing.ids, np.flatnonzero(facing))
    with pytest.raises(RegionError, match="faces all ways"):
        make_drawing(region, pattern, "normal")


def test_nothing_to_be_seen_is_refused(plate: tuple[Region, Pattern]) -> None:
    region, pattern = plate
    away = -pattern.normal[0]
    with pytest.raises(RegionError, match="face away"):
        make_drawing(region, pattern, (away[0], away[1], away[2]))


def test_features_over_a_cut_are_counted() -> None:
    body = trimesh.creation.cylinder(10, 40, sections=48)
    region = make_region(as_mesh(body), np.abs(body.face_normals[:, 2]) < 0.5)
    pattern = packed(region, 4.0, 2.4)
    drawing = make_drawing(region, pattern)
    assert len(drawing.cuts) == 2
    assert all(not line.closed for line in (*drawing.cuts, *drawing.boundary))
    middle, normal = _cut_in_space(region)
    away = np.abs((pattern.position - middle) @ normal)
    behind = (pattern.position - middle) @ np.cross(normal, [0, 0, 1])
    over = (away < 1.2) & (np.abs(behind) < 5)
    assert abs(drawing.across - int(over.sum())) <= 2
    assert drawing.across > 3


def _cut_in_space(region: Region) -> tuple[Floats, Floats]:
    """A point of the cut of an upright tube, and the direction along the tube's round there."""
    from bubble_pattern_addon.core.flattening import flatten

    row, corner = np.argwhere(flatten(region).cuts)[0]
    ends = region.corners[row, [(corner + 1) % 3, (corner + 2) % 3]]
    middle = ends.mean(axis=0)
    return middle, np.cross([0, 0, 1], middle / np.linalg.norm(middle[:2]))


def test_borders_of_sub_regions_are_drawn_and_do_not_cut_the_sheet() -> None:
    mesh = slab()
    top = np.arange(len(mesh.triangles)) < 288
    parts = (mesh.corners[:, :, 0].mean(axis=1) > 0).astype(np.int64)
    region = make_region(mesh, top, parts, 0.5)
    whole = make_region(mesh, top)
    pattern = spread(region, 30)
    drawing, plain = make_drawing(region, pattern), make_drawing(whole, pattern)
    assert drawing.centre == pytest.approx(plain.centre)
    assert len(drawing.boundary) == 2
    assert not drawing.cuts


def square(n: int, size: float = 1.0) -> Floats:
    return np.broadcast_to(size / 2 * np.array([[1, 1], [-1, 1], [-1, -1], [1, -1.0]]), (n, 4, 2))


@pytest.mark.parametrize("projection", ["flat", "normal"])
def test_other_profiles_keep_their_shape_and_heading(plate: tuple[Region, Pattern], projection: str) -> None:
    region, pattern = plate
    shapes = Shapes(pattern.normal, pattern.tangent, square(len(pattern)))
    drawing = make_drawing(region, pattern, projection, millimetres=2.0, shapes=shapes)
    assert drawing.outlines is not None
    sides = np.linalg.norm(drawing.outlines - np.roll(drawing.outlines, 1, axis=1), axis=2)
    assert sides == pytest.approx(2.0)
    assert drawing.outlines.mean(axis=1) == pytest.approx(drawing.centre)
    # the first corner is at heading + axis x heading
    across = np.cross(pattern.normal, pattern.tangent)
    corner = pattern.position + (pattern.tangent + across) / 2
    away = np.linalg.norm(corner[:, None] - pattern.position[None], axis=2)
    drawn = np.linalg.norm(drawing.outlines[:, :1] - drawing.centre[None], axis=2)
    assert drawn == pytest.approx(2 * away, abs=1e-6)


# -- files ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("projection", ["flat", "normal", (0.3, 0.2, 1.0)])
def test_another_library_reads_the_same_circles_from_dxf(
    tmp_path: Path, dome: tuple[Region, Pattern], projection: str
) -> None:
    ezdxf = pytest.importorskip("ezdxf", reason=WANTED)
    region, pattern = dome
    drawing = make_drawing(region, pattern, projection, millimetres=25.4)
    write_drawing(tmp_path / "a.dxf", drawing)
    document = ezdxf.readfile(tmp_path / "a.dxf")  # the strict reader, which mends nothing
    audit = document.audit()
    assert not audit.has_errors
    assert not audit.has_fixes
    assert document.dxfversion == "AC1015"
    assert document.header["$INSUNITS"] == 4
    assert {"FEATURES", "BOUNDARY", "CENTERS"} <= {layer.dxf.name for layer in document.layers}
    space = document.modelspace()
    features = [*space.query('*[layer=="FEATURES"]')]
    assert len(features) == len(pattern)
    if projection == "flat":
        assert {entity.dxftype() for entity in features} == {"CIRCLE"}
        assert [2 * entity.dxf.radius for entity in features] == pytest.approx(pattern.diameter * 25.4)
    else:
        ellipses = [entity for entity in features if entity.dxftype() == "ELLIPSE"]
        leaning = drawing.ratio[drawing.ratio < 1 - 1e-9]
        assert [entity.dxf.ratio for entity in ellipses] == pytest.approx(leaning)
        long = np.array([entity.dxf.major_axis.magnitude for entity in ellipses])
        assert long == pytest.approx(np.full(len(long), pattern.diameter[0] * 25.4 / 2))
        assert {(entity.dxf.start_param, round(entity.dxf.end_param, 12)) for entity in ellipses} == {
            (0.0, round(2 * np.pi, 12))
        }
    centres = np.array([list(entity.dxf.center)[:2] for entity in features])
    assert centres == pytest.approx(drawing.centre, abs=1e-8)
    (line,) = space.query('LWPOLYLINE[layer=="BOUNDARY"]')
    assert line.closed
    assert np.array(line.get_points("xy")) == pytest.approx(drawing.boundary[0].points, abs=1e-8)
    assert len(space.query('LINE[layer=="CENTERS"]')) == 2 * len(pattern)
    _, high = drawing.extent
    assert list(document.header["$EXTMAX"])[:2] == pytest.approx(high)
    handles = [entity.dxf.handle for entity in document.entitydb.values()]
    assert int(document.header["$HANDSEED"], 16) > max(int(handle, 16) for handle in handles[: len(pattern)])


def test_dxf_of_other_profiles_is_closed_polylines(tmp_path: Path, plate: tuple[Region, Pattern]) -> None:
    ezdxf = pytest.importorskip("ezdxf", reason=WANTED)
    region, pattern = plate
    shapes = Shapes(pattern.normal, pattern.tangent, square(len(pattern)))
    drawing = make_drawing(region, pattern, shapes=shapes)
    write_drawing(tmp_path / "a.dxf", drawing)
    space = ezdxf.readfile(tmp_path / "a.dxf").modelspace()
    lines = space.query('LWPOLYLINE[layer=="FEATURES"]')
    assert len(lines) == len(pattern)
    assert all(line.closed and len(line) == 4 for line in lines)
    assert not space.query("CIRCLE")


def test_dxf_of_a_tube_has_its_cut_on_a_layer(tmp_path: Path) -> None:
    ezdxf = pytest.importorskip("ezdxf", reason=WANTED)
    body = trimesh.creation.cylinder(10, 40, sections=48)
    region = make_region(as_mesh(body), np.abs(body.face_normals[:, 2]) < 0.5)
    write_drawing(tmp_path / "a.dxf", make_drawing(region, spread(region, 9)))
    space = ezdxf.readfile(tmp_path / "a.dxf").modelspace()
    cuts = space.query('LWPOLYLINE[layer=="CUTS"]')
    assert len(cuts) == 2
    around = [np.linalg.norm(np.diff(line.get_points("xy"), axis=0), axis=1).sum() for line in cuts]
    assert around == pytest.approx([40, 40], rel=0.01)


def test_svg_is_in_millimetres_with_a_group_per_layer(tmp_path: Path, plate: tuple[Region, Pattern]) -> None:
    region, pattern = plate
    drawing = make_drawing(region, pattern, millimetres=10.0)
    write_drawing(tmp_path / "a.svg", drawing)
    root = ElementTree.parse(tmp_path / "a.svg").getroot()
    left, top, width, tall = (float(value) for value in root.attrib["viewBox"].split())
    assert root.attrib["width"] == f"{width:g}mm"
    assert root.attrib["height"] == f"{tall:g}mm"
    low, high = drawing.extent
    assert (high - low) == pytest.approx([300, 300], rel=0.01)
    assert left < low[0]
    assert left + width > high[0]
    assert top < -high[1]
    assert top + tall > -low[1]
    groups = {group.attrib["id"]: group for group in root}
    assert set(groups) == {"boundary", "features", "centers"}
    circles = groups["features"].findall(f"{SVG}circle")
    assert len(circles) == len(pattern)
    assert [2 * float(circle.attrib["r"]) for circle in circles] == pytest.approx(10 * pattern.diameter)
    centres = np.array([[float(c.attrib["cx"]), -float(c.attrib["cy"])] for c in circles])
    assert centres == pytest.approx(drawing.centre, abs=1e-6)
    assert [c.attrib["id"] for c in circles] == [f"feature-{number}" for number in pattern.ids]
    paths = [path.attrib["d"] for path in groups["boundary"]]
    assert all(path.startswith("M") and path.endswith("Z") for path in paths)
    for path, line in zip(paths, drawing.boundary, strict=True):
        numbers = np.array(re.findall(r"-?[\d.]+", path), dtype=float).reshape(-1, 2)
        assert numbers * [1, -1] == pytest.approx(line.points, abs=1e-6)


def test_svg_turns_ellipses_as_they_lean(tmp_path: Path, dome: tuple[Region, Pattern]) -> None:
    region, pattern = dome
    drawing = make_drawing(region, pattern, (0.3, 0.2, 1.0))
    write_drawing(tmp_path / "a.svg", drawing)
    ellipses = [*ElementTree.parse(tmp_path / "a.svg").getroot().iter(f"{SVG}ellipse")]
    assert len(ellipses) > 0.9 * len(pattern)
    by_id = {int(e.attrib["id"].split("-")[1]): e.attrib for e in ellipses}
    for number, major, ratio in zip(drawing.ids.tolist(), drawing.major, drawing.ratio, strict=True):
        if number in by_id:
            angle = np.radians(float(by_id[number]["transform"][7:].split()[0]))
            assert abs(np.cos(angle) * major[1] + np.sin(angle) * major[0]) < 1e-6
            share = float(by_id[number]["ry"]) / float(by_id[number]["rx"])
            assert share == pytest.approx(ratio, abs=1e-5)


def test_the_same_drawing_gives_the_same_bytes(tmp_path: Path, dome: tuple[Region, Pattern]) -> None:
    for name in ("dxf", "svg"):
        for count in (1, 2):
            write_drawing(tmp_path / f"{count}.{name}", make_drawing(*dome))
        assert (tmp_path / f"1.{name}").read_bytes() == (tmp_path / f"2.{name}").read_bytes()


def test_the_places_of_features_do_not_depend_on_where_the_part_is(dome: tuple[Region, Pattern]) -> None:
    region, pattern = dome
    shift = np.array([100.0, -50.0, 7.0])
    meshes = (Mesh(mesh.vertices + shift, mesh.triangles) for mesh in (region.base, region.mesh))
    there = replace(region, **dict(zip(("base", "mesh"), meshes, strict=True)))
    places = replace(pattern.places, position=pattern.position + shift)
    one, two = make_drawing(region, pattern), make_drawing(there, replace(pattern, places=places))
    assert one.centre == pytest.approx(two.centre, abs=1e-6)


@pytest.mark.parametrize(
    "feature",
    [
        Feature(profile="slot", aspect=0.3),
        Feature(profile="cross", rounding=0.5, turn="fixed", turn_direction=(1.0, 0.0, 0.0), angle=20.0),
        Feature(kind="bump", form="boss", profile="polygon", corners=5, draft=10.0),
    ],
)
def test_profiles_are_drawn_as_they_are_cut(plate: tuple[Region, Pattern], feature: Feature) -> None:
    region, _ = plate
    recipe = Recipe(
        packing=Packing(pitch=Constant(2.4)), shaping=Shaping(diameter=Constant(1.5)), feature=feature
    )
    pattern = drive(pattern_steps(region, recipe))
    shapes = drawn_shapes(pattern, feature)
    drawing = make_drawing(region, pattern, shapes=shapes)
    assert drawing.outlines is not None
    # no outline leaves its circle, and each touches it
    reach = np.linalg.norm(drawing.outlines - drawing.centre[:, None], axis=2)
    assert reach.max(axis=1) == pytest.approx(np.full(len(pattern), 0.75))
    # it heads where the feature does: the same as seen along the normal of this flat region
    seen = make_drawing(region, pattern, "normal", shapes=shapes)
    was, is_ = (one.outlines.reshape(-1, 2) @ [1, 1j] for one in (seen, drawing))
    motion = np.polyfit(was, is_, 1)  # a rotation and a shift take one drawing to the other
    assert abs(motion[0]) == pytest.approx(1)
    assert np.abs(np.polyval(motion, was) - is_).max() < 1e-6


def test_a_circle_or_a_mesh_is_drawn_as_a_circle(plate: tuple[Region, Pattern]) -> None:
    _, pattern = plate
    for feature in (Feature(), Feature(rim="chamfer"), Feature(profile="mesh", mesh="star")):
        assert drawn_shapes(pattern, feature).outlines is None


def test_an_axis_other_than_the_normal_decides_how_a_circle_is_seen(dome: tuple[Region, Pattern]) -> None:
    region, _ = dome
    feature = Feature(axis=1.0, pull=(0.0, 0.0, 1.0))
    recipe = Recipe(
        packing=Packing(pitch=Constant(2.0)), shaping=Shaping(diameter=Constant(1.2)), feature=feature
    )
    pattern = drive(pattern_steps(region, recipe))
    drawing = make_drawing(region, pattern, (0.0, 0.0, 1.0), shapes=drawn_shapes(pattern, feature))
    assert drawing.ratio == pytest.approx(1)


def test_what_is_kept_out_is_a_hole_in_the_drawing() -> None:
    mesh = slab()
    top = np.arange(len(mesh.triangles)) < 288
    keep_out = KeepOut(cylinder=(3.0, 2.0, 4.0), diameter=6.0)
    region = region_with_keep_outs(mesh, top, None, 0.0, (keep_out,), {}, {})
    pattern = packed(region, 2.0, 1.2)
    drawing = make_drawing(region, pattern)
    assert len(drawing.boundary) == 2
    assert not drawing.cuts
    assert (clearance(drawing) > drawing.diameter / 2).all()
    assert drawing.stretch < 1.06
