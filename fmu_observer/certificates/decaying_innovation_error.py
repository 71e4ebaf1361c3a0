"""The error of an observer whose sampled innovation decays by ``phi' = -eta phi^a`` until it ends: exact transitions.

``de = drift e - gain phi(s) C e(0)`` over a gap. Since phi is a power of a straight line, the integral of its response
is a series of the drift, the same as that of an exponential but for the coefficients; no quadrature.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from fmu_observer.certificates.gap_error import GapError, Rows, matrix_powers, rows_of
from fmu_observer.certificates.impulsive_error import ImpulsiveError
from fmu_observer.certificates.matrix_exponential import small_exponential

_TERMS = 80
_LARGEST_TURN = 15.0  # of the drift's rate times the decay; beyond it the series loses more than half of its digits


@dataclass(frozen=True)
class DecayingError(GapError):
    """Error equations ``de = drift e - gain phi(s) C e(0)`` with ``phi = max(0, 1 - (1 - a) eta s)^(1/(1 - a))``.

    For a = 1 and for eta = 0 use `decaying_error`, which makes them an `ImpulsiveError`. A hashable value.

    Attributes:
        drift_rows: rows of shape (n, n) [1/s]. gain_rows: rows of shape (n, q). C_rows: rows of shape (q, n).
        rate: eta [1/s], positive. exponent: a, from 0 to below 1.
        levels: how many times each component is differentiated against the first, shape (n,); for scaling.
    """

    drift_rows: Rows
    gain_rows: Rows
    C_rows: Rows
    rate_of_decay: float
    exponent: float
    levels: tuple[int, ...]

    @property
    def size(self) -> int:
        """Number of error components, n."""
        return len(self.drift_rows)

    @cached_property
    def generator(self) -> np.ndarray:
        """The drift, shape (n, n): how a disturbance of the error moves within a gap."""
        return np.asarray(self.drift_rows)

    @cached_property
    def continuous_limit(self) -> np.ndarray:
        """Error matrix for infinitely frequent samples, ``drift - gain C``, shape (n, n)."""
        return np.asarray(self.generator - np.asarray(self.gain_rows) @ np.asarray(self.C_rows))

    @property
    def kept(self) -> np.ndarray:
        """All components count from sample to sample, shape (n, n)."""
        return np.eye(self.size)

    @property
    def spread(self) -> np.ndarray:
        """A sample leaves the error as it is, shape (n, n)."""
        return np.eye(self.size)

    def units(self, rate: float) -> np.ndarray:
        """Size of the components relative to the first, by their levels, shape (n,)."""
        return np.asarray(rate ** np.asarray(self.levels, dtype=float))

    def comparable(self, other: GapError) -> bool:
        """Whether both see the same of the error.

        Args:
            other: the error equation to compare with.
        """
        return isinstance(other, DecayingError) and self.C_rows == other.C_rows

    def moved(self, generator: np.ndarray) -> DecayingError:
        """The same correction with another drift.

        Args:
            generator: the drift, shape (n, n) [1/s].
        """
        return replace(self, drift_rows=rows_of(generator))

    def transition(self, gap: float) -> np.ndarray:
        """Error just before the next sample from the error just before this one, Phi(gap), shape (n, n)."""
        with np.errstate(over="ignore", invalid="ignore"):  # an unstable error may leave the range of numbers
            return np.asarray(self._closed(np.array([gap]), small_exponential(self.generator * gap)[None])[0])

    def transitions(self, longest: float, count: int) -> tuple[np.ndarray, np.ndarray]:
        """Transitions at `count` equidistant gaps in (0, longest]: gaps of shape (count,), matrices of shape (count, n,
        n).
        """
        gaps = longest / count * np.arange(1, count + 1)
        powers = matrix_powers(small_exponential(self.generator * (longest / count)), count)
        with np.errstate(over="ignore", invalid="ignore"):
            return gaps, self._closed(gaps, powers)

    def courses(self, longest: float, count: int) -> np.ndarray:
        """Error within a gap from the error before its sample, shape (count + 1, n, n).

        Args:
            longest: end of the gap [s]. count: equidistant instants after 0.
        """
        return np.concatenate([np.eye(self.size)[None], self.transitions(longest, count)[1]])

    def _closed(self, gaps: np.ndarray, flows: np.ndarray) -> np.ndarray:
        """``exp(A T) (I - M(0) C) + M(T) C``, M(T) being what phi would still do after T, taken back to T."""
        C = np.asarray(self.C_rows)
        whole = np.eye(self.size) - self._rest(np.zeros(1))[0] @ C
        return np.asarray(flows @ whole + self._rest(gaps) @ C)

    def _rest(self, gaps: np.ndarray) -> np.ndarray:
        """``int_T^E exp(A (T - s)) gain phi(s) ds``, shape (count, n, q).

        With ``E = m / eta``, ``m = 1/(1 - a)`` and ``c = 1 - T/E`` it is ``c^m E sum_j c_j c^(j + 1) (-A E)^j gain``,
        ``c_j = 1/((m + 1) ... (m + 1 + j))``.
        """
        m = 1.0 / (1.0 - self.exponent)
        end = m / self.rate_of_decay
        left = np.maximum(1.0 - gaps / end, 0.0)
        powers = (end * left ** (m + 1.0))[:, None] * np.vander(left, _TERMS, increasing=True)
        coefficients = 1.0 / np.cumprod(m + 1.0 + np.arange(_TERMS))
        term, terms = np.asarray(self.gain_rows), []
        for _ in range(_TERMS):
            terms.append(term)
            term = -self.generator * end @ term
        return np.tensordot(powers * coefficients, np.stack(terms), axes=1)


def decaying_error(
    drift: np.ndarray,
    gain: np.ndarray,
    C: np.ndarray,
    rate: float,
    exponent: float,
    levels: tuple[int, ...],
) -> DecayingError | ImpulsiveError:
    """The error of an observer with an innovation that decays by ``phi' = -rate phi^exponent``.

    Args:
        drift: shape (n, n) [1/s]. gain: shape (n, q). C: shape (q, n). rate: eta [1/s], zero for a held innovation.
        exponent: a, from 0 to 1. levels: of the n components.

    Raises:
        ValueError: the decay is so slow against the rates of the drift that its exact transitions lose their digits.
    """
    if rate == 0.0 or exponent == 1.0:
        return ImpulsiveError.with_innovation(drift, gain, rate * np.eye(np.shape(gain)[1]), C, levels)
    turn = float(np.abs(np.linalg.eigvals(drift)).max()) / ((1.0 - exponent) * rate)
    if turn > _LARGEST_TURN:
        raise ValueError(
            f"Certificate: the innovation lasts {turn:.3g} times the fastest time of the model; at most "
            f"{_LARGEST_TURN:g} can be evaluated. Raise the decay rate, lower the exponent, or take 1 for it."
        )
    return DecayingError(rows_of(drift), rows_of(gain), rows_of(C), float(rate), float(exponent), levels)
