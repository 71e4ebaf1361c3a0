"""FMI 3.0: instances and slaves; clocks, event mode, early return, time events."""

from __future__ import annotations

import ctypes
import math
from collections.abc import Callable, Mapping, Sequence
from time import perf_counter
from typing import Any

from fmpy.model_description import ModelDescription, ModelVariable

from fmus.fmi.call_warnings import BEYOND_STEP, EARLY_RETURN, EVENT
from fmus.fmi.clocks import ClockSchedule, clock_references
from fmus.fmi.described import EventPort
from fmus.fmi.instance import Instance
from fmus.fmi.interruption import EventMet
from fmus.fmi.native_calls import prepared_call
from fmus.fmi.ports import is_native
from fmus.fmi.quick_calls import quicken
from fmus.fmi.slave import Slave
from fmus.fmi.standard import DISCARD, MAX_RETURNS_PER_STEP, NEVER, TIME_TOLERANCE


class FMI3Instance(Instance):
    """An instance of FMI 3.0, for either interface type. Arguments as for `Instance`."""

    fmi_version = 3
    event_needs_step = False
    _get_state, _set_state, _free_state = "getFMUState", "setFMUState", "freeFMUState"

    def _instantiate(self) -> None:
        log = {"loggingOn": self.logging} if is_native(self.slave) else {}
        self.slave.instantiate(
            logMessage=lambda _environment, status, category, message: self.note(message, status, category),
            **log,
            **self._step_arguments(),
        )

    def _step_arguments(self) -> dict[str, Any]:
        """Further arguments of instantiate."""
        return {}

    def _find_events(self) -> dict[str, EventPort]:
        variables = self.description.modelVariables
        events = {}
        for clock in variables:
            if clock.type == "Clock" and clock.causality == "input" and clock.intervalVariability == "triggered":
                clocked = {v.name: v.valueReference for v in variables if clock.valueReference in clock_references(v)}
                stamp = clocked.get(f"{clock.name}_time")
                events[clock.name] = EventPort(
                    clock.name, clock.valueReference, stamp, self._payload_of(clock.name, clocked)
                )
        return events

    def begin_initialization(self, start_time: float, stop_time: float) -> None:
        call = self.slave.enterInitializationMode
        tolerance, words = self.tolerance_argument()
        self.guard(
            f"enterInitializationMode{words}", lambda: call(startTime=start_time, stopTime=stop_time, **tolerance)
        )


