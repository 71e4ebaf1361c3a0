"""What a filter did, so that a late measurement is taken in where it belongs: the belief before each step and what
followed. Knows beliefs only.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from cosim.fmu_filter.belief import FmuBelief, FmuFilter

Array = NDArray[np.float64]
EQUAL_WITHIN = 1e-9
"""Instants within this are one [s]."""


@dataclass(frozen=True, eq=False)
class _JournalEntry:
    """One thing that a filter did.

    Attributes:
        before: the belief before it. t: instant [s]. u: inputs, shape (m,).
        h: length of a prediction [s]; 0 for a measurement.
        seen: outputs that were measured. y: their values, shape (k,). R: covariance, shape (k, k).
    """

    before: FmuBelief
    t: float
    u: Array
    h: float = 0.0
    seen: Sequence[int] = ()
    y: Array | None = None
    R: Array | None = None


class FilterJournal:
    """A filter with a memory of the last seconds.

    Args:
        engine: the filter. belief: at the start. t: start [s]. horizon: how long entries are kept [s].
    """

    def __init__(self, engine: FmuFilter, belief: FmuBelief, t: float, horizon: float) -> None:
        self._engine, self._horizon = engine, horizon
        self.belief, self.t = belief, t
        self._entries: list[_JournalEntry] = []

    def predict(self, h: float, u: Array) -> None:
        """Go on.

        Args:
            h: how far [s]. u: inputs, held, shape (m,).
        """
        self._done(_JournalEntry(self.belief, self.t, u.copy(), h=h))
        oldest = self.t - self._horizon - EQUAL_WITHIN
        while self._entries and self._entries[0].t + self._entries[0].h < oldest:
            self._entries.pop(0)

    def correct(self, stamp: float, u: Array, seen: Sequence[int], y: Array, R: Array) -> bool:
        """Take a measurement in, at its stamp: a late one is put where it belongs, and what followed is done again.

        Args:
            stamp: when it was true [s]. u: inputs of now, shape (m,). seen: outputs that were measured.
            y: their values, shape (k,). R: covariance, shape (k, k).

        Returns:
            Whether it was taken; one from before the horizon is not.
        """
        if stamp >= self.t - EQUAL_WITHIN:
            self._done(_JournalEntry(self.belief, self.t, u.copy(), seen=tuple(seen), y=y.copy(), R=R))
            return True
        place = next(
            (i for i, e in enumerate(self._entries) if e.h > 0.0 and e.t <= stamp < e.t + e.h - EQUAL_WITHIN), None
        )
        if place is None:
            return False
        split, rest = self._entries[place], self._entries[place + 1 :]
        del self._entries[place:]
        self.belief, self.t = split.before, split.t
        if stamp > split.t + EQUAL_WITHIN:
            self._do(replace(split, h=stamp - split.t))
        self._do(_JournalEntry(self.belief, stamp, split.u, seen=tuple(seen), y=y.copy(), R=R))
        self._do(replace(split, h=split.t + split.h - stamp))
        for entry in rest:
            self._do(entry)
        return True

    def _do(self, entry: _JournalEntry) -> None:
        self._done(replace(entry, before=self.belief, t=self.t))

    def _done(self, entry: _JournalEntry) -> None:
        """What an entry that begins here and now does."""
        self._entries.append(entry)
        if entry.y is None:
            self.belief = self._engine.predict(self.belief, self.t, entry.h, entry.u)
            self.t += entry.h
        else:
            assert entry.R is not None
            self.belief = self._engine.correct(self.belief, self.t, entry.u, entry.seen, entry.y, entry.R)

    def state(self) -> tuple[FmuBelief, float, tuple[_JournalEntry, ...]]:
        """What to keep in order to return here."""
        return self.belief, self.t, tuple(self._entries)

    def restore(self, state: tuple[FmuBelief, float, tuple[_JournalEntry, ...]]) -> None:
        """Return.

        Args:
            state: from `state`.
        """
        self.belief, self.t, entries = state
        self._entries = list(entries)
