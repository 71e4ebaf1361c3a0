"""How many balise telegrams there were and what became of them. Standard library only."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from cosim.results.result import BaliseRecord

_KNOWN_OUTCOMES = (
    "accepted",
    "replayed",
    "late",
    "doubted",
    "ignored",
    "rejected",
    "notified",
    "repeated",
    "undelivered",
)
_UNDELIVERED = "undelivered"
USED = ("accepted", "replayed", "late", "doubted", "notified")
"""Outcomes after which the telegram is part of the estimate; ``notified`` is a receiver that reports no outcome."""
_IN_WORDS = {"notified": "delivered, outcome not reported"}


@dataclass(frozen=True, slots=True)
class _EventCounts:
    """Counts over a run.

    Args:
        delivered: telegrams that reached the receivers. missed: balises nobody read.
        undelivered: on their way when the run ended. false: telegrams without a balise.
        outcomes: by receiver, how many telegrams came to which outcome.
    """

    delivered: int
    missed: int
    undelivered: int
    false: int
    outcomes: dict[str, Counter[str]]


def count_events(events: Sequence[BaliseRecord]) -> _EventCounts:
    """Count telegrams by kind, and by receiver and outcome.

    Args:
        events: the telegrams.
    """
    kinds = Counter(event.kind for event in events)
    waiting = sum(bool(event.outcomes) and set(event.outcomes.values()) == {_UNDELIVERED} for event in events)
    outcomes: dict[str, Counter[str]] = {}
    for event in events:
        for receiver, outcome in event.outcomes.items():
            outcomes.setdefault(receiver, Counter())[outcome] += 1
    return _EventCounts(kinds["true"] + kinds["false"] - waiting, kinds["missed"], waiting, kinds["false"], outcomes)


def outcome_columns(outcomes: Iterable[Mapping[str, int]]) -> dict[str, str]:
    """The outcomes that occurred at some receiver, known ones first, each with its heading.

    Args:
        outcomes: number of telegrams by outcome, for each receiver.
    """
    seen = dict.fromkeys(outcome for counts in outcomes for outcome, count in counts.items() if count)
    ordered = [*(o for o in _KNOWN_OUTCOMES if o in seen), *(o for o in seen if o not in _KNOWN_OUTCOMES)]
    return {outcome: _IN_WORDS.get(outcome, outcome) for outcome in ordered}


def accepted_stamps(events: Sequence[BaliseRecord], receiver: str | None = None) -> list[float]:
    """Crossing times of the telegrams that were used [s], in order.

    Args:
        events: the telegrams.
        receiver: count what this component used; None for any receiver. A telegram without outcomes counts unless
            missed.
    """
    stamps = set()
    for event in events:
        outcomes = event.outcomes if receiver is None else {k: v for k, v in event.outcomes.items() if k == receiver}
        if event.kind != "missed" and (not event.outcomes or any(outcome in USED for outcome in outcomes.values())):
            stamps.add(event.stamp)
    return sorted(stamps)
