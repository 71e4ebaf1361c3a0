"""Slaves: instances for co-simulation of any FMI version, with what their steps have in common."""

from __future__ import annotations

import ctypes
import math
from abc import abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from time import perf_counter
from typing import Any, Protocol

import numpy as np
from fmpy.fmi1 import FMICallException
from fmpy.model_description import ModelDescription

from fmus.fmi.described import EventPort
from fmus.fmi.instance import Instance
from fmus.fmi.native_calls import prepared_call
from fmus.fmi.ports import is_native
from fmus.fmi.standard import DISCARD, NEVER, OK, PENDING, STATUS, WARNING

_ROUNDINGS = 4.0 * float(np.finfo(float).eps)
"""By how much the difference of two communication points may miss the length of a step, as a share of their size."""


class _CallNote(Protocol):
    """Where the step under way is noted: its number in `call[0]`, its time [s] in `time[0]`."""

    call: Any
    time: Any


class _Unnoted:
    """A note that nobody reads."""

    def __init__(self) -> None:
        self.call, self.time = [0], [math.nan]


@dataclass(frozen=True)
class RawStep:
    """What one call of doStep said.

    Args:
        status: FMI status by name.
        event: event handling is needed.
        terminate: the FMU asks for the end.
        reached: where it says it stands [s], NaN where it did the whole step.
    """

    status: str
    event: bool = False
    terminate: bool = False
    reached: float = math.nan

    @property
    def refused(self) -> bool:
        """Whether the step was not done."""
        return self.status not in {STATUS[OK], STATUS[WARNING]}


class Slave(Instance):
    """A co-simulation instance. Its life: `instantiate`, `enter_initialization`, readers and writers in turn,
    `exit_initialization`, then `advance` and `notify` in turn, `terminate`, `free`.

    `reset` leads back to the state after `instantiate`. `time` is where it stands [s], `next_event` when something
    known in advance is due [s]; `seconds` were spent in `calls` calls of doStep; `terminated` says that the slave asked
    for the end of the run. `no_way_back` is 1 until a state is saved: up to then nothing leads back before a step, as
    each is announced (noSetFMUStatePriorToCurrentPoint); some FMUs step only so. `left_at` is where an early return
    left it so near to the end of its last step that this counts as reached [s]: its next step begins there. Infinite
    where it got to the end.

    Args:
        name: of the instance.
        slave: object with fmpy's slave call surface, not yet instantiated.
        description: its model description.
    """

    _do_step: Callable[..., Any]
    """The slave's doStep from a time by a length [s], and with what stands in `_last`, prepared by `instantiate`."""

    _last: tuple[Any, ...] = ()
    """The last argument of a slave in Python, in FMI 2."""

    def __init__(self, name: str, slave: Any, description: ModelDescription) -> None:
        super().__init__(name, slave, description)
        self.seconds, self.calls = 0.0, 0
        self.time, self.next_event = math.nan, NEVER
        self.no_way_back, self.left_at = ctypes.c_int(1), ctypes.c_double(math.inf)
        self._call_note: _CallNote = _Unnoted()
        self._step_number = 0
        self.usual_step, self.rounding = 1.0, 0.0

    def expect_steps(self, step: float, start: float, stop: float) -> None:
        """State the length of the ordinary step, of which an FMU may want whole multiples and nothing else.

        Args:
            step: [s]. start, stop: of the run [s].
        """
        if is_native(self.slave):
            self.usual_step, self.rounding = step, _ROUNDINGS * (abs(start) + abs(stop))

    def step_length(self, t: float, until: float) -> float:
        """The length that doStep is handed for a step from `t` to `until` [s].

        The difference of two communication points is a multiple of the ordinary step but for rounding: where it is
        that, this multiple.
        """
        length = until - t
        if abs(length - self.usual_step) <= self.rounding:
            return self.usual_step
        whole = round(length / self.usual_step) * self.usual_step
        return whole if abs(length - whole) <= self.rounding else length

    def reset(self) -> None:
        """Back to the state after `instantiate`."""
        super().reset()
        self.time, self.next_event, self.left_at.value = math.nan, NEVER, math.inf

    def note_reset(self, t: float) -> None:
        """Follow a reset that a prepared call made.

        Args:
            t: instant at which it is initialised next [s].
        """
        self._forget()
        self.terminated = self._running = False
        self.time, self.next_event, self.left_at.value = t, NEVER, math.inf

    def note_initialised(self) -> None:
        """Follow the end of initialisation that a prepared call made."""
        self._running = True

    def enter_initialization(self, start_time: float, stop_time: float) -> None:
        """Begin initialisation.

        Args:
            start_time: [s].
            stop_time: announced to the slave [s].
        """
        self.time = start_time
        self.begin_initialization(start_time, stop_time)

    @abstractmethod
    def exit_initialization(self) -> None:
        """End initialisation, discrete states settled."""

    @abstractmethod
    def advance(self, t: float, until: float) -> None:
        """Step to a time, own time events on the way included. Raises what `failure` makes where it does not get there.

        Args:
            t: where it stands [s].
            until: where to [s].
        """

    @abstractmethod
    def notify(self, event: EventPort, t: float, stamp: float, payload: Mapping[str, float]) -> None:
        """Deliver a triggered event.

        Args:
            event: one of `events`.
            t: current time of the slave [s].
            stamp: when the event happened [s]: at or before `t`, or within the coming step where the slave takes
                stamps.
            payload: fields by name; fields that the slave does not declare are dropped.

        Where `event_needs_step` says so, only the last event before a step happens, and it happens in that step.
        """

    def raw_step(self, t: float, h: float) -> RawStep:
        """One doStep and nothing else; a refusal is returned, not raised. Raises where the call could not be made.

        Args:
            t: from when [s].
            h: length [s].
        """
        try:
            said = self._do_step(t, h, *self._last)
        except FMICallException as error:
            self.explained("doStep", error)
            return RawStep(STATUS[error.status] if error.status in range(len(STATUS)) else f"status {error.status}")
        except self.mistakes:
            raise
        except Exception as error:
            raise self.explained("doStep", error, t) from error
        if said is None:
            return RawStep(STATUS[OK])
        event, terminate, early, reached = said
        return RawStep(STATUS[OK], bool(event), bool(terminate), float(reached) if early or terminate else math.nan)

    def pending(self, t: float) -> Exception:
        """The error of a slave that returned from doStep before it was done.

        Args:
            t: when [s].
        """
        asynchronous = (
            "as canRunAsynchronuously allows" if self.capabilities.canRunAsynchronuously else "against its description"
        )
        return self.failure(
            f"doStep returned before it was done (status pending), {asynchronous}; slaves that compute asynchronously "
            "are not stepped here. Export the FMU without asynchronous computation.",
            t,
        )


