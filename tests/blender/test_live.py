"""The designer's seat: what follows a change, what tells that the base has changed, what survives what."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial import cKDTree

bpy = pytest.importorskip("bpy", reason="needs the bpy module: python scripts/test.py --blender VERSION")

from bubble_pattern_addon.blender import generation, live, runs, sources, stepping, watching  # noqa: E402
from bubble_pattern_addon.blender.properties import pattern_objects, pattern_of  # noqa: E402
from bubble_pattern_addon.blender.settings_recipe import is_outdated  # noqa: E402
from bubble_pattern_addon.core.errors import PatternError  # noqa: E402
from bubble_pattern_addon.core.progress import Progress  # noqa: E402

from .parts import activate, is_closed, on_top, panel, plate, points, select_faces  # noqa: E402


@pytest.fixture
def pattern() -> bpy.types.Object:
    """A pattern of few features on a plate, in Object Mode."""
    return pattern_on(plate())


def pattern_on(base: bpy.types.Object, pitch: float = 0.012) -> bpy.types.Object:
    select_faces(base, on_top)
    assert bpy.ops.bubble_pattern.add(pitch=pitch) == {'FINISHED'}
    bpy.ops.object.mode_set(mode='OBJECT')
    return pattern_of(base)


def push(name: str) -> None:
    bpy.ops.ed.undo_push(message=name)


@contextmanager
def counted(monkeypatch: pytest.MonkeyPatch, owner: object, name: str) -> Iterator[list[int]]:
    """How often the function `name` of a module is called meanwhile."""
    calls, real = [0], getattr(owner, name)

    def counting(*arguments: object, **named: object) -> object:
        calls[0] += 1
        return real(*arguments, **named)

    with monkeypatch.context() as patch:
        patch.setattr(owner, name, counting)
        yield calls


# -- only what depends on a change is done again -------------------------------------------------------------


def test_a_size_reads_nothing_and_packs_nothing(pattern: bpy.types.Object, monkeypatch) -> None:
    settings = pattern.bubble_pattern
    settings.diameter *= 0.9  # the first after Add, which has marked the region: read once
    with (
        counted(monkeypatch, sources, "read_base") as reads,
        counted(monkeypatch, sources, "make_region") as regions,
        counted(monkeypatch, generation, "pattern_steps") as packings,
    ):
        for _ in range(3):
            settings.diameter *= 0.9
        assert (reads, regions, packings) == ([0], [0], [0])
        settings.pitch *= 1.1
        assert (reads, regions, packings) == ([0], [0], [1])
    assert points(pattern, "diameter").max() == pytest.approx(settings.diameter)


@pytest.mark.parametrize("change", ["vertex", "modifier", "scale", "region", "material", "undo"])
def test_a_base_that_has_changed_is_read_again(change: str, monkeypatch) -> None:
    base = panel(cells=12)
    pattern = pattern_on(base, 0.02)
    settings = pattern.bubble_pattern
    settings.diameter *= 0.9
    push("before")
    if change == "vertex":
        base.data.vertices[0].co.z += 0.001
    elif change == "modifier":
        base.modifiers.new("Fine", 'SUBSURF').levels = 1
    elif change == "scale":
        base.scale.x = 1.1
    elif change == "region":
        marks = base.data.attributes["bubble_region"].data
        marks[next(i for i, mark in enumerate(marks) if mark.value)].value = False
        base.data.update_tag()
    elif change == "material":
        base.material_slots[0].material.name = "Shell"
    else:
        settings.diameter *= 0.9
        push("smaller")
        bpy.ops.ed.undo()
        base, pattern = (bpy.data.objects[name] for name in ("Panel", "Panel Pattern"))
        settings = pattern.bubble_pattern
    with counted(monkeypatch, sources, "read_base") as reads:
        settings.diameter *= 0.9
    assert reads == [1]
    assert not is_outdated(settings)


def test_nothing_is_remembered_where_nobody_watches(pattern: bpy.types.Object, monkeypatch) -> None:
    handler = watching.noted
    bpy.app.handlers.depsgraph_update_post.remove(handler)
    try:
        with counted(monkeypatch, sources, "read_base") as reads:
            pattern.bubble_pattern.diameter *= 0.9
            pattern.bubble_pattern.diameter *= 0.9
        assert reads == [2]
    finally:
        bpy.app.handlers.depsgraph_update_post.append(handler)


def test_another_file_frees_what_was_remembered(pattern: bpy.types.Object) -> None:
    pattern.bubble_pattern.diameter *= 0.9
    assert sources._remembered
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    assert not sources._remembered


# -- the base changes ----------------------------------------------------------------------------------------


def looked(obj: bpy.types.Object) -> str:
    """What is wrong with the base once Blender has come to rest."""
    bpy.context.view_layer.update()
    live.look()
    return live.trouble_of(obj)


def test_a_pattern_says_that_its_base_has_changed(pattern: bpy.types.Object) -> None:
    base = pattern.bubble_pattern.base
    assert looked(pattern) == ""
    before = base.data.vertices[0].co.copy()
    base.data.vertices[0].co.x -= 0.01
    assert "The base has changed" in looked(pattern)
    base.data.vertices[0].co = before
    assert looked(pattern) == ""
    base.modifiers.new("Fine", 'BEVEL').width = 0.002
    assert "The base has changed" in looked(pattern)
    bpy.ops.bubble_pattern.update()
    assert live.trouble_of(pattern) == ""
    assert looked(pattern) == ""


def test_moving_and_selecting_change_nothing(pattern: bpy.types.Object) -> None:
    base = pattern.bubble_pattern.base
    base.location.x = 3.0
    base.rotation_euler.z = 1.0
    base.select_set(False)
    assert looked(pattern) == ""
    bpy.context.view_layer.objects.active = base
    bpy.ops.object.mode_set(mode='EDIT')
    assert looked(pattern) == ""
    bpy.ops.object.mode_set(mode='OBJECT')
    assert looked(pattern) == ""


def test_a_base_in_edit_mode_is_looked_at_afterwards(pattern: bpy.types.Object) -> None:
    base = pattern.bubble_pattern.base
    activate(base)
    bpy.ops.object.mode_set(mode='EDIT')
    bpy.ops.mesh.select_all(action='SELECT')
    bpy.ops.transform.translate(value=(0, 0, 0.001))
    bpy.ops.mesh.subdivide()
    assert looked(pattern) == ""
    bpy.ops.object.mode_set(mode='OBJECT')
    assert "The base has changed" in looked(pattern)


def test_a_region_without_faces_says_so_and_loses_nothing(pattern: bpy.types.Object) -> None:
    settings = pattern.bubble_pattern
    base, before = settings.base, points(pattern)
    activate(base)
    bpy.ops.object.mode_set(mode='EDIT')
    bpy.ops.mesh.select_all(action='DESELECT')
    bpy.ops.object.mode_set(mode='OBJECT')
    marks = np.array([mark.value for mark in base.data.attributes["bubble_region"].data])
    base.data.polygons.foreach_set("select", marks)
    bpy.ops.object.mode_set(mode='EDIT')
    bpy.ops.mesh.delete(type='FACE')
    bpy.ops.object.mode_set(mode='OBJECT')
    assert "target region" in looked(pattern)
    for button in (bpy.ops.bubble_pattern.update, bpy.ops.bubble_pattern.apply):
        with pytest.raises(RuntimeError, match="target region"):
            button()
        assert np.array_equal(points(pattern), before)
        assert settings.made_with


def test_ten_edits_in_a_row(pattern: bpy.types.Object) -> None:
    settings = pattern.bubble_pattern
    base = settings.base
    for number in range(10):
        if number % 2:
            bpy.ops.bubble_pattern.edit()
            base.data.vertices[0].co.x -= 0.001
            settings.pitch = 0.012 + 0.0002 * number
        else:
            settings.diameter = 0.005 + 0.0001 * number
            modifier = base.modifiers.new(f"Step {number}", 'TRIANGULATE')
            assert modifier is not None
        assert bpy.ops.bubble_pattern.update() == {'FINISHED'}
        assert bpy.ops.bubble_pattern.apply() == {'FINISHED'}
        assert is_closed(settings.part.data)
        assert settings.verdict == ""
    assert len(bpy.data.objects) == 3
    assert len(bpy.data.meshes) == 3


# -- undo and redo -------------------------------------------------------------------------------------------


def state(name: str) -> tuple[float, float, int, bool]:
    obj = bpy.data.objects[name]
    settings = obj.bubble_pattern
    return settings.pitch, settings.diameter, len(obj.data.vertices), is_outdated(settings)


def test_undo_and_redo_at_every_step(pattern: bpy.types.Object) -> None:
    name, states = pattern.name, [state(pattern.name)]
    push("added")
    for pitch, diameter in ((0.012, 0.004), (0.015, 0.004), (0.015, 0.006), (0.011, 0.006)):
        settings = bpy.data.objects[name].bubble_pattern
        settings.pitch, settings.diameter = pitch, diameter
        push("changed")
        states.append(state(name))
    assert not any(outdated for *_, outdated in states)
    assert len({count for _, _, count, _ in states}) == 3
    for _ in range(2):
        for wanted in states[-2::-1]:
            bpy.ops.ed.undo()
            assert state(name) == wanted
        for wanted in states[1:]:
            bpy.ops.ed.redo()
            assert state(name) == wanted


def test_undo_takes_back_what_was_laid_after_the_step_was_put_down(pattern: bpy.types.Object) -> None:
    """As after a drag of the mouse: the pattern follows when the change is put down for undo already."""
    settings, name = pattern.bubble_pattern, pattern.name
    before = state(name)
    push("added")
    settings.live = False
    settings.pitch = 0.016
    settings.live = True
    push("dragged")
    generation.drive(generation.update_steps(pattern, bpy.context))
    after = state(name)
    assert after[2] != before[2]
    bpy.ops.ed.undo()
    assert state(name) == before
    bpy.ops.ed.redo()
    assert state(name) == (*after[:2], before[2], True)  # it says so, and in a window is laid again


def test_undo_of_apply_and_remove(pattern: bpy.types.Object) -> None:
    push("added")
    bpy.ops.bubble_pattern.apply()
    push("applied")
    bpy.ops.bubble_pattern.remove()
    push("removed")
    assert [obj.name for obj in bpy.data.objects] == ["Plate"]
    bpy.ops.ed.undo()
    assert bpy.data.objects["Plate Part"].visible_get()
    bpy.ops.ed.undo()
    assert sorted(obj.name for obj in bpy.data.objects) == ["Plate", "Plate Pattern"]
    pattern = bpy.data.objects["Plate Pattern"]
    pattern.bubble_pattern.pitch = 0.02
    assert not is_outdated(pattern.bubble_pattern)
    assert bpy.ops.bubble_pattern.apply() == {'FINISHED'}


# -- files and copies ----------------------------------------------------------------------------------------


def test_save_and_reopen(pattern: bpy.types.Object, tmp_path: Path) -> None:
    before, name = points(pattern), pattern.name
    settings = pattern.bubble_pattern
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "saved.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "saved.blend"))
    pattern = bpy.data.objects[name]
    settings = pattern.bubble_pattern
    assert np.array_equal(points(pattern), before)
    assert not is_outdated(settings)
    assert looked(pattern) == ""
    settings.diameter *= 0.8
    settings.pitch *= 1.2
    assert not is_outdated(settings)
    assert len(points(pattern)) < len(before)


@pytest.mark.parametrize("linked", [False, True], ids=["copy", "linked"])
def test_a_duplicate_is_a_variant_of_its_own(pattern: bpy.types.Object, linked: bool) -> None:
    base = pattern.bubble_pattern.base
    activate(pattern)
    bpy.ops.object.duplicate(linked=linked)
    twin = bpy.context.object
    assert twin.bubble_pattern.base == base
    before, sizes = points(pattern), points(pattern, "diameter")
    twin.bubble_pattern.diameter *= 0.5
    assert np.array_equal(points(pattern, "diameter"), sizes)
    twin.bubble_pattern.pitch *= 1.5
    assert np.array_equal(points(pattern), before)
    assert len(points(twin)) < len(before)
    assert not is_outdated(pattern.bubble_pattern)
    activate(twin)
    assert bpy.ops.bubble_pattern.apply() == {'FINISHED'}
    part = twin.bubble_pattern.part
    assert twin.bubble_pattern.verdict == ""
    assert is_closed(part.data)
    assert holes(part) == len(points(twin))


def holes(part: bpy.types.Object) -> int:
    """Number of through-holes of a part that is in one piece."""
    mesh = part.data
    return (2 - (len(mesh.vertices) - len(mesh.edges) + len(mesh.polygons))) // 2


def test_a_duplicate_of_base_and_pattern_is_independent(pattern: bpy.types.Object) -> None:
    base = pattern.bubble_pattern.base
    activate(base)
    pattern.select_set(True)
    bpy.ops.object.duplicate()
    other = next(obj for obj in bpy.context.selected_objects if obj.type == 'MESH' and obj.parent is None)
    twin = pattern_of(other)
    assert twin is not None
    assert twin != pattern
    assert twin.bubble_pattern.base == other
    other.data.vertices[0].co.x -= 0.02
    assert looked(pattern) == ""
    before = points(pattern)
    activate(other)
    assert bpy.ops.bubble_pattern.update() == {'FINISHED'}
    assert np.array_equal(points(pattern), before)


@pytest.mark.parametrize("link", [False, True], ids=["append", "link"])
def test_a_pattern_in_another_file(pattern: bpy.types.Object, link: bool, tmp_path: Path) -> None:
    path, name, count = str(tmp_path / "library.blend"), pattern.name, len(pattern.data.vertices)
    bpy.ops.wm.save_as_mainfile(filepath=path)
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    with bpy.data.libraries.load(path, link=link) as (_there, here):
        here.objects = [name]
    obj = here.objects[0]
    bpy.context.collection.objects.link(obj)
    activate(obj)
    settings = obj.bubble_pattern
    assert len(obj.data.vertices) == count
    assert not is_outdated(settings)
    live.look()
    if link:
        settings_before = settings.made_with
        with pytest.raises(RuntimeError):
            bpy.ops.bubble_pattern.update()
        assert obj.bubble_pattern.made_with == settings_before
        return
    if not settings.base.users_collection:
        with pytest.raises(RuntimeError, match="base of this pattern"):
            bpy.ops.bubble_pattern.update()
        settings.diameter *= 0.9  # nothing to shape on: it waits
        bpy.context.collection.objects.link(settings.base)
    bpy.context.view_layer.update()
    assert bpy.ops.bubble_pattern.update() == {'FINISHED'}
    assert bpy.ops.bubble_pattern.apply() == {'FINISHED'}


def test_renamed(pattern: bpy.types.Object) -> None:
    settings = pattern.bubble_pattern
    settings.base.name, pattern.name = "Cover", "Grille"
    assert looked(pattern) == ""
    settings.pitch *= 1.2
    assert not is_outdated(settings)
    bpy.ops.bubble_pattern.apply()
    assert settings.part.name == "Cover Part"
    settings.part.name = "Door"
    bpy.ops.bubble_pattern.edit()
    bpy.ops.bubble_pattern.apply()
    assert settings.part.name == "Door"


@pytest.mark.parametrize("how", ["operator", "data"])
@pytest.mark.parametrize("what", ["base", "pattern", "part"])
def test_deleted(pattern: bpy.types.Object, what: str, how: str) -> None:
    settings, name = pattern.bubble_pattern, pattern.name
    bpy.ops.bubble_pattern.apply()
    base, part = settings.base, settings.part
    if what == "base":
        bpy.ops.bubble_pattern.edit()
    doomed = {"base": base, "pattern": pattern, "part": part}[what]
    doomed.hide_set(False)
    activate(doomed)
    if how == "operator":
        bpy.ops.object.delete()
    else:
        bpy.data.objects.remove(doomed)
    bpy.context.view_layer.update()
    live.look()
    if what == "base":
        obj = bpy.data.objects[name]
        obj.bubble_pattern.diameter *= 0.9
        obj.bubble_pattern.pitch *= 0.9
        activate(obj)
        with pytest.raises(RuntimeError):
            bpy.ops.bubble_pattern.update()
        if how == "operator":
            assert bpy.ops.bubble_pattern.remove() == {'FINISHED'}
    elif what == "pattern":
        base.hide_set(False)
        activate(base)
        assert pattern_of(base) is None
        assert bpy.ops.bubble_pattern.add(pitch=0.02) == {'FINISHED'}
    else:
        activate(pattern_objects(base)[0])
        bpy.ops.bubble_pattern.edit()
        assert bpy.ops.bubble_pattern.apply() == {'FINISHED'}
        assert pattern.bubble_pattern.part is not None


# -- runs ----------------------------------------------------------------------------------------------------


def test_a_run_tells_bubbles_that_settle(pattern: bpy.types.Object) -> None:
    settings = pattern.bubble_pattern
    settings.live, settings.diameter_mode, settings.pitch = False, 'SHARE', 0.004
    before, shots = points(pattern), []
    steps = generation.update_steps(pattern, bpy.context)
    while True:
        try:
            progress = next(steps)
        except StopIteration:
            break
        if progress.snapshot is not None:
            shots.append((progress.stage, progress.snapshot()))
            assert np.array_equal(points(pattern), before)
    packing = [shot for stage, shot in shots if stage == "Packing the bubbles"]
    assert len(packing) > 2
    for shot in packing:
        assert np.allclose(np.linalg.norm(shot.normal, axis=1), 1.0)
        assert np.allclose(shot.pitch, 0.004)
    # they come to rest, where the pattern then is
    final = shots[-1][1].position
    strides = [
        cKDTree(one.position).query(other.position)[0].mean()  # some come and go between two rounds
        for one, other in pairwise(packing)
    ]
    assert strides[-1] < strides[0] / 2
    assert len(final) == pytest.approx(len(points(pattern)), rel=0.02)


def begun(pattern: bpy.types.Object) -> runs.Run:
    settings = pattern.bubble_pattern
    settings.live, settings.diameter_mode, settings.pitch = False, 'SHARE', 0.005
    run = runs.begin(generation.update_steps(pattern, bpy.context))
    run.advance(0.0)
    run.advance(0.0)
    assert run.open
    return run


@pytest.mark.parametrize(
    "event",
    [
        lambda path: bpy.ops.ed.undo(),
        lambda path: bpy.ops.wm.save_as_mainfile(filepath=str(path / "x.blend")),
        lambda path: bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True),
        lambda path: runs.begin(Progress("Another", 0.0) for _ in range(2)),
    ],
    ids=["undo", "save", "load", "another"],
)
def test_a_run_ends_before_the_data_change(
    pattern: bpy.types.Object, event: Callable[[Path], object], tmp_path: Path
) -> None:
    push("one")
    push("two")
    run = begun(pattern)
    event(tmp_path)
    assert not run.open
    assert not run.ended
    assert list(run.steps) == []
    runs.stop()


def test_a_run_given_up_leaves_the_last_good_pattern(pattern: bpy.types.Object) -> None:
    before, made = points(pattern), pattern.bubble_pattern.made_with
    run = begun(pattern)
    runs.stop()
    assert runs.under_way() is None
    assert not run.ended
    assert np.array_equal(points(pattern), before)
    assert pattern.bubble_pattern.made_with == made
    assert is_outdated(pattern.bubble_pattern)


def test_a_run_that_fails_can_be_stopped() -> None:
    def failing() -> Iterator[Progress]:
        yield Progress("Working", 0.0)
        raise PatternError("no")

    run = runs.begin(failing())
    with pytest.raises(PatternError):
        run.advance(1.0)
    run.stop()
    assert runs.under_way() is None
    assert not run.ended


def test_operators_see_that_their_pattern_has_gone(pattern: bpy.types.Object) -> None:
    update = SteppedUpdate()
    activate(pattern)
    assert update.stands(bpy.context)
    bpy.data.objects.remove(pattern.bubble_pattern.base)
    bpy.context.view_layer.update()
    assert not update.stands(bpy.context)


class SteppedUpdate:
    """The operator's own question, asked without an operator."""

    from bubble_pattern_addon.blender.operators import OnPattern

    stands = OnPattern.stands


