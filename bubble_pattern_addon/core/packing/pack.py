"""Step 1 as a whole: first row, lattice, relaxation, population control, last stiff phase."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction
from functools import partial

import numpy as np
from scipy.spatial import cKDTree

from ..boundary import make_boundary, nearest_boundary, signature
from ..errors import RegionError
from ..isometries import OFF
from ..mesh import Bools, Floats
from ..metric import Constant, Field
from ..progress import Progress, Steps, within
from ..quality import measure_points
from ..recipe import Packing, rounded
from ..region import Region
from ..surface import Charts, Complex, Spots, on_base, positions, to_frame, walk
from ..symmetry import find_symmetry
from .bubbles import Bubbles, Ground, Pins, can_move, joined
from .crowding import close_pairs, uncrowded
from .direction import smooth_directions
from .domain import all_reached, grown_here, led_here
from .force import STIFFNESS, stiff_law
from .inset import inset_track
from .lattice import growing_steps
from .narrows import in_the_narrows
from .orbits import orbit_sizes, settled_leaders, symmetric_start, with_followers
from .pins import PUSHED, check_apart, clear_of, on_surface, track_through, with_pins
from .plane import fills_its_box, lay
from .plane_growth import grown_in_plane
from .plane_rows import rather_along, with_plane_rows
from .population import control
from .relax import relax_steps
from .rim import (
    FirstRow,
    Lengths,
    Track,
    first_row,
    on_track,
    spots_on_track,
    straight_stretches,
)
from .rk4 import integration_steps
from .symmetric_field import symmetric_mean
from .symmetric_start import loop_starts, suiting, symmetric_seeds

# A recipe that asks for more bubbles than this is taken for a slip of the pen.
MOST = 1_000_000
# Lattice bubbles nearer to the boundary than this many pitches give way to the first row.
CLEAR_OF_RIM = 1.0
# In so many parts of a flat region graded lattices grow one by one in the plane, in more all at once.
PARTS = 8
# A straight stretch of the first row sets the lattice's direction when it is longer than this, in pitches.
LONG_ENOUGH = 6.0
# Bubbles of the first row closer than this, as across a narrow neck, do not both fit.
TOO_CLOSE = 0.8
# Directions that are tried for the best arrangement, in degrees; sixty mean the same lattice.
TURNS = (0.0, 15.0, 30.0, 45.0)
# Where nothing holds the bubbles together they are packed at this share of the pitch that would fill the
# surface exactly. The tighter, the more regular their angles, and the smaller the smallest gaps round the
# defects that a closed surface must have: an even icosahedral lattice on a sphere of 1,000 has psi6 .92 to
# .95 itself, by how far its gaps are evened out.
CRAMPED = 1.04
# Rounds of relaxation and population control, by the share of the recipe's steps that each may take (whoever
# comes or goes after the first stirs but a few neighbours), as long as more than FEW_CHANGED of the bubbles
# came or went: the last phase evens it out. In a graded pattern, where many do, it does so best at once.
ROUNDS = (Fraction(1), Fraction(1, 2), Fraction(1, 2))
ROUNDS_GRADED = (Fraction(2, 3),)
FEW_CHANGED = 0.01
# Steps of the last phase, and how often it may be done again.
STIFF_STEPS, LAST_ROUNDS = 45, 4
# Whoever comes or goes in the last phases stirs others so far away, in pitches.
STIRRED = 6.0
NOT_SYMMETRIC = "The pattern is not symmetric: some of its features are placed by hand."


def pack_steps(region: Region, packing: Packing) -> Steps[tuple[Ground, Bubbles]]:
    """Bubbles packed tightly in `region`. Raises RegionError where the pitch does not suit the region."""
    yield Progress("Reading the region", 0.0)
    ground = ground_of(region, packing)
    charts = ground.charts
    if packing.pins:
        ground = _pinned(ground, packing)
    else:
        asked = packing.symmetry, packing.symmetry_centre, packing.symmetry_axes
        finding = find_symmetry(charts, ground.boundary, ground.pitch, *asked)
        ground = replace(ground, symmetry=finding.symmetry, notes=finding.notes)
    row = first_row(ground.track, loop_starts(ground))
    spots = spots_on_track(charts, ground.track, row.arc) if len(row.arc) else _nobody()
    apart = _without_conflicts(ground, row, spots)
    first, between = in_the_narrows(ground, row.take(apart), spots.take(apart))
    fixed, inner = with_pins(ground, first, between)
    ground, bubbles = yield from _filled(ground, fixed, packing)
    return ground, replace(bubbles, inner=inner)


def ground_of(region: Region, packing: Packing) -> Ground:
    """What bubbles are packed on, without symmetry and pins. RegionError where the pitch does not suit."""
    charts = region.charts
    pitch = _pitch_over(region, packing.pitch)
    _check_count(region, pitch)
    uniform = packing.pitch.value if isinstance(packing.pitch, Constant) else None
    return _ground(charts, pitch, uniform, packing.edge_offset)


def _pinned(ground: Ground, packing: Packing) -> Ground:
    """The ground with the pins of the recipe, and the first row's track through those that are near it."""
    pins = on_surface(ground.charts, np.array(packing.pins), ground.pitch, "pinned feature")
    local = ground.pitch(pins)
    check_apart(ground.charts, pins, local)
    track, on_track = track_through(ground.track, ground.charts, pins, local)
    notes = () if packing.symmetry == OFF else (NOT_SYMMETRIC,)
    return replace(ground, track=track, pins=Pins(pins, on_track), notes=notes)


