"""The curves of a run for its page: every recorded signal, the errors of the observers, and which are drawn first.
Imports NumPy only.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np

from cosim.evaluation.roles import UNITS, Quantity, estimate, estimation_error, label, recorded
from cosim.evaluation.spec import ReportSpec
from cosim.report.live.live_page import Look, PageCurve, PagePanel, PageRecording
from cosim.results.result import Result, SignalInfo

QUANTITIES: tuple[Quantity, ...] = ("speed", "position")
_SHOWN_UNITS, _SHOWN_CURVES = 3, 6
"""Of a run without roles: how many units are drawn at first, and how many signals of each."""


def _error_name(observer: str, quantity: Quantity) -> str:
    """Name of the curve of an error.

    Args:
        observer: name of its component. quantity: whose error.
    """
    return f"{observer}.{quantity} error"


def error_panel(quantity: Quantity) -> str:
    """Title of the panel of an error.

    Args:
        quantity: whose error.
    """
    return f"{quantity.capitalize()} error"


def run_recording(result: Result, spec: ReportSpec, name: str = "run") -> PageRecording:
    """All recorded signals, shown in their own units, then the errors of the observers.

    Args:
        result: the run. spec: roles. name: of the recording.
    """
    looks = _looks(spec)
    known = {signal.name: signal for signal in result.signals}
    curves = []
    for column in (result.table.dtype.names or ())[1:]:
        signal = known.get(column, SignalInfo(column))
        unit, held, text = signal.unit, signal.variability == "discrete", signal.description
        component, _, variable = column.partition(".")
        shown = f"{spec.labels[component]}: {variable}" if component in spec.labels else ""
        curves.append(PageCurve(column, result[column], unit, held, text, looks.get(column, ""), shown, signal.shown))
    return PageRecording(name, result.time, [*curves, *_errors(result, spec)])


def _looks(spec: ReportSpec) -> Mapping[str | None, Look]:
    true: dict[str | None, Look] = dict.fromkeys(
        (spec.true_position, spec.true_speed, spec.true_slip, spec.true_adhesion_force), "true"
    )
    return true | {spec.odometer: "measured", spec.speed_reference: "wanted"}


def _errors(result: Result, spec: ReportSpec) -> Iterator[PageCurve]:
    for quantity in QUANTITIES:
        for observer in spec.observers:
            error = estimation_error(result, spec, observer, quantity)
            if error is not None:
                text = f"Estimated minus true {quantity} of {label(spec, observer)}"
                name = _error_name(observer, quantity)
                yield PageCurve(name, error, UNITS[quantity], False, text, "", label(spec, observer))


def run_panels(result: Result, spec: ReportSpec) -> list[PagePanel]:
    """What is drawn first: speed and errors; slip, forces, positions and faults are offered. Without roles, the signals
    that change, by their units.

    Args:
        result: the run. spec: roles.
    """
    panels = [_speed(result, spec), *(_error_panel(result, spec, quantity) for quantity in QUANTITIES)]
    panels += [
        _role_panel("Position", result, spec, spec.true_position, "position"),
        _role_panel("Slip", result, spec, spec.true_slip, "slip"),
        _role_panel("Adhesion force", result, spec, spec.true_adhesion_force, "adhesion_force"),
        _role_panel("Faults", result, spec, spec.true_fault, spec.detection),
        _role_panel("Slip indicators", result, spec, None, "slip_indicator"),
    ]
    found = [panel for panel in panels if panel.curves]
    errors = any(panel.curves and panel.is_shown for panel in panels[1:])
    if errors or recorded(result, spec.true_speed) is not None:
        return found
    return [*_changing_panels([result]), *(replace(panel, is_shown=False) for panel in found)]


def _known(result: Result, names: Sequence[str | None]) -> list[str]:
    return [name for name in names if name is not None and recorded(result, name) is not None]


def _speed(result: Result, spec: ReportSpec) -> PagePanel:
    """The truth first and the estimates last: what is drawn later lies above."""
    names = [spec.true_speed, spec.odometer, spec.speed_reference, *(f"{train}.speed" for train in spec.other_trains)]
    estimates = [f"{o}.speed" for o in spec.observers if estimate(result, o, "speed") is not None]
    return PagePanel("Speed", list(dict.fromkeys([*_known(result, names), *estimates])))


def _error_panel(result: Result, spec: ReportSpec, quantity: Quantity) -> PagePanel:
    names = [
        _error_name(o, quantity) for o in spec.observers if estimation_error(result, spec, o, quantity) is not None
    ]
    return PagePanel(error_panel(quantity), names)


def _role_panel(title: str, result: Result, spec: ReportSpec, true: str | None, output: str) -> PagePanel:
    estimates = [f"{o}.{output}" for o in spec.observers if estimate(result, o, output) is not None]
    return PagePanel(title, [*_known(result, [true]), *estimates], is_shown=False)


def _changing_panels(results: Sequence[Result]) -> list[PagePanel]:
    """Signals that change, by unit, those units first that most of them have.

    Args:
        results: runs that are drawn over each other.
    """
    by_unit: dict[str, list[str]] = {}
    for result in results:
        for signal in result.signals:
            values = result[signal.name]
            finite = values[np.isfinite(values)]
            names = by_unit.setdefault(signal.shown.name, [])
            if len(finite) and np.min(finite) < np.max(finite) and signal.name not in names:
                names.append(signal.name)
    ordered = sorted(
        ((u, names) for u, names in by_unit.items() if names), key=lambda entry: (entry[0] == "1", -len(entry[1]))
    )
    return [
        PagePanel(f"Signals [{unit}]", names[:_SHOWN_CURVES], is_shown=i < _SHOWN_UNITS)
        for i, (unit, names) in enumerate(ordered)
    ]
