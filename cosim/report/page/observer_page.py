"""The page of a comparison of observers: one HTML file that needs nothing else. Touches only the folder it is given."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from cosim.evaluation.spec import ReportSpec
from cosim.report.live.live_page import LivePage, PageVerdict, Rows, Section
from cosim.report.live.render import live_page
from cosim.report.page.page_files import explained, page_bytes, write_files
from cosim.report.page.picture_files import PictureKind, Pictures, picture_kind, write_pictures
from cosim.report.page.run_curves import run_panels, run_recording
from cosim.report.page.run_marks import run_marks
from cosim.report.page.run_tables import HOLDS, OBSERVER, telegrams_table
from cosim.results.result import Result
from cosim.results.results_folder import FIGURES
from fmus.tables.numbers import number
from fmus.tables.plain_data import jsonable
from fmus.tables.table import Column, Table, text_column

if TYPE_CHECKING:
    from cosim.choice.benchmark_scores import BenchmarkScores

PAGE, DATA = "observers.html", "observers.json"
_HOW = (
    "v is the speed error, p the position error, estimate minus true value, from the start of the evaluation on. 'At "
    "balises' is just before a telegram is used. 'Holds' says whether the certificate covers the gaps expected before "
    "the run, and those seen in it. The cost is the time spent in the observer per communication step, called from "
    "Python."
)


@dataclass(frozen=True)
class Answer:
    """What follows from a comparison.

    Args:
        text: in a line. good: whether it is a good one. groups: observers by what they are good for.
        data: plain data, to be written in place of those of the comparison.
    """

    text: str
    good: bool
    groups: Sequence[Table]
    data: Mapping[str, Any]


def write_benchmark(
    benchmark: BenchmarkScores, directory: str | Path, answer: Answer | None = None, *, figures: Pictures = False
) -> dict[str, Path]:
    """Write page and data of a comparison of observers.

    Args:
        benchmark: what to write.
        directory: the folder; created where it does not exist.
        answer: what follows from it and from other runs; None for nothing but the comparison.
        figures: whether those of the run are drawn as well, in ``figures/``, see `Pictures`.

    Returns:
        Paths by kind: ``page``, ``data``.

    Raises:
        OutputError: the folder cannot be written; former files are then still whole.
    """
    folder = Path(directory)
    data = json.dumps(jsonable(benchmark.to_data() if answer is None else answer.data), indent=2) + "\n"
    contents = {PAGE: page_bytes(live_page(_benchmark_page(benchmark, answer))), DATA: data.encode("utf-8")}
    with explained(f"The comparison cannot be written to {folder}", "Choose another output folder."):
        write_files(folder, contents)
    if figures:
        write_pictures(_drawn(benchmark, picture_kind(figures)), folder / FIGURES, picture_kind(figures))
    return {"page": folder / PAGE, "data": folder / DATA}


def _drawn(benchmark: BenchmarkScores, kind: PictureKind) -> dict[str, bytes]:
    """Figures of the run with all observers in it, by name."""
    from cosim.report.figures.panels import draw_all  # noqa: PLC0415 - matplotlib only for those who draw

    result, spec = _merged(benchmark)
    return {} if result is None else {panel.name: data for panel, data in draw_all(result, spec, kind).items()}


def _benchmark_page(benchmark: BenchmarkScores, answer: Answer | None = None) -> LivePage:
    """What the page of a comparison of observers shows.

    Args:
        benchmark: what was compared. answer: what follows from it.
    """
    result, spec = _merged(benchmark)
    failed = [f"{score.label}: {score.failure}" for score in benchmark.scores if score.failure is not None]
    telegrams = telegrams_table({s.label: s.telegrams for s in benchmark.scores if s.telegrams}, {}, "Observer")
    return LivePage(
        title=f"{'Observers on one run' if answer is None else 'Which observer'}: {benchmark.spec.title}",
        verdict=_verdict(benchmark) if answer is None else PageVerdict(answer.text, "" if answer.good else "bad"),
        lead=_lead(benchmark, answer),
        recordings=[] if result is None else [run_recording(result, spec)],
        panels=[] if result is None else run_panels(result, spec),
        marks=[] if result is None else run_marks(result, spec),
        settled=spec.evaluate_after,
        sections=[
            *(Section(_heading(g), [Rows(g)], is_open=True) for g in (() if answer is None else answer.groups) if g),
            Section("Without numbers, or cut short", [failed], mood="doubt"),
            Section("Overview", [Rows(benchmark.table())], is_open=True),
            Section("Errors by phase", [Rows(benchmark.errors(), plots=False)]),
            Section("Certificates", [_certificates(benchmark)]),
            Section("Telegrams", [telegrams]),
            Section("How it was done", [_HOW, [*benchmark.notes]]),
        ],
    )


def _lead(benchmark: BenchmarkScores, answer: Answer | None) -> str:
    """Of which run curves and overview are."""
    count = f"{len(benchmark.scores)} observers"
    if answer is None:
        return f"{count}, each alone beside the same recorded run of {benchmark.steps} steps."
    return f"Curves and overview show {count}, the best and the plain odometer, in the undisturbed run."


def _heading(group: Table) -> str:
    """The title of a table as that of a section."""
    return group.title[:1].upper() + group.title[1:]


def _verdict(benchmark: BenchmarkScores) -> PageVerdict:
    """Which observer has the smallest error, and how many have none."""
    known = [s for s in benchmark.scores if s.speed_rms is not None and isfinite(s.speed_rms)]
    if not known:
        return PageVerdict("No observer has a speed error that can be compared.", "bad")
    best, count = min(known, key=lambda s: s.speed_rms or 0.0), len(benchmark.scores)
    text = (
        f"{best.label} has the smallest rms speed error of {count} observers in this run, {number(best.speed_rms)} m/s."
    )
    lost = count - len(known)
    return PageVerdict(text + (f" {lost} diverged or have no numbers." if lost else ""), "doubt" if lost else "")


def _certificates(benchmark: BenchmarkScores) -> Table:
    rows = [
        [s.label, c.value, c.demand, HOLDS.get(str(c.holds)), seen.value, HOLDS.get(str(seen.holds))]
        for s in benchmark.scores
        if (c := s.certificate) is not None
        for seen in c.conditions
    ]
    columns = [
        OBSERVER,
        Column("limit", "Certified", "s", "Longest gap that the certificate covers"),
        Column("expected", "Expected gap", "s", "Longest, from the layout of the balises and the speed"),
        text_column("holds_expected", "For it"),
        Column("seen", "Longest gap seen", "s"),
        text_column("holds_seen", "For it"),
    ]
    return Table("certificates", columns, rows)


def _merged(benchmark: BenchmarkScores) -> tuple[Result | None, ReportSpec]:
    """One run with all observers in it, where any came through, and what the signals are."""
    result, spec = _merged_result(benchmark), benchmark.labelled_spec()
    if result is None:
        return None, spec
    names = {signal.name.partition(".")[0] for signal in result.signals}
    return result, replace(spec, observers=[name for name in spec.observers if name in names])


def _merged_result(benchmark: BenchmarkScores) -> Result | None:
    """One result with the columns of all observers whose rows are at the same times as those of the first one."""
    columns: dict[str, np.ndarray] = {}
    first: Result | None = None
    signals = []
    for outcome in benchmark.outcomes.values():
        result = outcome.result
        if first is None:
            first = result
        if len(result.time) and np.array_equal(result.time, first.time):
            new = [signal for signal in result.signals if signal.name not in columns]
            signals += new
            columns |= {signal.name: result[signal.name] for signal in new}
    if first is None or not len(first.time):
        return None
    table = np.empty(len(first.time), dtype=[("time", float), *((name, float) for name in columns)])
    table["time"] = first.time
    for name, values in columns.items():
        table[name] = values
    return Result(table, signals, first.events)
