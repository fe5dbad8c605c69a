"""Makeable in Blender: results, process, nominal sizes, Solve For, marks, and the way to the offenders."""

from __future__ import annotations

import pytest

pytest.importorskip("bpy")

import bpy
import numpy as np

from bubble_pattern_addon.blender import noting, overlay, result_panel
from bubble_pattern_addon.blender.properties import pattern_of
from bubble_pattern_addon.blender.result_panel import (
    broken_text,
    nominal_rows,
    quality_figures,
    removed_figures,
    size_figures,
)
from bubble_pattern_addon.blender.settings_recipe import is_outdated, recipe_of, take_recipe
from bubble_pattern_addon.core.recipe_file import recipe_from_dict, recipe_to_toml

from .parts import activate, add_on_top, plate, points, volume

MM = 0.001


@pytest.fixture
def pattern() -> bpy.types.Object:
    """About 200 holes in a plate of 60 by 60 by 1 mm."""
    found = add_on_top(plate(60 * MM, 1 * MM))
    bpy.ops.object.mode_set(mode='OBJECT')
    found.bubble_pattern.pitch = 4 * MM
    found.bubble_pattern.diameter = 2 * MM
    return found


def figures(pattern: bpy.types.Object) -> dict[str, str]:
    """The rows of the results, by name."""
    settings = pattern.bubble_pattern
    rows = [*size_figures(bpy.context, settings), *removed_figures(bpy.context, settings)]
    return {row.name: row.text for row in [*rows, *quality_figures(settings)]}


def test_results_are_told_with_their_units_and_in_words(pattern: bpy.types.Object) -> None:
    settings = pattern.bubble_pattern
    found = figures(pattern)
    assert found["Diameter"] == "2 mm"
    assert found["Order"].startswith("Excellent") or found["Order"].startswith("Good")
    assert found["First Row"].startswith("Excellent")
    assert settings.mean_web >= settings.web > 0
    assert settings.removed == pytest.approx(settings.count * np.pi * MM**3, rel=1e-3)
    assert found["Removed"].startswith("≈")
    assert "Mass Removed" not in found
    settings.density = 7.85
    assert figures(pattern)["Mass Removed"] == f"≈ {settings.count * np.pi * 7.85e-3:.4g} g"
    assert not is_outdated(settings)


def test_the_smallest_web_lies_between_two_points(pattern: bpy.types.Object) -> None:
    settings = pattern.bubble_pattern
    ends = np.array(settings.web_between).reshape(2, 3)
    assert np.linalg.norm(ends[1] - ends[0]) == pytest.approx(settings.web, rel=1e-3)
    rows = noting.rows_of_rule(pattern, 'SMALLEST_WEB')
    at = points(pattern)[rows]
    matrix = np.array(pattern.matrix_world)
    world = ends @ matrix[:3, :3].T + matrix[:3, 3]
    assert np.linalg.norm(at - world, axis=1) == pytest.approx([1 * MM] * 2, rel=1e-3)


def test_apply_tells_exactly_what_is_removed(pattern: bpy.types.Object) -> None:
    base = pattern.bubble_pattern.base
    assert bpy.ops.bubble_pattern.apply() == {'FINISHED'}
    settings = pattern.bubble_pattern
    assert settings.part_removed == pytest.approx(volume(base) - volume(settings.part), rel=1e-3)
    assert not figures(pattern)["Removed"].startswith("≈")
    assert bpy.ops.bubble_pattern.edit() == {'FINISHED'}
    settings.density = 2.7
    assert not figures(pattern)["Removed"].startswith("≈")
    settings.diameter = 1.9 * MM
    assert figures(pattern)["Removed"].startswith("≈")


def test_bumps_add(pattern: bpy.types.Object) -> None:
    settings = pattern.bubble_pattern
    settings.kind = 'BUMP'
    assert not any(name.startswith("Removed") for name in figures(pattern))
    assert bpy.ops.bubble_pattern.apply() == {'FINISHED'}
    assert settings.part_removed < 0
    assert figures(pattern)["Added"] == result_panel.volume_text(bpy.context, -settings.part_removed)


