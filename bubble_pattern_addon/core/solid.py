"""Step 3: add the features to the base geometry, all at once, then measure what came out."""

from __future__ import annotations

from collections.abc import Callable

import manifold3d
import numpy as np

from . import carry
from .columns import Columns
from .cutters import Cutters
from .drilling import Spans, drilled
from .elsewhere import elsewhere
from .errors import BaseError
from .feature_recipe import Feature
from .mesh import Floats, Ints, Mesh
from .part import Cut, Part
from .pattern import Pattern
from .plan import Plan, plan_steps
from .profile import covered, outlines
from .progress import Progress, Steps, within
from .splitting import split_crowded
from .verdict import judge

SECONDS = 4e-6
"""What the boolean takes for each triangle of the base and the cutters, measured on two cores of 2020."""
DRILLING = 2e-6
"""What drilling takes for each triangle of the base and the cutters that there would be."""


def part_steps(
    base: Mesh,
    pattern: Pattern,
    feature: Feature,
    stamp: Mesh | None = None,
    apart: Callable[[Plan], bool] | None = None,
) -> Steps[Part]:
    """Add every feature of `pattern` to `base`; a generator of Progress that returns the Part.

    stamp: the mesh that a feature with the profile "mesh" names; apart: whether the boolean of a plan shall
    run in a process of its own; None: it never does

    Raises BaseError when the base is not fit for a solid, RecipeError when the feature makes no sense. A
    single feature that cannot be added (wall too thick, next wall too close) is left out and reported in the
    part.

    Here cutting is one step: no call of manifold3d 3.5.4 lets go of the interpreter while it works, so
    that a thread beside it could neither read its progress nor cancel it. In a process of its own it can be
    given up as everything before and after can; what it has done is then told by the time it takes.
    """
    plan = yield from plan_steps(base, pattern, feature, stamp)
    if apart is not None and apart(plan):
        cutting = elsewhere(cut, plan, stage="Cutting", seconds=cutting_seconds(plan))
        left = yield from within(cutting, 0.3, 0.8)
    else:
        yield Progress("Cutting", 0.3)
        left = cut(plan)
    yield Progress("Checking", 0.8)
    part = judge(plan, left)
    yield Progress("Checking", 1.0)
    return part


def cutting_seconds(plan: Plan) -> float:
    """What cutting takes, roughly: within a factor of three on most machines of its time."""
    base = len(plan.sound.mesh.triangles)
    if plan.columns is not None:
        return DRILLING * (base + 4 * len(plan.columns.outline))
    return SECONDS * (base + len(plan.cutters.mesh.triangles))


def cut(plan: Plan) -> Cut:
    """What `plan` leaves of its base: straight holes are drilled, see core.drilling; what can't be is left to
    one boolean, see `combine`.
    """
    if plan.columns is None:
        return _split_and_combined(plan)
    left, done = _drilled(plan, plan.columns)
    if not len(done):
        return _split_and_combined(plan)
    if len(done) == len(plan.columns):
        return left
    return _rest_combined(left, len(plan.sound.mesh.triangles), plan.solids(np.delete(plan.chosen, done)))


def _drilled(plan: Plan, columns: Columns) -> tuple[Cut, Ints]:
    """See `drilling.drilled`."""
    wall, seen = plan.wall, np.flatnonzero(plan.meets)
    row = np.full(len(plan.pattern), -1)
    row[columns.feature] = np.arange(len(columns))
    owner = row[wall.seen_feature[seen]]
    spans = Spans(owner, wall.seen_triangle[seen], wall.seen_low[seen], wall.seen_high[seen])
    return drilled(plan.sound.mesh, columns, spans)


def _rest_combined(left: Cut, faces: int, rest: Cutters) -> Cut:
    """What drilling `left` of a base with so many `faces`, less the `rest` of the features."""
    # faces of the base and walls of the drilled holes are told apart by their numbers
    last = combine(left.mesh, np.concatenate([left.face, faces + left.facet]), rest)
    walls = last.face >= faces
    base_first = np.argsort(walls, kind="stable")
    order = np.concatenate([base_first, np.arange(len(walls), len(last.mesh.triangles))])
    return Cut(
        Mesh(last.mesh.vertices, last.mesh.triangles[order]),
        last.face[~walls],
        np.concatenate([last.face[walls] - faces, len(left.feature) + last.facet]),
        np.concatenate([left.feature, last.feature]),
    )


