"""Mirrors and rotations: how a recipe spells them, and what they do to points.

A symmetry is a finite group of isometries about one centre: one plane, two planes square to each other, or
an n-fold rotation. Its words are those of `[packing] symmetry`.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from .errors import RecipeError
from .mesh import Floats, Ints
from .toml_values import Point, nearest, show

OFF, AUTO = "off", "auto"
AXES = "xyz"
# A letter stands for the plane square to that axis: "x" makes left and right alike.
MIRRORS = ("x", "y", "z", "xy", "xz", "yz")
MOST_FOLD = 60
# Axes are square to one another to this.
SQUARE = 1e-4
# Images nearer to a point than this share of its reach are the point itself.
SAME = 1e-6
# A point drawn to where it is fixed arrives after few rounds.
MOST_ROUNDS = 40


@dataclass(frozen=True)
class Isometries:
    """A group of k isometries p -> centre + turns p - centre, the identity first.

    word: how a recipe spells it; turns: (k, 3, 3) orthogonal; centre: (3,); generators: numbers of those that
    make all the others; planes: (m, 3) unit normals of the planes of a mirror symmetry, none for a rotation;
    axis: number of a rotation's axis, -1 for mirrors; axes: (3, 3) unit vectors that the word calls x, y, z
    """

    word: str
    turns: Floats
    centre: Floats
    generators: Ints
    planes: Floats
    axis: int
    axes: Floats

    def __len__(self) -> int:
        return len(self.turns)

    @property
    def needs(self) -> str:
        """What it does to the region, for a sentence: "mirrored" or "turned"."""
        return "mirrored" if len(self.planes) else "turned"


def check_symmetry(word: str, where: str) -> None:
    """RecipeError, with the nearest right spelling, for a word that stands for no symmetry."""
    if word in (OFF, AUTO, *MIRRORS):
        return
    fold = _fold(word)
    if fold is None:
        raise RecipeError(f"{where} = {show(word)} is not known: {_advice(word)}")
    if not 2 <= fold[0] <= MOST_FOLD:
        raise RecipeError(
            f"{where} = {show(word)}: a rotation is from 2-fold to {MOST_FOLD}-fold, as in "
            f'"rotate {min(max(fold[0], 2), MOST_FOLD)}"'
        )


def _fold(word: str) -> tuple[int, str] | None:
    """Number and axis, or no axis, of a word such as "rotate 3" or "rotate 3 z"."""
    match = re.fullmatch(r"rotate (\d{1,9})(?: ([xyz]))?", word)
    return (int(match[1]), match[2] or "") if match else None


def _advice(word: str) -> str:
    low = word.lower()
    letters = "".join(sorted(set(re.sub(r"mirror|[^a-z]", "", low))))
    if letters in MIRRORS:
        return f"did you mean {show(letters)}?"
    number = re.search(r"(\d{1,9})", low)
    if re.search(r"rot|turn|fold", low) and number:
        axis = re.search(r"\b([xyz])\b", low)
        turn = f"rotate {min(max(int(number[1]), 2), MOST_FOLD)}" + (f" {axis[1]}" if axis else "")
        return f"did you mean {show(turn)}?"
    known = (OFF, AUTO, *MIRRORS, "rotate 2", "rotate 3")
    return nearest(word, known, [show(one) for one in known])


def words_of(word: str) -> list[str]:
    """The words with every axis named that a checked `word` may stand for, the likeliest first."""
    if word == AUTO:
        turns = [f"rotate {number} {axis}" for number in (6, 5, 4, 3) for axis in "zyx"]
        halves = [f"rotate 2 {axis}" for axis in "zyx"]
        return ["xy", "xz", "yz", *turns, "x", "y", "z", *halves]
    fold = _fold(word)
    if fold is not None and not fold[1]:
        return [f"rotate {fold[0]} {axis}" for axis in "zyx"]
    return [word]


def check_axes(axes: Sequence[Point], where: str) -> None:
    """RecipeError for axes that are not three vectors of length 1 square to one another, or none."""
    given = np.array(axes, dtype=np.float64)
    if len(axes) and (len(axes) != 3 or not np.abs(given @ given.T - np.eye(3)).max() < SQUARE):
        raise RecipeError(f"{where} must be three vectors of length 1 that are square to one another")


def isometries(word: str, centre: Floats, axes: Floats | None = None) -> Isometries:
    """The group that a checked `word` with its axis named stands for, about `centre` (3,) with x, y and z
    along the unit vectors `axes` (3, 3).
    """
    fold, axes = _fold(word), np.eye(3) if axes is None else axes
    if fold is not None:
        number, axis = fold[0], AXES.index(fold[1])
        turns = np.stack([_turn(axis, 2 * np.pi * step / number) for step in range(number)])
        turns = axes.T @ turns @ axes
        return Isometries(word, turns, centre, np.array([1]), np.empty((0, 3)), axis, axes)
    planes = axes[[AXES.index(letter) for letter in word]]
    mirrors = [np.eye(3) - 2 * np.outer(normal, normal) for normal in planes]
    turns = np.stack([np.eye(3), *mirrors, *([mirrors[0] @ mirrors[1]] if len(mirrors) == 2 else [])])
    return Isometries(word, turns, centre, np.arange(1, len(mirrors) + 1), planes, -1, axes)


def same_isometries(groups: Sequence[Isometries | None]) -> Isometries | None:
    """The group that all are, or None."""
    first = groups[0]
    for other in groups[1:]:
        if first is None or other is None or first.turns.shape != other.turns.shape:
            return None
        if not (np.allclose(first.turns, other.turns) and np.allclose(first.centre, other.centre)):
            return None
    return first


def _turn(axis: int, angle: float) -> Floats:
    turn = np.eye(3)
    one, two = (axis + 1) % 3, (axis + 2) % 3
    turn[[one, two], [one, two]] = np.cos(angle)
    turn[two, one], turn[one, two] = np.sin(angle), -np.sin(angle)
    return turn


def images(group: Isometries, points: Floats) -> Floats:
    """Images (k, n, 3) of `points` (n, 3)."""
    return np.einsum("kab,nb->kna", group.turns, points - group.centre) + group.centre


def image_of(group: Isometries, number: Ints, points: Floats) -> Floats:
    """Images (n, 3) of `points` (n, 3), each under the isometry `number` (n,)."""
    offset = points - group.centre
    return np.einsum("nab,nb->na", group.turns[number], offset) + group.centre


def settled(group: Isometries, points: Floats, reach: Floats) -> Floats:
    """The points (n, 3), those with an image nearer than `reach` (n,) moved to where the image is the
    point itself: onto the plane or the axis.
    """
    points = points.copy()
    open_ones = np.arange(len(points))
    for _ in range(MOST_ROUNDS):
        all_images = images(group, points[open_ones])
        away = np.linalg.norm(all_images - points[open_ones], axis=2)
        near = away < reach[open_ones]
        points[open_ones] = np.einsum("kn,knc->nc", near, all_images) / near.sum(axis=0)[:, None]
        open_ones = open_ones[np.where(near, away, 0.0).max(axis=0) > 0]
        if not len(open_ones):
            break
    return points


def first_alike(group: Isometries, points: Floats, reach: Floats) -> Ints:
    """For every point (n, 3) and isometry the first isometry with the same image, (n, k); images nearer to
    one another than SAME of the `reach` (n,) are the same.
    """
    k, n = len(group), len(points)
    first = np.tile(np.arange(k), (n, 1))
    away = np.linalg.norm(images(group, points) - points, axis=2)
    special = np.flatnonzero((away[1:] < SAME * reach).any(axis=0))
    if len(special):
        all_images = images(group, points[special])
        apart = np.linalg.norm(all_images[:, None] - all_images[None], axis=3)
        first[special] = (apart < SAME * reach[special]).argmax(axis=1).T
    return first


def depth(group: Isometries, points: Floats) -> Floats:
    """How deep, (n,), points (n, 3) are inside the part of space that its images fill without overlapping;
    negative outside it.
    """
    offset = points - group.centre
    if len(group.planes):
        return (offset @ group.planes.T).min(axis=1)
    across = offset @ group.axes[[(group.axis + 1) % 3, (group.axis + 2) % 3]].T
    distance, sector = np.linalg.norm(across, axis=1), 2 * np.pi / len(group)
    # Between the bounds of a sector that begins half a sector before the first axis.
    angle = np.arctan2(across[:, 1], across[:, 0])
    beyond = sector / 2 - np.abs(angle)
    return distance * np.sin(np.clip(beyond, -np.pi / 2, np.pi / 2))
