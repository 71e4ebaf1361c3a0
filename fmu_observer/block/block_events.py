"""The events of a block: announced, waiting for their stamp, applied, or too late.

Drives the runtime through them. Knows numbers and names of events, and nothing of value references or of FMI's calls.
"""

from __future__ import annotations

import logging
from collections.abc import Callable, Sequence
from itertools import pairwise
from math import isfinite
from operator import attrgetter

import numpy as np

from fmu_observer.block.block_journal import BlockJournal, Mark, Record, Stamped
from fmu_observer.block.policy import Counters, advance, jump, replay
from fmu_observer.description import STAMP_NOW, exposed_inputs
from fmu_observer.event_protocol import LATE_POLICIES, EventProtocol, LatePolicy
from plant_models.hybrid import HybridSystem, Runtime, width

TIME_TOLERANCE = 1e-9
"""Two communication times closer than this are the same [s]; below any sampling in use, above rounding at 1e5 s."""

QUEUE_CAPACITY = 64
"""Events that can wait at once, as in the exported FMU; one more is lost."""

_log = logging.getLogger(__name__)


EventsMark = tuple[Mark | None, tuple[list[Stamped], list[float], list[int], dict[str, int]] | None]
"""Where the events stood: journal, and queue, stamps, counts seen and counters where something waits; see
`Events.mark`.
"""

NO_MARK: EventsMark = (None, None)
"""That of a system without triggered events."""


