"""Recipes in and out of the panel: copied, pasted, saved, loaded, kept as presets; and the batch run
agrees.
"""

from __future__ import annotations

import tomllib
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

bpy = pytest.importorskip("bpy", reason="needs the bpy module: python scripts/test.py --blender VERSION")

import bubble_pattern_addon  # noqa: E402
from bubble_pattern_addon import batch  # noqa: E402
from bubble_pattern_addon.blender import generation, presets, recipe_exchange, recipe_operators, sources  # noqa: E402
from bubble_pattern_addon.blender.settings_recipe import recipe_of  # noqa: E402
from bubble_pattern_addon.core.errors import RecipeError  # noqa: E402
from bubble_pattern_addon.core.progress import drive  # noqa: E402

from .parts import activate, add_on_top, panel, plate, points  # noqa: E402

OPS = bpy.ops.bubble_pattern
SHIPPED = sorted((presets.SHIPPED / "presets" / presets.SUBDIR).glob("*.toml"))


def a_pattern(size: float = 0.1, name: str = "Plate") -> bpy.types.Object:
    """A pattern on the top of a plate, in Object Mode."""
    base = plate(size, name=name)
    pattern = add_on_top(base)
    bpy.ops.object.mode_set(mode='OBJECT')
    activate(base)
    return pattern


def copied() -> str:
    """The text of the active pattern's recipe."""
    assert OPS.recipe_copy() == {'FINISHED'}
    return "".join(recipe_operators._held)


def state(pattern: bpy.types.Object) -> tuple[Any, ...]:
    """Settings and points of a pattern."""
    return recipe_of(pattern.bubble_pattern), points(pattern).tolist(), points(pattern, "diameter").tolist()


def varied(pattern: bpy.types.Object) -> None:
    """Settings that are all a little different from what was chosen for the user."""
    settings = pattern.bubble_pattern
    settings.pitch = 0.0062
    settings.diameter = 0.0041
    settings.edge_offset = 0.0007
    settings.seed = 3
    settings.min_web = 0.0008
    settings.depth_mode, settings.depth = 'BLIND', 0.002
    settings.diameter_field.kind = 'EDGE'
    assert OPS.update() == {'FINISHED'}  # sizes follow from the places in single precision until then


# -- copy and paste ------------------------------------------------------------------------------------------


def test_a_copied_recipe_says_its_unit_and_is_a_recipe() -> None:
    pattern = a_pattern()
    varied(pattern)
    text = copied()
    assert text.splitlines()[0] == recipe_exchange.LINE.format(unit="m").strip()
    tables = tomllib.loads(text)
    assert tables["output"]["unit"] == "m"
    assert tables["packing"]["pitch"] == 0.0062
    bpy.context.scene.unit_settings.scale_length = 0.001
    assert tomllib.loads(copied())["output"]["unit"] == "mm"
    bpy.context.scene.unit_settings.scale_length = 0.007
    assert tomllib.loads(copied())["output"]["unit"] == 7.0
    bpy.context.scene.unit_settings.system = 'NONE'
    assert "unit" not in tomllib.loads(copied())["output"]


def test_a_pasted_recipe_lays_the_same_pattern_on_another_part() -> None:
    first = a_pattern()
    varied(first)
    copied()
    before = state(first)
    second = a_pattern(name="Other")
    assert points(second).shape != points(first).shape
    assert OPS.recipe_paste() == {'FINISHED'}
    assert state(second) == before
    assert second.bubble_pattern.region == "bubble_region"


def test_places_in_a_recipe_follow_the_part() -> None:
    """What is copied is in the world's coordinates, whatever frame the base has."""
    base = plate()
    base.location, base.rotation_euler = (0.3, -0.2, 0.1), (0.4, 0.5, 0.6)
    bpy.context.view_layer.update()
    first = add_on_top_of(base)
    settings = first.bubble_pattern
    settings.orientation, settings.rows_along = 'GIVEN', (0.0, 1.0, 0.0)
    tables = tomllib.loads(copied())
    across = np.array(base.matrix_world.to_3x3()) @ [0, 1, 0]
    assert tables["packing"]["orientation"] == pytest.approx(across, abs=1e-6)
    before = points(first)
    settings.orientation = 'EDGE'
    assert OPS.recipe_paste() == {'FINISHED'}
    assert np.array(settings.rows_along) == pytest.approx([0, 1, 0], abs=1e-6)
    assert points(first) == pytest.approx(before, abs=1e-5)


