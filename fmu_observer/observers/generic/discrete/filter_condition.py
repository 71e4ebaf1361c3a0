"""Whether a filter has a steady state: the Riccati equation of its model, linearised at the start. Plain NumPy."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import scipy

from fmu_observer.certificates.finding import Finding, condition_found
from fmu_observer.design.pole_placement import observability_matrix
from fmu_observer.formulas.filtering.kalman import through
from fmu_observer.models.filter_models import FilterModel, Known
from plant_models.hybrid import Array


@dataclass(frozen=True)
class _SteadyFilter:
    """Steady state of the filter ``x+ = A x + w``, ``y = C x + v``.

    Attributes:
        gain: filter gain K of ``xh(k|k) = xh(k|k-1) + K (y - C xh(k|k-1))``, shape (n, q).
        predicted: covariance P(k|k-1), shape (n, n). updated: P(k|k), shape (n, n).
        spectral_radius: of ``A (I - K C)`` [1].
    """

    gain: np.ndarray
    predicted: np.ndarray
    updated: np.ndarray
    spectral_radius: float


DOUBTED, WRONG = 1e-4, 1e-2  # differences at half the step: reported, and too much for a filter to rest on [ours]
_INACCURATE = (
    "its transition over a period is not accurate: steps of half the length change it by {error:.2g} of its size; set "
    "a shorter sample_period or more substeps (option `substeps`), or leave that out and give the option `period`"
)


def steady_condition(
    model: FilterModel, x: np.ndarray, known: Known, period: float, noise: np.ndarray, readings: np.ndarray, source: str
) -> Finding:
    """Detectability, stabilisability by the noise, and the stationary Riccati equation, as numbers.

    Args:
        model: the model. x: state that it is linearised at, shape (n,). known: time, inputs and parameters there.
        period: of the measurements [s]. noise: covariance of the process noise in it, shape (r, r).
        readings: covariance of the measurement noise, shape (s, s). source: of the filter.

    Returns:
        The condition: it holds where the Riccati equation has a stabilising solution.
    """
    (F, W), (H, V) = model.transition_jacobians(x, known, period), model.measurement_jacobians(x, known)
    error = model.transition_error(x, known, period)
    if not np.isfinite(np.asarray(F)).all():
        return _inaccurate(error, source)
    F, H, Q, R = (np.asarray(matrix) for matrix in (F, H, through(noise, W), through(readings, V)))
    steady, observed = _steady_filter(F, H, Q, R), observability_matrix(F, H)
    rank, reached = (int(np.linalg.matrix_rank(m)) for m in (observed, observability_matrix(F.T, Q)))
    found = condition_found(
        holds=steady is not None and error <= WRONG,
        numbers={
            "rank": rank,
            "order": model.order,
            "driven": reached,
            "smallest_singular_value": float(np.linalg.svd(observed)[1][-1]),
            "spectral_radius": np.inf if steady is None else steady.spectral_radius,
        },
        statement=_statement(model, rank, reached),
        source=source,
        kind="exact",
    )
    return replace(found, conditions=(*found.conditions, _of_transition(error)))


def _statement(model: FilterModel, rank: int, driven: int) -> str:
    where = "" if model.linear else ", linearised at the start of the estimates"
    return (
        "the gain settles and errors die out: the stationary Riccati equation has a stabilising solution, with "
        f"spectral_radius of A (I - K C) below 1{where}. Of {model.order} states the measurements observe {rank}, and "
        f"the process noise drives {driven}; steps of half the length change the transition over a period by "
        f"transition_error, at most {WRONG:g}"
    )


def within_steps(model: FilterModel, p: Any) -> dict[str, Array]:
    """That the period is none in which steps are longer than those of the system that a model comes from.

    Args:
        model: the model.

    Returns:
        By text: 1 where it is fulfilled, else 0; nothing for a model of any period.
    """
    if not np.isfinite(model.longest_period):
        return {}
    text = (
        f"sample_period must be at most {model.longest_period:.9g} s: in a longer one each step of the transition is "
        "longer than the internal step of the plant; give the option period what sample_period is to be, or say by the "
        "option substeps how many steps are enough"
    )
    return {text: np.where(p.sample_period <= model.longest_period, 1.0, 0.0)}


def _inaccurate(error: float, source: str) -> Finding:
    """Of a transition that gives no numbers."""
    text = "the transition over a period is a number"
    return replace(condition_found(False, {}, text, source), conditions=(_of_transition(error),))


def _of_transition(error: float) -> Finding:
    accurate = error <= DOUBTED
    statement = "" if accurate else _INACCURATE.format(error=error)
    return Finding("transition_error", error, "1", "exact", "steps of half the length", accurate, statement)


def _steady_filter(A: np.ndarray, C: np.ndarray, QN: np.ndarray, RN: np.ndarray) -> _SteadyFilter | None:
    """Solve the discrete Riccati equation of the filter."""
    try:
        P = scipy.linalg.solve_discrete_are(A.T, C.T, QN, RN)
    except (np.linalg.LinAlgError, ValueError):
        return None
    gain = np.linalg.solve(C @ P @ C.T + RN, C @ P).T
    rest = np.eye(len(A)) - gain @ C
    radius = float(np.abs(np.linalg.eigvals(A @ rest)).max())
    return _SteadyFilter(gain, P, rest @ P, radius) if radius < 1.0 else None
