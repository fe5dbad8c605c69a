"""A symmetry by axes of one's own: angles or an object in the panel, three vectors in the recipe."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

bpy = pytest.importorskip("bpy", reason="needs the bpy module: python scripts/test.py --blender VERSION")

from mathutils import Euler, Matrix  # noqa: E402

from bubble_pattern_addon.blender.settings_recipe import recipe_of, take_packing  # noqa: E402
from bubble_pattern_addon.blender.symmetry_settings import angles, rotation, symmetry_axes  # noqa: E402

from .parts import activate, add_on_top, plate, points  # noqa: E402

THIRTY = np.radians(30.0)


def askew() -> bpy.types.Object:
    """A plate whose mesh is turned by thirty degrees about Z, and the object by something else."""
    base = plate()
    base.data.transform(Matrix.Rotation(THIRTY, 4, 'Z'))
    base.matrix_world = Matrix.LocRotScale((0.3, -0.2, 0.7), Euler((0.3, 1.2, -2.0)), (1, 1, 1))
    bpy.context.view_layer.update()
    return base


def mirrored_by(pattern: bpy.types.Object) -> float:
    """How far the pattern is from its mirror image across the plane turned by thirty degrees, in pitches."""
    where = points(pattern, "position")
    base = pattern.bubble_pattern.base
    where = (where - np.array(base.location)) @ np.array(base.matrix_world.to_3x3())
    normal = np.array([np.cos(THIRTY), np.sin(THIRTY), 0.0])
    image = where - 2 * (where @ normal)[:, None] * normal
    away = np.linalg.norm(image[:, None] - where[None], axis=2).min(axis=1).max()
    return float(away / pattern.bubble_pattern.pitch)


def test_a_base_that_stands_askew_has_its_symmetry_by_own_axes() -> None:
    pattern = add_on_top(askew())
    settings = pattern.bubble_pattern
    settings.symmetry = 'X'
    assert "symmetric" in settings.notes or settings.trouble
    settings.use_symmetry_axes = True
    settings.symmetry_rotation = (0.0, 0.0, THIRTY)
    assert not settings.trouble
    assert mirrored_by(pattern) < 1e-3


def test_an_empty_lends_its_axes() -> None:
    base = askew()
    pattern = add_on_top(base)
    settings = pattern.bubble_pattern
    empty = bpy.data.objects.new("Axes", None)
    bpy.context.collection.objects.link(empty)
    empty.matrix_world = base.matrix_world @ Matrix.Rotation(THIRTY, 4, 'Z')
    bpy.context.view_layer.update()
    settings.use_symmetry_axes, settings.symmetry_object = True, empty
    settings.symmetry = 'X'
    assert not settings.trouble
    assert mirrored_by(pattern) < 1e-3
    packing = recipe_of(settings).packing
    assert np.allclose(packing.symmetry_axes[0], [np.cos(THIRTY), np.sin(THIRTY), 0], atol=1e-6)
    take_packing(settings, packing)
    assert settings.symmetry_object == empty


def test_axes_of_a_recipe_come_into_the_settings_and_out_again() -> None:
    settings = add_on_top(plate()).bubble_pattern
    packing = recipe_of(settings).packing
    for turned in ((0.0, 0.0, 30.0), (25.0, -50.0, 170.0), (0.0, 90.0, 40.0), (10.0, -90.0, 0.0)):
        axes = rotation(np.radians(turned).tolist()).T
        for given in (axes, axes * [[1], [1], [-1]]):
            wanted = replace(packing, symmetry="x", symmetry_axes=tuple(map(tuple, given.tolist())))
            take_packing(settings, wanted)
            back = np.array(recipe_of(settings).packing.symmetry_axes)
            assert np.abs(back[:2] - given[:2]).max() < 1e-5
            assert np.abs(back @ back.T - np.eye(3)).max() < 1e-12
    take_packing(settings, packing)
    assert not settings.use_symmetry_axes
    assert recipe_of(settings).packing == packing


def test_rotation_is_blender_s() -> None:
    for turned in ((0.3, 1.2, -2.0), (-1.0, 0.2, 0.7)):
        assert np.abs(rotation(list(turned)) - np.array(Euler(turned).to_matrix())).max() < 1e-6
        assert np.allclose(angles(rotation(list(turned))), turned)


def test_copied_and_pasted_on_a_part_that_stands_askew() -> None:
    pattern = add_on_top(askew())
    settings = pattern.bubble_pattern
    settings.symmetry = 'X'
    settings.use_symmetry_axes, settings.symmetry_rotation = True, (0.0, 0.0, THIRTY)
    before = symmetry_axes(settings)
    activate(pattern)
    assert bpy.ops.bubble_pattern.recipe_copy() == {'FINISHED'}
    settings.use_symmetry_axes = False
    assert bpy.ops.bubble_pattern.recipe_paste() == {'FINISHED'}
    assert settings.use_symmetry_axes
    assert np.allclose(symmetry_axes(settings), before, atol=1e-5)
