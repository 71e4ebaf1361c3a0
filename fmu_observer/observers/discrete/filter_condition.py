"""Whether a filter has a steady state: the Riccati equation of its model, linearised at the start. Plain NumPy."""

from __future__ import annotations

import numpy as np

from fmu_observer.condition import Condition
from fmu_observer.design.pole_placement import observability_matrix
from fmu_observer.design.riccati import steady_filter
from fmu_observer.filtering.kalman import through
from fmu_observer.models.filter_model import FilterModel, Known


def steady_condition(
    model: FilterModel, x: np.ndarray, known: Known, period: float, noise: np.ndarray, readings: np.ndarray, source: str
) -> Condition:
    """Detectability, stabilisability by the noise, and the stationary Riccati equation, as numbers.

    Args:
        model: the model. x: state that it is linearised at, shape (n,). known: time, inputs and parameters there.
        period: of the measurements [s]. noise: covariance of the process noise in it, shape (r, r).
        readings: covariance of the measurement noise, shape (s, s). source: of the filter.

    Returns:
        The condition: it holds where the Riccati equation has a stabilising solution.
    """
    (F, W), (H, V) = model.transition_jacobians(x, known, period), model.measurement_jacobians(x, known)
    F, H, Q, R = (np.asarray(matrix) for matrix in (F, H, through(noise, W), through(readings, V)))
    steady, matrix = steady_filter(F, H, Q, R), observability_matrix(F, H)
    where = "" if model.linear else ", linearised at the start of the estimates"
    driven = observability_matrix(F.T, Q)
    rank, reached = int(np.linalg.matrix_rank(matrix)), int(np.linalg.matrix_rank(driven))
    return Condition(
        holds=steady is not None,
        values={
            "rank": rank,
            "order": model.order,
            "driven": reached,
            "smallest_singular_value": float(np.linalg.svd(matrix)[1][-1]),
            "spectral_radius": np.inf if steady is None else steady.spectral_radius,
        },
        statement="the gain settles and errors die out: the stationary Riccati equation has a stabilising solution, "
        f"with spectral_radius of A (I - K C) below 1{where}. Of {model.order} states the measurements observe {rank}, "
        f"and the process noise drives {reached}",
        source=source,
    )