# -- process and sizes -----------------------------------------------------------------------------------


def test_a_process_goes_by_the_measured_wall(pattern: bpy.types.Object) -> None:
    """1 mm of sheet: holes from 1 mm, webs from 1 mm, margins from 1.5 mm."""
    settings = pattern.bubble_pattern
    settings.diameter = 3.5 * MM
    assert settings.web < 0.9 * MM
    settings.process = 'PUNCHED_SHEET'
    assert settings.web >= 1 * MM * (1 - 1e-5)
    assert settings.margin >= 1.5 * MM * (1 - 1e-5)
    assert settings.smallest >= 1 * MM * (1 - 1e-5)
    assert len(settings.broken) == 0
    settings.check_only = True
    assert settings.web < 0.9 * MM
    assert {one.rule for one in settings.broken} == {"web", "margin"}
    assert broken_text(bpy.context, settings.broken[0]).endswith("< 1 mm")
    settings.check_only = False
    assert len(settings.broken) == 0
    settings.thickness = 2 * MM
    assert settings.web >= 2 * MM * (1 - 1e-5)
    assert not is_outdated(settings)


def test_a_scene_of_another_scale_has_other_millimeters() -> None:
    base = plate(60.0, 1.0)  # in a scene where a unit is a millimeter
    bpy.context.scene.unit_settings.scale_length = 0.001
    pattern = add_on_top(base)
    bpy.ops.object.mode_set(mode='OBJECT')
    settings = pattern.bubble_pattern
    settings.pitch, settings.diameter = 4.0, 1.5
    settings.process = 'FDM_PRINT'
    assert "asks for" in settings.trouble
    settings.diameter = 2.5
    assert settings.trouble == ""
    assert settings.count > 100


def test_what_breaks_a_rule_of_the_process_is_told_and_marked(pattern: bpy.types.Object) -> None:
    """No draft can be given by making holes smaller."""
    settings = pattern.bubble_pattern
    settings.process = 'INJECTION_MOULDING'
    (draft,) = settings.broken
    assert (draft.rule, draft.count) == ("draft", settings.count)
    assert broken_text(bpy.context, draft) == f"{settings.count} with draft < 1°"
    marks = points(pattern, noting.BROKEN)
    assert (marks[points(pattern, "diameter") > 0] == 1 << noting.RULES.index("draft")).all()
    activate(settings.base)
    assert bpy.ops.bubble_pattern.select_offending(rule='DRAFT') == {'FINISHED'}
    assert bpy.context.active_object == pattern
    assert bpy.context.mode == 'EDIT_MESH'
    assert pattern.data.total_vert_sel == settings.count
    bpy.ops.object.mode_set(mode='OBJECT')
    settings.process = 'NONE'
    assert len(settings.broken) == 0
    assert not points(pattern, noting.BROKEN).any()
    assert bpy.ops.bubble_pattern.select_offending() == {'CANCELLED'}


def test_the_two_of_the_smallest_web_are_selected(pattern: bpy.types.Object) -> None:
    assert bpy.ops.bubble_pattern.select_offending(rule='SMALLEST_WEB') == {'FINISHED'}
    assert pattern.data.total_vert_sel == 2


def test_nominal_sizes(pattern: bpy.types.Object) -> None:
    settings = pattern.bubble_pattern
    settings.diameter_field.kind = 'LINEAR'
    settings.diameter_field.start_size, settings.diameter_field.end_size = 1.2 * MM, 3.2 * MM
    settings.sizes = 'DRILLS_05'
    sizes = np.unique(np.round(points(pattern, "diameter") / MM, 5))
    assert sizes.tolist() == [1.0, 1.5, 2.0, 2.5, 3.0]
    rows = nominal_rows(bpy.context, settings)
    assert [name for name, _ in rows] == [f"Size {size} mm" for size in ("1", "1.5", "2", "2.5", "3")]
    assert sum(int(count) for _, count in rows) == settings.count
    settings.sizes = 'DRILLS_01'
    ((name, count),) = nominal_rows(bpy.context, settings)
    assert (name, int(count)) == ("Sizes", len(np.unique(np.round(points(pattern, "diameter") / MM, 5))))


