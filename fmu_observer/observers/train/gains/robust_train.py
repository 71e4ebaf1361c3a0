"""Robust gains for the train observer `quasi_lpv_uio`: a decay rate and a size, as its parameters."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from fmu_observer.design.quasi_lpv_published import SEEN, quasi_lpv_vertices
from fmu_observer.design.robust_residual import ResidualProblem, RobustResidualDesign, design_robust_residual
from fmu_observer.observers.parameter_values import Value, parameter_values
from fmu_observer.observers.train.quasi_lpv_uio import QuasiLpvUio

SIZE = 2.2  # of alpha over M^2 [ours]: between 0.1 and 0.3 1/s the gains are then of the size of those printed


def design_quasi_lpv_gains(
    decay: float,
    alpha: float | None = None,
    parameters: Mapping[str, Value] | None = None,
    attenuation: float | None = None,
) -> tuple[dict[str, Any], RobustResidualDesign]:
    """Gains of the observer `quasi_lpv_uio` with the least attenuation: Algorithm 3-2 of Aguiar Cota 2019, repaired.

    The disturbance of the design is an acceleration, D = e1. The error of a continuous speed decays at the rate asked
    for; what the sampling of the odometer leaves of it is the observer's own `findings`.

    Args:
        decay: rate at which the error is to fall [1/s]. alpha: bound of ``K' P K``; None for 2.2 M^2.
        parameters: values of the observer that replace its defaults: mass, davis_b, davis_c, schedule_min,
            schedule_max, residual_gain.
        attenuation: lambda that is demanded, from an acceleration [m/s2] to the residual [m/s]; None for the least one.

    Returns:
        Parameters for the observer by name, and the design with its margins.

    Raises:
        InfeasibleResidualDesign: there are no such gains; the message says which demand stands in the way, and the
            nearest values that can be had.
        ValueError: a parameter is unknown or not legal.
        ImportError: cvxpy (extra `lmi`) is not installed.
    """
    observer = QuasiLpvUio()
    p = observer.unpack_parameters(parameter_values(observer, parameters, purpose="to design for"))
    low, high, M = float(p.schedule_min), float(p.schedule_max), float(p.residual_gain)
    vertices = quasi_lpv_vertices(float(p.davis_b / p.mass), float(p.davis_c / p.mass), low, high)
    size = SIZE * M**2 if alpha is None else alpha
    problem = ResidualProblem(vertices, SEEN, np.eye(3)[:, :1], M, decay=decay, alpha=size)
    design = design_robust_residual(problem, attenuation)
    gains = [tuple(map(float, gain)) for gain in design.gains[:, :, 0]]
    return {"gain_low": gains[0], "gain_high": gains[1]}, design