def _filled(ground: Ground, fixed: Spots, packing: Packing) -> Steps[tuple[Ground, Bubbles]]:
    """The bubbles that are `fixed`, and a lattice as the recipe wants it among them."""
    if packing.orientation == "best":
        return ground, (yield from _best_of_several(ground, fixed, packing))
    rows = packing.orientation if isinstance(packing.orientation, tuple) else None
    return ground, (yield from _settled(ground, fixed, packing, *_seeds(ground, packing.seed, rows)))


def _best_of_several(ground: Ground, fixed: Spots, packing: Packing) -> Steps[Bubbles]:
    """The best of the arrangements whose rows start along the longest straight edge and TURNS of it."""
    seeds, directions = _seeds(ground, packing.seed, None)
    best, highest = Bubbles(fixed, len(fixed.row)), -np.inf
    for number, turn in enumerate(TURNS):
        trial = _settled(ground, fixed, packing, seeds, directions * np.exp(1j * np.radians(turn)))
        bubbles = yield from within(trial, number / len(TURNS), (number + 1) / len(TURNS))
        merit = _merit(ground, bubbles)
        if merit > highest:
            best, highest = bubbles, merit
    return best


def _merit(ground: Ground, bubbles: Bubbles) -> float:
    """How good an arrangement looks: order and smallest gap, each between 0 and 1."""
    region, spots = ground.charts.region, bubbles.spots
    quality = measure_points(
        positions(ground.charts, spots),
        region.normals[spots.row],
        local_pitch(ground, bubbles),
        can_move(bubbles).astype(np.int64),
        region.boundary_segments,
    )
    return float(np.nansum([quality.six, quality.psi6, quality.gap_min]))


