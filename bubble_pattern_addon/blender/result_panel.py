"""The sub-panels of what came out, of what it shall come to, and of how it is shown."""

from __future__ import annotations

from typing import Any, NamedTuple

import bpy

from ..core.density import mass
from ..core.units import millimetres_in
from .making_recipe import scene_unit
from .recipe_operators import draw_files
from .settings_recipe import is_outdated, length_text, part_text
from .sidebar import SettingsPanel, columns, sentences, shown_settings

# More nominal sizes than this are only counted.
MOST_ROWS = 10
# A place as far as this from every feature, in pitches, has room for another one.
ROOM = 1.0


class Figure(NamedTuple):
    """A row of the results: its name, what it says, and whether it is cause for alarm."""

    name: str
    text: str
    alert: bool = False


class BUBBLE_PATTERN_PT_preview(SettingsPanel, bpy.types.Panel):
    """How the pattern is shown."""

    bl_label = "Preview"
    bl_order = 7
    bl_options = {'DEFAULT_CLOSED'}
    fields = ("live", "show_bubbles", "cut_preview")

    def draw(self, context: bpy.types.Context) -> None:
        super().draw(context)
        trouble = shown_settings(context).cut_trouble
        if trouble:
            sentences(self.layout, trouble, context.region.width, 'ERROR')


class BUBBLE_PATTERN_PT_result(SettingsPanel, bpy.types.Panel):
    """What came out."""

    bl_label = "Result"
    bl_order = 6

    def draw(self, context: bpy.types.Context) -> None:
        settings = shown_settings(context)
        layout = self.layout
        layout.active = not is_outdated(settings)
        draw_table(layout, [*size_figures(context, settings), *removed_figures(context, settings)])
        draw_table(layout, quality_figures(settings), 0.43)
        for one in settings.broken:
            draw_broken(context, layout, one)
        row = layout.row(align=True)
        row.prop(settings, "show_marks", toggle=True, icon='HIDE_OFF' if settings.show_marks else 'HIDE_ON')
        if settings.web_ids[0] >= 0:
            go = row.operator("bubble_pattern.select_offending", text="", icon='VIEWZOOM')
            go.rule = 'SMALLEST_WEB'
        draw_density(layout, settings)
        draw_files(layout)
        if settings.notes:
            sentences(layout, settings.notes, context.region.width, 'INFO')


def draw_table(layout: bpy.types.UILayout, figures: list[Figure], names: float = 0.5) -> None:
    """Names on the left, which take the share `names` of the width, figures on the right."""
    table = layout.column(align=True)
    for name, text, alert in figures:
        split = table.split(factor=names)
        left = split.row()
        left.alignment = 'RIGHT'
        left.label(text=name)
        right = split.row()
        right.alert = alert
        right.label(text=text)


def draw_density(layout: bpy.types.UILayout, settings: Any) -> None:
    """The density, with its unit, which Blender has none for."""
    row = columns(layout).row(align=True)
    row.prop(settings, "density")
    row.label(text="g/cm³")


def size_figures(context: bpy.types.Context, settings: Any) -> list[Figure]:
    """How many features there are, how large, how far apart, how much they open."""
    broken = {one.rule for one in settings.broken}
    figures = [Figure("Features", f"{settings.count:,}", settings.count == 0)]
    for name, count in (("Made Smaller", settings.shrunk), ("Left Out", settings.dropped)):
        if count:
            figures.append(Figure(name, f"{count:,}"))
    if settings.smallest >= 0:
        alert = bool(broken & {"hole", "slender"})
        texts = [length_text(context, size) for size in (settings.smallest, settings.largest)]
        names = ["Diameter"] if texts[0] == texts[1] else ["Smallest Size", "Largest Size"]
        figures.append(Figure(names[0], texts[0], alert))
        figures += [Figure(name, texts[1]) for name in names[1:]]
    figures += [Figure(name, text) for name, text in nominal_rows(context, settings)]
    if settings.web_ids[0] >= 0:
        alert = settings.web < 0 or "web" in broken
        figures.append(Figure("Smallest Web", length_text(context, settings.web), alert))
    if settings.mean_web >= 0:
        figures.append(Figure("Mean Web", length_text(context, settings.mean_web)))
    if settings.margin >= 0 or "margin" in broken:
        figures.append(Figure("Smallest Margin", length_text(context, settings.margin), "margin" in broken))
    figures.append(Figure("Open Area", f"{settings.open_area:.1%}"))
    return figures


