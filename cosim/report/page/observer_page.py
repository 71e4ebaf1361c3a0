"""The page of a comparison of observers: one HTML file that needs nothing else. Touches only the folder it is given."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from cosim.drawing.style import png
from cosim.report.figures.error_figures import speed_error_figure
from cosim.report.figures.observers_figure import observers_picture
from cosim.report.page.page_files import explained, write_files
from cosim.report.page.page_table import PageTable, simple_table
from cosim.report.page.phases import errors_table
from cosim.report.page.render import render
from cosim.report.page.run_tables import HOLDS, telegrams_table
from cosim.results.result import Result
from fmus.tables.numbers import DASH, cell, number
from fmus.tables.plain_data import jsonable

if TYPE_CHECKING:
    from cosim.observer_benchmark.benchmark_scores import BenchmarkScores

PAGE, PICTURE, DATA = "observers.html", "observers.png", "observers.json"


def write_benchmark(benchmark: BenchmarkScores, directory: str | Path) -> dict[str, Path]:
    """Write page, picture and data of a comparison of observers.

    Args:
        benchmark: what to write.
        directory: the folder; created where it does not exist.

    Returns:
        Paths by kind: ``page``, ``picture``, ``data``.

    Raises:
        OutputError: the folder cannot be written; former files are then still whole.
    """
    folder = Path(directory)
    picture = png(observers_picture(benchmark.scores))
    data = json.dumps(jsonable(benchmark.to_data()), indent=2) + "\n"
    contents = {PAGE: _benchmark_page(benchmark, picture).encode("utf-8"), PICTURE: picture, DATA: data.encode("utf-8")}
    with explained(f"The comparison cannot be written to {folder}", "Choose another output folder."):
        write_files(folder, contents)
    return {"page": folder / PAGE, "picture": folder / PICTURE, "data": folder / DATA}


def _benchmark_page(benchmark: BenchmarkScores, picture: bytes) -> str:
    """The page as text.

    Args:
        benchmark: scores of the observers.
        picture: PNG of `observers_picture`.

    Returns:
        The page.
    """
    metrics = [phase for score in benchmark.scores for phase in score.phases]
    return render(
        "observers.html.j2",
        f"Observers on one run: {benchmark.spec.title}",
        benchmark=benchmark,
        overview=_overview(benchmark),
        picture=picture,
        phases=errors_table(metrics, benchmark.labelled_spec()),
        over_time=_over_time(benchmark),
        certificates=_certificates(benchmark),
        telegrams=telegrams_table({s.label: s.telegrams for s in benchmark.scores if s.telegrams}, {}, "Observer"),
    )


def _overview(benchmark: BenchmarkScores) -> PageTable:
    rows = benchmark.rows()
    headings = list(rows[0]) if rows else []
    return simple_table(headings, [[cell(value) for value in row.values()] for row in rows], range(1, len(headings)))


def _certificates(benchmark: BenchmarkScores) -> PageTable:
    rows = [
        [
            score.label,
            number(c.limit),
            number(c.expected),
            HOLDS.get(str(c.holds_expected), DASH),
            number(c.seen),
            HOLDS.get(str(c.holds_seen), DASH),
        ]
        for score in benchmark.scores
        if (c := score.certificate) is not None
    ]
    headings = ["Observer", "Certified [s]", "Expected gap [s]", "For it", "Longest gap seen [s]", "For it"]
    return simple_table(headings, rows, (1, 2, 4))


def _over_time(benchmark: BenchmarkScores) -> bytes | None:
    """The speed errors of all observers as PNG; None where nothing can be drawn."""
    result = _merged_result(benchmark)
    if result is None or benchmark.spec.true_speed is None:
        return None
    names = {signal.name.partition(".")[0] for signal in result.signals}
    spec = benchmark.labelled_spec()
    shown = replace(spec, observers=[name for name in spec.observers if name in names])
    return png(speed_error_figure(result, shown).figure)


def _merged_result(benchmark: BenchmarkScores) -> Result | None:
    """One result with the columns of all observers whose rows are at the same times as those of the first one.

    Returns:
        The result, or None where no run has rows.
    """
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
