"""Step 3: add the features to the base geometry in one boolean, then measure what came out."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace

import manifold3d
import numpy as np

from . import carry
from .check import Check, check_part
from .closed import measure, patch_euler
from .collision import colliding
from .crossings import SHALLOWEST
from .cutters import Cutters
from .elsewhere import elsewhere
from .errors import BaseError, RecipeError
from .feature import make_cutters
from .feature_checks import check_feature
from .feature_recipe import Feature, nouns
from .feature_sizes import FeatureSizes, feature_sizes, sides
from .fitting import fitted, looked_for
from .loft import make_solids
from .mesh import Bools, Floats, Ints, Mesh
from .pattern import Pattern, aimed
from .profile import covered, outlines
from .progress import Progress, Steps, within
from .section import Extent
from .soundness import SoundBase, sound_base
from .splitting import split_crowded
from .stamp import Stamp, make_stamp, make_stamps, stamp_sizes
from .undercut import undercuts
from .wall import DEEPEST, Fault, NearWall, near_wall

SECONDS = 4e-6
"""What the boolean takes for each triangle of the base and the cutters, measured on two cores of 2020."""
SAID = 3
"""Features that could not be added and are named in the check's problems; the part lists them all."""


@dataclass(frozen=True)
class Part:
    """The base with its features, n of them.

    mesh: the part; source: (T',) triangle of the base each of its triangles lies on, -1 - feature id on a
        feature's wall
    vertex: (V',) vertex of the base at exactly this place, -1 for a vertex the cut made
    untouched: (T',) triangles that are triangles of the base as they were: their corners are the corners of
        their source, in the same order
    thickness: (n,) thickness of the near wall along each feature's axis, nan where no far side was found
    pierced: (n,) the feature goes through the near wall (False for a blind hole)
    failures: (feature id, sentence) for every feature that was not added
    undercut: (n,) features that cannot be drawn off along the pull direction, where there is one
    kind: of the features, "hole", "dimple" or "bump"
    """

    mesh: Mesh
    source: Ints
    vertex: Ints
    untouched: Bools
    thickness: Floats
    pierced: Bools
    failures: tuple[tuple[int, str], ...]
    check: Check
    undercut: Bools
    kind: str


@dataclass(frozen=True)
class Plan:
    """What will be cut or added: the base made ready, its near walls, and the features that can be, as
    solids; the pattern with their axes for normals, and the surface's normals, (n, 3).
    """

    feature: Feature
    pattern: Pattern
    normal: Floats
    sizes: FeatureSizes
    stamp: Stamp | None
    sound: SoundBase
    wall: NearWall
    fault: Ints
    extent: Extent
    cutters: Cutters

    @property
    def meets(self) -> Bools:
        """Which of the triangles seen by the walls a cutter reaches, (k,)."""
        wall, feature = self.wall, self.wall.seen_feature
        top, bottom = self.extent.top, self.extent.bottom
        within = (wall.seen_low <= top[feature]) & (wall.seen_high >= -bottom[feature])
        return within & (self.fault[feature] == Fault.NONE)


@dataclass(frozen=True)
class Cut:
    """What the boolean left.

    mesh: its triangles on the base come first, then those the cutters made
    face: (F,) face of the base each of the first triangles lies on
    facet: (W,) facet of the cutters each of the others lies on
    """

    mesh: Mesh
    face: Ints
    facet: Ints

    @property
    def surface(self) -> Ints:
        """Triangles on the base, (F, 3)."""
        return self.mesh.triangles[: len(self.face)]

    @property
    def walls(self) -> Ints:
        """Triangles that the cutters made, (W, 3)."""
        return self.mesh.triangles[len(self.face) :]


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

    Here the boolean is one step: no call of manifold3d 3.5.4 lets go of the interpreter while it works, so
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
    part = _judge(plan, left)
    yield Progress("Checking", 1.0)
    return part


def plan_steps(base: Mesh, pattern: Pattern, feature: Feature, stamp: Mesh | None = None) -> Steps[Plan]:
    """Everything before the boolean; raises like `part_steps`."""
    check_feature(feature, None)
    if (stamp is None) == (feature.profile == "mesh"):
        raise RecipeError("[feature] profile and mesh go together: give both or neither")
    yield Progress("Checking the base", 0.0)
    sound = sound_base(base)
    yield Progress("Measuring the wall", 0.1)
    normal, pattern = pattern.normal, aimed(pattern)
    sizes, shape = feature_sizes(feature, pattern), None
    if stamp is not None:
        shape = make_stamp(stamp, feature)
        sizes = stamp_sizes(feature, sizes, shape, pattern)
    reach = _reaching(pattern, feature)
    wall = near_wall(sound.mesh, sound.tree, reach, *looked_for(feature, sizes, pattern))
    extent, fault = fitted(feature, sizes, pattern, wall, normal)
    fault[colliding(reach, np.flatnonzero(fault == Fault.NONE), extent.top, extent.bottom)] = Fault.MEETS
    yield Progress("Shaping cutters", 0.2)
    chosen = np.flatnonzero(fault == Fault.NONE)
    if feature.plain:
        cutters = make_cutters(pattern, feature, chosen, extent.top[chosen], extent.bottom[chosen])
    elif shape is not None:
        cutters = make_stamps(pattern, feature, sizes, shape, chosen, extent)
    else:
        cutters = make_solids(pattern, feature, sizes, chosen, extent)
    return Plan(feature, pattern, normal, sizes, shape, sound, wall, fault, extent, cutters)


