"""What a robust residual generator is asked: vertices, where disturbance and fault act, and three numbers. A value."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fmu_observer.design.residual_channel import ResidualChannel, residual_channel
from fmu_observer.models.checks import check_numbers, checked_matrix


@dataclass(frozen=True, eq=False)
class ResidualProblem:
    """``dx = sum h_i A_i x + D eta``, ``y = C x - F f``, ``r = M (y - yh)``: Aguiar Cota 2019, (3.35)-(3.45).

    Attributes:
        vertices: A_i, shape (N, n, n) [1/s]; one of them for a linear system.
        C: shape (q, n).
        disturbance: D, where eta acts, shape (n, nd).
        residual_gain: M, a positive number. It is chosen and not sought: the attenuation and the sensitivity are both
            proportional to it, and the least attenuation is that of M = 0.
        fault: F, how the fault reaches the measurement, shape (q, nf); None for the identity.
        decay: sigma, the rate at which the error is to fall [1/s]. With 0, as printed, the best gains are those of an
            observer whose integrators stand still.
        alpha: bound of ``K_i' P K_i`` (3.58).

    Raises:
        ValueError: a shape does not fit, or a number is not legal; the message names it.
    """

    vertices: np.ndarray
    C: np.ndarray
    disturbance: np.ndarray
    residual_gain: float
    fault: np.ndarray | None = None
    decay: float = 0.1
    alpha: float = 1.0

    def __post_init__(self) -> None:
        where = "Robust residual"
        A = np.asarray(self.vertices, dtype=float)
        A = A[None] if A.ndim == 2 else A
        if A.ndim != 3 or not A.size or A.shape[1] != A.shape[2]:
            raise ValueError(f"{where}: vertices have shape {A.shape}, expected (N, n, n), or (n, n) for one.")
        n = A.shape[1]
        q = np.shape(self.C)[0] if np.ndim(self.C) == 2 else 0
        nd = np.shape(self.disturbance)[1] if np.ndim(self.disturbance) == 2 else 0
        F = np.eye(q) if self.fault is None else np.asarray(self.fault, dtype=float)
        nf = F.shape[1] if F.ndim == 2 else 0
        shapes = {"C": (self.C, (q, n)), "disturbance": (self.disturbance, (n, nd)), "fault": (F, (q, nf))}
        for name, (value, shape) in shapes.items():
            reason = f"{n} states, {q} measurements, {nd} disturbances and {nf} faults"
            object.__setattr__(self, name, checked_matrix(where, name, value, shape, reason))
        object.__setattr__(self, "vertices", checked_matrix(where, "vertices", A, A.shape, f"{n} states"))
        numbers = {"residual_gain": self.residual_gain, "alpha": self.alpha}
        check_numbers(where, numbers, {"decay": self.decay})
        if not q or not nd or not np.any(self.disturbance):
            raise ValueError(f"{where}: expected at least one measurement and a disturbance that acts on a state.")

    @property
    def order(self) -> int:
        """Number of states, n."""
        return int(self.vertices.shape[1])

    def gains(self, values: np.ndarray) -> np.ndarray:
        """Gains K_i in one array, checked.

        Args:
            values: of shape (N, n, q).

        Raises:
            ValueError: they have another shape or are not finite.
        """
        shape = (*self.vertices.shape[:2], len(self.C))
        return checked_matrix("Robust residual", "gains", values, shape, "vertices, states and measurements")

    def disturbance_channels(self, gains: np.ndarray) -> list[ResidualChannel]:
        """From eta to r at each vertex.

        Args:
            gains: K_i, shape (N, n, q).
        """
        return [
            residual_channel(A, K, self.C, on_states=self.disturbance, residual_gain=self.residual_gain)
            for A, K in zip(self.vertices, self.gains(gains), strict=True)
        ]

    def fault_channels(self, gains: np.ndarray) -> list[ResidualChannel]:
        """From f to r at each vertex.

        Args:
            gains: K_i, shape (N, n, q).
        """
        F = -np.asarray(self.fault)
        return [
            residual_channel(A, K, self.C, on_measurements=F, residual_gain=self.residual_gain)
            for A, K in zip(self.vertices, self.gains(gains), strict=True)
        ]