def test_what_navigates_is_no_edit() -> None:
    assert {'MIDDLEMOUSE', 'WHEELUPMOUSE', 'NDOF_MOTION', 'TIMER'} <= stepping.NAVIGATION
    assert not {'LEFTMOUSE', 'X', 'DEL', 'G', 'TAB', 'Z'} & stepping.NAVIGATION


# -- the cut, shown ------------------------------------------------------------------------------------------


def shown_faces(base: bpy.types.Object) -> int:
    return len(base.evaluated_get(bpy.context.evaluated_depsgraph_get()).data.polygons)


def test_cut_preview_shows_the_holes_and_goes_with_a_change(pattern: bpy.types.Object) -> None:
    settings = pattern.bubble_pattern
    base, before = settings.base, shown_faces(settings.base)
    settings.cut_preview = True
    assert shown_faces(base) > before + 10 * settings.count
    assert settings.cut_preview
    assert not pattern.visible_get()
    assert looked(pattern) == ""
    assert settings.cut_preview  # being looked at does not disturb it
    made = settings.made_with
    settings.diameter *= 0.9
    assert not settings.cut_preview
    assert pattern.visible_get()
    assert settings.made_with != made
    assert not is_outdated(settings)
    assert shown_faces(base) == before
    assert sorted(obj.name for obj in bpy.data.objects) == ["Plate", "Plate Pattern"]
    assert len(bpy.data.meshes) == 2
    assert looked(pattern) == ""


