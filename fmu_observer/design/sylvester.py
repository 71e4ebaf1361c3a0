"""Reduced-order observers by a Sylvester equation: the transformation that turns a part of the state into a stable
filter.

Plain NumPy and SciPy; the observer itself needs none of this at run time, its matrices are parameters.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy

from fmu_observer.design.pole_placement import observer_gain


@dataclass(frozen=True)
class _SylvesterDesign:
    """Matrices of ``dz = A z + B_c y_c + B_d w + T G u`` with z standing for ``T x``.

    Attributes:
        A: Hurwitz, shape (r, r). B: ``[B_c B_d]``, shape (r, n - r). T: ``[T_R T_c T_d]``, shape (r, n), with T_R
        invertible.
    """

    A: np.ndarray
    B: np.ndarray
    T: np.ndarray


def sylvester_transformation(F: np.ndarray, A: np.ndarray, B: np.ndarray) -> np.ndarray:
    """T of ``T F = A T + [0 B]``: Bouchama 2024, (1.46).

    Args:
        F: plant, shape (n, n), its state in the order [unmeasured, measured]. A: shape (r, r). B: shape (r, n - r).

    Returns:
        T, shape (r, n).

    Raises:
        ValueError: a shape is wrong, or A shares an eigenvalue with F, so that there is no unique T.
    """
    r, n = len(A), len(F)
    if np.shape(A) != (r, r) or np.shape(F) != (n, n) or np.shape(B) != (r, n - r):
        raise ValueError(
            f"Sylvester equation: A {np.shape(A)}, F {np.shape(F)} and B {np.shape(B)} do not fit; expected (r, r), "
            f"(n, n) and "
            f"(r, n - r), here {(r, n - r)}."
        )
    distance = np.abs(np.linalg.eigvals(A)[:, None] - np.linalg.eigvals(F)[None, :]).min()
    if distance < 1e-9 * max(1.0, float(np.abs(F).max())):
        raise ValueError(
            "Sylvester equation: A shares an eigenvalue with the plant, there is no unique T; move the poles of A."
        )
    return np.asarray(scipy.linalg.solve_sylvester(-A, F, np.hstack([np.zeros((r, r)), B])))


def sylvester_residual(F: np.ndarray, A: np.ndarray, B: np.ndarray, T: np.ndarray) -> float:
    """Largest entry of ``T F - A T - [0 B]``, relative to the largest of ``T F``."""
    r = len(A)
    left = T @ F
    error = left - A @ T - np.hstack([np.zeros((r, r)), B])
    return float(np.abs(error).max() / max(float(np.abs(left).max()), 1e-300))


def sylvester_design(
    F: np.ndarray, unmeasured: int, poles: Sequence[float] | np.ndarray, states: Sequence[str] = (), name: str = ""
) -> _SylvesterDesign:
    """A and B for given poles by the reduced-order observer, and T from the Sylvester equation [ours].

    With L placing the poles of ``A = F_11 - L F_21`` the unmeasured part less L times the measured one is such a
    filter, with ``B = F_12 - L F_22 + A L``; the equation then gives ``T = [I, -L]``, so that T_R is as well
    conditioned as can be.

    Args:
        F: plant, shape (n, n), its state in the order [unmeasured, measured]. unmeasured: r. poles: r of them [1/s].
        states: names of the unmeasured states, for the message. name: what asks, for the message.

    Raises:
        UnobservableError: a mode of the unmeasured part cannot be observed from the measured one; the message says
        which.
        ValueError: a pole is one of the plant.
    """
    r = unmeasured
    F11, F12, F21, F22 = F[:r, :r], F[:r, r:], F[r:, :r], F[r:, r:]
    names = tuple(states) or tuple(f"x{i + 1}" for i in range(r))
    L = observer_gain(F11, F21, poles, names, name or "Sylvester design")
    A = F11 - L @ F21
    B = F12 - L @ F22 + A @ L
    return _SylvesterDesign(A, B, sylvester_transformation(F, A, B))