def _settled(
    ground: Ground, fixed: Spots, packing: Packing, seeds: Spots, directions: Complex
) -> Steps[Bubbles]:
    """Bubbles in balance: those that are `fixed`, and a lattice from `seeds` with rows along `directions`."""
    yield Progress("Growing the lattice", 0.1)
    lattice = yield from within(_lattice(ground, seeds, directions), 0.1, 0.2)
    if ground.pins is not None:
        lattice = clear_of(ground, lattice, ground.pins.spots, PUSHED)
    bubbles = Bubbles(joined(fixed, lattice), len(fixed.row))
    if ground.symmetry is not None:
        bubbles = symmetric_start(ground, bubbles)
    if not len(bubbles):
        raise RegionError(
            "No bubble fits into the target region: it is narrower than one pitch everywhere; use a smaller "
            "pitch or a larger region."
        )
    for number, share in enumerate(ROUNDS if ground.uniform is not None else ROUNDS_GRADED):
        yield Progress("Packing the bubbles", 0.2 + 0.2 * number)
        local = local_pitch(ground, bubbles)
        settle = relax_steps if packing.integrator == "fire" else integration_steps
        steps = max(int(packing.iterations * share), 1)
        settling = settle(ground, bubbles, filling(ground, bubbles, local), steps, packing.tolerance)
        bubbles, work = yield from within(settling, 0.2 + 0.2 * number, 0.4 + 0.2 * number)
        bubbles, local = _on_planes_again(ground, bubbles, local)
        bubbles, changed = control(ground, bubbles, local, near=work.near)
        if changed <= FEW_CHANGED * len(bubbles):
            break
    yield Progress("Evening out the gaps", 0.8)
    moving: Bools | None = None
    for number in range(LAST_ROUNDS):
        local = local_pitch(ground, bubbles)
        size, stiffness = filling(ground, bubbles, local), 1.0 + STIFFNESS
        evening = relax_steps(
            ground,
            bubbles,
            size,
            STIFF_STEPS,
            packing.tolerance,
            stiff_law,
            stiffness,
            moving,
            stage="Evening out the gaps",
        )
        bubbles, work = yield from within(evening, 0.8, 0.95)
        # What stiff contacts have squeezed through the first row has no place between it and the boundary,
        # and what these have opened another bubble may fit into.
        bubbles, local = _on_planes_again(ground, bubbles, local_pitch(ground, bubbles))
        before, more = bubbles, number + 1 < LAST_ROUNDS
        bubbles, changed = control(ground, bubbles, local, True, more, moving, work.near)
        if not changed:
            break
        if ground.uniform is None and ground.symmetry is None:
            moving = _near_changes(ground, before, bubbles)
    if ground.symmetry is not None:
        bubbles = with_followers(ground, settled_leaders(ground, bubbles))
    return bubbles


def _near_changes(ground: Ground, before: Bubbles, after: Bubbles) -> Bools:
    """Which of the bubbles `after` population control may move, (n,): those near whoever has come or gone."""
    then, now = (positions(ground.charts, bubbles.spots) for bubbles in (before, after))
    # Whoever stayed stands exactly where it stood.
    old, new = (points[:, 0] + np.pi * points[:, 1] + np.e * points[:, 2] for points in (then, now))
    changed = np.concatenate([now[~np.isin(new, old)], then[~np.isin(old, new)]])
    changes = cKDTree(changed, balanced_tree=False, compact_nodes=False)
    return np.asarray(changes.query(now)[0] < STIRRED * local_pitch(ground, after))


def _on_planes_again(ground: Ground, bubbles: Bubbles, local: Floats) -> tuple[Bubbles, Floats]:
    """The bubbles of a symmetric pattern after they have moved, those on planes exactly there: one beside its
    own image would crowd that. And their local pitches (n,).
    """
    if ground.symmetry is None:
        return bubbles, local
    bubbles = settled_leaders(ground, bubbles)
    return bubbles, local_pitch(ground, bubbles)


def filling(ground: Ground, bubbles: Bubbles, local: Floats) -> Floats:
    """The pitches (n,) at which n bubbles of the `local` ones fill a surface without a boundary.

    Nothing holds them together there: whoever is missing for a full arrangement would leave the others loose
    and uneven.
    """
    if ground.boundary is not None:
        return local
    share = orbit_sizes(ground, bubbles, local)
    room = ground.charts.region.area / (np.sqrt(0.75) * (share * local**2).sum())
    return local * max(CRAMPED * np.sqrt(room), 1.0)


def local_pitch(ground: Ground, bubbles: Bubbles) -> Floats:
    """Packing metric at the bubbles, (n,)."""
    return ground.pitch(bubbles.spots)


def _pitch_over(region: Region, field: Field) -> Lengths:
    def pitch(spots: Spots) -> Floats:
        return field(on_base(region, spots))

    return pitch


