"""What was done by hand is known at once, not lost unasked, and made as it is to be seen or not at all."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

bpy = pytest.importorskip("bpy", reason="needs the bpy module: python scripts/test.py --blender VERSION")

import bmesh  # noqa: E402
from mathutils import Vector  # noqa: E402

from bubble_pattern_addon.blender import hand_state, live, panels, settings_recipe  # noqa: E402
from bubble_pattern_addon.blender.operators import BUBBLE_PATTERN_OT_update  # noqa: E402
from bubble_pattern_addon.blender.recipe_operators import BUBBLE_PATTERN_OT_recipe_paste  # noqa: E402

from .parts import activate, on_top, points, select_faces  # noqa: E402
from .test_fields import Layout  # noqa: E402
from .test_hand_work import PITCH, change, editing, nearest, select  # noqa: E402


def touched(moved: int = 0, added: int = 0, deleted: int = 0) -> Any:
    """A pattern of which so many points were moved, added and deleted, in Object Mode."""
    pattern = editing()
    places = [(0.02 * (n % 4) - 0.03, 0.01 * (n // 4)) for n in range(moved + added + deleted)]
    chosen = [nearest(pattern, *place) for place in places]
    assert len(set(chosen)) == len(chosen)

    half = Vector((0.5 * PITCH, 0.0, 0.0))

    def work(mesh: bmesh.types.BMesh) -> None:
        vertices = [mesh.verts[number] for number in chosen]
        for vertex in vertices[:moved]:
            vertex.co.x += 0.3 * PITCH
        for vertex in vertices[moved : moved + added]:
            mesh.verts.new(vertex.co + half)
        for vertex in vertices[moved + added :]:
            mesh.verts.remove(vertex)

    change(pattern, work)
    bpy.ops.object.mode_set(mode='OBJECT')
    activate(pattern)
    return pattern


def said(capfd: pytest.CaptureFixture[str]) -> str:
    return capfd.readouterr().out


@pytest.mark.parametrize("counts", [(0, 0, 0), (1, 0, 0), (2, 1, 0), (0, 0, 3), (1, 2, 3)])
def test_what_was_done_by_hand_is_counted(counts: tuple[int, int, int]) -> None:
    pattern = touched(*counts)
    assert tuple(hand_state.by_hand(pattern)) == counts
    assert tuple(hand_state.by_hand_now(pattern)) == counts
    assert hand_state.by_hand(pattern).unsettled == (counts[0] + counts[1] > 0)
    if any(counts):
        assert bpy.ops.bubble_pattern.settle() == {'FINISHED'}
        assert pattern.bubble_pattern.hand_made
    assert not any(hand_state.by_hand(pattern))
    bpy.context.view_layer.update()
    assert not any(hand_state.by_hand_now(pattern))


def test_a_copy_in_place_of_the_first_is_one_that_was_added() -> None:
    pattern = editing()
    select(pattern, nearest(pattern, 0.0, 0.0))
    bpy.ops.mesh.duplicate()
    bpy.ops.transform.translate(value=(0.002, 0.0, 0.0))
    bpy.ops.object.mode_set(mode='OBJECT')
    assert tuple(hand_state.by_hand(pattern)) == (0, 1, 0)
    assert str(hand_state.by_hand(pattern)) == "1 added"


def test_moved_features_are_not_made_where_they_were() -> None:
    pattern = touched(moved=2)
    settings = pattern.bubble_pattern
    with pytest.raises(RuntimeError, match=r"Settle the features .* \(2 moved\)"):
        bpy.ops.bubble_pattern.apply()
    from bubble_pattern_addon.blender.applying import apply_steps
    from bubble_pattern_addon.core.errors import PatternError
    from bubble_pattern_addon.core.progress import drive

    with pytest.raises(PatternError, match="not settled yet"):
        drive(apply_steps(pattern, bpy.context))
    before = points(pattern, "diameter")
    settings.diameter = 0.0015  # waits, or it would go by where the features were
    assert np.array_equal(points(pattern, "diameter"), before)
    assert bpy.ops.bubble_pattern.settle() == {'FINISHED'}
    assert bpy.context.mode == 'OBJECT'
    assert points(pattern, "diameter").max() == pytest.approx(0.0015)
    assert bpy.ops.bubble_pattern.apply() == {'FINISHED'}
    assert not settings.verdict


def test_deleted_features_are_gone_from_the_part_as_they_are_to_be_seen() -> None:
    pattern = touched(deleted=2)
    count = pattern.bubble_pattern.count
    assert bpy.ops.bubble_pattern.apply() == {'FINISHED'}
    part = pattern.bubble_pattern.part.data
    assert len(part.vertices) - len(part.edges) + len(part.polygons) == 2 - 2 * (count - 2)


def test_settings_do_not_lay_anew_what_was_touched_by_hand() -> None:
    for counts in ({"moved": 1}, {"deleted": 1}):
        pattern = touched(**counts)
        settings = pattern.bubble_pattern
        before = np.array([vertex.co for vertex in pattern.data.vertices])
        settings.pitch = 1.5 * PITCH
        assert np.array_equal([vertex.co for vertex in pattern.data.vertices], before)
        assert settings_recipe.is_outdated(settings)
        assert not live.is_behind(pattern)


def test_what_is_lost_is_said_where_nobody_can_be_asked(capfd: pytest.CaptureFixture[str]) -> None:
    pattern = touched(moved=1, deleted=2)
    said(capfd)
    assert bpy.ops.bubble_pattern.update() == {'FINISHED'}
    assert "What was done by hand is lost: 1 moved and 2 deleted points" in said(capfd)
    assert bpy.ops.bubble_pattern.update() == {'FINISHED'}
    assert "lost" not in said(capfd)
    pattern = touched(moved=1)
    bpy.ops.bubble_pattern.settle()
    base = pattern.bubble_pattern.base
    activate(base)
    select_faces(base, on_top)
    said(capfd)
    assert bpy.ops.bubble_pattern.region_assign() == {'FINISHED'}
    assert "lost: features settled by hand" in said(capfd)


def test_a_recipe_takes_pins_and_fixed_sizes_away_and_says_so(capfd: pytest.CaptureFixture[str]) -> None:
    pattern = editing()
    bpy.ops.object.mode_set(mode='OBJECT')
    activate(pattern)
    assert bpy.ops.bubble_pattern.recipe_copy() == {'FINISHED'}
    bpy.ops.object.mode_set(mode='EDIT')
    select(pattern, nearest(pattern, 0.0, 0.0), nearest(pattern, 0.02, 0.0))
    bpy.ops.bubble_pattern.pin()
    bpy.ops.bubble_pattern.fix_sizes()
    bpy.ops.object.mode_set(mode='OBJECT')
    settings = pattern.bubble_pattern
    assert (len(settings.pins), len(settings.seeds)) == (2, 2)
    assert hand_state.at_stake(pattern) == ""
    assert hand_state.at_stake(pattern, pins=True) == "2 pinned"
    assert hand_state.at_stake(pattern, sizes=True) == "2 of fixed size"
    said(capfd)
    assert bpy.ops.bubble_pattern.recipe_paste() == {'FINISHED'}
    assert "What was done by hand is lost: 2 pinned and 2 of fixed size" in said(capfd)
    assert (len(settings.pins), len(settings.seeds)) == (0, 0)


class Asking:
    """In place of Blender's windows: takes down what is asked."""

    def __init__(self) -> None:
        self.asked: list[dict[str, Any]] = []

    def invoke_confirm(self, _operator: Any, _event: Any, **options: Any) -> set[str]:
        self.asked.append(options)
        return {'RUNNING_MODAL'}


