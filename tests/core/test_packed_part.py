"""Step 3 on what step 1 packs: the laws of a part hold for real patterns on slab-like bases and a housing."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from bubble_pattern_addon.core.fields import Linear, Radial
from bubble_pattern_addon.core.files import load_base
from bubble_pattern_addon.core.mesh import Mesh
from bubble_pattern_addon.core.metric import Constant, Described
from bubble_pattern_addon.core.part import Part
from bubble_pattern_addon.core.pattern import Pattern
from bubble_pattern_addon.core.pipeline import pattern_steps
from bubble_pattern_addon.core.progress import drive
from bubble_pattern_addon.core.quality import min_margin, min_web
from bubble_pattern_addon.core.recipe import Feature, Packing, Recipe, Shaping
from bubble_pattern_addon.core.region import make_region
from bubble_pattern_addon.core.solid import part_steps
from bubble_pattern_addon.core.surroundings import Surroundings
from scripts.shapes import Shape, curved_slab, plate, thin_wall, trapezoid_slab
from tests.core.bases import polygon_area

HOLE = Feature(kind="hole", sides=24)
HOUSING = Path(__file__).resolve().parents[3] / "shared" / "data" / "LCD-cover-ORIGINAL-MK3.stl"


def packed(shape: Shape) -> Pattern:
    recipe = replace(
        Recipe(),
        packing=Packing(pitch=Constant(shape.pitch)),
        shaping=Shaping(diameter=Constant(0.6 * shape.pitch)),
    )
    return drive(pattern_steps(make_region(shape.mesh, shape.selected), recipe))


def one_side(shape: Shape) -> Shape:
    """The upper faces only."""
    up = shape.mesh.area_vectors[:, 2] > 0
    return replace(shape, selected=shape.selected & up)


def assert_laws(part: Part) -> None:
    """What the check says is so; closedness and Euler characteristic are counted once more, another way."""
    check = part.check
    sides = np.sort(part.mesh.triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    edges, faces = np.unique(sides, axis=0, return_counts=True)
    assert (faces == 2).all()
    assert check.euler == len(np.unique(part.mesh.triangles)) - len(edges) + len(part.mesh.triangles)
    assert check.watertight
    assert check.unchanged
    assert check.base_euler - check.euler == 2 * check.through
    assert check.bodies == check.base_bodies
    assert check.through + len(part.failures) == len(part.pierced)


GRADED_PITCH = Linear(from_=4.0, to=9.0, direction=(1.0, 0.0, 0.0))
GRADED_SIZE = Radial(from_=1.6, to=3.2, centre=(0.0, 0.0, 0.0), radius=30.0)


@pytest.mark.parametrize("pitch", [Constant(6.0), GRADED_PITCH], ids=["uniform packing", "graded packing"])
@pytest.mark.parametrize("diameter", [Constant(2.4), GRADED_SIZE], ids=["uniform sizes", "graded sizes"])
def test_table_1_of_the_paper_from_the_recipe_to_a_watertight_part(
    pitch: Described, diameter: Described
) -> None:
    """Regular and graded packing and sizes go together as they please (paper, Table 1)."""
    shape = plate(60.0, 40.0, 3.0, 6.0)
    recipe = replace(Recipe(), packing=Packing(pitch=pitch), shaping=Shaping(diameter=diameter))
    region = make_region(shape.mesh, shape.selected)
    pattern = drive(pattern_steps(region, recipe))
    # both are what was asked for, wherever the features are
    there = Surroundings(region=region)
    assert pattern.pitch == pytest.approx(pitch.bind(there)(pattern.places))
    assert pattern.diameter == pytest.approx(diameter.bind(there)(pattern.places))
    assert (np.ptp(pattern.pitch) > 3.0) == (pitch is GRADED_PITCH)
    assert (np.ptp(pattern.diameter) > 0.9) == (diameter is GRADED_SIZE)
    assert min_web(pattern) > 0.5
    assert min_margin(pattern, region) > 0.0
    part = drive(part_steps(shape.mesh, pattern, HOLE))
    assert_laws(part)
    assert part.check.through == len(pattern) > 50
    assert not part.check.problems
    drilled = sum(polygon_area(float(size), HOLE.sides) for size in pattern.diameter) * 3.0
    assert part.check.removed_volume == pytest.approx(drilled, rel=1e-6)


@pytest.mark.parametrize(
    ("shape", "thickness", "handles"),
    [
        (replace(curved_slab(), pitch=18.0), None, 0),
        (replace(curved_slab(8), pitch=18.0), None, 0),
        (trapezoid_slab(9.0), 3.0, 1),
        (plate(300.0, 300.0, 3.0, 16.0), 3.0, 0),
        (one_side(thin_wall()), 0.6, 0),
    ],
    ids=["curved", "curved-coarse", "trapezoid", "plate", "thin-wall"],
)
def test_every_packed_hole_goes_through_a_slab(shape, thickness, handles):
    pattern = packed(shape)
    part = drive(part_steps(shape.mesh, pattern, Feature(sides=32)))
    assert len(pattern) > 50
    assert part.check.problems == ()
    assert part.pierced.all()
    assert_laws(part)
    assert part.check.euler == 2 - 2 * handles - 2 * len(pattern)
    if thickness is not None:
        assert np.allclose(part.thickness, thickness)
        removed = len(pattern) * polygon_area(0.6 * shape.pitch, 32) * thickness
        assert part.check.removed_volume == pytest.approx(removed, rel=1e-6)


def test_holes_from_both_sides_of_a_wall_are_told_that_they_meet():
    shape = thin_wall()
    part = drive(part_steps(shape.mesh, packed(shape), Feature()))
    assert_laws(part)
    assert all("another hole" in text for _, text in part.failures)
    assert part.failures


@pytest.mark.skipif(not HOUSING.exists(), reason="the parts to try it on are not there")
def test_packed_vents_in_a_real_housing():
    base: Mesh = load_base(HOUSING).mesh
    plane = base.area_vectors
    area = np.linalg.norm(plane, axis=1)
    largest = int(area.argmax())
    normal = plane[largest] / area[largest]
    height = base.corners @ normal - base.corners[largest, 0] @ normal
    level = (np.abs(height).max(axis=1) < 1e-3) & (plane @ normal > 0.999 * area)
    pattern = packed(Shape(base, level & (area > 0), 4.0))
    part = drive(part_steps(base, pattern, Feature()))
    assert_laws(part)
    # behind some places a screw post or a rib leaves no gap to end in
    assert part.pierced.mean() > 0.9
    assert all("wall behind" in text for _, text in part.failures)
