"""Blender's part in a batch run: a .blend as base, a .blend with the editable pattern as result.

In a Blender without the extension, and in the plain `bpy` module, the add-on is registered for as long as it
writes.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import bpy
import numpy as np

from ..core.errors import BaseError, OutputError
from ..core.field_tables import NO_NAMES, Wanted
from ..core.files import LoadedBase, load_base, load_solids
from ..core.mesh import Bools, Floats, Mesh
from ..core.moving import moved_pattern, moved_recipe
from ..core.quality import measure
from ..core.recipe import KeepOut, Recipe
from ..core.recipe_names import recipe_names, with_recipe_images
from .applying import place_part, verdict_of
from .attributes import CORNER_VERTEX, MATERIAL, write_values
from .feature_objects import read_stamp as read_object_stamp
from .generation import fill_settings, measured, put
from .keep_outs import read_solids
from .marked_side import on_marked_side
from .part_mesh import build_part_mesh
from .pattern_object import new_pattern_object
from .picture import SIZE, render_part
from .pixels import load_image
from .pixels import read_image as read_image
from .properties import is_pattern
from .provenance import Original, read_original
from .reading import Base, evaluated_mesh, world_frame
from .reading import read_base as read_object
from .settings_recipe import recipe_of
from .sources import read_source
from .surroundings import read_painted, with_things
from .target_region import ATTRIBUTE, store, stored
from .units import scene_millimetres

if TYPE_CHECKING:
    from ..batch import Run

WORLD = np.eye(4)
# Edges that bend by more than this many degrees are shaded sharp on a base that is of no .blend.
SHARP = 30.0


@dataclass(frozen=True)
class BlendBase(LoadedBase):
    """A base read from the .blend that is open; name: that of its object."""

    name: str = ""


@contextmanager
def registered() -> Iterator[None]:
    """Make sure that objects have the settings of a pattern, for as long as the block lasts."""
    from . import register, unregister

    if hasattr(bpy.types.Object, "bubble_pattern"):
        yield
        return
    register()
    try:
        yield
    finally:
        unregister()


# -- in ------------------------------------------------------------------------------------------------------


def read_base(path: Path | None, names: Wanted = NO_NAMES, keep_outs: Sequence[KeepOut] = ()) -> LoadedBase:
    """The base in a .blend file, with its modifiers and in world coordinates, and of what is painted on it or
    stands beside it what `names` and `keep_outs` ask for; None: in the file that is open.

    Raises BaseError where the file is no .blend, or which of its objects is meant cannot be told.
    """
    if path is not None:
        try:
            bpy.ops.wm.open_mainfile(filepath=str(path.resolve()), load_ui=False)
        except RuntimeError as error:
            reason = str(error).removeprefix("Error: ").strip()
            raise BaseError(f"Base {path.name} is no .blend that this Blender can open: {reason}") from None
    with registered():
        obj = base_object()
        with evaluated_mesh(obj, bpy.context.evaluated_depsgraph_get()) as mesh:
            base = read_object(obj, mesh, WORLD)
            painted = read_painted(obj, mesh, base, replace(names, images=frozenset()))
        around = with_things(painted, names, WORLD, bpy.context)
        solids = read_solids([entry for entry in keep_outs if entry.file is None], WORLD, bpy.context)
        marks = {name: on_marked_side(obj, base, name, mask) for name, mask in base.attributes.items()}
    return BlendBase(
        base.mesh,
        marks,
        base.materials,
        obj.name,
        values=around.attributes,
        uv_maps=around.uv_maps,
        objects=around.objects,
        solids=solids,
        millimetres=scene_millimetres(bpy.context.scene),
    )


def base_object() -> bpy.types.Object:
    """The object of the open file that is the base: the only visible mesh, or else the active one."""
    meshes = [
        obj
        for obj in bpy.context.view_layer.objects
        if obj.type == 'MESH' and obj.data.polygons and obj.visible_get() and not is_pattern(obj)
    ]
    active = bpy.context.view_layer.objects.active
    if len(meshes) == 1:
        return meshes[0]
    if active in meshes:
        return active
    if not meshes:
        raise BaseError("The .blend has no visible mesh object: show the part that is the base, and save")
    names = ", ".join(f'"{obj.name}"' for obj in meshes[:5])
    raise BaseError(f"The .blend has {len(meshes)} mesh objects ({names}): make the base active, and save")


def read_stamp(name: str) -> Mesh:
    """The object of the open file with that name, as a feature."""
    return read_object_stamp(name, bpy.context)


# -- out -----------------------------------------------------------------------------------------------------


def write_blend(path: Path, run: Run) -> None:
    """A .blend that opens with the base, the editable pattern and the part, the part shown.

    Raises OutputError where it cannot be written.
    """
    with registered():
        base_obj, base, original = stand_base(run)
        region = run.recipe.region.attribute or ATTRIBUTE
        if region in base_obj.data.attributes and stored(base_obj, region) is None:
            region = ATTRIBUTE  # what the recipe names is no mark on faces
        if region not in base_obj.data.attributes:
            mark(base_obj, region, base, run.selected)
        pattern_obj = new_pattern_object(base_obj)
        to_frame = np.linalg.inv(world_frame(base_obj))
        fill_settings(pattern_obj, base_obj, region, moved_recipe(with_files_in(run), to_frame, run.region))
        recipe = recipe_of(pattern_obj.bubble_pattern)
        source = read_source(base_obj, region, bpy.context, recipe)
        own = moved_pattern(run.pattern, to_frame)
        laid = measured(own, source.region, recipe, measure(own, source.region))
        laid = replace(laid, seconds=run.report["seconds"]["pack"])
        put(pattern_obj, source, recipe, laid)
        mesh = build_part_mesh(f"{base_obj.name} Part", run.part, run.pattern.places, base, original)
        place_part(base_obj, [pattern_obj], mesh, verdict_of(run.part), bpy.context)
        try:
            bpy.ops.wm.save_as_mainfile(filepath=str(path.resolve()), compress=True, copy=True)
        except RuntimeError as error:
            raise OutputError(f"{path.name} can't be written: {str(error).removeprefix('Error: ')}") from None


def with_files_in(run: Run) -> Recipe:
    """The recipe with the files that it names, images and meshes, taken into the open file, under names that
    fit there.
    """
    names: dict[str, str] = {}
    for name in sorted(recipe_names(run.recipe).images):
        if (run.origin / name).is_file():
            image = load_image(run.origin / name)
            image.name = Path(name).name
            image.pack()
            image.use_fake_user = True  # a field that is kept as text does not hold it
            names[name] = image.name
    recipe = with_recipe_images(run.recipe, names)
    keep_outs = tuple(with_object(entry, run) for entry in recipe.region.keep_out)
    recipe = replace(recipe, region=replace(recipe.region, keep_out=keep_outs))
    mesh = recipe.feature.mesh
    if mesh is not None and (run.origin / mesh).is_file():
        name = stand_aside(Path(mesh).stem, load_base(run.origin / mesh).mesh)
        recipe = replace(recipe, feature=replace(recipe.feature, mesh=name))
    return recipe


def with_object(keep_out: KeepOut, run: Run) -> KeepOut:
    """The keep-out with the mesh file that it names as a hidden object of the open file."""
    if keep_out.file is None:
        return keep_out
    [solid] = load_solids([keep_out.file], run.origin)["file", keep_out.file]
    return replace(keep_out, file=None, object=stand_aside(Path(keep_out.file).stem, solid.mesh))


def stand_aside(name: str, body: Mesh) -> str:
    """Put a mesh into the open file as a hidden object, and say what it is called there."""
    obj = bpy.data.objects.new(name, mesh_of(body))
    bpy.context.scene.collection.objects.link(obj)
    obj.hide_render = True
    bpy.context.view_layer.update()
    obj.hide_set(True)
    return obj.name


def write_picture(path: Path, run: Run, size: tuple[int, int] = SIZE, up: Floats | None = None) -> None:
    """A rendered view of the part as PNG, looking at the pattern. Raises OutputError where that fails.

    size, up: see render_part
    """
    with registered():
        base_obj, base, original = stand_base(run)
        mesh = build_part_mesh(f"{base_obj.name} Part", run.part, run.pattern.places, base, original)
        render_part(path, mesh, np.array(base_obj.matrix_world), run.pattern, size, up)


def stand_base(run: Run) -> tuple[bpy.types.Object, Base, Original]:
    """The object of the run's base, made in a new file where the base is of no .blend, and how it reads."""
    base = run.base
    obj = bpy.data.objects[base.name] if isinstance(base, BlendBase) else new_file_with(base)
    with evaluated_mesh(obj, bpy.context.evaluated_depsgraph_get()) as mesh:
        read, original = read_object(obj, mesh, WORLD), read_original(obj, mesh)
    # The part refers to the base as the file gave it, in double precision.
    return obj, replace(read, mesh=base.mesh), original


