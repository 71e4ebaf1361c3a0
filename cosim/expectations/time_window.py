"""The part of a run that an expectation speaks of, and whether the run got there. Imports NumPy only."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cosim.evaluation.metrics import FEWEST_INSTANTS
from cosim.expectations.judged import given
from cosim.results.result import Result

ROUNDING = 1e-9  # relative; times closer than this are the same


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
        time, slack = self.result.time, ROUNDING * max(1.0, abs(self.end))
        return np.asarray((time >= self.start - slack) & (time <= self.end + slack))

    @property
    def time(self) -> np.ndarray:
        """Times of its rows [s]."""
        return np.asarray(self.result.time[self.rows])

    @property
    def unreached(self) -> str:
        """What to say where the run did not get to its end."""
        return f"not reached: the run ended at {given(self.reached)} s, before {given(self.end)} s"

    def holds(self, instant: float) -> bool:
        """Whether an instant lies in it."""
        slack = ROUNDING * max(1.0, abs(self.end))
        return self.start - slack <= instant <= self.end + slack


def window_of(result: Result, start: float | None, end: float | None, first: float, last: float) -> TimeWindow:
    """The window of an expectation.

    Args:
        result: the run. start, end: as given in the expectation [s], or None. first, last: where not given [s].
    """
    until = last if end is None else end
    reached = float(result.time[-1]) if len(result.time) else float("-inf")
    short = reached < until - ROUNDING * max(1.0, abs(until))
    broken = short and (end is not None or result.failure is not None)
    fewest = FEWEST_INSTANTS if end is None else 1
    return TimeWindow(result, first if start is None else start, until, reached, broken, fewest)
