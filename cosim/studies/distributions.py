"""Distributions that what is varied is drawn from: each takes a share of its probability to a value. Knows no
scenarios.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import ceil, exp, floor, inf, isfinite, log, sqrt
from typing import Any, Literal, Protocol

import numpy as np
import scipy

from cosim.errors import ScenarioError


class Distribution(Protocol):
    """What values are drawn from."""

    def at(self, share: float) -> Any:
        """The value below which this share of the probability lies, of a list the entry.

        Args:
            share: from 0 to 1, 1 excluded.
        """

    def scaled(self, factor: float, offset: float) -> Distribution:
        """The same in another unit: all values times a factor, plus an offset.

        Args:
            factor: above zero. offset: in the new unit.
        """


@dataclass(frozen=True)
class Range:
    """A range to take points from, both ends included where the numbers are whole.

    Args:
        low, high: its ends. kind: ``uniform``, ``log`` (uniform in the logarithm) or ``whole`` (whole numbers).
    """

    low: float
    high: float
    kind: Literal["uniform", "log", "whole"] = "uniform"

    def __post_init__(self) -> None:
        if not (isfinite(self.low) and isfinite(self.high) and self.low < self.high):
            raise ScenarioError(
                f"A range needs two finite ends, the lower one first (got {self.low!r} and {self.high!r})."
            )
        if self.kind == "log" and not self.low > 0.0:
            raise ScenarioError(f"A logarithmic range begins above zero (got {self.low!r}).")

    def at(self, share: float) -> float | int:
        """The point at a share of the range.

        Args:
            share: from 0 to 1, 1 excluded.
        """
        if self.kind == "log":
            return exp(log(self.low) + share * (log(self.high) - log(self.low)))
        if self.kind == "whole":
            return floor(self.low + share * (self.high - self.low + 1))
        return self.low + share * (self.high - self.low)

    def scaled(self, factor: float, offset: float) -> Range:
        """In another unit, whole numbers no more."""
        kind: Literal["uniform", "log", "whole"] = "log" if self.kind == "log" and offset == 0.0 else "uniform"
        if kind != self.kind:
            raise ScenarioError(
                f"A range of the kind {self.kind!r} takes no other unit; state it in the unit there is."
            )
        return Range(factor * self.low + offset, factor * self.high + offset, kind)


def uniform(low: float, high: float) -> Range:
    """All numbers from `low` to `high`, equally likely."""
    return Range(float(low), float(high))


def log_uniform(low: float, high: float) -> Range:
    """All numbers from `low` to `high`, every factor equally likely."""
    return Range(float(low), float(high), "log")


def whole(low: int, high: int) -> Range:
    """All whole numbers from `low` to `high`, both included, equally likely."""
    return Range(low, high, "whole")


@dataclass(frozen=True)
class Normal:
    """Normal values, of which those outside of two ends are never drawn.

    Args:
        mean, deviation: of the normal distribution before it is cut. low, high: the ends.
    """

    mean: float
    deviation: float
    low: float = -inf
    high: float = inf

    def __post_init__(self) -> None:
        if not (isfinite(self.mean) and 0.0 < self.deviation < inf):
            raise ScenarioError(
                f"A normal distribution needs a mean, and a deviation above zero "
                f"(got {self.mean!r} and {self.deviation!r})."
            )
        if not self.low < self.high or not self._cut[1] - self._cut[0] > 0.0:
            raise ScenarioError(
                f"A normal distribution of {self.mean!r} and {self.deviation!r} has nothing between {self.low!r} and "
                f"{self.high!r}."
            )

    @property
    def _cut(self) -> tuple[float, float]:
        """Probabilities below both ends."""
        low, high = ((end - self.mean) / self.deviation for end in (self.low, self.high))
        return float(scipy.special.ndtr(low)), float(scipy.special.ndtr(high))

    def at(self, share: float) -> float:
        """The quantile of the cut distribution; a share of 0 is taken for the least above, which is finite."""
        low, high = self._cut
        probability = low + max(share, 2.0**-53) * (high - low)
        value = self.mean + self.deviation * float(scipy.special.ndtri(probability))
        return min(max(value, self.low), self.high)

    def scaled(self, factor: float, offset: float) -> Normal:
        """In another unit."""
        mean, low, high = (factor * value + offset for value in (self.mean, self.low, self.high))
        return Normal(mean, factor * self.deviation, low, high)


@dataclass(frozen=True)
class Triangular:
    """Values between two ends, the likeliest one between them.

    Args:
        low, mode, high: in this order; the mode may be an end.
    """

    low: float
    mode: float
    high: float

    def __post_init__(self) -> None:
        ends = (self.low, self.mode, self.high)
        if not (all(map(isfinite, ends)) and self.low <= self.mode <= self.high and self.low < self.high):
            raise ScenarioError(f"A triangular distribution needs low <= mode <= high, low < high (got {ends!r}).")

    def at(self, share: float) -> float:
        """The quantile."""
        width, left = self.high - self.low, self.mode - self.low
        if share * width < left:
            return self.low + sqrt(share * width * left)
        return self.high - sqrt((1.0 - share) * width * (width - left))

    def scaled(self, factor: float, offset: float) -> Triangular:
        """In another unit."""
        return Triangular(*(factor * value + offset for value in (self.low, self.mode, self.high)))


@dataclass(frozen=True)
class Entries:
    """Entries of a list.

    Args:
        entries: of any kind. weights: how likely each is, in any unit; None for all alike.
    """

    entries: Sequence[Any]
    weights: Sequence[float] | None = None

    def __post_init__(self) -> None:
        weights = self.weights
        if not len(self.entries):
            raise ScenarioError("the list of values is empty.")
        if weights is None:
            return
        if len(weights) != len(self.entries):
            raise ScenarioError(f"{len(self.entries)} entries need as many weights (got {len(weights)}).")
        if not all(0.0 <= weight < inf for weight in weights) or not sum(weights) > 0.0:
            raise ScenarioError(f"weights are numbers from zero on, one of them above it (got {list(weights)!r}).")

    def at(self, share: float) -> Any:
        """The entry in whose part of the probability the share lies."""
        if self.weights is None:
            return self.entries[int(share * len(self.entries))]
        ends = np.cumsum(self.weights)
        return self.entries[int(np.searchsorted(ends, share * ends[-1], side="right"))]

    def scaled(self, factor: float, offset: float) -> Entries:
        """In another unit."""
        return Entries([factor * entry + offset for entry in self.entries], self.weights)


Method = Literal["latin", "random", "sobol"]


def unit_points(method: Method, count: int, dimensions: int, seed: int) -> np.ndarray:
    """Points in the unit cube: independent, of a Latin hypercube, or of a scrambled Sobol sequence. Of the last, and of
    independent ones, fewer points are the first of more.

    Args:
        method: ``random``, ``latin`` or ``sobol``. count: of points. dimensions: of the cube. seed: of the drawing.

    Returns:
        The points, shape (count, dimensions), each number from 0 to 1, 1 excluded.
    """
    if method == "random":
        return np.random.default_rng(seed).random((count, dimensions))
    if method == "latin":
        points = scipy.stats.qmc.LatinHypercube(d=dimensions, seed=seed).random(count)
    else:  # a whole power of two, whose first points are taken: others are not balanced, of which SciPy warns
        sequence = scipy.stats.qmc.Sobol(d=dimensions, seed=seed)
        points = sequence.random_base2(ceil(np.log2(max(count, 1))))[:count]
    return np.minimum(points, np.nextafter(1.0, 0.0))  # type: ignore[no-any-return]
