"""A sidebar of 250 pixels cuts nothing off: texts of all panels measured in Blender's own font.

Such a sidebar leaves a row of 195 pixels beside the tabs, of which a property's name gets two fifths and the
property itself the rest, as pictures of Blender 5.2 show.
"""

from __future__ import annotations

from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import pytest

bpy = pytest.importorskip("bpy", reason="needs the bpy module: python scripts/test.py --blender VERSION")

import blf  # noqa: E402

from bubble_pattern_addon.blender import (  # noqa: E402
    feature_panel,
    keep_outs,
    limits_panel,
    packing_panel,
    panels,
    region_panel,
    result_panel,
    shaping_panel,
    sidebar,
)

from .parts import activate, add_on_top, plate  # noqa: E402
from .test_fields import KIND_NAMES  # noqa: E402

WIDTH, ROW = 250, 195
NAME, ICON, ARROW, PADDING = 0.4, 20, 14, 5
SHOWN = (region_panel, keep_outs, packing_panel, shaping_panel, feature_panel, limits_panel, result_panel)


def wide(text: str) -> float:
    """Width of a text in pixels, in the font of Blender's buttons."""
    blf.size(0, 11)
    return float(blf.dimensions(0, text)[0])


class Measuring:
    """A layout `width` pixels wide that measures what is drawn in it; `cut` takes down what does not fit."""

    def __init__(self, cut: list[str], width: float, split: bool = False) -> None:
        self.cut, self.width, self.use_property_split = cut, width, split

    def fits(self, text: str, width: float) -> None:
        if wide(text) > width:
            self.cut.append(f"{text}: {wide(text):.0f} > {width:.0f}")

    def prop(
        self, data: Any, name: str, text: str | None = None, expand: bool = False, **options: Any
    ) -> None:
        known = data.bl_rna.properties[name]
        text = known.name if text is None else text
        room = self.width - (ICON if options.get("icon") else 0)
        if known.type == 'BOOLEAN':
            self.fits(text, room * (1 - NAME) - ICON if self.use_property_split else room - 2 * PADDING)
            return
        if self.use_property_split:
            axis = " X" if text.strip() and getattr(known, "array_length", 0) == 3 else ""
            self.fits(text + axis, NAME * self.width - PADDING)
            room *= 1 - NAME
        if known.type == 'ENUM' and not options.get("icon_only"):
            for item in known.enum_items:
                part = room / len(known.enum_items) if expand else room - ARROW
                self.fits(item.name, part - PADDING - (ICON if item.icon != 'NONE' and not expand else 0))

    def label(self, text: str = "", icon: str = 'NONE') -> None:
        self.fits(text, self.width - (ICON if icon != 'NONE' else 0))

    def operator(self, name: str, text: str | None = None, icon: str = 'NONE', **_options: Any) -> Any:
        self.fits(label_of(name, text), self.width - PADDING - (ICON if icon != 'NONE' else 0))
        return SimpleNamespace()

    def column(self, **_options: Any) -> Measuring:
        return Measuring(self.cut, self.width, self.use_property_split)

    def row(self, **_options: Any) -> Row:
        return Row(self.cut, self.width, self.use_property_split)

    def split(self, factor: float) -> Split:
        return Split(self.cut, self.width, factor)

    def ignored(self, *_arguments: Any, **_options: Any) -> None: ...

    menu = template_ID = template_list = progress = separator = operator_menu_enum = ignored


class Row(Measuring):
    """What stands side by side: buttons with a text have equal shares of the width."""

    def __init__(self, *arguments: Any) -> None:
        super().__init__(*arguments)
        self.texts: list[str] = []

    def operator(self, name: str, text: str | None = None, icon: str = 'NONE', **_options: Any) -> Any:
        if text != "":
            self.texts.append(label_of(name, text))
            if len(self.texts) > 1:  # what was measured as if it had the row for itself
                first, *_ = self.texts
                self.fits(first, self.width / len(self.texts) - PADDING - ICON)
            self.fits(self.texts[-1], self.width / len(self.texts) - PADDING - ICON)
        return SimpleNamespace()


class Split(Measuring):
    """Two columns, the first of which takes a share of the width."""

    def __init__(self, cut: list[str], width: float, factor: float) -> None:
        super().__init__(cut, width)
        self.parts = [factor * width, (1 - factor) * width]

    def row(self, **_options: Any) -> Row:
        return Row(self.cut, self.parts.pop(0))


def label_of(name: str, text: str | None) -> str:
    """What a button says."""
    group, _, kind = name.partition(".")
    return getattr(getattr(bpy.ops, group), kind).get_rna_type().name if text is None else text


