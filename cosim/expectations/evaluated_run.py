"""What expectations see of a run: the result, the roles of its signals, the part of its time that counts, and when it
was to begin and to end.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cosim.evaluation.metrics import FEWEST_INSTANTS
from cosim.evaluation.spec import ReportSpec
from cosim.expectations.evaluated import written
from cosim.results.result import Result
from cosim.results.shown_unit import ShownUnit

_ROUNDING = 1e-9  # relative; times closer than this are the same


@dataclass(frozen=True)
class TimeWindow:
    """An interval of a run, both ends included.

    Args:
        result: the run. start, end: what the expectation speaks of [s]. reached: when the run ended [s].
        broken: whether the run ended before `end` and the expectation asked for more: it failed, or `end` was given.
        fewest: instants that it must hold to be judged; one is enough where the expectation says when it ends.
    """

    result: Result
    start: float
    end: float
    reached: float
    broken: bool
    fewest: int = FEWEST_INSTANTS

    @property
    def rows(self) -> np.ndarray:
        """Which rows of the table lie in it, shape (rows,)."""
        time, slack = self.result.time, _ROUNDING * max(1.0, abs(self.end))
        return np.asarray((time >= self.start - slack) & (time <= self.end + slack))

    @property
    def time(self) -> np.ndarray:
        """Times of its rows [s]."""
        return np.asarray(self.result.time[self.rows])

    @property
    def unreached(self) -> str:
        """What to say where the run did not get to its end."""
        return f"not reached: the run ended at {written(self.reached)} s, before {written(self.end)} s"

    def holds(self, instant: float) -> bool:
        """Whether an instant lies in it."""
        slack = _ROUNDING * max(1.0, abs(self.end))
        return self.start - slack <= instant <= self.end + slack


def _window_of(result: Result, start: float | None, end: float | None, first: float, last: float) -> TimeWindow:
    """The window of an expectation.

    Args:
        result: the run. start, end: as given in the expectation [s], or None. first, last: where not given [s].
    """
    until = last if end is None else end
    reached = float(result.time[-1]) if len(result.time) else float("-inf")
    short = reached < until - _ROUNDING * max(1.0, abs(until))
    broken = short and (end is not None or result.failure is not None)
    fewest = FEWEST_INSTANTS if end is None else 1
    return TimeWindow(result, first if start is None else start, until, reached, broken, fewest)


@dataclass(frozen=True)
class EvaluatedRun:
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
        return _window_of(self.result, start, end, self.start if first is None else first, self.stop)

    def recorded(self, signal: str) -> np.ndarray:
        """Values of a signal, shape (rows,).

        Raises:
            NotRecordedError: the run has no such column.
        """
        if signal not in (self.result.table.dtype.names or ()):
            raise NotRecordedError(f"nothing measured: {signal} was not recorded")
        return self.result[signal]

    def shown(self, signal: str) -> ShownUnit:
        """The unit in which texts name values of a recorded signal, as pages, tables and pictures do."""
        return next((info.shown for info in self.result.signals if info.name == signal), ShownUnit())


class NotRecordedError(Exception):
    """What an expectation asks for is not among the results; the text says what."""


def span(start: float | None, end: float | None) -> str:
    """The window as given, to stand behind the name of an expectation; empty for the whole run.

    Args:
        start: of the window [s]; None for the begin of the run.
        end: of the window [s]; None for the end of the run.
    """
    begin = f" from {written(start)}" if start is not None else ""
    until = f" to {written(end)}" if end is not None else ""
    return f",{begin}{until} s" if begin or until else ""
