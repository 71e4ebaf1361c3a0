"""What a report says first: how the run ended and the few numbers that matter. Imports NumPy only."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from cosim.evaluation.event_counts import count_events
from cosim.evaluation.result_warnings import all_warnings
from cosim.evaluation.roles import Quantity, label
from cosim.evaluation.spec import ReportSpec
from cosim.evaluation.summary_entries import list_entry, mapping_entry, number_entry
from cosim.report.live.live_page import Card
from cosim.report.page.run_verdict import ObserverStatus
from cosim.results.result import Result
from fmus.tables.numbers import DASH, error_number, instant


def run_statements(result: Result, spec: ReportSpec, statuses: Sequence[ObserverStatus]) -> list[Card]:
    """The numbers at the head of a report, the most important first.

    Args:
        result: the run. spec: roles. statuses: how the observers did, the best first.
    """
    cards: list[Card | None] = [_ending(result), _expectations(result)]
    cards += [_error(spec, statuses, "speed", "m/s"), _error(spec, statuses, "position", "m")]
    cards += [_telegrams(result), _certificates(result), _warnings(result, spec)]
    return [card for card in cards if card is not None]


def _ending(result: Result) -> Card:
    reached = instant(float(result.time[-1])) if len(result.time) else "0"
    if result.failure:
        stop = number_entry(result.summary, "stop")
        return "Run", "ended early", f"at {reached} s" + (f" of {instant(stop)} s" if stop is not None else ""), "bad"
    return "Run", "complete", f"to {reached} s", "good"


def _expectations(result: Result) -> Card | None:
    evaluated = [entry for entry in list_entry(result, "expectations") if isinstance(entry, Mapping)]
    if not evaluated:
        return None
    met = sum(entry.get("passed") is True for entry in evaluated)
    return "Expectations", f"{met} of {len(evaluated)} met", "", "good" if met == len(evaluated) else "bad"


def _error(spec: ReportSpec, statuses: Sequence[ObserverStatus], quantity: Quantity, unit: str) -> Card | None:
    """The largest error of the observers that follow the train, or of all where none does."""
    sizes = {s.name: getattr(s, quantity) for s in statuses if not s.fails} or {
        s.name: getattr(s, quantity) for s in statuses
    }
    sizes = {name: size for name, size in sizes.items() if not np.isnan(size)}
    name = f"Largest {quantity} error"
    if not sizes:
        return (name, DASH, "too few rows to judge", "doubt") if spec.observers and statuses else None
    worst = max(sizes, key=lambda o: sizes[o])
    failing = len(statuses) - len(sizes)
    among = f", the worst of {len(sizes)}" if len(sizes) > 1 else ""
    among += f", {failing} failing left out" if failing else ""
    value = error_number(sizes[worst])
    return (
        (name, value, label(spec, worst) + among, "bad")
        if np.isinf(sizes[worst])
        else (name, f"{value} {unit}", label(spec, worst) + among, "")
    )


def _telegrams(result: Result) -> Card | None:
    if not result.events:
        return None
    counts = count_events(result.events)
    wrong = counts.false + counts.missed
    remark = f"{counts.false} false, {counts.missed} missed"
    return "Balise telegrams", f"{counts.delivered} delivered", remark, "doubt" if wrong else ""


def _certificates(result: Result) -> Card | None:
    known = [
        entry.get("holds") for entry in mapping_entry(result, "certificates").values() if isinstance(entry, Mapping)
    ]
    evaluated = [str(holds) for holds in known if holds is not None]
    if not evaluated:
        return None
    holding = evaluated.count("True")
    return (
        "Certificates",
        f"{holding} of {len(evaluated)} hold",
        "for the gaps expected",
        "good" if holding == len(evaluated) else "doubt",
    )


def _warnings(result: Result, spec: ReportSpec) -> Card | None:
    count = len(all_warnings(result, spec))
    return ("Warnings", str(count), "see below", "doubt") if count else None
