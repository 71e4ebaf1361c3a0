"""Strides: how a component that cannot stop everywhere takes part in a step that is divided at events. Knows one
component.
"""

from __future__ import annotations

from dataclasses import dataclass

from cosim.coupling.chain import Mover, Position, Stage, around, unchanged
from cosim.coupling.planned import PlannedComponent
from fmus.fmi.standard import TIME_TOLERANCE


@dataclass
class Span:
    """The communication step that is under way.

    Args:
        end: where it ends [s].
    """

    end: float = 0.0


class Stride:
    """The stage at `Position.EVENTS` of a planned component.

    A component that takes whole communication steps only waits for the last part of the step. One that has gone past
    an event, and could not be taken back, waits where it is until the others have come there.

    Args:
        planned: the component. span: the step under way.
        hold: called with the parts [s] that a waiting component does not take; None where nobody asks.
    """

    def __init__(self, planned: PlannedComponent, span: Span, hold: Mover | None = None) -> None:
        self._component, self._span, self._hold = planned.component, span, hold
        self._whole = not planned.component.can_vary_step
        drive = around(self._drive) if self._whole else unchanged
        text = event_stage_text(whole=self._whole)
        planned.add_stage(Stage(Position.EVENTS, text, move=around(self._move), drive=drive))

    def _move(self, inner: Mover, t: float, until: float) -> None:
        """From `t` to `until` [s], where it takes part in that."""
        start = self._start(t, until)
        if start is not None:
            inner(start, until)
        elif self._hold is not None and self._whole:
            self._hold(t, until)

    def _drive(self, inner: Mover, t: float, until: float) -> None:
        """The same without notifying anybody of the parts that are not taken."""
        start = self._start(t, until)
        if start is not None:
            inner(start, until)

    def _start(self, t: float, until: float) -> float | None:
        """Where its way to `until` begins [s]; None where it does not go there now."""
        stands = self._component.time
        if stands > t + TIME_TOLERANCE:
            return stands if until - stands > TIME_TOLERANCE else None
        if not self._whole:
            return t
        return stands if self._span.end - until <= TIME_TOLERANCE else None


def event_stage_text(*, whole: bool) -> str:
    """The stage in words; `whole`: the component takes whole communication steps only."""
    return "event stop (whole steps only)" if whole else "event stop"
