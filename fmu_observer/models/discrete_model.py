"""An observer model over one sampling period, for observers that live at the samples. Plain NumPy that traces, no gain.

The period may be a traced value: it is a parameter of the observers and may differ from the one they were designed for.
"""

from __future__ import annotations

import numpy as np

from fmu_observer.models.observer_model import ObserverModel
from plant_models.hybrid import Array
from plant_models.hybrid.integration import rk4_step

_TAYLOR_DEGREE = 10
_SQUARINGS = 6  # the remainder of the series is below 1e-14 while the norm of A times the period is below 16
_SUBSTEPS = 4  # Runge-Kutta steps in one period of a nonlinear model


def _zero_order_hold(A: np.ndarray, B: np.ndarray, period: Array) -> tuple[Array, Array]:
    """``A_d = exp(A T)`` and ``B_d = (integral of exp(A s) from 0 to T) B``, exact for inputs held over the period.

    By scaling, Taylor polynomial and squaring of a fixed number each, so that it traces.
    """
    n, m = B.shape
    block = np.zeros((n + m, n + m))
    block[:n, :n], block[:n, n:] = A, B
    scaled = block * (period / 2.0**_SQUARINGS)
    identity = np.eye(n + m)
    exponential = identity
    for k in range(_TAYLOR_DEGREE, 0, -1):
        exponential = identity + scaled @ exponential / float(k)
    for _ in range(_SQUARINGS):
        exponential = exponential @ exponential
    return exponential[:n, :n], exponential[:n, n:]


def transition(model: ObserverModel, x: Array, u: Array, period: Array) -> Array:
    """The state one period later, inputs held, shape (n,).

    Exact for a linear model; for a nonlinear one by 4 classical Runge-Kutta steps (error of the order (period / 4)^5).

    Args:
        model: the model. x: state, shape (n,). u: inputs, shape (m,). period: T [s].
    """
    if model.phi is None:
        A, B = _zero_order_hold(model.A, model.B, period)
        return A @ x + B @ u if len(model.inputs) else A @ x
    for _ in range(_SUBSTEPS):
        x = rk4_step(lambda _t, at: model.flow(at, u), 0.0, period / _SUBSTEPS, x)
    return x
