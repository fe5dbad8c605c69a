"""How every feature stands: its axis, where its profile heads, and its sizes that vary over the region."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from .distance import index_segments, nearest_piece
from .errors import FieldError, RecipeError
from .feature_checks import STEEPEST_DRAFT
from .feature_recipe import ASPECTS, Feature
from .links import Links
from .mesh import Floats
from .metric import Described, Field
from .painted import painted
from .partners import Kin, alike, along_or_square, kin_of, own_image
from .pattern import Pattern
from .profile import outlines, signed_area
from .region import Region
from .stamp import footprint, make_stamp
from .surroundings import NOTHING, Surroundings
from .vectors import dots

# A direction this much shorter than it was, once laid square to the axis, points nowhere.
NOWHERE = 1e-6
# The surface bends as much one way as the other where the normals of neighbours differ by less, in radians.
EVEN_BEND = 2e-3
# Steps of the boundary, between turns sharper than this and no longer than so many pitches, are smoothed over
# on a stretch of so many pitches to either side.
SHARP_TURN = np.radians(30.0)
STEP = 2.0
BESIDE = 0.75
# Turns for which the recipe says where to head in space.
GIVEN = ("fixed", "towards", "around", "attribute")
# what a size must be above, and at most
RANGES = {
    "depth": (0.0, np.inf),
    "height": (0.0, np.inf),
    "draft": (-1e-12, STEEPEST_DRAFT),
    "aspect": (0.0, 1.0),
    "angle": (-np.inf, np.inf),
}


def headed(bubbles: Pattern, links: Links, feature: Feature, surroundings: Surroundings) -> Pattern:
    """The bubbles with the axes, headings and varying sizes of their features; None and nothing where they
    are the bubbles' own, the same for all.

    surroundings: with the region. FieldError for what they lack, RecipeError for a size out of its range.
    """
    pitch = bubbles.pitch
    here = replace(surroundings, pitch=lambda places: pitch)
    sizes = {}
    for name in RANGES:
        size = getattr(feature, name)
        if isinstance(size, Described):
            sizes[name] = _laid(size, name, bubbles, here)
    plain_angle = 0.0 if isinstance(feature.angle, Described) else feature.angle
    angle = np.radians(sizes.pop("angle", np.full(1, plain_angle)))
    share = circle_share(feature, sizes.get("aspect"), len(bubbles), surroundings)
    if feature.axis == 0 and feature.turn == "row" and not np.any(angle):
        return replace(bubbles, axis=None, heading=None, sizes=sizes, share=share)
    axis = axes(bubbles.normal, feature)
    heading = square_to(axis, bubbles.tangent)
    if feature.turn != "row":
        wished = _directions(bubbles, axis, heading, links, feature, surroundings)
        heading = square_to(axis, wished, heading)
    kin = kin_of(bubbles)
    heading = (
        turned(axis, heading, angle) if kin is None else _turned_alike(kin, feature, axis, heading, angle)
    )
    axis_given = None if feature.axis == 0 else axis
    return replace(bubbles, axis=axis_given, heading=heading, sizes=sizes, share=share)


def _turned_alike(kin: Kin, feature: Feature, axis: Floats, heading: Floats, angle: Floats) -> Floats:
    """The headings turned by the angle, (n,) or (1,), so that partners are each other's images: one turned
    clockwise where the other is turned counter-clockwise.

    A direction that the designer gives in space is kept, symmetric or not.
    """
    own = own_image(kin, heading)
    if feature.turn not in GIVEN:
        heading, own = square_to(axis, alike(kin, along_or_square(kin, heading)), heading), np.ones_like(own)
    angle = kin.sign * np.broadcast_to(angle, len(axis))[kin.lead]
    heading = along_or_square(kin, turned(axis, heading, angle), own)
    return (
        square_to(axis, heading) if feature.turn in GIVEN else square_to(axis, alike(kin, heading), heading)
    )


def _laid(described: Described, name: str, bubbles: Pattern, surroundings: Surroundings) -> Floats:
    """Values of a field at the bubbles, (n,)."""
    try:
        field: Field = described.bind(surroundings)
    except FieldError as error:
        raise FieldError(f"[feature] {name}: {error}") from None
    values = field(bubbles.places)
    low, high = RANGES[name]
    if not (np.isfinite(values).all() and (values > low).all() and (values <= high).all()):
        raise RecipeError(
            f"[feature] {name} becomes {values.min():.4g} to {values.max():.4g} in the target region: "
            f"it must be above {max(low, 0):g} and at most {high:g}"
            if np.isfinite(high)
            else f"[feature] {name} becomes {values.min():.4g} in the target region: it must stay above 0"
        )
    return values


def circle_share(
    feature: Feature, aspect: Floats | None, count: int, surroundings: Surroundings = NOTHING
) -> Floats | None:
    """Share of the circle round it that each of `count` features takes, (n,); None where it is the circle.

    aspect: (n,) where it varies over the region. A mesh takes what it covers of its own plane, which lies on
    the surface; one that is not among the surroundings counts as its circle. RecipeError for a mesh that can
    be no feature.
    """
    mesh = surroundings.meshes.get(feature.mesh or "")
    if feature.profile == "mesh" and mesh is not None:
        return np.full(count, footprint(make_stamp(mesh, feature)))
    if feature.profile in ("circle", "mesh"):
        return None
    given = ASPECTS.get(feature.profile, 1.0) if feature.aspect is None else feature.aspect
    if aspect is None:
        assert not isinstance(given, Described)  # a field has been laid
        aspect = np.full(1, given)
    # as fine as makes no difference
    corners = outlines(feature, np.full(len(aspect), 2.0), aspect, 256).corners
    return np.broadcast_to(signed_area(corners) / np.pi, count).copy()


def axes(normal: Floats, feature: Feature) -> Floats:
    """Unit axes of features on a surface with these normals, (n, 3)."""
    if feature.axis == 0 or feature.pull is None:
        return normal
    pull = np.array(feature.pull) / np.linalg.norm(feature.pull)
    mixed = (1 - feature.axis) * normal + feature.axis * pull
    length = np.linalg.norm(mixed, axis=1, keepdims=True)
    # half way to the opposite side is no direction
    return np.where(length > NOWHERE, mixed / np.where(length > NOWHERE, length, 1), normal)


def square_to(axis: Floats, direction: Floats, otherwise: Floats | None = None) -> Floats:
    """Unit vectors (n, 3) square to the axes, along the directions; `otherwise`, or any, where there is
    none.
    """
    flat = direction - np.einsum("ij,ij->i", direction, axis)[:, None] * axis
    length = np.linalg.norm(flat, axis=1)
    lost = ~(length > NOWHERE * np.linalg.norm(direction, axis=1))
    if otherwise is not None:
        flat[lost] = otherwise[lost]
    elif lost.any():
        flat[lost] = np.cross(axis[lost], np.eye(3)[np.abs(axis[lost]).argmin(axis=1)])
    return flat / np.linalg.norm(flat, axis=1, keepdims=True)


def turned(axis: Floats, heading: Floats, angle: Floats) -> Floats:
    """Headings turned about their axes by the angle, (n,) or (1,), counter-clockwise seen from outside."""
    if not np.any(angle):
        return heading
    cosine, sine = np.cos(angle), np.sin(angle)
    across = np.cross(axis, heading)
    return np.asarray((heading.T * cosine + across.T * sine).T)


def _directions(
    bubbles: Pattern,
    axis: Floats,
    row: Floats,
    links: Links,
    feature: Feature,
    surroundings: Surroundings,
) -> Floats:
    """Where the profiles should head, (n, 3); row: (n, 3) along the rows, square to the axes."""
    position, turn = bubbles.position, feature.turn
    if turn == "fixed":
        return np.broadcast_to(np.array(feature.turn_direction, dtype=np.float64), position.shape)
    if turn == "boundary":
        region = surroundings.target()
        if not len(region.rim):
            raise FieldError(
                '[feature] turn = "boundary": the target region is closed, without a boundary: use another'
            )
        return along_boundary(region, position, bubbles.pitch)
    if turn == "attribute":
        assert feature.turn_attribute is not None  # check has seen to it
        try:
            return painted(surroundings.vector(feature.turn_attribute), bubbles.places)
        except FieldError as error:
            raise FieldError(f"[feature] turn_attribute: {error}") from None
    if turn == "curvature":
        return least_bent(bubbles, row, links)
    if turn == "random":
        # by the bubble's number: leaving one out turns no other
        angles = np.random.default_rng(feature.turn_seed).random(int(bubbles.ids.max(initial=0)) + 1)
        return turned(axis, row, 2 * np.pi * angles[bubbles.ids])
    towards = np.array(feature.turn_point, dtype=np.float64) - position
    return towards if turn == "towards" else np.cross(axis, towards)


def along_boundary(region: Region, position: Floats, pitch: Floats) -> Floats:
    """Directions (n, 3) of the boundary where it is nearest to each place (n, 3), the region on its left.

    Where it goes on for less than STEP pitches between two sharp turns, as round faces chosen on a grid, it
    is the chord of BESIDE pitches to either side: the way of the line that the steps stand for.
    """
    segments, sizes = region.boundary_segments, [len(loop) for loop in region.loops]
    along = segments[:, 1] - segments[:, 0]
    length = np.maximum(np.linalg.norm(along, axis=1), 1e-300)
    end = np.cumsum(length)
    index = index_segments(segments)
    piece_along = index.pieces[:, 1] - index.pieces[:, 0]
    piece_end = np.cumsum(np.linalg.norm(piece_along, axis=1))
    piece = nearest_piece(index, position)[1]
    middle = (piece_end[piece] + np.concatenate([[0.0], piece_end])[piece]) / 2
    loop_end = end[np.cumsum(sizes) - 1]
    loop_begin = np.concatenate([[0.0], loop_end[:-1]])
    loop = np.minimum(np.searchsorted(loop_end, middle), len(loop_end) - 1)
    begin, around = loop_begin[loop], (loop_end - loop_begin)[loop]
    reach = np.minimum(BESIDE * pitch, around / 4)

    def place(way: Floats) -> Floats:
        """Points (n, 3) so far along the loops."""
        arc = begin + np.mod(way - begin, around)
        on = np.minimum(np.searchsorted(end, arc), len(end) - 1)
        share = np.clip((arc - (end[on] - length[on])) / length[on], 0, 1)
        return segments[on, 0] + share[:, None] * along[on]

    going = _between_turns(along / length[:, None], end - length, sizes, middle, begin, around)
    steps = going < STEP * pitch
    chord = place(middle + reach) - place(middle - reach)
    way = np.where(steps[:, None], chord, piece_along[piece])
    return way / np.linalg.norm(way, axis=1, keepdims=True)


def _between_turns(
    unit: Floats, start: Floats, sizes: list[int], at: Floats, begin: Floats, around: Floats
) -> Floats:
    """How far the loops go on between the sharp turns on both sides of the arcs `at`, (n,).

    unit, start: (S, 3) directions and (S,) arcs of the segments, sizes: of the loops; begin, around: (n,) of
    the loop that each arc is on
    """
    ends = np.cumsum(sizes)
    before = np.arange(len(unit)) - 1
    before[ends - sizes] = ends - 1
    turn = start[dots(unit[before], unit) < np.cos(SHARP_TURN)]
    if not len(turn):
        return around
    first, beyond = np.searchsorted(turn, begin), np.searchsorted(turn, begin + around)
    after = np.searchsorted(turn, at)
    wrapped = np.minimum(first, len(turn) - 1), np.minimum(beyond, len(turn)) - 1
    following = np.where(after < beyond, turn[np.minimum(after, len(turn) - 1)], turn[wrapped[0]] + around)
    preceding = np.where(after > first, turn[after - 1], turn[wrapped[1]] - around)
    return np.where(beyond > first, following - preceding, around)


def least_bent(bubbles: Pattern, row: Floats, links: Links) -> Floats:
    """Directions (n, 3) in which the surface bends least, such as along a tube; `row` (n, 3) where it bends
    alike every way.

    The change of the normal from each bubble to its neighbours is fitted by a linear map, as in a discrete
    second fundamental form; so what counts is the bend on the scale of the pattern, not of its base's faces.
    """
    n = len(bubbles)
    normal, position = bubbles.normal, bubbles.position
    x = square_to(normal, row)
    frame = np.stack([x, np.cross(normal, x)], axis=1)
    own = np.concatenate([links.first, links.second])
    other = np.concatenate([links.second, links.first])
    step = np.einsum("mij,mj->mi", frame[own], position[other] - position[own])
    bend = np.einsum("mij,mj->mi", frame[own], normal[other] - normal[own])
    squares, products = np.zeros((2, n, 2, 2))
    for i in range(2):
        for j in range(2):
            squares[:, i, j] = np.bincount(own, step[:, i] * step[:, j], n)
            products[:, i, j] = np.bincount(own, bend[:, i] * step[:, j], n)
    size = np.trace(squares, axis1=1, axis2=2)
    known = np.linalg.det(squares) > 1e-6 * size**2
    squares[~known] = np.eye(2)
    shape = products @ np.linalg.inv(squares)
    value, vector = np.linalg.eigh((shape + shape.transpose(0, 2, 1)) / 2)
    flattest = np.abs(value).argmin(axis=1)
    flat = vector[np.arange(n), :, flattest]
    uneven = np.abs(np.abs(value[:, 1]) - np.abs(value[:, 0])) * bubbles.pitch > EVEN_BEND
    flat = np.where(flat[:, :1] < 0, -flat, flat)
    direction = np.einsum("ni,nij->nj", flat, frame)
    return np.where((known & uneven)[:, None], direction, row)
