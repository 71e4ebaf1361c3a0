"""Delivery: a receiver is stepped through the telegrams that reach it within a communication step.

What a receiver allows decides how. It is stopped at the instant where it can be. It is notified beforehand with a stamp
where it cannot, and too late where the run asks for that.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np

from cosim.balises.event_message import EventMessage
from cosim.balises.telegram import payload
from cosim.coupling.planned import PlannedComponent
from cosim.results.result import BaliseRecord
from fmus.fmi.described import EventPort
from fmus.fmi.standard import TIME_TOLERANCE

Timing = Literal["exact", "stale"]
_Deliverable = BaliseRecord | EventMessage
"""What receivers are notified of: telegrams of balises, and messages of others with an event of their own."""

OUTCOMES = (
    "ignored",
    "doubted",
    "replayed",
    "late",
    "rejected",
    "accepted",
)  # of several that changed at once the first one says most


@dataclass
class Delivery:
    """What one telegram did to one receiver.

    Args:
        time: when the receiver was notified [s].
        before, after: its outputs before and after, shape (q,); None where it could not be stopped there.
        outcome: what became of it: ``accepted``, ``replayed``, ``late``, ``rejected``, ``doubted`` (and used),
            ``ignored``, or ``notified`` where that is not known.
    """

    time: float
    before: np.ndarray | None = None
    after: np.ndarray | None = None
    outcome: str = "notified"
    _logged: tuple[dict[str, str], str] | None = None

    def logged_in(self, outcomes: dict[str, str], receiver: str) -> None:
        """From now on an outcome that becomes known later is written there too.

        Args:
            outcomes: by receiver, of the log. receiver: to which this was delivered.
        """
        self._logged = outcomes, receiver

    def settle(self, outcome: str) -> None:
        """The outcome has become known.

        Args:
            outcome: see the attribute.
        """
        self.outcome = outcome
        if self._logged is not None:
            outcomes, receiver = self._logged
            outcomes[receiver] = outcome


_StepThrough = Callable[[float, float, Sequence[Any]], list[Delivery]]
"""Steps a receiver from one time to another [s] through telegrams; what became of each."""


@dataclass
class Receiver:
    """A planned component that declares the balise event, or another one by which it is notified of something.

    An FMI 2 receiver acts on a telegram in the step that follows, and knows one telegram for each step. A telegram of
    this very instant is therefore announced before the step that ends there (`announced`); of telegrams that must not
    be announced together the later ones wait in `backlog` for the next step.

    Args:
        planned: the component in the plan.
        event: name of its event for balises; an `EventMessage` names its own.
        timing: ``exact`` uses a telegram at its own instant; ``stale`` hands it over unshifted at the next
            communication point, as a master without events would (for comparison only).
        compiled: the compiled stepper's way over a step with telegrams, where there is one.
    """

    planned: PlannedComponent
    event: str = "balise"
    timing: Timing = "exact"
    seen: dict[str, int] = field(default_factory=dict)
    backlog: list[_Deliverable] = field(default_factory=list)
    arrived: np.ndarray = field(default_factory=lambda: np.zeros(0))
    compiled: _StepThrough | None = None
    announced: bool = False
    _open: list[Delivery] = field(default_factory=list)
    _kept: dict[int, Delivery] = field(default_factory=dict)

    @property
    def busy(self) -> bool:
        """Whether something delivered or held back earlier still has to be seen to."""
        return bool(self.backlog or self.announced)

    def save(self) -> Any:
        """What it remembers from step to step; the component's own state is saved elsewhere."""
        return dict(self.seen), list(self.backlog), self.announced, list(self._open), dict(self._kept)

    def restore(self, state: Any) -> None:
        """Return to what was saved.

        Args:
            state: as `save` gave it.
        """
        seen, backlog, self.announced, unsettled, kept = state
        self.seen, self.backlog = dict(seen), list(backlog)
        self._open, self._kept = list(unsettled), dict(kept)

    def step(self, t: float, until: float, telegrams: Sequence[_Deliverable]) -> list[Delivery]:
        """Step from `t` to `until` [s] with the prepared inputs through `telegrams`, in order of delivery.

        Args:
            t: where the component stands [s]. until: end of the step [s]. telegrams: delivered within the step.

        Afterwards `arrived` holds the outputs on reaching `until`, before it was notified there, shape (q,).

        Returns:
            What became of each telegram, in the same order.
        """
        return (self.compiled or self.step_in_python)(t, until, telegrams)

    def step_in_python(self, t: float, until: float, telegrams: Sequence[_Deliverable]) -> list[Delivery]:
        """As `step`, without the compiled stepper's way through a single telegram.

        Args:
            t: start of the step [s]. until: end of the step [s].
        """
        self.planned.send(t, until)
        if not self.announced:
            self._open.clear()
        waiting, self.backlog = self.backlog, []
        if self.timing == "stale":
            return self._step_then_notify(t, until, telegrams)
        if not self.planned.component.can_vary_step:
            return self._notify_then_step(t, until, [*waiting, *telegrams])[len(waiting) :]
        return self._step_through(t, until, [*waiting, *telegrams])[len(waiting) :]

    def hold_back(self, t: float, until: float, telegrams: Sequence[_Deliverable]) -> list[Delivery]:
        """Keep telegrams of a part of a step, from `t` to `until` [s], that the component does not take: its next step
        has them.

        Returns:
            A delivery for each, in the same order.
        """
        self.arrived = self.planned.outputs.copy()
        return [self._put_off(telegram, snapped(telegram.delivered_at, t, until)) for telegram in telegrams]

    def notify(self, t: float, message: EventMessage) -> Delivery:
        """Notify of a message at `t` [s], where all components have come to; one that has not, or that knows one
        message for each step, is notified in its next step.

        Args:
            t: the instant [s]. message: delivered there.
        """
        component = self.planned.component
        if abs(component.time - t) > TIME_TOLERANCE or self.announced:
            return self._put_off(message, t)
        if not component.event_needs_step:
            self._open.clear()
        self.announced = component.event_needs_step
        return self._notify_here(t, message, message.stamp)

    def stepped_elsewhere(self, delivery: Delivery, arrived: np.ndarray) -> None:
        """Somebody else has stepped it through one telegram, all as `step` would have done.

        Args:
            delivery: what became of it. arrived: the outputs on reaching the end of the step, shape (q,).
        """
        self._open[:] = [delivery]
        self.arrived = arrived

    # -- a receiver that can be stopped anywhere --------------------------------------------------------------------

    def _step_through(self, t: float, until: float, telegrams: Sequence[_Deliverable]) -> list[Delivery]:
        now = t
        deliveries: list[Delivery] = []
        arrived = None
        for telegram in telegrams:
            notified_at = snapped(telegram.delivered_at, now, until)
            deliveries.append(self._deliver(now, notified_at, telegram))
            if notified_at == until and arrived is None:
                arrived = deliveries[-1].before
            now = notified_at
        if until > now:
            self._advance(now, until)
            self.planned.read()
        self.arrived = self.planned.outputs.copy() if arrived is None else arrived
        return deliveries

    def _deliver(self, now: float, notified_at: float, telegram: _Deliverable) -> Delivery:
        component = self.planned.component
        if not component.event_needs_step:
            if notified_at > now:
                self._advance(now, notified_at)
            return self._notify_here(notified_at, telegram, telegram.stamp)
        on_time = abs(telegram.stamp - notified_at) <= TIME_TOLERANCE
        if on_time and notified_at > now and not self.announced:
            return self._announce(now, notified_at, telegram)
        if notified_at > now:
            self._advance(now, notified_at)
        if self.announced:
            return self._put_off(telegram, notified_at)
        self.announced = True
        return self._notify_here(notified_at, telegram, telegram.stamp)

    def _notify_here(self, t: float, telegram: _Deliverable, stamp: float) -> Delivery:
        before = self._outputs()
        delivery = Delivery(t, before, before)
        self._notify(t, telegram, stamp, delivery)
        delivery.after = self._outputs()
        return delivery

    def _announce(self, now: float, notified_at: float, telegram: _Deliverable) -> Delivery:
        """FMI 2: the event happens at the end of the step from `now` to `notified_at` [s]."""
        delivery = Delivery(notified_at, self._step_ahead(now, notified_at))
        self._notify(now, telegram, min(telegram.stamp, notified_at), delivery)
        self._advance(now, notified_at)
        delivery.after = self._outputs()
        return delivery

    def _step_ahead(self, now: float, notified_at: float) -> np.ndarray | None:
        """Outputs at `notified_at` [s] without the event, where going there and back is known to leave no trace."""
        component = self.planned.component
        if not component.restores_exactly:
            return None
        state = component.save()
        try:
            self.planned.advance(now, notified_at)
            outputs = self._outputs()
            component.restore(state)
            return outputs
        finally:
            component.release(state)

    # -- a receiver that takes whole steps only ---------------------------------------------------------------------

    def _notify_then_step(self, t: float, until: float, telegrams: Sequence[_Deliverable]) -> list[Delivery]:
        """Stamps inside the coming step notify the receiver of what it may not be stopped for; without them it is
        notified late.
        """
        if any(self._port(telegram).stamp is None for telegram in telegrams):
            return self._step_then_notify(t, until, telegrams)
        at_once = 1 if self.planned.component.event_needs_step else len(telegrams)
        times = [snapped(telegram.delivered_at, t, until) for telegram in telegrams]
        deliveries = [Delivery(time) for time in times[:at_once]]
        for telegram, delivery in zip(telegrams, deliveries, strict=False):
            self._notify(t, telegram, telegram.stamp, delivery)
        deliveries += [self._put_off(*one) for one in zip(telegrams[at_once:], times[at_once:], strict=True)]
        self._advance(t, until)
        self.arrived = self._outputs()
        return deliveries

    def _step_then_notify(self, t: float, until: float, telegrams: Sequence[_Deliverable]) -> list[Delivery]:
        """Whatever was passed in the step is delivered at its end, as if it had happened there."""
        self._advance(t, until)
        self.arrived = self._outputs()
        # the last payload replaces the others
        known = telegrams[-1:] if self.planned.component.event_needs_step else telegrams
        overwritten = len(telegrams) - len(known)
        self.announced = bool(known) and self.planned.component.event_needs_step
        return [Delivery(until, self.arrived, self.arrived, "rejected") for _ in range(overwritten)] + [
            self._notify_here(until, telegram, until) for telegram in known
        ]

    # -- internals --------------------------------------------------------------------------------------------------

    def _port(self, telegram: _Deliverable) -> EventPort:
        event = telegram.event if isinstance(telegram, EventMessage) else self.event
        return self.planned.component.events[event]

    def _advance(self, now: float, until: float) -> None:
        self.planned.advance(now, until)
        self.announced = False
        self._note_outcome()

    def _outputs(self) -> np.ndarray:
        self.planned.read()
        return self.planned.outputs.copy()

    def _put_off(self, telegram: _Deliverable, time: float) -> Delivery:
        """The next step has it; what becomes of it there settles this delivery of `time` [s]."""
        self.backlog.append(telegram)
        return self._kept.setdefault(id(telegram), Delivery(time))

    def _notify(self, t: float, telegram: _Deliverable, stamp: float, delivery: Delivery) -> None:
        self.planned.component.notify(self._port(telegram), t, stamp, payload(telegram))
        self._open.append(delivery)
        if id(telegram) in self._kept:
            self._open.append(self._kept.pop(id(telegram)))  # what was promised when it was put into the backlog
        if not self.planned.component.event_needs_step:  # else nothing has happened yet
            self._note_outcome()

    def _note_outcome(self) -> None:
        """What the receiver's own counters say of the telegrams that it got and has not reported on yet."""
        counts = self.planned.component.outcomes()
        if counts is None or counts == self.seen:
            return
        seen, self.seen = self.seen, dict(counts)
        for name in OUTCOMES:
            if counts.get(name, 0) > seen.get(name, 0):
                for delivery in self._open:
                    delivery.settle(name)
                self._open.clear()
                return


def snapped(delivered_at: float, now: float, until: float) -> float:
    """Time of delivery within ``[now, until]`` [s], on an end where it is too near for a step in between.

    Args:
        delivered_at: instant of delivery [s].
    """
    notified_at = min(max(delivered_at, now), until)
    if until - notified_at <= TIME_TOLERANCE:
        return until
    return now if notified_at - now <= TIME_TOLERANCE else notified_at
