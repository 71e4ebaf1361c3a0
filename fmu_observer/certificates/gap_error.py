"""How an estimation error moves from one sample to the next, exactly: what every kind of sampled error has in common.

An error equation says what flows between samples and how it starts after one; the transition over a gap is one matrix
exponential, no bound and no approximation. The search for certificates (`aperiodic`) sees this interface only.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from functools import lru_cache
from math import inf

import numpy as np

from fmu_observer.certificates.bisection import bisected
from fmu_observer.certificates.matrix_exponential import small_exponential

_SCAN_POINTS = 4000
_DECADES, _DECADE_POINTS = (1000.0, 100.0, 10.0), 400  # parts of the horizon that are scanned finer before it
_SURELY = 1e-6  # growth over a short gap that is no rounding
_BISECTIONS = 40

Rows = tuple[tuple[float, ...], ...]


class GapError(ABC):
    """Error equations of a sampled observer as seen from sample to sample; subclasses are hashable values."""

    @property
    @abstractmethod
    def size(self) -> int:
        """Number of error components that count from sample to sample, n."""

    @property
    @abstractmethod
    def continuous_limit(self) -> np.ndarray | None:
        """Error matrix for infinitely frequent samples, shape (n, n); None where a sample does not leave an error as it
        is.
        """

    @property
    def rate(self) -> float:
        """Natural rate of the closed error equations [1/s]."""
        assert self.continuous_limit is not None, "without a continuous limit a subclass has a rate of its own"
        return max(float(np.abs(np.linalg.eigvals(self.continuous_limit)).max()), 1e-9)

    def units(self, rate: float) -> np.ndarray:
        """Size of the error components relative to the first, shape (n,): the j-th derivative is of the size rate^j."""
        return np.asarray(rate ** np.arange(self.size))

    def comparable(self, other: GapError) -> bool:
        """Whether the components of both are the same, so that one Lyapunov function can be asked of both.

        Args:
            other: the error equation to compare with.
        """
        return type(self) is type(other) and self.size == other.size

    @abstractmethod
    def transition(self, gap: float) -> np.ndarray:
        """Error just before the next sample from the error just before this one, Phi(gap), shape (n, n)."""

    @abstractmethod
    def transitions(self, longest: float, count: int) -> tuple[np.ndarray, np.ndarray]:
        """Transitions at `count` equidistant gaps in (0, longest]: gaps of shape (count,), matrices of shape (count, n,
        n).
        """

    def spectral_radius(self, gap: float) -> float:
        """Factor by which the error grows per sample at a constant gap [1]; stable below 1, inf beyond the range of
        numbers.
        """
        transition = self.transition(gap)
        return float(np.abs(np.linalg.eigvals(transition)).max()) if np.isfinite(transition).all() else inf


class GeneratorError(GapError):
    """A sampled error with one constant generator between samples: the transition is its exponential, closed over a
    sample.
    """

    @property
    @abstractmethod
    def generator(self) -> np.ndarray:
        """Matrix of everything that flows between samples, shape (N, N)."""

    @property
    @abstractmethod
    def reset(self) -> np.ndarray:
        """What a sample makes of it, shape (N, N)."""

    @abstractmethod
    def moved(self, generator: np.ndarray) -> GapError:
        """The same reset with another generator, shape (N, N), as a value that equals others so made."""

    @abstractmethod
    def close(self, exponentials: np.ndarray) -> np.ndarray:
        """Exponentials of shape (count, N, N) as transitions of shape (count, n, n).

        Args:
            exponentials: of the generator, see `GapError`.
        """

    def transition(self, gap: float) -> np.ndarray:
        """Error just before the next sample from the error just before this one, Phi(gap), shape (n, n)."""
        with np.errstate(over="ignore", invalid="ignore"):  # an unstable error may leave the range of numbers
            return np.asarray(self.close(small_exponential(self.generator * gap)[None])[0])

    def transitions(self, longest: float, count: int) -> tuple[np.ndarray, np.ndarray]:
        """Transitions at `count` equidistant gaps in (0, longest]: gaps of shape (count,), matrices of shape (count, n,
        n).
        """
        powers = matrix_powers(small_exponential(self.generator * (longest / count)), count)
        with np.errstate(over="ignore", invalid="ignore"):  # an unstable error may leave the range of numbers
            return longest / count * np.arange(1, count + 1), self.close(powers)


def rows_of(matrix: np.ndarray | None) -> Rows:
    """A matrix as a hashable value; empty where there is none."""
    return () if matrix is None else tuple(tuple(map(float, row)) for row in matrix)


def matrix_powers(step: np.ndarray, count: int) -> np.ndarray:
    """``step^k`` for k = 1 .. count, shape (count, n, n)."""
    powers = np.empty((count, *step.shape))
    powers[0] = step
    filled = 1
    with np.errstate(over="ignore", invalid="ignore"):  # an unstable error may leave the range of numbers
        while filled < count:  # doubling: powers[k + filled] = powers[k] step^filled
            more = min(filled, count - filled)
            powers[filled : filled + more] = powers[:more] @ powers[filled - 1]
            filled += more
    return powers


def first_unstable_gap(vertices: Sequence[GapError], horizon: float) -> float:
    """First constant gap at which some vertex is seen unstable, by scanning (0, horizon] and bisection.

    It is a scan of `_SCAN_POINTS` gaps, and of finer ones up to a thousandth, a hundredth and a tenth of the horizon: a
    window of instability narrower than their distance, as lightly damped errors have, can lie between two of them. What
    is guaranteed is the limit of `aperiodic`.

    Args:
        vertices: error equations. horizon: longest gap searched [s].

    Returns:
        The gap [s]; 0 if samples however frequent do not stabilise, inf if no gap up to the horizon is unstable.
    """
    return min(_first_unstable_gap_of(vertex, horizon) for vertex in vertices)


@lru_cache(maxsize=256)
def _first_unstable_gap_of(vertex: GapError, horizon: float) -> float:
    limit = vertex.continuous_limit
    if limit is not None and np.linalg.eigvals(limit).real.max() >= 0.0:
        return 0.0
    for parts in (*_DECADES, 1.0):
        points = _SCAN_POINTS if parts == 1.0 else _DECADE_POINTS
        gaps, matrices = vertex.transitions(horizon / parts, points)
        finite = np.isfinite(matrices).all(axis=(1, 2))
        radii = np.full(len(gaps), inf)
        radii[finite] = np.abs(np.linalg.eigvals(matrices[finite])).max(axis=1)
        unstable = np.flatnonzero(radii >= (1.0 if parts == 1.0 else 1.0 + _SURELY))
        if unstable.size:
            high = float(gaps[unstable[0]])
            return _boundary(vertex, high - horizon / (parts * points), high)
    return inf


def _boundary(vertex: GapError, low: float, high: float) -> float:
    """Where an error begins to grow between two gaps; 0 where it grows at every one from zero on."""
    stable, unstable = bisected(lambda gap: vertex.spectral_radius(gap) < 1.0, low, high, _BISECTIONS)
    return 0.0 if stable == low and low < 1e-9 * high else unstable
