"""The coordinator: divides a communication step at events, so that all components meet at each of them. Knows the
system.

What is known in advance (time events, ticks of time-based clocks) is where everybody is stepped to. Where a component
returns early, at an event that nobody knew of, the others are taken back and stepped to it as well.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from cosim.balises.service import Row
from cosim.components.component import Component
from cosim.components.recording import RecordingComponent
from cosim.coupling.chain import Mover
from cosim.coupling.plan import Plan
from cosim.coupling.planned import PlannedComponent
from cosim.errors import RunError
from cosim.master.events.participant import Participant
from cosim.master.events.stride import Span, Stride
from cosim.master.system import Checkpoint, System
from fmus.fmi.interruption import EventMet
from fmus.fmi.standard import TIME_TOLERANCE

_MAX_EVENTS_WITHOUT_PROGRESS = 100


_MAX_ROUNDS = 100
_NAMES_SHOWN = 5


class _EventIteration:
    """Takes all participants that are concerned through Event Mode.

    Args:
        plan: the plan. participants: in plan order.

    `count` is the number of instants with an event, `longest` the most super-dense instants that one took.
    """

    def __init__(self, plan: Plan, participants: Sequence[Participant]) -> None:
        self._plan, self._participants = plan, participants
        self.count = self.longest = 0

    def concerns_anybody(self, t: float) -> bool:
        """Whether there is an event at `t` [s]."""
        return any(p.stands_at(t) and (p.wants_event(t) or p.hears()) for p in self._participants)

    def run(self, t: float) -> None:
        """Handle everything that happens at `t` [s]; the values of the plan are those after it.

        Raises:
            RunError: a component failed, or the iteration does not settle; who and what still changes is named.
        """
        members = [p for p in self._participants if p.stands_at(t)]
        values = self._plan.values
        before = earlier = values.copy()
        for round_number in range(1, _MAX_ROUNDS + 1):
            earlier, before = before, values.copy()
            for member in members:
                if member.wants_event(t):
                    member.begin_own_event()
            self._pass_on(members, t)
            busy = [member for member in members if member.needs_update]
            if not busy:
                self._finish(members, round_number - 1)
                return
            for member in busy:
                member.update()
        changed = _differs(earlier, before) | _differs(before, values)
        raise self._unsettled(changed, [m.name for m in members if m.needs_update or m.wants_event(t)], t)

    def _pass_on(self, members: Sequence[Participant], t: float) -> None:
        for _ in range(_MAX_ROUNDS):
            before = self._plan.values.copy()
            news = [member.exchange() for member in members]
            if not any(news):
                return
        raise self._unsettled(_differs(before, self._plan.values), [], t)

    def _finish(self, members: Sequence[Participant], rounds: int) -> None:
        for member in members:
            member.leave()
        self.count += 1
        self.longest = max(self.longest, rounds)

    def _unsettled(self, changed: np.ndarray, busy: Sequence[str], t: float) -> RunError:
        signals = [self._plan.signals[i].name for i in np.flatnonzero(changed)]
        shown = ", ".join(signals[:_NAMES_SHOWN]) + (
            f" and {len(signals) - _NAMES_SHOWN} more" if len(signals) > _NAMES_SHOWN else ""
        )
        names = list(dict.fromkeys([*busy, *(name.partition(".")[0] for name in signals)]))
        still = f"; still changing: {shown}" if signals else "; no output changes any more"
        reason = (
            f"Events at t = {t:g} s do not settle in {_MAX_ROUNDS} rounds{still}; components: {', '.join(names)}. "
            "Look for two components that answer each other for ever, or for an event that is due again at once."
        )
        return RunError(reason, names[0] if names else "", t)


def _differs(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    different: np.ndarray = (a != b) & ~(np.isnan(a) & np.isnan(b))
    return different


class EventCoordinator:
    """Takes a system over a communication step with events on the way.

    Args:
        system: what is stepped. participants: components that take part in events, in plan order; kept.

    `notes` says who cannot take part as it should; `redone` counts parts of steps taken again because of an early
    return.
    """

    def __init__(self, system: System, participants: Sequence[Participant]) -> None:
        self._system, self.participants = system, list(participants)
        self.iteration = _EventIteration(system.plan, participants)
        self.redone = 0
        self._span = Span()
        self._interrupters = [p.component for p in participants if p.interrupts]
        for participant in participants:
            participant.component.coordinated = True
            participant.component.interrupts_from = math.inf
        for step in system.plan.steps:
            if self._interrupters or not step.component.can_vary_step:
                Stride(step, self._span, self._holder(step))
        self.notes = self._remarks()

    @property
    def all_foreseen(self) -> bool:
        """Whether it divides steps at the instants of the network and at events of recordings alone: their times are
        known, and nothing that others do is an event for them.
        """
        return all(isinstance(participant.component, RecordingComponent) for participant in self.participants)

    # -- steps ------------------------------------------------------------------------------------------------------

    def start(self, t: float) -> None:
        """The system was initialised at `t` [s]: what happens there already is handled.

        Raises:
            RunError: as for `advance`.
        """
        for participant in self.participants:
            participant.gate.open()
        if self._network_is_due(t):
            self._system.network.handle(t)  # type: ignore[union-attr] # else nothing of it is due
        if self.iteration.concerns_anybody(t):
            self.iteration.run(t)

    def advance(self, t: float, until: float) -> Sequence[Row]:
        """Bring the system from `t` to `until` [s]; returns the rows before and after events.

        Raises:
            RunError: a component failed, events do not settle, or time stands still.
        """
        rows: list[Row] = []
        now, standing = t, 0
        self._span.end = until
        while True:
            reached, found = self._part(now, self._next_stop(now, until))
            rows += found
            if any(step.component.terminated for step in self._system.plan.steps):
                return (
                    rows if until - reached <= TIME_TOLERANCE else [*rows, (reached, self._system.plan.values.copy())]
                )
            rows += self._handle(reached, until, bool(rows) and reached - rows[-1][0] <= TIME_TOLERANCE)
            ended = any(step.component.terminated for step in self._system.plan.steps)
            if ended or until - reached <= TIME_TOLERANCE:
                return rows
            standing = standing + 1 if reached - now <= TIME_TOLERANCE else 0
            if standing > _MAX_EVENTS_WITHOUT_PROGRESS:
                raise self._stuck(reached)
            now = reached

    @property
    def takes_back(self) -> bool:
        """Whether others are taken back where a component returns early, so that all are saved before each step."""
        return bool(self._interrupters)

    def go_on(self, until: float) -> None:
        """Somebody else has begun a step to `until` [s]."""
        self._span.end = until

    def end(self, until: float, rows: Sequence[Row]) -> Sequence[Row]:
        """Somebody else has brought the system to `until` [s], the end of a step; returns all rows of events in it.

        Args:
            rows: of events on the way.

        Raises:
            RunError: a component failed, or events do not settle.
        """
        if any(step.component.terminated for step in self._system.plan.steps):
            return rows
        return [*rows, *self._handle(until, until, bool(rows) and until - rows[-1][0] <= TIME_TOLERANCE)]

    def summary(self) -> dict[str, Any]:
        """What to report of it after the run, plain data."""
        names = [p.name for p in self.participants]
        iteration = self.iteration
        return {"participants": names, "instants": iteration.count, "longest": iteration.longest, "redone": self.redone}

    # -- state ------------------------------------------------------------------------------------------------------

    def save(self) -> Any:
        """What events change here; the states of the components are saved elsewhere."""
        return [participant.save() for participant in self.participants], self.iteration.count, self.iteration.longest

    def restore(self, state: Any) -> None:
        """Return to what was saved.

        Args:
            state: as `save` gave it.
        """
        participants, self.iteration.count, self.iteration.longest = state
        for participant, saved in zip(self.participants, participants, strict=True):
            participant.restore(saved)

    # -- parts of a step --------------------------------------------------------------------------------------------

    def _next_stop(self, now: float, until: float) -> float:
        """The first instant after `now` at which something is known to happen, or `until` [s]."""
        stop, network = until, self._system.network
        if network is not None and now + TIME_TOLERANCE < network.next_instant < stop:
            stop = network.next_instant
        for participant in self.participants:
            component = participant.component
            if component.time < now - TIME_TOLERANCE or not component.can_vary_step:
                continue  # it has not come here, or does not stop for it
            if now + TIME_TOLERANCE < component.next_event < stop:
                stop = component.next_event
        return stop if until - stop > TIME_TOLERANCE else until

    def _part(self, t: float, stop: float) -> tuple[float, Sequence[Row]]:
        """Everybody from `t` to `stop` or to an event met before it [s]; returns where that is, and rows on the way."""
        for component in self._interrupters:
            component.interrupts_from = t
        saved = self._system.save(anyway=True) if self._interrupters else None
        try:
            reached, rows, met = self._move(t, stop, saved)
        finally:
            if saved is not None:
                self._system.release(saved)
        for participant in self.participants:
            participant.component.event_pending |= participant.component is met
        return reached, rows

    def _move(self, t: float, stop: float, saved: Checkpoint | None) -> tuple[float, Sequence[Row], Component | None]:
        """The same, and who met an event; `saved` is the system at `t`, or None where nobody can be taken back."""
        met: Component | None = None
        while True:
            try:
                rows = self._system.move(t, stop)
            except EventMet as event:
                met = event.component
                if event.time - t <= TIME_TOLERANCE:  # it stands there already, the others come back to it
                    self._back(saved, met, {met.name})
                    return t, (), met
                self._back(saved, met, set())
                stop = event.time
                continue
            ended = self._first_end(stop)
            if ended is None or saved is None or ended.time - t <= TIME_TOLERANCE:
                return stop, rows, met
            met, stop = None, ended.time
            self._back(saved, ended, {ended.name})

    def _back(self, saved: Checkpoint | None, component: Component, keep: set[str]) -> None:
        """All who can, but for `keep`, are taken back to where the part began."""
        self.redone += 1
        if saved is None:
            self._system.plan.find(component.name).read()
        else:
            self._system.restore(saved, keep)

    def _first_end(self, stop: float) -> Component | None:
        """The component that asked for the end of the run before `stop` [s], the first one of several."""
        ended = [
            s.component
            for s in self._system.plan.steps
            if s.component.terminated and stop - s.component.time > TIME_TOLERANCE
        ]
        return min(ended, key=lambda c: c.time, default=None)

    # -- at an event ------------------------------------------------------------------------------------------------

    def _handle(self, t: float, until: float, row_before: bool) -> Sequence[Row]:
        """Handle what happens at `t` [s], and give the rows before and after it; the row of `until` itself is the
        master's.
        """
        packets = self._network_is_due(t)
        if not packets and not self.iteration.concerns_anybody(t):
            return ()
        plan = self._system.plan
        before = plan.values.copy()
        if packets:
            self._system.network.handle(t)  # type: ignore[union-attr] # else nothing of it is due
        if not packets or self.iteration.concerns_anybody(t):
            self.iteration.run(t)
        changed = ~((before == plan.values) | (np.isnan(before) & np.isnan(plan.values)))
        if changed[plan.continuous].any():
            self._system.restart_interpolation(t, changed, np.ones_like(changed))
        first = [] if row_before else [(t, before)]
        if until - t > TIME_TOLERANCE:
            return [*first, (t, plan.values.copy())]
        return first if changed.any() else ()

    def _network_is_due(self, t: float) -> bool:
        network = self._system.network
        return network is not None and network.is_due(t)

    def _stuck(self, t: float) -> RunError:
        names = [p.name for p in self.participants if abs(p.component.time - t) <= TIME_TOLERANCE]
        return RunError(
            f"Time stands still at t = {t:g} s: {_MAX_EVENTS_WITHOUT_PROGRESS} events one after the other without any "
            f"progress; "
            f"components with events: {', '.join(names)}.",
            names[0] if names else "",
            t,
        )

    def _holder(self, step: PlannedComponent) -> Mover | None:
        balises = self._system.balises
        if balises is None or not any(receiver.planned is step for receiver in balises.receivers):
            return None
        return balises.holder(step.component.name)

    # -- what cannot be done ----------------------------------------------------------------------------------------

    def _remarks(self) -> list[str]:
        components = [step.component for step in self._system.plan.steps]
        whole = [c.name for c in components if not c.can_vary_step]
        fixed = [c.name for c in components if not c.can_save]
        notes = []
        if whole:
            notes.append(
                f"Cannot vary the communication step, so events between two communication points reach them at the "
                f"later one: "
                f"{', '.join(whole)}."
            )
        if self._interrupters and fixed:
            names = ", ".join(c.name for c in self._interrupters)
            notes.append(
                f"{names} may return early from a step; components that cannot save their state are not taken back to "
                f"the "
                f"event: {', '.join(fixed)}."
            )
        return notes
