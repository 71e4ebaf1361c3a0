"""CompiledDelivery: a receiver with event mode is stepped through one telegram by one call into the stepper.

What is not ordinary is finished by the receiver's own Python, which is handed what the FMU has said so far.
"""

from __future__ import annotations

import ctypes
from collections.abc import Sequence
from time import perf_counter
from typing import Any

import numpy as np

from cosim.balises.delivery import OUTCOMES, Delivery, Receiver, snapped
from cosim.balises.telegram import PAYLOAD
from cosim.compiled.program import Program
from cosim.compiled.recorded_returns import Repetition
from cosim.components.component import Component
from cosim.results.result import BaliseRecord
from fmu_observer.event_protocol import OUTCOME_VARIABLES
from fmus.fmi.described import EventPort
from fmus.fmi.standard import NEVER

FUNCTIONS = ("fmi3EnterEventMode", "fmi3SetClock", "fmi3SetFloat64", "fmi3UpdateDiscreteStates", "fmi3EnterStepMode")
FIELDS = ("position", "location_accuracy", "odometer_reading", "delivered_at", "stamp")  # in the order of `stepper.h`
OUTCOMES_AT_MOST = 8
FMI3 = 3


class _CTelegram(ctypes.Structure):
    """`Telegram`."""

    _fields_ = (
        *(
            (name, ctypes.c_void_p)
            for name in ("enter_event", "set_clock", "set_reals", "update", "enter_step", "get_counts")
        ),
        *((name, ctypes.c_void_p) for name in ("references", "payload", "fields")),
        *((name, ctypes.c_int64) for name in ("payload_count", "clock")),
        *((name, ctypes.c_void_p) for name in ("before", "after", "count_references")),
        ("count_count", ctypes.c_int64),
        ("count_ranks", ctypes.c_int64 * OUTCOMES_AT_MOST),
        ("seen", ctypes.c_int64 * OUTCOMES_AT_MOST),
        ("outcome", ctypes.c_int64),
    )


class CompiledDelivery:
    """Steps one receiver.

    Args:
        receiver: see `can_be_notified`. place: of its component in the plan. program: the plan in C.
        library: the stepper.
        repetition: the time in which slaves repeat what they said.
    """

    def __init__(
        self,
        receiver: Receiver,
        place: int,
        program: Program,
        library: Any,
        repetition: Repetition,
    ) -> None:
        self.receiver, self.place, self.program = receiver, place, program
        self._repetition = repetition
        self.component = receiver.planned.component
        self._port = port = self.component.events[receiver.event]
        self._names = [name for name in port.payload if name in PAYLOAD] + ["stamp"] * (port.stamp is not None)
        references = [port.stamp if name == "stamp" else port.payload[name] for name in self._names]
        self._payload, self._is_prepared = np.zeros(len(references)), False
        self._before, self._after = (np.zeros(len(receiver.planned.outputs)) for _ in range(2))
        counted = list(OUTCOME_VARIABLES) if _counts(self.component) else []
        self._counts = [OUTCOME_VARIABLES[name] for name in counted]
        self.telegram = self._telegram(port, references, counted)
        self._times = (ctypes.c_double * 3)()
        self._call, self._slowly = library.stepper_deliver, receiver.step_in_python
        self._arguments = program.address, place, ctypes.addressof(self.telegram), ctypes.addressof(self._times)

    def _telegram(self, port: EventPort, references: Sequence[int | None], counted: Sequence[str]) -> _CTelegram:
        """The event as the stepper knows it.

        Args:
            references: value references of what comes with it. counted: variables that say what became of events.
        """
        program, keep, slave = self.program, self.program.keep, self.component.slave
        telegram = _CTelegram(
            *(ctypes.cast(slave._functions[name], ctypes.c_void_p).value for name in FUNCTIONS),
            program.function(self.component, "fmi3GetInt32") if self._counts else None,
            keep(np.array(references, dtype=np.uint32)),
            keep(self._payload),
            keep(np.array([FIELDS.index(name) for name in self._names], dtype=np.int64)),
            len(references),
            port.trigger,
            keep(self._before),
            keep(self._after),
            keep(np.array([self.component.variables[f].valueReference for f in counted], dtype=np.uint32)),
            len(counted),
        )
        for i, name in enumerate(self._counts):
            telegram.count_ranks[i] = OUTCOMES.index(name) if name in OUTCOMES else -1
        return telegram

    def step(self, t: float, until: float, telegrams: Sequence[BaliseRecord]) -> list[Delivery]:
        """As `Receiver.step`.

        Args:
            t: start of the step [s]. until: end of the step [s]. telegrams: to be delivered in it.
        """
        receiver, component = self.receiver, self.component
        if len(telegrams) != 1 or receiver.busy or component.next_event != NEVER or self._repetition.active:
            return self._slowly(t, until, telegrams)
        notified_at = snapped(telegrams[0].delivered_at, t, until)
        self._times[0], self._times[1], self._times[2] = t, notified_at, until
        self._payload[:] = [getattr(telegrams[0], name) for name in self._names]
        self.begin()
        begin = perf_counter()
        if not self._call(*self._arguments):
            with self._repetition.of(self.program.journalled()):
                return self._slowly(t, until, telegrams)
        before, after = self._before.copy(), self._after.copy()
        component.time, component.calls = until, component.calls + (notified_at > t) + (until > notified_at)
        component.calls += self.program.slaves[self.place].returns_here
        component.seconds += perf_counter() - begin
        delivery = Delivery(notified_at, before, after)
        self.end()
        if self.telegram.outcome >= 0:
            delivery.outcome = OUTCOMES[self.telegram.outcome]
        receiver.stepped_elsewhere(delivery, before if notified_at == until else receiver.planned.outputs.copy())
        return [delivery]

    def begin(self) -> None:
        """The stepper knows the outcomes that the receiver knows."""
        if self._counts and not self._is_prepared:
            self.component.outcomes()  # prepares its call while the library is there to be called
            self._is_prepared = True
        for i, name in enumerate(self._counts):
            self.telegram.seen[i] = self.receiver.seen.get(name, 0)

    def end(self) -> None:
        """The receiver knows the outcomes that the stepper knows."""
        if self._counts:
            self.receiver.seen = dict(zip(self._counts, self.telegram.seen, strict=False))


def can_be_notified(receiver: Receiver, place: int, program: Program) -> bool:
    """Whether `CompiledDelivery` is right for a receiver: an FMI 3 slave that can be stopped anywhere and is notified
    at the exact instant.

    Args:
        receiver: of the run. place: of its component in the plan. program: the plan in C.
    """
    component = receiver.planned.component
    plain = not component.event_needs_step and component.can_vary_step and not getattr(component, "clocks", False)
    countable = _counts(component) or not any(name in component.variables for name in OUTCOME_VARIABLES)
    return (
        component.fmi_version == FMI3
        and plain
        and countable
        and receiver.timing == "exact"
        and program.reads_straight(place)
    )


def _counts(component: Component) -> bool:
    """Whether the slave says what became of events, in the way of the FMUs this package exports."""
    return all(name in component.variables and component.variables[name].type == "Int32" for name in OUTCOME_VARIABLES)
