"""All pictures of a run as PNG: its figures and its enlarged windows."""

from __future__ import annotations

from cosim.evaluation.spec import ReportSpec
from cosim.report.figures.panels import draw_all
from cosim.report.figures.zooms import draw_zooms
from cosim.results.result import Result


def run_pictures(result: Result, spec: ReportSpec) -> dict[str, bytes]:
    """All pictures of a run, PNG by the stem of its file name.

    Args:
        result: the run. spec: roles.
    """
    panels = {panel.name: data for panel, data in draw_all(result, spec).items()}
    return panels | {zoom.key: zoom.png for zoom in draw_zooms(result, spec)}
