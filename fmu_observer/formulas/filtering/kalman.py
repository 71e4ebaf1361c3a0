"""The equations of the Kalman filter: prediction and correction of an estimate and its covariance. Pure functions that
trace.

They serve the linear and the extended filter alike: what the matrices are Jacobians of is the caller's business.
"""

from __future__ import annotations

from functools import cache
from math import factorial, log, pi
from typing import Literal, NamedTuple

import numpy as np

from plant_models.hybrid import Array

Form = Literal["joseph", "short"]


class Corrected(NamedTuple):
    """What a measurement makes of a prediction.

    Attributes:
        estimate: shape (n,). covariance: of it, shape (n, n), exactly symmetric; a lower factor of it from
            `square_root`. gain: K, shape (n, q). innovation_covariance: S, shape (q, q).
    """

    estimate: Array
    covariance: Array
    gain: Array
    innovation_covariance: Array


@cache
def _identity(n: int) -> Array:
    return np.eye(n)


def symmetric(matrix: Array) -> Array:
    """Half the sum of a matrix and its mirror.

    Args:
        matrix: shape (n, n).
    """
    return 0.5 * (matrix + matrix.T)


def flattened(matrix: Array) -> list[Array]:
    """Entries row by row, as scalars.

    Args:
        matrix: shape (n, m).
    """
    rows, columns = matrix.shape
    return [matrix[i, j] for i in range(rows) for j in range(columns)]


def solved(S: Array, right: Array) -> Array:
    """``inv(S) right``; a single number divides, which costs a tenth.

    Args:
        S: covariance, shape (q, q). right: shape (q,) or (q, k).
    """
    return right / S[0, 0] if S.shape[0] == 1 else np.linalg.solve(S, right)


def through(noise: Array, entry: Array | None) -> Array:
    """Covariance of a noise after the matrix by which it enters: ``W Q W'``, or Q where it is additive.

    Args:
        noise: Q, shape (r, r). entry: W, shape (n, r); None for the identity.

    Returns:
        Shape (n, n).
    """
    return noise if entry is None else entry @ noise @ entry.T


def predicted_covariance(P: Array, F: Array, QN: Array, W: Array | None = None) -> Array:
    """Covariance one transition later, ``F P F' + W QN W'``: Allaoui 2024, (2.19) and section II.5.

    Args:
        P: covariance before, shape (n, n). F: Jacobian of the transition by the state, shape (n, n).
        QN: covariance of the process noise, shape (r, r). W: Jacobian of the transition by that noise, shape (n, r);
            None for additive noise.

    Returns:
        Shape (n, n), exactly symmetric.
    """
    return symmetric(F @ P @ F.T) + through(QN, W)


def integrated_noise(order: int, elapsed: Array, density: Array) -> Array:
    """Covariance of a chain of integrators that white noise drives: ``dx_i = x_(i+1)``, the last one the noise.

    Entries are ``density T^(2n-1-i-j) / ((n-1-i)! (n-1-j)! (2n-1-i-j))`` with i, j from 0 (Bar-Shalom, Li, Kirubarajan:
    Estimation with applications to tracking and navigation, section 6.2).

    Args:
        order: n, number of integrators. elapsed: T, time [s]. density: spectral density of the noise.

    Returns:
        Shape (n, n).
    """
    powers = [elapsed + 0.0]
    while len(powers) < 2 * order - 1:
        powers.append(powers[-1] * elapsed)
    rows = []
    for i in range(order - 1, -1, -1):
        entries = []
        for j in range(order - 1, -1, -1):
            entries.append(density * powers[i + j] / (factorial(i) * factorial(j) * (i + j + 1)))
        rows.append(np.hstack(entries))
    return np.vstack(rows)


def correct(
    x: Array, P: Array, innovation: Array, H: Array, RN: Array, V: Array | None = None, form: Form = "joseph"
) -> Corrected:
    """Estimate and covariance after a measurement: Allaoui 2024, (2.12), (2.22)-(2.24) and section II.5.

    ``S = H P H' + V RN V'``, ``K = P H' inv(S)``, ``x + K innovation``. The Joseph form
    ``(I - K H) P (I - K H)' + K V RN V' K'`` stays positive for any rounding of the gain, the short form
    ``P - K H P`` costs a third. A smaller set of measurements takes its rows of H and V and its part of RN.

    Args:
        x: prediction, shape (n,). P: its covariance, shape (n, n).
        innovation: measurement less its prediction, shape (q,).
        H: Jacobian of the measurement by the state at the prediction, shape (q, n).
        RN: covariance of the measurement noise, shape (r, r). V: Jacobian of the measurement by that noise, shape
            (q, r); None for additive noise.
        form: ``joseph`` or ``short``.

    Returns:
        Estimate, covariance, gain and covariance of the innovation.
    """
    noise = through(RN, V)
    spread = H @ P
    S = symmetric(spread @ H.T) + noise
    K = solved(S, spread).T
    if form == "short":
        return Corrected(x + K @ innovation, symmetric(P - K @ spread), K, S)
    rest = _identity(P.shape[0]) - K @ H
    return Corrected(x + K @ innovation, symmetric(rest @ P @ rest.T + K @ noise @ K.T), K, S)


def normalised_square(error: Array, covariance: Array) -> Array:
    """``e' inv(P) e``: NEES of an error and its covariance, NIS of an innovation and its own; chi-square distributed.

    Args:
        error: shape (k,). covariance: of it, shape (k, k).
    """
    return error @ solved(covariance, error)


def decoupled(noise: Array, there: Array) -> Array:
    """Covariance of measurements some of which are missing: those stand alone, with variance 1.

    With no slope and no innovation of their own they then change nothing.

    Args:
        noise: of all measurements, shape (q, q). there: 1 for a measurement, 0 for one that is missing, shape (q,).
    """
    return noise * np.outer(there, there) + np.diag(1.0 - there)


def log_likelihood(innovation: Array, S: Array, count: Array | None = None) -> Array:
    """Logarithm of the Gaussian density of an innovation, ``-(q log 2 pi + log det S + e' inv(S) e) / 2``.

    Args:
        innovation: shape (q,). S: its covariance, shape (q, q).
        count: how many measurements there were, where some were `decoupled`; None for all.
    """
    numbers = innovation.shape[0] if count is None else count
    return -0.5 * (numbers * log(2.0 * pi) + np.log(np.linalg.det(S)) + normalised_square(innovation, S))
