"""Undo and redo do not stop between a change of a setting and the pattern that followed it."""

from __future__ import annotations

from contextlib import nullcontext
from types import SimpleNamespace
from typing import Any

import pytest

bpy = pytest.importorskip("bpy", reason="needs the bpy module: python scripts/test.py --blender VERSION")

from bubble_pattern_addon.blender import following, live  # noqa: E402

from .parts import add_on_top, plate  # noqa: E402


class Steps:
    """In place of Blender's steps of undo: the states of a pattern's settings, by what it was made with."""

    def __init__(self, settings: Any, states: list[tuple[str, float]]) -> None:
        self.settings, self.states, self.at = settings, states, len(states) - 1


class Step:
    """An operator that can be called and polled."""

    def __init__(self, steps: Steps, way: int) -> None:
        self.steps, self.way = steps, way

    def poll(self) -> bool:
        return 0 <= self.steps.at + self.way < len(self.steps.states)

    def __call__(self) -> None:
        steps = self.steps
        steps.at += self.way
        steps.settings.made_with, steps.settings.pitch = steps.states[steps.at]
        following.go_on_soon("undo" if self.way < 0 else "redo")  # as Blender's handlers do


def test_it_goes_on_to_what_was_before_and_after(monkeypatch: pytest.MonkeyPatch) -> None:
    pattern = add_on_top(plate())
    settings = pattern.bubble_pattern
    settings.live = False
    old, pitch = settings.made_with, settings.pitch
    # before, changed, laid, something later
    steps = Steps(settings, [(old, pitch), (old, 2 * pitch), ("new", 2 * pitch), ("newer", 2 * pitch)])
    ends = {"undo": Step(steps, -1), "redo": Step(steps, 1)}
    soon: list[Any] = []
    window = SimpleNamespace(window_manager=SimpleNamespace(windows=["a window"]))
    monkeypatch.setattr(live, "has_window", lambda: True)
    monkeypatch.setattr(live, "again", lambda action, _seconds: soon.append(action))
    monkeypatch.setattr(live, "inside", lambda _window: nullcontext())
    monkeypatch.setattr(live, "patterns_shown", lambda: iter([(pattern, None)]))
    blender = SimpleNamespace(context=window, ops=SimpleNamespace(ed=SimpleNamespace(**ends)))

    def press(name: str) -> int:
        ends[name]()
        monkeypatch.setattr(following, "bpy", blender)
        while soon:
            soon.pop()()
        monkeypatch.setattr(following, "bpy", bpy)
        return steps.at

    settings.pitch = 2 * pitch
    settings.made_with = old
    following._halfway.add(following.state_of(pattern))
    try:
        assert [press("undo"), press("undo")] == [2, 0]
        assert [press("redo"), press("redo")] == [2, 3]
        following._halfway.clear()  # a change that nothing followed is a state like others
        assert [press("undo"), press("undo"), press("undo")] == [2, 1, 0]
    finally:
        following.forget()
