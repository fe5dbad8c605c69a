"""Draft and angle that vary over the region, chosen in the panel as pitch and diameter are."""

from __future__ import annotations

import math

import numpy as np
import pytest

bpy = pytest.importorskip("bpy", reason="needs the bpy module: python scripts/test.py --blender VERSION")

from bubble_pattern_addon.blender import feature_panel  # noqa: E402
from bubble_pattern_addon.blender.settings_recipe import recipe_of, take_recipe  # noqa: E402
from bubble_pattern_addon.core.blending import Most  # noqa: E402
from bubble_pattern_addon.core.fields import Linear, Radial  # noqa: E402

from .parts import activate, add_on_top, euler, is_closed, plate, points  # noqa: E402
from .test_fields import Layout  # noqa: E402


def graded(settings: bpy.types.PropertyGroup, name: str, first: float, last: float) -> None:
    """Let an angle go from one value to another, in degrees, along X."""
    field = getattr(settings, f"{name}_field")
    field.kind = 'LINEAR'
    field.start_angle, field.end_angle = math.radians(first), math.radians(last)


def test_draft_and_angle_vary_as_the_panel_says() -> None:
    pattern = add_on_top(plate())
    settings = pattern.bubble_pattern
    settings.profile, settings.turn = 'SLOT', 'FIXED'
    graded(settings, "angle", 0.0, 90.0)
    graded(settings, "draft", 0.5, 2.0)
    feature = recipe_of(settings).feature
    assert (feature.angle.from_, feature.angle.to) == (0.0, 90.0)
    assert (feature.draft.from_, feature.draft.to) == (0.5, 2.0)
    x = points(pattern)[:, 0]
    along = (x / 0.1 + 0.5)[:, None]
    turned = np.radians(90.0 * along)
    heading = points(pattern, "heading")[:, :2]
    assert np.abs(heading - np.hstack([np.cos(turned), np.sin(turned)])).max() < 1e-5
    activate(pattern)
    assert bpy.ops.bubble_pattern.apply() == {'FINISHED'}
    assert not settings.verdict
    assert is_closed(settings.part.data)
    assert euler(settings.part.data) == 2 - 2 * settings.count


def test_a_new_field_begins_with_the_angle_that_it_replaces() -> None:
    settings = add_on_top(plate()).bubble_pattern
    settings.draft = math.radians(2.0)
    settings.draft_field.kind = 'EDGE'
    settings.angle_field.kind = 'RADIAL'
    feature = recipe_of(settings).feature
    assert (feature.draft.from_, feature.draft.to) == (2.0, 5.0)
    assert (feature.angle.from_, feature.angle.to) == (0.0, 90.0)
    settings.draft_field.kind = 'CONSTANT'
    assert recipe_of(settings).feature.draft == 2.0


def test_angles_of_recipes_come_into_the_panel_and_out_again() -> None:
    from dataclasses import replace

    settings = add_on_top(plate()).bubble_pattern
    recipe = recipe_of(settings)
    ways = (
        (Linear(from_=0.5, to=3.25, direction=(1.0, 0.0, 0.0)), 'LINEAR'),
        (Radial(from_=12.5, to=0.0, radius=0.05, falloff="smooth"), 'RADIAL'),
        (
            Most(of=(Linear(from_=1.0, to=4.0, direction=(0.0, 1.0, 0.0)), Radial(from_=2.0, to=3.0))),
            'RECIPE',
        ),
        (7.5, 'CONSTANT'),
    )
    for size, kind in ways:
        wanted = replace(recipe, feature=replace(recipe.feature, draft=size, angle=size))
        take_recipe(settings, wanted)
        assert {settings.draft_field.kind, settings.angle_field.kind} == {kind}
        assert recipe_of(settings).feature == wanted.feature


def test_angles_are_one_row_until_they_vary() -> None:
    settings = add_on_top(plate()).bubble_pattern
    for name, draw in (("draft", feature_panel.draw_walls), ("angle", feature_panel.draw_turn)):
        drawn: list[str] = []
        draw(Layout(drawn), settings)
        assert drawn[-2:] == [name, "kind"]
        getattr(settings, f"{name}_field").kind = 'LINEAR'
        drawn = []
        draw(Layout(drawn), settings)
        assert {"kind", "start_angle", "end_angle", "falloff"} <= set(drawn)
        assert name not in drawn
