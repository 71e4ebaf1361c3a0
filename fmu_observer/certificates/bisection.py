"""Bisection between a value at which something holds and one at which it does not."""

from __future__ import annotations

from collections.abc import Callable
from math import inf


def bisected(
    holds: Callable[[float], bool], low: float, high: float, most: float = inf, width: float = 0.0, least: float = 0.0
) -> tuple[float, float]:
    """The bracket between the largest value found at which something holds and the smallest at which it does not.

    Args:
        holds: at a value. low, high: the bracket to begin with; neither end is asked for.
        most: bisections. width: of the bracket, relative to `high`, at which it ends. least: value of `high` at which
            it ends.
    """
    done = 0
    while done < most and high - low > width * high and high > least:
        middle = 0.5 * (low + high)
        low, high = (middle, high) if holds(middle) else (low, middle)
        done += 1
    return low, high
