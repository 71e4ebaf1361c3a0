"""What many signals that differ have in common: a factor, an offset, a delay. NumPy only.

Of each signal three models of one number are fitted by least squares, with the reference r and the result x:
``x = k r``, ``x = r + c`` and ``x(t) = r(t - d)``. One counts where it leaves a tenth of the difference or less. The
number that most signals share is reported first. Of a held signal the delay is known as far as its rows show when it
changes: between two instants.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from math import isclose
from typing import Literal

import numpy as np

from cosim.comparison.verdict import SPAN, ComparisonData, Curves, SignalComparison
from cosim.results.shown_unit import shared_unit

Kind = Literal["factor", "delay", "offset"]
KINDS: tuple[Kind, ...] = ("factor", "delay", "offset")
LEFT = 0.1
"""Share of the difference that a model may leave, root mean square."""
SHARED = 0.1
"""How far, as a share, the numbers of two signals may be apart to be the same."""
_POINTS = 2000
_STEPS = 20
"""Delays that are tried, in steps of the reference, before they are refined."""
_ROUNDING = 1e-9
_NAMED = 3
_CONVERSIONS = {3.6: "m/s to km/h", 1000.0: "thousands", 100.0: "per cent", 180.0 / np.pi: "radians to degrees"}


@dataclass(frozen=True)
class CommonChange:
    """One change that explains how signals differ.

    Args:
        kind: which of the three. value: the factor [1], the delay [s] (the middle of what is known), or the offset in
            `unit`.
        signals: names of those it explains. unit: of an offset. text: one line for people.
    """

    kind: Kind
    value: float
    signals: Sequence[str]
    unit: str
    text: str


@dataclass(frozen=True)
class _Fit:
    """What one number explains of a signal."""

    kind: Kind
    value: float
    unit: str
    scale: float
    """Size by which two numbers are compared: that of what is changed, not that of a factor near one."""
    slack: float = 0.0
    """How far the number may be off on either hand."""


def common_changes(comparison: ComparisonData) -> list[CommonChange]:
    """Changes that signals which differ share, the one that explains most signals first; each signal is in one at most.

    Args:
        comparison: made with its curves.
    """
    fits = {s.name: _fits(s) for s in comparison.failed if any(f.kind not in SPAN for f in s.findings)}
    found = []
    while shared := _largest_group(fits):
        fit, names = shared
        fit = _common([other for name in names for other in fits[name] if _equal(fit, other)])
        found.append(CommonChange(fit.kind, fit.value, names, fit.unit, _text(fit, names, comparison)))
        fits = {name: own for name, own in fits.items() if name not in names}
    return found


def _common(fits: Sequence[_Fit]) -> _Fit:
    """The number in the middle of those that are known best; of several that leave room, the room that they share."""
    exact = [fit.value for fit in fits if not fit.slack]
    if exact:
        return replace(fits[0], value=float(np.median(exact)), slack=0.0)
    low, high = max(fit.value - fit.slack for fit in fits), min(fit.value + fit.slack for fit in fits)
    return replace(fits[0], value=0.5 * (low + high), slack=max(0.5 * (high - low), 0.0))


def _largest_group(fits: Mapping[str, Sequence[_Fit]]) -> tuple[_Fit, list[str]] | None:
    """The change that most signals share, and their names."""
    groups = [
        (fit, [name for name, others in fits.items() if any(_equal(fit, other) for other in others)])
        for own in fits.values()
        for fit in own
    ]
    return max(groups, key=lambda group: (len(group[1]), -KINDS.index(group[0].kind)), default=None)


def _equal(one: _Fit, two: _Fit) -> bool:
    room = SHARED * one.scale + one.slack + two.slack
    return (one.kind, one.unit) == (two.kind, two.unit) and abs(one.value - two.value) <= room


def _fits(signal: SignalComparison) -> list[_Fit]:
    """The models of one number that explain how a signal differs."""
    curves = signal.curves
    if curves is None or not np.isfinite(curves.reference).all() or not np.isfinite(curves.result).all():
        return []
    time, reference, result = _on_common_points(curves)
    difference = _rms(result - reference)
    if not difference > 0.0:
        return []
    late = _delay_of_changes(curves) if curves.held else _delay(curves, time, result)
    fits = [_factor(reference, result), _offset(reference, result, signal.unit), late]
    return [fit for fit, left in filter(None, fits) if left <= LEFT * difference]


def _on_common_points(curves: Curves) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Instants of the reference, a few thousand at most, with the values of both sides."""
    begin, end = (f(curves.reference_time[i], curves.result_time[i]) for f, i in ((max, 0), (min, -1)))
    inside = curves.reference_time[(curves.reference_time >= begin) & (curves.reference_time <= end)]
    time = np.unique(inside[:: max(1, len(inside) // _POINTS)])
    return time, _at(time, curves.reference_time, curves.reference), _at(time, curves.result_time, curves.result)


def _at(time: np.ndarray, rows: np.ndarray, values: np.ndarray) -> np.ndarray:
    return np.asarray(np.interp(time, rows, values))


def _rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2))) if len(values) else 0.0


def _factor(reference: np.ndarray, result: np.ndarray) -> tuple[_Fit, float] | None:
    size = float(reference @ reference)
    if not size > 0.0:
        return None
    factor = float(reference @ result) / size
    return _Fit("factor", factor, "", abs(factor - 1.0)), _rms(result - factor * reference)


def _offset(reference: np.ndarray, result: np.ndarray, unit: str) -> tuple[_Fit, float]:
    offset = float(np.mean(result - reference))
    return _Fit("offset", offset, unit, abs(offset)), _rms(result - reference - offset)


