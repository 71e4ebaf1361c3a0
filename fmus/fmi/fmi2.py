"""FMI 2.0: instances and slaves; events by count, stamp and payload before a step."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from fmpy.fmi1 import FMICallException
from fmpy.fmi2 import fmi2LastSuccessfulTime, fmi2Terminated

from fmus.fmi.call_warnings import BEYOND_STEP
from fmus.fmi.described import EventPort
from fmus.fmi.instance import Instance
from fmus.fmi.native_log import fmi2_callbacks
from fmus.fmi.ports import is_native
from fmus.fmi.quick_calls import quicken
from fmus.fmi.slave import WholeStepSlave, make_step, status_of
from fmus.fmi.standard import TIME_TOLERANCE


class FMI2Instance(Instance):
    """An instance of FMI 2.0, for either interface type. Arguments as for `Instance`."""

    fmi_version = 2
    event_needs_step = True
    _get_state, _set_state, _free_state = "getFMUstate", "setFMUstate", "freeFMUstate"

    def _instantiate(self) -> None:
        log = {"loggingOn": self.logging} if is_native(self.slave) else {}
        self.slave.instantiate(callbacks=fmi2_callbacks(self), **log)

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

    def begin_initialization(self, start_time: float, stop_time: float) -> None:
        slave = self.slave
        tolerance, words = self.tolerance_argument()
        self.guard(
            f"setupExperiment{words}",
            lambda: slave.setupExperiment(startTime=start_time, stopTime=stop_time, **tolerance),
        )
        self.guard("enterInitializationMode", slave.enterInitializationMode)


class FMI2Slave(FMI2Instance, WholeStepSlave):
    """A co-simulation slave of FMI 2.0. Arguments as for `Slave`."""

    def _instantiate(self) -> None:
        super()._instantiate()
        self._last = () if is_native(self.slave) else (bool(self.no_way_back.value),)
        self._do_step = make_step(self.slave, "fmi2DoStep", self.no_way_back)
        if is_native(self.slave):
            quicken(self.slave, self.fmi_version, (self._get_state, self._set_state, self._free_state))
        self._forget()

    def _forget(self) -> None:
        self._counts = dict.fromkeys(self.events, 0)

    def exit_initialization(self) -> None:
        self.guard("exitInitializationMode", self.slave.exitInitializationMode)
        self._running = True

    def notify(self, event: EventPort, t: float, stamp: float, payload: Mapping[str, float]) -> None:
        self._counts[event.name] += 1
        fields, count = event.fields(stamp, payload), self._counts[event.name]
        self.guard(f"payload of event '{event.name}'", self.slave.setReal, list(fields), list(fields.values()))
        self.guard(f"count of event '{event.name}'", self.slave.setInteger, [event.trigger], [count])

    def _remember(self) -> tuple[Any, ...]:
        self.no_way_back.value = 0
        self._last = self._last and (False,)
        return dict(self._counts), self.time, self.terminated

    def _recall(self, remembered: tuple[Any, ...]) -> None:
        counts, self.time, self.terminated = remembered
        self._counts = dict(counts)

    def _after_discard(self, error: FMICallException, t: float, until: float) -> None:
        """A discarded step is the end: the slave has terminated, or it cannot do this step and its state is lost."""
        reached = status_of(self.slave.getRealStatus, fmi2LastSuccessfulTime)
        if not status_of(self.slave.getBooleanStatus, fmi2Terminated):  # one that cannot say why has not terminated
            raise self._not_done(error, t, until, reached) from error
        if reached is not None and reached > until + TIME_TOLERANCE:
            self.contradictions.add(BEYOND_STEP, t)
        self.time = t if reached is None else min(max(float(reached), t), until)
        if self.time <= t + TIME_TOLERANCE and self._says_why():
            raise self.explained("doStep", error, t) from error  # it did nothing
        self.terminated = True

    def _says_why(self) -> bool:
        """Whether what the slave logged last says why it did nothing."""
        return False
