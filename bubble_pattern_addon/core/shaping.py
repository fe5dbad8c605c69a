"""Step 2: the size of the feature in every bubble, from the shaping metric."""

from __future__ import annotations

import numpy as np

from .errors import RecipeError
from .mesh import Floats
from .metric import Places
from .recipe import Shaping


def diameters(shaping: Shaping, places: Places, pitch: Floats) -> Floats:
    """Diameters (n,) of the features at `places`, whose bubbles have the local `pitch` (n,).

    Raises RecipeError where a diameter is no positive length or a feature would reach out of its bubble.
    """
    diameter = shaping.diameter(places)
    if not (np.isfinite(diameter).all() and diameter.min(initial=np.inf) > 0):
        raise RecipeError("The diameter must be a positive length everywhere in the target region: raise it.")
    over = diameter >= pitch
    if over.any():
        at = int(np.argmax(diameter / pitch))
        raise RecipeError(
            "The diameter {diameter} is not smaller than the pitch {pitch}: "
            "features would touch; use a smaller diameter or a larger pitch.",
            diameter=float(diameter[at]),
            pitch=float(pitch[at]),
        )
    return diameter