def _check_count(region: Region, pitch: Lengths) -> None:
    """Raises RegionError where the pitch is no length, or so small that it means over a million bubbles."""
    rows = np.arange(len(region.triangles))
    local = pitch(Spots(rows, np.full((len(rows), 3), 1 / 3)))
    if not (np.isfinite(local).all() and local.min() > 0):
        raise RegionError("The pitch must be a positive length everywhere in the target region: raise it.")
    area = np.linalg.norm(region.area_vectors, axis=1) / 2
    count = float((area / (np.sqrt(0.75) * local**2)).sum())
    if count > MOST:
        mean = float(local.mean())
        raise RegionError(
            f"A pitch of {{pitch}} means about {count:,.0f} features in this region, more than {MOST:,}: "
            "use a pitch of at least {fitting}, or a smaller region",
            pitch=rounded(mean),
            fitting=float(f"{mean * np.sqrt(count / MOST):.3g}"),
        )


def _ground(charts: Charts, pitch: Lengths, uniform: float | None, edge_offset: float) -> Ground:
    rim = charts.region.rim
    if not len(rim):
        nothing = np.empty(0)
        empty = Spots(nothing.astype(np.int64), np.empty((0, 3)))
        track = Track(
            empty, np.empty((0, 3)), nothing, empty.row, empty.row.astype(bool), nothing.astype(bool)
        )
        return Ground(charts, None, track, pitch, uniform, edge_offset)
    finest = float(pitch(Spots(rim[:, 0], np.full((len(rim), 3), 1 / 3))).min())
    boundary = make_boundary(charts.region, finest / 8)
    assert boundary is not None
    track = inset_track(charts, boundary, pitch, edge_offset)
    return Ground(charts, boundary, track, pitch, uniform, edge_offset)


def _nobody() -> Spots:
    return Spots(np.empty(0, dtype=np.int64), np.empty((0, 3)))


def _where(charts: Charts, spots: Spots, reach: float) -> Floats:
    return signature(charts.region, positions(charts, spots), spots.row, reach)


def _without_conflicts(ground: Ground, row: FirstRow, spots: Spots) -> Bools:
    """Which of the first row, at `spots`, stay: not those too close to others, as across a neck or in an
    acute corner; corners go last.
    """
    if not len(row.arc):
        return row.corner
    local = ground.pitch(spots)
    pairs = close_pairs(_where(ground.charts, spots, float(local.max())), TOO_CLOSE * local)
    rank = np.lexsort((np.arange(len(local)), ~row.corner)).argsort()
    return uncrowded(pairs, rank)


def _lattice(ground: Ground, seeds: Spots, directions: Complex) -> Steps[Spots]:
    """Bubbles of a lattice that fills what the first row leaves free."""
    charts = ground.charts
    uniform = ground.uniform if charts.region.flat else None
    if uniform is not None and ground.boundary is not None and fills_its_box(charts, uniform):
        seeds, directions, origin = symmetric_seeds(ground, seeds, directions, anywhere=True)
        clear = CLEAR_OF_RIM * uniform + ground.edge_offset
        inside = partial(led_here, ground, pitch=np.float64(uniform))
        return lay(charts, ground.boundary, uniform, clear, seeds, directions, origin, inside)
    seeds, directions, _ = symmetric_seeds(ground, seeds, directions, anywhere=False)
    few = int(charts.region.sheet.max()) < PARTS
    if charts.region.flat and ground.boundary is not None and ground.uniform is None and few:
        seeds, directions = with_plane_rows(ground, seeds, directions, None)
        asked = ground.pitch, seeds, directions, CLEAR_OF_RIM, ground.edge_offset
        return (yield from grown_in_plane(charts, ground.boundary, *asked))
    closed = np.bincount(charts.region.sheet[charts.region.rim[:, 0]], minlength=len(seeds.row)) == 0
    alike = None if ground.symmetry is None else symmetric_mean(ground.symmetry)
    field = smooth_directions(charts, closed[charts.region.sheet], alike) if closed.any() else None
    if field is not None:
        field = rather_along(ground, field)
        directions = np.where(closed, field[seeds.row] ** (1 / 6), directions)
    seeds, directions = with_plane_rows(ground, seeds, directions, field)
    here = None
    if ground.symmetry is not None and all_reached(ground, seeds):
        here, own = partial(grown_here, ground), grown_here(ground, seeds)
        seeds, directions = seeds.take(own), directions[own]
    bending = ground.uniform is None and field is None
    spots, _ = yield from growing_steps(charts, ground.pitch, seeds, directions, MOST, field, here, bending)
    return _clear_of_rim(ground, spots)


