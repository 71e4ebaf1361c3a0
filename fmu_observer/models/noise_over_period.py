"""Process noise over a period, from its spectral density and exact Jacobians. Pure functions that trace."""

from __future__ import annotations

from fmu_observer.formulas.filtering.kalman import symmetric
from fmu_observer.models.filter_models import FilterModel, Known
from plant_models.hybrid import Array


def noise_over(model: FilterModel, x: Array, known: Known, period: Array, density: Array) -> Array:
    """Covariance that white noise on the states leaves after a period, by Simpson's rule of its integral.

    Exact for chains of up to two integrators; positive for any period.

    Args:
        model: holds for any period. x: state at the start, shape (n,). known: time, inputs and parameters.
        period: [s]. density: spectral density, shape (n, n) [x2/s].

    Returns:
        ``integral of F(s) density F(s)'`` over the period, shape (n, n).
    """
    half, _ = model.transition_jacobians(x, known, 0.5 * period)
    whole, _ = model.transition_jacobians(x, known, period)
    middle = half @ density @ half.T
    return symmetric((period / 6.0) * (density + 4.0 * middle + whole @ density @ whole.T))
