"""A fitted run: what was measured over what was fitted, and the residuals over speed. Knows arrays only."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from cosim.drawing.style import BAND, BLACK, BLUE, TIME, VERMILION, new_figure, styled

Array = NDArray[np.float64]
BINS = 20


@styled
def residual_figure(time: Array, measured: Array, residuals: Array) -> Figure:
    """Speed over time with its fit, and residuals over speed with their means, which show what the model misses.

    Args:
        time: [s], shape (n,). measured: speed [m/s], shape (n,). residuals: measured less fitted [m/s], shape (n,).

    Returns:
        The figure.
    """
    figure = new_figure((8.2, 5.6))
    speed, below = figure.subplots(2, 1)
    speed.plot(time, measured, color=BAND, linewidth=4.0, label="measured")
    speed.plot(time, measured - residuals, color=BLUE, linewidth=1.3, label="fitted")
    speed.set(xlabel=TIME, ylabel="Speed [m/s]")
    speed.legend()
    below.plot(measured, residuals, ".", color=BAND, markersize=3.0, label="residuals")
    edges = np.linspace(measured.min(), measured.max(), BINS + 1)
    places = np.clip(np.digitize(measured, edges) - 1, 0, BINS - 1)
    counts = np.bincount(places, minlength=BINS)
    means = np.bincount(places, residuals, minlength=BINS)[counts > 0] / counts[counts > 0]
    middles = 0.5 * (edges[1:] + edges[:-1])
    below.plot(middles[counts > 0], means, color=VERMILION, linewidth=1.5, label="their means")
    below.axhline(0.0, color=BLACK, linewidth=0.6)
    below.set(xlabel="Speed [m/s]", ylabel="Residual [m/s]")
    below.legend()
    return figure