class WholeStepSlave(Slave):
    """A slave of FMI 1 or 2: a step gets to its end or is refused."""

    def advance(self, t: float, until: float) -> None:
        note = self._call_note
        note.call[0], note.time[0] = self._step_number, t
        begin = perf_counter()
        try:
            self._do_step(t, self.step_length(t, until) if self.rounding else until - t, *self._last)
            self.time = until
        except FMICallException as error:
            if error.status == PENDING:
                raise self.pending(t) from error
            if error.status != DISCARD:
                raise self.explained("doStep", error, t) from error
            self._after_discard(error, t, until)
        except self.mistakes:
            raise
        except Exception as error:
            raise self.explained("doStep", error, t) from error
        finally:
            self.seconds += perf_counter() - begin
            self.calls += 1

    @abstractmethod
    def _after_discard(self, error: FMICallException, t: float, until: float) -> None:
        """The step from `t` to `until` was discarded: the slave can be asked why."""

    def _not_done(self, error: Exception, t: float, until: float, reached: float | None) -> Exception:
        """The error of a discarded step from `t` to `until`, of which it did the part to `reached` [s]."""
        known = "it does not say how far it came" if reached is None else f"it came to {reached:g} s"
        return self.discarded(error, f"asked for {until:g} s, {known}", t)


def status_of(ask: Callable[[int], Any], kind: int) -> Any:
    """What a slave says of its last step.

    Args:
        ask: one of its status functions.
        kind: of status, in the numbers of FMI.

    Returns:
        The value; None where it cannot say.
    """
    try:
        return ask(kind)
    except Exception:
        return None


def make_step(slave: Any, name: str, flag: Any) -> Callable[..., None]:
    """The doStep of FMI 1 and 2 from a time by a length, both in [s], its arguments allocated once.

    Args:
        slave: instantiated, with fmpy's call surface.
        name: of the function in fmpy's words.
        flag: the last argument as C has it, read at each call.
    """
    if not is_native(slave):
        step: Callable[..., None] = slave.doStep
        return step
    start, length = ctypes.c_double(), ctypes.c_double()
    call = prepared_call(slave, name, slave.component, start, length, flag)

    def do_step(t: float, h: float) -> None:
        start.value, length.value = t, h
        call()

    return do_step
