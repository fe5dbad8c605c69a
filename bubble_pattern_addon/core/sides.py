"""Which side of a wall is meant, where a modeller's thickness has carried the target region to both.

A designer marks faces of a surface and gives it a wall afterwards. The wall's inner side is a copy of the
surface, marks included; what was meant is the side that faces where the marked faces faced.
"""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_array, csr_array
from scipy.sparse.csgraph import connected_components, dijkstra

from .boxtree import build_tree, meeting_cylinders
from .errors import RegionError
from .mesh import Bools, Floats, Ints, Mesh
from .region import weld

OPPOSED = -0.5
"""Largest cosine between the normals of faces that are two sides of one wall."""
ALONG = 0.5
"""Smallest cosine between normals that face the same way."""
CLEAR = 0.8
"""Share of the votes that decides for a whole sheet."""
LOOKS = 1000
"""Triangles that are looked at from both sides; the others go with them."""


def faced_side(base: Mesh, selected: Bools, original: Mesh) -> Bools:
    """The triangles of `base` (T,) among the `selected` ones that are on the side the `original` ones face.

    original: the marked triangles before the wall was made, in the coordinates of `base`

    Where both sides of a wall are selected, and the original surface tells which one it faced, the other side
    is left out, with the rim between. All are kept where no wall is selected from both sides, or where the
    original triangles face both ways themselves.
    """
    rows = np.flatnonzero(selected)
    if not len(rows) or not len(original.triangles):
        return selected
    looks, far, depth = _looks_through(base, selected)
    if not len(looks):
        return selected
    normal, size = _unit(base.area_vectors[rows]), _size(base)
    middle = base.corners[rows].mean(axis=1)
    behind = np.full(len(rows), -1)
    behind[looks] = np.searchsorted(rows, far)
    label, distance = np.zeros(len(rows), dtype=np.int64), np.full(len(rows), np.inf)
    asked = np.union1d(looks, behind[looks])
    label[asked], distance[asked] = _agreement(middle[asked], normal[asked], original, size)
    thickness = np.ones(len(rows))
    thickness[looks] = depth
    kept = _decided(base, rows, label, behind, distance / thickness)
    if kept is None or not kept.any():
        return selected
    chosen = np.zeros_like(selected)
    chosen[rows[kept]] = True
    return chosen


def lies_on_both_sides(base: Mesh, selected: Bools) -> bool:
    """Whether most of the `selected` triangles of `base` (T,) have others of them behind their wall."""
    rows = np.flatnonzero(selected)
    if not len(rows):
        return False
    area = np.linalg.norm(base.area_vectors[rows], axis=1)
    both = area[_looks_through(base, selected)[0]].sum()
    return bool(both > area[_sample(len(rows))].sum() / 2)


def check_one_side(base: Mesh, selected: Bools) -> None:
    """Raise RegionError where through-holes in the `selected` triangles of `base` (T,) would start from both
    sides of one wall.
    """
    if lies_on_both_sides(base, selected):
        raise RegionError(
            "The target region is on both sides of the wall, so that holes through it would run into one "
            "another: keep one side of it, or make the holes blind"
        )


def _looks_through(base: Mesh, selected: Bools) -> tuple[Ints, Ints, Floats]:
    """Of a sample of the `selected` triangles (T,) those that have another one behind their wall: which
    of the selected ones they are, the triangle there, and how thick the wall is. All (k,).
    """
    rows = np.flatnonzero(selected)
    looks = _sample(len(rows))
    own, normal, size = rows[looks], _unit(base.area_vectors), _size(base)
    start = np.full(len(looks), 1e-6 * size)
    far, depth = _first_hit(base.corners, base.corners[own].mean(axis=1), -normal[own], start, size)
    opposed = np.einsum("ij,ij->i", normal[far], normal[own]) <= OPPOSED
    seen = (far >= 0) & selected[far] & opposed
    return looks[seen], far[seen], depth[seen]


def _sample(count: int) -> Ints:
    """At most LOOKS of `count` rows, evenly spread."""
    return np.unique(np.linspace(0, count - 1, min(count, LOOKS)).astype(np.int64))


def _size(mesh: Mesh) -> float:
    """Diagonal of the box round the mesh."""
    return float(np.linalg.norm(np.ptp(mesh.vertices, axis=0)))


def _agreement(middle: Floats, normal: Floats, original: Mesh, size: float) -> tuple[Ints, Floats]:
    """Does the original surface nearest along the normal line of each place face the same way (1), the other
    (-1), or neither (0); and how far it is. Both (k,).
    """
    start = np.full(len(middle), -1e-6 * size)
    found = [_first_hit(original.corners, middle, way, start, size) for way in (normal, -normal)]
    nearer = np.argmin([distance for _, distance in found], axis=0)
    triangle = np.choose(nearer, [hit for hit, _ in found])
    distance = np.choose(nearer, [distance for _, distance in found])
    cosine = np.einsum("ij,ij->i", _unit(original.area_vectors)[triangle], normal)
    label = np.where(np.abs(cosine) >= ALONG, np.sign(cosine), 0).astype(np.int64)
    return np.where(triangle >= 0, label, 0), np.abs(distance)


