"""The events of a block: announced, waiting for their stamp, applied, or too late.

Drives the runtime through them. Knows numbers and names of events, and nothing of value references or of FMI's calls.
"""

from __future__ import annotations

import logging
from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from fmu_observer.block.journal import Journal, Record, Stamped
from fmu_observer.block.policy import LATE_POLICIES, Counters, LatePolicy, advance, jump, replay
from fmu_observer.block.variables import BlockError
from fmu_observer.description import STAMP_NOW, exposed_inputs
from plant_models.hybrid import HybridSystem, Runtime, width

TIME_TOLERANCE = 1e-9
"""Two communication times closer than this are the same [s]; below any sampling in use, above rounding at 1e5 s."""

_log = logging.getLogger(__name__)


class Events:
    """Triggered events of one runtime.

    `stamps`, `counts` and `active` (FMI 3: numbers of the active clocks) are set from outside; `seen` are the counts already
    taken notice of, `queue` the events whose stamp lies ahead, `journal` the past for replay, where the policy needs it.

    Args:
        system: the hybrid system. runtime: its runtime.
        late_policy: what to do with events stamped in the past.
        replay_horizon: how far back `replay` can go [s].

    Raises:
        BlockError: the policy is unknown, or the horizon is not a time.
    """

    def __init__(self, system: HybridSystem, runtime: Runtime, late_policy: LatePolicy, replay_horizon: float) -> None:
        if late_policy not in LATE_POLICIES:
            raise BlockError(f"late_policy {late_policy!r} is unknown; use one of {', '.join(LATE_POLICIES)}.")
        if not replay_horizon >= 0.0:
            raise BlockError(f"replay_horizon = {replay_horizon!r} s; expected zero or more seconds.")
        self.late_policy, self.replay_horizon = late_policy, replay_horizon
        self.payloads = _payload_positions(system)
        self._names = tuple(self.payloads)
        self._runtime, self._given = runtime, _given_positions(system, runtime)
        self.stamps = [STAMP_NOW] * len(self._names)
        self.reset()

    def reset(self) -> None:
        """Nothing announced, nothing past."""
        count = len(self._names)
        self.stamps[:] = [STAMP_NOW] * count
        self.counts, self.seen = [0] * count, [0] * count
        self.active: set[int] = set()
        self.queue: list[Stamped] = []
        self.counters = Counters()
        self.restore_past(())

    def restore_past(self, records: Sequence[Record]) -> None:
        """Take over what happened so far, where the policy needs it."""
        remembers = bool(self._names) and self.late_policy == "replay"
        self.journal = Journal(self.replay_horizon, records) if remembers else None

    def advance(self, end: float) -> None:
        """Move the runtime to `end` [s] through the waiting events whose stamps lie before it or at it."""
        if self.queue:
            self._take_until(end)
        advance(self._runtime, self.journal, end)

    def tell(self, number: int) -> None:
        """An event happened: its payload stands in the inputs, its stamp in `stamps` (unset: now). A stamp ahead waits."""
        self._announce(number)
        self._take_until(self._runtime.t)

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
                _log.warning(text, self._names[number], self._runtime.t, seen, count, what)

    def _announce(self, number: int) -> None:
        name = self._names[number]
        stamp = self.stamps[number] if self.stamps[number] > STAMP_NOW else self._runtime.t
        self.stamps[number] = STAMP_NOW
        positions = self.payloads[name]
        self.queue.append(Stamped(name, stamp, positions, tuple(float(self._runtime.u[i]) for i in positions)))
        self.queue.sort(key=lambda e: e.stamp)  # of equal stamps the one announced first stays first

    def _take_until(self, end: float) -> None:
        while self.queue and self.queue[0].stamp <= end + TIME_TOLERANCE:
            self._take(self.queue.pop(0))

    def _take(self, event: Stamped) -> None:
        runtime = self._runtime
        if event.stamp >= runtime.t - TIME_TOLERANCE:
            advance(runtime, self.journal, event.stamp)
            jump(runtime, self.journal, event)
            self.counters.accepted += 1
        elif self.journal is not None and replay(runtime, self.journal, event, self._given, TIME_TOLERANCE):
            self.counters.accepted += 1
            self.counters.replayed += 1
        elif self.late_policy == "late":
            jump(runtime, None, event)
            self.counters.accepted += 1
            self.counters.late += 1
        else:
            self.counters.rejected += 1


def _payload_positions(system: HybridSystem) -> dict[str, tuple[int, ...]]:
    lengths = [width(event.payload) for event in system.triggered_events]
    starts = np.cumsum([width(system.inputs), *lengths]).tolist()
    assert starts[-1] == width(exposed_inputs(system))
    names = [event.name for event in system.triggered_events]
    return {name: tuple(range(a, b)) for name, (a, b) in zip(names, pairwise(starts), strict=True)}


def _given_positions(system: HybridSystem, runtime: Runtime) -> np.ndarray:
    """Where in the runtime's memory stands what is set from outside at any time: inputs proper, and parameters."""
    states, inputs = len(runtime.x), len(runtime.u)
    return np.array([*range(states, states + width(system.inputs)), *range(states + inputs, len(runtime.memory))], dtype=np.intp)