def _delay(curves: Curves, time: np.ndarray, result: np.ndarray) -> tuple[_Fit, float] | None:
    """The delay, and what it leaves; a signal that hardly changes has none."""
    step = float(np.median(np.diff(np.unique(curves.reference_time)))) if len(time) > 2 else 0.0
    if not step > 0.0 or np.ptp(curves.reference) == 0.0:
        return None

    def left(delay: float) -> float:
        inside = (time - delay >= curves.reference_time[0]) & (time - delay <= curves.reference_time[-1])
        if np.count_nonzero(inside) < len(time) // 2:
            return np.inf
        return _rms(result[inside] - _at(time[inside] - delay, curves.reference_time, curves.reference))

    best = min((step * k for k in range(-_STEPS, _STEPS + 1)), key=left)
    best = _refined(left, best, step)
    return _Fit("delay", best, "", abs(best)), left(best)


def _delay_of_changes(curves: Curves) -> tuple[_Fit, float] | None:
    """The delay of a held signal whose changes all come earlier or later; it leaves nothing.

    A change lies between two rows, so the delay does, too. A few changes at one end may be lost: those that come after
    the end, or came before the begin.
    """
    one, two = _changes(curves.reference_time, curves.reference), _changes(curves.result_time, curves.result)
    count = min(one.shape[1], two.shape[1])
    if not count or abs(one.shape[1] - two.shape[1]) > max(1, count // _STEPS):
        return None
    for a, b in ((one[:, :count], two[:, :count]), (one[:, -count:], two[:, -count:])):
        low, high = float(np.max(b[0] - a[1])), float(np.min(b[1] - a[0]))
        slack, middle = 0.5 * (high - low), 0.5 * (low + high)
        rounding = _ROUNDING * (1.0 + abs(middle))
        if np.max(np.abs(a[2:] - b[2:])) <= curves.allowed and -rounding <= slack <= abs(middle) + rounding:
            return _Fit("delay", middle, "", abs(middle), max(slack, 0.0)), 0.0
    return None


def _changes(time: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Rows before and after each change: their times [s], then their values, shape (4, changes)."""
    rows = np.flatnonzero(np.diff(values))
    return np.stack([time[rows], time[rows + 1], values[rows], values[rows + 1]])


def _refined(left: Callable[[float], float], at: float, step: float) -> float:
    """The place of the least value near `at`, by halving."""
    while step > _ROUNDING * max(abs(at), 1e-3):
        step *= 0.5
        at = min((at, at - step, at + step), key=left)
    return at


def _text(fit: _Fit, names: Sequence[str], comparison: ComparisonData) -> str:
    """One line for people."""
    compared = [s for s in comparison.signals if s.status != "ignored"]
    differ = comparison.failed
    several = len(names) > 1
    all_of_them = "both" if len(names) == 2 else f"all {len(names)}"
    if several and len(names) == len(compared):
        who = f"{all_of_them} signals"
    elif several and len(names) == len(differ):
        who = f"{all_of_them} signals that differ"
    elif several:
        who = f"{len(names)} of the {len(differ)} signals that differ"
    else:
        who = names[0]
    shown = "" if not several or len(names) == len(compared) else f": {', '.join(names[:_NAMED])}"
    more = f" and {len(names) - _NAMED} more" if shown and len(names) > _NAMED else ""
    return f"{who} {_verb(fit, names, comparison)}{shown}{more}"


def _verb(fit: _Fit, names: Sequence[str], comparison: ComparisonData) -> str:
    amount, several = abs(fit.value), len(names) > 1
    if fit.kind == "delay":
        return f"{'are' if several else 'is'} {_delay_text(fit)}{_in_steps(amount, comparison)}"
    if fit.kind == "offset":
        unit = shared_unit(s.shown for s in comparison.failed if s.name in names)
        high = "high" if fit.value > 0.0 else "low"
        return f"{'are' if several else 'is'} {unit.difference_text(amount)} too {high}"
    if isclose(fit.value, -1.0, rel_tol=1e-3):
        return f"{'have' if several else 'has'} the opposite sign"
    if amount < 1e-3:
        return f"{'are' if several else 'is'} zero"
    if 0.5 < fit.value < 2.0:
        return f"{'scale' if several else 'scales'} by {100.0 * (fit.value - 1.0):+.3g} %"
    return f"{'scale' if several else 'scales'} by a factor of {fit.value:.4g}{_conversion(fit.value)}"


def _delay_text(fit: _Fit) -> str:
    """A delay, or the two between which it lies."""
    word = "late" if fit.value > 0.0 else "early"
    if fit.slack <= _ROUNDING * (1.0 + abs(fit.value)):
        return f"{abs(fit.value):.4g} s {word}"
    near, far = (round(abs(fit.value) + sign * fit.slack, 9) + 0.0 for sign in (-1.0, 1.0))
    return f"between {near:.4g} and {far:.4g} s {word}"


def _conversion(factor: float) -> str:
    """A change of unit that has this factor."""
    for known, name in _CONVERSIONS.items():
        if isclose(factor, known, rel_tol=1e-3):
            return f", as from {name}"
        if isclose(factor * known, 1.0, rel_tol=1e-3):
            return f", the inverse of {name}"
    return ""


def _in_steps(delay: float, comparison: ComparisonData) -> str:
    """The delay in steps of the reference, where it is a whole number of them."""
    times = next(s.curves.reference_time for s in comparison.failed if s.curves is not None)
    steps = delay / float(np.median(np.diff(np.unique(times))))
    whole = round(steps)
    if whole == 0 or not isclose(steps, whole, rel_tol=0.02):
        return ""
    return f" ({whole} step{'s' if whole > 1 else ''})"