def drawn(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """What is cut off in the panels as they would be drawn now."""
    now = bpy.context
    context = SimpleNamespace(
        active_object=now.active_object,
        mode=now.mode,
        scene=now.scene,
        region=SimpleNamespace(width=WIDTH),
        preferences=SimpleNamespace(system=SimpleNamespace(ui_scale=1.0)),
    )
    cut: list[str] = []
    with monkeypatch.context() as patched:
        patched.setattr(bpy, "context", context)  # without a window it has no scale of the interface
        for module in SHOWN:
            for cls in module.CLASSES:
                if issubclass(cls, sidebar.SettingsPanel) and cls.poll(context):
                    draw_of(cls)(stand_in(cls, cut), context)
        main = panels.BUBBLE_PATTERN_PT_main
        main.draw(stand_in(main, cut), context)
    return cut


def stand_in(cls: type, cut: list[str]) -> Any:
    """A panel of this kind to draw in."""
    methods = {name: value for name, value in vars(cls).items() if name.startswith("draw_")}
    panel = SimpleNamespace(layout=Measuring(cut, ROW), fields=getattr(cls, "fields", ()))
    for name, method in methods.items():
        setattr(panel, name, method.__get__(panel))
    return panel


def draw_of(cls: type) -> Callable[[Any, Any], None]:
    """How a panel draws itself; without what it inherits, which asks for a panel."""
    if cls is result_panel.BUBBLE_PATTERN_PT_preview:
        return sidebar.SettingsPanel.draw
    return cls.draw


def states(settings: Any) -> Any:
    """Changes of settings, after each of which the panels are looked at."""
    yield
    settings.pitch_field.kind = 'LINEAR'
    settings.symmetry, settings.use_symmetry_centre, settings.use_symmetry_axes = 'ROTATE', True, True
    settings.orientation = 'GIVEN'
    yield
    settings.live = False
    for kind in (*KIND_NAMES, 'RECIPE'):
        for name in ("diameter", "depth", "aspect", "draft", "angle"):
            getattr(settings, f"{name}_field").kind = kind
        settings.profile, settings.turn = 'SLOT', 'AROUND'
        settings.rim, settings.depth_mode = 'CHAMFER', 'BLIND'
        yield
    settings.kind, settings.form, settings.sizes, settings.diameter_mode = 'BUMP', 'BOSS', 'LIST', 'SHARE'
    settings.process, settings.density, settings.solve_for = 'PUNCHED_SHEET', 2.7, 'COUNT'
    settings.keep_out.add()
    for profile in ('POLYGON', 'CURVE', 'MESH'):
        settings.profile = profile
        yield
    for rule, least in (
        ("hole", 0.0125),
        ("slender", 0.002),
        ("web", 0.0125),
        ("margin", 0.0125),
        ("draft", 1.5),
    ):
        one = settings.broken.add()
        one.rule, one.count, one.least = rule, 1234, least
    settings.web_ids = (1, 2)
    settings.shrunk = settings.dropped = 12345
    yield


def test_nothing_is_cut_off_in_a_narrow_sidebar(monkeypatch: pytest.MonkeyPatch) -> None:
    bpy.context.scene.unit_settings.length_unit = 'MILLIMETERS'
    assert drawn(monkeypatch) == []
    pattern = add_on_top(plate())
    for number, _ in enumerate(states(pattern.bubble_pattern)):
        assert drawn(monkeypatch) == [], f"state {number}"


def test_points_and_parts_too(monkeypatch: pytest.MonkeyPatch) -> None:
    pattern = add_on_top(plate())
    activate(pattern)
    assert bpy.ops.bubble_pattern.edit_sizes() == {'FINISHED'}
    assert drawn(monkeypatch) == []
    bpy.ops.object.mode_set(mode='OBJECT')
    assert bpy.ops.bubble_pattern.apply() == {'FINISHED'}
    assert drawn(monkeypatch) == []


def test_what_does_not_fit_is_noticed() -> None:
    settings = add_on_top(plate()).bubble_pattern
    cut: list[str] = []
    layout = Measuring(cut, ROW, split=True)
    layout.prop(settings, "density", text="Density (g/cm³)")
    layout.prop(settings, "kind", text="Kind", expand=True)
    row = layout.row()
    row.operator("bubble_pattern.edit_sizes", text="Edit Sizes of Features")
    row.operator("bubble_pattern.free_sizes", text="Free")
    assert [entry.split(":")[0] for entry in cut] == [
        "Density (g/cm³)", "Dimple", "Edit Sizes of Features"
    ]  # fmt: skip
