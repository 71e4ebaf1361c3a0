"""Strides: how a component that cannot stop everywhere takes part in a step that is divided at events. Knows one
component.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from cosim.coupling.plan import Mover, PlannedComponent
from fmus.fmi.standard import TIME_TOLERANCE


@dataclass
class Span:
    """The communication step that is under way.

    Args:
        end: where it ends [s].
    """

    end: float = 0.0


class Stride:
    """Takes over how a planned component moves.

    One that takes whole communication steps only waits for the last part of the step. One that has gone past an event,
    and could not be taken back, waits where it is until the others have come there.

    Args:
        planned: the component. span: the step under way.
        hold: told of the parts that a waiting component does not take.
    """

    def __init__(
        self, planned: PlannedComponent, span: Span, hold: Callable[[float, float], None] | None = None
    ) -> None:
        self._component, self._span, self._hold = planned.component, span, hold
        self._whole = not planned.component.can_vary_step
        self._move: Mover = planned.move
        planned.move = self.move
        if self._whole:
            self._drive: Mover = planned.drive
            planned.drive = self.drive  # type: ignore[method-assign]

    def move(self, t: float, until: float) -> None:
        """From `t` to `until` [s], where it takes part in that."""
        start = self._start(t, until)
        if start is not None:
            self._move(start, until)
        elif self._hold is not None and self._whole:
            self._hold(t, until)

    def drive(self, t: float, until: float) -> None:
        """The same, without what a service adds."""
        start = self._start(t, until)
        if start is not None:
            self._drive(start, until)

    def _start(self, t: float, until: float) -> float | None:
        """Where its way to `until` begins [s]; None where it does not go there now."""
        stands = self._component.time
        if stands > t + TIME_TOLERANCE:
            return stands if until - stands > TIME_TOLERANCE else None
        if not self._whole:
            return t
        return stands if self._span.end - until <= TIME_TOLERANCE else None
