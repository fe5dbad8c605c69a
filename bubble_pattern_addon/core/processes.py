"""What a manufacturing process asks of a pattern, by the thickness t of the wall.

The figures are those of published design guides, the milder one where guides differ: they say what a shop
takes without asking, not what it likes best.

- Punched sheet: hole, web and margin hang on the thickness alone, because the punch buckles and the web
  tears: hole >= t and at least 1 mm (classic sheet metal guides, "the material's thickness or 1.00 mm,
  whichever is greater"), web >= t, margin >= 1.5 t. Stainless steel wants twice that.
- Injection moulding: the melt must fill the web and the core pin must stand: web and margin >= 1.5 t
  (RPWorld, Rutland Plastics: 2 t where strength counts), depth <= 4 diameters of a through-hole, whose pin is
  held at both ends, and 2 of a blind one (the rule for pins below 5 mm), draft >= 1 degree.
- FDM print: hole >= 2 mm, web and margin >= 0.8 mm, two lines of the usual 0.4 mm nozzle.
- CNC: drills of 1 mm or more (recommended from 2.5 mm, feasible from 0.5 mm), depth <= 10 diameters
  (recommended up to 4), web and margin >= 0.8 mm, the least wall of metal that does not give way.
- Laser: hole and web >= 0.7 t, margin >= t, none below 0.5 mm, about two kerfs: narrower webs melt.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .mesh import Floats


@dataclass(frozen=True)
class Least:
    """A least length: so many `times` the thickness, and never below so many `millimetres`."""

    times: float = 0.0
    millimetres: float = 0.0

    def at(self, thickness: Floats, millimetre: float) -> Floats:
        """The length (n,) in the unit of the base where the wall is `thickness` (n,), nan where that is not
        known.
        """
        return np.fmax(self.times * thickness, self.millimetres * millimetre)


@dataclass(frozen=True)
class Process:
    """hole: least diameter; web; margin: from a feature's edge to the region's boundary

    through, blind: how many diameters a feature may be deep; inf for any depth
    draft: least angle of a feature's wall to its axis, in degrees
    """

    hole: Least = Least()
    web: Least = Least()
    margin: Least = Least()
    through: float = np.inf
    blind: float = np.inf
    draft: float = 0.0


PROCESSES: dict[str, Process] = {
    "punched sheet": Process(Least(1.0, 1.0), Least(1.0), Least(1.5)),
    "injection moulding": Process(Least(), Least(1.5), Least(1.5), through=4.0, blind=2.0, draft=1.0),
    "fdm print": Process(Least(0.0, 2.0), Least(0.0, 0.8), Least(0.0, 0.8)),
    "cnc": Process(Least(0.0, 1.0), Least(0.0, 0.8), Least(0.0, 0.8), through=10.0, blind=10.0),
    "laser": Process(Least(0.7, 0.5), Least(0.7, 0.5), Least(1.0, 0.5)),
}
