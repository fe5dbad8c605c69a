"""Before the boolean: the base made ready, the walls under the features, and the features as solids."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from .collision import colliding
from .columns import Columns, columns_of, straight
from .cutters import Cutters
from .errors import RecipeError
from .feature import make_cutters
from .feature_checks import check_feature
from .feature_recipe import Feature
from .feature_sizes import FeatureSizes, feature_sizes, sides
from .fitting import fitted, looked_for
from .loft import make_solids
from .mesh import Bools, Floats, Ints, Mesh
from .pattern import Pattern, aimed
from .progress import Progress, Steps
from .section import Extent
from .soundness import SoundBase, sound_base
from .stamp import Stamp, make_stamp, make_stamps, stamp_sizes
from .wall import Fault, NearWall, near_wall


@dataclass(frozen=True)
class Plan:
    """What will be cut or added: the base made ready, its near walls, and how far the features reach; the
    pattern with their axes for normals, and the surface's normals, (n, 3).

    stamp: of a feature with the profile "mesh"; columns: of straight features, None for others
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
    columns: Columns | None

    @property
    def chosen(self) -> Ints:
        """The features that can be made, rising, (m,)."""
        return np.flatnonzero(self.fault == Fault.NONE)

    @cached_property
    def cutters(self) -> Cutters:
        """These features as solids."""
        return self.solids(self.chosen)

    def solids(self, chosen: Ints) -> Cutters:
        """The features `chosen`, (k,), as solids."""
        feature, pattern, extent = self.feature, self.pattern, self.extent
        if feature.plain:
            return make_cutters(pattern, feature, chosen, extent.top[chosen], extent.bottom[chosen])
        if self.stamp is not None:
            return make_stamps(pattern, feature, self.sizes, self.stamp, chosen, extent)
        return make_solids(pattern, feature, self.sizes, chosen, extent)

    @property
    def meets(self) -> Bools:
        """Which of the triangles seen by the walls a cutter reaches, (k,)."""
        wall, feature = self.wall, self.wall.seen_feature
        top, bottom = self.extent.top, self.extent.bottom
        within = (wall.seen_low <= top[feature]) & (wall.seen_high >= -bottom[feature])
        return within & (self.fault[feature] == Fault.NONE)


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
    columns = None
    if straight(feature):
        columns = columns_of(pattern, feature, sizes, np.flatnonzero(fault == Fault.NONE), extent)
    plan = Plan(feature, pattern, normal, sizes, shape, sound, wall, fault, extent, columns)
    if columns is None:
        _ = plan.cutters
    return plan


def _reaching(pattern: Pattern, feature: Feature) -> Pattern:
    """The pattern with diameters that no corner reaches beyond: those of circles across flats do."""
    if feature.across != "flats":
        return pattern
    return replace(pattern, diameter=pattern.diameter / np.cos(np.pi / sides(feature, pattern.diameter)))
