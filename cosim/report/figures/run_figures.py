"""Figures of speed, slip and adhesion force. Draws on the axes it is given, or on a figure of its own."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import chain
from typing import Any, ClassVar

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Rectangle

from cosim.drawing.style import (
    BLACK,
    NOISY_LINE,
    ODOMETER_LINE,
    PALE,
    REFERENCE_LINE,
    TRUE_LINE,
    TRUE_LINE_ABOVE,
    WILD_LINE,
    observer_line,
)
from cosim.evaluation.indicators import on_intervals
from cosim.evaluation.roles import estimate, label, recorded
from cosim.evaluation.spec import ReportSpec
from cosim.report.figures.drawing import FORCE, SLIP, SPEED, axis_unit, curve, shade_zones
from cosim.report.figures.panel import Panel, any_estimate
from cosim.report.figures.scales import curve_size, drawn, value_limits
from cosim.results.result import Result
from cosim.results.shown_unit import ShownUnit

_OTHER_LINE: dict[str, Any] = {"color": BLACK, "linewidth": 1.2}
_DASHES: tuple[Any, ...] = ("--", "-.", (0, (6, 2)), (0, (3, 1, 1, 1, 1, 1)))  # of other trains
_STRIP = 0.055  # height of an indicator's strip as a share of the axes


def _estimates(result: Result, spec: ReportSpec, signal: str, unit: ShownUnit) -> dict[str, np.ndarray]:
    found = {observer: estimate(result, observer, signal) for observer in spec.observers}
    return {observer: drawn(values, unit) for observer, values in found.items() if values is not None}


def _scaled(result: Result, name: str | None, unit: ShownUnit) -> list[np.ndarray]:
    values = recorded(result, name)
    return [] if values is None else [drawn(values, unit)]


def _draw(
    ax: Axes,
    result: Result,
    curves: Sequence[np.ndarray],
    limits: tuple[float, float] | None,
    text: str,
    line: dict[str, Any],
) -> None:
    for values in curves:
        curve(ax, result.time, values, limits, label=text, **line)


def _draw_estimates(
    ax: Axes, result: Result, spec: ReportSpec, estimates: Mapping[str, np.ndarray], limits: tuple[float, float] | None
) -> None:
    settled = result.time >= spec.evaluate_after
    for observer, values in estimates.items():
        line, text = observer_line(spec.observers, observer), label(spec, observer)
        if _is_wild(values[settled], limits):
            line, text = line | WILD_LINE, f"{text} (off scale)"
        elif _is_noisy(values[settled]):
            line = line | NOISY_LINE
        _draw(ax, result, [values], limits, text, line)
    if limits is not None:
        ax.set_ylim(*limits)


def _indicator_strips(ax: Axes, result: Result, spec: ReportSpec, limits: tuple[float, float] | None) -> None:
    """One strip for each indicator at the bottom, in the observer's colour where it is on, in the order of the
    observers.
    """
    low, high = limits or (0.0, 1.0)
    found = [(o, v) for o in spec.observers if (v := estimate(result, o, "slip_indicator")) is not None]
    share = _STRIP * len(found)
    if found:
        ax.add_patch(Rectangle((0.0, 0.0), 1.0, share, transform=ax.transAxes, color=PALE, linewidth=0, zorder=3.0))
    for i, (observer, values) in enumerate(found):
        bars = [(a, b - a) for a, b in on_intervals(result.time, values)]
        place = (share - (i + 0.9) * _STRIP, 0.8 * _STRIP)
        colour = observer_line(spec.observers, observer)["color"]
        text = "indicator on" if i == 0 else None
        ax.broken_barh(bars, place, transform=ax.get_xaxis_transform(), facecolor=colour, label=text, zorder=3.1)
    ax.set_ylim(low - (high - low) * share / (1 - share), high)
    ax.set_yticks([tick for tick in ax.get_yticks() if low <= tick <= high])


class _RunPanel(Panel):
    """Drawn where one of these roles is recorded, or one of these outputs estimated."""

    roles: ClassVar[tuple[str, ...]]
    estimates: ClassVar[tuple[str, ...]]

    @classmethod
    def available(cls, result: Result, spec: ReportSpec) -> bool:
        recorded_roles = (recorded(result, getattr(spec, role)) for role in cls.roles)
        return any(values is not None for values in recorded_roles) or any_estimate(result, spec, *cls.estimates)


class SpeedPanel(_RunPanel):
    """True speed, odometer, reference, other trains and estimates in the unit in which they are shown, against time."""

    name = "speed"
    title = "Speed"
    caption = "True speed, odometer, reference, other trains of the run and estimates."
    place = 1
    roles, estimates = ("true_speed", "odometer", "speed_reference"), ("speed",)

    @classmethod
    def plot(cls, result: Result, spec: ReportSpec, ax: Axes) -> None:  # noqa: D102 - see Panel
        names = [f"{name}.speed" for name in (*spec.observers, *spec.other_trains)]
        unit = axis_unit(result, [spec.true_speed, spec.odometer, spec.speed_reference, *names], SPEED)
        true, odometer = _scaled(result, spec.true_speed, unit), _scaled(result, spec.odometer, unit)
        reference, estimates = _scaled(result, spec.speed_reference, unit), _estimates(result, spec, "speed", unit)
        others = {train: _scaled(result, f"{train}.speed", unit) for train in spec.other_trains}
        limits = value_limits([*true, *reference, *chain(*others.values())], odometer + list(estimates.values()))
        shade_zones(ax, spec)
        _draw(ax, result, true, limits, "true", TRUE_LINE)
        _draw(ax, result, odometer, limits, "odometer", ODOMETER_LINE)
        _draw(ax, result, reference, limits, "reference", REFERENCE_LINE)
        for i, (train, found) in enumerate(others.items()):
            line = _OTHER_LINE | {"linestyle": _DASHES[i % len(_DASHES)]}
            _draw(ax, result, found, limits, label(spec, train), line)
        _draw_estimates(ax, result, spec, estimates, limits)
        ax.set_ylabel(f"Speed [{unit.name}]")


class SlipPanel(_RunPanel):
    """True and estimated slip, and bars below them where the slip indicators were on, against time."""

    name = "slip"
    title = "Slip"
    caption = "True and estimated slip; bars where a slip indicator is on, in the legend's order. Locked wheel: -1."
    place = 4
    roles, estimates = ("true_slip",), ("slip", "slip_indicator")
    size = (8.2, 3.8)

    @classmethod
    def plot(cls, result: Result, spec: ReportSpec, ax: Axes) -> None:  # noqa: D102 - see Panel
        unit = axis_unit(result, [spec.true_slip, *(f"{observer}.slip" for observer in spec.observers)], SLIP)
        true, estimates = _scaled(result, spec.true_slip, unit), _estimates(result, spec, "slip", unit)
        settled = result.time >= spec.evaluate_after
        limits = value_limits([v[settled] for v in true], [v[settled] for v in estimates.values()])
        shade_zones(ax, spec)
        _draw(ax, result, true, limits, "true", TRUE_LINE)
        _draw_estimates(ax, result, spec, estimates, limits)
        _indicator_strips(ax, result, spec, limits)
        ax.set_ylabel(f"Slip [{unit.name}]")


class AdhesionPanel(_RunPanel):
    """True and estimated adhesion force in the unit in which they are shown, against time; the estimates' spikes may
    leave the axis.
    """

    name = "adhesion"
    title = "Adhesion force"
    caption = "True and estimated adhesion force; short spikes may be cut."
    place = 5
    roles, estimates = ("true_adhesion_force",), ("adhesion_force",)

    @classmethod
    def plot(cls, result: Result, spec: ReportSpec, ax: Axes) -> None:  # noqa: D102 - see Panel
        names = [spec.true_adhesion_force, *(f"{observer}.adhesion_force" for observer in spec.observers)]
        unit = axis_unit(result, names, FORCE)
        true = _scaled(result, spec.true_adhesion_force, unit)
        estimates = _estimates(result, spec, "adhesion_force", unit)
        limits = value_limits(true, list(estimates.values()))
        shade_zones(ax, spec)
        true_line = TRUE_LINE_ABOVE if any(map(_is_noisy, estimates.values())) else TRUE_LINE
        _draw(ax, result, true, limits, "true", true_line)
        _draw_estimates(ax, result, spec, estimates, limits)
        ax.set_ylabel(f"Adhesion force [{unit.name}]")
        ax.ticklabel_format(axis="y", useOffset=False)  # a force that does not change has no scale of its own


def _is_wild(values: np.ndarray, limits: tuple[float, float] | None) -> bool:
    """Whether a curve has left the axis by more than its height, for more than a spike.

    Args:
        values: values, shape (rows,).
        limits: lowest and highest value of the axis, or None.
    """
    return limits is not None and curve_size(values - sum(limits) / 2) > 1.5 * (limits[1] - limits[0])


def _is_noisy(values: np.ndarray) -> bool:
    """Whether a curve turns round at more than a quarter of its rows: drawn in full width it would hide all others.

    Args:
        values: values, shape (rows,).
    """
    with np.errstate(invalid="ignore", over="ignore"):
        steps = np.diff(values)
        turns = steps[1:] * steps[:-1] < 0
    return bool(np.count_nonzero(turns) > 0.25 * max(len(turns), 100))
