"""What the features of a recipe look like in a drawing: circles, or the outlines of their profiles."""

from __future__ import annotations

from .drawing import Shapes, axes_of, headings_of
from .feature_recipe import Feature
from .feature_sizes import feature_sizes
from .pattern import Pattern
from .profile import outlines

# Facets round a full turn of what is drawn as a polyline: a chord stays within 0.03 per cent of the diameter.
FACETS = 96


def drawn_shapes(pattern: Pattern, feature: Feature) -> Shapes:
    """Axes, headings and outlines of the pattern's features.

    The outline is that of the profile at its widest, rim and draft included. A mesh as feature is drawn as
    the circle round it. RecipeError where a varying size has not been laid over the pattern.
    """
    axis, heading = axes_of(pattern), headings_of(pattern)
    if feature.profile in ("circle", "mesh"):
        return Shapes(axis, heading)
    aspect = feature_sizes(feature, pattern).aspect
    return Shapes(axis, heading, outlines(feature, pattern.diameter, aspect, FACETS).corners)
