"""The speed of a train under a known effort, with its sensitivities to what is to be identified; many runs at once.

The model is (5.1)-(5.2) of Aguiar Cota 2019, v' = q(t) + a - w1 v - w2 v^2, where a is the effort less the constant
resistance, and q(t) what is known of the effort beyond a constant.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

PARAMETERS = ("net_acceleration", "w1", "w2", "initial_speed")
"""What a run is described by: a [m/s2], w1 [1/s], w2 [1/m], v(0) [m/s]."""
_GRID_STEP, _GRID_MOST = 0.25, 400  # [s]; speeds change over many seconds, so that fourth order is exact to rounding


def integration_grid(time: Array, forcing: Array | None) -> Array:
    """Instants of the integration: the samples themselves where the effort changes, a uniform grid otherwise.

    Args:
        time: of the samples [s], shape (n,).
        forcing: what is known of the acceleration at begin and end of each interval [m/s2], shape (2, n - 1); None for
            a constant effort.

    Returns:
        Instants [s], from the first to the last sample.
    """
    if forcing is not None:
        return time
    span = time[-1] - time[0]
    count = int(np.clip(np.ceil(span / _GRID_STEP), 40, _GRID_MOST))
    return np.linspace(time[0], time[-1], count + 1)


def speeds_and_sensitivities(
    time: Array, parameters: Array, forcing: Array | None = None, grid: Array | None = None
) -> Array:
    """Speeds of many runs and their derivatives by `PARAMETERS`, at the samples.

    Runge-Kutta steps of fourth order on the grid, cubic Hermite polynomials between.

    Args:
        time: of the samples [s], shape (n,), increasing.
        parameters: as `PARAMETERS`, shape (4, runs).
        forcing: known part of the acceleration at begin and end of each interval between samples [m/s2], shape
            (2, n - 1), on a line within it; None for none.
        grid: instants of the integration [s]; None for `integration_grid`.

    Returns:
        Shape (5, runs, n): the speed [m/s], and its derivatives in the order of `PARAMETERS`.
    """
    grid = integration_grid(time, forcing) if grid is None else grid
    known = np.zeros((2, len(grid) - 1)) if forcing is None else forcing
    state = np.zeros((5, parameters.shape[1]))
    state[0], state[4] = parameters[3], 1.0
    values, rates = np.empty((len(grid), *state.shape)), np.empty((len(grid), *state.shape))
    for k, instant in enumerate(grid):
        begin, end = known[:, min(k, len(grid) - 2)]
        values[k], rates[k] = state, _rate(state, parameters, begin)
        if k + 1 == len(grid):
            break
        step, middle = grid[k + 1] - instant, 0.5 * (begin + end)
        second = _rate(state + 0.5 * step * rates[k], parameters, middle)
        third = _rate(state + 0.5 * step * second, parameters, middle)
        fourth = _rate(state + step * third, parameters, end)
        state = state + step / 6.0 * (rates[k] + 2.0 * second + 2.0 * third + fourth)
    return _between(grid, values, rates, time)


def _rate(state: Array, parameters: Array, known: float) -> Array:
    """Rates of speed and sensitivities, shape (5, runs)."""
    speed = state[0]
    net, linear, square = parameters[0], parameters[1], parameters[2]
    slope = -linear - 2.0 * square * speed
    rate: Array = slope * state
    rate[0] = known + net - linear * speed - square * speed**2
    rate[1] += 1.0
    rate[2] -= speed
    rate[3] -= speed**2
    return rate


def _between(grid: Array, values: Array, rates: Array, time: Array) -> Array:
    """Values at the samples by cubic Hermite polynomials, shape (5, runs, n)."""
    left = np.clip(np.searchsorted(grid, time, side="right") - 1, 0, len(grid) - 2)
    width = grid[left + 1] - grid[left]
    s = (time - grid[left]) / width
    weights = np.array(
        [(1 + 2 * s) * (1 - s) ** 2, s * (1 - s) ** 2 * width, s**2 * (3 - 2 * s), -(s**2) * (1 - s) * width]
    )
    parts = (values[left], rates[left], values[left + 1], rates[left + 1])
    total = sum(weight[:, None, None] * part for weight, part in zip(weights, parts, strict=True))
    return np.moveaxis(np.asarray(total), 0, -1)
