"""Quick points: a reset, initialisation and perhaps a step of a native co-simulation slave to what is read there, as
one call that is prepared once. A filter makes it many times a sample. Touches one slave.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
from fmpy.fmi1 import FMICallException
from numpy.typing import NDArray

from fmus.fmi.instance import shown
from fmus.fmi.native_calls import WARNING, JoinedCalls, prepared_call
from fmus.fmi.standard import DISCARD

Array = NDArray[np.float64]
Slowly = Callable[[float, float, Array], Array]  # (instant [s], length of the step [s], values written) -> read
Batch = Callable[[float, float, Array, Slowly], Array]
"""Of instant [s], length of the step [s], what is written before initialisation, shape (N, k), and who does a point in
the ordinary way; gives what is read, shape (N, q).
"""
Call = tuple[Callable[..., int], tuple[Any, ...], str]


class Prepared(NamedTuple):
    """Calls of several points, each with memory of its own.

    Attributes:
        written: before initialisation, shape (N, k). read: shape (N, q). calls: of each point, in their order.
    """

    written: Array
    read: Array
    calls: list[list[Call]]


class QuickPoints:
    """Restarts of one instance, whose order of calls is fixed.

    Args:
        instance: native co-simulation of FMI 2 or 3, instantiated, without event mode: there initialisation ends in
            calls that depend on what the FMU answers.
        far: time from a restart to the end that is announced [s].
        written: names of start values and inputs. write: writes them before initialisation.
    """

    def __init__(self, instance: Any, far: float, written: Sequence[str], write: Callable[[], None]) -> None:
        self._instance, self._far, self._written = instance, far, list(written)
        self._write = [write] if written else []
        slave, three = instance.slave, instance.fmi_version == 3
        prefix, held = f"fmi{instance.fmi_version}", slave.component
        tolerance, words = instance.tolerance_argument()
        flag = ctypes.c_bool if three else ctypes.c_int  # how fmpy declares a truth value
        self._start, self._stop, self._length = ctypes.c_double(), ctypes.c_double(), ctypes.c_double()
        begin = f"{prefix}EnterInitializationMode" if three else f"{prefix}SetupExperiment"
        size = tolerance.get("tolerance")
        arguments = (flag(size is not None), ctypes.c_double(size or 0.0), self._start, flag(1), self._stop)
        self._reset = prepared_call(slave, f"{prefix}Reset", held)
        self._initialise = [prepared_call(slave, begin, held, *arguments)]
        if not three:
            self._initialise.append(prepared_call(slave, f"{prefix}EnterInitializationMode", held))
        self._initialise.append(prepared_call(slave, f"{prefix}ExitInitializationMode", held))
        self._flags = tuple(ctypes.c_bool() for _ in range(3))  # event, terminate, early return
        self._reached = ctypes.c_double()
        results = (*map(ctypes.byref, self._flags), ctypes.byref(self._reached)) if three else ()
        still = ctypes.c_bool(False) if three else ctypes.c_int(0)
        self._step = prepared_call(slave, f"{prefix}DoStep", held, self._start, self._length, still, *results)
        self._words = {
            f"{prefix}Reset": "reset",
            begin: ("enterInitializationMode" if three else "setupExperiment") + words,
            f"{prefix}EnterInitializationMode": "enterInitializationMode" + (words if three else ""),
            f"{prefix}ExitInitializationMode": "exitInitializationMode",
            f"{prefix}DoStep": "doStep",
            f"{prefix}Set": f"writing {shown(written)}",
        }
        self._get = f"{prefix}Get"
        self._restart = JoinedCalls(slave, [self._reset, *self._write, *self._initialise])

    @property
    def hangs_in(self) -> bool:
        """Whether somebody logs the calls or answers in place of the library: then go the ordinary way."""
        return self._restart.hangs_in

    def restart(self, t: float) -> None:
        """Reset, values and initialisation.

        Args:
            t: instant [s].
        """
        self._begin(t, 0.0)
        try:
            self._restart()
        except self._instance.mistakes:
            raise
        except Exception as error:
            raise self._explained(error, "", t) from error
        self._instance.note_initialised()

    def batch(self, names: Sequence[str], *, step: bool) -> Batch:
        """Restarts at many points, a step from each where one is asked for, and what is read there.

        Args:
            names: what is read. step: whether a step is made.

        Returns:
            The call. A point whose step is discarded, ends early or meets an event is given to who knows what to make
            of it. It raises what the instance makes of a failure.
        """
        kept: dict[int, Prepared] = {}
        instance, text = self._instance, shown(names)

        def run(t: float, h: float, written: Array, slowly: Slowly) -> Array:
            count = len(written)
            if count not in kept:
                kept[count] = self._prepared(count, names, step)
            prepared = kept[count]
            prepared.written[:] = written
            self._begin(t, h)
            try:
                apart = [i for i, calls in enumerate(prepared.calls) if not self._is_plain(calls, step)]
                found = prepared.read.copy()
                for i in apart:
                    found[i] = slowly(t, h, written[i])
            except instance.mistakes:
                raise
            except Exception as error:
                raise self._explained(error, text, t) from error
            instance.note_initialised()
            instance.time = t + h
            return found

        return run

    def _is_plain(self, calls: Sequence[Call], step: bool) -> bool:
        """Make the calls of a point; whether its step, if there is one, was done to its end and met no event."""
        for raw, typed, name in calls:
            status = raw(*typed)
            if status > WARNING:
                if status != DISCARD or not name.endswith("DoStep"):
                    raise FMICallException(name, status)
                return False
        event, terminate, early = self._flags
        if step and (event.value or terminate.value or early.value):
            event.value = terminate.value = early.value = False
            return False
        return True

    def _prepared(self, count: int, names: Sequence[str], step: bool) -> Prepared:
        """Calls of `count` points."""
        instance, written, read = self._instance, np.zeros((count, len(self._written))), np.zeros((count, len(names)))
        around = [*self._initialise, *([self._step] if step else [])]
        each = []
        for into, out in zip(written, read, strict=True):
            write = [instance.writer(self._written, into)[0]] if self._written else []
            read_out = [instance.reader(names, out)] if names else []
            each.append(JoinedCalls(instance.slave, [self._reset, *write, *around, *read_out]).steps)
        return Prepared(written, read, each)

    def _begin(self, t: float, h: float) -> None:
        self._start.value, self._stop.value, self._length.value, self._reached.value = t, t + self._far, h, t + h
        for raised in self._flags:  # a slave may leave out what it has nothing to say of
            raised.value = False
        self._instance.note_reset(t)

    def _explained(self, error: Exception, names: str, t: float) -> Exception:
        name = str(getattr(error, "function", ""))
        words = self._words | {self._get: f"reading {names}"}
        what = next((words[key] for key in words if name.startswith(key)), name or "a restart")
        found: Exception = self._instance.explained(what, error, t if what == "doStep" else None)
        return found