@pytest.mark.parametrize("operator", [BUBBLE_PATTERN_OT_update, BUBBLE_PATTERN_OT_recipe_paste])
def test_in_a_window_it_is_asked_before(operator: Any) -> None:
    pattern = touched(moved=1, deleted=2)
    manager = Asking()
    context = SimpleNamespace(active_object=pattern, window_manager=manager)
    known = ("lost", "keeps_pins", "keeps_sizes", "bl_label")
    pressed = SimpleNamespace(**{name: getattr(operator, name) for name in known})
    pressed.lost = operator.lost.__get__(pressed)
    assert operator.invoke(pressed, context, None) == {'RUNNING_MODAL'}
    (options,) = manager.asked
    assert "1 moved and 2 deleted" in options["message"]
    assert options["confirm_text"] == operator.bl_label


def test_the_sidebar_says_why_it_waits_and_what_is_next() -> None:
    pattern = touched(moved=1)
    settings = pattern.bubble_pattern
    drawn, texts = drawing(pattern)
    assert drawn[0] == "bubble_pattern.settle"
    assert "1 moved" in texts
    bpy.ops.bubble_pattern.settle()
    drawn, texts = drawing(pattern)
    assert "bubble_pattern.settle" not in drawn
    assert "waits" not in texts
    settings.pitch = 1.5 * PITCH
    drawn, texts = drawing(pattern)
    assert "Live update waits" in texts
    assert "settled by hand" in texts
    assert drawn.index("bubble_pattern.update") < drawn.index("bubble_pattern.apply")


def drawing(pattern: Any) -> tuple[list[str], str]:
    """Buttons of the main panel in their order, and all that it says."""
    drawn: list[str] = []
    texts: list[str] = []

    def said_by(_layout: Any, text: str, _width: int, _icon: str) -> None:
        texts.append(text)

    main = panels.BUBBLE_PATTERN_PT_main
    stand_in = SimpleNamespace(draw_placed=lambda *given: main.draw_placed(None, *given))
    kept, panels.sentences = panels.sentences, said_by
    try:
        bpy.context.view_layer.update()
        region = SimpleNamespace(width=250)
        context = SimpleNamespace(active_object=pattern, mode='OBJECT', region=region)
        main.draw_pattern(stand_in, context, Layout(drawn), pattern)
    finally:
        panels.sentences = kept
    return drawn, " ".join(texts)


def test_patterns_never_touched_are_laid_as_before() -> None:
    pattern = editing()
    bpy.ops.object.mode_set(mode='OBJECT')
    count = pattern.bubble_pattern.count
    pattern.bubble_pattern.pitch = 1.2 * PITCH
    assert pattern.bubble_pattern.count < count


def test_update_is_the_next_step_only_where_it_helps() -> None:
    pattern = editing()
    bpy.ops.object.mode_set(mode='OBJECT')
    settings = pattern.bubble_pattern
    settings.live = False
    settings.pitch = 1.2 * PITCH
    assert "bubble_pattern.update" in highlighted(pattern)
    settings.diameter_field.kind = 'ATTRIBUTE'  # which is not chosen yet
    assert settings_recipe.contradict(settings)
    assert highlighted(pattern) == []


def highlighted(pattern: Any) -> list[str]:
    """Buttons of the main panel that stand out."""
    found: list[str] = []

    class Highlights(Layout):
        def operator(self, name: str, **options: Any) -> None:
            if options.get("depress"):
                found.append(name)

        def row(self, **_options: Any) -> Highlights:
            return Highlights(self.drawn)

    context = SimpleNamespace(active_object=pattern, mode='OBJECT', region=SimpleNamespace(width=250))
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(panels, "sentences", lambda *_: None)
        panels.BUBBLE_PATTERN_PT_main.draw_pattern(SimpleNamespace(), context, Highlights([]), pattern)
    return found
