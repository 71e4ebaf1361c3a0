"""What the judges are given of a run: the result, the roles of its signals, and when it was to begin and to end."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cosim.evaluation.spec import ReportSpec
from cosim.expectations.judged import given
from cosim.expectations.time_window import TimeWindow, window_of
from cosim.results.result import Result


@dataclass(frozen=True)
class JudgedRun:
    """A run to be judged.

    Args:
        result: table, telegrams, summary. spec: roles. start, stop: planned begin and end [s].
    """

    result: Result
    spec: ReportSpec
    start: float
    stop: float

    def window(self, start: float | None, end: float | None, first: float | None = None) -> TimeWindow:
        """The window of an expectation; where nothing is given it begins at `first`, or else with the run [s]."""
        return window_of(self.result, start, end, self.start if first is None else first, self.stop)

    def recorded(self, signal: str) -> np.ndarray:
        """Values of a signal, shape (rows,).

        Raises:
            NotRecordedError: the run has no such column.
        """
        if signal not in (self.result.table.dtype.names or ()):
            raise NotRecordedError(f"nothing measured: {signal} was not recorded")
        return self.result[signal]

    def unit(self, signal: str) -> str:
        """SI unit of a recorded signal."""
        return next((info.unit for info in self.result.signals if info.name == signal), "1")


class NotRecordedError(Exception):
    """What an expectation asks for is not among the results; the text says what."""


def span(start: float | None, end: float | None) -> str:
    """The window as given, to stand behind the name of an expectation; empty for the whole run.

    Args:
        start: of the window [s]; None for the begin of the run.
        end: of the window [s]; None for the end of the run.
    """
    begin = f" from {given(start)}" if start is not None else ""
    until = f" to {given(end)}" if end is not None else ""
    return f",{begin}{until} s" if begin or until else ""
