"""The FMI 2.0 dialect of a component: events by count, stamp and payload before a step."""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Mapping
from typing import Any

from fmpy.fmi1 import FMICallException
from fmpy.fmi2 import (
    fmi2Discard,
    fmi2LastSuccessfulTime,
    fmi2Pending,
    fmi2Terminated,
)

from cosim.components.component import Component
from cosim.components.described import EventPort
from cosim.diagnostics.native_log import fmi2_callbacks
from fmus.fmi.native_calls import prepared_call
from fmus.fmi.standard import TIME_TOLERANCE


class FMI2Component(Component):
    """An FMI 2.0 co-simulation slave. Arguments as for `Component`."""

    fmi_version = 2
    real_type = "Real"
    event_needs_step = True

    def _instantiate(self) -> None:
        if hasattr(self.slave, "dll"):
            self.slave.instantiate(callbacks=fmi2_callbacks(self), loggingOn=self._logging_on)
        else:
            self.slave.instantiate(callbacks=fmi2_callbacks(self))
        self._do_step = _make_step(self.slave)
        self._forget()

    def _forget(self) -> None:
        self._counts = dict.fromkeys(self.events, 0)

    def _find_events(self) -> dict[str, EventPort]:
        inputs = {v.name: v for v in self.description.modelVariables if v.causality == "input"}
        references = {name: v.valueReference for name, v in inputs.items()}
        events = {}
        for name, variable in inputs.items():
            stem = name.removesuffix("_count")
            if stem != name and variable.type == "Integer" and f"{stem}_time" in inputs:
                events[stem] = EventPort(
                    stem, variable.valueReference, references[f"{stem}_time"], self._payload_of(stem, references)
                )
        return events

    def enter_initialization(self, start_time: float, stop_time: float) -> None:  # noqa: D102 - see Component
        slave, self.time = self.slave, start_time
        tolerance, words = self.tolerance_argument()
        self._guard(
            f"setupExperiment{words}",
            lambda: slave.setupExperiment(startTime=start_time, stopTime=stop_time, **tolerance),
        )
        self._guard("enterInitializationMode", slave.enterInitializationMode)

    def exit_initialization(self) -> None:  # noqa: D102 - see Component
        self._guard("exitInitializationMode", self.slave.exitInitializationMode)
        self._running = True

    def advance(self, t: float, until: float) -> None:  # noqa: D102 - see Component
        self._step_whole(self._do_step, self._after_refusal, t, until)

    def notify(self, event: EventPort, t: float, stamp: float, payload: Mapping[str, float]) -> None:  # noqa: D102 - see Component
        self._counts[event.name] += 1
        fields = {event.payload[n]: float(payload[n]) for n in event.payload if n in payload}
        if event.stamp is not None:
            fields[event.stamp] = stamp
        count = self._counts[event.name]
        self._guard(f"payload of event '{event.name}'", lambda: self.slave.setReal(list(fields), list(fields.values())))
        self._guard(f"count of event '{event.name}'", lambda: self.slave.setInteger([event.trigger], [count]))

    def save(self) -> Any:  # noqa: D102 - see Component
        return self._saved_state("getFMUstate", self.slave.getFMUstate), dict(self._counts), self.time, self.terminated

    def restore(self, state: Any) -> None:  # noqa: D102 - see Component
        self._guard("setFMUstate", lambda: self.slave.setFMUstate(state[0]))
        self._counts, self.time, self.terminated = dict(state[1]), state[2], state[3]

    def release(self, state: Any) -> None:  # noqa: D102 - see Component
        if self._alive:
            self._guard("freeFMUstate", lambda: self.slave.freeFMUstate(state[0]))

    def _after_refusal(self, error: FMICallException, t: float, until: float) -> None:
        """A discarded step is the end: the slave has terminated, or it cannot do this step and its state is lost."""
        if error.status == fmi2Pending:
            raise self.pending(t) from error
        if error.status != fmi2Discard:
            raise self._explained("doStep", error, t) from error
        reached = self._asked(self.slave.getRealStatus, fmi2LastSuccessfulTime)
        if self._asked(self.slave.getBooleanStatus, fmi2Terminated):
            self.time = t if reached is None else min(max(float(reached), t), until)
            if self.time <= t + TIME_TOLERANCE and (self.messages or self.kind == "block"):
                raise self._explained("doStep", error, t) from error  # it did nothing, and says why
            self.terminated = True
            return
        known = "it does not say how far it came" if reached is None else f"it came to {reached:g} s"
        reason = f"doStep was discarded: asked for {until:g} s, {known}; try a smaller communication step"
        raise self.failure(reason, t) from error

    @staticmethod
    def _asked(call: Any, kind: int) -> Any:
        try:
            return call(kind)
        except Exception:  # a slave that cannot say why it discarded a step has simply not terminated
            return None


def _make_step(slave: Any) -> Callable[[float, float], None]:
    """The slave's doStep(t, h) in [s]. Its state may be set back: nothing of the past may be forgotten."""
    if not hasattr(slave, "dll"):
        return lambda t, h: slave.doStep(t, h, False)
    start, length = ctypes.c_double(), ctypes.c_double()
    call = prepared_call(slave, "fmi2DoStep", slave.component, start, length, ctypes.c_int(False))

    def do_step(t: float, h: float) -> None:
        start.value, length.value = t, h
        call()

    return do_step
