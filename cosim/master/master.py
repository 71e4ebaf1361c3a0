"""The master: steps the plan along an indexed time axis, delivers balises at their own instants, records.

Time is an index, ``t_k = t0 + k*H``; a row labelled t holds the values at t; an event gives two rows, before and after. The
trajectory of the plant does not depend on whether anybody looks for balises (methods `rollback` and `interpolate`).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from math import nan
from time import perf_counter

import numpy as np

from cosim.balises.localise import Localiser
from cosim.balises.telegram import Channel, FalseTelegram, Mailbox, Passing
from cosim.components.component import TIME_TOLERANCE
from cosim.coupling.plan import Plan
from cosim.errors import CouplingError, RunError
from cosim.master.delivery import Delivery, Receiver
from cosim.master.initialisation import initialise
from cosim.results.recorder import Recorder
from cosim.results.result import BaliseRecord

PROGRESS_INTERVAL = 64
Row = tuple[float, np.ndarray]
Snapshot = tuple[Passing, np.ndarray]
NO_ROWS: tuple[Row, ...] = ()


@dataclass(frozen=True)
class TimeAxis:
    """Communication points ``t_k = start + k * step``, k = 0 ... count, the last one included.

    Args:
        start: [s]. step: [s]. count: number of steps.
    """

    start: float
    step: float
    count: int

    def __getitem__(self, k: int) -> float:
        return self.start + k * self.step

    @property
    def stop(self) -> float:
        """The last communication point [s]."""
        return self[self.count]


@dataclass
class BaliseService:
    """Everything about balises in a run.

    Args:
        localiser: steps the watched plant and finds passings.
        channel: latency, misses, false telegrams.
        receivers: components that are told.
        odometer: column of the odometer reading that a telegram carries, or None.
        position: column of the plant's position.
        mailbox: telegrams on their way, and the log of all others.
        passed: number of balises passed so far; each is in the log or still on its way.
    """

    localiser: Localiser
    channel: Channel
    receivers: list[Receiver]
    odometer: int | None
    position: int
    mailbox: Mailbox = field(default_factory=Mailbox)
    passed: int = 0

    @property
    def plant(self) -> str:
        """Name of the watched plant."""
        return self.localiser.watch.component.name


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

    After `run`, `recorder`, `timing`, `exchange_rounds` and `balises.mailbox.log` hold what came out, also when it failed.

    Raises:
        CouplingError: a receiver is stepped before the watched plant, or is the plant itself.
    """

    def __init__(
        self, plan: Plan, axis: TimeAxis, balises: BaliseService | None = None, progress: Callable[[float], None] | None = None
    ) -> None:
        self.plan, self.axis, self.balises = plan, axis, balises
        self.recorder = Recorder(plan.signals, axis.count + 1)
        self.timing = WallClock()
        self.exchange_rounds = 0
        self.ended_early: str | None = None
        self._progress = progress
        self._plant = None if balises is None else plan.find(balises.plant)
        self._receivers = {} if balises is None else {r.planned.component.name: r for r in balises.receivers}
        watched = len(plan.steps) if self._plant is None else plan.steps.index(self._plant)
        self._upstream, self._downstream = plan.steps[:watched], plan.steps[watched + 1 :]
        self._busy = False
        self._previous = np.zeros_like(plan.values)
        self._false = [] if balises is None else sorted(balises.channel.false_telegrams, key=lambda f: f.time)
        self._check_order()

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

    # -- stepping ---------------------------------------------------------------------------------------------------

    def _step_all(self) -> None:
        axis = self.axis
        for k in range(axis.count):
            t, until = axis[k], axis[k + 1]
            self._previous[:] = self.plan.values
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
        """`_step`; where a component fails because another one handed it NaN, the error names that one."""
        try:
            return self._step(t, until)
        except RunError:
            self._check_finite(until)
            raise

    def _step(self, t: float, until: float) -> Sequence[Row]:
        """Step all components; returns the event rows within the step."""
        for step in self._upstream:
            step.step(t, until)
        if self.balises is None:
            return NO_ROWS
        snapshots = self.balises.localiser.step(t, until)
        if snapshots or self.balises.mailbox.waiting or self._false or self._busy:
            return self._step_with_telegrams(t, until, snapshots)
        for step in self._downstream:
            step.step(t, until)
        return NO_ROWS

    def _step_with_telegrams(self, t: float, until: float, snapshots: Sequence[Snapshot]) -> Sequence[Row]:
        """Step what comes after the plant, receivers through what is delivered to them in this step."""
        telegrams: list[BaliseRecord] | None = None
        told: dict[str, list[Delivery]] = {}
        for step in self._downstream:
            receiver = self._receivers.get(step.component.name)
            if receiver is None:
                step.step(t, until)
                continue
            if telegrams is None:
                telegrams = self._collect(snapshots, t, until)
            if telegrams or receiver.busy:
                told[step.component.name] = receiver.step(t, until, telegrams)
            else:
                step.step(t, until)
        if telegrams is None:
            telegrams = self._collect(snapshots, t, until)
        self._busy = any(receiver.busy for receiver in self._receivers.values())
        return self._event_rows(t, until, telegrams, snapshots, told) if telegrams else NO_ROWS

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

    # -- balises ----------------------------------------------------------------------------------------------------

    def _collect(self, snapshots: Sequence[Snapshot], t: float, until: float) -> list[BaliseRecord]:
        """Post the passings of this step, and take what is delivered within it."""
        balises = self.balises
        assert balises is not None
        for passing, _ in snapshots:
            balises.mailbox.post(balises.channel.transmit(passing, balises.passed, self._odometer_at(passing.stamp, t, until)))
            balises.passed += 1
        while self._false and self._false[0].time <= until + TIME_TOLERANCE:
            balises.mailbox.post(self._false_telegram(self._false.pop(0), t, until))
        return balises.mailbox.due(until + TIME_TOLERANCE)

    def _false_telegram(self, false: FalseTelegram, t: float, until: float) -> BaliseRecord:
        balises = self.balises
        assert balises is not None
        stamp = max(false.time, t)
        position = float(self._interpolate(stamp, t, until)[balises.position]) * balises.localiser.watch.position_scale
        reading = self._odometer_at(stamp, t, until)
        return BaliseRecord(stamp, stamp, "false", position + false.offset, position, 0.0, reading, "false")

    def _odometer_at(self, time: float, t: float, until: float) -> float:
        assert self.balises is not None
        column = self.balises.odometer
        return nan if column is None else float(self._interpolate(time, t, until)[column])

    # -- rows -------------------------------------------------------------------------------------------------------

    def _event_rows(
        self, t: float, until: float, telegrams: Sequence[BaliseRecord], snapshots: Sequence[Snapshot],
        told: dict[str, list[Delivery]],
    ) -> list[Row]:  # fmt: skip
        """Log the telegrams; rows before and after each, at the times at which receivers were told."""
        assert self.balises is not None
        at_stamp = {passing.stamp: outputs for passing, outputs in snapshots}
        rows: list[Row] = []
        for i, telegram in enumerate(telegrams):
            deliveries = {name: several[i] for name, several in told.items()}
            nominal = min(max(telegram.delivered_at, t), until)
            times = sorted({d.time for d in deliveries.values()}) or [nominal]
            late = times[0] - telegram.delivered_at > TIME_TOLERANCE
            logged = replace(telegram, delivered_at=times[0]) if late else telegram
            self.balises.mailbox.delivered(logged, {name: d.outcome for name, d in deliveries.items()})
            for time in times:
                rows += self._pair(time, t, until, deliveries, at_stamp.get(telegram.delivered_at))
        return sorted(rows, key=lambda row: row[0])

    def _pair(
        self, time: float, t: float, until: float, deliveries: dict[str, Delivery], plant_there: np.ndarray | None
    ) -> list[Row]:
        """The rows before and after one telegram; the latter only where it is not the row of the communication point."""
        before = self._interpolate(time, t, until)
        if plant_there is not None and self._plant is not None and time < until:
            before[self._plant.columns] = plant_there
        after = before.copy()
        for name, delivery in deliveries.items():
            columns = self._receivers[name].planned.columns
            before[columns] = after[columns] = self._mixed(time, t, until, columns, self._receivers[name].arrived)
            if delivery.time == time and delivery.before is not None:
                before[columns] = delivery.before
            if delivery.time == time and delivery.after is not None:
                after[columns] = delivery.after
        return [(time, before), (time, after)] if until - time > TIME_TOLERANCE else [(time, before)]

    def _interpolate(self, time: float, t: float, until: float) -> np.ndarray:
        """Values at an instant within the step: linear between its ends, discrete ones held."""
        return self._mixed(time, t, until, slice(None), self.plan.values)

    def _mixed(self, time: float, t: float, until: float, columns: slice, end: np.ndarray) -> np.ndarray:
        if until - time <= TIME_TOLERANCE:
            return end.copy()
        start = self._previous[columns]
        share = (time - t) / (until - t)
        return np.where(self.plan.continuous[columns], start + share * (end - start), start)

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

    def _check_order(self) -> None:
        order = [s.component.name for s in self.plan.steps]
        for name in self._receivers:
            assert self.balises is not None
            if name == self.balises.plant:
                raise CouplingError(f"{name}: the watched plant cannot be told of its own balises; take it off the receivers.")
            if order.index(name) < order.index(self.balises.plant):
                raise CouplingError(f"{name} is told of balises, so it must be stepped after the plant '{self.balises.plant}'.")


def close(plan: Plan) -> None:
    """Terminate and free all components; never raises."""
    for step in plan.steps:
        step.component.terminate()
        step.component.free()
