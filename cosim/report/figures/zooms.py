"""The zoom figures of a report as PNG, with their texts."""

from __future__ import annotations

from dataclasses import dataclass

from cosim.drawing.style import png
from cosim.evaluation.spec import ReportSpec
from cosim.report.figures.zoom_figure import zoom_figure
from cosim.report.zoom_windows import MOST, ZoomWindow, notable_windows
from cosim.results.result import Result
from fmus.tables.numbers import number

ZOOM_KEYS = tuple(f"zoom_{i}" for i in range(1, MOST + 1))
"""Stems of the file names, in order of time."""
_VIEWS = {"errors": "Speed error and position error", "slip": "Speed error and slip"}


@dataclass(frozen=True, slots=True)
class Zoom:
    """A drawn zoom.

    Args:
        key: stem of its file name. title: what it is about. caption: what else is in it. png: the picture.
    """

    key: str
    title: str
    caption: str
    png: bytes


def draw_zooms(result: Result, spec: ReportSpec) -> list[Zoom]:
    """All zoom figures of a run in order of time; none where it has no errors.

    Args:
        result: the run.
        spec: roles of the signals, labels, phases and zones.
    """
    windows = notable_windows(result, spec)
    pictures = [png(zoom_figure(result, spec, window)) for window in windows]
    return [
        Zoom(key, window.reasons[0], _caption(window), picture)
        for key, window, picture in zip(ZOOM_KEYS, windows, pictures, strict=False)
    ]


def _caption(window: ZoomWindow) -> str:
    span = f"{_VIEWS[window.view]}, {number(window.start, 4)} s to {number(window.end, 4)} s."
    return " ".join([span, *(f"{reason}." for reason in window.reasons[1:])])