def _clear_of_rim(ground: Ground, spots: Spots) -> Spots:
    """The lattice less what would be in the first row's way."""
    if ground.boundary is None:
        return spots
    local = ground.pitch(spots)
    distance, _ = nearest_boundary(ground.boundary, positions(ground.charts, spots), spots.row)
    return spots.take(distance > CLEAR_OF_RIM * local + ground.edge_offset)


def _seeds(ground: Ground, seed: int, rows: tuple[float, float, float] | None) -> tuple[Spots, Complex]:
    """One start of the lattice for each connected part of the region, and the direction of its rows: along
    the vector `rows` if that is given and not square to the surface there.

    A part with a straight edge starts there, so that lattice and first row are one; any other in its middle.
    A `seed` other than 0 turns and shifts them by chance, for another pattern of the same recipe.
    """
    charts, track = ground.charts, ground.track
    seeds = _middles(charts.region)
    directions = np.ones(len(seeds.row), dtype=np.complex128)
    if len(track.arc):
        middle, length, sheet = straight_stretches(charts, track)
        suits = suiting(ground, on_track(track, middle)[0], ground.pitch(track.spots))
        order = np.lexsort((middle, -length, ~suits, length <= LONG_ENOUGH, sheet))
        best = order[np.concatenate([[True], np.diff(sheet[order]) != 0])]
        best = best[length[best] > LONG_ENOUGH]
        _, tangent, _ = on_track(track, middle[best])
        on_rim = spots_on_track(charts, track, middle[best])
        along = to_frame(charts, on_rim.row, tangent)
        seeds.row[sheet[best]], seeds.barycentric[sheet[best]] = on_rim
        directions[sheet[best]] = along / np.abs(along)
    if rows is not None:
        along = to_frame(charts, seeds.row, np.tile(rows, (len(seeds.row), 1)))
        lies = np.abs(along) > 1e-6 * np.linalg.norm(rows)
        directions = np.where(lies, along / np.where(lies, np.abs(along), 1.0), directions)
    if seed:
        chance = np.random.default_rng(seed)
        directions *= np.exp(1j * chance.uniform(0, np.pi / 3, len(directions)))
        shift = chance.uniform(-0.5, 0.5, (len(directions), 2)) @ np.array([1, 1j]) * ground.pitch(seeds)
        walked = walk(charts, seeds, shift, carried=directions)
        seeds, directions = walked.arrived, walked.carried
    return seeds, directions


def _middles(region: Region) -> Spots:
    """The place nearest to the middle of each connected part of the region."""
    area = np.linalg.norm(region.area_vectors, axis=1)
    middle = region.corners.mean(axis=1)
    sheets = int(region.sheet.max()) + 1
    weight = np.bincount(region.sheet, area, sheets)
    centre = (
        np.stack([np.bincount(region.sheet, area * axis, sheets) for axis in middle.T], axis=1)
        / weight[:, None]
    )
    away = np.linalg.norm(middle - centre[region.sheet], axis=1)
    # A closed part has no middle: its first triangle is as good as any, and does not hang on rounding.
    away[~np.isin(region.sheet, region.sheet[region.rim[:, 0]])] = 0.0
    order = np.lexsort((away, region.sheet))
    first = order[np.searchsorted(region.sheet[order], np.arange(sheets))]
    return Spots(first, np.full((sheets, 3), 1 / 3))
