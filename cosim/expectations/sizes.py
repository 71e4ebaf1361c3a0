"""Values over a window against limits: largest size and root mean square of an error, bounds of a signal. Imports NumPy
only.
"""

from __future__ import annotations

from math import inf, isfinite, nan
from typing import Any

import numpy as np

from cosim.evaluation.metrics import error_size, instants
from cosim.expectations.evaluated import Evaluated, at, with_unit, written
from cosim.expectations.evaluated_run import TimeWindow
from cosim.results.shown_unit import ShownUnit


def difference(values: np.ndarray, reference: np.ndarray) -> np.ndarray:
    """One signal minus another, shape (rows,).

    Args:
        values, reference: the signals, shape (rows,).
    """
    with np.errstate(invalid="ignore", over="ignore"):  # inf - inf: NaN is judged as what it is
        return np.asarray(values - reference)


def evaluate_sizes(name: str, item: Any, window: TimeWindow, error: np.ndarray, unit: ShownUnit) -> list[Evaluated]:
    """Largest size and root mean square of an error, as far as they are limited.

    Args:
        name: of the expectation, with a place for which of the two it is. item: its table, with `max` and `rms`.
        window: that it speaks of. error: in SI, shape (rows,). unit: in which texts name it.
    """
    time, shown = window.time, error[window.rows]
    size = error_size(time, shown)
    found = []
    for what, measured in (("max", size.max_abs), ("rms", size.rms)):
        limit = getattr(item, what)
        if limit is None:
            continue
        evaluated: dict[str, Any] = {
            "name": name.format(f", {what}"),
            "check": item.check,
            "limit": limit,
            "unit": unit.kept,
        }
        nothing = _nothing_measured(window, time, shown, window.fewest)
        if nothing is not None:
            found.append(Evaluated(passed=False, **evaluated, **nothing))
            continue
        when = float(time[np.argmax(np.abs(shown))]) if what == "max" else nan
        value, allowed = (
            with_unit(unit.difference(measured), unit.name),
            _as_stated(limit, unit, unit.difference(limit)),
        )
        text = f"{value}{at(when)}, allowed {allowed}"
        passed = measured <= limit
        text += f"; {window.unreached}" if passed and window.broken else ""
        found.append(
            Evaluated(passed=passed and not window.broken, measured=measured, when=when, text=text, **evaluated)
        )
    return found


def bounded(
    name: str,
    base: dict[str, Any],
    window: TimeWindow,
    time: np.ndarray,
    values: np.ndarray,
    low: float,
    high: float,
    unit: ShownUnit,
    *,
    last: bool = False,
) -> Evaluated:
    """Whether values lie between two bounds, one of which may be infinite.

    Args:
        name: of the expectation. base: what else is known of it. window: that it speaks of.
        time, values: in the window, shape (rows,). low, high: the bounds, all in SI. unit: in which texts name them.
        last: whether only the last value counts.
    """
    base = base | {"unit": unit.kept}
    nothing = _nothing_measured(window, time, values, 1 if last else window.fewest)
    if nothing is not None:
        return Evaluated(name, passed=False, limit=low if high == inf else high, **base, **nothing)
    excess = np.maximum(values - high, low - values)
    row = int(np.argmax(excess))
    measured, when = float(values[row]), float(time[row])
    passed = bool(low <= measured <= high)
    least, most = (_as_stated(limit, unit, unit.value(limit)) for limit in (low, high))
    allowed = f"at least {least}" if high == inf else f"at most {most}"
    if last:
        allowed = f"{written(low)} to {most}" if unit.is_kept else f"{least} to {most}"
    limit = low if high == inf or measured < low else high
    value = with_unit(unit.value(measured), unit.name)
    text = f"{value}{at(when)}, expected {allowed}"
    text += f"; {window.unreached}" if passed and window.broken else ""
    if last and window.broken:
        text, passed = f"{value} so far, expected {allowed}; {window.unreached}", False
    scale = 0.5 * (high - low) if isfinite(high - low) else abs(limit)
    return Evaluated(
        name,
        passed=passed and not window.broken,
        measured=measured,
        limit=limit,
        when=when,
        text=text,
        margin=-float(excess[row]) / (scale or 1.0),
        **base,
    )


def _as_stated(limit: float, unit: ShownUnit, shown: float) -> str:
    """A limit as it is shown, and behind it as the scenario states it, which is in SI."""
    text = written(shown, unit.name)
    return text if unit.is_kept else f"{text} ({written(limit, unit.kept)})"


def _nothing_measured(window: TimeWindow, time: np.ndarray, values: np.ndarray, fewest: int) -> dict[str, Any] | None:
    """What to say where there are fewer than `fewest` instants, or values that are no finite numbers; None where all is
    well.
    """
    count = instants(time)
    if count < fewest:
        rows = f"only {count} instant{'s' * (count > 1)}, too few to judge:" if count else "nothing measured: no row"
        between = f"{rows} between {written(window.start)} and {written(min(window.end, window.reached))} s"
        return {"text": window.unreached if window.reached < window.start else between}
    bad = np.flatnonzero(~np.isfinite(values))
    if not len(bad):
        return None
    first = float(time[bad[0]])
    what = "not a number" if np.isnan(values[bad[0]]) else "infinite"
    return {
        "measured": inf,
        "when": first,
        "text": f"{what} at {written(first)} s; {len(bad)} of {len(values)} rows are not finite",
    }
