"""The state of a linear system from a window of samples by the pseudo-inverse: exact after so many samples, without
memory of anything before. Gains are computed here; a detector multiplies by them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
import scipy

Instant = Literal["first", "last"]


@dataclass(frozen=True, slots=True)
class _FiniteWindowObserver:
    """``x = gain_y Y + gain_u U`` of the samples of a window, oldest first.

    Attributes:
        gain_y: of the measurements ``y_k .. y_{k+N-1}``, shape (n, N p). gain_u: of the inputs ``u_k .. u_{k+N-1}``,
            shape (n, N m). singular_values: of the observability matrix over the window, shape (n,).
        unobservable: directions of the state that the window does not show, shape (n, n - rank).
        at: ``first`` or ``last`` sample of the window, whose state it is.
    """

    gain_y: np.ndarray
    gain_u: np.ndarray
    singular_values: np.ndarray
    unobservable: np.ndarray
    at: Instant

    @property
    def rank(self) -> int:
        """Number of directions of the state that the window shows."""
        return int(len(self.singular_values) - self.unobservable.shape[1])

    def estimate(self, measurements: np.ndarray, inputs: np.ndarray) -> np.ndarray:
        """State, shape (n,).

        Args:
            measurements: of the window, oldest first, shape (N, p). inputs: held after each sample, shape (N, m).
        """
        return np.asarray(self.gain_y @ np.ravel(measurements) + self.gain_u @ np.ravel(inputs))


def sampled(A: np.ndarray, B: np.ndarray, sample_period: float) -> tuple[np.ndarray, np.ndarray]:
    """Matrices of a linear system from sample to sample, its inputs held in between, exact.

    Args:
        A: of ``dx = A x + B u``, shape (n, n). B: shape (n, m). sample_period: [s].

    Returns:
        The two matrices of ``x+ = Ad x + Bd u``.
    """
    n, m = B.shape
    whole = scipy.linalg.expm(sample_period * np.block([[A, B], [np.zeros((m, n + m))]]))
    return whole[:n, :n], whole[:n, n:]


def finite_window_observer(
    A: np.ndarray, B: np.ndarray, C: np.ndarray, samples: int, at: Instant = "last"
) -> _FiniteWindowObserver:
    """``x_k = pinv(O) (Y_k - M U_k)``: Omar 2012, (7.7.1)-(7.7.3); for the last sample the model brings it there.

    Where the window does not show the whole state, the directions it leaves open are reported, and the estimate has
    zero along them at the first sample.

    Args:
        A: of ``x+ = A x + B u``, shape (n, n). B: shape (n, m). C: of ``y = C x``, shape (p, n).
        samples: N in the window, at least 1. at: ``first`` (as printed) or ``last`` sample whose state is wanted.

    Raises:
        ValueError: the window has no sample, or the shapes do not fit.
    """
    n, m = len(A), B.shape[1]
    if samples < 1:
        raise ValueError(f"A window of {samples} samples shows nothing; expected at least 1.")
    if A.shape != (n, n) or B.shape[0] != n or C.shape[1] != n:
        raise ValueError(f"A {A.shape}, B {B.shape}, C {C.shape} do not fit; expected (n, n), (n, m), (p, n).")
    powers = [np.eye(n)]
    for _ in range(samples - 1):
        powers.append(A @ powers[-1])
    observed, M = np.vstack([C @ power for power in powers]), _impulse_responses(powers, B, C)
    left, values, right = np.linalg.svd(observed, full_matrices=True)
    values = np.concatenate([values, np.zeros(n - len(values))])
    rank = int(np.sum(values > max(observed.shape) * np.finfo(float).eps * values[0]))
    inverse = right[:rank].T @ (left[:, :rank] / values[:rank]).T
    gain_y, gain_u = inverse, -inverse @ M
    if at == "last":
        driven = np.hstack([powers[samples - 2 - i] @ B for i in range(samples - 1)] + [np.zeros((n, m))])
        gain_y, gain_u = powers[-1] @ gain_y, powers[-1] @ gain_u + driven
    return _FiniteWindowObserver(gain_y, gain_u, values, right[rank:].T, at)


def _impulse_responses(powers: Sequence[np.ndarray], B: np.ndarray, C: np.ndarray) -> np.ndarray:
    """M: what each input of the window does to each of its measurements, shape (N p, N m)."""
    samples, m, p = len(powers), B.shape[1], len(C)
    M = np.zeros((samples * p, samples * m))
    for row in range(samples):
        for column in range(row):
            M[row * p : (row + 1) * p, column * m : (column + 1) * m] = C @ powers[row - 1 - column] @ B
    return M
