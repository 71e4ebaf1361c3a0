"""A calibrated run: each measured signal over its fit, and its residuals over time. Knows arrays only."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from cosim.drawing.style import BAND, BLACK, BLUE, TIME, new_figure, styled

Array = NDArray[np.float64]


@styled
def calibration_figure(
    time: Array, measured: Mapping[str, Array], residuals: Array, units: Mapping[str, str], noise: Array
) -> Figure:
    """Signals with their fit on the left, residuals with twice their standard deviation on the right.

    Args:
        time: instants [s], shape (n,). measured: signals by name, q of them, each of shape (n,).
        residuals: measured less fitted, shape (q, n). units: by name. noise: standard deviations, shape (q,).

    Returns:
        The figure.
    """
    figure = new_figure((9.6, 0.8 + 2.4 * len(measured)))
    panels = figure.subplots(len(measured), 2, squeeze=False)
    for i, (name, values) in enumerate(measured.items()):
        signal, rest = panels[i]
        unit = f" [{units[name]}]" if units.get(name) else ""
        signal.plot(time, values, color=BAND, linewidth=4.0, label="measured")
        signal.plot(time, values - residuals[i], color=BLUE, linewidth=1.3, label="fitted")
        signal.set(xlabel=TIME, ylabel=name + unit)
        signal.legend()
        rest.plot(time, residuals[i], ".", color=BAND, markersize=3.0)
        for edge in (-2.0, 0.0, 2.0):
            rest.axhline(edge * noise[i], color=BLACK, linewidth=0.6, linestyle="-" if edge == 0.0 else "--")
        rest.set(xlabel=TIME, ylabel=f"Residual{unit}")
    return figure
