"""Judges of values: errors of estimates, differences of two signals, bounds of a signal. Imports NumPy only."""

from __future__ import annotations

from collections.abc import Sequence
from math import inf, nan
from typing import TYPE_CHECKING, Any

import numpy as np

from cosim.evaluation.metrics import error_size, instants
from cosim.expectations.judged import Judged, at, given, with_unit
from cosim.expectations.run import NotRecordedError, Run, span
from cosim.expectations.window import Window

if TYPE_CHECKING:
    from cosim.scenario.expectation_tables import DifferenceExpectation, ErrorExpectation, SignalExpectation

ERRORS = {
    "speed_error": ("true_speed", "speed", "m/s"),
    "position_error": ("true_position", "position", "m"),
    "slip_error": ("true_slip", "slip", "1"),
    "adhesion_force_error": ("true_adhesion_force", "adhesion_force", "N"),
}
"""By check: role of the true value in the report, output of the observer, SI unit."""


def judge_error(item: ErrorExpectation, run: Run) -> list[Judged]:
    """Errors of the estimates of each observer, from the start of the evaluation on where no window is given."""
    role, output, unit = ERRORS[item.check]
    true = getattr(run.spec, role)
    if true is None:
        raise NotRecordedError(f"nothing measured: the report has no {role}")
    window = run.window(item.start, item.end, max(run.start, run.spec.evaluate_after))
    found = []
    for observer in observers_of(item.of, run):
        error = _difference(run.recorded(f"{observer}.{output}"), run.recorded(true))
        name = f"{item.check} of {observer}"
        found += _judge_sizes(name + "{}" + span(item.start, item.end), item, window, error, unit)
    return found


def observers_of(given: str | Sequence[str] | None, run: Run) -> list[str]:
    """Names of the observers an expectation speaks of; those of the report where it names none."""
    if given is None:
        return list(run.spec.observers)
    return [given] if isinstance(given, str) else list(given)


def judge_difference(item: DifferenceExpectation, run: Run) -> list[Judged]:
    """One signal minus another."""
    error = _difference(run.recorded(item.signal), run.recorded(item.reference))
    window = run.window(item.start, item.end)
    name = f"difference of {item.signal} and {item.reference}"
    return _judge_sizes(name + "{}" + span(item.start, item.end), item, window, error, run.unit(item.signal))


def judge_signal(item: SignalExpectation, run: Run) -> list[Judged]:
    """Smallest, largest and last value of a signal."""
    values, unit, window = run.recorded(item.signal), run.unit(item.signal), run.window(item.start, item.end)
    shown, when = values[window.rows], window.time
    base: dict[str, Any] = {"check": item.check, "unit": unit}
    name = f"{item.signal}{{}}{span(item.start, item.end)}"
    found = []
    if item.min is not None:
        found.append(_bounded(name.format(", min"), base, window, when, shown, item.min, inf))
    if item.max is not None:
        found.append(_bounded(name.format(", max"), base, window, when, shown, -inf, item.max))
    if item.final is not None:
        found.append(_bounded(name.format(", final"), base, window, when[-1:], shown[-1:], *item.final, last=True))
    return found


def _difference(values: np.ndarray, reference: np.ndarray) -> np.ndarray:
    with np.errstate(invalid="ignore", over="ignore"):  # inf - inf: NaN is judged as what it is
        return np.asarray(values - reference)


def _judge_sizes(name: str, item: Any, window: Window, error: np.ndarray, unit: str) -> list[Judged]:
    """Largest size and root mean square of an error, as far as they are limited; `name` has a place for which it is."""
    time, shown = window.time, error[window.rows]
    size = error_size(time, shown)
    found = []
    for what, measured in (("max", size.max_abs), ("rms", size.rms)):
        limit = getattr(item, what)
        if limit is None:
            continue
        judged: dict[str, Any] = {"name": name.format(f", {what}"), "check": item.check, "limit": limit, "unit": unit}
        nothing = _nothing_measured(window, time, shown, window.fewest)
        if nothing is not None:
            found.append(Judged(passed=False, **judged, **nothing))
            continue
        when = float(time[np.argmax(np.abs(shown))]) if what == "max" else nan
        text = f"{with_unit(measured, unit)}{at(when)}, allowed {given(limit, unit)}"
        passed = measured <= limit
        text += f"; {window.unreached}" if passed and window.broken else ""
        found.append(Judged(passed=passed and not window.broken, measured=measured, when=when, text=text, **judged))
    return found


def _bounded(
    name: str,
    base: dict[str, Any],
    window: Window,
    time: np.ndarray,
    values: np.ndarray,
    low: float,
    high: float,
    *,
    last: bool = False,
) -> Judged:
    """Whether values lie between two bounds, one of which may be infinite."""
    unit = base["unit"]
    nothing = _nothing_measured(window, time, values, 1 if last else window.fewest)
    if nothing is not None:
        return Judged(name, passed=False, limit=low if high == inf else high, **base, **nothing)
    excess = np.maximum(values - high, low - values)
    row = int(np.argmax(excess))
    measured, when = float(values[row]), float(time[row])
    passed = bool(low <= measured <= high)
    allowed = f"at least {given(low, unit)}" if high == inf else f"at most {given(high, unit)}"
    if last:
        allowed = f"{given(low)} to {given(high, unit)}"
    limit = low if high == inf or measured < low else high
    text = f"{with_unit(measured, unit)}{at(when)}, expected {allowed}"
    text += f"; {window.unreached}" if passed and window.broken else ""
    if last and window.broken:
        text, passed = f"{with_unit(measured, unit)} so far, expected {allowed}; {window.unreached}", False
    return Judged(
        name, passed=passed and not window.broken, measured=measured, limit=limit, when=when, text=text, **base
    )


def _nothing_measured(window: Window, time: np.ndarray, values: np.ndarray, fewest: int) -> dict[str, Any] | None:
    """What to say where there are fewer than `fewest` instants, or values that are no finite numbers; None where all is
    well.
    """
    count = instants(time)
    if count < fewest:
        rows = f"only {count} instant{'s' * (count > 1)}, too few to judge:" if count else "nothing measured: no row"
        between = f"{rows} between {given(window.start)} and {given(min(window.end, window.reached))} s"
        return {"text": window.unreached if window.reached < window.start else between}
    bad = np.flatnonzero(~np.isfinite(values))
    if not len(bad):
        return None
    first = float(time[bad[0]])
    what = "not a number" if np.isnan(values[bad[0]]) else "infinite"
    return {
        "measured": inf,
        "when": first,
        "text": f"{what} at {given(first)} s; {len(bad)} of {len(values)} rows are not finite",
    }
