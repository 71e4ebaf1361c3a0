"""How many balise telegrams there were and what became of them. Standard library only."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

from cosim.results.result import BaliseRecord

OUTCOMES = ("accepted", "replayed", "late", "doubted", "ignored", "rejected", "told", "undelivered")
USED = ("accepted", "replayed", "late", "doubted", "told")
"""Outcomes after which the telegram is part of the estimate; ``told`` is a receiver that does not say."""


@dataclass(frozen=True, slots=True)
class EventCounts:
    """Counts over a run.

    Args:
        told: telegrams that were delivered. missed: balises nobody read. false: delivered telegrams without a balise.
        outcomes: by receiver, how many telegrams came to which of `OUTCOMES`.
    """

    told: int
    missed: int
    false: int
    outcomes: dict[str, Counter[str]]


def count_events(events: Sequence[BaliseRecord]) -> EventCounts:
    """Count telegrams by kind, and by receiver and outcome."""
    kinds = Counter(event.kind for event in events)
    outcomes: dict[str, Counter[str]] = {}
    for event in events:
        for receiver, outcome in event.outcomes.items():
            outcomes.setdefault(receiver, Counter())[outcome] += 1
    return EventCounts(kinds["true"] + kinds["false"], kinds["missed"], kinds["false"], outcomes)


def accepted_stamps(events: Sequence[BaliseRecord], receiver: str | None = None) -> list[float]:
    """Passing times of the telegrams that were used [s], in order.

    Args:
        events: the telegrams.
        receiver: count what this component used; None for any receiver. A telegram without outcomes counts unless missed.
    """
    stamps = set()
    for event in events:
        outcomes = event.outcomes if receiver is None else {k: v for k, v in event.outcomes.items() if k == receiver}
        if event.kind != "missed" and (not event.outcomes or any(outcome in USED for outcome in outcomes.values())):
            stamps.add(event.stamp)
    return sorted(stamps)
