# mypy: disable-error-code="valid-type"
"""The button and the menu entry that write files for other programs."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import bpy
from bpy.props import EnumProperty, FloatVectorProperty, StringProperty
from bpy_extras.io_utils import ExportHelper

from ..core.errors import PatternError
from .field_properties import point_of
from .operators import OnPattern, current_pattern
from .settings_recipe import spoken

FORMATS = (
    ('STL', "STL (.stl)", "The finished part, in millimeters"),
    ('3MF', "3MF (.3mf)", "The finished part for 3D printing; the file says that it is in millimeters"),
    ('OBJ', "Wavefront (.obj)", "The finished part, in millimeters, shape only"),
    ('PLY', "Stanford PLY (.ply)", "The finished part, in millimeters, shape only"),
    ('GLB', "glTF Binary (.glb)", "The finished part, in meters as glTF has it, shape only"),
    ('CSV', "Hole Table (.csv)", "Centers, directions and sizes of all features, in millimeters"),
    ('DXF', "Drawing (.dxf)", "Drawing for CAD and cutting machines: true circles on layers, in millimeters"),
    ('SVG', "Drawing (.svg)", "Drawing for vector programs, in millimeters"),
    ('TOML', "Recipe (.toml)", "All settings of the pattern, for a batch run or another part"),
)
SUFFIXES = {f".{name.lower()}" for name, _, _ in FORMATS}


class BUBBLE_PATTERN_OT_export(OnPattern, bpy.types.Operator, ExportHelper):
    """Write the part, the table of holes, a drawing or the recipe to a file"""

    bl_idname = "bubble_pattern.export"
    bl_label = "Export Bubble Pattern"
    bl_options = {'REGISTER', 'PRESET'}

    filter_glob: StringProperty(
        default=";".join(f"*{suffix}" for suffix in sorted(SUFFIXES)), options={'HIDDEN'}
    )
    format: EnumProperty(name="Format", description="Kind of file", items=FORMATS, default='STL')
    projection: EnumProperty(
        name="Drawn",
        description="How the features come onto the paper",
        items=(
            ('FLAT', "Laid Flat", "Unrolled, with all features in their true size"),
            ('NORMAL', "From the Front", "Seen against the mean normal of the region"),
            ('GIVEN', "Along a Direction", "Seen against a direction, such as that of a tool"),
        ),
        default='FLAT',
    )
    direction: FloatVectorProperty(
        name="Direction",
        description="Direction towards the viewer of the drawing",
        subtype='XYZ',
        default=(0.0, 0.0, 1.0),
    )
    align: EnumProperty(
        name="Upright",
        description="What the paper's horizontal follows",
        items=(
            ('BASE', "As the World", "Z points up, or Y where the drawing is seen from above"),
            ('ROWS', "Along the Rows", "The rows of features run from left to right"),
        ),
        default='BASE',
    )

    if TYPE_CHECKING:  # what ExportHelper brings
        filepath: str

    @property
    def filename_ext(self) -> str:
        """The suffix of the chosen format."""
        return f".{self.format.lower()}"

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        """Ask for the file, and offer the name of the base."""
        if not self.filepath:
            name = bpy.path.clean_name(current_pattern(context).bubble_pattern.base.name)
            folder = Path(bpy.data.filepath).parent if bpy.data.filepath else Path()
            self.filepath = str(folder / f"{name}{self.filename_ext}")
        return ExportHelper.invoke(self, context, event)

    def check(self, _context: bpy.types.Context) -> bool:
        """Let the name in the file browser end as the format wants."""
        path = Path(self.filepath)
        stem = path.with_suffix("") if path.suffix.lower() in SUFFIXES else path
        if path.name and path.suffix.lower() != self.filename_ext:
            self.filepath = f"{stem}{self.filename_ext}"
            return True
        return False

    def draw(self, _context: bpy.types.Context) -> None:
        """What there is to choose for the format."""
        layout = self.layout
        layout.use_property_split = True
        layout.use_property_decorate = False
        layout.prop(self, "format")
        if self.format in {'DXF', 'SVG'}:
            layout.prop(self, "projection")
            if self.projection == 'GIVEN':
                layout.prop(self, "direction")
            layout.prop(self, "align")

    def execute(self, context: bpy.types.Context) -> set[str]:
        from . import exporting

        path = Path(bpy.path.abspath(self.filepath))
        if self.properties.is_property_set("format") and path.suffix.lower() != self.filename_ext:
            path = path.with_name(path.name + self.filename_ext)
        projection = point_of(self.direction) if self.projection == 'GIVEN' else self.projection.lower()
        try:
            what = exporting.export(current_pattern(context), context, path, projection, self.align.lower())
        except PatternError as error:
            self.report({'ERROR'}, spoken(error, context))
            return {'CANCELLED'}
        self.report({'INFO'}, f"{path.name}: {what}")
        return {'FINISHED'}


def draw_entry(menu: bpy.types.Menu, _context: bpy.types.Context) -> None:
    """The entry in File > Export."""
    menu.layout.operator("bubble_pattern.export", text="Bubble Pattern (.stl/.3mf/.csv/.dxf/.svg)")


_register, _unregister = bpy.utils.register_classes_factory((BUBBLE_PATTERN_OT_export,))


def register() -> None:
    """Register the operator and its entry in File > Export."""
    _register()
    bpy.types.TOPBAR_MT_file_export.append(draw_entry)


def unregister() -> None:
    """Take both back."""
    bpy.types.TOPBAR_MT_file_export.remove(draw_entry)
    _unregister()