def test_cut_preview_goes_with_any_setting(pattern: bpy.types.Object) -> None:
    settings = pattern.bubble_pattern
    settings.live = False
    for name, value in (("depth_mode", 'BLIND'), ("depth", 0.003), ("diameter", 0.004), ("kind", 'BUMP')):
        settings.cut_preview = True
        assert settings.cut_preview, settings.cut_trouble
        setattr(settings, name, value)
        assert not settings.cut_preview
        assert not settings.base.modifiers
        bpy.ops.bubble_pattern.update()


def test_cut_preview_of_bumps_adds(pattern: bpy.types.Object) -> None:
    settings = pattern.bubble_pattern
    settings.kind = 'BUMP'
    settings.cut_preview = True
    top = settings.base.evaluated_get(bpy.context.evaluated_depsgraph_get()).bound_box
    assert max(corner[2] for corner in top) > 0.0051


@pytest.mark.parametrize("button", ["update", "apply", "remove"])
def test_cut_preview_is_never_part_of_the_base(pattern: bpy.types.Object, button: str) -> None:
    settings, count = pattern.bubble_pattern, pattern.bubble_pattern.count
    base, trace = settings.base, settings.fingerprint
    settings.cut_preview = True
    assert getattr(bpy.ops.bubble_pattern, button)() == {'FINISHED'}
    assert not base.modifiers
    assert not any(obj.name.endswith("Cutters") for obj in bpy.data.objects)
    if button != "remove":
        assert pattern.bubble_pattern.fingerprint == trace
        assert pattern.visible_get() == (button == "update")
    if button == "apply":
        assert holes(settings.part) == count


