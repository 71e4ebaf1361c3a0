"""The picture that shows a whole run at a glance: speed, speed error, slip and gaps over one time axis."""

from __future__ import annotations

from matplotlib.figure import Figure

from cosim.drawing.style import headline, new_figure, styled
from cosim.evaluation.spec import ReportSpec
from cosim.report.figures.drawing import legend_above
from cosim.report.figures.panels import panels as all_panels
from cosim.results.result import Result

_MAIN_PANELS = ("speed", "speed_error", "slip", "gaps")
WIDTH, HEIGHT = 8.4, 2.55  # inches; the height of one panel


@styled
def main_picture(result: Result, spec: ReportSpec) -> Figure:
    """Speed, speed error, slip and sampling gaps below each other, as far as they were recorded.

    Args:
        result: the run. spec: roles.

    Returns:
        The figure; save it with ``figure.savefig(path)``.
    """
    panels = [p for p in all_panels() if p.name in _MAIN_PANELS and p.available(result, spec)]
    figure = new_figure((WIDTH, HEIGHT * max(len(panels), 1)))
    headline(figure, spec.title)
    if not panels:
        return figure
    rows = figure.subplots(len(panels), 1, sharex=True, squeeze=False)[:, 0]
    repeated: set[str] = set()
    for ax, panel in zip(rows, panels, strict=True):
        panel.draw(result, spec, ax)
        legend_above(ax, sorted(repeated))
        repeated |= set(ax.get_legend_handles_labels()[1])
        if ax is not rows[-1]:
            ax.set_xlabel("")
    return figure
