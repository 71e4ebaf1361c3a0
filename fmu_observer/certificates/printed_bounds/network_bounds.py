"""Bounds of Hann 2014, chapter 2, for observers behind a network: as printed, as their proofs need them, and the exact
tests of linear equations beside them. Plain NumPy and SciPy.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import inf, log, log1p

import numpy as np
import scipy

_POINTS = 400
_SPAN = 1e3  # the grid of frequencies reaches from the slowest pole over this to the fastest times this


@dataclass(frozen=True)
class NetworkBounds:
    """What Theorem 2.1 says of one observer.

    Attributes:
        lipschitz: L of the model's equations, largest norm of their Jacobian [1/s]. decay: sigma, rate at which the
            error of the observer with continuous measurements decays [1/s], zero where it does not.
        gain: gamma from the noise of a measurement to that error, a lower bound: the largest gain over all
            frequencies [1]; inf where the error does not decay. measured: norm of H [1]. cycle: N, transmissions of a
            period of the protocol. predictors: m, at least 1.
    """

    lipschitz: float
    decay: float
    gain: float
    measured: float
    cycle: int
    predictors: int

    @property
    def loop(self) -> float:
        """``gamma |H| N L`` [1/s]."""
        return self.gain * self.measured * self.cycle * self.lipschitz

    @property
    def longest_interval(self) -> float:
        """tau_MATI of (2.17), ``1 / (gamma |H| N L)`` [s]."""
        return 1.0 / self.loop if np.isfinite(self.loop) and self.loop > 0.0 else 0.0

    @property
    def strict_interval(self) -> float:
        """The same where the weight ``exp(sigma N tau)``, which the proof of (2.34) carries and (2.17) leaves out, is
        kept: root of ``gamma |H| N L tau exp(sigma N tau) = 1`` [s].
        """
        rate = self.decay * self.cycle
        if self.longest_interval == 0.0 or rate == 0.0:
            return self.longest_interval
        return float(scipy.special.lambertw(rate * self.longest_interval).real) / rate

    @property
    def longest_delay(self) -> float:
        """tau_MAD of (2.17), (2.59): root of ``(L/sigma) (exp(sigma tau / m) - 1) = 1`` [s]."""
        if self.lipschitz == 0.0:
            return inf
        one = log1p(self.decay / self.lipschitz) / self.decay if self.decay > 0.0 else 1.0 / self.lipschitz
        return self.predictors * one

    def predictors_needed(self, delay: float) -> int:
        """Fewest predictors that (2.59) allows for a delay.

        Args:
            delay: of the packets [s].
        """
        return max(1, int(np.floor(delay * self.predictors / self.longest_delay)) + 1)

    def small_gain(self, interval: float, rate: float | None = None) -> float:
        """``gamma |H| N L tau exp(rate N tau)``; below 1 where the error decays with that rate.

        Args:
            interval: tau [s]. rate: [1/s]; None for sigma.
        """
        weight = (self.decay if rate is None else rate) * self.cycle * interval
        return inf if weight > log(1e300) else self.loop * interval * float(np.exp(weight))


def network_bounds(
    drifts: Sequence[np.ndarray], at: np.ndarray, gain: np.ndarray, C: np.ndarray, cycle: int, predictors: int
) -> NetworkBounds:
    """Constants of Theorem 2.1.

    L is the largest over all Jacobians; sigma and gamma are those of the equations linearised at one state, which the
    constants of a nonlinear model are not better than.

    Args:
        drifts: Jacobians of the model, each of shape (n, n). at: the one at the state, shape (n, n).
        gain: of the observer, shape (n, q). C: shape (q, n).
        cycle: transmissions of a period of the protocol. predictors: of the cascade, 0 counts as 1.
    """
    closed = at - gain @ C
    decay = max(0.0, -float(np.linalg.eigvals(closed).real.max()))
    return NetworkBounds(
        lipschitz=max(float(np.linalg.norm(drift, 2)) for drift in drifts),
        decay=decay,
        gain=_largest_gain(closed, gain) if decay > 0.0 else inf,
        measured=float(np.linalg.norm(C, 2)),
        cycle=cycle,
        predictors=max(predictors, 1),
    )


def _largest_gain(A: np.ndarray, B: np.ndarray) -> float:
    """Largest norm of ``inv(jw I - A) B`` over all frequencies, found on a grid and refined.

    Args:
        A: stable, shape (n, n). B: shape (n, q).
    """

    def norm(frequency: float) -> float:
        return float(np.linalg.norm(np.linalg.solve(1j * frequency * np.eye(len(A)) - A, B), 2))

    poles = np.linalg.eigvals(A)
    rates = np.abs(poles)
    about = np.geomspace(rates.min() / _SPAN, rates.max() * _SPAN, _POINTS)
    grid = np.unique(np.concatenate([[0.0], np.abs(poles.imag), about]))
    best = int(np.argmax([norm(w) for w in grid]))
    around = (grid[max(best - 1, 0)], grid[min(best + 1, len(grid) - 1)])
    refined = scipy.optimize.minimize_scalar(
        lambda w: -norm(w), bounds=around, method="bounded", options={"xatol": 1e-9 * around[1]}
    )
    return max(norm(grid[best]), -float(refined.fun))


def exact_predictor_delay(A: np.ndarray, predictors: int = 1) -> float:
    """Delay at which the predictors of a linear model stop being stable [s].

    Once reached, the error of a predictor over a share r of the delay obeys ``e(t) = A int e`` over the last r, whose
    roots are those of ``s = l (1 - exp(-s r))`` for the eigenvalues l of A. A root reaches the imaginary axis first at
    ``r = arg(l) / Im(l)``, in the limit ``1 / l`` for a real one; a negative real one bounds nothing. [ours]

    Args:
        A: of the model, shape (n, n). predictors: of the cascade; each has its share.
    """
    shares = [inf]
    for value in np.linalg.eigvals(A):
        if abs(value.imag) > 1e-12 * abs(value):
            shares.append(float(np.angle(value) / value.imag))
        elif value.real > 0.0:
            shares.append(1.0 / float(value.real))
    return max(predictors, 1) * min(shares)