def test_a_list_of_sizes_is_in_the_scenes_unit(pattern: bpy.types.Object) -> None:
    settings = pattern.bubble_pattern
    bpy.context.scene.unit_settings.length_unit = 'MILLIMETERS'
    settings.sizes = 'LIST'
    assert "The list of sizes is empty" in settings.trouble
    settings.size_list = "1.5, 0.17 cm; 3"
    assert settings.trouble == ""
    assert recipe_of(settings).shaping.sizes == pytest.approx((0.0015, 0.0017, 0.003))
    assert settings.largest == pytest.approx(1.7 * MM)
    settings.size_list = "1.5, wide"
    assert '"wide" in the list of sizes is no length' in settings.trouble
    bpy.context.scene.unit_settings.system = 'NONE'
    settings.size_list = "0.0015, thin"
    assert '"thin" in the list' in settings.trouble
    settings.size_list = "0.0015"
    assert recipe_of(settings).shaping.sizes == (0.0015,)


@pytest.mark.parametrize("system", ['METRIC', 'IMPERIAL', 'NONE'])
def test_settings_and_recipe_are_the_same_thing(pattern: bpy.types.Object, system: str) -> None:
    settings = pattern.bubble_pattern
    bpy.context.scene.unit_settings.system = system
    settings.live = False
    recipe = recipe_from_dict(
        {
            "region": {"attribute": settings.region},
            "packing": {"pitch": 0.004},
            "shaping": {"diameter": 0.002, "sizes": [0.0015, 0.002]},
            "limits": {"process": "laser", "thickness": 0.0012, "check_only": True},
            # without units, one is taken for a millimetre
            "output": {"density": 2.7, "unit": "mm" if system == 'NONE' else "m"},
        }
    )
    take_recipe(settings, recipe)
    assert recipe_to_toml(recipe_of(settings)) == recipe_to_toml(recipe)
    take_recipe(settings, recipe_from_dict({"region": {"all": True}, "shaping": {"sizes": "tap drills"}}))
    assert (settings.sizes, settings.process, settings.density) == ('TAP_DRILLS', 'NONE', 0.0)
    assert recipe_of(settings).shaping.sizes == "tap drills"


# -- Solve For -------------------------------------------------------------------------------------------


def test_the_diameter_is_found_for_an_open_area(pattern: bpy.types.Object) -> None:
    settings = pattern.bubble_pattern
    settings.solve_open_area = 30.0
    places = points(pattern)
    assert bpy.ops.bubble_pattern.solve() == {'FINISHED'}
    assert settings.open_area == pytest.approx(0.3, rel=0.005)
    assert settings.diameter != pytest.approx(2 * MM, rel=0.01)
    assert settings.pitch == pytest.approx(4 * MM)
    assert np.allclose(points(pattern), places, atol=1e-7)
    assert not is_outdated(settings)
    assert settings.live


def test_undo_takes_back_what_was_found_and_what_was_laid(pattern: bpy.types.Object) -> None:
    name = pattern.name
    settings = pattern.bubble_pattern
    settings.solve_for, settings.solve_count = 'COUNT', 100
    before = settings.count
    bpy.ops.ed.undo_push(message="before")
    assert bpy.ops.bubble_pattern.solve() == {'FINISHED'}
    bpy.ops.ed.undo_push(message="Solve")
    bpy.ops.ed.undo()
    back = bpy.data.objects[name]
    assert back.bubble_pattern.count == len(back.data.vertices) == before
    assert back.bubble_pattern.pitch == pytest.approx(4 * MM)
    bpy.ops.ed.redo()
    again = bpy.data.objects[name]
    assert abs(len(again.data.vertices) - 100) <= 1
    assert not is_outdated(again.bubble_pattern)


def test_the_pitch_is_found_for_a_count(pattern: bpy.types.Object) -> None:
    settings = pattern.bubble_pattern
    settings.solve_for, settings.solve_count = 'COUNT', 120
    assert bpy.ops.bubble_pattern.solve() == {'FINISHED'}
    assert abs(settings.count - 120) <= 1
    assert settings.diameter == pytest.approx(2 * MM)
    assert len(pattern.data.vertices) == settings.count
    assert not is_outdated(settings)


