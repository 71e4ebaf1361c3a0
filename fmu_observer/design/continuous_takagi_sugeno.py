"""Gains of the continuous Takagi-Sugeno observer and the Lyapunov function behind them. Clarabel checks, cvxpy
designs.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import reduce
from math import inf
from typing import Any

import numpy as np

from fmu_observer.certificates.quadratic import QuadraticCondition, common_quadratic_form, decrease, flow_condition
from fmu_observer.design.cone_solver import load_cvxpy, solved
from fmu_observer.design.pole_placement import observer_gain
from fmu_observer.models.checks import check_numbers
from fmu_observer.models.takagi_sugeno import TakagiSugenoModel
from fmu_observer.observability import require_detectable_vertices

_POSITIVE = 1e-6  # of P in the design, whose trace is bounded by the unknowns being free
_SMALLEST, _BISECTIONS = 1e-9, 10  # of the search for the nearest decay, relative to what was asked
_SIZE = 1e-3  # weight of the size of the gains in the design [ours]


@dataclass(frozen=True)
class _VertexDecrease:
    """Common quadratic Lyapunov function of the vertex errors ``A_i - K_i C``.

    Attributes:
        margin: smallest decrease ``-lmax((A_i - K_i C)' P + P (A_i - K_i C))`` over the vertices, recomputed, at
        trace(P) = n in the
            model's scaled coordinates [1/s]; -inf when no P was found. abscissa: largest real part at the vertices
            [1/s].
    """

    margin: float
    abscissa: float


def placed_gains(model: TakagiSugenoModel, poles: np.ndarray) -> np.ndarray:
    """Gains K_i that give every vertex the same poles, shape (N, n, q).

    All measurements of the model count as continuous. The same poles at every vertex are not yet a common Lyapunov
    function:
    `vertex_decrease` says whether there is one.

    Raises:
        UnobservableError: a vertex is not observable; the message says which mode.
    """
    names, T = tuple(s.name for s in model.states), np.asarray(model.scaling)
    gains = []
    for i, A in enumerate(model.A):
        name = f"{model.name}, vertex {i + 1}"
        gains.append(observer_gain(A * T[:, None] / T, model.C / T, poles, names, name) / T[:, None])
    return np.stack(gains)


def vertex_errors(model: TakagiSugenoModel, gains: np.ndarray) -> list[np.ndarray]:
    """``A_i - K_i C`` in the model's scaled coordinates, N matrices of shape (n, n).

    Args:
        gains: of all vertices.
    """
    T = np.asarray(model.scaling)
    return [(A - K @ model.C) * T[:, None] / T for A, K in zip(model.A, gains, strict=True)]


def vertex_decrease(model: TakagiSugenoModel, gains: np.ndarray) -> _VertexDecrease:
    """Seek one P for all vertices by semidefinite programming and recompute what it gives.

    Args:
        model: N vertices. gains: shape (N, n, q).
    """
    errors = vertex_errors(model, gains)
    abscissa = max(float(np.linalg.eigvals(error).real.max()) for error in errors)
    conditions = reduce(QuadraticCondition.joined, map(flow_condition, errors))
    found = common_quadratic_form(conditions) if abscissa < 0.0 else None
    margin = -inf if found is None else -float(decrease(conditions, found.P).max())
    return _VertexDecrease(margin, abscissa)


def designed_gains(model: TakagiSugenoModel, decay: float = 1.0) -> np.ndarray:
    """Gains from the linear matrix inequalities ``A_i' P + P A_i - L_i C - C' L_i' + 2 decay P < 0``,
    ``K_i = inv(P) L_i``.

    Bouchama 2024, (1.26) with the term ``C' L_i'`` in the order that fits, and a decay rate [ours]. Among the solutions
    with P >= I one with small L_i is taken, so that the gains are not larger than the rate asks for.

    Args:
        model: N vertices; all its measurements count as continuous. decay: rate at which the error shall decay at least
            [1/s].

    Returns:
        Gains of shape (N, n, q) in SI units, their inequality recomputed.

    Raises:
        UnobservableError: a vertex has a mode that does not decay and is not measured; it is named.
        ValueError: no gains were found for that rate; the message says what was tried and the nearest rate that can be
        had.
        ImportError: cvxpy (extra `lmi`) is not installed.
    """
    check_numbers("Takagi-Sugeno Luenberger design", {}, {"decay": decay})
    require_detectable_vertices(model, "Takagi-Sugeno Luenberger design")
    gains = _proven(model, decay)
    if gains is not None:
        return gains
    nearest = _nearest_decay(model, decay)
    found = f"none down to {_SMALLEST * decay:.3g} 1/s" if nearest is None else f"{nearest:.3g} 1/s"
    raise ValueError(
        f"Takagi-Sugeno Luenberger design for {model.name!r}: no common P at the {model.vertices} vertices for decay "
        f"{decay:g} "
        f"1/s. Nearest decay found feasible: {found}. Ask for a smaller one, measure more, or narrow the bounds of the "
        f"premises."
    )


def _proven(model: TakagiSugenoModel, decay: float) -> np.ndarray | None:
    """Gains whose inequalities hold when recomputed, or None."""
    P, parts = _solve(model, decay)
    if P is None:
        return None
    T = np.asarray(model.scaling)
    gains = np.stack([np.linalg.solve(P, L) / T[:, None] for L in parts])
    closed = [error + decay * np.eye(model.order) for error in vertex_errors(model, gains)]
    worst = max(float(np.linalg.eigvalsh(E.T @ P + P @ E)[-1]) for E in closed)
    return gains if worst < 0.0 and np.linalg.eigvalsh(P)[0] > 0.0 else None


def _nearest_decay(model: TakagiSugenoModel, decay: float) -> float | None:
    """Largest decay below the one asked for with proven gains, by bisection of its logarithm; None down to a
    billionth.
    """
    low, high = _SMALLEST * decay, decay
    if not decay or _proven(model, low) is None:
        return None
    for _ in range(_BISECTIONS):
        middle = float(np.sqrt(low * high))
        low, high = (middle, high) if _proven(model, middle) is not None else (low, middle)
    return low


def _solve(model: TakagiSugenoModel, decay: float) -> tuple[np.ndarray | None, list[np.ndarray]]:
    cp = load_cvxpy("Design by linear matrix inequalities")
    T, n = np.asarray(model.scaling), model.order
    C = model.C / T
    P: Any = cp.Variable((n, n), symmetric=True)
    parts: list[Any] = [cp.Variable((n, len(C))) for _ in model.A]
    constraints = [np.eye(n) << P]
    for A, L in zip(model.A, parts, strict=True):
        product = P @ (A * T[:, None] / T) - L @ C
        constraints.append(product + product.T + 2.0 * decay * P << -_POSITIVE * np.eye(n))
    cost = cp.trace(P) + _SIZE * sum(cp.sum_squares(L) for L in parts)
    if not solved(cp, cp.Problem(cp.Minimize(cost), constraints)):
        return None, []
    return np.asarray(P.value), [np.asarray(L.value) for L in parts]
