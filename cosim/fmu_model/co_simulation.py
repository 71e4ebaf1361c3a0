"""A co-simulation FMU as a model: a state goes in by a restart, a step is one doStep. Touches one instance."""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
from fmpy.fmi1 import FMICallException

from cosim.fmu_model.sealed import FAR, Array, FmuModelError, SealedModel, Way
from fmus.check.checked_instance import SlaveError
from fmus.fmi.instance import shown
from fmus.fmi.native_calls import WARNING, JoinedCalls, prepared_call
from fmus.fmi.ports import is_native
from fmus.fmi.standard import DISCARD

_Slowly = Callable[[float, float, Array], Array]  # (instant [s], length of the step [s], values written) -> read
_Batch = Callable[[float, float, Array, _Slowly], Array]
"""Of instant [s], length of the step [s], what is written before initialisation, shape (N, k), and who does a point in
the ordinary way; gives what is read, shape (N, q).
"""
_Call = tuple[Callable[..., int], tuple[Any, ...], str]


class _Prepared(NamedTuple):
    """Calls of several points, each with memory of its own.

    Attributes:
        written: before initialisation, shape (N, k). read: shape (N, q). calls: of each point, in their order.
    """

    written: Array
    read: Array
    calls: list[list[_Call]]


class _QuickPoints:
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

    def batch(self, names: Sequence[str], *, step: bool) -> _Batch:
        """Restarts at many points, a step from each where one is asked for, and what is read there."""
        kept: dict[int, _Prepared] = {}
        instance, text = self._instance, shown(names)

        def run(t: float, h: float, written: Array, slowly: _Slowly) -> Array:
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

    def _is_plain(self, calls: Sequence[_Call], step: bool) -> bool:
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

    def _prepared(self, count: int, names: Sequence[str], step: bool) -> _Prepared:
        """Calls of `count` points."""
        instance, written, read = self._instance, np.zeros((count, len(self._written))), np.zeros((count, len(names)))
        around = [*self._initialise, *([self._step] if step else [])]
        each = []
        for into, out in zip(written, read, strict=True):
            write = [instance.writer(self._written, into)[0]] if self._written else []
            read_out = [instance.reader(names, out)] if names else []
            each.append(JoinedCalls(instance.slave, [self._reset, *write, *around, *read_out]).steps)
        return _Prepared(written, read, each)

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


def _quicken_restarts(slave: Any, fmi_version: int) -> None:
    """Prepare reset, set-up and both ends of initialisation of an instantiated native slave.

    Arguments and results are those of fmpy's methods.
    """
    prefix, held = f"fmi{fmi_version}", slave.component
    start, stop, size = ctypes.c_double(), ctypes.c_double(), ctypes.c_double()
    flag = ctypes.c_bool if fmi_version == 3 else ctypes.c_int  # how fmpy declares a truth value
    with_tolerance, with_stop = flag(0), flag(1)
    name = f"{prefix}EnterInitializationMode" if fmi_version == 3 else f"{prefix}SetupExperiment"
    begin = prepared_call(slave, name, held, with_tolerance, size, start, with_stop, stop)

    def set_up(tolerance: float | None = None, startTime: float = 0.0, stopTime: float | None = None) -> None:
        with_tolerance.value, size.value = tolerance is not None, tolerance or 0.0
        start.value, with_stop.value, stop.value = startTime, stopTime is not None, stopTime or 0.0
        begin()

    slave.reset = prepared_call(slave, f"{prefix}Reset", held)
    slave.exitInitializationMode = prepared_call(slave, f"{prefix}ExitInitializationMode", held)
    if fmi_version == 3:
        slave.enterInitializationMode = set_up
    else:
        slave.setupExperiment = set_up
        slave.enterInitializationMode = prepared_call(slave, f"{prefix}EnterInitializationMode", held)


