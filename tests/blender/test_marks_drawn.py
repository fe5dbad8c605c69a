"""The marks are drawn, off the screen, where this Blender can; elsewhere all that they use is there."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

bpy = pytest.importorskip("bpy", reason="needs the bpy module: python scripts/test.py --blender VERSION")

import gpu  # noqa: E402
from mathutils import Matrix  # noqa: E402

from bubble_pattern_addon.blender import overlay  # noqa: E402

from .parts import add_on_top, plate  # noqa: E402

SIZE = 256


@pytest.fixture
def canvas() -> object:
    """An image to draw on; older Blenders have none without a window."""
    if not hasattr(gpu, "init"):
        pytest.skip("this Blender draws in windows alone")
    try:
        gpu.init()
        image = gpu.types.GPUOffScreen(SIZE, SIZE)
    except (SystemError, RuntimeError) as error:
        pytest.skip(f"nothing can be drawn here: {error}")
    yield image
    image.free()


def test_what_marks_are_drawn_with_is_there() -> None:
    for module, names in (
        (gpu.state, ("blend_set", "depth_test_set", "viewport_get")),
        (gpu.matrix, ("push_pop", "multiply_matrix")),
        (gpu.types.GPUShader, ("bind", "uniform_float")),
        (gpu.types.GPUBatch, ("draw",)),
    ):
        for name in names:
            assert hasattr(module, name), name


def test_the_smallest_web_and_the_rings_are_drawn(canvas: object, monkeypatch: pytest.MonkeyPatch) -> None:
    pattern = add_on_top(plate(0.05))
    settings = pattern.bubble_pattern
    settings.thickness, settings.process = 0.0003, 'INJECTION_MOULDING'
    settings.show_marks = True
    (draft,) = settings.broken
    assert draft.count == settings.count
    monkeypatch.setattr(overlay, "wishing", lambda _context: iter([pattern]))
    scale = SimpleNamespace(system=SimpleNamespace(ui_scale=1.0))
    monkeypatch.setattr(overlay, "bpy", SimpleNamespace(context=SimpleNamespace(preferences=scale)))
    with canvas.bind():
        buffer = gpu.state.active_framebuffer_get()
        buffer.clear(color=(0.0, 0.0, 0.0, 1.0), depth=1.0)
        with gpu.matrix.push_pop(), gpu.matrix.push_pop_projection():
            gpu.matrix.load_matrix(Matrix.Identity(4))
            gpu.matrix.load_projection_matrix(Matrix.Diagonal((36.0, 36.0, -1.0, 1.0)))
            overlay.draw_lines()
        pixels = np.array(buffer.read_color(0, 0, SIZE, SIZE, 4, 0, 'FLOAT').to_list())
    colours = pixels.reshape(-1, 4)[:, :3]
    red = (np.abs(colours - overlay.BAD[:3]) < 0.02).all(axis=1)
    gold = (np.abs(colours - overlay.color_of(pattern)[:3]) < 0.02).all(axis=1)
    assert 0.05 < red.mean() < 0.9  # rings all over the plate
    assert gold.sum() >= 4
