"""The journal of the stepper: calls of a step that Python may have to do again, and what was said, as in
``stepper.h``.
"""

from __future__ import annotations

import ctypes
from collections.abc import Iterator, Sequence
from enum import IntEnum

import numpy as np

from cosim.compiled.recorded_returns import RecordedReturn

STEPS_AT_MOST = 68
"""Of the plant in a step over a balise: the whole step, `MAX_ROOT_STEPS` of the root search, to the stamp, again to the
end.
"""

CALLS_OF_EVENT = 12
EARLY_RETURNS = 1024
"""Room for those of all slaves in a step; a step with more of them is Python's."""
FMI2, FMI3 = 2, 3


class StepperCall(IntEnum):
    """Functions in a journal."""

    SET = 0
    STEP = 1
    GET = 2
    ENTER_EVENT = 3
    SET_CLOCK = 4
    SET_REALS = 5
    UPDATE = 6
    ENTER_STEP = 7
    COUNT = 8
    SAVE = 9
    RESTORE = 10
    RELEASE = 11

    def function(self, version: int) -> str | None:
        """Name of the function; None where it depends on the type of the variables.

        Args:
            version: of FMI.
        """
        if self in (StepperCall.SET, StepperCall.GET):
            return None
        if self is StepperCall.STEP:
            return f"fmi{version}DoStep"
        return NAMES[self] if version == FMI3 else NAMES[self].replace("fmi3", "fmi2").replace("FMUState", "FMUstate")


NAMES = {
    StepperCall.ENTER_EVENT: "fmi3EnterEventMode",
    StepperCall.SET_CLOCK: "fmi3SetClock",
    StepperCall.SET_REALS: "fmi3SetFloat64",
    StepperCall.UPDATE: "fmi3UpdateDiscreteStates",
    StepperCall.ENTER_STEP: "fmi3EnterStepMode",
    StepperCall.COUNT: "fmi3GetInt32",
    StepperCall.SAVE: "fmi3GetFMUState",
    StepperCall.RESTORE: "fmi3SetFMUState",
    StepperCall.RELEASE: "fmi3FreeFMUState",
}


class _CNote(ctypes.Structure):
    """`Note`."""

    _fields_ = (
        *((name, ctypes.c_int64) for name in ("slave", "call", "port", "status")),
        ("flags", ctypes.c_int64 * 5),
        ("number", ctypes.c_double),
        ("state", ctypes.c_void_p),
        *((name, ctypes.c_int64) for name in ("first", "bytes")),
    )


class CJournal(ctypes.Structure):
    """`StepperJournal`."""

    _fields_ = (
        ("on", ctypes.c_int64),
        ("notes", ctypes.POINTER(_CNote)),
        *((name, ctypes.c_int64) for name in ("count", "returns_up_to")),
        ("bytes", ctypes.c_void_p),
        ("used", ctypes.c_int64),
    )


class StepperJournal:
    """Room for the calls of one step.

    Args:
        head: the structure. calls: of all slaves in an ordinary step. values: what all of them read in it [bytes].
    """

    def __init__(self, head: CJournal, calls: int, values: int) -> None:
        self._head = head
        self._notes = (_CNote * (STEPS_AT_MOST * (calls + CALLS_OF_EVENT) + EARLY_RETURNS))()
        head.returns_up_to = EARLY_RETURNS
        self._bytes = np.zeros(STEPS_AT_MOST * (values + 64), dtype=np.uint8)
        head.notes, head.bytes = ctypes.cast(self._notes, ctypes.POINTER(_CNote)), self._bytes.ctypes.data

    def read(self, versions: Sequence[int]) -> Iterator[tuple[int, StepperCall, int, RecordedReturn]]:
        """Place of the slave, function, port, answer; in the order of the calls.

        Args:
            versions: of FMI, of each slave.
        """
        for note in self._notes[: self._head.count]:
            yield note.slave, StepperCall(note.call), note.port, self._response(note, versions[note.slave])

    def _response(self, note: _CNote, version: int) -> RecordedReturn:
        call = StepperCall(note.call)
        if call is StepperCall.STEP and version == FMI3:
            event, terminate, early = (bool(flag) for flag in note.flags[:3])
            return RecordedReturn(note.status, (event, terminate, early, note.number))
        if call is StepperCall.UPDATE:
            return RecordedReturn(note.status, (*(bool(flag) for flag in note.flags), note.number))
        if call is StepperCall.SAVE:
            return RecordedReturn(note.status, (note.state,))
        if call in (StepperCall.GET, StepperCall.COUNT):
            return RecordedReturn(note.status, values=self._bytes[note.first : note.first + note.bytes].tobytes())
        return RecordedReturn(note.status)
