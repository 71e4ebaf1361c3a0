"""The recorder: rows of values in one growing array, copied and never looked up."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cosim.results.result import SignalInfo


class Recorder:
    """Rows ``(time, values...)``.

    Args:
        signals: what the values are.
        expected_rows: rows to make room for at first.
    """

    def __init__(self, signals: Sequence[SignalInfo], expected_rows: int) -> None:
        self._signals = list(signals)
        self._rows = np.empty((max(expected_rows, 16), len(self._signals) + 1))
        self.count = 0

    def add(self, t: float, values: np.ndarray) -> None:
        """Copy one row: time [s] and values, shape (n,)."""
        if self.count == len(self._rows):
            self._rows = np.concatenate([self._rows, np.empty_like(self._rows)])
        row = self._rows[self.count]
        row[0] = t
        row[1:] = values
        self.count += 1

    def table(self) -> np.ndarray:
        """The rows as a structured array, ``time`` first."""
        names = ["time", *(s.name for s in self._signals)]
        table = np.empty(self.count, dtype=[(name, np.float64) for name in names])
        for i, name in enumerate(names):
            table[name] = self._rows[: self.count, i]
        return table
