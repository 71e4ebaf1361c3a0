"""All figures of a report, in order, and as files."""

from __future__ import annotations

import logging
from collections.abc import Iterator

from cosim.drawing.style import picture
from cosim.evaluation.spec import ReportSpec
from cosim.report.figures.panel import Panel
from cosim.results.result import Result
from plant_models.explained_error import explained
from plant_models.registry import Registry

LOG = logging.getLogger("cosim")

FIGURES: Registry[type[Panel]] = Registry(
    "figure", ("cosim.report.figures",), "cosim.figures", "cosim.report.figures.panel:Panel"
)


def panels() -> list[type[Panel]]:
    """All figures in the order of the report; the log names one that cannot be loaded."""
    return sorted(FIGURES.usable().values(), key=lambda panel: panel.place)


def draw_all(result: Result, spec: ReportSpec, kind: str = "png") -> dict[type[Panel], bytes]:
    """All figures that a run has, in the order of the report.

    Args:
        result: the run.
        spec: roles of the signals, labels, phases and zones.
        kind: of file, ``png`` or ``svg``.
    """
    return dict(_drawn(result, spec, kind))


def _drawn(result: Result, spec: ReportSpec, kind: str) -> Iterator[tuple[type[Panel], bytes]]:
    """A figure that fails is left out with a warning: it takes nothing along that is computed already."""
    for panel in panels():
        try:
            if panel.available(result, spec):
                yield panel, picture(panel.draw(result, spec).figure, kind)
        except Exception as error:
            LOG.warning("the figure %r is left out: %s", panel.name, explained(error))
