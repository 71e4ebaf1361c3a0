"""The limit of an observer by simulation: the first value at which it loses its plant, found by native runs."""

from __future__ import annotations

from math import inf
from typing import Any

import numpy as np

from fmu_observer.certificates.finding import Finding, limit_found
from fmu_observer.certificates.limit_search import LimitSearch
from fmus import Batch

MEMBERS = 16
LAST_PART = 0.8  # of a run; behind it the error counts
_LOWER = 32.0  # parts of the range's shortest value down to which is searched
_FEWEST_PERIODS = 10.0  # of a run, for a period to be evaluated
_COMMUNICATION_STEP = 0.01  # [s]; the inputs are held for so long


def keeps_plant(search: LimitSearch, values: Any) -> np.ndarray:
    """Whether the observer finds its plant and keeps it, for values of what the search varies, shape (k,).

    Args:
        search: what is run. values: periods or delays [s], shape (k,).
    """
    tried = np.atleast_1d(np.asarray(values, dtype=float))
    periods = tried if search.varied == "period" else np.full(len(tried), search.period)
    delays = tried if search.varied == "delay" else np.full(len(tried), search.delay)
    batch = Batch(search.system, len(tried))
    for name, value in search.settings.items():
        batch.set(name, value)
    if search.delay_parameter:
        batch.set(search.delay_parameter, delays)
    _notify(batch, search, periods, delays)
    instants = _COMMUNICATION_STEP * np.arange(round(search.stop / _COMMUNICATION_STEP) + 1)
    batch.start(0.0)
    middles = np.minimum(instants + 0.5 * _COMMUNICATION_STEP, search.stop)
    names = list(search.truth(instants[:1]))
    found = batch.run(instants[1:], names, dict(search.inputs(middles)))
    with np.errstate(invalid="ignore", over="ignore"):
        errors = np.stack([_error(search, names, instants, found[i], delay) for i, delay in enumerate(delays)])
    late = instants >= LAST_PART * search.stop
    first = np.maximum(errors[:, 0], 1e-300)
    kept = errors[:, late].max(axis=1) < search.left * first
    return np.asarray(np.all(np.isfinite(errors), axis=1) & kept)


def reach(search: LimitSearch) -> tuple[float, float]:
    """The shortest and the longest value that a search tries where its range holds no end of what is kept [s].

    Periods are tried up to a tenth of a run, but delays not beyond the range, which the memory of the observer sets.

    Args:
        search: what is run.
    """
    longest = max(search.high, search.stop / _FEWEST_PERIODS) if search.varied == "period" else search.high
    return search.low / _LOWER, longest


def simulated(finding: Finding, members: int = MEMBERS) -> Finding:
    """A finding whose search has been run; others as they are.

    Args:
        finding: of an observer. members: values that are tried at once, see `simulated_limit`.
    """
    if finding.search is None:
        return finding
    shortest, longest = reach(finding.search)
    limit = simulated_limit(finding.search, members)
    source = f"{finding.source}, {shortest:g} to {longest:g} s"
    return limit_found(finding.what, limit, longest, source, shortest=shortest, kind="simulated")


def simulated_limit(search: LimitSearch, members: int = MEMBERS) -> float:
    """First value at which the observer loses its plant [s].

    The range is tried at equally spaced values at once, then the step in which the first failure lies. So the limit is
    known to a fraction ``1 / (members - 1)^2`` of the range; an island of failures narrower than a step may be missed.
    Where the range has no failure, or nothing else, the search goes on to the ends of `reach`, in equal ratios.

    Args:
        search: what is run. members: values that are tried at once.

    Returns:
        The limit; 0 where it fails at the shortest value of `reach` too, inf where all up to the longest are kept.
    """
    shortest, longest = reach(search)
    bracket = _first_lost(search, np.linspace(search.low, search.high, members))
    if bracket == (0.0, search.low):
        bracket = _first_lost(search, np.geomspace(shortest, search.low, members))
    elif bracket is None and longest > search.high:
        bracket = _first_lost(search, np.geomspace(search.high, longest, members))
    if bracket is None:
        return inf
    low, high = bracket
    if low == 0.0:
        return 0.0
    finer = _first_lost(search, np.linspace(low, high, members))
    return high if finer is None else finer[1]


def _first_lost(search: LimitSearch, values: np.ndarray) -> tuple[float, float] | None:
    """The value before the first one at which the plant is lost, 0 for none, and that one; None where all are kept."""
    lost = np.flatnonzero(~keeps_plant(search, values))
    if not len(lost):
        return None
    return (float(values[lost[0] - 1]) if lost[0] else 0.0), float(values[lost[0]])


def _notify(batch: Batch, search: LimitSearch, periods: np.ndarray, delays: np.ndarray) -> None:
    numbers = [
        np.arange(int((search.stop - delay) / period) + 1) for period, delay in zip(periods, delays, strict=True)
    ]
    members = np.repeat(np.arange(len(periods)), [len(own) for own in numbers])
    turn = np.concatenate(numbers)
    stamps = turn * periods[members]
    payload = dict(search.payload(stamps))
    arrivals = stamps + delays[members]
    if not search.node_events:
        values = payload | ({"node": turn % search.nodes + 1.0} if search.nodes else {})
        batch.notify(search.event, members, arrivals, **values)
        return
    events = {event.name: event for event in search.system.triggered_events}
    for node, name in enumerate(search.node_events):
        own = turn % len(search.node_events) == node
        fields = {s.name.removeprefix(f"{name}_") for s in events[name].payload}
        values = {field: values[own] for field, values in payload.items() if field in fields}
        batch.notify(name, members[own], arrivals[own], **values)


def _error(search: LimitSearch, names: list[str], instants: np.ndarray, found: np.ndarray, delay: float) -> np.ndarray:
    """Norm of the error over time, shape (k,)."""
    at = np.maximum(instants - delay, 0.0) if search.delayed_truth else instants
    truth = search.truth(at)
    return np.asarray(np.linalg.norm(found - np.stack([truth[name] for name in names], axis=1), axis=1))
