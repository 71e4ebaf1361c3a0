"""Errors that move between vertices: one quadratic Lyapunov function for all of them, and the decay it proves.

For ``de = A(t) e`` with A(t) anywhere in the convex hull of given matrices, however fast it moves: Takagi-Sugeno and
quasi-LPV observers whose premises are measured. The answer of the cone solver is a candidate; numbers are recomputed.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import reduce
from math import inf

import numpy as np

from fmu_observer.certificates.bisection import bisected
from fmu_observer.certificates.quadratic import QuadraticCondition, common_quadratic_form, decrease, flow_condition

_BISECTIONS = 20
_ROUNDING = 1e-12  # of the largest number in an inequality


@dataclass(frozen=True)
class PolytopeStability:
    """What one Lyapunov function ``e' P e`` proves for all mixtures of the vertices.

    Attributes:
        decay: largest rate found such that the error falls at least as ``exp(-decay t)`` [1/s]; -inf where no common P
            was found, even for stability alone.
        abscissa: largest real part of an eigenvalue at the vertices [1/s]; no decay beyond ``-abscissa`` is possible.
        overshoot: ``sqrt(lmax(P) / lmin(P))`` in the coordinates asked for: ``|e(t)| <= overshoot exp(-decay t)
            |e(0)|``.
        margin: least ``-lmax(A_i' P + P A_i + 2 decay P)``, recomputed, at trace(P) = n [1/s].
        lyapunov_matrix: P, shape (n, n), in the units of the error; empty where there is none.
    """

    decay: float
    abscissa: float
    overshoot: float
    margin: float
    lyapunov_matrix: np.ndarray

    @property
    def holds(self) -> bool:
        """Whether the error vanishes, whatever the mixture does."""
        return self.decay > 0.0


def polytope_stability(
    vertices: Sequence[np.ndarray] | np.ndarray, scaling: Sequence[float] | None = None, decay: float | None = None
) -> PolytopeStability:
    """Seek one Lyapunov function for all vertices, with the largest decay rate or with a given one.

    Args:
        vertices: ``A_i - K_i C``, each of shape (n, n) [1/s].
        scaling: n positive numbers T; the function is sought in ``T e``, where its numbers should be of order one.
        decay: the rate to prove [1/s]; None for the largest one, by bisection.

    Returns:
        What was proven.

    Raises:
        ValueError: there is no vertex, their shapes differ, or the scaling does not fit.
    """
    matrices = [np.asarray(A, dtype=float) for A in vertices]
    n = len(matrices[0]) if matrices and np.ndim(matrices[0]) else 0
    if not n or any(A.shape != (n, n) or not np.all(np.isfinite(A)) for A in matrices):
        shapes = ", ".join(str(A.shape) for A in matrices) or "none"
        raise ValueError(f"Polytope of errors: vertices of shapes {shapes}; expected finite ones of one shape (n, n).")
    T = np.ones(n) if scaling is None else np.asarray(scaling, dtype=float)
    if T.shape != (n,) or not np.all((T > 0.0) & np.isfinite(T)):
        raise ValueError(f"Polytope of errors: scaling {T.tolist()}, expected {n} positive numbers, one a state.")
    matrices = [A * T[:, None] / T for A in matrices]
    abscissa = max(float(np.linalg.eigvals(A).real.max()) for A in matrices)
    if decay is not None:
        found = _proven(matrices, decay)
        return _stability(found, decay if found else -inf, abscissa, T)
    return _fastest_proven(matrices, abscissa, T)


def _fastest_proven(matrices: list[np.ndarray], abscissa: float, scaling: np.ndarray) -> PolytopeStability:
    """The largest decay rate with a proof, by bisection."""
    proofs = {0.0: _proven(matrices, 0.0)}
    if proofs[0.0] is None:
        return _stability(None, -inf, abscissa, scaling)

    def provable(decay: float) -> bool:
        proofs[decay] = _proven(matrices, decay)
        return proofs[decay] is not None

    fastest, _ = bisected(provable, 0.0, -abscissa, _BISECTIONS)
    return _stability(proofs[fastest], fastest, abscissa, scaling)


def _proven(matrices: list[np.ndarray], decay: float) -> tuple[np.ndarray, float] | None:
    """P and its margin where the inequalities hold when recomputed, else None."""
    shifted = [A + decay * np.eye(len(A)) for A in matrices]
    if max(np.linalg.eigvals(A).real.max() for A in shifted) >= 0.0:
        return None
    conditions = reduce(QuadraticCondition.joined, map(flow_condition, shifted))
    found = common_quadratic_form(conditions)
    if found is None:
        return None
    rounding = _ROUNDING * max(float(np.abs(A).max()) for A in shifted) * float(np.abs(found.P).max())
    margin = -float(decrease(conditions, found.P).max()) - rounding
    return (found.P, margin) if margin > 0.0 else None


def _stability(
    found: tuple[np.ndarray, float] | None, decay: float, abscissa: float, scaling: np.ndarray
) -> PolytopeStability:
    if found is None:
        return PolytopeStability(-inf, abscissa, inf, -inf, np.zeros((0, 0)))
    sizes = np.linalg.eigvalsh(found[0])
    P = found[0] * scaling[:, None] * scaling
    return PolytopeStability(decay, abscissa, float(np.sqrt(sizes[-1] / sizes[0])), found[1], P)