def test_cut_preview_undone(pattern: bpy.types.Object) -> None:
    push("added")
    pattern.bubble_pattern.cut_preview = True
    push("shown")
    bpy.ops.ed.undo()
    pattern = bpy.data.objects["Plate Pattern"]
    assert not pattern.bubble_pattern.cut_preview
    assert not bpy.data.objects["Plate"].modifiers
    bpy.ops.ed.redo()
    assert bpy.data.objects["Plate Pattern"].bubble_pattern.cut_preview
    bpy.data.objects["Plate Pattern"].bubble_pattern.cut_preview = False
    assert sorted(obj.name for obj in bpy.data.objects) == ["Plate", "Plate Pattern"]


def test_a_modifier_that_does_not_cut_is_told(pattern: bpy.types.Object, monkeypatch) -> None:
    """As with open input, or in a build of Blender without the solver."""
    from bubble_pattern_addon.blender import cut_preview

    monkeypatch.setattr(cut_preview, "SOLVERS", ())
    settings = pattern.bubble_pattern
    settings.cut_preview = True
    assert "cannot cut" in settings.cut_trouble
    assert not settings.cut_preview
    assert not settings.base.modifiers
    assert pattern.visible_get()
    assert len(bpy.data.objects) == 2
    monkeypatch.undo()
    settings.cut_preview = True
    assert (settings.cut_preview, settings.cut_trouble) == (True, "")


def test_cut_preview_of_an_open_base_says_why(pattern: bpy.types.Object) -> None:
    settings = pattern.bubble_pattern
    base = settings.base
    edited = next(face.index for face in base.data.polygons if face.normal.z < -0.7)
    activate(base)
    base.data.polygons.foreach_set("select", [face.index == edited for face in base.data.polygons])
    bpy.ops.object.mode_set(mode='EDIT')
    bpy.ops.mesh.delete(type='FACE')
    bpy.ops.object.mode_set(mode='OBJECT')
    settings.cut_preview = True
    assert "press Update" in settings.cut_trouble
    bpy.ops.bubble_pattern.update()
    assert settings.cut_trouble == ""
    settings.cut_preview = True
    assert "not a closed solid" in settings.cut_trouble
    assert settings.trouble == ""
    assert not settings.cut_preview
    assert not base.modifiers