def test_the_pitch_is_found_for_an_open_area_of_a_graded_pattern(pattern: bpy.types.Object) -> None:
    settings = pattern.bubble_pattern
    settings.pitch_field.kind = 'LINEAR'
    ratio = settings.pitch_field.end_size / settings.pitch_field.start_size
    settings.solve_by, settings.solve_open_area = 'PITCH', 10.0
    assert bpy.ops.bubble_pattern.solve() == {'FINISHED'}
    one = 1 / settings.count
    assert settings.open_area == pytest.approx(0.1, rel=max(0.005, one))
    assert settings.pitch_field.end_size / settings.pitch_field.start_size == pytest.approx(ratio, rel=1e-4)


def test_what_can_not_be_is_told_and_changes_nothing(pattern: bpy.types.Object) -> None:
    settings = pattern.bubble_pattern
    settings.min_web = 1.5 * MM
    settings.solve_open_area = 70.0
    before = settings.made_with
    with pytest.raises(RuntimeError, match="can't be reached by the diameter"):
        bpy.ops.bubble_pattern.solve()
    assert settings.made_with == before
    assert settings.diameter == pytest.approx(2 * MM)


# -- marks -----------------------------------------------------------------------------------------------


def test_marks_are_lines_in_the_pattern_s_frame(pattern: bpy.types.Object) -> None:
    settings = pattern.bubble_pattern
    web = overlay.web_lines(pattern)
    assert web is not None
    assert web.shape == (6, 3)
    assert np.linalg.norm(web[1] - web[0]) == pytest.approx(settings.web, rel=1e-3)
    assert (web[:, 2] > np.array(settings.web_between)[[2, 5]].max()).all()  # over the surface
    assert not len(overlay.broken_rings(pattern))
    settings.process = 'INJECTION_MOULDING'
    rings = overlay.broken_rings(pattern)
    assert len(rings) == 2 * overlay.CORNERS * settings.count
    assert overlay.color_of(pattern) == overlay.GOOD
    settings.diameter = 0.1 * MM
    assert np.isfinite(overlay.broken_rings(pattern)).all()


def test_without_a_window_nothing_is_drawn_and_nothing_breaks(pattern: bpy.types.Object) -> None:
    settings = pattern.bubble_pattern
    settings.show_marks = True
    assert bpy.app.background
    assert not overlay._handles
    assert list(overlay.wishing(bpy.context)) == [pattern]
    assert overlay.wished_in_file()
    pattern.hide_set(True)
    assert not list(overlay.wishing(bpy.context))
    settings.show_marks = False
    assert not overlay.wished_in_file()


def test_handlers_come_with_the_first_wish_and_go_with_the_last(
    pattern: bpy.types.Object, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As in a window, which this Blender lacks: the handlers themselves are only counted."""
    there: list[str] = []

    class View:
        @staticmethod
        def draw_handler_add(_function: object, _arguments: object, _region: str, kind: str) -> str:
            there.append(kind)
            return kind

        @staticmethod
        def draw_handler_remove(handle: str, _region: str) -> None:
            there.remove(handle)

    monkeypatch.setattr(overlay, "in_background", lambda: False)
    monkeypatch.setattr(overlay, "drawing_space", lambda: View)
    settings = pattern.bubble_pattern
    settings.show_marks = True
    assert there == ['POST_VIEW', 'POST_PIXEL']
    overlay.refresh()
    assert len(there) == 2
    settings.show_marks = False
    assert there == []
    settings.show_marks = True
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    assert there == []


def test_old_settings_have_no_figures_and_that_is_no_error() -> None:
    obj = bpy.data.objects.new("Plain", bpy.data.meshes.new("Plain"))
    bpy.context.collection.objects.link(obj)
    settings = obj.bubble_pattern
    assert pattern_of(obj) is None
    assert quality_figures(settings) == []
    assert removed_figures(bpy.context, settings) == []
    assert nominal_rows(bpy.context, settings) == []
    assert overlay.web_lines(obj) is None
