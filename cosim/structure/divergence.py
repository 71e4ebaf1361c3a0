"""Where a run that ended in numbers that are none began to go wrong: read off the recorded rows afterwards, never in a
step.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from math import inf, isfinite
from typing import TYPE_CHECKING, Any

import numpy as np

from cosim.errors import RunError
from plant_models.hybrid.units import UnitError, parse_unit

if TYPE_CHECKING:
    from cosim.coupling.plan import Plan
    from cosim.coupling.planned import PlannedComponent

_PLAUSIBLE = {
    parse_unit(unit).exponents: limit
    for unit, limit in (("m", 1e7), ("m/s", 1e3), ("m/s2", 1e4), ("N", 1e9), ("W", 1e11), ("rad/s", 1e5))
}
"""Sizes in SI that nothing which runs on rails comes near."""
FAR = 1e6
"""A value of another unit is implausible beyond so many times its nominal value or its median, whichever is larger."""
SHOWN = 6  # inputs


@dataclass(frozen=True, slots=True)
class Departure:
    """A signal on its way out.

    Args:
        component, signal: whose output. row: of the table, the first outside. time: of it [s]. value: there [unit].
        why: what it left, in words. unit: of the component, for people.
    """

    component: str
    signal: str
    row: int
    time: float
    value: float
    why: str
    unit: str

    @property
    def text(self) -> str:
        """One sentence."""
        value = f"{self.value:.4g} {self.unit}".rstrip()
        return f"{self.component}.{self.signal} {self.why} first, at t = {self.time:.6g} s: {value}."


@dataclass(frozen=True, slots=True)
class _Range:
    low: float
    high: float
    why: str
    grave: float
    """How far beyond the range a value must come for its signal to count as lost, and not as declared too narrowly."""


def explained_failure(error: Exception, plan: Plan, table: Any) -> str:
    """The text of a failure, with the signal that went wrong first and what fed its component, where the rows show it.

    Args:
        error: that ended the run. plan: that was run. table: rows by ``component.signal``, in the components' own
            units.
    """
    found = _first_departure(plan, table) if isinstance(error, RunError) else None
    if found is None:
        return str(error)
    cause = f"{found.text} {_fed(plan, table, found)}"
    if (
        np.isfinite(plan.values) | plan.can_be_missing
    ).all():  # a component failed by itself: it may have other reasons
        return f"{error} Before that: {cause}"
    return f"{cause} In the end: {error}"


def _first_departure(plan: Plan, table: Any) -> Departure | None:
    """The signal that left its declared or plausible range first and did not come back; None where none did."""
    found = (_departure(step, signal, table) for step in plan.steps for signal in _signals(step, plan))
    return min((d for d in found if d is not None), key=lambda d: d.row, default=None)


def _signals(step: PlannedComponent, plan: Plan) -> list[str]:
    return [signal.name.partition(".")[2] for signal in plan.signals[step.columns]]


def _departure(step: PlannedComponent, signal: str, table: Any) -> Departure | None:
    name = step.component.name
    values = np.asarray(table[f"{name}.{signal}"], dtype=float)
    finite = np.isfinite(values) | (step.component.can_be_missing(signal) & np.isnan(values))
    rows = [] if finite.all() else [(int(np.argmin(finite)), "became no finite number")]
    for bounds in _ranges(step, signal, values[np.isfinite(values)]):
        excess = np.where(finite, np.maximum(values - bounds.high, bounds.low - values), inf)
        row = _for_good(excess > 0.0)
        if row is not None and excess.max() > bounds.grave:
            rows.append((row, bounds.why))
    if not rows:
        return None
    row, why = min(rows)
    return Departure(
        name, signal, row, float(table["time"][row]), float(values[row]), why, step.component.unit_name(signal) or ""
    )


def _for_good(outside: np.ndarray) -> int | None:
    """The first row outside from which on most rows are outside, up to an end outside; None where there is none."""
    if not len(outside) or not outside[-min(3, len(outside)) :].any():
        return None
    share = np.cumsum(outside[::-1])[::-1] / np.arange(len(outside), 0, -1)
    rows = np.flatnonzero(outside & (share >= 0.5))
    return int(rows[0]) if len(rows) else None


def _ranges(step: PlannedComponent, signal: str, values: np.ndarray) -> Iterator[_Range]:
    """What a signal should stay in: its declared range, and what is plausible for its unit or, without one, its
    history.
    """
    variable = step.component.variable(signal)
    low, high = (_number(getattr(variable, bound), otherwise) for bound, otherwise in (("min", -inf), ("max", inf)))
    if isfinite(low) and isfinite(high) and low < high:
        yield _Range(low, high, f"left its declared range ({low:g} to {high:g})", high - low)
    try:
        unit = step.component.unit(signal)
    except UnitError:
        unit = None
    largest = None if unit is None else _PLAUSIBLE.get(unit.exponents)
    if unit is not None and largest is not None:
        limit = largest / abs(unit.factor)
        yield _Range(-limit, limit, f"grew beyond anything plausible ({limit:g})", 0.0)
        return
    usual = max(abs(_number(variable.nominal, 1.0)), float(np.median(np.abs(values))) if len(values) else 0.0)
    yield _Range(-FAR * usual, FAR * usual, f"grew beyond {FAR:g} times its usual size ({usual:.3g})", 0.0)


def _number(text: object, otherwise: float) -> float:
    try:
        return float(text)  # type: ignore[arg-type]  # None and words are answered below
    except (TypeError, ValueError):
        return otherwise


def _fed(plan: Plan, table: Any, found: Departure) -> str:
    """What the component of a departure was given in that row."""
    inputs = plan.find(found.component).inputs
    sources = [plan.signals[column].name for column in inputs.sources]
    if not sources:
        return f"Nothing is connected to '{found.component}', so it went by itself."
    pairs = [
        f"{source} -> {name} ({float(table[source][found.row]):.4g})"
        for source, name in zip(sources, inputs.names, strict=True)
    ]
    more = f", and {len(pairs) - SHOWN} more" if len(pairs) > SHOWN else ""
    return (
        f"'{found.component}' was fed by {', '.join(pairs[:SHOWN])}{more}: look there first, and at its parameters "
        f"and the step."
    )
