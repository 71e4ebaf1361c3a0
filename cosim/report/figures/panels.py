"""All figures of a report, in order, and as PNG."""

from __future__ import annotations

from cosim.drawing.style import png
from cosim.evaluation.spec import ReportSpec
from cosim.report.figures.panel import Panel
from cosim.results.result import Result
from plant_models.registry import Registry

FIGURES: Registry[type[Panel]] = Registry(
    "figure", ("cosim.report.figures",), "cosim.figures", "cosim.report.figures.panel:Panel"
)


def panels() -> list[type[Panel]]:
    """All figures in the order of the report; the log names one that cannot be loaded."""
    return sorted(FIGURES.usable().values(), key=lambda panel: panel.place)


def draw_all(result: Result, spec: ReportSpec) -> dict[type[Panel], bytes]:
    """All figures that a run has, as PNG, in the order of the report.

    Args:
        result: the run.
        spec: roles of the signals, labels, phases and zones.
    """
    return {panel: png(panel.draw(result, spec, None).figure) for panel in panels() if panel.available(result, spec)}