def nominal_rows(context: bpy.types.Context, settings: Any) -> list[tuple[str, str]]:
    """How many features have which nominal diameter, the largest at the end; where that is a long list, only
    how many diameters there are.
    """
    entries = [entry.split(",") for entry in settings.nominal.split(";") if entry]
    if len(entries) > MOST_ROWS:
        return [("Sizes", f"{len(entries)}")]
    return [(f"Size {length_text(context, float(size))}", f"{int(count):,}") for size, count in entries]


def removed_figures(context: bpy.types.Context, settings: Any) -> list[Figure]:
    """The volume that the features take away or add, and its mass: estimated before Apply, exact after."""
    exact = bool(settings.part_made_with) and settings.part_made_with == part_text(settings)
    if not exact and settings.removed < 0:
        return []  # not known
    volume = settings.part_removed if exact else settings.removed
    about, what = "" if exact else "≈ ", "Added" if volume < 0 else "Removed"
    figures = [Figure(what, about + volume_text(context, abs(volume)))]
    if settings.density > 0:
        grams = mass(abs(volume), settings.density, 1 / millimetres_in(scene_unit()))
        figures.append(Figure(f"Mass {what}", about + mass_text(context, grams)))
    return figures


def volume_text(context: bpy.types.Context, volume: float) -> str:
    """A volume in the scene's unit."""
    units = context.scene.unit_settings
    if units.system == 'NONE':
        return f"{volume:.4g}"
    return str(bpy.utils.units.to_string(units.system, 'VOLUME', volume * units.scale_length**3, precision=4))


def mass_text(context: bpy.types.Context, grams: float) -> str:
    """A mass in the scene's unit."""
    units = context.scene.unit_settings
    if units.system == 'NONE':
        return f"{grams:.4g} g"
    return str(bpy.utils.units.to_string(units.system, 'MASS', grams / 1000, precision=4))


def quality_figures(settings: Any) -> list[Figure]:
    """How good the packing is, in words, with the figure behind each word."""
    behind = {
        "order": f"{settings.six:.0%}",
        "gaps": f"±{settings.gap_cv:.1%}",
        "smallest_gap": f"{settings.gap_min:.2f}",
        "first_row": f"±{settings.rim_cv:.1%}",
    }
    entries = [entry.split(",") for entry in settings.words.split(";") if entry]
    figures = [
        Figure(name.replace("_", " ").title(), f"{word.title()} ({behind[name]})", word == "poor")
        for name, word in entries
    ]
    if settings.void >= 0:
        figures.append(Figure("Widest Void", f"{settings.void:.2f} pitches", settings.void >= ROOM))
    return figures


def draw_broken(context: bpy.types.Context, layout: bpy.types.UILayout, one: Any) -> None:
    """A rule that features break, with the button that goes there."""
    row = layout.row(align=True)
    label = row.row()
    label.alert = True
    label.label(text=broken_text(context, one), icon='ERROR')
    row.operator("bubble_pattern.select_offending", text="", icon='VIEWZOOM').rule = one.rule.upper()


def broken_text(context: bpy.types.Context, one: Any) -> str:
    """Which rule, and how many features break it; how far the worst falls short is among the figures."""
    least = f"{one.least:g}°" if one.rule == "draft" else length_text(context, one.least)
    what = {
        "hole": f"smaller than {least}",
        "slender": f"too deep below {least}",
        "web": f"with a web < {least}",
        "margin": f"with a margin < {least}",
        "draft": f"with draft < {least}",
    }
    return f"{one.count:,} {what[one.rule]}"


class BUBBLE_PATTERN_PT_solve(SettingsPanel, bpy.types.Panel):
    """What the pattern shall come to."""

    bl_label = "Solve For"
    bl_parent_id = "BUBBLE_PATTERN_PT_result"
    bl_options = {'DEFAULT_CLOSED'}

    def draw(self, context: bpy.types.Context) -> None:
        settings = shown_settings(context)
        column = columns(self.layout)
        column.prop(settings, "solve_for", text="Target")
        if settings.solve_for == 'COUNT':
            column.prop(settings, "solve_count")
        else:
            column.prop(settings, "solve_open_area", text="Share")
            column.row().prop(settings, "solve_by", expand=True)
        column.operator("bubble_pattern.solve", icon='DRIVER_TRANSFORM')


CLASSES = (BUBBLE_PATTERN_PT_result, BUBBLE_PATTERN_PT_solve, BUBBLE_PATTERN_PT_preview)
