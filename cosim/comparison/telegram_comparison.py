"""Balise telegrams compared as events."""

from __future__ import annotations

from collections.abc import Sequence

from cosim.comparison.event_comparison import Event, EventLimits, compare_events, event_limits
from cosim.comparison.tolerance import Tolerance
from cosim.comparison.verdict import EventComparison
from cosim.results.result import BaliseRecord, Result

TIMES = {"stamp": "passed", "delivered_at": "delivered"}
PAYLOAD = {"position": "m", "true_position": "m", "odometer_reading": "m/s", "location_accuracy": "m"}


def _keeps_telegrams(result: Result) -> bool:
    """Whether a result would have telegrams if there had been any: a run does, a plain table does not.

    The summary may say so itself: ``events_recorded``.

    Args:
        result: result or reference.
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


def telegram_limits(reference: Sequence[BaliseRecord], tolerance: Tolerance, length: float) -> EventLimits:
    """What telegrams may differ by from those of a reference of `length` [s].

    Args:
        reference: its telegrams.
        tolerance: what is allowed.
        length: of the run [s].
    """
    return event_limits([_event(record) for record in reference], tolerance, length)


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
