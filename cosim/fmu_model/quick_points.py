"""Quick points: a reset, initialisation and perhaps a step of a native co-simulation slave to what is read there, as
one call that is prepared once. A filter makes it many times a sample. Touches one slave.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Sequence
from typing import Any

from fmus.fmi.instance import shown
from fmus.fmi.native_calls import joined_calls, prepared_call
from fmus.fmi.standard import DISCARD

Point = Callable[[float, float], bool]  # (instant [s], length of the step [s]) -> whether it was done as asked


class QuickPoints:
    """Restarts of one instance, whose order of calls is fixed.

    Args:
        instance: native co-simulation of FMI 2 or 3, instantiated, without event mode: there initialisation ends in
            calls that depend on what the FMU answers.
        far: time from a restart to the end that is announced [s].
        written: names of start values and inputs. write: writes them before initialisation.
    """

    def __init__(self, instance: Any, far: float, written: Sequence[str], write: Callable[[], None]) -> None:
        self._instance, self._far = instance, far
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

    def point(self, names: Sequence[str], read: Callable[[], None] | None, *, step: bool) -> Point:
        """Reset, values, initialisation, a step where one is asked for, and what is read, in one call.

        Args:
            names: what is read. read: reads it at the end; None for nothing. step: whether a step is made.

        Returns:
            The call. It says False where the step was discarded, ended early or met an event: then do it in the
            ordinary way, which knows what to make of that. It raises what the instance makes of a failure.
        """
        instance, start, stop, length, far = self._instance, self._start, self._stop, self._length, self._far
        flags, words = self._flags, self._words | {self._get: f"reading {shown(names)}"}
        calls = [self._reset, *self._write, *self._initialise, *([self._step] if step else [])]
        run = joined_calls(instance.slave, [*calls, read] if read is not None and names else calls)

        def point(t: float, h: float) -> bool:
            start.value, stop.value, length.value, self._reached.value = t, t + far, h, t + h
            for raised in flags:  # a slave may leave out what it has nothing to say of
                raised.value = False
            instance.note_reset(t)
            try:
                run()
            except instance.mistakes:
                raise
            except Exception as error:
                name = str(getattr(error, "function", ""))
                if name.endswith("DoStep") and getattr(error, "status", None) == DISCARD:
                    return False
                what = next((words[key] for key in words if name.startswith(key)), name or "a restart")
                raise instance.explained(what, error, t if what == "doStep" else None) from error
            instance.note_initialised()
            if not step:
                return True
            instance.time = t + h
            event, terminate, early = flags
            return not (event.value or terminate.value or early.value)

        return point
