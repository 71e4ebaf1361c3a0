"""The few windows of a run worth a closer look, chosen from errors, telegrams, zones and indicators. Imports NumPy
only.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from cosim.evaluation.corrections import corrections
from cosim.evaluation.event_counts import accepted_stamps
from cosim.evaluation.indicators import on_intervals
from cosim.evaluation.metrics import FEWEST_INSTANTS, error_size, instants
from cosim.evaluation.roles import Quantity, estimate, estimation_error, label
from cosim.evaluation.spec import ReportSpec
from cosim.evaluation.summary_entries import number_entry
from cosim.report.figures.scales import error_scale
from cosim.results.result import BaliseRecord, Result
from fmus.tables.numbers import number

_FEWEST_ROWS = 3  # below these there is nothing to enlarge
MOST = 6  # windows; more would hide what matters
NOT_TAKEN = ("late", "ignored", "rejected", "undelivered")  # outcomes of a telegram that was not used when it came
SPIKE = 3.0  # an observer whose error leaves the scale by this factor has diverged: its error is no window
UNITS: dict[Quantity, str] = {"speed": "m/s", "position": "m"}


@dataclass(frozen=True, slots=True)
class ZoomWindow:
    """A window of time to look into.

    Args:
        time: what it is about [s]. start, end: of the window [s]. reasons: why, the first one the title.
    """

    time: float
    start: float
    end: float
    reasons: tuple[str, ...]


def notable_windows(result: Result, spec: ReportSpec, most: int = MOST) -> list[ZoomWindow]:
    """Windows in order of time: largest errors, telegrams gone wrong, zones, indicators, largest jumps at balises.

    Args:
        result: the run. spec: roles, zones, start of the evaluation. most: how many at most.

    Returns:
        Windows of which none holds the instant of another; where two would, they are one with both reasons.
    """
    if len(result.time) < _FEWEST_ROWS or not (
        _all_errors(result, spec, "speed") or _all_errors(result, spec, "position")
    ):
        return []
    chosen: list[ZoomWindow] = []
    for window in _candidates(result, spec, _Scale(result)):
        home = next((i for i, m in enumerate(chosen) if m.start <= window.time <= m.end), None)
        if home is not None:
            chosen[home] = replace(chosen[home], reasons=(*chosen[home].reasons, *window.reasons))
        elif len(chosen) < most:
            chosen.append(window)
    return sorted(chosen, key=lambda m: m.time)


class _Scale:
    """How long windows of a run are."""

    def __init__(self, result: Result) -> None:
        self.first, self.last = float(result.time[0]), float(result.time[-1])
        step = number_entry(result.summary, "step") or float(np.median(np.diff(result.time)))
        gaps = np.diff(accepted_stamps(result.events))
        duration = self.last - self.first
        gap = float(np.median(gaps)) if len(gaps) else 0.01 * duration
        self.least, self.largest = min(20 * step, 0.25 * duration), 0.05 * duration
        self.half = self.bounded(1.6 * gap)

    def bounded(self, length: float) -> float:
        return max(min(length, self.largest), self.least)

    def window(self, time: float, before: float, after: float, reason: str) -> ZoomWindow:
        return ZoomWindow(time, max(time - before, self.first), min(time + after, self.last), (reason,))


def _candidates(result: Result, spec: ReportSpec, scale: _Scale) -> Iterator[ZoomWindow]:
    """Windows, the most instructive first."""
    yield from _largest_error(result, spec, scale, "speed")
    yield from _largest_error(result, spec, scale, "position")
    yield from _telegrams(result, spec, scale)
    zone = _worst_zone(result, spec)
    if zone is not None:
        yield from _edge(scale, zone, 0, "A low-adhesion zone begins")
    yield from _indicator(result, spec, scale)
    yield from _largest_jump(result, spec, scale)
    if zone is not None:
        yield from _edge(scale, zone, 1, "A low-adhesion zone ends")


def _all_errors(result: Result, spec: ReportSpec, quantity: Quantity) -> dict[str, np.ndarray]:
    """Errors by observer, 0 in the start-up; none where too little is judged."""
    settled = result.time >= spec.evaluate_after
    if instants(result.time[settled]) < FEWEST_INSTANTS:
        return {}
    found = {o: estimation_error(result, spec, o, quantity) for o in spec.observers}
    return {o: np.where(settled, e, 0.0) for o, e in found.items() if e is not None}


def _errors(result: Result, spec: ReportSpec, quantity: Quantity) -> dict[str, np.ndarray]:
    """As `_all_errors`, without those of observers that have diverged."""
    errors = _all_errors(result, spec, quantity)
    settled = result.time >= spec.evaluate_after
    limit = SPIKE * error_scale([e[settled] for e in errors.values()]).limit
    return {o: e for o, e in errors.items() if error_size(result.time, e).max_abs <= limit}


def _largest_error(result: Result, spec: ReportSpec, scale: _Scale, quantity: Quantity) -> Iterator[ZoomWindow]:
    """The worst point of all observers; where that one has diverged, the worst of the others after it."""
    errors, working = _all_errors(result, spec, quantity), _errors(result, spec, quantity)
    sizes = {o: error_size(result.time, e).max_abs for o, e in errors.items()}
    worst = max(sizes, key=lambda o: sizes[o], default=None)
    if worst is not None and worst not in working:
        yield _worst_point(result, spec, scale, quantity, worst, errors[worst])
    others = max(working, key=lambda o: sizes[o], default=None)
    if others is not None and sizes[others] != 0.0:
        window = _worst_point(result, spec, scale, quantity, others, errors[others])
        among = "" if worst in working else " of the others"
        yield replace(window, reasons=(window.reasons[0].replace(" error", f" error{among}", 1),))


def _worst_point(
    result: Result, spec: ReportSpec, scale: _Scale, quantity: Quantity, observer: str, error: np.ndarray
) -> ZoomWindow:
    """Where an error is largest, or the last row before it is no number any more."""
    lost = np.flatnonzero(~np.isfinite(error))
    row = max(int(lost[0]) - 1, 0) if len(lost) else int(np.argmax(np.abs(error)))
    size = "then without bound" if len(lost) else f"{number(float(error[row]))} {UNITS[quantity]}"
    reason = f"Largest {quantity} error, {size} ({label(spec, observer)})"
    return scale.window(float(result.time[row]), 1.5 * scale.half, 1.5 * scale.half, reason)


def _telegrams(result: Result, spec: ReportSpec, scale: _Scale) -> Iterator[ZoomWindow]:
    """The first false telegram, the one that came latest, the first one not taken, the missed one in the longest gap.

    Those during the start-up count only where there are no others.
    """
    events = [e for e in result.events if e.stamp >= spec.evaluate_after] or result.events
    delivered = [e for e in events if e.kind != "missed"]
    yield from _at(scale, (e for e in delivered if e.kind == "false"), "A false telegram")
    latest = max(delivered, key=lambda e: e.delivered_at - e.stamp, default=None)
    if latest is not None and latest.delivered_at > latest.stamp:
        yield from _at(scale, [latest], f"A telegram {number(1000 * (latest.delivered_at - latest.stamp))} ms late")
    refused = (
        e for e in delivered if e.kind == "true" and any(outcome in NOT_TAKEN for outcome in e.outcomes.values())
    )
    yield from _at(scale, refused, "A telegram that not every observer took")
    stamps = np.array([*accepted_stamps(result.events), np.inf])
    missed = [e for e in events if e.kind == "missed"]
    worst = max(missed, key=lambda e: _gap_around(stamps, e.stamp, scale), default=None)
    yield from _at(scale, [] if worst is None else [worst], "A missed balise")


def _gap_around(stamps: np.ndarray, instant: float, scale: _Scale) -> float:
    after = int(np.searchsorted(stamps, instant))
    return float(min(stamps[after], scale.last) - (stamps[after - 1] if after else scale.first))


def _at(scale: _Scale, events: Iterable[BaliseRecord], what: str) -> Iterator[ZoomWindow]:
    event = next(iter(events), None)
    if event is not None and scale.first <= event.stamp <= scale.last:
        delay = event.delivered_at - event.stamp if np.isfinite(event.delivered_at) else 0.0
        yield scale.window(event.stamp, scale.half, scale.half + max(delay, 0.0), f"{what}, {event.identity}")


def _worst_zone(result: Result, spec: ReportSpec) -> tuple[float, float] | None:
    """The low-adhesion zone with the largest speed error, or the first."""
    errors = _errors(result, spec, "speed").values()

    def size(zone: tuple[float, float]) -> float:
        rows = (result.time >= zone[0]) & (result.time <= zone[1])
        return max((float(np.max(np.abs(e[rows]))) for e in errors if rows.any()), default=0.0)

    return max(spec.zones, key=size, default=None)


def _edge(scale: _Scale, zone: tuple[float, float], end: int, what: str) -> Iterator[ZoomWindow]:
    length = zone[1] - zone[0]
    if scale.first < zone[end] < scale.last:
        before, after = scale.bounded(0.08 * length), scale.bounded(0.2 * length)
        yield scale.window(zone[end], before, after, f"{what} at {number(zone[end])} s")


def _indicator(result: Result, spec: ReportSpec, scale: _Scale) -> Iterator[ZoomWindow]:
    """The longest false alarm; where there is none, the first time an indicator goes on."""
    on = [
        (a, b, observer)
        for observer in spec.observers
        if (values := estimate(result, observer, "slip_indicator")) is not None
        for a, b in on_intervals(result.time, values)
        if a >= max(spec.evaluate_after, scale.first + scale.least)
    ]
    false = [(a, b, o) for a, b, o in on if spec.zones and not any(a < end and b > start for start, end in spec.zones)]
    chosen = max(false, key=lambda x: x[1] - x[0], default=None) or min(on, default=None)
    if chosen is not None:
        what = "Slip indicated outside every zone" if false else "First slip indication"
        yield scale.window(chosen[0], 2 * scale.half, 2 * scale.half, f"{what} ({label(spec, chosen[2])})")


def _largest_jump(result: Result, spec: ReportSpec, scale: _Scale) -> Iterator[ZoomWindow]:
    """The telegram that moved the position of an observer most."""
    largest: tuple[float, float, str] | None = None
    for observer in _errors(result, spec, "position"):
        made = corrections(result, spec, observer, "position")
        jumps = np.where(made.time >= spec.evaluate_after, made.jump, 0.0)
        if len(jumps) and (largest is None or np.max(jumps) > largest[0]):
            largest = float(np.max(jumps)), float(made.time[np.argmax(jumps)]), observer
    if largest is not None and largest[0] > 0.0:
        reason = f"Largest correction at a balise, {number(largest[0])} m ({label(spec, largest[2])})"
        yield scale.window(largest[1], scale.half, scale.half, reason)
