"""Proportional-integral observers: a linear system extended by its disturbance and derivatives of it, and their gains.

Plain NumPy and SciPy, matrices only; the observers need none of this at run time, their gains are parameters.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import scipy

from fmu_observer.design.pole_placement import observer_gain
from fmu_observer.models.checks import check_numbers
from fmu_observer.observability import MeasuredSystem, require_observable


def extended_matrices(A: np.ndarray, H: np.ndarray, C: np.ndarray, rho: int) -> tuple[np.ndarray, np.ndarray]:
    """The extended pair of ``dx = A x + H d``, ``y = C x`` with ``d^(rho) = 0``: Aguiar Cota 2019, (2.13)-(2.15).

    Args:
        A: shape (n, n) [1/s]. H: where the disturbance acts, shape (n, nd). C: shape (q, n). rho: how many of d, d' and
            so on are states; 1 for a disturbance believed constant, 2 for a ramp.

    Returns:
        ``A_e = [[A, H, 0], [0, 0, I], [0, 0, 0]]``, shape (n + rho nd, n + rho nd), and ``C_e = [C, 0, ..., 0]``, shape
        (q, n + rho nd), for the state ``[x; d; d'; ...]``.

    Raises:
        ValueError: rho is no whole number of at least 1, or H has not as many rows as A.
    """
    check_rho(rho, "Extended pair")
    n, width = len(A), np.shape(H)[1] if np.ndim(H) == 2 else 0
    if np.shape(H) != (n, width) or not width or np.shape(C)[1:] != (n,):
        raise ValueError(
            f"Extended pair: A {np.shape(A)}, H {np.shape(H)} and C {np.shape(C)} do not fit; expected (n, n), (n, nd) "
            f"with nd at least 1, and (q, n)."
        )
    extended = np.zeros((n + rho * width, n + rho * width))
    extended[:n, :n], extended[:n, n : n + width] = A, H
    extended[n:, n:] = np.eye(rho * width, k=width)
    return extended, np.hstack([C, np.zeros((len(C), rho * width))])


def extended_gain(
    A: np.ndarray,
    H: np.ndarray,
    C: np.ndarray,
    rho: int,
    poles: Sequence[float] | np.ndarray,
    states: tuple[str, ...] = (),
    name: str = "Proportional-integral observer",
) -> np.ndarray:
    """Gain of ``dx_e = A_e x_e + B_e u + L (y - C_e x_e)`` for given error poles: Aguiar Cota 2019, (2.16)-(2.17).

    For the train of 3.2.3, ``extended_gain([[-0.1]], [[1.0]], [[1.0]], 2, [-50, -50, -1.5])``, it is (101.4, 2650,
    3750).

    Args:
        A: shape (n, n) [1/s]. H: where the disturbance acts, shape (n, nd). C: shape (q, n). rho: number of disturbance
            states, as of `extended_matrices`.
        poles: n + rho nd of them [1/s], real or in conjugate pairs; with several measurements none repeated more often
            than C has rank.
        states: names of the n + rho nd states, for the message. name: what asks, for the message.

    Returns:
        L of shape (n + rho nd, q).

    Raises:
        UnobservableError: the measurements do not show a mode of the extended pair; the message says which. It has one
            where (A, C) has one, or where (A, H, C) has an invariant zero at the origin.
        ValueError: a shape does not fit, rho is not legal, the number of poles is wrong, or one is repeated too often.
    """
    extended, seen = extended_matrices(np.asarray(A, dtype=float), np.asarray(H), np.asarray(C), rho)
    return observer_gain(extended, seen, poles, states, name)


def decaying_gain(A: np.ndarray, C: np.ndarray, decay: float, noise: float = 1.0, name: str = "") -> np.ndarray:
    """Gain with a quadratic Lyapunov function: the error decays at least at a given rate.

    P solves the filter's Riccati equation of ``A + decay I`` with unit process noise; ``V = e' inv(P) e`` then falls at
    least as ``exp(-2 decay t)``, whatever the numbers. Aguiar Cota 2019, (2.17), asks for such a function; how to find
    it is ours.

    Args:
        A: shape (n, n) [1/s]. C: shape (q, n). decay: at least this rate [1/s]. noise: variance of a measurement beside
            the unit process noise; more of it makes a smaller gain. name: what asks, for the message.

    Returns:
        L of shape (n, q).

    Raises:
        UnobservableError: a mode is not observable; the message says which.
        ValueError: the decay or the noise is not legal.
    """
    name = name or "Gain by a quadratic Lyapunov function"
    check_numbers(name, {"noise": noise}, {"decay": decay})
    require_observable(MeasuredSystem(A, C, name=name))
    shifted = np.asarray(A) + decay * np.eye(len(A))
    P = scipy.linalg.solve_continuous_are(shifted.T, np.asarray(C).T, np.eye(len(A)), noise * np.eye(len(C)))
    return np.asarray(P @ np.asarray(C).T) / noise


def check_rho(rho: object, where: str) -> None:
    """The number of disturbance states is a whole number of at least 1.

    Args:
        rho: what was given. where: for the message.

    Raises:
        ValueError: it is not.
    """
    if isinstance(rho, bool) or not isinstance(rho, int | np.integer):
        raise ValueError(f"{where}: rho must be a whole number, got {rho!r}.")
    if rho < 1:
        raise ValueError(f"{where}: rho must be at least 1, the disturbance itself, got {rho}.")