def add_on_top_of(base: bpy.types.Object) -> bpy.types.Object:
    """A pattern on the first face that is on top in the object's own coordinates."""
    marked = base.data.attributes.new("bubble_region", 'BOOLEAN', 'FACE')
    marked.data.foreach_set("value", [face.normal.z > 0.7 for face in base.data.polygons])
    activate(base)
    assert OPS.add() == {'FINISHED'}
    (pattern,) = base.children
    return pattern


def test_lengths_are_converted_to_the_scenes_unit() -> None:
    pattern = a_pattern()
    recipe_operators._held[:] = ['[packing]\npitch = 6\n[shaping]\ndiameter = 3.6\n[output]\nunit = "mm"']
    assert OPS.recipe_paste() == {'FINISHED'}
    assert pattern.bubble_pattern.pitch == pytest.approx(0.006)
    assert pattern.bubble_pattern.diameter == pytest.approx(0.0036)


@pytest.mark.parametrize("keeps", [True, False])
def test_the_clipboard_is_used_where_there_is_one(keeps: bool) -> None:
    class Manager:
        """A window manager, with a clipboard or without, as in the background."""

        text = ""

        @property
        def clipboard(self) -> str:
            return self.text

        @clipboard.setter
        def clipboard(self, text: str) -> None:
            self.text = text if keeps else ""

    context = SimpleNamespace(window_manager=Manager())
    assert recipe_operators.to_clipboard("one", context) is keeps
    assert recipe_operators.from_clipboard(context) == "one"
    if keeps:
        context.window_manager.clipboard = "from elsewhere"
        assert recipe_operators.from_clipboard(context) == "from elsewhere"


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "clipboard is empty"),
        ("Dear Sir", "holds no recipe"),
        ("[packing]\npich = 3", "did you mean pitch"),
        ("[packing]\npitch = 1e-9\n", "features on a region"),
        ("[packing]\npitch = 0.01\n[shaping]\ndiameter = 0.02", "leaves no web"),
        ('[shaping.diameter]\nkind = "attribute"\nname = "none"\nfrom = 0.001\nto = 0.002', "none"),
        ('[packing]\npitch = 90\n[output]\nunit = "mm"', "pitch"),
    ],
)
def test_a_recipe_that_cannot_be_used_changes_nothing(text: str, words: str) -> None:
    pattern = a_pattern()
    varied(pattern)
    before = state(pattern)
    recipe_operators._held[:] = [text]
    with pytest.raises(RuntimeError, match=words):
        OPS.recipe_paste()
    assert state(pattern) == before
    assert pattern.bubble_pattern.live


def test_recipes_go_through_files(tmp_path: Path) -> None:
    pattern = a_pattern()
    varied(pattern)
    path = tmp_path / "grille.toml"
    assert OPS.recipe_save(filepath=str(path)) == {'FINISHED'}
    assert path.read_text(encoding="utf-8") == copied()
    assert [*tmp_path.iterdir()] == [path]
    before = state(pattern)
    pattern.bubble_pattern.pitch = 0.009
    assert OPS.recipe_load(filepath=str(path)) == {'FINISHED'}
    assert state(pattern) == before
    with pytest.raises(RuntimeError, match="does not exist"):
        OPS.recipe_load(filepath=str(tmp_path / "none.toml"))
    with pytest.raises(RuntimeError, match="does not exist"):
        OPS.recipe_save(filepath=str(tmp_path / "none" / "grille.toml"))


# -- panel and batch run -------------------------------------------------------------------------------------


