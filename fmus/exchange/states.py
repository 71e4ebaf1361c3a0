"""Saved states of a model exchange FMU that is stepped: what the FMU gives, and what stands beside it.

An FMU that saves no states is put back by time, continuous states and inputs where these are all of its state: where it
declares nothing that an event could change, as long as no event happens, and where a step that is made again is seen
to end where it did. What is hidden nevertheless is seen at the first save, or not at all: see `StoredStates`.
"""

from __future__ import annotations

import ctypes
import json
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from itertools import count
from typing import Any, Protocol

import numpy as np
from fmpy.fmi1 import FMICallException
from fmpy.model_description import ModelDescription

from fmus.exchange.cvode import SolverError
from fmus.exchange.motion import Motion, MotionState
from fmus.exchange.sent import Content, Key, SentValues
from fmus.fmi.standard import OK, WARNING, fmi_version
from fmus.fmi.types import REAL_TYPE, is_continuous

_PROBED, _SHARE = 1e-3, 0.01
"""Length of the step that is made twice [s], where none was made before, and as a share of one that was: an event in it
could not be taken back.
"""
_SAME = 10.0
"""By how many tolerances of the solver its ends may differ: an FMU may iterate from where it stood."""


class _Stepped(Protocol):
    """What states are saved of: see `slave.CoSimulationFunctions`."""

    sent: SentValues
    reached: float
    length: float
    tolerance: float

    @property
    def moved(self) -> Motion: ...

    def put(self, key: Key, content: bytes) -> None: ...

    def get_reals(self, references: Sequence[int]) -> np.ndarray: ...


@dataclass(frozen=True)
class _Saved:
    """A state: what the FMU gave, if it gives one, and what stands beside it."""

    held: ctypes.c_void_p | None
    states: np.ndarray
    sent: Content
    motion: MotionState
    time: float
    events: int


