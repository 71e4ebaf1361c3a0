"""Coordination: steps at the end of which something may be an event for a component, or in which one may meet an event
that takes all others back to it. The stepper does them as long as nothing of that happens.
"""

from __future__ import annotations

import ctypes
import math
from collections.abc import Sequence

import numpy as np

from cosim.compiled.journal import StepperCall
from cosim.compiled.program import NotCompilable, Program
from cosim.compiled.structures import CListener
from cosim.components.component import Component
from cosim.coupling.plan import Plan
from cosim.master.events.coordinator import EventCoordinator
from cosim.master.system import System
from fmus.fmi.standard import TIME_TOLERANCE

_ROWS_OF_PART = 3


class Coordination:
    """What the stepper needs to know of the events of components that concern others.

    Args:
        program: the plan in C. plan: prepared. events: the coordinator of the run.

    Raises:
        NotCompilable: one of them has a rate of its own.
    """

    def __init__(self, program: Program, plan: Plan, events: EventCoordinator) -> None:
        self._program, self._plan, self._events = program, plan, events
        slow = [p.name for p in events.participants if p.planned.every != 1]
        if slow:
            raise NotCompilable(f"events are propagated to {slow[0]}, which has a rate of its own")
        self._listening = [p for p in events.participants if p.gate.listens]
        self._saved: list[int] = []
        self._by_parts = events.takes_back and bool(program.in_python)  # whom Python moves it saves as well
        if events.takes_back and not self._by_parts:
            self._save_before_steps()
        self._told = [np.zeros(len(p.gate.listened)) for p in self._listening]
        self._listeners = (CListener * len(self._listening))()
        for listener, participant, told in zip(self._listeners, self._listening, self._told, strict=True):
            inputs, places = participant.planned.inputs, participant.gate.listened
            listener.count, listener.told = len(places), told.ctypes.data
            listener.sources = program.keep(inputs.sources[places].astype(np.int64))
            if np.any(inputs.factors != 1.0) or np.any(inputs.offsets != 0.0):
                listener.factors = program.keep(inputs.factors[places].astype(np.float64))
                listener.offsets = program.keep(inputs.offsets[places].astype(np.float64))
        program.head.listeners, program.head.listener_count = ctypes.addressof(self._listeners), len(self._listening)

    def _save_before_steps(self) -> None:
        program = self._program
        for place, step in enumerate(self._plan.steps):
            component, slave = step.component, program.slaves[place]
            if component.can_save:
                self._saved.append(place)
                for field, call in (("save_state", StepperCall.SAVE), ("release_state", StepperCall.RELEASE)):
                    setattr(slave, field, program.function(component, str(call.function(component.fmi_version))))
        program.head.saves = True

    def begin(self, t: float) -> bool:
        """Whether the stepper may do whole steps from `t` [s] on: all have come there, and nothing is to be seen to.

        Args:
            t: a communication point [s].
        """
        if self._by_parts:
            return False
        for participant in self._events.participants:
            if not participant.is_quiet or abs(participant.component.time - t) > TIME_TOLERANCE:
                return False
        for participant, told in zip(self._listening, self._told, strict=True):
            known = participant.gate.told
            if known is None or len(known) != told.nbytes:
                return False
            told[:] = np.frombuffer(known)
        return True

    def close(self, steps: int) -> None:
        """Count the states that were saved and released.

        Args:
            steps: that were done with them.
        """
        for place in self._saved:
            for kind in ("save", "release"):
                self._plan.steps[place].component.call_statistics[kind].add(0.0, steps)


class Parts:
    """Parts of steps, between events and packets, that the stepper may do.

    Args:
        components: of the plan, all with the same rate. system: of the run. events: its coordinator.

    `rows` is room for the rows of events in one part, shape (3, 1 + n).
    """

    def __init__(self, components: Sequence[Component], system: System, events: EventCoordinator) -> None:
        coordinated = {id(participant.component) for participant in events.participants}
        self._components, self._system = components, system
        self._own = [component for component in components if id(component) not in coordinated]
        self._coordinated = [component for component in components if id(component) in coordinated]
        self.rows = np.zeros((_ROWS_OF_PART, 1 + len(system.plan.values)))
        self._divisible = all(component.can_vary_step for component in components)

    def may_begin(self, t: float, until: float) -> bool:
        """Whether all stand at `t` and nothing is due before they come to `until` [s]; an event there is seen to
        afterwards where somebody coordinates it.
        """
        balises, network = self._system.balises, self._system.network
        late = until + 2.0 * TIME_TOLERANCE
        if not self._divisible or (balises is not None and balises.idle_until <= late):
            return False
        if network is not None and network.idle_until == -math.inf:
            return False
        for component in self._own:
            if component.next_event <= late or component.terminated or abs(component.time - t) > TIME_TOLERANCE:
                return False
        for component in self._coordinated:
            if component.next_event < until - TIME_TOLERANCE or component.terminated:
                return False
            if abs(component.time - t) > TIME_TOLERANCE:
                return False
        return True
