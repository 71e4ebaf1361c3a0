"""The master: steps the coupled system along an indexed time axis and records.

Time is an index, ``t_k = t0 + k*H``; a row labelled t holds the values at t; an event gives two rows, before and after.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence, Set
from dataclasses import dataclass
from functools import partial
from time import perf_counter

import numpy as np

from cosim.balises.service import BaliseService
from cosim.coupling.plan import Plan
from cosim.errors import RunError
from cosim.master.algorithms.algorithm import Algorithm
from cosim.master.algorithms.gauss_seidel import GaussSeidel
from cosim.master.axis import TimeAxis
from cosim.master.control.control import StepControl
from cosim.master.control.fixed import FixedStep
from cosim.master.events.choose import Events, make_coordinator
from cosim.master.initialisation import initialise
from cosim.master.stepper import ChooseStepper, StepperChoice, python_stepper
from cosim.master.system import Checkpoint, Row, System
from cosim.network.service import NetworkService
from cosim.process.last_call import LAST_CALL
from cosim.results.recorder import Recorder
from cosim.results.result import SignalInfo
from fmus.fmi.standard import TIME_TOLERANCE

_PROGRESS_INTERVAL = 64


def _make_finite_check(values: np.ndarray, can_be_missing: np.ndarray) -> Callable[[], bool]:
    """A call that says whether all values are finite, or NaN where one can be missing.

    Args:
        values: shape (n,); looked at anew in each call. The flags are compared as bytes, a quarter of what ``all``
            costs.
        can_be_missing: mask of the values of which NaN says that there is none, shape (n,).
    """
    flags, good, isfinite = bytearray(len(values)), b"\1" * len(values), np.isfinite
    finite = np.frombuffer(flags, dtype=bool)
    some = bool(can_be_missing.any())

    def all_finite() -> bool:
        isfinite(values, out=finite)
        return flags == good or (some and bool((finite | (can_be_missing & np.isnan(values))).all()))

    return all_finite


class _CoordinatedSystem(System):
    """All components of a plan, stepped together from event to event.

    Args:
        plan, algorithm, balises, network: as for `System`.
        events: ``propagate`` events of the components to others, or leave them ``local``.

    `events` is the coordinator, None where none is needed.
    """

    def __init__(
        self,
        plan: Plan,
        algorithm: Algorithm,
        balises: BaliseService | None = None,
        network: NetworkService | None = None,
        events: Events = "propagate",
    ) -> None:
        super().__init__(plan, algorithm, balises, network)
        self.events = make_coordinator(self, events)

    @property
    def meets_events(self) -> bool:
        return self.events is not None and not self.events.all_foreseen

    def start(self, t: float) -> None:
        """All components were initialised at `t` [s]: handle what happens there already.

        Raises:
            RunError: a component failed, or events do not settle.
        """
        if self.events is not None:
            self.events.start(t)

    def advance(self, t: float, until: float) -> Sequence[Row]:
        """As `System.advance`, events of the components on the way included.

        Where a component asks for the end of the run, everybody who can stops there.

        Raises:
            RunError: a component failed, or events do not settle.
        """
        return self.move(t, until) if self.events is None else self.events.advance(t, until)

    def save(self, *, anyway: bool = False) -> Checkpoint:
        checkpoint = super().save(anyway=anyway)
        checkpoint.events = None if self.events is None else self.events.save()
        return checkpoint

    def restore(self, checkpoint: Checkpoint, keep: Set[str] = frozenset()) -> None:
        super().restore(checkpoint, keep)
        if self.events is not None:
            self.events.restore(checkpoint.events)


@dataclass
class _WallClock:
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
        recorder: makes the recorder for signals and an expected number of rows.
        stepper: chooses who executes the plan, Python by default; `cosim.compiled.choice` knows the other one.
        events: of the components: ``propagate`` them to others at the same instant, or leave them ``local``.
        network: over which measurements travel, or None.

    `initialised` is called once when Initialization Mode is over, before an input is set again, `between_steps`
    between two steps, or chunks of the compiled stepper; they may raise KeyboardInterrupt.

    After `run`, `recorder`, `timing`, `exchange_rounds` and `balises.mailbox.log` hold what came out, also when it
    failed.

    Raises:
        CouplingError: a receiver is stepped before the watched plant, or is the plant itself.
    """

    def __init__(
        self,
        plan: Plan,
        axis: TimeAxis,
        balises: BaliseService | None = None,
        progress: Callable[[float], None] | None = None,
        algorithm: Callable[[Plan], Algorithm] = GaussSeidel,
        control: Callable[[System], StepControl] = FixedStep,
        stepper: ChooseStepper = python_stepper,
        recorder: Callable[[Sequence[SignalInfo], int], Recorder] = Recorder,
        events: Events = "propagate",
        network: NetworkService | None = None,
    ) -> None:
        self.plan, self.axis, self.balises = plan, axis, balises
        self.system = _CoordinatedSystem(plan, algorithm(plan), balises, network, events)
        self.control = control(self.system)
        event_rows = 0 if balises is None else balises.expected_rows(axis.start, axis.stop)
        self.recorder = recorder(plan.signals, axis.count + 1 + event_rows)
        self.timing = _WallClock()
        self.exchange_rounds = 0
        self.ended_early: str | None = None
        self._progress = progress
        self._all_finite = _make_finite_check(plan.values, plan.can_be_missing)
        self._stepper: StepperChoice | None = None
        self._choose_stepper = stepper
        self.between_steps: Callable[[], None] | None = None
        self.initialised: Callable[[], None] = lambda: None

    def choose_stepper(self) -> StepperChoice:
        """Choose who executes the plan, where nobody did before; `run` does so too.

        After it no component may be instantiated anew.

        Returns:
            The choice.

        Raises:
            CouplingError: the compiled stepper is demanded and cannot be had; why.
        """
        if self._stepper is None:
            for planned in self.plan.steps:
                planned.component.expect_steps(self.axis.step / planned.substeps, self.axis.start, self.axis.stop)
            self._stepper = self._choose_stepper(self.control, self.axis)
        return self._stepper

    @property
    def stepper(self) -> StepperChoice:
        """Who executes the plan; see `choose_stepper`."""
        return self.choose_stepper()

    def run(self) -> None:
        """Initialise and step to the end.

        Raises:
            CouplingError: as for `choose_stepper`.
            RunError: a component failed; what was recorded so far is kept.
        """
        compiled = self.stepper.compiled
        begin = perf_counter()
        try:
            self.exchange_rounds = initialise(self.plan, self.axis.start, self.axis.announced_stop, self.initialised)
            self.system.start(self.axis.start)
            self.recorder.add(self.axis.start, self.plan.values)
            self._check_finite(self.axis.start)
        finally:
            self.timing.initialisation = perf_counter() - begin
        begin = perf_counter()
        try:
            if self._stopped_at(self.axis.start) is None:
                self._step_all()
        finally:
            LAST_CALL.call[0] = 0
            self.timing.stepping = perf_counter() - begin - self.timing.recording
            if compiled is not None:
                compiled.close()
            self.system.algorithm.close()

    # -- stepping ---------------------------------------------------------------------------------------------------

    def _step_all(self) -> None:
        axis, compiled = self.axis, self.stepper.compiled
        k = 0
        while k < axis.count:
            if self.between_steps is not None:
                self.between_steps()
            step: Callable[[], Sequence[Row]] | None
            if compiled is None:
                step = partial(self.control.step, axis[k], axis[k + 1])
            else:
                chunk = compiled.run(k, self.recorder)
                k, step = k + chunk.done, chunk.finish
                if chunk.suspect:
                    self._check_finite(axis[k])
                if self._progress is not None and chunk.done:
                    self._progress(axis[k])
            if step is None:
                continue
            if not self._step_and_record(step, axis[k + 1]):
                return
            if self._progress is not None and k % _PROGRESS_INTERVAL == 0:
                self._progress(axis[k + 1])
            k += 1
        if self._progress is not None:
            self._progress(axis.stop)

    def _step_and_record(self, step: Callable[[], Sequence[Row]], until: float) -> bool:
        """One step in Python, or what is left of it; whether the run goes on."""
        rows = self._step_or_name_the_cause(step, until)
        stopped = self._stopped_at(until)
        if stopped is not None and until - stopped > TIME_TOLERANCE:
            self._record_events([row for row in rows if row[0] <= stopped + TIME_TOLERANCE])
            return False  # somebody never came to `until`: there are no values of that time to record
        self._record(rows, until)
        self._check_finite(until)
        return stopped is None

    def _step_or_name_the_cause(self, step: Callable[[], Sequence[Row]], until: float) -> Sequence[Row]:
        """One step; where a component fails because another one handed it NaN, the error names that one."""
        try:
            return step()
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
        stopped = min(until, *(c.time for c in asking))
        names = [f"'{c.name}'" for c in asking if c.time - stopped <= TIME_TOLERANCE]
        who = f"Component {names[0]}" if len(names) == 1 else f"Components {', '.join(names[:-1])} and {names[-1]}"
        self.ended_early = f"{who} asked to terminate at t = {stopped:g} s."
        return stopped

    def _record(self, rows: Sequence[Row], until: float) -> None:
        if rows:
            self._record_events(rows)
        begin = perf_counter()
        self.recorder.add(until, self.plan.values)
        self.timing.recording += perf_counter() - begin

    def _record_events(self, rows: Sequence[Row]) -> None:
        begin = perf_counter()
        for time, row in rows:
            self.recorder.add_event(time, row)
        self.timing.recording += perf_counter() - begin

    # -- checks -----------------------------------------------------------------------------------------------------

    def _check_finite(self, t: float) -> None:
        if self._all_finite():
            return
        values = self.plan.values
        bad = int(np.argmin(np.isfinite(values) | (self.plan.can_be_missing & np.isnan(values))))
        name, value = self.plan.signals[bad].name, values[bad]
        component, _, signal = name.partition(".")
        declare = f"can_be_missing = ['{signal}'] in [components.{component}], and filters leave it out"
        text = f"output {name} is {value}; the run ends here."
        for step in self.plan.steps:
            if step.component.name == component and step.component.messages.said_fault:
                raise step.component.failure(text, t)  # it said why itself
        hint = f" If NaN says that a measurement is missing, declare it: {declare}." if np.isnan(value) else ""
        raise RunError(f"Component '{component}' at t = {t:g} s: {text}{hint}", component, t)


def close(plan: Plan) -> None:
    """Terminate and free all components; never raises.

    Args:
        plan: of the run.
    """
    for step in plan.steps:
        step.component.terminate()
        step.component.free()