class FMI3Slave(FMI3Instance, Slave):
    """A co-simulation slave of FMI 3.0.

    It handles its events itself, unless somebody coordinates it: then it stops at an event (`EventMet`), says so
    (`event_pending`), and is taken through Event Mode from outside. `next_event` is when something known in advance is
    due, `clocks` are its time-based input clocks.

    Args:
        name: of the instance.
        slave: object with fmpy's slave call surface, not yet instantiated.
        description: its model description.
    """

    def __init__(self, name: str, slave: Any, description: ModelDescription) -> None:
        super().__init__(name, slave, description)
        self._intermediate = _IntermediateUpdate()
        clocks = description.modelVariables if self.has_event_mode else []
        self.clocks = ClockSchedule(lambda: self.slave, clocks, self.failure)
        self.coordinated = self.event_pending = False
        self.interrupts_from = -math.inf  # [s]; early returns before it are handled here even when coordinated

    def _instantiate(self) -> None:
        super()._instantiate()
        native = is_native(self.slave)
        self._do_step = _native_step(self.slave, self.no_way_back) if native else self.slave.doStep
        if native:
            quicken(self.slave, self.fmi_version, (self._get_state, self._set_state, self._free_state))

    def exit_initialization(self) -> None:
        if self.clocks:
            self.guard("intervals of clocks", self.clocks.begin, self.time)
        self.guard("exitInitializationMode", self.slave.exitInitializationMode)
        self._running = True
        if self.has_event_mode:
            self.settle()

    def step(self, t: float, until: float) -> tuple[float, bool]:
        """One doStep from `t` towards `until` [s]; returns the time reached and whether event handling is needed.

        Raises:
            RunError: doStep failed, or says that it reached a time outside the step.
        """
        note = self._call_note
        left = self.left_at.value
        t = left if left < t else t
        note.call[0], note.time[0] = self._step_number, t
        begin = perf_counter()
        try:
            length = self.step_length(t, until) if self.rounding else until - t
            event, terminate, early, reached = self._do_step(t, length)
            if self._intermediate.requested:
                self._intermediate.check()
        except self.mistakes:
            raise
        except Exception as error:
            raise self._step_failed(error, t, until) from error
        finally:
            self.seconds += perf_counter() - begin
            self.calls += 1
        # NEVER stands in where the compiled stepper did the step
        beyond = reached > until and until + TIME_TOLERANCE < reached < NEVER
        if event or early or beyond:
            self._note_contradictions(t, bool(event), bool(early), beyond)
        if terminate:
            self.terminated = True
            # a slave that stops on the way says where
            early = early or t + TIME_TOLERANCE < reached < until - TIME_TOLERANCE
        # lastSuccessfulTime may then be that of an internal step: the slave stands where it was asked to go
        if not early:
            self.time = until
            if left < math.inf:
                self.left_at.value = math.inf
            return until, event
        if not t - TIME_TOLERANCE <= reached <= until + TIME_TOLERANCE:
            raise self.failure(f"doStep to {until:g} s says that it reached {reached!r} s", t)
        self.time = self.left_at.value = min(max(float(reached), t), until)
        return self.time, event

    def _note_contradictions(self, t: float, *said: bool) -> None:
        """Count what a step from `t` [s] said that it must not: event, early return, beyond its end."""
        event, early, beyond = said
        declared = self.capabilities
        for text, wrong in (
            (BEYOND_STEP, beyond and not early),
            (EARLY_RETURN, early and not declared.mightReturnEarlyFromDoStep),
            (EVENT, event and not self.has_event_mode),
        ):
            if wrong:
                self.contradictions.add(text, t)

    def _step_failed(self, error: Exception, t: float, until: float) -> Exception:
        if getattr(error, "status", None) != DISCARD:
            return self.explained("doStep", error, t)
        return self.discarded(error, f"asked for {until:g} s", t)

    def advance(self, t: float, until: float) -> None:
        if self.next_event == NEVER:  # the ordinary step: nothing is due, and mostly nothing happens
            reached, event = self.step(t, until)
            if event and self.has_event_mode and not self.terminated:
                self._meet_event(reached, until)
            if self.terminated or until - reached <= TIME_TOLERANCE:
                return
            t = reached
        for _ in range(MAX_RETURNS_PER_STEP):
            if self.has_event_mode and not self.coordinated and self.next_event <= t + TIME_TOLERANCE:
                self.handle_event()
            t = self.step_towards(t, until)
            if self.terminated or until - t <= TIME_TOLERANCE:
                return
        raise self.failure(f"returned early {MAX_RETURNS_PER_STEP} times without reaching {until:g} s", t)

    def step_towards(self, t: float, until: float) -> float:
        """One doStep to `until` or to the next time event before it, with the event handled; returns the time reached
        [s].

        Args:
            t: where it stands [s].
        """
        reached, event = self.step(t, self.next_stop(t, until))
        if self.has_event_mode and not self.terminated and self.is_event(reached, event):
            self._meet_event(reached, until)
        return reached

    def next_stop(self, t: float, until: float) -> float:
        """Where the next doStep from `t` must end: `until`, or the time event before it where the step may vary [s]."""
        ahead = t + TIME_TOLERANCE < self.next_event < until - TIME_TOLERANCE
        return self.next_event if ahead and self.can_vary_step else until

    def is_event(self, reached: float, event: bool) -> bool:
        """Whether events must be handled at the time reached [s]: the slave says so, or its time event is due."""
        return event or reached >= self.next_event - TIME_TOLERANCE

    def handle_event(self) -> None:
        """Enter event mode, let due clocks tick, settle, and return to step mode."""
        self.enter_event_mode()
        self.tick_due_clocks()
        self.settle()

    def enter_event_mode(self) -> None:
        """From Step Mode to Event Mode."""
        self.guard("enterEventMode", self.slave.enterEventMode)

    def tick_due_clocks(self) -> list[int]:
        """In Event Mode: set the time-based clocks active that are due here; returns their value references."""
        due = self.clocks.due(self.time) if self.clocks else []
        if due:
            self.set_clocks([clock.variable.valueReference for clock in due])
            self.clocks.tick(due)
        return [clock.variable.valueReference for clock in due]

    def set_clocks(self, references: Sequence[int]) -> None:
        """In Event Mode: set input clocks active.

        Args:
            references: value references of the clocks.
        """
        self.guard("setClock", self.slave.setClock, list(references), [True] * len(references))

    def ticking(self, references: Sequence[int]) -> list[bool]:
        """In Event Mode: which of these output clocks are active.

        Args:
            references: value references of the clocks.
        """
        return [bool(x) for x in self.guard("getClock", self.slave.getClock, list(references))]

    def update_discrete_states(self) -> bool:
        again, terminate, _, _, defined, next_time = self.guard("updateDiscreteStates", self.slave.updateDiscreteStates)
        self.terminated |= bool(terminate)
        if defined and math.isnan(next_time):
            raise self.failure("updateDiscreteStates says that the next event is at t = nan")
        self.next_event = float(next_time) if defined else NEVER
        if self.clocks.clocks:
            self.guard("intervals of clocks", self.clocks.ask, self.time)
            self.next_event = min(self.next_event, self.clocks.next)
        self.event_pending = False
        return bool(again)

    def enter_step_mode(self) -> None:
        """From Event Mode to Step Mode."""
        self.guard("enterStepMode", self.slave.enterStepMode)

    def _meet_event(self, reached: float, until: float) -> None:
        """An event at the time reached [s] of a step to `until` [s]: handle it, or leave it to who coordinates."""
        early = until - reached > TIME_TOLERANCE
        if not self.coordinated or (early and reached < self.interrupts_from - TIME_TOLERANCE):
            self.handle_event()
            return
        self.event_pending = True
        if early:
            raise EventMet(self, reached)

    def report_clock(self, clock: int) -> bool:
        """Handle an event; True where the triggered output clock ticked."""
        self.enter_event_mode()
        self.tick_due_clocks()
        ticked = self.ticking([clock])[0]
        self.settle()
        return ticked

    def activate(self, clock: str) -> None:
        """Let a triggered input clock tick, with the values its clocked inputs have.

        Args:
            clock: its name.
        """
        self.enter_event_mode()
        self.set_clocks([self.events[clock].trigger])
        self.settle()

    def notify(self, event: EventPort, t: float, stamp: float, payload: Mapping[str, float]) -> None:
        self.guard(f"event '{event.name}'", self._deliver, event, stamp, payload)

    def _deliver(self, event: EventPort, stamp: float, payload: Mapping[str, float]) -> None:
        slave, fields = self.slave, event.fields(stamp, payload)
        slave.enterEventMode()
        slave.setClock([event.trigger], [True])
        if fields:
            slave.setFloat64(list(fields), list(fields.values()))
        self.settle()

    def settle(self) -> None:
        """In Event Mode: update the discrete states until they do not change any more, and return to Step Mode."""
        super().settle()
        self.enter_step_mode()

    def _remember(self) -> tuple[Any, ...]:
        self.no_way_back.value = 0
        stands = self.time, self.left_at.value
        return self.next_event, *stands, self.terminated, self.event_pending, self.clocks.save()

    def _recall(self, remembered: tuple[Any, ...]) -> None:
        self.next_event, self.time, self.left_at.value, self.terminated, self.event_pending, clocks = remembered
        if clocks:
            self.clocks.restore(clocks)

    def _step_arguments(self) -> dict[str, Any]:
        early = self.capabilities.mightReturnEarlyFromDoStep
        return {"eventModeUsed": self.has_event_mode, "earlyReturnAllowed": early} | self._intermediate.arguments


