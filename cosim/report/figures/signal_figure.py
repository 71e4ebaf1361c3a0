"""Recorded signals over time, those of one unit in one panel."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure

from cosim.drawing.style import TIME, new_figure, observer_line, styled
from cosim.report.figures.drawing import curve, legend_above
from cosim.results.result_data import ResultData, SignalInfo
from cosim.results.shown_unit import shared_unit

_WIDTH, _HEIGHT = 8.4, 2.55  # [inch], of a panel


@styled
def signal_figure(result: ResultData, signals: Sequence[SignalInfo]) -> Figure:
    """Signals over one time axis, a panel for each unit in which they are kept.

    Args:
        result: the run. signals: what is drawn.

    Returns:
        The figure; save it with ``figure.savefig(path)``.
    """
    units = list(dict.fromkeys(signal.unit for signal in signals))
    figure = new_figure((_WIDTH, _HEIGHT * max(len(units), 1)))
    rows = figure.subplots(max(len(units), 1), 1, sharex=True, squeeze=False)[:, 0]
    for ax, unit in zip(rows, units, strict=False):
        shown = [signal for signal in signals if signal.unit == unit]
        names, axis = [signal.name for signal in shown], shared_unit(signal.shown for signal in shown)
        for signal in shown:
            values = axis.values(np.asarray(result[signal.name], dtype=float))
            held = "steps-post" if signal.variability == "discrete" else "default"
            curve(ax, result.time, values, None, label=signal.name, drawstyle=held, **observer_line(names, signal.name))
        ax.set_ylabel(f"[{axis.name}]" if len(shown) > 1 else f"{shown[0].name} [{axis.name}]")
        if len(shown) > 1:
            legend_above(ax)
    rows[-1].set_xlabel(TIME)
    return figure
