"""Figures of several runs laid over each other: one line a run, one panel an observer. Draws on figures of its own."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from cosim.drawing.style import TIME, TRUE_LINE, new_figure, picture, run_line, styled
from cosim.evaluation.roles import Quantity, estimate, estimation_error, label, recorded
from cosim.report.figures.drawing import (
    FORCE,
    SLIP,
    SPEED,
    axis_unit,
    curve,
    legend_above,
    mark_evaluation,
    shade_zones,
    thin,
)
from cosim.report.figures.error_figures import ErrorCurve, draw_errors
from cosim.report.figures.scales import bounded, drawn, value_limits
from cosim.report.overlay.overlaid_runs import OverlayRun, observers_of, one_each
from cosim.results.shown_unit import ShownUnit, shared_unit

WIDTH, _FIRST_PANEL, _NEXT_PANEL = 8.2, 3.3, 2.2  # inches
Panel = tuple[str, dict[int, str]]
"""Title of a panel, and the observer of each run in it by index of the run."""


@dataclass(frozen=True, slots=True)
class _OverlayPicture:
    """A drawn figure.

    Args:
        key: stem of its file name. title: short. caption: what to see in it. data: the picture.
    """

    key: str
    title: str
    caption: str
    data: bytes


def draw_overlays(runs: Sequence[OverlayRun], signals: Sequence[str] = (), kind: str = "png") -> list[_OverlayPicture]:
    """All figures that the runs have something for.

    Args:
        runs: from `make_runs`. signals: names of recorded signals to draw besides those that have a role.
        kind: of file, ``png`` or ``svg``.
    """
    made = [
        ("speed", "Speed", "True speed of each run.", _true_speed_figure(runs)),
        ("speed_error", "Speed error", "Estimated minus true speed.", _error_overlay(runs, "speed")),
        ("position_error", "Position error", "Estimated minus true position.", _error_overlay(runs, "position")),
        ("slip", "Slip", "Estimated slip, and the true slip of the first run.", _estimate_overlay(runs, "slip")),
        (
            "adhesion",
            "Adhesion force",
            "Estimated adhesion force, and the true one of the first run.",
            _estimate_overlay(runs, "adhesion_force"),
        ),
        *((f"signal_{i}", name, "As recorded.", _signal_figure(runs, name)) for i, name in enumerate(signals, 1)),
    ]
    return [
        _OverlayPicture(f"overlay_{key}", title, text, picture(figure, kind))
        for key, title, text, figure in made
        if figure is not None
    ]


@styled
def _true_speed_figure(runs: Sequence[OverlayRun]) -> Figure | None:
    """True speed of all runs, or None without any."""
    found = [
        (i, run, speed)
        for i, run in enumerate(runs)
        if (speed := recorded(run.result, run.spec.true_speed)) is not None
    ]
    if not found:
        return None
    ax = _axes(runs, [("", {})])[0]
    unit = shared_unit(axis_unit(run.result, [run.spec.true_speed], SPEED) for _, run, _ in found)
    limits = value_limits([unit.values(bounded(speed)) for _, _, speed in found], [])
    for i, run, speed in found:
        curve(ax, run.result.time, unit.values(bounded(speed)), limits, label=run.label, **run_line(i))
    return _finished([ax], f"Speed [{unit.name}]", limits)


@styled
def _error_overlay(runs: Sequence[OverlayRun], quantity: Literal["speed", "position"]) -> Figure | None:
    """Errors of speed [m/s] or position [m], a panel for each observer, or None without any."""
    unit = "m/s" if quantity == "speed" else "m"
    panels = _panels(runs, lambda run, observer: estimation_error(run.result, run.spec, observer, quantity) is not None)
    if not panels:
        return None
    axes = _axes(runs, panels)
    for ax, (_, members) in zip(axes, panels, strict=True):
        draw_errors(
            ax, [_error_curve(runs[i], i, observer, quantity) for i, observer in members.items()], quantity, unit
        )
        mark_evaluation(ax, runs[0].result, runs[0].spec)
    return _finished(axes)


@styled
def _estimate_overlay(runs: Sequence[OverlayRun], signal: Literal["slip", "adhesion_force"]) -> Figure | None:
    """Estimates of the slip or the adhesion force in the unit in which they are shown, a panel for each observer, or
    None without any.
    """
    text, otherwise = ("Slip", SLIP) if signal == "slip" else ("Adhesion force", FORCE)
    panels = _panels(runs, lambda run, observer: estimate(run.result, observer, signal) is not None)
    if not panels:
        return None
    axes = _axes(runs, panels)
    name = getattr(runs[0].spec, f"true_{signal}")
    shown = [(runs[i].result, f"{observer}.{signal}") for _, members in panels for i, observer in members.items()]
    unit = shared_unit(axis_unit(result, [one], otherwise) for result, one in [(runs[0].result, name), *shown])
    true = recorded(runs[0].result, name)
    anchors = [] if true is None else [drawn(true, unit)]
    for ax, (_, members) in zip(axes, panels, strict=True):
        values = {i: drawn(runs[i].result[f"{observer}.{signal}"], unit) for i, observer in members.items()}
        limits = value_limits(
            anchors, [v[runs[i].result.time >= runs[i].spec.evaluate_after] for i, v in values.items()]
        )
        for band in anchors:
            curve(ax, runs[0].result.time, band, limits, label="true", **TRUE_LINE)
        for i, line in values.items():
            curve(ax, runs[i].result.time, line, limits, label=runs[i].label, **run_line(i))
        ax.set_ylabel(f"{text} [{unit.name}]")
        if limits is not None:
            ax.set_ylim(*limits)
    return _finished(axes)


@styled
def _signal_figure(runs: Sequence[OverlayRun], name: str) -> Figure | None:
    """One recorded signal of all runs, or None where no run has it."""
    found = [(i, run) for i, run in enumerate(runs) if recorded(run.result, name) is not None]
    if not found:
        return None
    ax = _axes(runs, [("", {})])[0]
    units = [s.shown for _, run in found for s in run.result.signals if s.name == name]
    unit = shared_unit(units) if units else ShownUnit("unit unknown")
    for i, run in found:
        values = bounded(unit.values(run.result[name]))
        ax.plot(*thin(run.result.time, np.where(np.isfinite(values), values, np.nan)), label=run.label, **run_line(i))
    return _finished([ax], f"{name} [{unit.name}]")


def _panels(runs: Sequence[OverlayRun], has: Callable[[OverlayRun, str], bool]) -> list[Panel]:
    if one_each(runs):
        members = {i: run.spec.observers[0] for i, run in enumerate(runs) if has(run, run.spec.observers[0])}
        return [("", members)] if members else []
    found = []
    for observer in observers_of(runs):
        members = {i: observer for i, run in enumerate(runs) if observer in run.spec.observers and has(run, observer)}
        if members:
            found.append((label(runs[min(members)].spec, observer), members))
    return found


def _error_curve(run: OverlayRun, index: int, observer: str, quantity: Quantity) -> ErrorCurve:
    error = estimation_error(run.result, run.spec, observer, quantity)
    assert error is not None  # by the choice of the panels
    return ErrorCurve(run.result.time, error, run.result.time >= run.spec.evaluate_after, run_line(index), run.label)


def _axes(runs: Sequence[OverlayRun], panels: Sequence[Panel]) -> list[Axes]:
    """Panels below each other over one time axis that holds all runs."""
    figure = new_figure((WIDTH, _FIRST_PANEL + _NEXT_PANEL * (len(panels) - 1)))
    axes: list[Axes] = list(figure.subplots(len(panels), 1, sharex=True, squeeze=False)[:, 0])
    start, end = min(float(r.result.time[0]) for r in runs), max(float(r.result.time[-1]) for r in runs)
    for ax, (title, _) in zip(axes, panels, strict=True):
        shade_zones(ax, runs[0].spec)
        if title:
            ax.text(0.995, 0.97, title, transform=ax.transAxes, ha="right", va="top", fontweight="bold", zorder=5)
    if end > start:
        axes[0].set_xlim(start, end)
    axes[-1].set_xlabel(TIME)
    return axes


def _finished(axes: Sequence[Axes], text: str | None = None, limits: tuple[float, float] | None = None) -> Figure:
    """Labels, limits and legends: each panel names what its first one does not."""
    named: set[str] = set()
    for ax in axes:
        if text is not None:
            ax.set_ylabel(text)
        if limits is not None:
            ax.set_ylim(*limits)
        legend_above(ax, sorted(named))
        named |= set(ax.get_legend_handles_labels()[1])
    figure = axes[0].get_figure(root=True)
    assert figure is not None
    return figure
