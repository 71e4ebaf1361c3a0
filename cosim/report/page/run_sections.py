"""What folds on the page of a run: its tables with what there is to know beside them, what is wrong first."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cosim.evaluation.balise_gaps import ENVELOPE
from cosim.evaluation.cost import was_compiled
from cosim.evaluation.error_table import error_table
from cosim.evaluation.event_counts import count_events
from cosim.evaluation.metrics import phase_metrics
from cosim.evaluation.result_warnings import all_warnings
from cosim.evaluation.spec import ReportSpec
from cosim.evaluation.summary_entries import list_entry, mapping_entry, statement
from cosim.expectations.evaluated import Evaluated
from cosim.report.live.live_page import Folded, Part, Rows, Section
from cosim.report.page.run_tables import run_tables
from cosim.results.result import Result
from fmus.tables.numbers import number
from fmus.tables.table import Column, Table, name_column, text_column

_CONSISTENCY = (
    "Squares of innovations (NIS) and of estimation errors (NEES) over what the filter's covariance lets expect. The "
    "mean of a consistent filter lies in the band in 99 % of runs, 95 % of its samples lie inside theirs."
)
_GAPS = (
    "Estimated minus true position just before the next balise is used, in metres and as the time the train needs for "
    "them at the speed it has there. The plain odometer is set to each balise and counts from there. Reference: "
    f"{ENVELOPE}."
)
_PHASES = (
    "Root mean squares of estimate minus true value. Before and after: in the last row before, and the first row "
    "after, each telegram that the observer used."
)


def run_sections(result: Result, spec: ReportSpec, evaluated: Sequence[Evaluated]) -> list[Section]:
    """All sections of the page of a run; those without content leave nothing behind.

    Args:
        result: the run. spec: roles, labels, phases. evaluated: expectations.
    """
    tables = run_tables(result, spec, evaluated)
    seeds = len(mapping_entry(result, "seed_study").get("seeds", []))
    in_c = "in C were not timed" if was_compiled(result) else "were timed in one call of 64"
    notes = list(dict.fromkeys(map(str, [*spec.notes, *list_entry(result, "notes")])))
    explained = [Folded(f"{name}: what was checked", [text]) for name, text in tables["explained"].items()]
    return [
        *_first(result, spec, evaluated, tables["expectations"]),
        Section(
            "Over several seeds", _with(f"Maximal speed error in m/s over {seeds} seeds of the run.", tables["seeds"])
        ),
        Section("Phase by phase", _with(_PHASES, tables["phases"])),
        Section("At the end of the longest gaps", _with(_GAPS, tables["gaps"])),
        Section("Certificates", [tables["certificates"], *explained]),
        Section("Balise telegrams", _telegrams(result, tables["telegrams"])),
        Section("Packets of the network", [tables["packets"]]),
        Section("Slip indicators", [tables["indicators"]]),
        Section("Odometer faults", [tables["faults"]]),
        Section("Consistency of the filters", _with(_CONSISTENCY, tables["consistency"])),
        Section("Signals", [Rows(signals_table(result), plots=False)]),
        Section("Components", [tables["components"]]),
        Section(
            "Calls",
            _with(f"Calls and the milliseconds they took. Reading (get) and writing (set) {in_c}.", tables["calls"]),
        ),
        Section("Messages of the components", _messages(result, tables["messages"])),
        Section("How it was run", [statement(result), notes]),
        Section("Versions", [tables["versions"]]),
    ]


def _first(result: Result, spec: ReportSpec, evaluated: Sequence[Evaluated], expectations: Table) -> list[Section]:
    """What is wrong, and the errors."""
    metrics = (
        phase_metrics(result, spec) if spec.true_speed or spec.true_position else []
    )  # a turbine has no such errors
    unmet = [f"{one.name}: {one.text}" for one in evaluated if not one.passed]
    warnings: list[Part] = [*all_warnings(result, spec)]
    sources = any(m.published is not None or m.independent is not None for m in metrics)
    text = "Estimate minus true value."
    if spec.evaluate_after > 0.0:
        text += f" Evaluated from {number(spec.evaluate_after)} s on, after the start-up."
    if sources:
        text += " Published numbers are those in print; independent ones were measured by a separate implementation."
    return [
        Section("Why the run ended early", [result.failure or ""], mood="bad"),
        Section("Expectations not met", [unmet], mood="bad"),
        Section(f"Warnings ({len(warnings)})", warnings, mood="doubt"),
        Section("Errors of the observers", _with(text, error_table(metrics, spec))),
        Section("Expectations", [expectations]),
    ]


def _with(text: str, table: Table) -> list[Part]:
    """A table and what is said of it; nothing where it has no rows."""
    return [text, table] if table else []


def _telegrams(result: Result, table: Table) -> list[Part]:
    if not result.events:
        return []
    counts = count_events(result.events)
    text = (
        f"{counts.delivered} telegrams were delivered, {counts.missed} balises were missed; {counts.false} telegrams "
        f"were false."
    )
    late = f" {counts.undelivered} were on their way when the run ended." if counts.undelivered else ""
    return [text + late, table]


def _messages(result: Result, table: Table) -> list[Part]:
    hidden = len(table.rows) < len(result.messages)
    return [f"The first and last of {len(result.messages)} messages; messages.csv holds them." if hidden else "", table]


_SIGNAL_COLUMNS = (
    name_column("signal", "Signal"),
    text_column("unit", "Unit"),
    Column("least", "Smallest", digits=5),
    Column("largest", "Largest", digits=5),
    Column("mean", "Mean", "", "Over the time of the run", digits=5),
    Column("last", "At the end", digits=5),
    text_column("remark", "Remark"),
    text_column("description", "Description"),
)


def signals_table(result: Result) -> Table:
    """Every recorded signal in the unit in which it is shown: smallest, largest, mean and last value, and whether it
    never changes or is not finite somewhere.

    Args:
        result: the run.
    """
    signals = result.signals if len(result.time) else []
    rows = [
        [s.name, s.shown.name, *_numbers(result.time, s.shown.values(result[s.name])), s.description] for s in signals
    ]
    return Table("signals", _SIGNAL_COLUMNS, rows).filled()


def _numbers(time: np.ndarray, values: np.ndarray) -> list[float | str | None]:
    finite = np.isfinite(values)
    if not finite.any():
        return [None, None, None, float(values[-1]), "never finite"]
    kept = values[finite]
    low, high = float(np.min(kept)), float(np.max(kept))
    steps = np.diff(time)
    whole = finite.all() and float(np.sum(steps)) > 0.0 and max(abs(low), abs(high)) < 1e150
    mean = float(np.sum(steps * (values[1:] / 2 + values[:-1] / 2)) / np.sum(steps)) if whole else None
    odd = f"not finite in {np.count_nonzero(~finite)} rows" if not finite.all() else ""
    return [low, high, mean, float(values[-1]), odd or ("never changes" if low == high else "")]
