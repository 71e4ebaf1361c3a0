"""Balise telegrams compared as events: matched, missing, extra, late, or with another content."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from math import isfinite, isnan
from typing import Literal

import numpy as np
import scipy

from cosim.comparison.span import rounding
from cosim.comparison.tolerance import Tolerance
from cosim.comparison.verdict import EventComparison, EventDifference
from cosim.results.result import BaliseRecord, Result

TIMES = {"stamp": "passed", "delivered_at": "delivered"}
PAYLOAD = {"position": "m", "true_position": "m", "odometer_reading": "m/s", "location_accuracy": "m"}
LARGEST_GROUP = 1000  # telegrams with one name: more of them are paired in order, not by the best assignment
NEAR_STEPS = 0.01  # of the length: how far off a telegram with another name may be the same

Pair = tuple[BaliseRecord, BaliseRecord]


@dataclass(frozen=True)
class Limits:
    """What two telegrams may differ by: `time` [s], and `payload` by field in its unit."""

    time: float
    payload: dict[str, float]


def keeps_telegrams(result: Result) -> bool:
    """Whether a result would have telegrams if there had been any: a run does, a plain table does not.

    The summary may say so itself: ``events_recorded``.

    Args:
        result: result or reference.
    """
    told = result.summary.get("events_recorded")
    return bool(result.events) or (bool(told) if told is not None else "components" in result.summary)


def compare_telegrams(reference: Result, result: Result, tolerance: Tolerance, length: float) -> EventComparison:
    """Compare two lists of telegrams.

    Args:
        reference, result: whose telegrams. tolerance: of times and payload. length: of the reference [s].
    """
    if not keeps_telegrams(reference) or not keeps_telegrams(result):
        return EventComparison(compared=False)
    limits = telegram_limits(reference.events, tolerance, length)
    pairs, missing, extra = _match(reference.events, result.events, max(10.0 * limits.time, NEAR_STEPS * length))
    differences = [d for pair in pairs for d in _differences(*pair, limits)]
    differences += [EventDifference("missing", one, None, f"{_name(one)} is missing") for one in missing]
    differences += [EventDifference("extra", None, two, f"{_name(two)} is only in the result") for two in extra]
    differences.sort(key=lambda d: (d.reference or d.result).stamp)  # type: ignore[union-attr]  # one of them is there
    shift = max((abs(two.stamp - one.stamp) for one, two in pairs), default=0.0)
    return EventComparison(len(pairs), differences, shift)


def telegram_limits(reference: Sequence[BaliseRecord], tolerance: Tolerance, length: float) -> Limits:
    """What telegrams may differ by from those of a reference of `length` [s].

    Args:
        reference: its telegrams.
        tolerance: what is allowed.
        length: of the run [s].
    """
    payload = {}
    for name in PAYLOAD:
        values = [v for record in reference if isfinite(v := getattr(record, name))]
        spread = max(values) - min(values) if values else 0.0
        payload[name] = tolerance.value_for(spread or max(map(abs, values), default=0.0))
    return Limits(tolerance.time_for(length), payload)


def _match(
    reference: Sequence[BaliseRecord], result: Sequence[BaliseRecord], window: float
) -> tuple[list[Pair], list[BaliseRecord], list[BaliseRecord]]:
    """Pairs of telegrams: first of the same name and kind, then what is left by nearest stamp."""
    pairs: list[Pair] = []
    missing: list[BaliseRecord] = []
    extra: list[BaliseRecord] = []
    one, two = _groups(reference), _groups(result)
    for key in {**one, **two}:
        found, left, right = _assign(one.get(key, []), two.get(key, []))
        pairs, missing, extra = pairs + found, missing + left, extra + right
    found, missing, extra = _assign(missing, extra)
    for pair in found:
        if abs(pair[0].stamp - pair[1].stamp) <= window:
            pairs.append(pair)
        else:
            missing.append(pair[0])
            extra.append(pair[1])
    return sorted(pairs, key=lambda p: p[0].stamp), missing, extra


def _groups(records: Iterable[BaliseRecord]) -> dict[tuple[str, str], list[BaliseRecord]]:
    groups: dict[tuple[str, str], list[BaliseRecord]] = {}
    for record in sorted(records, key=lambda r: r.stamp):
        groups.setdefault((record.identity, record.kind), []).append(record)
    return groups


def _assign(
    one: list[BaliseRecord], two: list[BaliseRecord]
) -> tuple[list[Pair], list[BaliseRecord], list[BaliseRecord]]:
    """Pairs with the least sum of time differences, and what is left on either side."""
    count = min(len(one), len(two))
    rows = columns = np.arange(count)
    if len(one) != len(two) and count and max(len(one), len(two)) <= LARGEST_GROUP:
        stamps = [np.array([record.stamp for record in side]) for side in (one, two)]
        rows, columns = scipy.optimize.linear_sum_assignment(np.abs(stamps[0][:, None] - stamps[1]))
    taken = set(rows.tolist()), set(columns.tolist())
    pairs = [(one[int(i)], two[int(j)]) for i, j in zip(rows, columns, strict=True)]
    left, right = (
        [r for k, r in enumerate(side) if k not in done] for side, done in zip((one, two), taken, strict=True)
    )
    return pairs, left, right


def _differences(one: BaliseRecord, two: BaliseRecord, limits: Limits) -> list[EventDifference]:
    times = [text for name in TIMES if (text := _time_text(name, one, two, limits.time))]
    contents = [text for name in PAYLOAD if (text := _payload_text(name, one, two, limits.payload[name]))]
    contents += [f"{name} {a!r} instead of {b!r}" for name, a, b in _words(one, two) if a != b]
    kinds: tuple[tuple[Literal["time", "payload"], list[str]], ...] = (("time", times), ("payload", contents))
    return [EventDifference(kind, one, two, f"{_name(one)}: {', '.join(texts)}") for kind, texts in kinds if texts]


def _time_text(field: str, one: BaliseRecord, two: BaliseRecord, allowed: float) -> str:
    a, b = getattr(one, field), getattr(two, field)
    if isnan(a) or isnan(b):
        return (
            ""
            if isnan(a) and isnan(b)
            else f"{TIMES[field]} {'never' if isnan(b) else f'at {b:.9g} s, in the reference never'}"
        )
    if abs(b - a) <= allowed + rounding(a, b):
        return ""
    return f"{TIMES[field]} {abs(b - a):.4g} s {'late' if b > a else 'early'} (allowed {allowed:.4g} s)"


def _payload_text(field: str, one: BaliseRecord, two: BaliseRecord, allowed: float) -> str:
    a, b = getattr(one, field), getattr(two, field)
    if a == b or (isnan(a) and isnan(b)) or abs(b - a) <= allowed:
        return ""
    return (
        f"{field} {b:.9g} {PAYLOAD[field]} instead of {a:.9g} {PAYLOAD[field]} (allowed {allowed:.4g} {PAYLOAD[field]})"
    )


def _words(one: BaliseRecord, two: BaliseRecord) -> list[tuple[str, str, str]]:
    words = [("identity", two.identity, one.identity), ("kind", two.kind, one.kind)]
    both = [name for name in one.outcomes if name in two.outcomes]
    return words + [(f"outcome at {name}", two.outcomes[name], one.outcomes[name]) for name in both]


def _name(record: BaliseRecord) -> str:
    return f"telegram {record.identity!r} ({record.kind}) of {record.stamp:.9g} s"