def _split_and_combined(plan: Plan) -> Cut:
    """One boolean for all features, the faces that many of them crowd split for it."""
    wall, base, pattern = plan.wall, plan.sound.mesh, plan.pattern
    through = np.flatnonzero(plan.meets & np.isfinite(wall.seen_axis))
    feature = wall.seen_feature[through]
    place = pattern.position[feature] + wall.seen_axis[through, None] * pattern.normal[feature]
    split, piece = split_crowded(base, wall.seen_triangle[through], place, _room(plan)[feature])
    return combine(split, piece, plan.cutters, plan.feature.adds)


def _room(plan: Plan) -> Floats:
    """Radius of a circle about its axis that each feature covers for sure, (n,); inf, so that nothing is
    split, for one with a profile beside its axis.
    """
    radius, feature = plan.pattern.diameter / 2, plan.feature
    if feature.profile == "circle":
        return radius
    if plan.stamp is not None:
        return np.full(len(radius), np.inf)
    inner = covered(outlines(feature, plan.pattern.diameter, plan.sizes.aspect, 12).corners)
    return np.where(inner > 0, inner, np.inf)


def combine(base: Mesh, face: Ints, cutters: Cutters, adds: bool = False) -> Cut:
    """`base`, whose triangles belong to the faces `face`, (T,), less `cutters`, or with them where they are
    what a bump adds, in one boolean.

    Faces keep their identity through the boolean, which also keeps it from merging any of the base's own
    edges, however flat.
    """
    none = np.zeros(0, dtype=np.int64)
    if len(cutters.facet) == 0:
        return Cut(base, face, none, none)
    first = manifold3d.Manifold.reserve_ids(2)
    whole, solids = _manifold(base, face, first), _manifold(cutters.mesh, cutters.facet, first + 1)
    result = whole + solids if adds else whole - solids
    if result.status() != manifold3d.Error.NoError:
        raise BaseError(f"The features could not be cut ({result.status().name}): check the base for flaws.")
    out = result.to_mesh64()
    # manifold3d hands these out as lists, each time anew
    names, ends = out.run_original_id, [end // 3 for end in out.run_index]
    identity = np.fromiter(out.face_id, dtype=np.int64, count=ends[-1])
    triangles = out.tri_verts.view(np.int64)

    def of(name: int, rows: Ints) -> list[Ints]:
        runs = zip(names, ends[:-1], ends[1:], strict=True)
        return [rows[start:end] for owner, start, end in runs if owner == name]

    order = np.concatenate([triangles[:0], *of(first, triangles), *of(first + 1, triangles)])
    on_base, on_cutters = (np.concatenate([none, *of(name, identity)]) for name in (first, first + 1))
    return Cut(Mesh(np.array(out.vert_properties), order), on_base, on_cutters, cutters.feature)


def _manifold(mesh: Mesh, facet: Ints, name: int) -> manifold3d.Manifold:
    """`mesh` for the boolean in double precision, every triangle marked with its `facet`, all under the id
    `name`.
    """

    def given(array: np.ndarray) -> np.ndarray:
        # manifold3d takes no array that cannot be written to
        return np.require(array, requirements=["C", "W"])

    solid = manifold3d.Manifold(
        manifold3d.Mesh64(
            vert_properties=given(mesh.vertices),
            tri_verts=given(mesh.triangles).view(np.uint64),
            face_id=given(facet).view(np.uint64),
            run_index=np.array([0, mesh.triangles.size], dtype=np.uint64),
            run_original_id=np.array([name], dtype=np.uint32),
        )
    )
    if solid.status() != manifold3d.Error.NoError:
        raise BaseError(f"The base is not a solid ({solid.status().name}): repair the mesh first.")
    return solid


def carry_corners(base: Mesh, part: Part, values: Floats) -> Floats:
    """Values on the corners of the base carried to the part: (T, 3, k) -> (T', 3, k); see
    `carry.carry_corners`.
    """
    return carry.carry_corners(base, part.mesh, part.source, values)
