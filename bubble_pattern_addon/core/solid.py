"""Step 3: add the features to the base geometry in one boolean, then measure what came out."""

from __future__ import annotations

from dataclasses import dataclass

import manifold3d
import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from .boxtree import build_tree
from .errors import BaseError, RecipeError
from .feature import Cutters, make_cutters
from .mesh import Bools, Floats, Ints, Mesh
from .pattern import Pattern
from .progress import Progress, Steps
from .recipe import Feature
from .soundness import SoundBase, edge_keys, signed_volumes, sound_base
from .wall import DEEPEST, Fault, NearWall, near_wall


@dataclass(frozen=True)
class Check:
    """Measured on the part, never assumed.

    watertight: every edge is shared by exactly two faces, in opposite directions
    euler, base_euler: V - E + F of the part and of the base; every through-hole takes two
    genus: handles of the part, all shells together
    bodies, base_bodies: closed shells around material; cavities: shells around enclosed hollows
    volume, base_volume, removed_volume: in cubic units
    through: holes that pierce their wall
    unchanged: every face of the base that no feature touches came out as it went in
    problems: one sentence each; empty when the part is good
    """

    watertight: bool
    euler: int
    base_euler: int
    genus: int
    bodies: int
    base_bodies: int
    cavities: int
    volume: float
    base_volume: float
    removed_volume: float
    through: int
    unchanged: bool
    problems: tuple[str, ...]


@dataclass(frozen=True)
class Part:
    """The base with its features, n of them.

    mesh: the part; source: (T',) triangle of the base each of its triangles lies on, -1 - feature id on a
        feature's wall
    vertex: (V',) vertex of the base at exactly this place, -1 for a vertex the cut made
    untouched: (T',) triangles that are triangles of the base as they were, corner for corner
    thickness: (n,) thickness of the near wall along each feature's axis, nan where no far side was found
    pierced: (n,) the feature goes through the near wall (False for a blind hole)
    failures: (feature id, sentence) for every feature that was not added
    """

    mesh: Mesh
    source: Ints
    vertex: Ints
    untouched: Bools
    thickness: Floats
    pierced: Bools
    failures: tuple[tuple[int, str], ...]
    check: Check


@dataclass(frozen=True)
class Plan:
    """What will be cut: the base made ready, its near walls, the features that can be cut and their
    cutters.
    """

    sound: SoundBase
    wall: NearWall
    fault: Ints
    cutters: Cutters


def part_steps(base: Mesh, pattern: Pattern, feature: Feature) -> Steps[Part]:
    """Add every feature of `pattern` to `base`; a generator of Progress that returns the Part.

    Raises BaseError when the base is not fit for a solid, RecipeError when the feature makes no sense. A
    single feature that cannot be added (wall too thick, next wall too close) is left out and reported in the
    part.
    """
    plan = yield from plan_steps(base, pattern, feature)
    yield Progress("Cutting", 0.3)
    mesh, raw = subtract(plan.sound.mesh, plan.cutters)
    yield Progress("Checking", 0.8)
    part = _judge(base, pattern, feature, plan, mesh, raw)
    yield Progress("Checking", 1.0)
    return part


def plan_steps(base: Mesh, pattern: Pattern, feature: Feature) -> Steps[Plan]:
    """Everything before the boolean; raises like `part_steps`."""
    if feature.kind != "hole":
        raise RecipeError(f"There is no feature kind “{feature.kind}”: use “hole”.")
    if feature.depth is not None and not feature.depth > 0:
        raise RecipeError("A blind hole's depth must be above zero; leave it out for through-holes.")
    yield Progress("Checking the base", 0.0)
    sound = sound_base(base)
    yield Progress("Measuring the wall", 0.1)
    deepest = DEEPEST * pattern.diameter
    if feature.depth is not None:
        deepest = np.maximum(deepest, 2 * feature.depth)
    wall = near_wall(sound.mesh, build_tree(sound.mesh.corners), pattern, deepest)
    fault = wall.fault.copy()
    bottom = wall.bottom
    if feature.depth is not None:
        bottom = np.full(len(pattern), feature.depth)
        fault[(fault == Fault.THICK) | (fault == Fault.CROWDED)] = Fault.NONE
        fault[(wall.near_far >= -feature.depth * (1 + 1e-9)) & (fault == Fault.NONE)] = Fault.BREAKS
    else:
        bottom = -bottom
    yield Progress("Shaping cutters", 0.2)
    chosen = np.flatnonzero(fault == Fault.NONE)
    return Plan(sound, wall, fault, make_cutters(pattern, feature, chosen, wall.top[chosen], bottom[chosen]))


