"""Balise telegrams and packets compared as events: which belong to each other, and how far they differ."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from math import isfinite, isnan
from typing import Literal

import numpy as np
import scipy

from cosim.comparison.span import rounding
from cosim.comparison.tolerance import Tolerance
from cosim.comparison.verdict import EventComparison, EventDifference, Record
from cosim.results.result import BaliseRecord, Result

TIMES = {"stamp": "passed", "delivered_at": "delivered"}
PAYLOAD = {"position": "m", "true_position": "m", "odometer_reading": "m/s", "location_accuracy": "m"}


_LARGEST_GROUP = 1000  # events with one name: more of them are paired in order, not by the best assignment
_NEAR_STEPS = 0.01  # of the length: how far off an event with another name may be the same


@dataclass(frozen=True, slots=True)
class Event:
    """What is compared of a telegram or a packet.

    Args:
        record: the telegram or packet. name: what it is called in messages.
        words: what must be the same, by field; events are first sought among those with the same words.
        times: instants [s] by what happens at them, the stamp first. payload: numbers by field.
        outcomes: by receiver. units: of the payload by field; none is stated where there is none.
    """

    record: Record
    name: str
    words: Mapping[str, str]
    times: Mapping[str, float]
    payload: Mapping[str, float]
    outcomes: Mapping[str, str]
    units: Mapping[str, str] = field(default_factory=dict)

    @property
    def stamp(self) -> float:
        """When it was [s]."""
        return self.record.stamp


_Pair = tuple[Event, Event]


@dataclass(frozen=True)
class _EventLimits:
    """What two events may differ by: `time` [s], and `payload` by field in its unit."""

    time: float
    payload: Mapping[str, float]


def compare_events(
    reference: Sequence[Event], result: Sequence[Event], tolerance: Tolerance, length: float
) -> EventComparison:
    """Compare two lists of events.

    Args:
        reference, result: the events. tolerance: of times and payload. length: of the reference [s].
    """
    limits = _event_limits(reference, tolerance, length)
    pairs, missing, extra = _match(reference, result, max(10.0 * limits.time, _NEAR_STEPS * length))
    differences = [d for pair in pairs for d in _differences(*pair, limits)]
    differences += [EventDifference("missing", one.record, None, f"{one.name} is missing") for one in missing]
    differences += [EventDifference("extra", None, two.record, f"{two.name} is only in the result") for two in extra]
    differences.sort(key=lambda d: (d.reference or d.result).stamp)  # type: ignore[union-attr]  # one of them is there
    shift = max((abs(two.stamp - one.stamp) for one, two in pairs), default=0.0)
    return EventComparison(len(pairs), differences, shift)


def _event_limits(reference: Sequence[Event], tolerance: Tolerance, length: float) -> _EventLimits:
    """What events may differ by from those of a reference of `length` [s].

    Args:
        reference: its events.
        tolerance: what is allowed.
        length: of the run [s].
    """
    by_name: dict[str, list[float]] = {}
    for event in reference:
        for name, value in event.payload.items():
            by_name.setdefault(name, []).append(value)
    payload = {}
    for name, all_values in by_name.items():
        values = [v for v in all_values if isfinite(v)]
        spread = max(values) - min(values) if values else 0.0
        payload[name] = tolerance.value_for(spread or max(map(abs, values), default=0.0))
    return _EventLimits(tolerance.time_for(length), payload)


def _match(
    reference: Sequence[Event], result: Sequence[Event], window: float
) -> tuple[list[_Pair], list[Event], list[Event]]:
    """Pairs of events: first of the same words, then what is left by nearest stamp."""
    pairs: list[_Pair] = []
    missing: list[Event] = []
    extra: list[Event] = []
    one, two = _groups(reference), _groups(result)
    for key in {**one, **two}:
        found, left, right = _assign(one.get(key, []), two.get(key, []))
        pairs += found
        missing += left
        extra += right
    found, missing, extra = _assign(missing, extra)
    for pair in found:
        if abs(pair[0].stamp - pair[1].stamp) <= window:
            pairs.append(pair)
        else:
            missing.append(pair[0])
            extra.append(pair[1])
    return sorted(pairs, key=lambda p: p[0].stamp), missing, extra


def _groups(records: Iterable[Event]) -> dict[tuple[str, ...], list[Event]]:
    groups: dict[tuple[str, ...], list[Event]] = {}
    for record in sorted(records, key=lambda r: r.stamp):
        groups.setdefault(tuple(record.words.values()), []).append(record)
    return groups


def _assign(one: list[Event], two: list[Event]) -> tuple[list[_Pair], list[Event], list[Event]]:
    """Pairs with the least sum of time differences, and what is left on either side."""
    count = min(len(one), len(two))
    rows = columns = np.arange(count)
    if len(one) != len(two) and count and max(len(one), len(two)) <= _LARGEST_GROUP:
        stamps = [np.array([record.stamp for record in side]) for side in (one, two)]
        rows, columns = scipy.optimize.linear_sum_assignment(np.abs(stamps[0][:, None] - stamps[1]))
    taken = set(rows.tolist()), set(columns.tolist())
    pairs = [(one[int(i)], two[int(j)]) for i, j in zip(rows, columns, strict=True)]
    left, right = (
        [r for k, r in enumerate(side) if k not in done] for side, done in zip((one, two), taken, strict=True)
    )
    return pairs, left, right


def _differences(one: Event, two: Event, limits: _EventLimits) -> list[EventDifference]:
    times = [text for what in one.times if (text := _time_text(what, one.times[what], two.times[what], limits.time))]
    shared = [name for name in one.payload if name in two.payload]
    contents = [text for name in shared if (text := _payload_text(name, one, two, limits.payload[name]))]
    contents += [f"{name} {a!r} instead of {b!r}" for name, a, b in _words(one, two) if a != b]
    kinds: tuple[tuple[Literal["time", "payload"], list[str]], ...] = (("time", times), ("payload", contents))
    return [
        EventDifference(kind, one.record, two.record, f"{one.name}: {', '.join(texts)}")
        for kind, texts in kinds
        if texts
    ]


def _time_text(what: str, a: float, b: float, allowed: float) -> str:
    if isnan(a) or isnan(b):
        return (
            ""
            if isnan(a) and isnan(b)
            else f"{what} {'never' if isnan(b) else f'at {b:.9g} s, in the reference never'}"
        )
    if abs(b - a) <= allowed + rounding(a, b):
        return ""
    return f"{what} {abs(b - a):.4g} s {'late' if b > a else 'early'} (allowed {allowed:.4g} s)"


def _payload_text(name: str, one: Event, two: Event, allowed: float) -> str:
    a, b = one.payload[name], two.payload[name]
    if a == b or (isnan(a) and isnan(b)) or abs(b - a) <= allowed:
        return ""
    unit = f" {one.units[name]}" if name in one.units else ""
    return f"{name} {b:.9g}{unit} instead of {a:.9g}{unit} (allowed {allowed:.4g}{unit})"


def _words(one: Event, two: Event) -> list[tuple[str, str, str]]:
    words = [(name, two.words[name], one.words[name]) for name in one.words]
    both = [name for name in one.outcomes if name in two.outcomes]
    return words + [(f"outcome at {name}", two.outcomes[name], one.outcomes[name]) for name in both]


def _keeps_telegrams(result: Result) -> bool:
    """Whether a result would have telegrams if there had been any: a run does, a plain table does not.

    The summary may say so itself: ``events_recorded``.
    """
    recorded = result.summary.get("events_recorded")
    return bool(result.events) or (bool(recorded) if recorded is not None else "components" in result.summary)


def compare_telegrams(reference: Result, result: Result, tolerance: Tolerance, length: float) -> EventComparison:
    """Compare two lists of telegrams.

    Args:
        reference, result: whose telegrams. tolerance: of times and payload. length: of the reference [s].
    """
    if not _keeps_telegrams(reference) or not _keeps_telegrams(result):
        return EventComparison(compared=False)
    ours, theirs = ([_event(record) for record in side.events] for side in (reference, result))
    return compare_events(ours, theirs, tolerance, length)


def telegram_limits(reference: Sequence[BaliseRecord], tolerance: Tolerance, length: float) -> _EventLimits:
    """What telegrams may differ by from those of a reference of `length` [s].

    Args:
        reference: its telegrams.
        tolerance: what is allowed.
        length: of the run [s].
    """
    return _event_limits([_event(record) for record in reference], tolerance, length)


def _event(record: BaliseRecord) -> Event:
    return Event(
        record,
        f"telegram {record.identity!r} ({record.kind}) of {record.stamp:.9g} s",
        {"identity": record.identity, "kind": record.kind},
        {what: getattr(record, name) for name, what in TIMES.items()},
        {name: getattr(record, name) for name in PAYLOAD},
        record.outcomes,
        PAYLOAD,
    )