def _native_step(slave: Any, no_way_back: ctypes.c_int) -> Callable[[float, float], tuple[bool, bool, bool, float]]:
    """fmpy's doStep of a native slave with its four results allocated once instead of at every call."""
    event, terminate, early, reached = ctypes.c_bool(), ctypes.c_bool(), ctypes.c_bool(), ctypes.c_double()
    results = (ctypes.byref(event), ctypes.byref(terminate), ctypes.byref(early), ctypes.byref(reached))
    start, length = ctypes.c_double(), ctypes.c_double()
    flag = ctypes.c_bool.from_buffer(no_way_back)  # its low byte: all platforms of FMUs are little-endian
    call = prepared_call(slave, "fmi3DoStep", slave.component, start, length, flag, *results)

    def do_step(t: float, h: float) -> tuple[bool, bool, bool, float]:
        start.value, length.value, reached.value = t, h, t + h  # the last for slaves that do not fill it in
        call()
        return event.value, terminate.value, early.value, reached.value

    return do_step


class _IntermediateUpdate:
    """The callback of one slave.

    `request` names the inputs before the slave is instantiated; afterwards `handler` is called with the time [s]
    whenever the slave lets inputs be set within its step. An exception of the handler cannot pass through the slave's C
    code; it is kept, and raised by `check` after the step.
    """

    def __init__(self) -> None:
        self.requested: dict[str, int] = {}
        self.handler: Callable[[float], None] | None = None
        self._error: Exception | None = None

    def request(self, variables: Sequence[ModelVariable]) -> None:
        """Ask for calls for those of the inputs that may be set within a step.

        Args:
            variables: the inputs that are asked for.
        """
        self.requested = {v.name: v.valueReference for v in variables if v.intermediateUpdate}

    @property
    def arguments(self) -> dict[str, Any]:
        """What to instantiate the slave with."""
        if not self.requested:
            return {}
        return {"intermediateUpdate": self._called, "requiredIntermediateVariables": list(self.requested.values())}

    def check(self) -> None:
        """Raise what the handler raised within the last step."""
        if self._error is not None:
            error, self._error = self._error, None
            raise error

    def _called(self, _environment: Any, time: float, set_requested: bool, *_rest: Any) -> None:
        if not set_requested or self.handler is None or self._error is not None:
            return
        try:
            self.handler(time)
        except Exception as error:  # it would be lost in the slave
            self._error = error