class StoredStates:
    """The functions of saved states, over those of the library where the FMU has them.

    At the first save of an FMU that gives no states, a step is made twice, with one under other inputs between: where
    it ends elsewhere the second time, the FMU holds more than its continuous states, which is an error.

    Args:
        stepped: whose states they are. description: of the FMU.
    """

    def __init__(self, stepped: _Stepped, description: ModelDescription) -> None:
        self._of, self._numbers, self._stored = stepped, count(1), dict[int, _Saved]()
        self._own = bool(getattr(description.modelExchange, "canGetAndSetFMUstate", False))
        self._probed = self._own
        variables, real = description.modelVariables, REAL_TYPE[fmi_version(description)]
        plain = [v for v in variables if v.type == real and not v.shape]
        self._outputs = {v.valueReference: v.name for v in plain if v.causality == "output"}
        self._inputs = {v.valueReference for v in variables if v.causality == "input" and is_continuous(v)}

    def functions(self, version: int) -> dict[str, tuple[Any, ...]]:
        """What is installed: a function, and the types of its arguments behind the instance.

        Args:
            version: of FMI.
        """
        pointer, size = ctypes.c_void_p, ctypes.c_size_t
        word, again = ("FMUstate", "DeSerialize") if version == 2 else ("FMUState", "Deserialize")
        kept: dict[str, tuple[Any, ...]] = {
            f"Get{word}": (self._save, pointer),
            f"Set{word}": (self._restore, pointer),
            f"Free{word}": (self._release, pointer),
        }
        return (
            kept
            if not self._own
            else kept
            | {
                f"Serialized{word}Size": (self._size, pointer, pointer),
                f"Serialize{word}": (self._serialize, pointer, pointer, size),
                f"{again}{word}": (self._deserialize, pointer, size, pointer),
            }
        )

    # -- in memory ----------------------------------------------------------------------------------------------------

    def _save(self, call: Callable[..., int], instance: Any, place: int) -> int:
        """What follows begins anew, as it does once this state is restored."""
        held = ctypes.c_void_p() if self._own else None
        status = OK if held is None else call(instance, ctypes.addressof(held))
        if status <= WARNING:
            self._demand_whole()
            self._keep(self._here(held), place)
        return status

    def _restore(self, call: Callable[..., int], instance: Any, number: int) -> int:
        """Back to a saved state."""
        saved, status = self._stored[number], OK
        if saved.held is None:
            self._put_back(saved)
        else:
            status = call(instance, saved.held.value)
            self._of.moved.restore(saved.motion)
        self._of.sent.restore(saved.sent)
        self._of.reached = saved.time
        return status

    def _release(self, call: Callable[..., int], instance: Any, place: int) -> int:
        """Free a saved state."""
        pointer = ctypes.c_void_p.from_address(place)
        saved = self._stored.pop(pointer.value or 0, None)
        pointer.value = None
        held = None if saved is None else saved.held
        return OK if held is None else call(instance, ctypes.addressof(held))

    # -- as bytes, of an FMU that has them -----------------------------------------------------------------------------

    def _size(self, call: Callable[..., int], instance: Any, number: int, place: int) -> int:
        """How many bytes a state has."""
        saved = self._stored[number]
        assert saved.held is not None
        status = call(instance, saved.held.value, place)
        ctypes.c_size_t.from_address(place).value += len(_written(saved))
        return status

    def _serialize(self, call: Callable[..., int], instance: Any, number: int, place: int, size: int) -> int:
        """A state as bytes: those of the FMU, then what stands beside."""
        saved = self._stored[number]
        assert saved.held is not None
        own = _written(saved)
        ctypes.memmove(place + size - len(own), own, len(own))
        return call(instance, saved.held.value, place, size - len(own))

    def _deserialize(self, call: Callable[..., int], instance: Any, content: int, size: int, place: int) -> int:
        """A state from bytes, in this instance or another one."""
        own = int.from_bytes(ctypes.string_at(content + size - _WIDTH, _WIDTH), "little")
        if not 0 < own <= size:
            raise SolverError("the bytes are no saved state")
        held = ctypes.c_void_p()
        status = call(instance, content, size - own, ctypes.addressof(held))
        if status <= WARNING:
            self._keep(_read(ctypes.string_at(content + size - own, own - _WIDTH), held, self._of.moved.events), place)
        return status

    # -- internals ----------------------------------------------------------------------------------------------------

    def _here(self, held: ctypes.c_void_p | None) -> _Saved:
        of = self._of
        states, motion = of.moved.states(), of.moved.state()
        return _Saved(held, states, of.sent.all(), motion, of.reached, of.moved.events)

    def _keep(self, saved: _Saved, place: int) -> None:
        number = next(self._numbers)
        self._stored[number] = saved
        ctypes.c_void_p.from_address(place).value = number

    def _put_back(self, saved: _Saved) -> None:
        """Time, continuous states and inputs, where nothing else was changed."""
        of = self._of
        if of.moved.events != saved.events:
            raise SolverError(
                f"an event happened since t = {saved.time:.12g} s, and the FMU saves no states "
                "(canGetAndSetFMUstate): it cannot be put back before it"
            )
        if not _set_in(of.sent.all()) <= _set_in(saved.sent):
            raise SolverError(
                f"a variable was set for the first time since t = {saved.time:.12g} s: what it was is lost"
            )
        of.moved.put(saved.time, saved.states)
        for key, content in saved.sent.items():
            if of.sent.get(key) != content:  # which leads through Event Mode
                of.put(key, content)
        in_event_mode, _, _ = saved.motion
        if in_event_mode:
            of.moved.enter_event_mode()
        elif of.moved.in_event_mode:
            of.moved.settle()
        of.moved.restore(saved.motion)

    def _demand_whole(self) -> None:
        """Once: a step from here, and again after one under other inputs."""
        if self._probed:
            return
        self._probed, of = True, self._of
        here, h, ends = self._here(None), _SHARE * of.length or _PROBED, list[np.ndarray]()
        for _ in range(2):
            end = of.moved.step(of.reached, of.reached + h).time
            ends.append(np.concatenate([of.moved.states(), of.get_reals(list(self._outputs))]))
            with suppress(FMICallException, SolverError):  # inputs that it cannot stand say nothing of its states
                for (name, references), content in here.sent.items():
                    if self._inputs.issuperset(memoryview(references).cast("I")):
                        of.put((name, references), (np.frombuffer(content) + 1.0).tobytes())
                of.moved.step(end, end + h)
            self._put_back(here)
        apart = np.abs(ends[1] - ends[0]) - _SAME * of.tolerance * np.maximum(np.abs(ends[0]), 1.0)
        if (apart > 0.0).any():
            names = [*(of.moved.state_name(i) for i in range(len(here.states))), *map(repr, self._outputs.values())]
            i = int(np.argmax(apart))
            raise SolverError(
                f"its continuous states are not all of its state: a step from the same ends with {names[i]} at "
                f"{float(ends[0][i])!r}, then at {float(ends[1][i])!r}. It saves no states (canGetAndSetFMUstate), so "
                "that no step can be taken back"
            )


def _set_in(sent: Content) -> set[tuple[str, int]]:
    """Which variables were set, by function and value reference."""
    return {(name, reference) for name, references in sent for reference in memoryview(references).cast("I")}


_WIDTH = 8
"""Bytes of the length at the end of a state in bytes."""


def _written(saved: _Saved) -> bytes:
    """What stands beside, as bytes that end with how many they are."""
    sent = [[name, references.hex(), content.hex()] for (name, references), content in saved.sent.items()]
    beside = {"sent": sent, "motion": saved.motion, "time": saved.time}
    text = json.dumps(beside).encode()
    return text + (len(text) + _WIDTH).to_bytes(_WIDTH, "little")


def _read(text: bytes, held: ctypes.c_void_p, events: int) -> _Saved:
    beside = json.loads(text)
    sent = {(name, bytes.fromhex(references)): bytes.fromhex(content) for name, references, content in beside["sent"]}
    in_event_mode, terminated, next_event = beside["motion"]
    return _Saved(held, np.zeros(0), sent, (in_event_mode, terminated, next_event), beside["time"], events)
