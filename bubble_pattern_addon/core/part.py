"""What step 3 makes: the base with its features, and what the boolean left of it."""

from __future__ import annotations

from dataclasses import dataclass

from .check import Check
from .mesh import Bools, Floats, Ints, Mesh


@dataclass(frozen=True)
class Part:
    """The base with its features, n of them.

    mesh: the part; source: (T',) triangle of the base each of its triangles lies on, -1 - feature id on a
        feature's wall
    facet: (T',) flat facet of a feature each of its triangles lies on, numbered through all; -1 on the base
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
    facet: Ints
    vertex: Ints
    untouched: Bools
    thickness: Floats
    pierced: Bools
    failures: tuple[tuple[int, str], ...]
    check: Check
    undercut: Bools
    kind: str


@dataclass(frozen=True)
class Cut:
    """What the boolean left.

    mesh: its triangles on the base come first, then those the cutters made
    face: (F,) face of the base each of the first triangles lies on
    facet: (W,) flat facet of a feature each of the others lies on
    feature: (facets,) feature each facet belongs to
    """

    mesh: Mesh
    face: Ints
    facet: Ints
    feature: Ints

    @property
    def surface(self) -> Ints:
        """Triangles on the base, (F, 3)."""
        return self.mesh.triangles[: len(self.face)]

    @property
    def walls(self) -> Ints:
        """Triangles that the cutters made, (W, 3)."""
        return self.mesh.triangles[len(self.face) :]
