"""The journal: the recent past of a runtime, so that it can be lived again with one more event in it.

A record is a value that is never changed, so copies of a journal share their records. Knows the runtime, not FMI.
"""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from collections.abc import Iterable
from dataclasses import dataclass
from math import ulp
from operator import attrgetter
from typing import NamedTuple

import numpy as np

from plant_models.hybrid import Runtime

SMALLEST_PRUNING = 256
ROUNDING_ULPS = 4.0  # a master's k*H and the sum t + H at which a step ended differ by so many units in the last place at most


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
    """One thing the runtime did: an advance from `t` to `until` [s], or, with `event`, a jump at `t`.

    `memory` (state, inputs, parameters) and `ticks` are the runtime's before it.
    """

    memory: np.ndarray
    t: float
    until: float
    ticks: tuple[int, ...]
    event: Stamped | None


class Journal:
    """Records of a runtime, oldest first, at least as far back as the horizon.

    Args:
        horizon: how far back a stamp may lie [s].
        records: the first records.
    """

    def __init__(self, horizon: float, records: Iterable[Record] = ()) -> None:
        self.horizon = horizon
        self._records = list(records)
        self._prune_at = max(SMALLEST_PRUNING, 2 * len(self._records))

    @property
    def records(self) -> tuple[Record, ...]:
        """All records, as a value."""
        return tuple(self._records)

    def append(self, runtime: Runtime, until: float, event: Stamped | None = None) -> None:
        """Remember where the runtime stands before it advances to `until` [s] or jumps at `event`."""
        if len(self._records) >= self._prune_at:
            self._prune(runtime.t)
        self._records.append(Record(runtime.memory.copy(), runtime.t, until, tuple(runtime.ticks), event))

    def cut(self, stamp: float, tolerance: float, now: float) -> list[Record]:
        """Take out the record in which `stamp` [s] lies and all that follow.

        Args:
            stamp: an instant before `now`; at the border of two records, to rounding, the later one has it.
            tolerance: how far it may lie before the first record or the horizon [s].
            now: the present [s].

        Returns:
            The records taken out, oldest first; empty where memory does not reach back so far.
        """
        records = self._records
        if stamp < now - self.horizon - tolerance or not records or stamp < records[0].t - tolerance:
            return []
        index = max(0, bisect_right(records, stamp + ROUNDING_ULPS * ulp(stamp), key=attrgetter("t")) - 1)
        taken = records[index:]
        del records[index:]
        return taken

    def _prune(self, now: float) -> None:
        """Forget what ended before the horizon; next time when as much again has been remembered."""
        del self._records[: bisect_left(self._records, now - self.horizon, key=attrgetter("until"))]
        self._prune_at = max(SMALLEST_PRUNING, 2 * len(self._records))