def new_file_in_millimeters() -> None:
    """Open a new file without any object, one unit of which is a millimeter."""
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    units = bpy.context.scene.unit_settings
    units.system, units.scale_length, units.length_unit = 'METRIC', 0.001, 'MILLIMETERS'


def new_file_with(base: LoadedBase) -> bpy.types.Object:
    """The object of `base`, the only one in a new file."""
    new_file_in_millimeters()
    obj = bpy.data.objects.new("Base", mesh_of(base.mesh))
    obj.data.set_sharp_from_angle(angle=np.radians(SHARP))  # such files say nothing of shading
    bpy.context.scene.collection.objects.link(obj)
    for name, mask in base.attributes.items():
        write_values(obj.data, name, 'FACE', 'BOOLEAN', mask)
    write_painted(obj.data, base)
    index = np.zeros(len(base.mesh.triangles), dtype=np.int32)
    for row, (name, mask) in enumerate(base.materials.items()):
        obj.data.materials.append(bpy.data.materials.new(name))
        index[mask] = row
    write_values(obj.data, MATERIAL, 'FACE', 'INT', index)
    bpy.context.view_layer.update()
    return obj


def write_painted(mesh: bpy.types.Mesh, base: LoadedBase) -> None:
    """Give the mesh what is painted on `base`: numbers, colours and UV maps. Masks of faces stay masks."""
    for name, values in base.values.items():
        if values.ndim == 1:
            if not np.isin(values, (0.0, 1.0)).all():
                write_values(mesh, name, 'FACE', 'FLOAT', values)
        elif values.ndim == 2:
            write_values(mesh, name, 'CORNER', 'FLOAT', values.reshape(-1))
        else:
            colours = np.ones((values.shape[0] * 3, 4))
            flat = values.reshape(-1, values.shape[2])
            # one channel is grey, two are grey and alpha
            colours[:, :3] = flat[:, :3] if flat.shape[1] > 2 else flat[:, :1]
            if flat.shape[1] in (2, 4):
                colours[:, 3] = flat[:, -1]
            write_values(mesh, name, 'CORNER', 'FLOAT_COLOR', colours)
    for name, uv in base.uv_maps.items():
        mesh.uv_layers.new(name=name, do_init=False).uv.foreach_set(
            "vector", np.ascontiguousarray(uv, dtype=np.float32).ravel()
        )


