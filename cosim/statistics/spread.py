"""A number of many runs with its interval. Standard library only."""

from __future__ import annotations

from dataclasses import dataclass
from math import isnan, nan

from fmus.tables.numbers import DASH
from fmus.tables.numbers import number as number_text

LEVEL = 0.95


@dataclass(frozen=True)
class Spread:
    """A measure over runs.

    Args:
        value: mean, quantile, share or rate; NaN where there is none.
        low, high: ends of its confidence interval; NaN where there are too few runs.
        count: runs that have the measure, or what was counted.
        needed: runs from which on there is an interval; 0 where there is one, or where it depends on more.
    """

    value: float
    low: float = nan
    high: float = nan
    count: int = 0
    needed: int = 0

    def text(self, factor: float = 1.0, digits: int = 3) -> str:
        """The value, and the interval where there is one.

        Args:
            factor: what the numbers are multiplied by. digits: significant ones.
        """
        if isnan(self.value):
            return DASH
        value, low, high = (number_text(factor * x, digits) for x in (self.value, self.low, self.high))
        if not (isnan(self.low) or isnan(self.high)):
            return f"{value} ({low} to {high})"
        return f"{value} (interval needs at least {self.needed} runs)" if self.needed else value
