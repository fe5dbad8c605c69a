"""Solve for: a target open area gives the diameter or the pitch, a target count of features the pitch.

By the diameter it is one packing: all sizes of the shaping metric are scaled by one factor, and the limits
have their say at every trial, so that what is found is what the pattern will be. Without limits the open area
grows with the square of the factor and the first trial is right; with them the smallest factor is bracketed
and bisected.

By the pitch every trial is a packing. The count goes with 1 / pitch^2 but for what the boundary takes; the
first trial starts from the region's area, each next one from what was found (a fit while all are on one side
of the target, regula falsi between two sides). A count is a whole number and jumps, so near the target
neighbouring pitches are tried in turn until one is within a feature. Along straight edges it jumps by a whole
row, over the target too; then the search begins again with a lattice that starts elsewhere, the next seed.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from .blending import Fill
from .errors import RecipeError, RegionError
from .floors import floors_for
from .limits import limited_by
from .mesh import Floats
from .metric import Constant, Field, Places
from .nominal import nominal_sizes
from .pattern import Pattern, all_bubbles
from .pipeline import pattern_steps
from .progress import Progress, Steps, within
from .quality import open_area
from .recipe import Limits, Recipe, Solve
from .recipe_checks import check_recipe, uniform_diameter
from .region import Region
from .scaling import scaled, scaled_sizes
from .shaping import bound, reshaped
from .surroundings import NOTHING, Surroundings
from .webs import LEAST_WEB

# What is wanted is met within this share of it, or within one feature.
TOLERANCE = 0.005
# The diameter is found closer than that, for it costs next to nothing.
CLOSE = 1e-5
TRIALS = 60
# A pitch that meets the target within TOLERANCE but not within one feature is good enough after so many
# packings; after the most of them the nearest one is taken whatever it is.
PATIENCE = 8
MOST_PACKINGS = 16
# So many seeds are tried, the recipe's own first.
SEEDS = 4
# Least steps of the pitch, as shares of it, when neighbouring pitches are tried in turn; where few features
# are wanted they are as wide as gives about one feature more or less.
TINY = 4e-4
SEEDED = "The lattice starts elsewhere, as seed {seed} says: with the seed given no pitch comes as near."
# The most that the pitch changes from one trial to the next while the target is far.
STRIDE = 4.0


@dataclass(frozen=True)
class Solved:
    """What was found.

    recipe: with the lengths and the seed that were found and no target any more: it gives the pattern again
    wanted, reached: open area or count; factor: times which the diameter or the pitch was taken
    packings, shapings: how often the region was packed, and features were shaped, to find it
    met: within TOLERANCE or one feature
    """

    recipe: Recipe
    pattern: Pattern
    by: str
    wanted: float
    reached: float
    factor: float
    packings: int
    shapings: int
    met: bool


def solving_steps(region: Region, recipe: Recipe, surroundings: Surroundings = NOTHING) -> Steps[Solved]:
    """The pattern that comes to what the recipe's [solve] asks for; a generator of Progress.

    Raises RecipeError where the recipe asks for nothing or contradicts itself, and where the target cannot be
    reached, with the nearest that can; further as pattern_steps.
    """
    solve = recipe.solve
    if not solve:
        raise RecipeError("[solve] has no target: give open_area or count")
    check_recipe(recipe)
    if solve.count is None and solve.by != "pitch":
        return (yield from _by_diameter(region, recipe, surroundings))
    return (yield from _by_pitch(region, recipe, surroundings))


# -- by the diameter -----------------------------------------------------------------------------------------


def _by_diameter(region: Region, recipe: Recipe, surroundings: Surroundings) -> Steps[Solved]:
    target = recipe.solve.open_area
    assert target is not None
    recipe = replace(recipe, solve=Solve())
    free = replace(recipe, limits=Limits(), shaping=replace(recipe.shaping, sizes=None))
    packed = yield from within(pattern_steps(region, free, surroundings), 0.0, 0.8)
    bubbles = all_bubbles(packed)
    wished = bubbles.diameter if bubbles.wished is None else bubbles.wished
    floors = floors_for(bubbles, region, recipe)
    sizes = nominal_sizes(recipe.shaping.sizes, recipe.millimetre)

    def open_at(factor: float) -> float:
        sized = replace(bubbles, diameter=wished * factor)
        return open_area(limited_by(sized, region, floors, sizes), region)

    yield Progress("Shaping to the open area", 0.8)
    plain = open_area(replace(bubbles, diameter=wished), region)
    trials = yield from within(
        _smallest_factor(open_at, target, plain, _largest_factor(recipe, bubbles.pitch, wished)), 0.8, 0.95
    )
    reachable = max(trials, key=lambda trial: trial[1])
    slack = max(TOLERANCE * target, plain / len(bubbles) if sizes is None else 0.0)
    if reachable[1] < target - slack:
        raise RecipeError(
            f"An open area of {target:.1%} can't be reached by the diameter: pitch and limits let it come to "
            f"{reachable[1]:.1%} at most; make the limits or the edge offset smaller, or solve by the pitch"
        )
    factor = float(min(trials, key=lambda trial: (abs(trial[1] - target), trial[0]))[0])
    found = replace(recipe, shaping=scaled_sizes(recipe.shaping, factor))
    check_recipe(found)
    pattern = reshaped(packed, region, found, surroundings)
    reached = open_area(pattern, region)
    met = abs(reached - target) <= slack
    pattern = _with_note(pattern, met, f"An open area of {target:.2%}", f"{reached:.2%}", "diameter")
    return Solved(found, pattern, "diameter", target, reached, factor, 1, len(trials) + 1, met)


def _largest_factor(recipe: Recipe, pitch: Floats, wished: Floats) -> float:
    """How much larger the diameters may be asked for: a recipe with one pitch and one diameter refuses those
    that leave no web, and so does one with a share of the pitch; of other graded ones, until every single
    feature fills its place.
    """
    diameter, size = uniform_diameter(recipe), recipe.shaping.diameter
    whole = recipe.packing.pitch
    if diameter is None or not isinstance(whole, Constant):
        most = size.share.bounds()[1] if isinstance(size, Fill) else np.inf
        return min(float((2 * pitch / wished).max()), (1 - LEAST_WEB) / most if np.isfinite(most) else np.inf)
    web = max(recipe.limits.min_web, LEAST_WEB * whole.value)
    most = min(whole.value - web, whole.value + 2 * recipe.packing.edge_offset)
    return most * (1 - 1e-6) / diameter


def _smallest_factor(
    open_at: Callable[[float], float], target: float, plain: float, largest: float
) -> Steps[list[tuple[float, float]]]:
    """Trials (factor, open area), among them the smallest factor up to the `largest` that reaches the target,
    or, where none does, the one that comes nearest on the way.

    plain: the open area of the sizes as they are, without limits; with them it is never more
    """
    low = 0.0
    factor = min(np.sqrt(target / plain), largest)
    trials = [(factor, open_at(factor))]
    while trials[-1][1] < target * (1 - CLOSE) and factor < largest and len(trials) < TRIALS:
        yield Progress("Shaping to the open area", 0.5 * len(trials) / TRIALS)
        low = factor
        ahead = np.sqrt(target / max(trials[-1][1], 1e-9))
        factor = min(factor * float(np.clip(ahead, 1.01, 1.1)), largest)
        trials.append((factor, open_at(factor)))
    if trials[-1][1] < target * (1 - CLOSE) or low == 0.0:
        return trials
    high = factor
    while high - low > CLOSE * high and abs(trials[-1][1] / target - 1) > CLOSE and len(trials) < 2 * TRIALS:
        yield Progress("Shaping to the open area", 0.5 * len(trials) / TRIALS)
        factor = (low + high) / 2
        trials.append((factor, open_at(factor)))
        if trials[-1][1] < target:
            low = factor
        else:
            high = factor
    return trials


# -- by the pitch --------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class _Trial:
    """A packing with the pitch times `factor`, what it comes to, and what one feature is of that."""

    factor: float
    value: float
    one: float
    pattern: Pattern | None


def _by_pitch(region: Region, recipe: Recipe, surroundings: Surroundings) -> Steps[Solved]:
    solve = recipe.solve
    target = float(solve.open_area if solve.count is None else solve.count)  # type: ignore[arg-type]
    recipe = replace(recipe, solve=Solve())
    smallest = _smallest_pitch(recipe)
    factor = max(_first_factor(region, recipe, surroundings, solve), smallest)
    own, packings = recipe.packing.seed, 0
    found: list[tuple[float, int, Recipe, _Trial]] = []
    for seed in range(own, own + SEEDS):
        begun = replace(recipe, packing=replace(recipe.packing, seed=seed))
        share = (seed - own) / SEEDS
        searching = _searched(region, begun, surroundings, solve, target, (factor, smallest))
        trials = yield from within(searching, share, share + 1 / SEEDS)
        packings += len(trials)
        best = _best(trials, target)
        off = abs(best.value - target)
        if best.pattern is not None and (
            best.factor > smallest or best.value >= target - _slack(best, target)
        ):
            found.append((off, seed, begun, best))
            factor = best.factor
        elif not found:
            raise _unreachable(solve, target, best)
        if off <= _slack(best, target):
            break
    off, seed, begun, best = min(found, key=lambda one: one[:2])
    assert best.pattern is not None  # or it would not have been found
    met = off <= _slack(best, target)
    what, reached = f"{target:,.0f} features", f"{best.value:,.0f}"
    if solve.count is None:
        what, reached = f"An open area of {target:.2%}", f"{best.value:.2%}"
    pattern = _with_note(best.pattern, met, what, reached, "pitch")
    if seed != own:
        pattern = replace(pattern, notes=(*pattern.notes, SEEDED.format(seed=seed)))
    repitched = _repitched(begun, best.factor)
    return Solved(repitched, pattern, "pitch", target, best.value, best.factor, packings, packings, met)


def _searched(
    region: Region,
    recipe: Recipe,
    surroundings: Surroundings,
    solve: Solve,
    target: float,
    start: tuple[float, float],
) -> Steps[list[_Trial]]:
    """Trials with the recipe's seed, until one is good enough.

    start: the first factor on the pitch, and the smallest that makes sense
    """
    factor, smallest = start
    trials: list[_Trial] = []
    while True:
        done = len(trials) / MOST_PACKINGS
        trial = yield from within(
            _trial(region, _repitched(recipe, factor), surroundings, factor, solve),
            done,
            done + 1 / MOST_PACKINGS,
        )
        trials.append(trial)
        if _good_enough(_best(trials, target), target, len(trials)):
            return trials
        factor = max(_next_factor(trials, target), smallest)
        if any(abs(factor / trial.factor - 1) < 1e-9 for trial in trials):
            return trials


def _best(trials: list[_Trial], target: float) -> _Trial:
    """The trial that comes nearest to the target."""
    return min(trials, key=lambda trial: (abs(trial.value - target), trial.factor))


def _unreachable(solve: Solve, target: float, best: _Trial) -> RecipeError:
    if solve.count is None:
        return RecipeError(
            f"An open area of {target:.1%} can't be reached by the pitch: features of this diameter take "
            f"{best.value:.1%} at most; make the diameter larger or the limits smaller"
        )
    return RecipeError(
        f"{target:,.0f} features of this diameter don't fit into the target region: about {best.value:,.0f} "
        "do; make the diameter or the limits smaller"
    )


def _repitched(recipe: Recipe, factor: float) -> Recipe:
    return replace(recipe, packing=replace(recipe.packing, pitch=scaled(recipe.packing.pitch, factor)))


def _smallest_pitch(recipe: Recipe) -> float:
    """The least factor on the pitch at which the recipe still makes sense: features of one size must not
    touch.
    """
    diameter, pitch = uniform_diameter(recipe), recipe.packing.pitch
    if diameter is None or not isinstance(pitch, Constant):
        return 0.0
    if not isinstance(recipe.shaping.diameter, Constant):
        return 0.0  # it follows the pitch
    web = recipe.limits.min_web
    least = max(diameter / (1 - LEAST_WEB), diameter + web, diameter - 2 * recipe.packing.edge_offset)
    return least * (1 + 1e-6) / pitch.value


def _first_factor(region: Region, recipe: Recipe, surroundings: Surroundings, solve: Solve) -> float:
    """The factor at which bubbles of sqrt(3)/2 pitch^2 each fill the region with what is wanted."""
    middles = Places(
        region.corners.mean(axis=1), region.triangles, np.full((len(region.triangles), 3), 1 / 3)
    )
    area = np.linalg.norm(region.area_vectors, axis=1) / 2
    field: Field = bound(recipe.packing.pitch, replace(surroundings, region=region), "[packing] pitch")
    pitch = field(middles)
    if not (np.isfinite(pitch).all() and pitch.min() > 0):
        return 1.0
    count = float((area / (np.sqrt(0.75) * pitch**2)).sum())
    if solve.count is not None:
        return float(np.sqrt(count / solve.count))
    diameter = uniform_diameter(recipe)
    assert solve.open_area is not None
    if diameter is None:
        return 1.0
    return float(np.sqrt(count * np.pi / 4 * diameter**2 / region.area / solve.open_area))


def _trial(
    region: Region, recipe: Recipe, surroundings: Surroundings, factor: float, solve: Solve
) -> Steps[_Trial]:
    """One packing. A pitch at which no bubble fits comes to nothing."""
    check_recipe(recipe)
    try:
        pattern = yield from pattern_steps(region, recipe, surroundings)
    except RegionError:
        if factor <= 1.0:  # not because of us
            raise
        return _Trial(factor, 0.0, 0.0, None)
    if solve.count is not None:
        return _Trial(factor, float(len(pattern)), 1.0, pattern)
    value = open_area(pattern, region)
    return _Trial(factor, value, value / max(len(pattern), 1), pattern)


def _slack(trial: _Trial, target: float) -> float:
    return max(TOLERANCE * target, trial.one) * (1 + 1e-9)


def _good_enough(best: _Trial, target: float, packings: int) -> bool:
    """Whether the search ends here: at once within one feature, after a while within the tolerance."""
    off = abs(best.value - target)
    if off <= best.one * (1 + 1e-9) and best.pattern is not None:
        return True
    return packings >= (PATIENCE if off <= _slack(best, target) else MOST_PACKINGS)


def _next_factor(trials: list[_Trial], target: float) -> float:
    """The factor to try next."""
    more = [trial for trial in trials if trial.value > target]
    less = [trial for trial in trials if trial.value <= target]
    last = trials[-1]
    if not more or not less:
        fit = last.factor * np.sqrt(last.value / target)
        return float(np.clip(fit, last.factor / STRIDE, last.factor * STRIDE))
    high, low = max(more, key=lambda trial: trial.factor), min(less, key=lambda trial: trial.factor)
    tiny = max(TINY, 0.4 * high.one / target)
    if low.factor > high.factor * (1 + 4 * tiny):
        share = 0.5
        if low.value > 0:
            share = float(np.log(high.value / target) / np.log(high.value / low.value))
        between = high.factor * float((low.factor / high.factor) ** np.clip(share, 0.1, 0.9))
        if _untried(between, trials, tiny):
            return between
    # counts jump here: the neighbourhood of what the nearest trials agree on, near to far
    nearest = sorted((trial for trial in trials if trial.value > 0), key=lambda t: abs(t.value - target))[:4]
    middle = float(np.median([trial.factor * np.sqrt(trial.value / target) for trial in nearest]))
    steps = (
        side * number * (number + 1) / 2 * tiny for number in range(2 * MOST_PACKINGS) for side in (1, -1)
    )
    return next(middle * (1 + step) for step in steps if _untried(middle * (1 + step), trials, tiny))


def _untried(factor: float, trials: list[_Trial], tiny: float) -> bool:
    return all(abs(factor / trial.factor - 1) > tiny / 4 for trial in trials)


def _with_note(pattern: Pattern, met: bool, what: str, reached: str, by: str) -> Pattern:
    """The pattern with a sentence on a target that was missed."""
    if met:
        return pattern
    note = f"{what} can't be met exactly by the {by}: the nearest that was found is {reached}."
    return replace(pattern, notes=(*pattern.notes, note))
