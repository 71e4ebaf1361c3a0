"""The balise service of a run: the plant is watched, telegrams are sent, receivers are notified, events become rows.

It takes over how the watched plant and the receivers are moved; whoever steps the components need not know of it. The
trajectory of the plant does not depend on whether anybody looks for balises (methods `rollback` and `interpolate`).
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from functools import partial
from math import nan
from operator import attrgetter, itemgetter
from typing import Any

import numpy as np

from cosim.balises.delivery import Delivery, Receiver
from cosim.balises.layout import InstantLayout
from cosim.balises.localiser import Localiser
from cosim.balises.telegram import Channel, Crossing, FalseTelegram, Mailbox
from cosim.coupling.chain import Mover, Position, Stage, around
from cosim.coupling.plan import Plan
from cosim.errors import CouplingError
from cosim.results.result import BaliseRecord
from fmus.fmi.standard import TIME_TOLERANCE

Row = tuple[float, np.ndarray]
Snapshot = tuple[Crossing, np.ndarray]
NO_ROWS: tuple[Row, ...] = ()
REPEATED = "repeated"


_TIME = attrgetter("time")
_NO_MORE = FalseTelegram(np.inf, 0.0)
"""Stands behind the last one."""
_ANNOUNCED, _BACKLOG = attrgetter("announced"), attrgetter("backlog")


class BaliseService:
    """Everything about balises in a run.

    Args:
        localiser: steps the watched plant and finds crossings.
        channel: latency, misses, false telegrams.
        receivers: components that receive telegrams.
        odometer: column of the odometer reading that a telegram carries, or None.
        position: column of the plant's position.

    A telegram that is delivered twice, with the same identity and stamp, counts once: receivers are not notified again.

    After a run `mailbox` holds what was delivered, missed, and still on its way; `passed` counts the balises passed.
    """

    def __init__(
        self, localiser: Localiser, channel: Channel, receivers: Sequence[Receiver], odometer: int | None, position: int
    ) -> None:
        self.localiser, self.channel, self.receivers = localiser, channel, list(receivers)
        self.odometer, self.position = odometer, position
        self.mailbox: Mailbox[BaliseRecord] = Mailbox()
        self.passed = 0
        self._delivered: dict[tuple[str, float], None] = {}  # in the order of delivery
        self._by_name = {r.planned.component.name: r for r in receivers}
        self._false = [*sorted(channel.false_telegrams, key=lambda f: f.time), _NO_MORE]
        self._next_false = 0
        self._t = self._until = nan
        self._snapshots: list[Snapshot] = []
        self._ahead: list[Snapshot] = []
        self._telegrams: list[BaliseRecord] | None = None
        self._deliveries: dict[str, list[Delivery]] = {}

    @property
    def plant(self) -> str:
        """Name of the watched plant."""
        return self.localiser.watch.component.name

    def attach(self, plan: Plan) -> None:
        """Add the stages that find crossings on the way of the plant, and deliver telegrams on that of the receivers.

        Args:
            plan: of the run.

        Raises:
            CouplingError: a receiver is stepped before the watched plant, or is the plant itself.
        """
        self._plan = plan
        self._check_order()
        self._plant = plan.find(self.plant)
        self._plant.add_stage(
            Stage(Position.BALISES, localiser_stage_text(self.localiser.method), move=lambda _: self._move_plant)
        )
        for receiver in self.receivers:
            move = around(partial(self._move_receiver, receiver))
            receiver.planned.add_stage(Stage(Position.BALISES, receiver_stage_text(receiver.timing), move=move))
        plan.services.append(self)

    # -- a step -----------------------------------------------------------------------------------------------------

    def begin(self, t: float, until: float) -> None:
        """A step from `t` to `until` [s] begins."""
        self._t, self._until = t, until
        self._snapshots = []
        if self._ahead:
            self._snapshots = [found for found in self._ahead if found[0].stamp <= until + TIME_TOLERANCE]
            self._ahead = self._ahead[len(self._snapshots) :]
        self._telegrams, self._deliveries = None, {}

    def _move_plant(self, t: float, until: float) -> None:
        self._snapshots += self.localiser.step(t, until)

    def _move_receiver(self, receiver: Receiver, drive: Mover, t: float, until: float) -> None:
        """Step a receiver through what is delivered to it; what it needs of plant and odometer has been stepped
        before.
        """
        if self._telegrams is None and self._something_to_deliver:
            self._telegrams = self._collect(t, until)
        if self._telegrams or receiver.announced or receiver.backlog:
            self._deliveries[receiver.planned.component.name] = receiver.step(t, until, self._telegrams or [])
        else:
            drive(t, until)

    def holder(self, name: str) -> Mover:
        """What to call instead of moving a receiver that waits: telegrams of that time are kept for its next step.

        Args:
            name: of a component.
        """

        def hold(t: float, until: float) -> None:
            if self._telegrams is None and self._something_to_deliver:
                self._telegrams = self._collect(t, until)
            self._deliveries[name] = self._by_name[name].hold_back(t, until, self._telegrams or [])

        return hold

    @property
    def _something_to_deliver(self) -> bool:
        return bool(self._snapshots or self.mailbox.waiting or self._false[self._next_false] is not _NO_MORE)

    def rows(self) -> Sequence[Row]:
        """The step is done: log the telegrams delivered in it.

        Returns:
            Rows before and after each, at the times at which receivers were notified.
        """
        if self._telegrams is None and self._something_to_deliver:
            self._telegrams = self._collect(self._t, self._until)
        return self._event_rows(self._t, self._until, self._telegrams) if self._telegrams else NO_ROWS

    @property
    def notified(self) -> Collection[str]:
        """Names of the receivers on which a telegram may have acted in the last step."""
        return self._deliveries.keys()

    @property
    def idle_until(self) -> float:
        """Up to here [s] nothing is on its way to a receiver; what the plant passes in between is not known
        beforehand.
        """
        if any(map(_ANNOUNCED, self.receivers)) or any(map(_BACKLOG, self.receivers)):
            return -np.inf
        first = self.mailbox.waiting[0].delivered_at if self.mailbox.waiting else np.inf
        return min(first, self._false[self._next_false].time)

    # -- steps done by somebody else ---------------------------------------------------------------------------------

    def expected_rows(self, start: float, stop: float) -> int:
        """Rows of events in a run from `start` to `stop` [s], where the layout states how many; else none."""
        layout = self.localiser.layout
        return 2 * len(layout.within(start, stop)) if isinstance(layout, InstantLayout) else 0

    @property
    def has_nothing_found(self) -> bool:
        """Whether no crossing is known that lies ahead of the receivers."""
        return not self._ahead

    def delivered_elsewhere(self, crossing: Crossing, odometer_reading: float, outcomes: Mapping[str, str]) -> None:
        """Somebody else did a step in which a balise was passed and all receivers were notified at once.

        Args:
            crossing: of the balise. odometer_reading: there. outcomes: what became of the telegram, by receiver.
        """
        self.mailbox.log.append(self.channel.transmit(crossing, self.passed, odometer_reading, outcomes))
        self.passed += 1

    # -- state ------------------------------------------------------------------------------------------------------

    def save(self) -> Any:
        """What a step changes here."""
        mailbox = list(self.mailbox.waiting), len(self.mailbox.log)
        receivers = [r.save() for r in self.receivers]
        passed = self.passed, len(self._delivered)
        return mailbox, passed, self._next_false, self.localiser.save(), receivers, list(self._ahead)

    def restore(self, state: Any) -> None:
        """Return to a saved state."""
        (waiting, logged), (self.passed, delivered), self._next_false, localiser, receivers, ahead = state
        while len(self._delivered) > delivered:
            self._delivered.popitem()
        self._ahead = list(ahead)
        self.mailbox.waiting = list(waiting)
        del self.mailbox.log[logged:]
        self.localiser.restore(localiser)
        for receiver, saved in zip(self.receivers, receivers, strict=True):
            receiver.restore(saved)

    def restore_but_plant(self, state: Any) -> None:
        """Return to a saved state without the plant, which stays ahead of it: what it has passed is not found a second
        time.
        """
        found, localiser = [*self._snapshots, *self._ahead], self.localiser.save()
        self.restore(state)
        self.localiser.restore(localiser)
        self._ahead = found

    def save_within(self) -> Any:
        """The same in the middle of a step, with what the step has brought so far."""
        telegrams = None if self._telegrams is None else list(self._telegrams)
        return self.save(), list(self._snapshots), telegrams, dict(self._deliveries)

    def restore_within(self, state: Any) -> None:
        """Return to the middle of the step.

        Args:
            state: as `save` gave it.
        """
        saved, snapshots, telegrams, deliveries = state
        self.restore(saved)
        self._snapshots, self._deliveries = list(snapshots), dict(deliveries)
        self._telegrams = None if telegrams is None else list(telegrams)

    # -- telegrams --------------------------------------------------------------------------------------------------

    def _collect(self, t: float, until: float) -> list[BaliseRecord]:
        """Post the crossings of this step, and take what is delivered within it."""
        for crossing, _ in self._snapshots:
            self.mailbox.post(self.channel.transmit(crossing, self.passed, self._odometer_at(crossing.stamp, t, until)))
            self.passed += 1
        while self._false[self._next_false].time <= until + TIME_TOLERANCE:
            self.mailbox.post(self._false_telegram(self._false[self._next_false], t, until))
            self._next_false += 1
        return [e for e in self.mailbox.due(until + TIME_TOLERANCE) if not self._is_repeated(e)]

    def _is_repeated(self, telegram: BaliseRecord) -> bool:
        """Whether it was delivered before, which is only logged. One of no balise has no identity."""
        key = telegram.identity, telegram.stamp
        if telegram.kind == "false" or key not in self._delivered:
            self._delivered[key] = None
            return False
        self.mailbox.delivered(telegram, dict.fromkeys(self._by_name, REPEATED))
        return True

    def _false_telegram(self, false: FalseTelegram, t: float, until: float) -> BaliseRecord:
        stamp = max(false.time, t)
        own = float(self._mixed(stamp, t, until, slice(None), self._plan.values)[self.position])
        position = self.localiser.watch.metres(own)
        reading = self._odometer_at(stamp, t, until)
        return BaliseRecord(stamp, stamp, "false", position + false.offset, position, 0.0, reading, "false")

    def _odometer_at(self, time: float, t: float, until: float) -> float:
        if self.odometer is None:
            return nan
        column = slice(self.odometer, self.odometer + 1)
        return float(self._mixed(time, t, until, column, self._plan.values[column])[0])

    # -- rows -------------------------------------------------------------------------------------------------------

    def _event_rows(self, t: float, until: float, telegrams: Sequence[BaliseRecord]) -> list[Row]:
        at_stamp = {crossing.stamp: outputs for crossing, outputs in self._snapshots}
        rows: list[Row] = []
        for i, telegram in enumerate(telegrams):
            deliveries = {name: several[i] for name, several in self._deliveries.items()}
            nominal = min(max(telegram.delivered_at, t), until)
            times = sorted(set(map(_TIME, deliveries.values()))) or [nominal]
            late = times[0] - telegram.delivered_at > TIME_TOLERANCE
            logged = replace(telegram, delivered_at=times[0]) if late else telegram
            outcomes = self.mailbox.delivered(logged, {name: d.outcome for name, d in deliveries.items()})
            for name, delivery in deliveries.items():
                delivery.logged_in(outcomes, name)
            for time in times:
                rows += self._pair(time, t, until, deliveries, at_stamp.get(telegram.delivered_at))
        return sorted(rows, key=itemgetter(0))

    def _pair(
        self, time: float, t: float, until: float, deliveries: dict[str, Delivery], plant_there: np.ndarray | None
    ) -> list[Row]:
        """The rows before and after one telegram; the latter only where it is not the row of the communication
        point.
        """
        end = self._plan.values.copy()
        for name in deliveries:
            end[self._by_name[name].planned.columns] = self._by_name[name].arrived
        before = self._mixed(time, t, until, slice(None), end)
        if plant_there is not None and time < until:
            before[self._plant.columns] = plant_there
        after = before.copy()
        for name, delivery in deliveries.items():
            columns = self._by_name[name].planned.columns
            if delivery.time == time and delivery.before is not None:
                before[columns] = delivery.before
            if delivery.time == time and delivery.after is not None:
                after[columns] = delivery.after
        return [(time, before), (time, after)] if until - time > TIME_TOLERANCE else [(time, before)]

    def _mixed(self, time: float, t: float, until: float, columns: slice, end: np.ndarray) -> np.ndarray:
        if until - time <= TIME_TOLERANCE:
            return end.copy()
        start = self._plan.start[columns]
        share = max((time - t) / (until - t), 0.0)
        return np.where(self._plan.continuous[columns], start + share * (end - start), start)

    # -- checks -----------------------------------------------------------------------------------------------------

    def _check_order(self) -> None:
        order = [s.component.name for s in self._plan.steps]
        for name in self._by_name:
            if name == self.plant:
                raise CouplingError(
                    f"{name}: the watched plant cannot receive its own balises; take it off the receivers."
                )
            if order.index(name) < order.index(self.plant):
                raise CouplingError(f"{name} receives balises, so it must be stepped after the plant '{self.plant}'.")


def localiser_stage_text(method: str) -> str:
    """The stage of the watched plant in words; `method`: of localisation, or when it is chosen."""
    return f"balise localiser ({method})"


def receiver_stage_text(timing: str) -> str:
    """The stage of a receiver in words; `timing`: ``exact`` or ``stale``."""
    return f"balise receiver ({timing})"
