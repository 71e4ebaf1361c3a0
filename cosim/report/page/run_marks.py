"""The marks of a run that a reader can jump to: telegrams, phases, zones, faults, warnings, what is worth a look.
Imports NumPy only.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from math import isfinite

import numpy as np

from cosim.diagnostics.messages import BAD
from cosim.evaluation.fault_detection import intervals
from cosim.evaluation.indicators import on_intervals
from cosim.evaluation.result_warnings import all_warnings
from cosim.evaluation.roles import UNITS, estimate, estimation_error, label, recorded
from cosim.evaluation.spec import ReportSpec
from cosim.report.live.live_page import Mark
from cosim.report.page.run_curves import QUANTITIES, error_panel
from cosim.report.zoom_windows import NOT_TAKEN, notable_windows
from cosim.results.result import BaliseRecord, Result
from fmus.tables.numbers import number

_ODD = (*NOT_TAKEN, "doubted")
"""Outcomes of a telegram that was not used as it came."""
_MOST = 400
"""Intervals of one kind, messages: more would hide what matters."""
_INSTANT = re.compile(r"\b(?:at|t =|from) (-?[0-9.]+(?:e[-+]?[0-9]+)?) s\b")


def run_marks(result: Result, spec: ReportSpec) -> list[Mark]:
    """All marks of a run, by kind.

    Args:
        result: the run. spec: roles, phases, zones.
    """
    worst = sorted(_largest_errors(result, spec), key=lambda mark: (mark.panel, -abs(mark.value or 0.0)))
    marks = [*worst, *_notable(result, spec)]
    parts = spec.phases if len(spec.phases) > 1 else ()  # a single one is the run itself
    marks += [Mark("phase", p.start, f"phase {p.name}", p.end) for p in parts]
    marks += [Mark("zone", a, "low adhesion", b) for a, b in spec.zones]
    marks += [*_faults(result, spec), *_warnings(result, spec)]
    return [*marks, *map(_telegram, result.events)]


def _largest_errors(result: Result, spec: ReportSpec) -> Iterator[Mark]:
    """The largest error of each observer after the start-up."""
    settled = result.time >= spec.evaluate_after
    for quantity in QUANTITIES:
        for observer in spec.observers:
            error = estimation_error(result, spec, observer, quantity)
            if error is None or not settled.any():
                continue
            size = np.where(settled & np.isfinite(error), np.abs(error), -1.0)
            row = int(np.argmax(size))
            if size[row] > 0.0:
                text = f"largest {quantity} error of {label(spec, observer)}: {number(error[row])} {UNITS[quantity]}"
                yield Mark("worst", float(result.time[row]), text, None, error_panel(quantity), float(error[row]))


def _notable(result: Result, spec: ReportSpec) -> Iterator[Mark]:
    for window in notable_windows(result, spec):
        yield Mark("notable", window.time, "; ".join(window.reasons))


def _faults(result: Result, spec: ReportSpec) -> Iterator[Mark]:
    """True faults, and what the observers took for one."""
    true = recorded(result, spec.true_fault)
    if true is not None:
        yield from (Mark("fault", a, f"{spec.true_fault} acts", b) for a, b in intervals(result.time, true)[:_MOST])
    for observer in spec.observers:
        found = estimate(result, observer, spec.detection)
        if found is not None:
            text = f"{label(spec, observer)} reports {spec.detection.replace('_', ' ')}"
            yield from (Mark("detection", a, text, b) for a, b in intervals(result.time, found)[:_MOST])
        slip = estimate(result, observer, "slip_indicator")
        if slip is not None and len(slip):
            text = f"{label(spec, observer)} indicates slip"
            yield from (Mark("slip", a, text, b) for a, b in on_intervals(result.time, slip)[:_MOST])


def _warnings(result: Result, spec: ReportSpec) -> Iterator[Mark]:
    """Warnings that state an instant, messages that are no good news, the end of a run that failed."""
    for text in all_warnings(result, spec):
        if match := _INSTANT.search(text):
            yield Mark("warning", float(match[1]), text)
    for message in [m for m in result.messages if m.status in BAD][:_MOST]:
        if isfinite(message.time):
            yield Mark("message", message.time, f"{message.component}: {message.text}")
    if result.failure is not None and len(result.time):
        yield Mark("failure", float(result.time[-1]), result.failure)


def _telegram(event: BaliseRecord) -> Mark:
    if event.kind == "missed":
        return Mark("telegram problem", event.stamp, f"balise {event.identity} missed")
    if event.kind == "false":
        return Mark("telegram problem", event.stamp, f"false telegram {event.identity}")
    odd = [f"{outcome} at {receiver}" for receiver, outcome in event.outcomes.items() if outcome in _ODD]
    if odd:
        return Mark("telegram problem", event.stamp, f"balise {event.identity}: {', '.join(odd)}")
    return Mark("balise", event.stamp, f"balise {event.identity} at {number(event.true_position, 6)} m")
