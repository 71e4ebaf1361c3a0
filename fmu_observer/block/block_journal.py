"""The journal: the recent past of a runtime, so that it can be lived again with one more event in it.

A record is a value that is never changed, so copies of a journal share their records. Knows the runtime, not FMI.
"""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import partial
from math import ulp
from operator import attrgetter
from typing import NamedTuple

import numpy as np

from fmu_observer.event_protocol import JOURNAL_CAPACITY
from plant_models.hybrid import Runtime

SMALLEST_PRUNING = 256
PRUNING_MARGIN = 1e-6
"""What ended so much before the horizon [s] is out of reach whatever the tolerance."""

# a master's k*H and the sum t + H at which a step ended differ by so many units in the last place at most
ROUNDING_ULPS = 4.0


@dataclass(frozen=True, slots=True)
class Stamped:
    """A triggered event with its payload.

    Args:
        name: the event.
        stamp: when it happened [s].
        positions: positions of the payload in the runtime's `u`.
        payload: values for these positions.
    """

    name: str
    stamp: float
    positions: tuple[int, ...]
    payload: tuple[float, ...]


class Record(NamedTuple):
    """One thing the runtime did: an advance from `t` to a later `until` [s], with `event` a jump at `t`, else a
    communication.

    `memory` (state, inputs, parameters) and `ticks` are the runtime's before it.
    """

    memory: np.ndarray
    t: float
    until: float
    ticks: tuple[int, ...]
    event: Stamped | None


new_record: Callable[[tuple[np.ndarray, float, float, tuple[int, ...], Stamped | None]], Record]
new_record = partial(tuple.__new__, Record)
"""A record of its fields in their order, without a call of Python: a replay makes one for each step."""

Mark = tuple[list[Record], int, int, int]
"""Where a journal stood: its records, how many, the first that counts, when to prune; see `BlockJournal.mark`."""


class BlockJournal:
    """Records of a runtime, oldest first: at least as far back as the horizon, but no more than `JOURNAL_CAPACITY`.

    Args:
        horizon: how far back a stamp may lie [s].
        records: the first records.
    """

    def __init__(self, horizon: float, records: Iterable[Record] = ()) -> None:
        self.horizon = horizon
        self._records = list(records)
        self._first = 0  # of these, the oldest one that counts
        self._prune_at = max(SMALLEST_PRUNING, 2 * len(self._records))

    @property
    def records(self) -> tuple[Record, ...]:
        """All records, as a value."""
        return tuple(self._records[self._first :])

    def append(self, runtime: Runtime, until: float, event: Stamped | None = None) -> None:
        """Remember where the runtime stands before it advances to `until` [s], jumps at `event`, or communicates."""
        if len(self._records) >= self._prune_at:
            self._prune(runtime.t)
        self._records.append(new_record((runtime.memory.copy(), runtime.t, until, tuple(runtime.ticks), event)))
        if len(self._records) - self._first > JOURNAL_CAPACITY:
            self._first += 1

    def extend(self, now: float, records: Sequence[Record]) -> None:
        """Remember what a runtime that stands at `now` [s] has done since the last record, in order of time."""
        if len(self._records) >= self._prune_at:
            self._prune(now)
        self._records += records
        self._first = max(self._first, len(self._records) - JOURNAL_CAPACITY)

    def out_of_reach(self, stamp: float, tolerance: float, now: float) -> str:
        """Why memory does not reach back to `stamp` [s]; empty where it does.

        Args:
            stamp: an instant before `now`.
            tolerance: how far it may lie before the first record or the horizon [s].
            now: the present [s].
        """
        if stamp < now - self.horizon - tolerance:
            return "it lies further back than replay_horizon"
        if len(self._records) == self._first or stamp < self._records[self._first].t - tolerance:
            return "it lies before the first of the steps that are remembered"
        return ""

    def cut(self, stamp: float) -> list[Record]:
        """Take out the record in which `stamp` [s] lies (at the border of two, to rounding, the later) and all that
        follow.

        Returns:
            The records taken out, oldest first.
        """
        records = self._records
        after = bisect_right(records, stamp + ROUNDING_ULPS * ulp(stamp), self._first, key=attrgetter("t"))
        index = max(self._first, after - 1)
        self._records = records[:index]  # the old list stays as it is: a mark may hold it
        return records[index:]

    def mark(self) -> Mark:
        """Where the journal stands, for `undo`."""
        return self._records, len(self._records), self._first, self._prune_at

    def undo(self, mark: Mark) -> None:
        """Forget everything since `mark`."""
        self._records, length, self._first, self._prune_at = mark
        del self._records[length:]

    def _prune(self, now: float) -> None:
        """Forget what ended before the horizon; next time when as much again has been remembered."""
        oldest = now - self.horizon - PRUNING_MARGIN
        self._records = self._records[bisect_left(self._records, oldest, self._first, key=attrgetter("until")) :]
        self._first = 0
        self._prune_at = max(SMALLEST_PRUNING, 2 * len(self._records))
