"""What a report says first: how the run ended and the few numbers that matter. Imports NumPy only."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from cosim.evaluation.event_counts import count_events
from cosim.evaluation.metrics import judged_size
from cosim.evaluation.result_warnings import all_warnings, result_warnings
from cosim.evaluation.roles import Quantity, estimation_error, label
from cosim.evaluation.spec import ReportSpec
from cosim.evaluation.summary_entries import list_entry, mapping_entry, number_entry
from cosim.results.result import Result
from fmus.tables.numbers import DASH, error_number, number

Statement = tuple[str, str, str, str]
"""Name, value, remark, mood."""


def run_statements(result: Result, spec: ReportSpec) -> list[Statement]:
    """The facts at the head of a report, the most important first.

    Args:
        result: the run. spec: roles.
    """
    facts: list[Statement | None] = [_ending(result, spec), _expectations(result)]
    facts += [_error(result, spec, "speed", "m/s"), _error(result, spec, "position", "m")]
    facts += [_telegrams(result), _certificates(result), _warnings(result, spec)]
    return [fact for fact in facts if fact is not None]


def _ending(result: Result, spec: ReportSpec) -> Statement:
    reached = number(float(result.time[-1])) if len(result.time) else "0"
    if result.failure:
        stop = number_entry(result.summary, "stop")
        return "Run", "ended early", f"at {reached} s" + (f" of {number(stop)} s" if stop is not None else ""), "bad"
    if result_warnings(result, spec):
        return "Run", "complete", f"to {reached} s, but it shows little: see the warnings", "doubt"
    return "Run", "complete", f"to {reached} s", "good"


def _expectations(result: Result) -> Statement | None:
    judged = [entry for entry in list_entry(result, "expectations") if isinstance(entry, Mapping)]
    if not judged:
        return None
    met = sum(entry.get("passed") is True for entry in judged)
    return "Expectations", f"{met} of {len(judged)} met", "", "good" if met == len(judged) else "bad"


def _error(result: Result, spec: ReportSpec, quantity: Quantity, unit: str) -> Statement | None:
    """The largest error of all observers, after the start-up."""
    settled = result.time >= spec.evaluate_after
    found = {o: e for o in spec.observers if (e := estimation_error(result, spec, o, quantity)) is not None}
    sizes = {o: judged_size(result.time[settled], e[settled]).max_abs for o, e in found.items()}
    if not sizes:
        return None
    name = f"Largest {quantity} error"
    worst = max(sizes, key=lambda o: sizes[o])
    if np.isnan(sizes[worst]):  # the rows judged are those of all observers
        return name, DASH, "too few rows to judge", "doubt"
    among = f", the worst of {len(sizes)}" if len(sizes) > 1 else ""
    if np.isinf(sizes[worst]):
        return name, error_number(sizes[worst]), label(spec, worst) + among, "bad"
    return name, f"{error_number(sizes[worst])} {unit}", label(spec, worst) + among, ""


def _telegrams(result: Result) -> Statement | None:
    if not result.events:
        return None
    counts = count_events(result.events)
    wrong = counts.false + counts.missed
    remark = f"{counts.false} false, {counts.missed} missed"
    return "Balise telegrams", f"{counts.delivered} delivered", remark, "doubt" if wrong else ""


def _certificates(result: Result) -> Statement | None:
    known = [
        entry.get("holds") for entry in mapping_entry(result, "certificates").values() if isinstance(entry, Mapping)
    ]
    judged = [str(holds) for holds in known if holds is not None]
    if not judged:
        return None
    holding = judged.count("True")
    return (
        "Certificates",
        f"{holding} of {len(judged)} hold",
        "for the gaps expected",
        "good" if holding == len(judged) else "doubt",
    )


def _warnings(result: Result, spec: ReportSpec) -> Statement | None:
    count = len(all_warnings(result, spec))
    return ("Warnings", str(count), "see below", "doubt") if count else None
