"""The first panels of a page as pictures that need no script, for a notebook."""

from __future__ import annotations

from collections.abc import Sequence

from cosim.report.live.live_page import PageCurve, PagePanel, PageRecording
from cosim.results.shown_unit import ShownUnit, shared_unit
from fmus.tables.line_picture import Line, line_picture

_PANELS = 2


def still_panels(recordings: Sequence[PageRecording], panels: Sequence[PagePanel], settled: float | None = None) -> str:
    """The panels that a page shows first, as HTML; empty where there is nothing to draw.

    Args:
        recordings: with the curves. panels: of the page. settled: as for `LivePage`.
    """
    first = [panel for panel in panels if panel.is_shown][:_PANELS]
    return "".join(_picture(recordings, panel, None if panel.is_whole else settled) for panel in first)


def _picture(recordings: Sequence[PageRecording], panel: PagePanel, settled: float | None) -> str:
    drawn = [(r, c) for name in panel.curves for r in recordings for c in r.curves if c.name == name]
    if not drawn:
        return ""
    shown = {id(c): _unit(c, [other for _, other in drawn]) for _, c in drawn}
    units = {unit.name for unit in shown.values()}
    title = f"{panel.title} [{min(units)}]" if len(units) == 1 and units != {"1"} else panel.title
    about = drawn[0][0]
    x_title = about.x_name if about.x_unit == "1" else f"{about.x_name} [{about.x_unit}]"
    lines = [
        Line(_label(r, c, recordings, panel), r.x, shown[id(c)].values(c.values), c.look, c.held) for r, c in drawn
    ]
    return line_picture(title, lines, x_title, settled)


def _unit(curve: PageCurve, drawn: Sequence[PageCurve]) -> ShownUnit:
    """The unit in which a curve is drawn: that of all curves beside it that are kept in its unit."""
    return shared_unit(c.shown or ShownUnit(c.unit, kept=c.unit) for c in drawn if c.unit == curve.unit)


def _label(recording: PageRecording, curve: PageCurve, recordings: Sequence[PageRecording], panel: PagePanel) -> str:
    """By its run where there are several, by its name where the panel has several."""
    name = curve.label or curve.name
    if len(recordings) == 1:
        return name
    return recording.label if len(panel.curves) == 1 else f"{name}, {recording.label}"
