"""Work in a process of its own: the same result, the same errors, given up at any moment."""

from __future__ import annotations

import os
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from bubble_pattern_addon.core import elsewhere as module
from bubble_pattern_addon.core.elsewhere import elsewhere
from bubble_pattern_addon.core.errors import RecipeError, RegionError
from bubble_pattern_addon.core.mesh import Mesh
from bubble_pattern_addon.core.metric import Constant
from bubble_pattern_addon.core.progress import drive
from bubble_pattern_addon.core.recipe import Packing
from bubble_pattern_addon.core.recipe_checks import check_recipe
from bubble_pattern_addon.core.recipe_file import recipe_from_dict
from bubble_pattern_addon.core.region import make_region, weld


def alive(number: int) -> bool:
    try:
        os.kill(number, 0)
    except ProcessLookupError:
        return False
    return True


def test_the_result_is_the_same() -> None:
    chance = np.random.default_rng(1)
    mesh = Mesh(np.repeat(chance.random((50, 3)), 2, axis=0), chance.integers(0, 100, (80, 3)))
    there = drive(elsewhere(weld, mesh, stage="Welding", seconds=1.0))
    here = weld(mesh)
    assert np.array_equal(there.vertices, here.vertices)
    assert np.array_equal(there.triangles, here.triangles)
    assert len(here.vertices) == 50


def test_it_runs_in_another_process() -> None:
    assert drive(elsewhere(os.getpid, stage="Asking", seconds=1.0)) != os.getpid()


def test_errors_come_back_as_they_are() -> None:
    bad, faces = Mesh(np.zeros((3, 3)), np.array([[0, 1, 2]])), np.ones(1, dtype=bool)
    with pytest.raises(RegionError) as here:
        make_region(bad, faces)
    with pytest.raises(RegionError) as there:
        drive(elsewhere(make_region, bad, faces, stage="Reading", seconds=1.0))
    assert str(there.value) == str(here.value)
    asked = recipe_from_dict(
        {"region": {"all": True}, "packing": {"pitch": 3.0}, "shaping": {"diameter": 2.0}}
    )
    wrong = replace(asked, packing=Packing(pitch=Constant(1.0)))
    with pytest.raises(RecipeError) as told:
        drive(elsewhere(check_recipe, wrong, stage="Checking", seconds=1.0))
    assert told.value.lengths == {"diameter": 2.0, "pitch": 1.0}


def test_progress_grows_with_time_and_never_says_done() -> None:
    told = []
    drive(elsewhere(time.sleep, 0.4, stage="Waiting", seconds=0.2), told.append)
    fractions = [progress.fraction for progress in told]
    assert {progress.stage for progress in told} == {"Waiting"}
    assert fractions == sorted(fractions)
    assert len(set(fractions)) > 3
    assert fractions[-1] == module.MOST


def test_given_up_it_ends_at_once_and_leaves_nothing(tmp_path: Path, monkeypatch) -> None:
    monkeypatch.setattr(module.tempfile, "tempdir", str(tmp_path))
    started = []
    real = module._started

    def noting(*arguments):
        started.append(real(*arguments))
        return started[-1]

    monkeypatch.setattr(module, "_started", noting)
    steps = elsewhere(time.sleep, 60.0, stage="Waiting", seconds=1.0)
    for _ in range(3):
        next(steps)
    (process,) = started
    assert process.poll() is None
    assert list(tmp_path.iterdir())
    start = time.perf_counter()
    steps.close()
    assert time.perf_counter() - start < 5.0
    assert process.poll() is not None
    assert not alive(process.pid)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("python", ["/no/such/python", "/bin/false"])
def test_where_no_process_works_it_runs_here(python: str) -> None:
    assert drive(elsewhere(os.getpid, stage="Asking", seconds=1.0, python=python)) == os.getpid()