def test_the_batch_run_makes_the_same_features_bit_for_bit(tmp_path: Path) -> None:
    base = panel()
    pattern = add_on_top(base)
    bpy.ops.object.mode_set(mode='OBJECT')
    activate(base)
    settings = pattern.bubble_pattern
    settings.pitch, settings.edge_offset, settings.min_web, settings.seed = 0.0093, 0.0004, 0.001, 2
    settings.diameter_mode, settings.fill = 'SHARE', 0.55
    recipe = recipe_of(settings)
    source = sources.read_source(base, settings.region, bpy.context, recipe)
    laid = drive(generation.laying_steps(source, recipe)).pattern
    (tmp_path / "recipe.toml").write_text(copied(), encoding="utf-8")
    pattern.hide_set(True)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "base.blend"))
    arguments = [tmp_path / "recipe.toml", "--base", tmp_path / "base.blend", "--out", tmp_path / "out"]
    assert batch.main([*map(str, arguments), "--quiet"]) == 0
    table = np.genfromtxt(tmp_path / "out" / "features.csv", delimiter=",", names=True)
    there = np.stack([table[name] for name in ("x", "y", "z")], axis=1)
    assert np.array_equal(there, laid.position)
    assert np.array_equal(np.stack([table[name] for name in ("nx", "ny", "nz")], axis=1), laid.normal)
    assert np.array_equal(table["diameter"], laid.diameter)
    assert np.array_equal(table["pitch"], laid.pitch)
    assert np.array_equal(table["id"], laid.ids)


# -- presets -------------------------------------------------------------------------------------------------


def load(name: str) -> set[str]:
    """Choose a preset of the menu by its file's name."""
    (path,) = [path for path in SHIPPED if path.stem == name]
    return OPS.preset_load(filepath=str(path))


def test_six_presets_come_along() -> None:
    names = [bpy.path.display_name(path.name, title_case=False) for path in SHIPPED]
    assert names == ["Grip", "Halftone", "Shower Head", "Speaker Coarse", "Speaker Fine", "Vent"]
    assert str(SHIPPED[0].parent) in bpy.utils.preset_paths(presets.SUBDIR)


@pytest.mark.parametrize("path", SHIPPED, ids=lambda path: path.stem)
def test_a_preset_lays_the_pattern(path: Path) -> None:
    pattern = a_pattern(size=0.06)
    assert OPS.preset_load(filepath=str(path)) == {'FINISHED'}
    settings = pattern.bubble_pattern
    assert settings.count > 60
    assert not settings.trouble
    tables = tomllib.loads(path.read_text())
    if "pitch" in tables.get("packing", {}):
        assert settings.pitch == pytest.approx(
            tables["packing"]["pitch"] / 1000
        )  # millimetres are what they are
    else:
        assert 300 < settings.count < 700  # fits the region, whatever its size
    assert OPS.apply() == {'FINISHED'}
    assert not settings.verdict


@pytest.mark.parametrize("scale", [1.0, 0.001])
def test_a_presets_lengths_are_millimetres_in_any_scene(scale: float) -> None:
    bpy.context.scene.unit_settings.scale_length = scale
    pattern = a_pattern(size=0.1 / scale)
    load("Shower_Head")
    assert pattern.bubble_pattern.pitch == pytest.approx(0.007 / scale)
    assert pattern.bubble_pattern.diameter == pytest.approx(0.0012 / scale)


def test_a_preset_that_fits_itself_does_so_on_any_part() -> None:
    large, small = a_pattern(size=2.0), a_pattern(size=0.01, name="Small")
    for pattern in (large, small):
        activate(pattern.bubble_pattern.base)
        load("Vent")
        assert pattern.bubble_pattern.fill == pytest.approx(0.85)
    assert large.bubble_pattern.count == pytest.approx(small.bubble_pattern.count, rel=0.05)
    assert large.bubble_pattern.pitch == pytest.approx(200 * small.bubble_pattern.pitch)


def test_a_preset_leaves_rows_and_symmetry_as_they_are() -> None:
    pattern = a_pattern()
    settings = pattern.bubble_pattern
    settings.orientation, settings.rows_along = 'GIVEN', (0.0, 1.0, 0.0)
    settings.seed = 5
    settings.edge_offset = 0.001
    load("Speaker_Coarse")
    assert settings.orientation == 'GIVEN'
    assert settings.seed == 5
    assert settings.edge_offset == 0


