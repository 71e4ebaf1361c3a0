"""Certificates of observers with state jumps at two rates: a periodic odometer, and balises at any time in between.

What happens between two balises is a product of per-sample updates, with the balise at every possible phase of the
odometer period. One Lyapunov function over all such products covers every mixture of gaps.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from math import ceil, inf

import numpy as np
import scipy

from fmu_observer.certificates.finding import Finding
from fmu_observer.certificates.gap_error import rows_of
from fmu_observer.certificates.gap_findings import gap_finding
from fmu_observer.certificates.matrix_exponential import small_exponential
from fmu_observer.certificates.quadratic import (
    Decrease,
    QuadraticCondition,
    best_decrease,
    inequalities,
    largest_between,
    transition_condition,
)

_HORIZON = 10.0  # [s]
_COARSE_PHASES, _FINE_PHASES = 5, 41  # phases of the balise in an odometer period, for finding and for checking
_CUTS = 6


@dataclass(frozen=True)
class TwoRateError:
    """Error equations ``de = A e`` with jumps ``e -= K_1 e_i`` at odometer samples and ``e -= K_2 e_j`` at balises;
    hashable.

    Attributes:
        A: rows of shape (n, n) [1/s].
        odometer_gain, balise_gain: shape (n,).
        odometer_index, balise_index: the components measured.
        period: odometer period [s].
    """

    A: tuple[tuple[float, ...], ...]
    odometer_gain: tuple[float, ...]
    balise_gain: tuple[float, ...]
    odometer_index: int
    balise_index: int
    period: float

    def flow(self, time: float) -> np.ndarray:
        """Transition over `time` [s] without a measurement, shape (n, n)."""
        return small_exponential(np.asarray(self.A) * time)

    def sample(self) -> np.ndarray:
        """From one odometer sample to just after the next, without a balise, shape (n, n)."""
        return np.asarray(self._odometer_jump() @ self.flow(self.period))

    def sample_with_balise(self, phase: float) -> np.ndarray:
        """As `sample`, with a balise at ``phase * period`` after the first sample, shape (n, n)."""
        after, before = self.flow((1.0 - phase) * self.period), self.flow(phase * self.period)
        return np.asarray(self._odometer_jump() @ after @ self._jump(self.balise_gain, self.balise_index) @ before)

    def products(self, samples: int, phases: int) -> np.ndarray:
        """``B(phase) N^j`` for j = 0 .. samples - 1 and equidistant phases in [0, 1], shape (samples, phases, n, n)."""
        with_balise = np.stack([self.sample_with_balise(s) for s in np.linspace(0.0, 1.0, phases)])
        powers = [np.eye(len(self.A))]
        for _ in range(samples - 1):
            powers.append(self.sample() @ powers[-1])
        return np.stack([with_balise @ power for power in powers])

    def _odometer_jump(self) -> np.ndarray:
        return self._jump(self.odometer_gain, self.odometer_index)

    def _jump(self, gain: tuple[float, ...], index: int) -> np.ndarray:
        matrix = np.eye(len(gain))
        matrix[:, index] -= gain
        return matrix


def certify_two_rate_error(error: TwoRateError, max_gap: float, error_model: str) -> Finding:
    """Certificate for balise gaps up to `max_gap` [s], at most one balise in an odometer period.

    Constant gaps are whole numbers of odometer periods, at the worst phase.

    Args:
        error: the error equations. max_gap: longest gap asked for [s]. error_model: the same in words.

    Returns:
        What is found about the gaps.
    """
    samples = _samples(error, max_gap)
    horizon = max(_HORIZON, 2.0 * max_gap)
    radii = _constant_radii(error, _samples(error, horizon))
    unstable = np.flatnonzero(~(radii < 1.0))
    searched = int(unstable[0]) if unstable.size else len(radii)
    covered = _aperiodic_samples(error, searched)
    found = _common_decrease(error, samples)
    return gap_finding(
        max_gap,
        horizon,
        constant_limit=float((unstable[0] + 1) * error.period) if unstable.size else inf,
        mixed_limit=inf if covered == len(radii) else covered * error.period,
        growth=float(radii[samples - 1]),
        decrease=found.margin,
        holds=found.holds,
        error_model=error_model,
        remarks=("at most one balise in an odometer period",),
        matrix=rows_of(found.P),
    )


@lru_cache(maxsize=256)
def _aperiodic_samples(error: TwoRateError, most: int) -> int:
    """Largest number of samples in a gap, up to `most`, such that one Lyapunov function covers all shorter gaps too.

    Any gap up to m periods holds at most m - 1 samples before the one in which the balise falls.
    """
    if most == 0 or _common_decrease(error, most).holds:
        return most
    low, high = 0, most
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (middle, high) if _common_decrease(error, middle).holds else (low, middle)
    return low


def _samples(error: TwoRateError, gap: float) -> int:
    return max(1, ceil(gap / error.period - 1e-9))


def _constant_radii(error: TwoRateError, samples: int) -> np.ndarray:
    """Worst spectral radius over the phases at gaps of 1 .. `samples` periods, shape (samples,)."""
    return np.asarray(np.abs(np.linalg.eigvals(error.products(samples, _COARSE_PHASES))).max(axis=(1, 2)))


@lru_cache(maxsize=256)
def _common_decrease(error: TwoRateError, samples: int) -> Decrease:
    """Best recomputed relative decrease over all products of up to `samples` samples, and its P."""
    scale = _scaling(error, samples)
    fine = error.products(samples, _FINE_PHASES) * (scale[None, :] / scale[:, None])
    shape = fine.shape
    condition = transition_condition(fine.reshape(-1, *shape[2:]))
    places = np.arange(len(condition.w)).reshape(shape[:2])
    coarse = places[:: max(1, samples // 8), :: _FINE_PHASES // _COARSE_PHASES]
    chosen = set(map(int, coarse.ravel()))

    def recomputed(P: np.ndarray) -> tuple[float, set[int]]:
        values = inequalities(condition, P).reshape(*shape[:2], *P.shape)
        largest = np.linalg.eigvalsh(values)[..., -1]
        worst = {i * _FINE_PHASES + int(k) for i, k in enumerate(largest.argmax(axis=1))}
        return -largest_between(values), worst

    def refined(_: QuadraticCondition, worst: set[int]) -> QuadraticCondition:
        chosen.update(worst)
        return condition.picked(sorted(chosen))

    return best_decrease(condition.picked(sorted(chosen)), recomputed, refined, _CUTS).unscaled(scale)


def _scaling(error: TwoRateError, samples: int) -> np.ndarray:
    """Size of each component's unit, from the Lyapunov matrix of a constant gap in the middle."""
    middle = error.products((samples + 1) // 2, 1)[-1, 0]
    if np.abs(np.linalg.eigvals(middle)).max() >= 1.0:
        return np.ones(len(error.A))
    return np.asarray(1.0 / np.sqrt(np.diag(scipy.linalg.solve_discrete_lyapunov(middle.T, np.eye(len(error.A))))))
