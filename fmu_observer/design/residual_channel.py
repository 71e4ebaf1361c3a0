"""From a disturbance or a fault to the residual of a linear observer: the error equation as matrices. Plain NumPy."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fmu_observer.design.decoupling import decoupling
from fmu_observer.models.checks import checked_matrix
from fmu_observer.models.observer_model import ObserverModel


@dataclass(frozen=True, eq=False)
class ResidualChannel:
    """``de = A e + B s``, ``r = C e + D s``: how signals s reach the residual r.

    Attributes:
        A: of the error, shape (n, n) [1/s]. B: shape (n, k). C: shape (q, n). D: shape (q, k).

    Raises:
        ValueError: the shapes do not fit, or a number is not finite.
    """

    A: np.ndarray
    B: np.ndarray
    C: np.ndarray
    D: np.ndarray

    def __post_init__(self) -> None:
        n, k = np.shape(self.B) if np.ndim(self.B) == 2 else (0, 0)
        q = len(self.C)
        shapes = {"A": (n, n), "B": (n, k), "C": (q, n), "D": (q, k)}
        reason = f"{n} states, {k} signals and {q} residuals, as B and C have"
        for name, shape in shapes.items():
            matrix = checked_matrix("Residual channel", name, getattr(self, name), shape, reason)
            object.__setattr__(self, name, matrix)

    @property
    def matrices(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """A, B, C, D, as ``control.ss(*channel.matrices)`` takes them."""
        return self.A, self.B, self.C, self.D

    @property
    def poles(self) -> np.ndarray:
        """Eigenvalues of A [1/s], shape (n,)."""
        return np.linalg.eigvals(self.A)

    @property
    def stable(self) -> bool:
        """Whether all poles lie in the left half plane."""
        return bool(np.all(self.poles.real < 0.0))

    def response(self, omega: np.ndarray) -> np.ndarray:
        """Frequency response ``C inv(i omega I - A) B + D``, shape (K, q, k); at infinity D.

        Args:
            omega: frequencies [rad/s], shape (K,).
        """
        omega = np.atleast_1d(np.asarray(omega, dtype=float))
        finite = np.where(np.isfinite(omega), omega, 0.0)
        shifted = 1j * finite[:, None, None] * np.eye(len(self.A)) - self.A
        inner = np.linalg.solve(shifted, np.broadcast_to(self.B.astype(complex), (len(omega), *self.B.shape)))
        return np.asarray(np.where(np.isfinite(omega)[:, None, None], self.C @ inner, 0.0) + self.D)


def residual_channel(
    A: np.ndarray,
    gain: np.ndarray,
    C: np.ndarray,
    on_states: np.ndarray | None = None,
    on_measurements: np.ndarray | None = None,
    residual_gain: float | np.ndarray = 1.0,
) -> ResidualChannel:
    """Error and residual of ``dx = A x + E s``, ``y = C x + F s`` under ``dxh = A xh + L (y - C xh)``.

    ``de = (A - L C) e + (E - L F) s`` and ``r = L_r (C e + F s)``: Aguiar Cota 2019, (2.21)-(2.25), repaired. An
    unknown input or a fault of the actuator has E alone; noise and a fault of the sensor have F alone, as in (3.45)
    with F = -1: a jam makes the measured speed low.

    Args:
        A: of the plant, extended by disturbance states where the observer is, shape (n, n) [1/s].
        gain: L, shape (n, q). C: shape (q, n).
        on_states: E, shape (n, k); None for zero. on_measurements: F, shape (q, k); None for zero.
        residual_gain: L_r, a number or of shape (q, q).

    Raises:
        ValueError: neither E nor F is given, or a shape does not fit.
    """
    A, gain, C = (np.asarray(matrix, dtype=float) for matrix in (A, gain, C))
    E, F = _entries(len(A), len(C), on_states, on_measurements)
    L_r = np.asarray(residual_gain, dtype=float)
    L_r = L_r * np.eye(len(C)) if L_r.ndim == 0 else L_r
    return ResidualChannel(A - gain @ C, E - gain @ F, L_r @ C, L_r @ F)


def decoupled_channel(
    model: ObserverModel,
    gain: np.ndarray,
    on_states: np.ndarray | None = None,
    on_measurements: np.ndarray | None = None,
    residual_gain: float | np.ndarray = 1.0,
) -> ResidualChannel:
    """The same of the decoupling observer of a model: its unknown inputs do not reach the residual at all.

    In ``q = P x - z``: ``dq = (P A - K C) q + (P E + P A M F - K (I + C M) F) s``, ``r = L_r (C q + (I + C M) F s)``.

    Args:
        model: a linear model with unknown inputs. gain: K of what is left free, shape (n, q).
        on_states, on_measurements, residual_gain: as of `residual_channel`.

    Raises:
        ValueError: neither E nor F is given, or a shape does not fit.
    """
    A, C = model.A, model.C
    E, F = _entries(len(A), len(C), on_states, on_measurements)
    found = decoupling(A, np.asarray(model.H), C)
    K, L_r = np.asarray(gain, dtype=float), np.asarray(residual_gain, dtype=float)
    L_r = L_r * np.eye(len(C)) if L_r.ndim == 0 else L_r
    left = (np.eye(len(C)) + C @ found.M) @ F
    return ResidualChannel(found.free - K @ C, found.P @ E + found.free @ found.M @ F - K @ left, L_r @ C, L_r @ left)


def _entries(
    n: int, q: int, on_states: np.ndarray | None, on_measurements: np.ndarray | None
) -> tuple[np.ndarray, np.ndarray]:
    entries = [np.asarray(matrix, dtype=float) for matrix in (on_states, on_measurements) if matrix is not None]
    if not entries or any(matrix.ndim != 2 for matrix in entries):
        raise ValueError(
            f"Residual channel: give on_states of shape ({n}, k), on_measurements of shape ({q}, k), or both."
        )
    k = entries[0].shape[1]
    shapes = {"on_states": (on_states, (n, k)), "on_measurements": (on_measurements, (q, k))}
    E, F = (
        np.zeros(shape) if matrix is None else checked_matrix("Residual channel", name, matrix, shape, f"{k} signals")
        for name, (matrix, shape) in shapes.items()
    )
    return E, F
