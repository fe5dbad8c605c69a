"""What operators have in common that lay a pattern, and that ask before hand work is lost by it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import bpy

from .hand_state import at_stake
from .properties import pattern_of
from .stepping import SteppedOperator


class LayingOperator(SteppedOperator):
    """Mixin for an operator that lays a pattern: its steps end with the pattern's object."""

    def settles_on(self, context: bpy.types.Context) -> bpy.types.Object | None:
        obj = pattern_of(context.active_object)
        return context.active_object if obj is None else obj.bubble_pattern.base

    def done(self, context: bpy.types.Context, result: bpy.types.Object) -> None:
        """Say how many features there are."""
        count = result.bubble_pattern.count
        if count == 0:
            self.report({'WARNING'}, "No feature fits in the region: make the pitch smaller")
        else:
            self.report({'INFO'}, f"{count:,} feature{'s' if count > 1 else ''}")


class AnewOperator(SteppedOperator):
    """Mixin for an operator that lays the current pattern anew: in a window it asks before hand work is
    thrown away, in a script it says what was.
    """

    # Whether pins and fixed sizes, which settings keep, stay as they are.
    keeps_pins, keeps_sizes = True, True

    if TYPE_CHECKING:  # what the operator itself brings
        bl_label: str

    def lost(self, context: bpy.types.Context) -> str:
        """What was done by hand and will be lost, in words."""
        obj = pattern_of(context.active_object)
        return "" if obj is None else at_stake(obj, not self.keeps_pins, not self.keeps_sizes)

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        """Ask where there is something to lose, or work at once."""
        lost = self.lost(context)
        if not lost:
            return super().invoke(context, event)
        self._asked = True
        obj = pattern_of(context.active_object)
        stay = self.keeps_pins and obj is not None and len(obj.bubble_pattern.pins)
        return context.window_manager.invoke_confirm(  # type: ignore[no-any-return]
            self,
            event,
            title=f"{self.bl_label}: lose what was done by hand?",
            message=f"Lost will be: {lost}.{' Pinned features stay.' if stay else ''}",
            confirm_text=self.bl_label,
            icon='WARNING',
        )

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Work without a pause, and say what was lost where nobody was asked."""
        lost = "" if getattr(self, "_asked", False) else self.lost(context)
        outcome = super().execute(context)
        if lost and outcome == {'FINISHED'}:
            self.report({'WARNING'}, f"What was done by hand is lost: {lost}")
        return outcome
