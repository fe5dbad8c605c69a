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


def symmetric_mean(symmetry: Symmetry) -> Callable[[Complex], Complex]:
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
