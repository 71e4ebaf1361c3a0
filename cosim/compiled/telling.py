"""Telling: a receiver with event mode is stepped through one telegram by one call into the stepper.

What is not ordinary is finished by the receiver's own Python, which is handed what the FMU has said so far.
"""

from __future__ import annotations

import ctypes
from collections import defaultdict
from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager
from enum import IntEnum
from time import perf_counter
from typing import Any

import numpy as np

from cosim.balises.delivery import Delivery, Receiver, snapped
from cosim.balises.telegram import PAYLOAD, payload
from cosim.compiled.answers import Answer
from cosim.compiled.program import Program, Stop
from cosim.components.component import NEVER
from cosim.results.result import BaliseRecord

FUNCTIONS = ("fmi3EnterEventMode", "fmi3SetClock", "fmi3SetFloat64", "fmi3UpdateDiscreteStates", "fmi3EnterStepMode")
FMI3 = 3
Answering = Callable[[Any, Mapping[str, Sequence[Answer]]], AbstractContextManager[None]]


class Stage(IntEnum):
    """Stages of telling, as in ``stepper.h``."""

    SEND = 0
    ARRIVE = 1
    BEFORE = 2
    ENTER = 3
    CLOCK = 4
    PAYLOAD = 5
    UPDATE = 6
    LEAVE = 7
    AFTER = 8
    GO_ON = 9
    END = 10


CALLED = {
    Stage.ENTER: "fmi3EnterEventMode", Stage.CLOCK: "fmi3SetClock", Stage.PAYLOAD: "fmi3SetFloat64",
    Stage.LEAVE: "fmi3EnterStepMode",
}  # fmt: skip


class CTelegram(ctypes.Structure):
    """`Telegram`."""

    _fields_ = (
        *((name, ctypes.c_void_p) for name in ("enter_event", "set_clock", "set_reals", "update", "enter_step")),
        *((name, ctypes.c_void_p) for name in ("references", "payload")),
        *((name, ctypes.c_int64) for name in ("payload_count", "clock", "stage")),
        ("flags", ctypes.c_int64 * 5),
        ("next_event", ctypes.c_double),
    )


class Telling:
    """Steps one receiver.

    Args:
        receiver: see `can_be_told`. place: of its component in the plan. program: the plan in C. library: the stepper.
        answering: context in which the slave gives answers and nothing calls the stepper.
    """

    def __init__(self, receiver: Receiver, place: int, program: Program, library: Any, answering: Answering) -> None:
        self.receiver, self.place, self.program, self._answering = receiver, place, program, answering
        self.component = receiver.planned.component
        self._port = self.component.events[receiver.event]
        self._fields = [name for name in self._port.payload if name in PAYLOAD]
        references = [self._port.payload[name] for name in self._fields]
        references += [] if self._port.stamp is None else [self._port.stamp]
        self._references = np.array(references, dtype=np.uint32)
        self._payload, self._times = np.zeros(len(references)), np.zeros(3)
        functions = [ctypes.cast(self.component.slave._functions[name], ctypes.c_void_p).value for name in FUNCTIONS]
        pointers = [*functions, self._references.ctypes.data, self._payload.ctypes.data]
        self._telegram = CTelegram(*pointers, len(references), self._port.trigger)
        self._call, self._slowly = library.stepper_tell, receiver.step

    def step(self, t: float, until: float, telegrams: Sequence[BaliseRecord]) -> list[Delivery]:
        """As `Receiver.step`."""
        receiver, component = self.receiver, self.component
        if len(telegrams) != 1 or receiver.busy or component.next_event != NEVER:
            return self._slowly(t, until, telegrams)
        told_at = snapped(telegrams[0].delivered_at, t, until)
        self._times[:] = t, told_at, until
        fields = payload(telegrams[0])
        self._payload[:] = [*(fields[name] for name in self._fields), *([] if self._port.stamp is None else [telegrams[0].stamp])]
        before = np.empty(len(receiver.planned.outputs))
        after = np.empty_like(before)
        begin = perf_counter()
        done = self._call(
            self.program.address, self.place, ctypes.addressof(self._telegram), self._times.ctypes.data, before.ctypes.data,
            after.ctypes.data,
        )  # fmt: skip
        if not done:
            with self._answering(component.slave, self._said(before, after)):
                return self._slowly(t, until, telegrams)
        component.time, component.calls = until, component.calls + (told_at > t) + (until > told_at)
        component.seconds += perf_counter() - begin
        delivery = Delivery(told_at, before, after)
        receiver.told(delivery, before if told_at == until else receiver.planned.outputs.copy())
        return [delivery]

    def _said(self, before: np.ndarray, after: np.ndarray) -> Mapping[str, Sequence[Answer]]:
        """All that the slave has said up to the stage that was not ordinary, in order."""
        head, stage = self.program.head, self._telegram.stage
        said: defaultdict[str, list[Answer]] = defaultdict(list)
        moves = {Stage.ARRIVE: self._times[1] > self._times[0], Stage.GO_ON: self._times[2] > self._times[1]}
        reads = {Stage.BEFORE: before, Stage.AFTER: after}
        for past in list(Stage)[: stage + 1]:
            odd = past == stage
            if past == Stage.SEND:
                for name, answers in self.program.said(self.place, Stop(head.stop) if odd else Stop.SENT).items():
                    said[name] += answers
            elif moves.get(past):
                for name, answers in self.program.said(self.place, Stop(head.stop) if odd else Stop.DONE).items():
                    said[name] += answers
            elif past == Stage.UPDATE:
                flags = tuple(bool(flag) for flag in self._telegram.flags)
                said["fmi3UpdateDiscreteStates"].append(Answer(head.status if odd else 0, (*flags, self._telegram.next_event)))
            elif past in CALLED and (past != Stage.PAYLOAD or len(self._payload)):
                said[CALLED[past]].append(Answer(head.status if odd else 0))
            elif past in reads:
                said["fmi3GetFloat64"].append(Answer(head.status) if odd else Answer(values=reads[past].tobytes()))
            elif past == Stage.END:
                said["fmi3GetFloat64"].append(Answer(head.status))
        return said


def can_be_told(receiver: Receiver, place: int, program: Program) -> bool:
    """Whether a receiver is one for which `Telling` is right: an FMI 3 slave that can be stopped anywhere and is told exactly.

    Args:
        receiver: of the run. place: of its component in the plan. program: the plan in C.
    """
    component = receiver.planned.component
    plain = not component.event_needs_step and component.can_vary_step and component.outcomes() is None
    clocks = bool(getattr(component, "clocks", False))
    exact = receiver.timing == "exact" and program.reads_straight(place)
    return component.fmi_version == FMI3 and plain and exact and not clocks
