"""How many runs a claim about a rate needs, said before the first, and when to stop that may be asked after every run.
SciPy.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import ceil, log, log1p

import scipy

from cosim.statistics.intervals import proportion
from cosim.statistics.spread import LEVEL, Spread
from fmus.tables.numbers import number

_MOST = 10**12  # runs that nobody does


def runs_needed(rate: float, half_width: float, level: float = LEVEL) -> int:
    """Runs after which a rate is known to half the width of its exact interval (`proportion`), if it is as expected.

    Args:
        rate: expected [1]; 0.5 needs most. half_width: wanted [1]. level: of confidence [1].

    Raises:
        ValueError: the rate is not between 0 and 1, or the width not above 0.
    """
    if not (0.0 <= rate <= 1.0 and half_width > 0.0):
        raise ValueError(f"runs_needed({rate}, {half_width}): expected a rate from 0 to 1 and a width above 0.")
    return _smallest(lambda runs: _width(proportion(ceil(rate * runs), runs, level)) <= 2.0 * half_width)


def runs_to_show_below(limit: float, failures: int = 0, level: float = LEVEL) -> int:
    """Runs that show that a rate lies below a limit, if no more fail than that: ``P(K <= failures) <= 1 - level`` for
    binomial K of the limit. Without a failure about ``3 / limit`` at 95 %, the rule of three.

    Args:
        limit: of the rate [1], between 0 and 1. failures: that may occur among them. level: of confidence [1].

    Raises:
        ValueError: the limit is not between 0 and 1, or the failures are fewer than none.
    """
    if not 0.0 < limit < 1.0 or failures < 0:
        raise ValueError(f"runs_to_show_below({limit}, {failures}): expected a limit between 0 and 1, failures from 0.")
    return _smallest(
        lambda runs: runs > failures and float(scipy.special.bdtr(failures, runs, limit)) <= 1.0 - level,
    )


def anytime_proportion(count: int, trials: int, level: float = LEVEL, expected: float = 0.5) -> Spread:
    """A share of runs with an interval that holds at all numbers of runs together, so that one may look after each and
    stop when one likes. It is wider than `proportion`, which holds at one number of runs that was fixed before.

    The rates p at which the mixture ``B(a + k, b + n - k) / B(a, b) / (p^k (1 - p)^(n - k))`` has stayed below
    ``1 / (1 - level)``; that is a martingale for the true p, and passes the limit with probability ``1 - level`` at
    most (Ville): Robbins, Annals of Mathematical Statistics 41 (1970) 1397. Beta(a, b) has ``a = 1/2`` and the mean
    `expected`; whatever it is the interval holds, near it it is shortest.

    Args:
        count: k, runs in which it was so. trials: n, all so far. level: of confidence [1].
        expected: where the interval shall be shortest [1], chosen before the first run.

    Returns:
        The share [1]; all that is possible without a run.
    """
    if trials < 1:
        return Spread(float("nan"), 0.0, 1.0)
    a, b = 0.5, 0.5 * (1.0 / expected - 1.0)
    passes = -log(1.0 - level) - float(scipy.special.betaln(a + count, b + trials - count) - scipy.special.betaln(a, b))

    def beyond(p: float) -> float:
        return -count * (log(p) if count else 0.0) - (trials - count) * (log1p(-p) if count < trials else 0.0) - passes

    share, least, most = count / trials, 1e-300, 1.0 - 1e-16
    ends = {"xtol": 1e-300, "rtol": 1e-10}
    low = float(scipy.optimize.brentq(beyond, least, share, **ends)) if count else 0.0
    high = float(scipy.optimize.brentq(beyond, share or least, most, **ends)) if count < trials else 1.0
    return Spread(share, low, high, count)


@dataclass(frozen=True)
class RateGoal:
    """Until when runs are done: until the rate of a failure is known, or shown to lie below a limit.

    It may be asked after every run; that costs none of the confidence (`anytime_proportion`).

    Args:
        half_width: to which the rate shall be known [1]; None for no such goal.
        below: limit below which it shall be shown, or be shown not to lie [1]; None for no such goal.
        level: of confidence [1].
    """

    half_width: float | None = None
    below: float | None = None
    level: float = LEVEL

    def __post_init__(self) -> None:
        stated = [value for value in (self.half_width, self.below) if value is not None]
        if not stated or not all(0.0 < value < 1.0 for value in stated):
            raise ValueError(
                f"RateGoal({self.half_width}, {self.below}): expected a half-width or a limit between 0 and 1."
            )

    def interval(self, failures: int, runs: int) -> Spread:
        """The rate so far, with its interval.

        Args:
            failures: so far. runs: so far.
        """
        return anytime_proportion(failures, runs, self.level, self.below or 0.5)

    def reached(self, failures: int, runs: int) -> str:
        """What is known now that was asked for; empty while nothing is.

        Args:
            failures: so far. runs: so far.
        """
        found = self.interval(failures, runs)
        if self.below is not None and found.high < self.below:
            return f"shown below {number(self.below)}: {found.text()} after {runs} runs"
        if self.below is not None and found.low > self.below:
            return f"shown above {number(self.below)}: {found.text()} after {runs} runs"
        if self.half_width is not None and _width(found) <= 2.0 * self.half_width:
            return f"known to {number(self.half_width)}: {found.text()} after {runs} runs"
        return ""

    def runs(self, rate: float = 0.0) -> int:
        """Runs after which the goal is reached if the rate is as expected; said before the first.

        Args:
            rate: expected [1]; 0 for no failure.
        """
        return _smallest(lambda runs: bool(self.reached(ceil(rate * runs), runs)))


def _width(found: Spread) -> float:
    return found.high - found.low


def _smallest(holds: Callable[[int], bool]) -> int:
    """The smallest whole number from which on something holds, by doubling and halving."""
    high = 1
    while not holds(high):
        high *= 2
        if high > _MOST:
            raise ValueError(f"This cannot be shown by {_MOST:.0e} runs; a rate that equals its limit never is.")
    low = high // 2
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (low, middle) if holds(middle) else (middle, high)
    return high