def _decided(base: Mesh, rows: Ints, label: Ints, behind: Ints, steps: Floats) -> Bools | None:
    """Which of the region's triangles `rows` are kept, (R,); None where nothing can be told.

    label: see `_agreement`; behind: the row on the wall's other side, -1 where that is not selected; steps:
    distance to the original surface in thicknesses of the wall. Sheets vote, near triangles with more weight:
    a mirrored copy is far from the surface it stems from, but joined to it.
    """
    across = (behind >= 0) & (label * label[behind] < 0)
    if not across.any():
        return None
    pairs, bend = _neighbours(base, rows)
    sheets, sheet = connected_components(_graph(pairs[bend >= ALONG], None, len(rows)), directed=False)
    area = np.linalg.norm(base.area_vectors[rows], axis=1)
    weight = np.where(across, area / (1 + steps**2), 0)
    votes = np.bincount(sheet, weight, sheets)
    share = (np.bincount(sheet, weight * (label > 0), sheets) / np.where(votes > 0, votes, 1))[sheet]
    kept, mixed = share >= CLEAR, (share > 1 - CLEAR) & (share < CLEAR)
    if mixed.any():  # a rounded rim joins both sides
        near = across & (steps <= 1.5 + 4 * np.quantile(steps[across], 0.1))
        kept = np.where(mixed, _spread(pairs, bend, near, label) > 0, kept)
    silent = (votes == 0)[sheet]
    kept[silent] = True
    one, other = pairs.T
    beside = np.zeros(sheets, dtype=bool)  # sheets that end on what is left out, such as the wall's rim
    beside[sheet[one[~kept[other]]]] = True
    beside[sheet[other[~kept[one]]]] = True
    return kept & ~(silent & beside[sheet])


def _spread(pairs: Ints, bend: Floats, known: Bools, label: Ints) -> Ints:
    """The `label` (R,) of the `known` triangles, given to each other one from where the way bends least."""
    angle = np.arccos(np.clip(bend, -1, 1)) + 1e-6
    sources = np.flatnonzero(known)
    _, _, source = dijkstra(
        _graph(pairs, angle, len(label)),
        directed=False,
        indices=sources,
        min_only=True,
        return_predecessors=True,
    )
    return np.where(source >= 0, label[source], 0)


def _graph(pairs: Ints, weight: Floats | None, size: int) -> csr_array:
    """The graph with edges `pairs` (k, 2) of these weights, or 1, among `size` triangles."""
    return coo_array((np.ones(len(pairs)) if weight is None else weight, pairs.T), shape=(size, size)).tocsr()


def _neighbours(base: Mesh, rows: Ints) -> tuple[Ints, Floats]:
    """Pairs of the triangles `rows` that share an edge, (k, 2) as indices into `rows`, and the cosine of the
    bend between them, (k,).
    """
    triangles = weld(base).triangles[rows]
    edges = np.sort(np.stack([triangles, np.roll(triangles, -1, axis=1)], axis=2), axis=2).reshape(-1, 2)
    owner = np.repeat(np.arange(len(rows)), 3)
    order = np.lexsort((owner, edges[:, 1], edges[:, 0]))
    same = (edges[order[1:]] == edges[order[:-1]]).all(axis=1)
    pairs = np.stack([owner[order[:-1][same]], owner[order[1:][same]]], axis=1)
    normal = _unit(base.area_vectors[rows])
    return pairs, np.einsum("ij,ij->i", normal[pairs[:, 0]], normal[pairs[:, 1]])


def _first_hit(
    corners: Floats, origin: Floats, way: Floats, start: Floats, reach: float
) -> tuple[Ints, Floats]:
    """First of the triangles `corners` (T, 3, 3) on the rays from `origin` (n, 3) along the unit vectors
    `way`, between the distances `start` (n,) and `reach`: triangle (n,), -1 where there is none, and distance
    (n,), inf there.
    """
    triangle, distance = np.full(len(origin), -1), np.full(len(origin), np.inf)
    begin, end = origin + start[:, None] * way, origin + reach * way
    owner, met = meeting_cylinders(build_tree(corners.transpose(2, 1, 0)), begin, end, np.zeros(len(origin)))
    along = _crossing(corners[met], origin[owner], way[owner])
    along[along < start[owner]] = np.inf
    order = np.lexsort((met, along, owner))
    own, place = np.unique(owner[order], return_index=True)
    best = order[place]
    hit = np.isfinite(along[best])
    triangle[own[hit]], distance[own[hit]] = met[best[hit]], along[best[hit]]
    return triangle, distance


def _crossing(corners: Floats, origin: Floats, way: Floats) -> Floats:
    """Where lines meet triangles, edges included, as distances along `way` (m,); inf where they miss.

    After T. Moeller and B. Trumbore, Fast, minimum storage ray-triangle intersection, 1997.
    """
    one, two = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    p = np.cross(way, two)
    volume = np.einsum("ij,ij->i", one, p)
    flat = np.abs(volume) <= 1e-12 * np.linalg.norm(one, axis=1) * np.linalg.norm(two, axis=1)
    volume = np.where(flat, 1, volume)
    offset = origin - corners[:, 0]
    u = np.einsum("ij,ij->i", offset, p) / volume
    q = np.cross(offset, one)
    v = np.einsum("ij,ij->i", way, q) / volume
    inside = ~flat & (u >= -1e-9) & (v >= -1e-9) & (u + v <= 1 + 1e-9)
    return np.where(inside, np.einsum("ij,ij->i", two, q) / volume, np.inf)


def _unit(vectors: Floats) -> Floats:
    """(n, 3) vectors of length 1; those without a length stay 0."""
    length = np.linalg.norm(vectors, axis=1, keepdims=True)
    return vectors / np.where(length > 0, length, 1)
