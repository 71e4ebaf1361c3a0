"""A calibrated run: each measured signal over its fit, and its residuals over time and over the signal itself. Knows
arrays only.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from cosim.drawing.style import BAND, BLACK, BLUE, TIME, VERMILION, new_figure, styled

Array = NDArray[np.float64]
_BINS = 20


@styled
def calibration_figure(
    time: Array, measured: Mapping[str, Array], residuals: Array, units: Mapping[str, str], noise: Array
) -> Figure:
    """Signals with their fit, residuals over time with twice their standard deviation, and residuals over the signal
    with their means, which show what the model misses.

    Args:
        time: instants [s], shape (n,). measured: signals by name, q of them, each of shape (n,).
        residuals: measured less fitted, shape (q, n). units: by name. noise: standard deviations, shape (q,).

    Returns:
        The figure.
    """
    figure = new_figure((13.2, 0.8 + 2.4 * len(measured)))
    panels = figure.subplots(len(measured), 3, squeeze=False)
    for i, (name, values) in enumerate(measured.items()):
        signal, rest, over = panels[i]
        unit = f" [{units[name]}]" if units.get(name) else ""
        signal.plot(time, values, color=BAND, linewidth=4.0, label="measured")
        signal.plot(time, values - residuals[i], color=BLUE, linewidth=1.3, label="fitted")
        signal.set(xlabel=TIME, ylabel=name + unit)
        signal.legend()
        rest.plot(time, residuals[i], ".", color=BAND, markersize=3.0)
        for edge in (-2.0, 0.0, 2.0):
            rest.axhline(edge * noise[i], color=BLACK, linewidth=0.6, linestyle="-" if edge == 0.0 else "--")
        rest.set(xlabel=TIME, ylabel=f"Residual{unit}")
        known = np.isfinite(values)
        _draw_means(over, values[known], residuals[i][known])
        over.set(xlabel=name + unit, ylabel=f"Residual{unit}")
    return figure


def _draw_means(axes: Any, values: Array, residuals: Array) -> None:
    """Residuals over the values, and their means in equal parts of the range."""
    axes.plot(values, residuals, ".", color=BAND, markersize=3.0, label="residuals")
    edges = np.linspace(values.min(), values.max(), _BINS + 1)
    places = np.clip(np.digitize(values, edges) - 1, 0, _BINS - 1)
    counts = np.bincount(places, minlength=_BINS)
    used = counts > 0
    means = np.bincount(places, residuals, minlength=_BINS)[used] / counts[used]
    axes.plot((0.5 * (edges[1:] + edges[:-1]))[used], means, color=VERMILION, linewidth=1.5, label="their means")
    axes.axhline(0.0, color=BLACK, linewidth=0.6)
    axes.legend()
