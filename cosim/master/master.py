"""The master: steps the coupled system along an indexed time axis and records.

Time is an index, ``t_k = t0 + k*H``; a row labelled t holds the values at t; an event gives two rows, before and after.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from time import perf_counter

import numpy as np

from cosim.balises.service import BaliseService
from cosim.components.component import TIME_TOLERANCE
from cosim.coupling.plan import Plan
from cosim.errors import RunError
from cosim.master.algorithms.algorithm import Algorithm
from cosim.master.algorithms.gauss_seidel import GaussSeidel
from cosim.master.axis import TimeAxis
from cosim.master.control.fixed import FixedStep
from cosim.master.initialisation import initialise
from cosim.master.system import Row, System
from cosim.results.recorder import Recorder

PROGRESS_INTERVAL = 64


@dataclass
class WallClock:
    """Wall-clock seconds of a run."""

    initialisation: float = 0.0
    stepping: float = 0.0
    recording: float = 0.0


class Master:
    """Runs a prepared plan.

    Args:
        plan: components instantiated, start values set.
        axis: communication points.
        balises: balise service, or None.
        progress: called now and then with the time reached [s].
        algorithm: makes the algorithm for the plan; Gauss-Seidel by default.
        control: makes the step control for the system; fixed steps by default.

    After `run`, `recorder`, `timing`, `exchange_rounds` and `balises.mailbox.log` hold what came out, also when it failed.

    Raises:
        CouplingError: a receiver is stepped before the watched plant, or is the plant itself.
    """

    def __init__(
        self, plan: Plan, axis: TimeAxis, balises: BaliseService | None = None, progress: Callable[[float], None] | None = None,
        algorithm: Callable[[Plan], Algorithm] = GaussSeidel, control: Callable[[System], FixedStep] = FixedStep,
    ) -> None:  # fmt: skip
        self.plan, self.axis, self.balises = plan, axis, balises
        self.system = System(plan, algorithm(plan), balises)
        self.control = control(self.system)
        self.recorder = Recorder(plan.signals, axis.count + 1)
        self.timing = WallClock()
        self.exchange_rounds = 0
        self.ended_early: str | None = None
        self._progress = progress

    def run(self) -> None:
        """Initialise and step to the end.

        Raises:
            RunError: a component failed; what was recorded so far is kept.
        """
        begin = perf_counter()
        try:
            self.exchange_rounds = initialise(self.plan, self.axis.start, self.axis.stop)
            self.recorder.add(self.axis.start, self.plan.values)
            self._check_finite(self.axis.start)
        finally:
            self.timing.initialisation = perf_counter() - begin
        begin = perf_counter()
        try:
            self._step_all()
        finally:
            self.timing.stepping = perf_counter() - begin - self.timing.recording
            self.system.algorithm.close()

    # -- stepping ---------------------------------------------------------------------------------------------------

    def _step_all(self) -> None:
        axis = self.axis
        for k in range(axis.count):
            t, until = axis[k], axis[k + 1]
            rows = self._step_or_name_the_cause(t, until)
            stopped = self._stopped_at(until)
            if stopped is not None and until - stopped > TIME_TOLERANCE:
                return  # somebody never came to `until`: there are no values of that time to record
            self._record(rows, until)
            self._check_finite(until)
            if stopped is not None:
                return
            if self._progress is not None and k % PROGRESS_INTERVAL == 0:
                self._progress(until)
        if self._progress is not None:
            self._progress(axis.stop)

    def _step_or_name_the_cause(self, t: float, until: float) -> Sequence[Row]:
        """One step; where a component fails because another one handed it NaN, the error names that one."""
        try:
            return self.control.step(t, until)
        except RunError:
            self._check_finite(until)
            raise

    def _stopped_at(self, until: float) -> float | None:
        """When the first component that asked for the end stopped [s]; None where nobody asked."""
        for step in self.plan.steps:
            if step.component.terminated:
                return self._first_stop(until)
        return None

    def _first_stop(self, until: float) -> float:
        asking = [s.component for s in self.plan.steps if s.component.terminated]
        first = min(asking, key=lambda c: c.time)
        self.ended_early = f"Component '{first.name}' asked to terminate at t = {min(first.time, until):g} s."
        return min(first.time, until)

    def _record(self, rows: Sequence[Row], until: float) -> None:
        begin = perf_counter()
        for time, row in rows:
            self.recorder.add(time, row)
        self.recorder.add(until, self.plan.values)
        self.timing.recording += perf_counter() - begin

    # -- checks -----------------------------------------------------------------------------------------------------

    def _check_finite(self, t: float) -> None:
        finite = np.isfinite(self.plan.values)
        if finite.all():
            return
        bad = int(np.argmin(finite))
        name, value = self.plan.signals[bad].name, self.plan.values[bad]
        component = name.partition(".")[0]
        raise RunError(f"Component '{component}' at t = {t:g} s: output {name} is {value}; the run ends here.", component, t)


def close(plan: Plan) -> None:
    """Terminate and free all components; never raises."""
    for step in plan.steps:
        step.component.terminate()
        step.component.free()