def subtract(base: Mesh, cutters: Cutters) -> tuple[Mesh, Ints]:
    """`base` less `cutters`, one boolean: the result and the facet each triangle lies on, (T',).

    Facets: the base's triangle, or -1 - a facet of the cutters. Faces keep their identity through the
    boolean, which also keeps it from merging any of the base's own edges, however flat.
    """
    if len(cutters.facet) == 0:
        return base, np.arange(len(base.triangles))
    first = manifold3d.Manifold.reserve_ids(2)
    solid = _manifold(base, np.arange(len(base.triangles)), first)
    tool = _manifold(cutters.mesh, cutters.facet, first + 1)
    result = solid - tool
    if result.status() != manifold3d.Error.NoError:
        raise BaseError(f"The features could not be cut ({result.status().name}): check the base for flaws.")
    out = result.to_mesh64()
    facet = np.array(out.face_id, dtype=np.int64)
    ends = np.array(out.run_index, dtype=np.int64) // 3
    from_tool = np.repeat(np.array(out.run_original_id) == first + 1, ends[1:] - ends[:-1])
    mesh = Mesh(np.array(out.vert_properties)[:, :3], np.array(out.tri_verts, dtype=np.int64))
    return mesh, np.where(from_tool, -1 - facet, facet)


def _manifold(mesh: Mesh, facet: Ints, name: int) -> manifold3d.Manifold:
    """`mesh` for the boolean in double precision, every triangle marked with its `facet`, all under the id
    `name`.
    """
    solid = manifold3d.Manifold(
        manifold3d.Mesh64(
            vert_properties=np.ascontiguousarray(mesh.vertices),
            tri_verts=np.ascontiguousarray(mesh.triangles, dtype=np.uint64),
            face_id=facet.astype(np.uint64),
            run_index=np.array([0, mesh.triangles.size], dtype=np.uint64),
            run_original_id=np.array([name], dtype=np.uint32),
        )
    )
    if solid.status() != manifold3d.Error.NoError:
        raise BaseError(f"The base is not a solid ({solid.status().name}): repair the mesh first.")
    return solid


def _judge(base: Mesh, pattern: Pattern, feature: Feature, plan: Plan, mesh: Mesh, facet: Ints) -> Part:
    """The Part from the boolean's result: where its faces come from, and what can be measured on it."""
    sound, cutters = plan.sound, plan.cutters
    wall_face = facet < 0
    source = np.where(wall_face, 0, sound.triangle[np.where(wall_face, 0, facet)])
    if len(cutters.feature):
        source[wall_face] = -1 - cutters.feature[-1 - facet[wall_face]]
    vertex = _match_vertices(sound, mesh)
    untouched = _untouched(base, sound, facet, vertex[mesh.triangles])
    cut = np.zeros(len(pattern), dtype=bool)
    cut[cutters.feature] = True
    capped = np.zeros(len(pattern), dtype=bool)
    ends = (
        cutters.feature[-1 - facet[wall_face]][cutters.cap[-1 - facet[wall_face]] != 0] if cut.any() else []
    )
    capped[ends] = True
    pierced = cut & ~capped if feature.depth is None else np.zeros(len(pattern), dtype=bool)
    failures = _failures(pattern, feature, plan)
    check = _check(plan, feature, mesh, pierced, cut, untouched, facet, failures)
    return Part(mesh, source, vertex, untouched, plan.wall.thickness, pierced, failures, check)


def _match_vertices(sound: SoundBase, mesh: Mesh) -> Ints:
    """Caller's vertex at exactly each vertex of `mesh`, -1 where there is none, (V',)."""
    own = sound.mesh.vertices
    keys = _place_keys(own)
    order = np.argsort(keys, kind="stable")
    asked = _place_keys(mesh.vertices)
    nearest = order[np.minimum(np.searchsorted(keys[order], asked), len(own) - 1)]
    same = np.all(own[nearest] == mesh.vertices, axis=1)
    return np.where(same, sound.vertex[nearest], -1)


def _place_keys(points: Floats) -> np.ndarray:
    """A number per place, equal for equal places, (n,) uint64; adding 0 makes -0 and 0 the same place."""
    bits = (points + 0.0).view(np.uint64)
    return (
        bits[:, 0] * np.uint64(0x9E3779B97F4A7C15)
        + (bits[:, 1] ^ (bits[:, 1] >> np.uint64(29))) * np.uint64(0xBF58476D1CE4E5B9)
        + (bits[:, 2] ^ (bits[:, 2] >> np.uint64(31))) * np.uint64(0x94D049BB133111EB)
    )


def _untouched(base: Mesh, sound: SoundBase, facet: Ints, corners: Ints) -> Bools:
    """Triangles of the result, (T',), that are a whole triangle of the base with the same three corners."""
    pieces = np.bincount(facet[facet >= 0], minlength=len(sound.triangle))
    candidate = np.flatnonzero((facet >= 0) & np.all(corners >= 0, axis=1))
    candidate = candidate[pieces[facet[candidate]] == 1]
    before = sound.vertex[sound.mesh.triangles[facet[candidate]]]
    same = np.zeros(len(facet), dtype=bool)
    same[candidate] = np.all(np.sort(before, axis=1) == np.sort(corners[candidate], axis=1), axis=1)
    return same


