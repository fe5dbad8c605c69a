"""A field of row directions made its own image under a symmetry.

A field that is smooth everywhere need not be symmetric: the lattice grown along it and the image of that then
meet at odds all along the planes. The mean of a field and its images runs along the planes or square to them.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ..isometries import image_of
from ..mesh import Ints
from ..surface import Complex, product
from ..symmetry import Finder, Symmetry, rows_near

Alike = Callable[[Complex], Complex]


def symmetric_mean(symmetry: Symmetry) -> Alike:
    """A function of sixth powers of directions in the triangles' frames, (R,): the mean of all images of the
    field that they are.
    """
    group, charts = symmetry.group, symmetry.finder.charts
    parts: list[tuple[Ints, Complex, bool]] = []
    for number in range(1, len(group)):
        turn = group.turns[number]
        source = _taken_from(symmetry.finder, symmetry, number)
        # A mirror takes a direction z to m conj(z), a rotation to m z; m is where it takes 1.
        one = np.einsum("rac,rc->ra", charts.axes, charts.axes[source, 0] @ turn.T)
        length = np.maximum(np.linalg.norm(one, axis=1), 1e-300)
        square = ((one[:, 0] + 1j * one[:, 1]) / length) ** 2
        parts.append((source, product(product(square, square), square), bool(np.linalg.det(turn) < 0)))

    def mean(field: Complex) -> Complex:
        total = field.copy()
        for source, factor, mirrored in parts:
            value = field[source]
            total += product(value.conj() if mirrored else value, factor)
        return total / len(group)

    return mean


def _taken_from(finder: Finder, symmetry: Symmetry, number: int) -> Ints:
    """The triangle (R,) that an isometry takes nearest to where each triangle is."""
    group, region = symmetry.group, finder.charts.region
    back = int(np.abs(group.turns - group.turns[number].T).max(axis=(1, 2)).argmin())
    middle = region.corners.mean(axis=1)
    image = image_of(group, np.full(len(middle), back), middle)
    return rows_near(finder, image, region.normals @ group.turns[back].T)


def on_patches(alike: Alike, members: Ints, triangles: int, levels: list[tuple[Ints, Complex]]) -> Alike:
    """What `alike` does to the values of all `triangles`, for those of the largest of nested patches of the
    triangles `members`.

    levels: for each, from the smallest on, the larger patch that a patch is a part of, and the turn that
    brings its value into the small one's own frame
    """
    at, turn = np.arange(len(members)), np.ones(len(members), dtype=np.complex128)
    for patch, step in levels:
        at, turn = patch[at], product(turn, step[at])

    def kept(value: Complex) -> Complex:
        fine = np.zeros(triangles, dtype=np.complex128)
        fine[members] = product(value[at], turn)
        back = product(alike(fine)[members], turn.conj())
        n = len(value)
        return np.bincount(at, back.real, n) + 1j * np.bincount(at, back.imag, n)

    return kept


def most_alike(kept: Alike, value: Complex) -> Complex:
    """The values turned, all by the same angle, so that `kept` takes least away from them.

    It is the sum of a linear and an antilinear map, p and m of `value`, as mirrors are the latter: of the
    values turned by t it makes t p + m / t, which is longest where t^2 p has the direction of m.
    """
    one, other = kept(value), kept(1j * value)
    p, m = (one - 1j * other) / 2, (one + 1j * other) / 2
    common = np.einsum("n,n->", p.conj(), m)
    return value * np.exp(0.5j * np.angle(common)) if abs(common) > 0 else value
