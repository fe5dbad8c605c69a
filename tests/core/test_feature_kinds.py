"""Every kind of feature with every profile, on a flat, a curved and a closed base: watertight, and with the
volume that the formula says.
"""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import manifold3d
import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import trapezoid

from bubble_pattern_addon.core.closed import measure
from bubble_pattern_addon.core.errors import RecipeError
from bubble_pattern_addon.core.facets import joined_faces
from bubble_pattern_addon.core.feature import make_cutters
from bubble_pattern_addon.core.feature_recipe import PROFILES, Feature
from bubble_pattern_addon.core.feature_sizes import feature_sizes
from bubble_pattern_addon.core.heading import axes, square_to
from bubble_pattern_addon.core.loft import make_solids
from bubble_pattern_addon.core.mesh import Floats, Mesh
from bubble_pattern_addon.core.part import Part
from bubble_pattern_addon.core.pattern import Pattern
from bubble_pattern_addon.core.profile import outlines
from bubble_pattern_addon.core.progress import drive
from bubble_pattern_addon.core.section import Extent
from bubble_pattern_addon.core.solid import part_steps
from tests.core.bases import as_mesh, box, hexagons, laid, on_slab, slab

UP = (0.0, 0.0, 1.0)
HOOK = ((-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (0.2, 1.0), (0.2, -0.2), (-1.0, -0.2))
KINDS = {
    "hole": Feature(),
    "blind": Feature(depth=0.5, draft=4.0),
    "countersunk": Feature(rim="chamfer", rim_size=0.1, rim_angle=82.0),
    "filleted": Feature(rim="fillet", rim_size=0.1, depth=0.6),
    "dimple": Feature(kind="dimple", depth=0.3),
    "dome": Feature(kind="bump", height=0.35),
    "cone": Feature(kind="bump", form="cone", height=0.6),
    "boss": Feature(kind="bump", form="boss", height=0.4, draft=5.0),
    "rounded boss": Feature(kind="bump", form="boss", height=0.4, rim="fillet", rim_size=0.12, draft=2.0),
    "chamfered boss": Feature(kind="bump", form="boss", height=0.4, rim="chamfer", rim_size=0.1),
}
OUTLINES = {name: {"profile": name} for name in PROFILES if name not in ("curve", "mesh")} | {
    "curve": {"profile": "curve", "points": HOOK},
    "rounded triangle": {"profile": "polygon", "corners": 3, "rounding": 0.3},
    "rounded cross": {"profile": "cross", "rounding": 1.0},
}


def sphere(radius: float = 9.0) -> tuple[Mesh, Pattern]:
    ball = as_mesh(trimesh.creation.icosphere(3, radius))
    place = ball.corners[[0, 700]].mean(axis=1)
    return ball, laid(place, place, 3.0, 1.8)


def bases() -> dict[str, tuple[Mesh, Pattern]]:
    panel = slab(4, 14.0)
    some = on_slab(panel, 0.7, 4)
    return {
        "flat": (box((-3, -2, -1.5), (3, 2, 0)), laid(hexagons(5, 3, 2.4), UP, 2.4, 1.8)),
        "curved": (panel, replace(some, diameter=np.full(len(some), 1.8))),
        "closed": sphere(),
    }


BASES = bases()


def made(base: Mesh, pattern: Pattern, feature: Feature, stamp: Mesh | None = None) -> Part:
    return drive(part_steps(base, pattern, feature, stamp))


def area_at(feature: Feature, diameter: float, inset: Floats) -> Floats:
    """Area of the profile with all its sides moved inward, by another library's offset."""
    one = np.full(1, diameter)
    aspect = feature_sizes(feature, laid([[0, 0, 0]], UP, 1, diameter)).aspect
    outline = outlines(feature, one, aspect, 96).corners[0]
    section = manifold3d.CrossSection([outline], manifold3d.FillRule.Positive)
    return np.array([section.offset(-float(d), manifold3d.JoinType.Miter, 100.0).area() for d in inset])


@lru_cache
def volume_of(feature: Feature, diameter: float, deep: float) -> float:
    """What the feature takes away, or adds, on a flat surface, from textbook formulas; `deep`: of a hole."""
    whole = float(area_at(feature, diameter, np.zeros(1))[0])
    radius = diameter / 2
    if feature.kind == "dimple" or (feature.form == "dome" and feature.kind == "bump"):
        rise = float(feature.depth or feature.height)
        return whole / (np.pi * radius**2) * np.pi * rise * (3 * radius**2 + rise**2) / 6
    if feature.kind == "bump" and feature.form == "cone":
        return whole * float(feature.height) / 3
    length = deep if feature.kind == "hole" else float(feature.height)
    z = np.linspace(0, length, 41)  # from the rim on
    return float(trapezoid(area_at(feature, diameter, inset_at(feature, z, length)), z))


def inset_at(feature: Feature, z: Floats, length: float) -> Floats:
    """How far the wall has moved inward at the distance z from the rim, drawn with compass and ruler."""
    tangent = np.tan(np.radians(feature.draft))
    rim = feature.rim_size or 0.0
    slope = np.radians(feature.draft)
    if feature.kind == "hole":
        if feature.rim == "chamfer":
            deep = rim / np.tan(np.radians(feature.rim_angle / 2))
            return np.where(z < deep, rim * z / deep, rim + (z - deep) * tangent)
        if feature.rim == "fillet":
            end = rim * (1 - np.sin(slope))
            arc = np.sqrt(np.maximum(rim**2 - (rim - np.minimum(z, end)) ** 2, 0))
            return np.where(z < end, arc, rim * np.cos(slope) + (z - end) * tangent)
        return z * tangent
    wall = (length - z) * tangent
    if feature.rim == "chamfer":
        return wall + np.maximum(rim - z * np.tan(np.radians(feature.rim_angle / 2)), 0)
    if feature.rim == "fillet":
        middle = length * tangent + rim * np.tan(np.pi / 4 - slope / 2)
        arc = middle - np.sqrt(np.maximum(rim**2 - (rim - np.minimum(z, rim)) ** 2, 0))
        return np.where(z < rim * (1 - np.sin(slope)), arc, wall)
    return wall


@pytest.mark.parametrize("base_name", BASES)
@pytest.mark.parametrize("profile", OUTLINES)
@pytest.mark.parametrize("kind", KINDS)
def test_every_kind_with_every_profile_on_every_base(kind, profile, base_name):
    base, pattern = BASES[base_name]
    feature = replace(KINDS[kind], **OUTLINES[profile], sides=36)
    if base_name == "closed" and feature.through:
        feature = replace(feature, depth=0.7)
    part = made(base, pattern, feature)
    assert part.check.problems == ()
    assert part.check.watertight
    assert part.check.unchanged
    through = len(pattern) if feature.through else 0
    assert part.check.through == through
    assert part.check.euler == part.check.base_euler - 2 * through
    deep = round(float(np.mean(part.thickness)), 3) if feature.through else feature.depth
    expected = len(pattern) * volume_of(feature, 1.8, deep) * (-1 if feature.adds else 1)
    assert part.check.removed_volume == pytest.approx(expected, rel=0.02 if base_name == "flat" else 0.12)
    assert_flat_faces(part)


def assert_flat_faces(part: Part) -> None:
    """The facets of walls are flat, so that each can be one face, and as good as all of them are."""
    walls = np.flatnonzero(part.source < 0)
    assert np.array_equal(walls, np.flatnonzero(part.facet >= 0))
    mesh = Mesh(part.mesh.vertices, part.mesh.triangles[walls])
    faces = joined_faces(mesh.triangles, part.facet[walls])
    start = np.cumsum(faces.total) - faces.total
    following = np.arange(1, len(faces.corner) + 1)
    following[start + faces.total - 1] = start
    at = mesh.vertices[faces.corner]
    area = np.add.reduceat(np.cross(at, at[following]) / 2, start)
    # the area inside an outline seen from its front is that of its triangles only where all lie in one plane
    whole = np.linalg.norm(mesh.area_vectors, axis=1).sum() / 2
    assert np.linalg.norm(area, axis=1).sum() == pytest.approx(whole, rel=1e-7)
    # some are in two pieces, where a slanting wall comes out of a rounded surface twice
    assert len(faces.total) < 1.02 * len(np.unique(part.facet[walls])) + 3


@pytest.mark.parametrize("kind", KINDS)
def test_the_walls_carry_their_feature(kind):
    base, pattern = BASES["flat"]
    part = made(base, pattern, KINDS[kind])
    for feature in range(len(pattern)):
        corners = part.mesh.corners[part.source == -1 - feature].reshape(-1, 3) - pattern.position[feature]
        assert np.linalg.norm(corners[:, :2], axis=1).max() == pytest.approx(0.9, rel=1e-12)
    assert part.kind == KINDS[kind].kind


def test_a_bumps_top_and_a_dimples_bottom_are_where_they_should_be():
    base, pattern = BASES["flat"]
    for form in ("dome", "boss", "cone"):
        part = made(base, pattern, Feature(kind="bump", form=form, height=0.37))
        assert part.mesh.vertices[:, 2].max() == pytest.approx(0.37, abs=1e-12)
    part = made(base, pattern, Feature(kind="dimple", depth=0.21))
    lowest = part.mesh.corners[part.source < 0][..., 2].min()
    assert lowest == pytest.approx(-0.21, abs=1e-12)
    ball, on_ball = BASES["closed"]
    part = made(ball, on_ball, Feature(kind="bump", height=0.4))
    tip = np.einsum("vi,ni->vn", part.mesh.vertices, on_ball.normal).max(axis=0)
    assert np.allclose(tip, 0.4 + np.einsum("ni,ni->n", on_ball.position, on_ball.normal), atol=1e-12)


def test_on_a_bent_surface_a_countersink_is_as_wide_as_it_says():
    ball, pattern = BASES["closed"]
    part = made(ball, pattern, Feature(depth=0.8, rim="chamfer", rim_size=0.2, sides=64))
    for feature in range(len(pattern)):
        offset = part.mesh.corners[part.source == -1 - feature].reshape(-1, 3) - pattern.position[feature]
        along = offset @ pattern.normal[feature]
        aside = np.linalg.norm(offset - along[:, None] * pattern.normal[feature], axis=1)
        assert aside.max() == pytest.approx(0.9, rel=2e-3)
        assert aside[along < -0.4].max() == pytest.approx(0.7, rel=1e-9)


def test_a_lofted_plain_hole_is_the_plain_hole():
    pattern = BASES["flat"][1]
    ones = np.ones(len(pattern))
    plain = make_cutters(pattern, Feature(), np.arange(len(pattern)), ones, ones)
    extent = Extent(ones, ones, 0 * ones)
    lofted = make_solids(
        pattern, Feature(), feature_sizes(Feature(), pattern), np.arange(len(pattern)), extent
    )
    key = [np.round(mesh.vertices, 12) + 0.0 for mesh in (plain.mesh, lofted.mesh)]
    assert np.array_equal(*[rows[np.lexsort(rows.T)] for rows in key])
    assert np.allclose(*[measure(mesh).volumes for mesh in (plain.mesh, lofted.mesh)])


@settings(max_examples=25, deadline=None, derandomize=True)
@given(
    kind=st.sampled_from(sorted(KINDS)),
    profile=st.sampled_from(sorted(OUTLINES)),
    diameters=st.lists(st.floats(1.0, 2.0), min_size=1, max_size=5),
    aspect=st.floats(0.4, 1.0),
    top=st.floats(0.5, 2),
    bottom=st.floats(0.7, 1.5),
    level=st.floats(-0.05, 0.05),
    sides=st.sampled_from([None, 12, 17, 40]),
)
def test_solids_are_closed_and_inside_their_circle(
    kind, profile, diameters, aspect, top, bottom, level, sides
):
    feature = replace(KINDS[kind], **OUTLINES[profile], sides=sides)
    if profile in ("ellipse", "slot", "rectangle", "drop"):
        feature = replace(feature, aspect=aspect)
    number = len(diameters)
    place = np.stack([np.arange(number) * 3.0, np.zeros(number), np.zeros(number)], axis=1)
    pattern = laid(place, (1, 2, 3), 3, np.array(diameters))
    one = np.ones(number)
    sizes = feature_sizes(feature, pattern)
    if feature.adds:
        extent = Extent(sizes.height, 0.1 * one, level * one)
    else:
        extent = Extent(top * one, np.nan_to_num(sizes.depth, nan=bottom), level * one)
    cutters = make_solids(pattern, feature, sizes, np.arange(number), extent)
    found = measure(cutters.mesh)
    assert found.closed
    assert found.euler == 2 * number
    assert found.volumes.min() > 0
    owner = cutters.feature[cutters.facet]
    offset = cutters.mesh.corners - pattern.position[owner][:, None]
    along = offset @ pattern.normal[0]
    aside = np.linalg.norm(offset - along[..., None] * pattern.normal[0], axis=2)
    assert (aside <= pattern.diameter[owner][:, None] / 2 * (1 + 1e-9)).all()
    solid = manifold3d.Manifold(
        manifold3d.Mesh64(cutters.mesh.vertices, cutters.mesh.triangles.astype(np.uint64))
    )
    assert solid.status() == manifold3d.Error.NoError
    assert (solid + solid).volume() == pytest.approx(found.volumes.sum(), rel=1e-6)


@pytest.mark.parametrize(
    ("feature", "words"),
    [
        (Feature(draft=40.0), "closes up"),
        (Feature(rim="fillet", rim_size=1.0), "closes up"),
        (Feature(rim="chamfer", rim_size=0.5, rim_angle=30.0), "rim deeper"),
        (Feature(depth=0.3, rim="fillet", rim_size=0.4), "rim deeper"),
        (Feature(kind="bump", form="boss", height=0.2, rim="fillet", rim_size=0.3), "rim deeper"),
        (Feature(kind="dimple", depth=1.0), "half its diameter"),
        (Feature(kind="dimple", depth=1.6), "break through"),
        (Feature(pull=(1, 0, 0), axis=1.0), "faces away"),
        (Feature(pull=(0, 0, -1), axis=1.0), "faces away"),
    ],
)
def test_what_cannot_be_made_is_left_out_and_told(feature, words):
    base, pattern = BASES["flat"]
    axis = axes(pattern.normal, feature)
    part = made(base, replace(pattern, axis=axis, heading=square_to(axis, pattern.tangent)), feature)
    assert len(part.failures) == len(pattern)
    assert words in part.failures[0][1]
    assert part.untouched.all()
    assert part.failures[0][1].startswith(feature.kind.capitalize())


def test_what_is_lost_in_the_bend_of_the_surface_is_told():
    ball = as_mesh(trimesh.creation.icosphere(4, 1.5))
    pattern = laid(ball.corners[:1].mean(axis=1), ball.corners[0].mean(axis=0), 2.0, 1.6)
    part = made(ball, pattern, Feature(kind="dimple", depth=0.1))
    assert "lost in the bend" in part.failures[0][1]


def test_a_bump_keeps_clear_of_what_hangs_over_it():
    plate = box((-3, -2, -1), (3, 2, 0))
    lid = box((-3, -2, 0.5), (3, 2, 1))
    both = Mesh(
        np.concatenate([plate.vertices, lid.vertices]), np.concatenate([plate.triangles, lid.triangles + 8])
    )
    pattern = laid([[0, 0, 0]], UP, 3, 1.8)
    assert made(both, pattern, Feature(kind="bump", height=0.4)).check.good
    assert "what lies over" in made(both, pattern, Feature(kind="bump", height=0.6)).failures[0][1]


def test_a_slanted_axis_follows_the_pull():
    base, pattern = BASES["curved"]
    part = made(
        base, replace(pattern, axis=np.tile(UP, (len(pattern), 1))), Feature(depth=0.6, pull=UP, axis=1.0)
    )
    assert part.check.problems == ()
    assert not part.undercut.any()
    wall = part.mesh.area_vectors[part.source < 0]
    wall /= np.linalg.norm(wall, axis=1)[:, None]
    assert np.minimum(np.abs(wall[:, 2]), np.abs(np.abs(wall[:, 2]) - 1)).max() < 1e-9


def test_undercuts_are_told_where_a_pull_direction_is_given():
    base, pattern = BASES["curved"]
    tilt = np.degrees(np.arccos(pattern.normal[:, 2]))
    assert 3 < tilt.max() < 20
    part = made(base, pattern, Feature(depth=0.6, pull=UP, draft=3.0))
    assert np.array_equal(part.undercut, tilt > 3)
    assert "cannot be drawn off" in part.check.notes[0]
    assert part.check.good
    assert not made(base, pattern, Feature(depth=0.6)).undercut.any()
    assert not made(base, pattern, Feature(kind="dimple", depth=0.3, pull=UP)).undercut.any()
    assert made(base, pattern, Feature(kind="bump", form="boss", height=0.3, pull=(0, 1, 0.2))).undercut.all()


# -- meshes --------------------------------------------------------------------------------------------------

PYRAMID = Mesh(
    np.array([[1, 1, 0], [-1, 1, 0], [-1, -1, 0], [1, -1, 0], [0, 0, 1]], dtype=float) * [2, 1, 1],
    np.array([[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4], [1, 0, 2], [2, 0, 3]]),
)
STAMPED = Feature(kind="bump", profile="mesh", mesh="pyramid")


@pytest.mark.parametrize("base_name", BASES)
def test_a_mesh_stands_on_any_surface(base_name):
    base, pattern = BASES[base_name]
    part = made(base, pattern, replace(STAMPED, height=0.5), PYRAMID)
    assert part.check.problems == ()
    side = 0.9 * 2 / np.sqrt(5)
    expected = 2 * side * side * 0.5 / 3 * len(pattern)
    assert -part.check.removed_volume == pytest.approx(expected, rel=1e-9 if base_name == "flat" else 0.15)


def test_a_mesh_without_a_height_keeps_its_proportions():
    base, pattern = BASES["flat"]
    part = made(base, pattern, STAMPED, PYRAMID)
    assert part.mesh.vertices[:, 2].max() == pytest.approx(0.9 / np.sqrt(5))


def test_a_ring_and_two_pieces_count_as_what_they_are():
    base, pattern = BASES["flat"]
    ring = as_mesh(trimesh.creation.annulus(0.5, 1.0, 2.0, sections=16))
    upright = Mesh(ring.vertices[:, [0, 2, 1]] * [1, 0.2, -1], ring.triangles)
    part = made(base, pattern, STAMPED, upright)
    assert part.check.problems == ()
    assert part.check.euler == part.check.base_euler - 2 * len(pattern)
    two = Mesh(
        np.concatenate([PYRAMID.vertices * 0.3 - [1, 0, 0], PYRAMID.vertices * 0.3 + [1, 0, 0]]),
        np.concatenate([PYRAMID.triangles, PYRAMID.triangles + 5]),
    )
    part = made(base, pattern, STAMPED, two)
    assert part.check.problems == ()
    assert part.check.euler == part.check.base_euler


def test_a_mesh_may_go_through_or_not():
    base, pattern = BASES["flat"]
    drill = Mesh(PYRAMID.vertices * [1, 1, -1], PYRAMID.triangles[:, ::-1].copy())
    feature = replace(STAMPED, kind="hole")
    part = made(base, pattern, replace(feature, depth=1.0), drill)
    assert part.check.problems == ()
    assert part.check.through == 0
    part = made(base, pattern, replace(feature, depth=2.5), drill)
    assert part.check.problems == ()
    assert part.check.through == len(pattern)


@pytest.mark.parametrize(
    ("mesh", "words"),
    [
        (Mesh(PYRAMID.vertices, PYRAMID.triangles[:-1]), "not a closed mesh"),
        (Mesh(PYRAMID.vertices, PYRAMID.triangles[:, ::-1].copy()), "not a closed mesh"),
        (Mesh(PYRAMID.vertices - [0, 0, 2], PYRAMID.triangles), "nothing above"),
        (Mesh(PYRAMID.vertices + [0, 0, 2], PYRAMID.triangles), "does not cross"),
    ],
)
def test_a_mesh_that_is_no_feature_is_refused(mesh, words):
    with pytest.raises(RecipeError, match=words):
        made(*BASES["flat"], STAMPED, mesh)


def test_a_mesh_must_be_there():
    with pytest.raises(RecipeError):
        made(*BASES["flat"], STAMPED)