def _reaching(pattern: Pattern, feature: Feature) -> Pattern:
    """The pattern with diameters that no corner reaches beyond: those of circles across flats do."""
    if feature.across != "flats":
        return pattern
    return replace(pattern, diameter=pattern.diameter / np.cos(np.pi / sides(feature, pattern.diameter)))


def cutting_seconds(plan: Plan) -> float:
    """What the boolean of `plan` takes, roughly: within a factor of three on most machines of its time."""
    return SECONDS * (len(plan.sound.mesh.triangles) + len(plan.cutters.mesh.triangles))


def cut(plan: Plan) -> Cut:
    """The boolean of `plan` on its base, split where many holes crowd one face: see `combine`."""
    wall, base = plan.wall, plan.sound.mesh
    through = np.flatnonzero(plan.meets & np.isfinite(wall.seen_axis))
    feature = wall.seen_feature[through]
    pattern = plan.pattern
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
        return Cut(base, face, none)
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
    return Cut(Mesh(np.array(out.vert_properties), order), on_base, on_cutters)


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


def _judge(plan: Plan, left: Cut) -> Part:
    """The Part from what the boolean left: where its faces come from, and what can be measured on it."""
    # numpy's work on large arrays goes on beside the rest
    with ThreadPoolExecutor(1) as beside:
        measured = beside.submit(measure, left.mesh)
        sound = plan.sound
        known, named = carry.same_places(sound.mesh.vertices, left.mesh.vertices)
        whole, turn = carry.whole_faces(left.surface, named, left.face, known[sound.mesh.triangles])
        mesh = Mesh(left.mesh.vertices, carry.turned(left.mesh.triangles, turn))
        owner = plan.cutters.feature[left.facet]
        source = np.concatenate([sound.triangle[left.face], -1 - owner])
        vertex = np.where(named >= 0, sound.vertex[named], -1)
        untouched = np.concatenate([whole, np.zeros(len(owner), dtype=bool)])
        shape = _wall_shapes(left, owner, len(plan.pattern))
        unchanged, notes = _unchanged(plan, left, named, whole)

    failures = _failures(plan)
    problems, pierced, change = _verdict(plan, shape, failures)
    undercut = (plan.fault == Fault.NONE) & undercuts(
        plan.feature, plan.sizes, plan.extent, plan.pattern, plan.normal
    )
    if undercut.any():
        notes = [*notes, _undercut_note(plan, undercut)]
    check = check_part(
        measured.result(),
        sound.measures,
        int(pierced.sum()),
        unchanged,
        problems,
        notes,
        change,
        plan.feature.kind,
    )
    thickness, kind = plan.wall.thickness, plan.feature.kind
    return Part(mesh, source, vertex, untouched, thickness, pierced, failures, check, undercut, kind)


def _undercut_note(plan: Plan, undercut: Bools) -> str:
    first = _place(plan, int(np.flatnonzero(undercut)[0]))
    count = int(undercut.sum())
    return (
        f"{nouns(plan.feature.kind, count)} cannot be drawn off along the pull direction, the first is "
        f"{first}: give more draft, or let the axis follow the pull."
    )


def _verdict(
    plan: Plan, shape: Floats, failures: tuple[tuple[int, str], ...]
) -> tuple[list[str], Bools, int]:
    """What is wrong with single features; which of them pierce the wall, (n,); and by how much they change
    the Euler characteristic of the base.

    shape: (n,) see `_wall_shapes`. Of a solid with the characteristic x the base's surface swallows or cuts
    off regions with the sum r: its wall in the part has x - r, in the place of r, so that the part changes by
    x - 2r. A bump, a dimple or a blind hole (x = 2, r = 1) changes nothing, a hole through the wall, with a
    region on either side, takes two.
    """
    feature, cut = plan.feature, plan.fault == Fault.NONE
    euler, region = (2, 1) if plan.stamp is None else (plan.stamp.euler, plan.stamp.cap_euler)
    blind = cut & (shape == euler - region)
    # where a mesh comes out of the wall again, its regions may be of any kind
    pierced = cut & ((shape == 0) if plan.stamp is None else (shape < euler - region)) & (not feature.adds)
    problems = [text for _, text in failures[:SAID]]
    if len(failures) > SAID:
        problems.append(f"{nouns(f'more {feature.kind}', len(failures) - SAID)} could not be added either.")
    good = pierced if feature.through else blind if plan.stamp is None else pierced | blind
    torn = np.flatnonzero(cut & ~good)
    if len(torn):
        state = "pierces one wall cleanly" if feature.through else "joins the surface in one clean edge"
        problems.append(
            f"Not every {feature.kind} {state}: {len(torn):,} do not, "
            f"the first is {_place(plan, int(torn[0]))}."
        )
    change = int((2 * shape[blind | pierced] - euler).sum())
    return problems, pierced, change


