"""The FMI 3.0 dialect of a component: clocks, event mode, early return, time events."""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Mapping
from time import perf_counter
from typing import Any

from fmpy.model_description import ModelVariable

from cosim.components.component import NEVER, TIME_TOLERANCE, Component, EventPort

MAX_EVENT_ITERATIONS = 100
MAX_RETURNS_PER_STEP = 10_000


class FMI3Component(Component):
    """An FMI 3.0 co-simulation slave. Arguments as for `Component`."""

    fmi_version = 3
    real_type = "Float64"
    event_needs_step = False

    @property
    def has_event_mode(self) -> bool:
        """Whether the slave declares event mode."""
        return bool(self.description.coSimulation.hasEventMode)

    def _instantiate(self) -> None:
        early = bool(self.description.coSimulation.mightReturnEarlyFromDoStep)
        native = hasattr(self.slave, "dll")
        log = {"logMessage": lambda _environment, _status, _category, message: self.note(message)} if native else {}
        self.slave.instantiate(eventModeUsed=self.has_event_mode, earlyReturnAllowed=early, **log)
        self._do_step = _native_step(self.slave) if native else self.slave.doStep

    def _find_events(self) -> dict[str, EventPort]:
        variables = self.description.modelVariables
        events = {}
        for clock in variables:
            if clock.type == "Clock" and clock.causality == "input" and clock.intervalVariability == "triggered":
                clocked = {v.name: v.valueReference for v in variables if _is_clocked_by(v, clock)}
                stamp = clocked.get(f"{clock.name}_time")
                events[clock.name] = EventPort(clock.name, clock.valueReference, stamp, self._payload_of(clock.name, clocked))
        return events

    def output_clock(self, name: str) -> int:
        """Value reference of a triggered output clock."""
        return int(self.variable(name, "output").valueReference)

    def enter_initialization(self, start_time: float, stop_time: float) -> None:  # noqa: D102 - see Component
        call, self.time = self.slave.enterInitializationMode, start_time
        self._guard("enterInitializationMode", lambda: call(startTime=start_time, stopTime=stop_time))

    def exit_initialization(self) -> None:  # noqa: D102 - see Component
        self._guard("exitInitializationMode", self.slave.exitInitializationMode)
        self._running = True
        if self.has_event_mode:
            self._settle()

    def step(self, t: float, until: float) -> tuple[float, bool]:
        """One doStep from `t` towards `until` [s]; returns the time reached and whether event handling is needed.

        Raises:
            RunError: doStep failed, or says that it reached a time outside the step.
        """
        begin = perf_counter()
        try:
            event, terminate, early, reached = self._do_step(t, until - t)
        except Exception as error:
            raise self._explained("doStep", error, t) from error
        finally:
            self.seconds += perf_counter() - begin
            self.calls += 1
        if terminate:
            self.terminated = True
            early = early or abs(reached - until) > TIME_TOLERANCE  # a slave that stops on the way says where
        if not early:
            self.time = until
            return until, event
        if not t - TIME_TOLERANCE <= reached <= until + TIME_TOLERANCE:
            raise self.failure(f"doStep to {until:g} s says that it reached {reached!r} s", t)
        self.time = min(max(float(reached), t), until)
        return self.time, event

    def advance(self, t: float, until: float) -> None:  # noqa: D102 - see Component
        if self.next_event == NEVER:  # the ordinary step: nothing is due, and mostly nothing happens
            reached, event = self.step(t, until)
            if event and self.has_event_mode and not self.terminated:
                self.handle_event()
            if self.terminated or until - reached <= TIME_TOLERANCE:
                return
            t = reached
        for _ in range(MAX_RETURNS_PER_STEP):
            if self.has_event_mode and self.next_event <= t + TIME_TOLERANCE:
                self.handle_event()
            t = self.step_towards(t, until)
            if self.terminated or until - t <= TIME_TOLERANCE:
                return
        raise self.failure(f"returned early {MAX_RETURNS_PER_STEP} times without reaching {until:g} s", t)

    def step_towards(self, t: float, until: float) -> float:
        """One doStep to `until` or to the next time event before it, with the event handled; returns the time reached [s]."""
        reached, event = self.step(t, self.next_stop(t, until))
        if self.has_event_mode and not self.terminated and self.is_event(reached, event):
            self.handle_event()
        return reached

    def next_stop(self, t: float, until: float) -> float:
        """Where the next doStep from `t` must end: `until`, or the time event before it [s]."""
        return self.next_event if t + TIME_TOLERANCE < self.next_event < until - TIME_TOLERANCE else until

    def is_event(self, reached: float, event: bool) -> bool:
        """Whether events must be handled at the time reached [s]: the slave says so, or its time event is due."""
        return event or reached >= self.next_event - TIME_TOLERANCE

    def handle_event(self) -> None:
        """Enter event mode, settle, and return to step mode."""
        self._guard("enterEventMode", self.slave.enterEventMode)
        self._settle()

    def report_clock(self, clock: int) -> bool:
        """Handle an event; True where the triggered output clock ticked."""
        self._guard("enterEventMode", self.slave.enterEventMode)
        ticked = bool(self._guard("getClock", lambda: self.slave.getClock([clock]))[0])
        self._settle()
        return ticked

    def tell(self, event: EventPort, t: float, stamp: float, payload: Mapping[str, float]) -> None:  # noqa: D102 - see Component
        begin = perf_counter()
        self._guard(f"event '{event.name}'", lambda: self._tell(event, stamp, payload))
        self.seconds += perf_counter() - begin

    def _tell(self, event: EventPort, stamp: float, payload: Mapping[str, float]) -> None:
        slave = self.slave
        slave.enterEventMode()
        slave.setClock([event.trigger], [True])
        fields = {event.payload[n]: float(payload[n]) for n in event.payload if n in payload}
        if event.stamp is not None:
            fields[event.stamp] = stamp
        if fields:
            slave.setFloat64(list(fields), list(fields.values()))
        self._settle()

    def _settle(self) -> None:
        for _ in range(MAX_EVENT_ITERATIONS):
            again, terminate, _, _, defined, next_time = self._guard("updateDiscreteStates", self.slave.updateDiscreteStates)
            self.terminated |= bool(terminate)
            if not again:
                break
        else:
            raise self.failure(f"discrete states do not settle in {MAX_EVENT_ITERATIONS} updates")
        self.next_event = float(next_time) if defined else NEVER
        self._guard("enterStepMode", self.slave.enterStepMode)

    def save(self) -> Any:  # noqa: D102 - see Component
        return self._guard("getFMUState", self.slave.getFMUState), self.next_event, self.time, self.terminated

    def restore(self, state: Any) -> None:  # noqa: D102 - see Component
        self._guard("setFMUState", lambda: self.slave.setFMUState(state[0]))
        _, self.next_event, self.time, self.terminated = state

    def release(self, state: Any) -> None:  # noqa: D102 - see Component
        self._guard("freeFMUState", lambda: self.slave.freeFMUState(state[0]))


def _is_clocked_by(variable: ModelVariable, clock: ModelVariable) -> bool:
    """fmpy puts the clocks themselves where it read a file, and value references where a description was made in Python."""
    return any(entry is clock or entry == clock.valueReference for entry in variable.clocks or ())


def _native_step(slave: Any) -> Callable[[float, float], tuple[bool, bool, bool, float]]:
    """fmpy's doStep of a native slave with its four results allocated once instead of at every call."""
    event, terminate, early, reached = ctypes.c_bool(), ctypes.c_bool(), ctypes.c_bool(), ctypes.c_double()
    results = (ctypes.byref(event), ctypes.byref(terminate), ctypes.byref(early), ctypes.byref(reached))
    call, component, no_set_state = slave.fmi3DoStep, slave.component, ctypes.c_bool(False)

    def do_step(t: float, h: float) -> tuple[bool, bool, bool, float]:
        call(component, t, h, no_set_state, *results)
        return event.value, terminate.value, early.value, reached.value

    return do_step