_REASONS = {
    Fault.OFF: "does not lie on the base's surface",
    Fault.FOLDED: "covers a place where the surface folds away or rises steeply: move it or make it smaller",
    Fault.THICK: "finds no far side of the wall within reach: give it a depth, or make the wall thinner",
    Fault.CROWDED: "cannot pierce the near wall without cutting into the wall behind it",
    Fault.BREAKS: "would break through the wall: make it shallower",
    Fault.MEETS: "would run into another hole inside the wall: make it smaller or give it a depth",
}


def _failures(pattern: Pattern, feature: Feature, plan: Plan) -> tuple[tuple[int, str], ...]:
    """A sentence for every feature that was not cut."""
    return tuple(
        (int(which), f"Hole {which} at ({x:.4g}, {y:.4g}, {z:.4g}) {_REASONS[Fault(plan.fault[which])]}.")
        for which in np.flatnonzero(plan.fault)
        for x, y, z in [pattern.position[which]]
    )


def is_watertight(triangles: Ints) -> bool:
    """Is every edge shared by exactly two triangles, in opposite directions?"""
    keys = np.sort(edge_keys(triangles)[0])
    first, second = keys[::2], keys[1::2]
    return (
        len(keys) % 2 == 0
        and bool(np.all(second == first + 1))
        and bool(np.all(first % 2 == 0))
        and bool(np.all(second[:-1] < first[1:]))
    )


def euler_number(triangles: Ints) -> int:
    """V - E + F of a closed surface, whose edges are 3/2 of its faces."""
    used = np.zeros(int(triangles.max()) + 1 if len(triangles) else 0, dtype=bool)
    used[triangles] = True
    return int(used.sum()) - len(triangles) * 3 // 2 + len(triangles)


def shell_volumes(mesh: Mesh) -> Floats:
    """Signed volume of every connected shell, (shells,); a cavity's is negative."""
    start, end = mesh.triangles[:, 0], mesh.triangles[:, 1]
    number = len(mesh.vertices)
    graph = coo_array(
        (
            np.ones(len(start) * 2, dtype=np.int8),
            (np.concatenate([start, start]), np.concatenate([end, mesh.triangles[:, 2]])),
        ),
        (number, number),
    )
    label = connected_components(graph, directed=False)[1][start]
    volumes = np.bincount(label, weights=signed_volumes(mesh))
    return volumes[np.bincount(label) > 0]


def _check(
    plan: Plan,
    feature: Feature,
    mesh: Mesh,
    pierced: Bools,
    cut: Bools,
    untouched: Bools,
    facet: Ints,
    failures: tuple[tuple[int, str], ...],
) -> Check:
    """Measure the result and say what is wrong with it."""
    base = plan.sound.mesh
    before, after = shell_volumes(base), shell_volumes(mesh)
    euler, base_euler = euler_number(mesh.triangles), euler_number(base.triangles)
    volume, base_volume = float(after.sum()), float(before.sum())
    unchanged = True
    problems = [text for _, text in failures[:3]]
    if len(failures) > 3:
        problems.append(f"{len(failures) - 3:,} more holes were not cut.")
    watertight = is_watertight(mesh.triangles)
    if not watertight:
        problems.append("The part is not watertight.")
    expected = base_euler - 2 * int(pierced.sum())
    if euler != expected:
        problems.append(f"The part's Euler characteristic is {euler}, it should be {expected}.")
    bodies, base_bodies = int((after > 0).sum()), int((before > 0).sum())
    if bodies > base_bodies:
        problems.append(f"{bodies - base_bodies} loose pieces were cut off the part.")
    return Check(
        watertight,
        euler,
        base_euler,
        len(after) - euler // 2,
        bodies,
        base_bodies,
        int((after < 0).sum()),
        volume,
        base_volume,
        base_volume - volume,
        int(pierced.sum()),
        unchanged,
        tuple(problems),
    )


def carry_corners(base: Mesh, part: Part, values: Floats) -> Floats:
    """Corner values of the base carried to the part: (T, 3, k) -> (T', 3, k), linear on every base triangle.

    Zero on the walls of features, which lie on no triangle of the base. Corners that are corners of the base
    keep their value bit for bit.
    """
    carried = np.zeros((len(part.source), 3, values.shape[2]), dtype=values.dtype)
    on_base = np.flatnonzero(part.source >= 0)
    source = part.source[on_base]
    a, b, c = base.corners[source].swapaxes(0, 1)
    plane = np.cross(b - a, c - a)
    size = np.einsum("ij,ij->i", plane, plane)
    offset = part.mesh.corners[on_base] - a[:, None]
    share = np.empty((len(on_base), 3, 3))
    for corner in range(3):
        share[:, corner, 1] = np.einsum("ij,ij->i", np.cross(offset[:, corner], c - a), plane)
        share[:, corner, 2] = np.einsum("ij,ij->i", np.cross(b - a, offset[:, corner]), plane)
    share[..., 1:] /= np.where(size > 0, size, 1)[:, None, None]
    share[..., 0] = 1 - share[..., 1] - share[..., 2]
    match = part.vertex[part.mesh.triangles[on_base]][:, :, None] == base.triangles[source][:, None]
    known = match.any(axis=2)
    share[known] = match[known]
    carried[on_base] = np.einsum("tij,tjk->tik", share, values[source])
    return carried
