"""What makes a start symmetric by itself: where rows round smooth loops begin, and the lattice's seeds."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from ..isometries import depth, images
from ..mesh import Bools, Floats, Ints
from ..surface import Complex, Spots, positions, to_frame, to_space
from ..symmetry import Symmetry, places_near
from ..vectors import dots
from .bubbles import Ground
from .rim import Starts, on_track

# Lines nearer to each other than this, in pitches, are each other's images.
SAME_LINE = 0.3
# A seed that the region lets come no nearer than this, in pitches, to where it is its own image is none.
ON_IT = 0.02
# A straight stretch whose middle is nearer than this, in pitches, to its own image suits the symmetry.
SUITS = 0.3
# Rows of a hexagonal lattice and its mirror lines are at multiples of this angle.
TWELFTH = np.pi / 6
ROUNDS = 12


def loop_starts(ground: Ground) -> Starts | None:
    """Where on every line the first row begins, (C,) arcs, and of what its count must be a multiple, (C,);
    None without a symmetry.

    Rows round a loop that is its own mirror image begin on the plane, those round the image of another loop
    where the other's begin.
    """
    symmetry, track = ground.symmetry, ground.track
    if symmetry is None or not len(track.arc):
        return None
    lines = len(track.closed)
    first = np.searchsorted(track.chain, np.arange(lines))
    arc, multiple = track.arc[first].copy(), np.ones(lines, dtype=np.int64)
    goes_to = _lines_of_images(ground, symmetry)
    proper = np.linalg.det(symmetry.group.turns) > 0
    done = np.zeros(lines, dtype=bool)
    for line in np.flatnonzero(track.closed):
        if done[line]:
            continue
        done[line] = True
        own = goes_to[:, line] == line
        multiple[line] = int((own & proper).sum())
        mirrors = np.flatnonzero(own & ~proper)
        if len(mirrors):
            arc[line] = _crossing(ground, int(line), symmetry.group.turns[mirrors[0]], symmetry.group.centre)
        point = on_track(track, arc[[line]])[0]
        for number, other in enumerate(goes_to[:, line]):
            if other >= 0 and not done[other] and track.closed[other]:
                done[other], multiple[other] = True, multiple[line]
                arc[other] = _nearest_on(ground, int(other), images(symmetry.group, point)[number, 0])
    return Starts(arc, multiple)


def _lines_of_images(ground: Ground, symmetry: Symmetry) -> Ints:
    """Line (k, C) that each isometry takes each line of the track to, -1 where that is none."""
    track = ground.track
    lines = len(track.closed)
    tree = cKDTree(track.points)
    result = np.full((len(symmetry.group), lines), -1)
    for line in range(lines):
        knots = np.flatnonzero(track.chain == line)
        some = knots[:: len(knots) // 8 + 1]
        pitch = ground.pitch(track.spots.take(some))
        distance, near = tree.query(images(symmetry.group, track.points[some]))
        there = track.chain[near]
        same = (distance < SAME_LINE * pitch).all(axis=1) & (there == there[:, :1]).all(axis=1)
        result[same, line] = there[same, 0]
    return result


def _crossing(ground: Ground, line: int, mirror: Floats, centre: Floats) -> float:
    """Arc where a line crosses the plane of a mirror, or comes nearest to it."""
    track = ground.track
    knots = np.flatnonzero(track.chain == line)
    # A mirror (3, 3) is 1 - 2 n n: its normal is the longest column of 1 - mirror.
    columns = np.eye(3) - mirror
    side = (track.points[knots] - centre) @ columns[:, np.linalg.norm(columns, axis=0).argmax()]
    at = int(np.abs(side).argmin())
    for before in (at - 1, at):
        if 0 <= before < len(knots) - 1 and side[before] * side[before + 1] < 0:
            share = side[before] / (side[before] - side[before + 1])
            low, high = track.arc[knots[before : before + 2]]
            return float(low + share * (high - low))
    return float(track.arc[knots[at]])


def _nearest_on(ground: Ground, line: int, point: Floats) -> float:
    """Arc of the place on a line that is nearest to `point` (3,)."""
    track = ground.track
    knots = np.flatnonzero(track.chain == line)
    start, along = track.points[knots[:-1]], np.diff(track.points[knots], axis=0)
    square = np.maximum(dots(along, along), 1e-300)
    share = np.clip(dots(point - start, along) / square, 0, 1)
    best = int(np.linalg.norm(start + share[:, None] * along - point, axis=1).argmin())
    low, high = track.arc[knots[best : best + 2]]
    return float(low + share[best] * (high - low))


def suiting(ground: Ground, points: Floats, pitch: Floats) -> Bools:
    """Which of the points (n, 3) are near to where every isometry leaves them, (n,): all without one."""
    if ground.symmetry is None:
        return np.ones(len(points), dtype=bool)
    group = ground.symmetry.group
    still = images(group, points).mean(axis=0)
    return np.linalg.norm(still - points, axis=1) < SUITS * pitch


def symmetric_seeds(
    ground: Ground, seeds: Spots, directions: Complex, anywhere: bool
) -> tuple[Spots, Complex, Floats]:
    """Seeds of lattices that are symmetric themselves, where the parts of the region are; their row
    directions; and the points (s, 3) that the seeds stand for, which where the region is flat and they may be
    `anywhere` may be outside it.

    A lattice through a point of a plane with a row along it, or at a multiple of 30 degrees to it, is its own
    mirror image; one round an axis is so for 2-, 3- and 6-fold rotations.
    """
    points = positions(ground.charts, seeds)
    symmetry = ground.symmetry
    if symmetry is None:
        return seeds, directions, points
    row, bary, headings = seeds.row.copy(), seeds.barycentric.copy(), directions.copy()
    own = _own_parts(ground, symmetry, seeds)
    for part in range(len(row)):
        seed = seeds.take(np.array([part]))
        for chosen in _subgroups(symmetry, own[:, part]):
            turns = symmetry.group.turns[chosen]
            if anywhere:
                points[part] = _still(symmetry, points[part], turns)
                headings[part] = _rounded(ground, seed, headings[part], turns)
                break
            found, target, off = _still_place(ground, symmetry, seed, turns)
            if off < ON_IT:
                row[part], bary[part], points[part] = found.row[0], found.barycentric[0], target
                headings[part] = _rounded(ground, found, _carried(ground, seed, found, headings[part]), turns)
                break
        else:
            found, headings[part] = _led_image(ground, symmetry, seed, headings[part], own[:, part])
            row[part], bary[part] = found.row[0], found.barycentric[0]
    return Spots(row, bary), headings, points


def _own_parts(ground: Ground, symmetry: Symmetry, seeds: Spots) -> Bools:
    """Whether an isometry takes a part of the region to itself, (k, s), judged by its seed."""
    region = ground.charts.region
    own = np.ones((len(symmetry.group), len(seeds.row)), dtype=bool)
    if region.sheet.max() == 0:
        return own
    at = images(symmetry.group, positions(ground.charts, seeds))
    for number, turn in enumerate(symmetry.group.turns):
        normals = region.normals[seeds.row] @ turn.T
        place, _ = places_near(symmetry.finder, at[number], normals, 1e-9 * ground.pitch(seeds))
        own[number] = region.sheet[place.row] == region.sheet[seeds.row]
    return own


def _subgroups(symmetry: Symmetry, own: Bools) -> list[Ints]:
    """Sets of isometries that a seed may be still under: as many as may be, then one mirror alone."""
    everyone = np.flatnonzero(own)
    mirrors = [g for g in everyone if np.linalg.det(symmetry.group.turns[g]) < 0]
    return [everyone, *(np.array([0, mirror]) for mirror in mirrors)]


def _still_place(
    ground: Ground, symmetry: Symmetry, seed: Spots, turns: Floats
) -> tuple[Spots, Floats, float]:
    """The place near `seed` that the isometries leave where it is, that point (3,), and how far the place is
    from it, in pitches.
    """
    target = _still(symmetry, positions(ground.charts, seed), turns)
    normals, pitch = ground.charts.region.normals[seed.row], ground.pitch(seed)
    for _ in range(ROUNDS):
        found, _ = places_near(symmetry.finder, target, normals, 1e-9 * pitch)
        at = positions(ground.charts, found)
        if ground.charts.region.flat:
            break
        target = _still(symmetry, at, turns)
    return found, target[0], float(np.linalg.norm(target - at) / pitch[0])


def _led_image(
    ground: Ground, symmetry: Symmetry, seed: Spots, heading: complex, own: Bools
) -> tuple[Spots, complex]:
    """The image of a seed under those of the isometries that are its part's `own`, (k,), that is deepest
    inside where leaders are packed; and its direction there.
    """
    at = images(symmetry.group, positions(ground.charts, seed))[:, 0]
    number = int(np.where(own, depth(symmetry.group, at), -np.inf).argmax())
    if number == 0:
        return seed, heading
    turn, within = symmetry.group.turns[number], 1e-9 * ground.pitch(seed)
    normals = ground.charts.region.normals[seed.row] @ turn.T
    found, _ = places_near(symmetry.finder, at[[number]], normals, within)
    along = to_space(ground.charts, seed.row, np.array([heading])) @ turn.T
    there = to_frame(ground.charts, found.row, along)[0]
    return found, complex(there / abs(there))


def _still(symmetry: Symmetry, points: Floats, turns: Floats) -> Floats:
    """The points (..., 3) moved to where the isometries with these `turns` (k, 3, 3) leave them."""
    centre = symmetry.group.centre
    return centre + (points - centre) @ turns.mean(axis=0).T


def _carried(ground: Ground, seed: Spots, found: Spots, heading: complex) -> complex:
    """A direction at `seed` as seen in the frame at `found`."""
    across = to_space(ground.charts, seed.row, np.array([heading]))
    there = to_frame(ground.charts, found.row, across)[0]
    return complex(there / abs(there)) if abs(there) > 1e-9 else 1 + 0j


def _rounded(ground: Ground, found: Spots, heading: complex, turns: Floats) -> complex:
    """The direction nearest to `heading` whose lattice the mirrors among the isometries leave as it is."""
    for turn in turns:
        if np.linalg.det(turn) < 0:
            columns = np.eye(3) - turn
            normal = columns[:, [np.linalg.norm(columns, axis=0).argmax()]].T
            across = to_frame(ground.charts, found.row, normal)[0]
            across /= abs(across)
            angle = np.round(np.angle(heading / across) / TWELFTH) * TWELFTH
            return complex(across * np.exp(1j * angle))
    return heading
