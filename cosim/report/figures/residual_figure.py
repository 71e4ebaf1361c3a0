"""Figure of residuals over their thresholds: when each raised its alarm, beside the true faults. For every detector
whose outputs `ratio_*` are such.
"""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes

from cosim.drawing.style import MARK, OBSERVER_LINES, PALE_RED
from cosim.evaluation.fault_detection import intervals
from cosim.evaluation.roles import recorded
from cosim.evaluation.spec import ReportSpec
from cosim.report.figures.drawing import logarithmic, thin
from cosim.report.figures.panel import Panel
from cosim.report.page.derived_curves import RATIO
from cosim.results.result import Result

FLOOR = 0.1  # smallest ratio that is drawn


def _ratio_signals(result: Result, spec: ReportSpec) -> dict[str, np.ndarray]:
    """Residuals over their thresholds by signal name, each shape (rows,)."""
    starts = tuple(f"{observer}.{RATIO}" for observer in spec.observers)
    return {name: result[name] for name in result.table.dtype.names or () if starts and name.startswith(starts)}


class ResidualsPanel(Panel):
    """Each residual over its threshold on a logarithmic axis: above 1 it raises an alarm. Those that never did are
    grey; true faults are shaded.
    """

    name = "residuals"
    title = "Residuals over their thresholds"
    caption = "Above the line a residual raises an alarm; grey: never did. Shaded: a fault acts."
    place = 3.45

    @classmethod
    def plot(cls, result: Result, spec: ReportSpec, ax: Axes) -> None:  # noqa: D102 - see Panel
        true = recorded(result, spec.true_fault)
        for start, end in intervals(result.time, true) if true is not None else []:
            ax.axvspan(start, end, color=PALE_RED, zorder=0.5)
        several, coloured = len(spec.observers) > 1, 0
        for name, ratio in _ratio_signals(result, spec).items():
            time, values = thin(result.time, np.maximum(np.nan_to_num(ratio, posinf=1e6), FLOOR))
            if np.max(values) <= 1.0:
                ax.plot(time, values, color=MARK, linewidth=0.5, alpha=0.5)
                continue
            observer, _, signal = name.partition(f".{RATIO}")
            text = signal.replace("_", " ")
            ax.plot(time, values, label=f"{observer}: {text}" if several else text, **OBSERVER_LINES[coloured % 6])
            coloured += 1
        ax.axhline(1.0, color=MARK, linewidth=1.2, label="threshold")
        logarithmic(ax)
        ax.set_ylim(bottom=FLOOR)
        ax.set_ylabel("Residual / threshold [1]")

    @classmethod
    def available(cls, result: Result, spec: ReportSpec) -> bool:  # noqa: D102 - see Panel
        return bool(_ratio_signals(result, spec))
