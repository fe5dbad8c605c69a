"""Every kind of field against its formula, at places all over a region."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bubble_pattern_addon.core.blending import Blend, FaceSet, Fill, Least, Most, Product, SubRegions
from bubble_pattern_addon.core.errors import FieldError, RecipeError
from bubble_pattern_addon.core.falloff import FALLOFFS
from bubble_pattern_addon.core.fields import Distance, Edge, Linear, Radial, outer_loops
from bubble_pattern_addon.core.mesh import Floats, Mesh
from bubble_pattern_addon.core.metric import Constant, Described, Places
from bubble_pattern_addon.core.painted import LIGHT, Attribute, Image, bilinear
from bubble_pattern_addon.core.region import Region, make_region
from bubble_pattern_addon.core.surroundings import NOTHING, Surroundings, Thing
from scripts import shapes

ISLAND, HOLE = (20.0, 5.0), 15.0


def whole(sheet: Mesh) -> Region:
    return make_region(sheet, np.ones(len(sheet.triangles), bool))


PLATE = whole(shapes.fine_sheet(shapes.trapezoid_outline(), 4.0))
PANEL = whole(shapes.panel_sheet(20))
SPHERE = whole(shapes.sphere_sheet(10.0, 2))


def scattered(region: Region, count: int = 400, seed: int = 0) -> Places:
    """Places all over the region, none on a vertex."""
    chance = np.random.default_rng(seed)
    row = chance.integers(0, len(region.triangles), count)
    barycentric = chance.dirichlet([1.0, 1.0, 1.0], count)
    position = np.einsum("nk,nkc->nc", barycentric, region.corners[row])
    return Places(position, region.triangles[row], barycentric)


HERE = scattered(PLATE)


def values(described: Described, surroundings: Surroundings = NOTHING, places: Places = HERE) -> Floats:
    described.check("here")
    region = PLATE if surroundings.region is None else surroundings.region
    found = described.bind(replace(surroundings, region=region))(places)
    assert found.shape == (len(places),)
    low, high = described.bounds()
    assert (found >= low - 1e-12).all()
    assert (found <= high + 1e-12).all()
    return found


def graded(t: Floats, start: float = 2.0, end: float = 6.0) -> Floats:
    return start + (end - start) * np.clip(t, 0, 1)


ENDS = {"from_": 2.0, "to": 6.0}


# -- by place ------------------------------------------------------------------------------------------------


def test_linear_along_a_direction_spans_the_regions_own_extent() -> None:
    direction = np.array([3.0, 4.0, 0.0])
    along = PLATE.corners.reshape(-1, 3) @ direction
    t = (HERE.position @ direction - along.min()) / np.ptp(along)
    assert np.allclose(values(Linear(**ENDS, direction=(3.0, 4.0, 0.0))), graded(t))


def test_linear_between_two_points_stays_at_its_ends_beyond_them() -> None:
    t = (HERE.position[:, 0] + 20) / 50
    found = values(Linear(**ENDS, start=(-20.0, 3.0, 0.0), end=(30.0, 3.0, 0.0)))
    assert np.allclose(found, graded(t))
    assert (found == 2).any()
    assert (found == 6).any()


def test_linear_goes_on_beyond_its_ends_where_it_is_not_clamped() -> None:
    field = Linear(**ENDS, start=(-20.0, 0.0, 0.0), end=(30.0, 0.0, 0.0), clamp=False)
    assert np.allclose(values(field), 2 + 4 * (HERE.position[:, 0] + 20) / 50)


def test_radial_about_a_point() -> None:
    away = np.linalg.norm(HERE.position - [10, -5, 7], axis=1)
    found = values(Radial(**ENDS, centre=(10.0, -5.0, 7.0), inner=5, radius=30))
    assert np.allclose(found, graded((away - 5) / 25))


def test_radial_about_an_axis() -> None:
    away = np.linalg.norm(HERE.position[:, 1:] - [-5, 7], axis=1)
    found = values(Radial(**ENDS, centre=(10.0, -5.0, 7.0), axis=(2.0, 0.0, 0.0), radius=40))
    assert np.allclose(found, graded(away / 40))


def test_radial_about_an_object_and_its_own_axis() -> None:
    frame = np.eye(4)
    frame[:3, :3] = [[0, 0, 2], [1, 0, 0], [0, 1, 0]]  # its z axis is the base's x axis, twice as long
    frame[:3, 3] = (10, -5, 7)
    around = Surroundings(objects={"Empty": Thing(frame[None, :3, 3], frame=frame)})
    found = values(Radial(**ENDS, object="Empty", axis="z", radius=40), around)
    assert np.allclose(found, values(Radial(**ENDS, centre=(10, -5, 7), axis=(1, 0, 0), radius=40)))
    found = values(Radial(**ENDS, object="Empty", radius=40), around)
    assert np.allclose(found, values(Radial(**ENDS, centre=(10, -5, 7), radius=40)))


def test_radial_without_centre_and_radius_goes_from_the_middle_to_the_farthest_place() -> None:
    disc = whole(shapes.coarse_sheet([shapes.circle(20.0, (3.0, 4.0), 720)]))
    places = scattered(disc)
    away = np.linalg.norm(places.position - [3, 4, 0], axis=1)
    found = values(Radial(**ENDS), Surroundings(region=disc), places)
    assert np.allclose(found, graded(away / 20), atol=1e-3)


def test_distance_from_the_boundary_of_a_disc_and_its_island() -> None:
    ring = whole(shapes.coarse_sheet([shapes.circle(30.0, sides=2000), shapes.circle(5.0, sides=2000)[::-1]]))
    places = scattered(ring)
    r = np.linalg.norm(places.position, axis=1)
    around = Surroundings(region=ring)
    outer, inner = (30 - r) / 8, (r - 5) / 8
    for chosen, t in [
        ({"loops": "outer"}, outer),
        ({"loops": "islands"}, inner),
        ({}, np.minimum(outer, inner)),
        ({"near": ((0.0, 7.0, 0.0),)}, inner),
        ({"near": ((0.0, 29.0, 0.0),)}, outer),
        ({"near": ((0.0, 29.0, 0.0), (0.0, 7.0, 0.0))}, np.minimum(outer, inner)),
    ]:
        assert np.allclose(values(Edge(**ENDS, distance=8, **chosen), around, places), graded(t), atol=1e-3)


def test_every_part_has_one_outer_loop() -> None:
    parts = shapes.parts()
    region = make_region(parts.mesh, parts.selected)
    with_boundary = np.unique(region.sheet[region.rim[:, 0]])
    assert len(outer_loops(region)) == len(with_boundary)


def test_distance_from_points_lines_and_objects_is_that_to_the_nearest() -> None:
    point, line = (10.0, 10.0, 3.0), ((-30.0, 0.0, 0.0), (-30.0, 20.0, 0.0), (0.0, 30.0, 0.0))
    curve = Thing(np.empty((0, 3)), np.array([[[40.0, -30, 0], [50, -30, 0]]]))
    around = Surroundings(objects={"Logo": Thing(np.array([[0.0, -20, 0], [5, -20, 0]])), "Curve": curve})

    def to_segment(a: Floats, b: Floats) -> Floats:
        share = np.clip((HERE.position - a) @ (b - a) / ((b - a) @ (b - a)), 0, 1)
        return np.linalg.norm(HERE.position - a - share[:, None] * (b - a), axis=1)

    corners = np.array(line)
    each = [np.linalg.norm(HERE.position - p, axis=1) for p in (point, (0, -20, 0), (5, -20, 0))]
    each += [to_segment(corners[0], corners[1]), to_segment(corners[1], corners[2])]
    each += [to_segment(*curve.segments[0])]
    field = Distance(**ENDS, distance=25, points=(point,), lines=(line,), objects=("Logo", "Curve"))
    assert np.allclose(values(field, around), graded(np.min(each, axis=0) / 25))
    alone = Distance(**ENDS, distance=25, points=(point,))
    assert np.allclose(alone(HERE), graded(each[0] / 25))  # needs no surroundings


# -- painted -------------------------------------------------------------------------------------------------


def test_an_attribute_is_read_between_the_corners_not_at_the_nearest() -> None:
    """A value that is linear in space is met exactly at every place."""
    weight = (PLATE.base.corners @ [0.01, 0.02, 0.0]) + 0.5
    t = HERE.position @ [0.01, 0.02, 0.0] + 0.5
    around = Surroundings(attributes={"Weight": weight})
    assert np.allclose(values(Attribute(**ENDS, name="Weight"), around), graded(t))
    found = values(Attribute(**ENDS, name="Weight", low=0.2, high=0.6), around)
    assert np.allclose(found, graded((t - 0.2) / 0.4))


def test_face_values_and_colours() -> None:
    count = len(PLATE.base.triangles)
    chance = np.random.default_rng(1)
    faces, colours = chance.random(count), chance.random((count, 3, 4))
    around = Surroundings(attributes={"Face": faces, "Color": colours})
    assert np.allclose(values(Attribute(**ENDS, name="Face"), around), graded(faces[HERE.triangle]))
    here = np.einsum("nk,nkc->nc", HERE.barycentric, colours[HERE.triangle])
    for channel, t in {"light": here[:, :3] @ LIGHT, "green": here[:, 1], "alpha": here[:, 3]}.items():
        assert np.allclose(values(Attribute(**ENDS, name="Color", channel=channel), around), graded(t))


def ramp(width: int = 64, height: int = 32) -> Floats:
    """An image whose brightness is u / 2 + v / 4 at the middles of its pixels."""
    u, v = np.meshgrid((np.arange(width) + 0.5) / width, (np.arange(height) + 0.5) / height)
    return u / 2 + v / 4


def test_an_image_on_a_plane_covers_the_region_or_lies_where_it_is_put() -> None:
    low, high = PLATE.corners.reshape(-1, 3).min(axis=0), PLATE.corners.reshape(-1, 3).max(axis=0)
    middle, size = (low + high) / 2, high - low
    width = max(size[0], size[1] * 2)  # the image is twice as wide as high
    uv = (HERE.position - middle)[:, :2] / [width, width / 2] + 0.5
    inside = (np.abs(uv - 0.5) < [0.49, 0.48]).all(axis=1)
    assert inside.sum() > 100
    around = Surroundings(images={"ramp.png": ramp()})
    found = values(Image(**ENDS, image="ramp.png"), around)
    assert np.allclose(found[inside], graded(uv @ [0.5, 0.25])[inside])
    put = Image(**ENDS, image="ramp.png", project=(0, 0, 1), up=(1, 0, 0), centre=(0, 0, 9), width=200.0)
    uv = np.stack([-HERE.position[:, 1] / 200, HERE.position[:, 0] / 100], axis=1) + 0.5
    inside = (np.abs(uv - 0.5) < [0.49, 0.48]).all(axis=1)
    assert np.allclose(values(put, around)[inside], graded(uv @ [0.5, 0.25])[inside])


def test_an_image_through_a_uv_map_repeats() -> None:
    uv_map = PLATE.base.corners[:, :, :2] / 20
    around = Surroundings(images={"ramp.png": ramp()[:, :, None]}, uv_maps={"UVMap": uv_map})
    uv = (HERE.position[:, :2] / 20) % 1
    inside = (np.abs(uv - 0.5) < [0.49, 0.48]).all(axis=1)
    assert inside.sum() > 100
    found = values(Image(**ENDS, image="ramp.png", uv="UVMap", invert=True), around)
    assert np.allclose(found[inside], graded(1 - uv @ [0.5, 0.25])[inside])


def test_bilinear_meets_pixels_in_their_middles_and_is_even_between() -> None:
    pixels = np.array([[0.0, 1.0], [0.5, 0.25]])
    at = np.array([[0.25, 0.25], [0.75, 0.25], [0.5, 0.25], [0.5, 0.5], [0.0, 0.25], [-3.0, 9.0]])
    assert np.allclose(bilinear(pixels, at, repeat=False), [0, 1, 0.5, 0.4375, 0, 0.5])
    assert np.allclose(bilinear(pixels, at, repeat=True)[:5], [0, 1, 0.5, 0.4375, 0.5])


# -- falloffs ------------------------------------------------------------------------------------------------

FORMULAS = {
    "linear": lambda t: t,
    "smooth": lambda t: 3 * t**2 - 2 * t**3,
    "sphere": lambda t: np.sqrt(2 * t - t**2),
    "root": lambda t: t**0.5,
    "sharp": lambda t: t**2,
}


@pytest.mark.parametrize("falloff", FORMULAS)
@pytest.mark.parametrize("invert", [False, True])
def test_falloffs(falloff: str, invert: bool) -> None:
    t = np.clip((HERE.position[:, 0] + 20) / 50, 0, 1)
    found = values(Linear(**ENDS, start=(-20, 0, 0), end=(30, 0, 0), falloff=falloff, invert=invert))
    assert np.allclose(found, 2 + 4 * FORMULAS[falloff](1 - t if invert else t))


heights = st.lists(st.floats(-2, 3), min_size=2, max_size=6)


@given(heights)
@settings(derandomize=True, deadline=None)
def test_a_curve_goes_through_its_points_and_never_beyond_them(heights: list[float]) -> None:
    at = np.linspace(0.1, 0.9, len(heights))
    field = Linear(
        from_=0,
        to=1,
        start=(0, 0, 0),
        end=(1, 0, 0),
        falloff="curve",
        curve=tuple(zip(at, heights, strict=True)),
    )
    x = np.sort(np.concatenate([at, np.linspace(-0.5, 1.5, 201)]))
    position = np.stack([x, 0 * x, 0 * x], axis=1)
    found = values(field, places=Places(position, np.zeros(len(x), int), np.eye(3)[np.zeros(len(x), int)]))
    assert np.allclose(np.interp(at, x, found), heights)
    # monotone between two control points
    between = np.searchsorted(at, x[1:-1])
    for number in range(1, len(at)):
        steps = np.diff(found[1:-1][between == number])
        assert (steps >= -1e-12).all() or (steps <= 1e-12).all()


def test_a_curve_of_all_falloffs_is_told_by_name() -> None:
    assert set(FALLOFFS) == {*FORMULAS, "curve"}


# -- taken together ------------------------------------------------------------------------------------------

A = Linear(**ENDS, direction=(1, 0, 0))
B = Radial(from_=5, to=1, centre=(0, 0, 0), radius=50)
MASK = Linear(from_=-1, to=2, direction=(0, 1, 0))


def test_product_least_most_and_blend() -> None:
    a, b, mask = values(A), values(B), np.clip(values(MASK), 0, 1)
    assert np.allclose(values(Product(of=(A, B, Constant(0.5)))), a * b / 2)
    assert np.allclose(values(Least(of=(A, B))), np.minimum(a, b))
    assert np.allclose(values(Most(of=(A, B, Constant(3.0)))), np.maximum(np.maximum(a, b), 3))
    assert np.allclose(values(Blend(first=A, second=B, mask=MASK)), (1 - mask) * a + mask * b)
    assert np.allclose(values(Product(of=(Constant(-2.0), A))), -2 * a)


def test_each_sub_region_has_its_own_field_and_the_first_counts() -> None:
    middle = PLATE.base.corners.mean(axis=1)
    zone = np.where(middle[:, 0] < -20, 1.0, np.where(middle[:, 0] < 10, 2.0, 0.0))
    around = Surroundings(attributes={"zone": zone}, materials={"Rim": middle[:, 1] > 10})
    field = SubRegions(
        sets=(
            FaceSet(attribute="zone", equals=1, value=A),
            FaceSet(material="Rim", value=Constant(9.0)),
            FaceSet(attribute="zone", value=B),
        ),
        otherwise=Constant(1.5),
    )
    at, rim = zone[HERE.triangle], around.materials["Rim"][HERE.triangle]
    wanted = np.where(at == 1, values(A), np.where(rim, 9.0, np.where(at == 2, values(B), 1.5)))
    assert np.allclose(values(field, around), wanted)
    assert len(np.unique(wanted // 1)) > 3


def test_a_share_of_the_pitch_follows_the_pitch() -> None:
    around = Surroundings(pitch=A.bind(Surroundings(region=PLATE)))
    assert np.allclose(values(Fill(Constant(0.6)), around), 0.6 * values(A))
    with pytest.raises(FieldError, match="no pitch here"):
        values(Fill(Constant(0.6)))


def test_a_constant_is_bound_to_itself() -> None:
    three = Constant(3.0)
    assert three.bind(NOTHING) is three
    assert (values(three) == 3).all()
    assert values(Constant(3)).dtype == np.float64


# -- what is not there ---------------------------------------------------------------------------------------

PAINTED = Surroundings(
    attributes={
        "Group": np.zeros((len(PLATE.base.triangles), 3)),
        "Mask": np.ones(len(PLATE.base.triangles)),
    },
    materials={"Grille": np.zeros(len(PLATE.base.triangles), bool)},
    images={"dots.png": np.ones((2, 2, 3)), "none.png": np.ones((0, 2, 3))},
    objects={"Empty": Thing(np.zeros((1, 3))), "Nothing": Thing(np.empty((0, 3)))},
)
MISSING = {
    "attribute": (Attribute(**ENDS, name="Grup"), 'name = "Grup": .*did you mean "Group"'),
    "uv map": (Image(**ENDS, image="dots.png", uv="UVMap"), 'uv = "UVMap": .*nor any other'),
    "image": (Image(**ENDS, image="dot.png"), 'image = "dot.png": .*did you mean "dots.png"'),
    "image without pixels": (Image(**ENDS, image="none.png"), "no pixels"),
    "object": (Radial(**ENDS, object="Emty"), 'object = "Emty": .*did you mean "Empty"'),
    "attractor": (Distance(**ENDS, distance=1, objects=("Zzz",)), 'object = "Zzz": .*known are "Empty"'),
    "attractor without points": (Distance(**ENDS, distance=1, objects=("Nothing",)), "no points"),
    "material": (
        SubRegions(sets=(FaceSet(material="Gril", value=A),), otherwise=A),
        'material = "Gril": .*did you mean "Grille"',
    ),
    "empty sub-region": (
        SubRegions(sets=(FaceSet(material="Grille", value=A),), otherwise=A),
        'no face of the target region is in "Grille"',
    ),
    "sub-region on vertices": (
        SubRegions(sets=(FaceSet(attribute="Group", value=A),), otherwise=A),
        "painted on vertices",
    ),
    "alpha": (Image(**ENDS, image="dots.png", channel="alpha"), "has no alpha"),
    "direction across": (Linear(**ENDS, direction=(0, 0, 1)), "square to the target region"),
    "inner beyond": (Radial(**ENDS, inner=1000), "beyond the farthest place"),
    "up at the viewer": (Image(**ENDS, image="dots.png", up=(0, 0, 2)), "points at the viewer"),
}


@pytest.mark.parametrize("name", MISSING)
def test_what_is_missing_is_told_with_the_nearest_that_is_there(name: str) -> None:
    described, words = MISSING[name]
    described.check("here")
    with pytest.raises(FieldError, match=words) as caught:
        values(described, PAINTED)
    assert "\n" not in str(caught.value)


def test_closed_regions_have_no_boundary_and_face_all_ways() -> None:
    around = replace(PAINTED, region=SPHERE)
    with pytest.raises(FieldError, match="has no boundary"):
        values(Edge(**ENDS, distance=1), around)
    with pytest.raises(FieldError, match="faces all ways"):
        values(Image(**ENDS, image="dots.png"), around)
    disc = whole(shapes.coarse_sheet([shapes.circle(20.0)]))
    with pytest.raises(FieldError, match='loops = "islands"'):
        values(Edge(**ENDS, distance=1, loops="islands"), Surroundings(region=disc))


def test_a_value_that_is_missing_on_the_region_is_refused_elsewhere_it_does_not_matter() -> None:
    half = np.arange(len(PANEL.base.triangles)) < 300
    region = make_region(PANEL.base, half)
    values_there = np.where(half, 0.5, np.nan)
    around = Surroundings(region=region, attributes={"Weight": values_there})
    field = Attribute(**ENDS, name="Weight")
    assert np.allclose(values(field, around, scattered(region)), 4.0)
    with pytest.raises(FieldError, match="no value on a part"):
        values(field, replace(around, region=PANEL), scattered(PANEL))


def test_a_field_of_the_region_asked_without_one_says_so() -> None:
    with pytest.raises(FieldError, match="depends on the target region"):
        A(HERE)


# -- what makes no sense -------------------------------------------------------------------------------------

NONSENSE = {
    "falloff": (Linear(**ENDS, direction=(1, 0, 0), falloff="smoth"), 'did you mean "smooth"'),
    "curve and falloff": (
        Linear(**ENDS, direction=(1, 0, 0), falloff="root", curve=((0, 0), (1, 1))),
        "leave one of the two out",
    ),
    "no curve": (Linear(**ENDS, direction=(1, 0, 0), falloff="curve"), "two control points"),
    "curve backwards": (
        Linear(**ENDS, direction=(1, 0, 0), falloff="curve", curve=((1, 0), (0, 1))),
        "t rising",
    ),
    "curve beyond": (
        Linear(**ENDS, direction=(1, 0, 0), falloff="curve", curve=((0, 0), (2, 1))),
        "t from 0 to 1",
    ),
    "unclamped smooth": (
        Linear(**ENDS, direction=(1, 0, 0), falloff="smooth", clamp=False),
        "leave clamp out",
    ),
    "infinite end": (Linear(from_=1, to=np.inf, direction=(1, 0, 0)), "here: to = inf must be a finite"),
    "no direction": (Linear(**ENDS), "give either direction"),
    "half a way": (Linear(**ENDS, start=(0, 0, 0)), "both start and end"),
    "zero direction": (Linear(**ENDS, direction=(0, 0, 0)), "leads nowhere"),
    "no way": (Linear(**ENDS, start=(1, 0, 0), end=(1, 0, 0)), "the same point"),
    "two centres": (Radial(**ENDS, centre=(0, 0, 0), object="Empty"), "either centre or object"),
    "letter without object": (Radial(**ENDS, axis="z"), "is an object's"),
    "unknown axis": (Radial(**ENDS, object="Empty", axis="w"), "is not known"),
    "zero axis": (Radial(**ENDS, axis=(0, 0, 0)), "leads nowhere"),
    "radius": (Radial(**ENDS, inner=3, radius=2), "must be above inner"),
    "inner": (Radial(**ENDS, inner=-1), "at least 0"),
    "fade over nothing": (Edge(**ENDS, distance=0), "above 0"),
    "loops": (Edge(**ENDS, distance=1, loops="outside"), "is not known"),
    "loops and near": (Edge(**ENDS, distance=1, loops="outer", near=((0, 0, 0),)), "either loops or near"),
    "from nothing": (Distance(**ENDS, distance=1), "give points, lines or objects"),
    "no reach": (Distance(**ENDS, distance=-1, points=((0, 0, 0),)), "above 0"),
    "one point is no line": (Distance(**ENDS, distance=1, lines=(((0, 0, 0),),)), "two points or more"),
    "channel": (Attribute(**ENDS, name="Color", channel="lite"), 'did you mean "light"'),
    "no range": (Attribute(**ENDS, name="Weight", low=1, high=1), "two different values"),
    "uv and plane": (Image(**ENDS, image="a", uv="UVMap", width=3), "either uv or width"),
    "zero width": (Image(**ENDS, image="a", width=0), "above 0"),
    "zero sight": (Image(**ENDS, image="a", project=(0, 0, 0)), "leads nowhere"),
    "parallel": (Image(**ENDS, image="a", project=(0, 0, 1), up=(0, 0, 2)), "parallel"),
    "one is no product": (Product(of=(A,)), "two fields or more"),
    "nested": (Least(of=(A, Linear(**ENDS))), "here: of, field 2: give either direction"),
    "mask": (Blend(first=A, second=B, mask=Linear(**ENDS)), "here: mask: give"),
    "no sets": (SubRegions(sets=(), otherwise=A), "one sub-region at least"),
    "set of nothing": (SubRegions(sets=(FaceSet(value=A),), otherwise=A), "either attribute or material"),
    "material that equals": (
        SubRegions(sets=(FaceSet(value=A, material="Grille", equals=2),), otherwise=A),
        "equals goes with attribute",
    ),
}


@pytest.mark.parametrize("name", NONSENSE)
def test_nonsense_is_refused_in_plain_words(name: str) -> None:
    described, words = NONSENSE[name]
    with pytest.raises(RecipeError, match=words) as caught:
        described.check("here")
    assert str(caught.value).startswith("here")
    assert "\n" not in str(caught.value)
