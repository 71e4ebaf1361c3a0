"""A participant: one component with Event Mode, as the event iteration sees it. Knows its component, inputs and
clocks.
"""

from __future__ import annotations

from typing import Any

from cosim.components.fmi3 import FMI3Component
from cosim.coupling.planned import PlannedComponent
from cosim.master.events.gates import Gate
from fmus.fmi.standard import TIME_TOLERANCE

Wire = tuple["Participant", int]
"""A participant and one of its triggered input clocks."""


class Participant:
    """One component that takes part in events.

    Args:
        planned: an FMI 3 component with Event Mode, in the plan.
        gives: whether somebody takes something from it.

    `wires` says which input clocks tick with each of its output clocks (by value reference). `interrupts` says that
    others are taken back to the event where it returns early.
    """

    def __init__(self, planned: PlannedComponent, *, gives: bool) -> None:
        assert isinstance(planned.component, FMI3Component)
        self.planned, self.component = planned, planned.component
        self.interrupts = interrupts(self.component, gives=gives)
        self.gate = Gate(self.component, planned.inputs)
        self.wires: dict[int, list[Wire]] = {}
        self.in_event_mode = self.needs_update = False
        self._not_passed_on = False  # its outputs and clocks have not been passed on in this super-dense instant
        self._waiting: set[int] = set()
        self._active: set[int] = set()
        self._reported: set[int] = set()
        self._flow = b""

    @property
    def name(self) -> str:
        """Name of the component."""
        return self.component.name

    def stands_at(self, t: float) -> bool:
        """Whether it has come to `t` [s], no less and no more."""
        return abs(self.component.time - t) <= TIME_TOLERANCE and not self.component.terminated

    def wants_event(self, t: float) -> bool:
        """Whether something of its own is due at `t` [s]."""
        return self.component.event_pending or self.component.next_event <= t + TIME_TOLERANCE

    @property
    def is_quiet(self) -> bool:
        """Whether nothing is to be seen to that was met or triggered before."""
        return not self._waiting and not self.component.event_pending

    def hears(self) -> bool:
        """Whether somebody else changed something that is an event for it."""
        if self._waiting:
            return True
        if not self.gate.listens:
            return False
        self.planned.inputs.gather_now()
        return self.gate.changed()

    def trigger(self, clock: int) -> None:
        """An input clock is to tick as soon as the component is in Event Mode here."""
        self._waiting.add(clock)

    # -- Event Mode -------------------------------------------------------------------------------------------------

    def begin_own_event(self) -> None:
        """Its own event: enter Event Mode and let the due clocks tick."""
        self._enter()
        self._active.update(self.component.tick_due_clocks())
        self.needs_update = self._not_passed_on = True

    def exchange(self) -> bool:
        """Take what the others pass on, and pass on what follows from it; True where anything was new."""
        if not self.in_event_mode:
            if not self.hears():
                return False
            self._enter()
        self.planned.inputs.gather_now()
        if not self._take() and not self._not_passed_on:
            return False
        self.needs_update, self._not_passed_on = True, False
        self._pass_ticks()
        self.planned.read()
        return True

    def update(self) -> None:
        """End the super-dense instant."""
        self._active.clear()
        self._reported.clear()
        self.needs_update = self._not_passed_on = self.component.update_discrete_states()
        self.planned.read()

    def leave(self) -> None:
        """Back to Step Mode."""
        if self.in_event_mode:
            self.component.enter_step_mode()
            self.in_event_mode = False

    # -- state ------------------------------------------------------------------------------------------------------

    def save(self) -> Any:
        """What an event changes here between events; the component's own state is saved elsewhere."""
        return self.gate.save(), set(self._waiting)

    def restore(self, state: Any) -> None:
        """Return to what was saved.

        Args:
            state: as `save` gave it.
        """
        gate, waiting = state
        self.gate.restore(gate)
        self._waiting = set(waiting)

    # -- internals --------------------------------------------------------------------------------------------------

    def _enter(self) -> None:
        if not self.in_event_mode:
            self.component.enter_event_mode()
            self.in_event_mode, self._flow = True, b""
            self._not_passed_on = True

    def _take(self) -> bool:
        """Set clocks, then inputs; True where anything was set that the component did not know."""
        ticking = self._waiting - self._active
        self._waiting.clear()
        if ticking:
            self.component.set_clocks(sorted(ticking))
            self._active |= ticking
        flow = self.gate.flow()
        new = flow != self._flow or self.gate.changed()
        if new:
            self.gate.send()
            self._flow = flow
        return self.gate.send_clocked(self._active, fresh=bool(ticking) or self._not_passed_on) or new or bool(ticking)

    def _pass_ticks(self) -> None:
        clocks = [clock for clock in self.wires if clock not in self._reported]
        if not clocks:
            return
        for clock, active in zip(clocks, self.component.ticking(clocks), strict=True):
            if active:
                self._reported.add(clock)
                for participant, target in self.wires[clock]:
                    participant.trigger(target)


def interrupts(component: FMI3Component, *, gives: bool) -> bool:
    """Whether the others are taken back to an event at which a component returns early.

    Args:
        component: it takes part in events. gives: whether another one takes something from it.
    """
    return gives and bool(component.capabilities.mightReturnEarlyFromDoStep)
