"""Observer gains by pole placement. Plain NumPy and SciPy."""

from __future__ import annotations

import warnings
from collections.abc import Sequence

import numpy as np
import scipy

from fmu_observer.observability import MeasuredSystem, require_observable


def observer_gain(
    A: np.ndarray,
    C: np.ndarray,
    poles: Sequence[float] | np.ndarray,
    states: tuple[str, ...] = (),
    name: str = "pole placement",
) -> np.ndarray:
    """Gain L such that ``A - L C`` has the given poles.

    With one measurement by Ackermann's formula, for poles of any multiplicity; with several SciPy's robust placement.

    Args:
        A: shape (n, n). C: shape (q, n), (A, C) observable. poles: n of them [1/s], real or in conjugate pairs; with
            several measurements none repeated more often than C has rank. For a discrete A the same, within the unit
            circle.
        states: their names, for the message. name: what asks, for the message.

    Returns:
        L of shape (n, q).

    Raises:
        UnobservableError: a mode is not observable; the message says which.
        ValueError: the number of poles is not n, or a pole is repeated too often.
    """
    wanted = np.asarray(poles)
    if wanted.shape != (len(A),):
        raise ValueError(
            f"Pole placement: got poles of shape {wanted.shape}, expected {(len(A),)}, one for each state."
        )
    require_observable(MeasuredSystem(A, C, states=states, name=name))
    if len(C) > 1:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", UserWarning)  # poles as asked, only their conditioning is not yet the best
            return np.asarray(scipy.signal.place_poles(A.T, C.T, wanted).gain_matrix.T)
    return _by_ackermann(A, C, wanted)


def _by_ackermann(A: np.ndarray, C: np.ndarray, poles: np.ndarray) -> np.ndarray:
    """Gain of one measurement, shape (n, 1)."""
    n = len(A)
    matrix = observability_matrix(A, C)
    value = np.zeros((n, n))
    for coefficient in np.real(np.poly(poles)):  # Horner
        value = value @ A + coefficient * np.eye(n)
    return np.asarray(value @ np.linalg.solve(matrix, np.eye(n)[:, -1:]))


def observability_matrix(A: np.ndarray, C: np.ndarray) -> np.ndarray:
    """``[C; C A; ...; C A^(n-1)]`` of Bouchama 2024, (1.2), shape (q n, n)."""
    return np.vstack([C @ np.linalg.matrix_power(A, k) for k in range(len(A))])
