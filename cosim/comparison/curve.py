"""One signal of one result as a curve: straight between its rows, or held until the next. NumPy only."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from cosim.errors import ComparisonError

_FEW_VALUES = 16  # a signal of so few whole numbers that mostly stands still is an indicator, a mode or a counter: held


BESIDE = 1e-3
"""Of a step: what is so near to a row is not between two rows."""
ROUNDING, NOISE = 1e-12, 1e-6
"""Shares of the size of a signal: what rounding alone does, and the least range that is taken for one."""


@dataclass(frozen=True)
class Curve:
    """Rows of a signal.

    Args:
        time: [s], shape (n,), never falling; two rows with the same time are before and after an event.
        values: [unit], shape (n,).
        held: whether a value stays until the next row (discrete), else the curve is straight between rows.
    """

    time: np.ndarray
    values: np.ndarray
    held: bool = False

    @cached_property
    def finite(self) -> np.ndarray:
        """Rows that hold a number, shape (n,)."""
        return np.asarray(np.isfinite(self.values))

    @cached_property
    def filled(self) -> np.ndarray:
        """Values with a straight line (or the last number, where held) over rows that hold none, shape (n,)."""
        if self.finite.all() or not self.finite.any():
            return self.values
        rows = np.flatnonzero(self.finite)
        if self.held:
            before = np.searchsorted(rows, np.arange(len(self.values)), side="right") - 1
            return np.asarray(self.values[rows[np.maximum(before, 0)]])
        filled = np.interp(np.arange(len(self.values)), rows, self.values[rows])
        filled[rows] = self.values[rows]
        return np.asarray(filled)

    @cached_property
    def scale(self) -> float:
        """Largest minus smallest value, or a millionth of the largest size if that is more: noise of solvers.

        The largest size where the values are constant but for rounding; zero without any number.
        """
        values = self.values[self.finite]
        if not len(values):
            return 0.0
        size, spread = float(np.max(np.abs(values))), float(np.max(values)) - float(np.min(values))
        return max(spread, NOISE * size) if ROUNDING * size < spread < np.inf else size

    @cached_property
    def share_scale(self) -> float:
        """What a tolerance for all signals is a share of: `scale`, and of whole numbers that are held one at most.

        A fault code, a mode or a counter that is one off is another one, however far its values reach.
        """
        numbers = self.values[self.finite]
        return min(self.scale, 1.0) if self.held and np.array_equal(numbers, np.rint(numbers)) else self.scale

    @cached_property
    def step(self) -> float:
        """Usual distance of two rows [s]."""
        steps = np.diff(self.time)
        steps = steps[steps > 0.0]
        return float(np.median(steps)) if len(steps) else 0.0


def check_time(time: np.ndarray, label: str) -> None:
    """That there are rows, and that time never falls.

    Args:
        time: [s], shape (rows,).
        label: what the result is called in messages.

    Raises:
        ComparisonError: no rows, or the first row that is out of order.
    """
    if not len(time):
        raise ComparisonError(f"{label}: an empty run, it has no rows; there is nothing to compare.")
    wrong = np.flatnonzero(~(np.diff(time, prepend=time[0]) >= 0.0) | ~np.isfinite(time))
    if len(wrong):
        row = int(wrong[0])
        was = "" if row == 0 else f" after {time[row - 1]:.9g} s"
        raise ComparisonError(
            f"{label}: row {row + 1} has the time {time[row]:.9g} s{was}; expected times that never fall."
        )


def is_held(values: np.ndarray) -> bool:
    """Whether a signal that says it is continuous is an indicator: a few whole numbers, most steps without a change.

    Args:
        values: of the signal, shape (rows,).
    """
    values = values[np.isfinite(values)]
    if len(values) < 3 or not np.array_equal(values, np.rint(values)):
        return False
    changes = np.flatnonzero(np.diff(values))
    return 2 * len(changes) < len(values) and len(np.unique(values[np.append(changes, len(values) - 1)])) <= _FEW_VALUES
