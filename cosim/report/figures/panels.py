"""All figures of a report: what each shows, whether a run has it, and as PNG."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from matplotlib.axes import Axes

from cosim.drawing.style import png
from cosim.evaluation.roles import estimate, estimation_error, recorded
from cosim.evaluation.spec import ReportSpec
from cosim.report.figures.error_figures import position_error_figure, speed_error_figure
from cosim.report.figures.gap_figure import gap_figure, sampling_gaps
from cosim.report.figures.run_figures import adhesion_figure, slip_figure, speed_figure
from cosim.results.result import Result


@dataclass(frozen=True)
class Panel:
    """A figure of the report.

    Args:
        key: stem of its file name. title: short. caption: what to see in it.
        draw: draws it on the axes given, or on its own for None. available: whether a run has something to draw.
    """

    key: str
    title: str
    caption: str
    draw: Callable[[Result, ReportSpec, Axes | None], Axes]
    available: Callable[[Result, ReportSpec], bool]


def _any_estimate(result: Result, spec: ReportSpec, *signals: str) -> bool:
    return any(estimate(result, observer, signal) is not None for observer in spec.observers for signal in signals)


def _has_speed(result: Result, spec: ReportSpec) -> bool:
    roles = (spec.true_speed, spec.odometer, spec.speed_reference)
    return any(recorded(result, name) is not None for name in roles) or _any_estimate(result, spec, "speed")


def _has_speed_error(result: Result, spec: ReportSpec) -> bool:
    return any(estimation_error(result, spec, observer, "speed") is not None for observer in spec.observers)


def _has_position_error(result: Result, spec: ReportSpec) -> bool:
    return any(estimation_error(result, spec, observer, "position") is not None for observer in spec.observers)


def _has_slip(result: Result, spec: ReportSpec) -> bool:
    return recorded(result, spec.true_slip) is not None or _any_estimate(result, spec, "slip", "slip_indicator")


def _has_adhesion(result: Result, spec: ReportSpec) -> bool:
    return recorded(result, spec.true_adhesion_force) is not None or _any_estimate(result, spec, "adhesion_force")


def _has_gaps(result: Result, _: ReportSpec) -> bool:
    return len(sampling_gaps(result)[1]) > 0


PANELS: tuple[Panel, ...] = (
    Panel("speed", "Speed", "True speed, odometer, reference and estimates.", speed_figure, _has_speed),
    Panel(
        "speed_error",
        "Speed error",
        "Estimated minus true speed. The scale follows the observers that work; one that leaves it is named in the "
        "legend.",
        speed_error_figure,
        _has_speed_error,
    ),
    Panel(
        "position_error",
        "Position error",
        "Estimated minus true position, on a scale chosen in the same way.",
        position_error_figure,
        _has_position_error,
    ),
    Panel(
        "slip",
        "Slip",
        "True and estimated slip; bars where a slip indicator is on, in the legend's order.",
        slip_figure,
        _has_slip,
    ),
    Panel(
        "adhesion",
        "Adhesion force",
        "True and estimated adhesion force; short spikes may be cut.",
        adhesion_figure,
        _has_adhesion,
    ),
    Panel(
        "gaps",
        "Sampling gaps",
        "Time between consecutive balises that were used, beside the largest varying gap each observer is certified "
        "for.",
        gap_figure,
        _has_gaps,
    ),
)


def draw_all(result: Result, spec: ReportSpec) -> dict[Panel, bytes]:
    """All figures that a run has, as PNG, in the order of the report.

    Args:
        result: the run.
        spec: roles of the signals, labels, phases and zones.
    """
    return {panel: png(panel.draw(result, spec, None).figure) for panel in PANELS if panel.available(result, spec)}
