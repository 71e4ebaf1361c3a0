"""Fit of acceleration runs to measured speeds: least squares on the solution of the model, not on a derivative of the
measurement. Many runs at once.

With white noise on the speed this is the maximum-likelihood estimate. A regression on differences of the measured speed
would be biased, since the noise stands on both sides of it, and a smoothed one has no covariance to be trusted.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy
from numpy.typing import NDArray

from fmu_observer.identification.acceleration_run import PARAMETERS, Array, integration_grid, speeds_and_sensitivities
from fmu_observer.identification.least_squares import serial_correlation, serial_enlargement

_COUNT = len(PARAMETERS)
_ITERATIONS = 25
_CONVERGED, _ROUNDING = 1e-7, 1e-8  # of the standard deviations of the estimates, and of the estimates themselves


@dataclass(frozen=True)
class RunFits:
    """What was found from each run.

    Args:
        parameters: estimates in the order of `acceleration_run.PARAMETERS`, shape (4, runs).
        covariance: of the estimates, shape (runs, 4, 4).
        residuals: measured less fitted speed [m/s], shape (runs, n).
        noise: standard deviation of the residuals [m/s], shape (runs,).
        correlation: of neighbouring residuals, shape (runs,).
        condition: condition number of the sensitivities, each scaled to length 1, shape (runs,).
        freedom: samples less parameters.
        converged: whether the iteration came to rest, shape (runs,).
    """

    parameters: Array
    covariance: Array
    residuals: Array
    noise: Array
    correlation: Array
    condition: Array
    freedom: int
    converged: NDArray[np.bool_]

    def half_widths(self, level: float) -> Array:
        """Half of the confidence intervals, by quantiles of Student's t.

        Args:
            level: probability that an interval covers the true value, between 0 and 1.

        Returns:
            In the units of the parameters, shape (4, runs).
        """
        deviations = np.sqrt(np.einsum("rii->ir", self.covariance))
        return np.asarray(float(scipy.stats.t.ppf(0.5 + 0.5 * level, self.freedom)) * deviations)


def fit_runs(time: Array, speeds: Array, forcing: Array | None = None) -> RunFits:
    """Fit the model to each run by Gauss-Newton steps from a regression on integrals of the measured speed.

    Where neighbouring residuals are alike (a filter in the sensor, aggregated samples), the covariance is enlarged by
    (1 + r) / (1 - r) with their correlation r, as for noise of first order.

    Args:
        time: of the samples [s], shape (n,), increasing.
        speeds: measured [m/s], shape (runs, n).
        forcing: known part of the acceleration at begin and end of each interval [m/s2], shape (2, n - 1); None for
            none.

    Returns:
        The estimates with their covariances.
    """
    time = time - time[0]
    grid = integration_grid(time, forcing)
    estimates = _first_guess(time, speeds, forcing)
    converged = np.zeros(len(speeds), dtype=bool)
    for _ in range(_ITERATIONS):
        with np.errstate(all="ignore"):  # a run that cannot be fitted is told by `converged`
            found = speeds_and_sensitivities(time, estimates, forcing, grid)
            inverse, projected, _, _ = _normal(found[1:], speeds - found[0])
            step = np.einsum("rij,rj->ir", inverse, projected)
            size = np.sum((speeds - found[0]) ** 2, axis=1) / (len(time) - _COUNT)
            deviations = np.sqrt(np.einsum("rii->ir", inverse) * size)
            converged = np.all(np.abs(step) <= _CONVERGED * deviations + _ROUNDING * np.abs(estimates), axis=0)
            estimates = estimates + step
        if converged.all():
            break
    found = speeds_and_sensitivities(time, estimates, forcing, grid)
    residuals = speeds - found[0]
    inverse, _, condition, _ = _normal(found[1:], residuals)
    return with_covariance(estimates, inverse, residuals, condition, converged)


def with_covariance(
    estimates: Array, inverse: Array, residuals: Array, condition: Array, converged: NDArray[np.bool_]
) -> RunFits:
    """Fits with the covariance that their residuals tell.

    Args:
        estimates: shape (p, runs). inverse: of the normal matrices, shape (runs, p, p).
        residuals: shape (runs, n). condition: condition numbers, shape (runs,).
        converged: shape (runs,).

    Returns:
        The fits.
    """
    count = residuals.shape[1]
    freedom = count - len(estimates)
    squares = np.sum(residuals**2, axis=1)
    correlation = serial_correlation(residuals)
    covariance = inverse * (squares / freedom * serial_enlargement(residuals))[:, None, None]
    return RunFits(
        estimates, covariance, residuals, np.sqrt(squares / freedom), correlation, condition, freedom, converged
    )


def _first_guess(time: Array, speeds: Array, forcing: Array | None) -> Array:
    """Regression of the speed on integrals of itself: v = v0 + q t + a t - w1 int v - w2 int v^2, shape (4, runs)."""
    known = 0.0 if forcing is None else np.append(0.0, np.cumsum(np.diff(time) * forcing.mean(axis=0)))
    first = scipy.integrate.cumulative_trapezoid(speeds, time, axis=1, initial=0.0)
    second = scipy.integrate.cumulative_trapezoid(speeds**2, time, axis=1, initial=0.0)
    lines = np.broadcast_to(time, speeds.shape)
    columns = np.stack([lines, -first, -second, np.ones_like(speeds)])
    inverse, projected, _, _ = _normal(columns, speeds - known)
    return np.asarray(np.einsum("rij,rj->ir", inverse, projected))


def _normal(columns: Array, values: Array) -> tuple[Array, Array, Array, Array]:
    """Inverse of the normal matrix, projected values, condition number and lengths of the columns.

    Args:
        columns: shape (p, runs, n). values: shape (runs, n).
    """
    lengths = np.sqrt(np.sum(columns**2, axis=2))
    lengths = np.where(lengths > 0.0, lengths, 1.0)
    scaled = columns / lengths[:, :, None]
    matrix = np.einsum("irn,jrn->rij", scaled, scaled)
    singular = np.linalg.svd(matrix, compute_uv=False)
    condition = np.sqrt(singular[:, 0] / np.maximum(singular[:, -1], 1e-30))
    inverse = np.linalg.pinv(matrix, rcond=1e-14, hermitian=True) / np.einsum("ir,jr->rij", lengths, lengths)
    return inverse, np.einsum("irn,rn->ri", columns, values), condition, lengths
