"""A linear system and how it is measured: ``dx = A x``, continuously ``C_continuous x``, at instants ``C_sampled x``;
or the same from one step to the next. A value.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True, eq=False)
class MeasuredSystem:
    """The matrices of a question about observability.

    Args:
        A: shape (n, n) [1/s and the units of the states].
        C_continuous: what is measured at all times, shape (q1, n), or None.
        C_sampled: what is measured at the instants of a pattern, shape (q2, n), or None.
        states: names of the states; ``x1`` ... ``xn`` where none are matrix.
        scales: a typical size of each state, so that states of different units can be compared, shape (n,); 1 where not
            matrix.
        name: for messages. step: length [s] of the step over which A leads; 0 where it is that of ``dx = A x``.

    Raises:
        ValueError: a shape does not fit, a number is not finite, a scale is not positive, or nothing is measured.
    """

    A: np.ndarray
    C_continuous: np.ndarray | None = None
    C_sampled: np.ndarray | None = None
    states: Sequence[str] = ()
    scales: Sequence[float] | np.ndarray = ()
    name: str = "system"
    step: float = 0.0

    def __post_init__(self) -> None:
        A = np.array(self.A, dtype=float)
        if A.ndim != 2 or A.shape[0] != A.shape[1] or not A.size:
            raise ValueError(f"{self.name}: A has shape {A.shape}, expected (n, n) with n at least 1.")
        n = len(A)
        found = {"A": A, "scales": np.array(self.scales if len(self.scales) else np.ones(n), dtype=float)}
        for key in ("C_continuous", "C_sampled"):
            matrix = getattr(self, key)
            C = np.zeros((0, n)) if matrix is None else np.atleast_2d(np.array(matrix, dtype=float))
            if C.shape[1] != n:
                raise ValueError(f"{self.name}: {key} has shape {C.shape}, expected {n} columns as A has.")
            found[key] = C
        object.__setattr__(self, "states", tuple(self.states) or tuple(f"x{i + 1}" for i in range(n)))
        if len(self.states) != n or found["scales"].shape != (n,):
            raise ValueError(
                f"{self.name}: {len(self.states)} state names, {found['scales'].size} scales; expected {n} of each."
            )
        wrong = [key for key, value in found.items() if not np.isfinite(value).all()]
        if wrong or (found["scales"] <= 0.0).any():
            raise ValueError(
                f"{self.name}: {wrong[0] if wrong else 'scales'} must hold finite numbers, scales positive ones."
            )
        if not len(found["C_continuous"]) and not len(found["C_sampled"]):
            raise ValueError(f"{self.name}: nothing is measured; give C_continuous, C_sampled, or both.")
        for key, value in found.items():
            object.__setattr__(self, key, value)

    @property
    def order(self) -> int:
        """Number of states, n."""
        return len(self.A)

    @property
    def C(self) -> np.ndarray:
        """All measurements, continuous ones first, shape (q1 + q2, n)."""
        return np.vstack([self.C_continuous, self.C_sampled])  # type: ignore[list-item]

    def scaled(self) -> MeasuredSystem:
        """The same system in states divided by their scales."""
        S, inverse = np.diag(self.scales), np.diag(1.0 / np.asarray(self.scales))
        return MeasuredSystem(
            inverse @ self.A @ S,
            self.C_continuous @ S,
            self.C_sampled @ S,
            self.states,
            name=self.name,
            step=self.step,
        )