def _unchanged(plan: Plan, left: Cut, named: Ints, whole: Bools) -> tuple[bool, list[str]]:
    """Is the surface the same wherever no cutter reaches? And a note where it is, but in other faces.

    Every face there must come out whole. Only faces narrower than what single precision in a file can hold
    may be dissolved into their neighbours, as the boolean does with slivers and folds.
    """
    base = plan.sound.mesh
    other = np.ones(len(base.triangles), dtype=bool)
    other[left.face[whole]] = False
    other[plan.wall.seen_triangle[plan.meets]] = False
    changed = np.flatnonzero(other)
    if len(changed) == 0:
        return True, []
    slack = SHALLOWEST * float(np.linalg.norm(np.ptp(base.vertices, axis=0)))
    moved = carry.drift(left.mesh, left.face, named, changed, base)
    if moved > slack:
        return False, []
    lost = int((np.bincount(left.face, minlength=len(other))[changed] == 0).sum())
    # faces without area are no loss worth telling
    if lost == 0 or moved < 1e-6 * slack:
        return True, []
    faces = "1 face" if lost == 1 else f"{lost:,} faces"
    return True, [
        f"{faces} of the base narrower than {slack:.1g} merged into the neighbours; "
        f"the surface moved there by at most {moved:.1g}."
    ]


def _wall_shapes(left: Cut, owner: Ints, count: int) -> Floats:
    """Euler characteristic of each feature's wall and floor in the result, (count,): 0 a ring, as of a
    through-hole; 1 a cup, as of a blind one; -1 for a feature without any. owner: (W,) whose the walls are.
    """
    shape = patch_euler(left.walls, owner, left.surface, count)
    shape[np.bincount(owner, minlength=count) == 0] = -1
    return shape


_REASONS = {
    Fault.OFF: "does not lie on the base's surface",
    Fault.FOLDED: "covers a place where the surface folds away or rises steeply: move it or make it smaller",
    Fault.THICK: f"finds no far side of the wall within {DEEPEST:g} diameters, too thick to pierce: "
    "give it a depth or make the wall thinner",
    Fault.CROWDED: "cannot pierce the near wall without cutting into the wall behind it",
    Fault.COVERED: "cannot be reached without cutting into what lies over the surface there",
    Fault.BREAKS: "would break through the wall: make it shallower",
    Fault.MEETS: "would run into another {kind} inside the wall: make it smaller or give it a depth",
    Fault.CLOSED: "closes up before it comes to its end: less draft, a smaller rim or a wider profile helps",
    Fault.RIM: "has a rim deeper than itself or than the wall: make the rim smaller",
    Fault.FLAT: "is lost in the bend of the surface, which is deeper: give it more height or depth",
    Fault.STEEP_CAP: "is deeper than half its diameter, which no spherical cap can be: make it shallower",
    Fault.THIN: "finds no room for its foot in the wall, which is too thin or too steep to its axis",
    Fault.AVERTED: "lies on a surface that faces away from its axis: take another pull direction",
}


def _failures(plan: Plan) -> tuple[tuple[int, str], ...]:
    """A sentence for every feature that was not cut."""
    return tuple(
        (int(which), f"{_place(plan, int(which)).capitalize()} {_reason(plan, int(which))}.")
        for which in np.flatnonzero(plan.fault)
    )


def _reason(plan: Plan, which: int) -> str:
    return _REASONS[Fault(plan.fault[which])].format(kind=plan.feature.kind)


def _place(plan: Plan, which: int) -> str:
    x, y, z = plan.pattern.position[which]
    return f"{plan.feature.kind} {which} at ({x:.4g}, {y:.4g}, {z:.4g})"


def carry_corners(base: Mesh, part: Part, values: Floats) -> Floats:
    """Values on the corners of the base carried to the part: (T, 3, k) -> (T', 3, k); see
    `carry.carry_corners`.
    """
    return carry.carry_corners(base, part.mesh, part.source, values)