class Events:
    """Triggered events of one runtime.

    `stamps`, `counts` and `active` (FMI 3: numbers of the active clocks) are set from outside, as are, before time
    runs, the two parameters in `protocol`: the number of the late policy, from one, and how far back it can go [s].
    `listener` gets what is wrong with an event; where there is none, Python's log is. `seen` are the counts
    already taken notice of, `queue` the events whose stamp lies ahead, `journal` the past for replay, where the policy
    needs it.

    Args:
        system: the hybrid system. runtime: its runtime.
        protocol: start values of the parameters.
    """

    def __init__(self, system: HybridSystem, runtime: Runtime, protocol: EventProtocol) -> None:
        self._start = [float(protocol.policy_number(system.late_policy)), protocol.replay_horizon]
        self.payloads = _payload_positions(system)
        self._names = tuple(self.payloads)
        self._runtime, self._stated = runtime, _stated_positions(system, runtime)
        self.protocol = list(self._start)
        self.stamps = [STAMP_NOW] * len(self._names)
        self.listener: Callable[[str], None] | None = None
        self.counters = Counters()
        self.reset()

    @property
    def late_policy(self) -> LatePolicy:
        """What to do with events stamped in the past."""
        return LATE_POLICIES[round(self.protocol[0]) - 1]

    def reset(self) -> None:
        """Nothing announced, nothing past."""
        count = len(self._names)
        self.protocol[:] = self._start
        self.stamps[:] = [STAMP_NOW] * count
        self.counts, self.seen = [0] * count, [0] * count
        self.active: set[int] = set()
        self.queue: list[Stamped] = []
        vars(self.counters).update(vars(Counters()))
        self.restore_past(())

    def warn(self, text: str, *values: object) -> None:
        """Say what is wrong with an event; `values` are put into the text as a logger does."""
        if self.listener is None:
            _log.warning(text, *values)
        else:
            self.listener(text % values)

    def restore_past(self, records: Sequence[Record]) -> None:
        """Take over what happened so far, where the policy needs it.

        Args:
            records: what happened, in order of time.
        """
        remembers = bool(self._names) and self.late_policy == "replay"
        self.journal = BlockJournal(self.protocol[1], records) if remembers else None

    def mark(self) -> EventsMark:
        """Where the events stand, for `undo`."""
        waiting = None
        if self.queue or self.counts != self.seen:
            waiting = (list(self.queue), list(self.stamps), list(self.seen), dict(vars(self.counters)))
        return (None if self.journal is None else self.journal.mark(), waiting)

    def undo(self, mark: EventsMark) -> None:
        """Forget everything since `mark`."""
        past, waiting = mark
        if self.journal is not None and past is not None:
            self.journal.undo(past)
        if waiting is not None:
            self.queue, self.stamps[:], self.seen, counters = waiting
            vars(self.counters).update(counters)

    def tick(self) -> bool:
        """The events of the active clocks happen, in declared order, their payload in the inputs, their stamp in
        `stamps` (unset:
        now); a stamp ahead waits. Whether there were any."""
        ticked = sorted(self.active)
        self.active.clear()
        for number in ticked:
            self._announce(number)
        self.take_until(self._runtime.t)
        return bool(ticked)

    def poll_counts(self) -> None:
        """FMI 2: a raised ``<event>_count`` announces one event; more than one step up means that events were lost."""
        for number, (count, seen) in enumerate(zip(self.counts, self.seen, strict=True)):
            if count == seen:
                continue
            self.seen[number] = count
            if count > seen:
                self.counters.lost += count - seen - 1
                self._announce(number)
            if count != seen + 1:
                what = "only the last payload is known" if count > seen else "no event is taken from that"
                text = "event %s at t = %s s: the count went from %d to %d; %s"
                self.warn(text, self._names[number], self._runtime.t, seen, count, what)

    def _announce(self, number: int) -> None:
        name = self._names[number]
        stamp = self._runtime.t if self.stamps[number] <= STAMP_NOW else self.stamps[number]
        self.stamps[number] = STAMP_NOW
        if not isfinite(stamp):
            self.counters.lost += 1
            self.warn("event %s: its stamp %r s is not a finite number; it is lost", name, stamp)
            return
        if len(self.queue) >= QUEUE_CAPACITY:
            self.counters.lost += 1
            self.warn("event %s at %r s: %d events are waiting already; this one is lost", name, stamp, QUEUE_CAPACITY)
            return
        positions = self.payloads[name]
        self.queue.append(Stamped(name, stamp, positions, tuple(map(self._runtime.u.item, positions))))
        self.queue.sort(key=attrgetter("stamp"))  # of equal stamps the one announced first stays first

    def take_until(self, end: float) -> None:
        """Move the runtime to the waiting events whose stamps lie before `end` [s] or at it, and through them."""
        while self.queue and self.queue[0].stamp <= end + TIME_TOLERANCE:
            self._take(self.queue.pop(0))

    def _take(self, event: Stamped) -> None:
        runtime = self._runtime
        if event.stamp >= runtime.t - TIME_TOLERANCE:
            advance(runtime, self.journal, event.stamp)
            self.counters.evaluated(jump(runtime, self.journal, event))
        elif self.late_policy == "late":
            self.counters.late += self.counters.evaluated(jump(runtime, None, event))
        else:
            reason, verdict = "late_policy is reject", 0
            if self.journal is not None:
                reason, verdict = replay(runtime, self.journal, event, self._stated, TIME_TOLERANCE)
            if reason:
                self._reject(event, reason)
                return
            self.counters.replayed += self.counters.evaluated(verdict)

    def _reject(self, event: Stamped, reason: str) -> None:
        self.counters.rejected += 1
        text = "event %s: its stamp %r s lies before the current time %r s; it is rejected (%d so far): %s"
        self.warn(text, event.name, event.stamp, self._runtime.t, self.counters.rejected, reason)


def _payload_positions(system: HybridSystem) -> dict[str, tuple[int, ...]]:
    lengths = [width(event.payload) for event in system.triggered_events]
    starts = np.cumsum([width(system.inputs), *lengths]).tolist()
    assert starts[-1] == width(exposed_inputs(system))
    names = [event.name for event in system.triggered_events]
    return {name: tuple(range(a, b)) for name, (a, b) in zip(names, pairwise(starts), strict=True)}


def _stated_positions(system: HybridSystem, runtime: Runtime) -> np.ndarray:
    """Where in the runtime's memory stands what is set from outside: inputs and payloads (not the noises), and
    parameters.
    """
    states, inputs = len(runtime.x), len(runtime.u)
    return np.array(
        [*range(states, states + width(exposed_inputs(system))), *range(states + inputs, len(runtime.memory))],
        dtype=np.intp,
    )