def mesh_of(base: Mesh) -> bpy.types.Mesh:
    """A Blender mesh of these triangles, row by row."""
    mesh = bpy.data.meshes.new("Base")
    mesh.vertices.add(len(base.vertices))
    mesh.loops.add(base.triangles.size)
    mesh.polygons.add(len(base.triangles))
    write_values(mesh, "position", 'POINT', 'FLOAT_VECTOR', base.vertices)
    write_values(mesh, CORNER_VERTEX, 'CORNER', 'INT', base.triangles)
    mesh.polygons.foreach_set("loop_start", np.arange(0, base.triangles.size, 3, dtype=np.int32))
    mesh.update(calc_edges=True)
    return mesh


def mark(obj: bpy.types.Object, region: str, base: Base, selected: Bools) -> None:
    """Store the target region, triangles `selected` (T,), as a face attribute of the object's own mesh.

    Modifiers that change the faces are applied first: which face an evaluated one stems from cannot be told.
    """
    faces = int(base.polygon.max()) + 1
    if faces != len(obj.data.polygons):
        graph = bpy.context.evaluated_depsgraph_get()
        applied = bpy.data.meshes.new_from_object(
            obj.evaluated_get(graph), preserve_all_data_layers=True, depsgraph=graph
        )
        obj.modifiers.clear()
        obj.data = applied
    marked = np.zeros(len(obj.data.polygons), dtype=bool)
    marked[base.polygon[selected]] = True
    store(obj, region, marked)