class CoSimulationModel(SealedModel):
    """A co-simulation FMU; arguments as for `SealedModel`."""

    way: Way = "restart"
    _quick: _QuickPoints | None = None
    """Restarts as one call each, where the order of the calls is fixed."""
    _steps: _Batch
    _readings: _Batch

    def advance(self, t: float, h: float) -> None:
        """Go on by one communication step, inputs held; its length is handed over as it is, not ``(t + h) - t``."""
        self.instance.expect_steps(h, t, t + h)
        super().advance(t, h)

    def states_after(self, t: float, h: float, points: Array, u: Array) -> Array:  # noqa: D102 - see SealedModel
        if self._quick is None or self._quick.hangs_in:
            return super().states_after(t, h, points, u)
        try:
            return self._steps(t, h, self._values_of(points, u), self._slowly).T
        except SlaveError as error:
            raise self._in_words(error) from error

    def outputs_at(self, t: float, points: Array, u: Array, chosen: Sequence[int] | None = None) -> Array:  # noqa: D102 - see SealedModel
        if self._quick is None or self._quick.hangs_in:
            return super().outputs_at(t, points, u, chosen)
        try:
            found = self._readings(t, 0.0, self._values_of(points, u), self._slowly)
        except SlaveError as error:
            raise self._in_words(error) from error
        return found.T if chosen is None else found.take(chosen, axis=1).T

    def _values_of(self, points: Array, u: Array) -> Array:
        """What is written before initialisation at points, shape (n, N), under inputs, shape (m,) or (m, N)."""
        first, last = len(self._settings), len(self._settings) + len(self.states)
        found = np.empty((points.shape[1], len(self._values)))
        found[:, :first], found[:, first:last], found[:, last:] = self._values[:first], points.T, u.T
        return found

    def _slowly(self, t: float, h: float, written: Array) -> Array:
        """States after a step in the ordinary way from what is written before initialisation, shape (k,)."""
        first, last = len(self._settings), len(self._settings) + len(self.states)
        super()._restart(t, written[first:last], written[last:])
        self.instance.expect_steps(h, t, t + h)
        self.instance.advance(t, t + h)
        self._read_states()
        return self._states_read

    def _restart(self, t: float, x: Array, u: Array) -> None:
        if self._quick is not None:
            self._state_values[:], self._input_values[:] = x, u
            self._quick.restart(t)
            return
        super()._restart(t, x, u)
        if self.way == "step mode":
            self._late_states[:] = x
            self._write_late()

    def _enter(self, t: float) -> None:
        self.instance.enter_initialization(t, t + FAR)
        self.instance.exit_initialization()

    def _demand_settable(self) -> None:
        """States without start values are set in Step Mode after each restart, where the FMU takes them there."""
        stuck = [name for name in self.states if not self._has_start(name)]
        if not stuck:
            return
        self.way = "step mode"
        self._write_late, self._late_states = self.instance.writer(list(self.states))
        self._late_states[:] = self.start
        try:
            self._write_late()
        except SlaveError as error:
            variable = self.instance.variables.element(stuck[0]).variable
            raise FmuModelError(
                f"{self.path}: the state {stuck[0]!r} has no start value that can be set (causality "
                f"{variable.causality}, initial {variable.initial or 'not declared'}), and in Step Mode the FMU "
                f"refuses it ({str(error).rstrip('.')}), so no filter can move it. Name states whose start is exact, "
                "use the model exchange of the FMU where it has one, or a particle filter over saved states, which "
                "selects and moves nothing."
            ) from error

    def _quicken(self) -> None:
        instance = self.instance
        if not is_native(instance.slave):
            return
        _quicken_restarts(instance.slave, instance.fmi_version)
        if instance.has_event_mode or self.way != "restart":
            return  # initialisation ends in calls that depend on what the FMU answers, or is followed by others
        self._quick = quick = _QuickPoints(instance, FAR, self._written, self._write_values)
        self._steps, self._readings = quick.batch(self.states, step=True), quick.batch(self.outputs, step=False)