@pytest.mark.parametrize(
    ("size", "name", "words"),
    [
        (0.004, "Shower_Head", "No bubble fits"),
        (0.010, "Shower_Head", "too small for this recipe, whose pitch is up to 7 mm"),
        (4.0, "Speaker_Fine", "about 4,618,802 features on a region 4 m across"),
    ],
)
def test_a_preset_that_does_not_fit_says_so_and_changes_nothing(size: float, name: str, words: str) -> None:
    pattern = a_pattern(size=size)
    before = state(pattern)
    with pytest.raises(RuntimeError, match=words):
        load(name)
    assert state(pattern) == before


def test_users_keep_presets_of_their_own() -> None:
    pattern = a_pattern()
    varied(pattern)
    assert OPS.preset_add(name="My grille") == {'FINISHED'}
    path = bpy.utils.preset_find("My_grille", presets.SUBDIR, ext=presets.SUFFIX)
    assert path
    try:
        tables = tomllib.loads(Path(path).read_text(encoding="utf-8"))
        assert tables["packing"]["pitch"] == 6.2  # millimetres
        assert "region" not in tables
        assert OPS.preset_add(name="My grille") == {'CANCELLED'}
        before = state(pattern)
        load("Vent")
        assert state(pattern) != before
        assert OPS.preset_load(filepath=path) == {'FINISHED'}
        assert state(pattern)[1:] == before[1:]
    finally:
        assert OPS.preset_add(name="My grille", remove_name=True) == {'FINISHED'}
    assert not Path(path).exists()
    assert OPS.preset_add(name="My grille", remove_name=True) == {'CANCELLED'}


def test_what_came_along_cannot_be_removed() -> None:
    a_pattern()
    assert OPS.preset_add(name="Vent", remove_name=True) == {'CANCELLED'}
    assert len([*SHIPPED[0].parent.glob("*.toml")]) == 6


def test_without_a_pattern_the_buttons_say_why() -> None:
    plate()
    for name in ("recipe_copy", "recipe_paste", "recipe_save", "recipe_load", "preset_load", "preset_add"):
        with pytest.raises(RuntimeError, match="Select a pattern, its base or its part first"):
            getattr(OPS, name)()


def test_nothing_stays_in_the_menus() -> None:
    bubble_pattern_addon.unregister()
    try:
        folders = bpy.utils.preset_paths(presets.SUBDIR)
        assert not [folder for folder in folders if folder.startswith(str(presets.SHIPPED))]
        assert not presets._registered
        entries = bpy.types.TOPBAR_MT_file_export._dyn_ui_initialize()
        assert not [entry for entry in entries if "bubble" in getattr(entry, "__module__", "")]
    finally:
        bubble_pattern_addon.register()


def test_an_empty_clipboard_is_told() -> None:
    recipe_operators._held.clear()
    with pytest.raises(RecipeError, match="copy a recipe first"):
        recipe_operators.from_clipboard(bpy.context)


def test_a_target_in_a_recipe_is_solved_for_as_the_button_does() -> None:
    pattern, twin = a_pattern(), a_pattern(name="Twin")
    activate(pattern.bubble_pattern.base)
    recipe_operators._held[:] = ["[solve]\nopen_area = 0.3"]
    assert OPS.recipe_paste() == {'FINISHED'}
    assert pattern.bubble_pattern.open_area == pytest.approx(0.3, rel=0.005)
    activate(twin.bubble_pattern.base)
    twin.bubble_pattern.solve_for, twin.bubble_pattern.solve_open_area = 'OPEN_AREA', 30.0
    assert OPS.solve() == {'FINISHED'}
    assert pattern.bubble_pattern.diameter == pytest.approx(twin.bubble_pattern.diameter, rel=0.005)


def test_the_rules_of_a_process_go_along() -> None:
    pattern = a_pattern()
    pattern.bubble_pattern.process = 'LASER'
    pattern.bubble_pattern.density = 2.7
    tables = tomllib.loads(copied())
    assert tables["limits"]["process"] == "laser"
    assert tables["output"] == tables["output"] | {"density": 2.7, "unit": "m"}
