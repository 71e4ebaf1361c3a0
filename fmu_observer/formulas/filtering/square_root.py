"""Square-root forms of the Kalman equations: a covariance is carried as a lower triangular factor S with ``P = S S'``.

Factors are combined by Householder reflections of their columns side by side, so that no covariance is ever formed: an
entry of P may be as small as the square of the rounding. Pure functions that trace.
"""

from __future__ import annotations

import numpy as np

from fmu_observer.formulas.filtering.kalman import Corrected
from plant_models.hybrid import Array


def factor(covariance: Array) -> Array:
    """Lower triangular S with ``S S'`` the covariance: Cholesky, for semidefinite ones too.

    A state that is known exactly has a row and a column of zeros, in the covariance and in S. Only the lower triangle
    is read. A matrix that is not positive semidefinite gives zeros where a root of a negative number would stand.

    Args:
        covariance: shape (n, n).

    Returns:
        Shape (n, n), diagonal not negative.
    """
    columns: list[Array] = []
    rest = covariance
    for j in range(covariance.shape[0]):
        pivot = np.maximum(rest[0, 0], 0.0)
        root = np.sqrt(pivot)
        column = np.where(pivot > 0.0, rest[:, 0] / np.where(pivot > 0.0, root, 1.0), 0.0 * rest[:, 0])
        columns.append(np.hstack([np.zeros(j), column]))
        rest = rest[1:, 1:] - np.outer(column[1:], column[1:])
    return np.stack(columns, axis=1)


def triangular(columns: Array) -> Array:
    """Lower triangular L with ``L L' = A A'``, by Householder reflections from the right.

    Args:
        columns: A, shape (n, m); fewer columns than rows are filled up by zeros.

    Returns:
        Shape (n, n), diagonal not negative.
    """
    n, m = columns.shape
    rest = columns if m >= n else np.hstack([columns, np.zeros((n, n - m))])
    lower: list[Array] = []
    for j in range(n):
        row = rest[0]
        length = np.sqrt(row @ row)
        first = np.eye(row.shape[0])[0]
        towards = np.where(row[0] > 0.0, -length, length)  # away from the first entry: nothing cancels
        v = row - towards * first
        square = v @ v
        share = np.where(square > 0.0, 2.0 / np.where(square > 0.0, square, 1.0), 0.0)
        turned = rest - share * np.outer(rest @ v, v)
        sign = np.where(towards < 0.0, -1.0, 1.0)
        lower.append(np.hstack([np.zeros(j), sign * turned[:, 0]]))
        rest = turned[1:, 1:]
    return np.stack(lower, axis=1)


def solved_lower(L: Array, right: Array) -> Array:
    """``inv(L) right`` by forward substitution; a row of zeros in L gives zeros.

    Args:
        L: lower triangular, shape (q, q). right: shape (q, k).

    Returns:
        Shape (q, k).
    """
    rows: list[Array] = []
    for i in range(L.shape[0]):
        known = right[i] if i == 0 else right[i] - L[i, :i] @ np.stack(rows)
        rows.append(_over(known, L[i, i]))
    return np.stack(rows)


def _over(known: Array, pivot: Array) -> Array:
    """The quotient; zeros where the pivot is not positive."""
    return np.where(pivot > 0.0, known / np.where(pivot > 0.0, pivot, 1.0), 0.0 * known)


def predicted_factor(S: Array, F: Array, noise: Array) -> Array:
    """Factor of ``F P F' + Q``.

    Args:
        S: factor before, shape (n, n). F: Jacobian of the transition by the state, shape (n, n).
        noise: factor of Q as it acts on the state, ``W factor(QN)``, shape (n, r).

    Returns:
        Lower triangular, shape (n, n).
    """
    return triangular(np.hstack([F @ S, noise]))


def correct_factor(x: Array, S: Array, innovation: Array, H: Array, noise: Array) -> Corrected:
    """Estimate and factor after a measurement, from one triangularisation of ``[[noise, H S], [0, S]]``.

    Kaminski, Bryson and Schmidt, IEEE TAC 16 (1971) 727, the square-root covariance form.

    Args:
        x: prediction, shape (n,). S: factor of its covariance, shape (n, n).
        innovation: measurement less its prediction, shape (q,).
        H: Jacobian of the measurement by the state at the prediction, shape (q, n).
        noise: factor of the measurement noise as it acts on the measurement, ``V factor(RN)``, shape (q, r).

    Returns:
        Estimate, lower factor of the covariance, gain and covariance of the innovation.
    """
    return corrected_by(x, innovation, noise, H @ S, S)


def corrected_by(x: Array, innovation: Array, noise: Array, seen: Array, spread: Array) -> Corrected:
    """Estimate and factor after a measurement, of deviations side by side: those of the state and how each is seen.

    With ``spread spread' = P``, ``seen spread' = Pyx`` and ``seen seen' + noise noise' = S``.

    Args:
        x: prediction, shape (n,). innovation: shape (q,). noise: factor of the measurement noise, shape (q, r).
        seen: shape (q, c). spread: shape (n, c).

    Returns:
        Estimate, lower factor of the covariance, gain and covariance of the innovation.
    """
    q, n = seen.shape[0], spread.shape[0]
    block = np.vstack([np.hstack([noise, seen]), np.hstack([np.zeros((n, noise.shape[1])), spread])])
    lower = triangular(block)
    root, cross = lower[:q, :q], lower[q:, :q]
    scaled = solved_lower(root, innovation.reshape(q, 1))
    K = _solved_lower_transposed(root, cross.T).T
    return Corrected(x + (cross @ scaled)[:, 0], lower[q:, q:], K, root @ root.T)


def _solved_lower_transposed(L: Array, right: Array) -> Array:
    """``inv(L') right`` by backward substitution, else as `solved_lower`."""
    rows: list[Array] = []
    for i in reversed(range(L.shape[0])):
        known = right[i] if not rows else right[i] - L[i + 1 :, i] @ np.stack(rows)
        rows.insert(0, _over(known, L[i, i]))
    return np.stack(rows)
