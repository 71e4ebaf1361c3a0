"""The page of a comparison of observers: one HTML file that needs nothing else. Touches only the folder it is given."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from cosim.drawing.style import png
from cosim.report.figures.error_figures import SpeedErrorPanel
from cosim.report.figures.observers_figure import observers_picture
from cosim.report.page.page_files import explained, write_files
from cosim.report.page.render import render
from cosim.report.page.run_tables import HOLDS, OBSERVER, telegrams_table
from cosim.results.result import Result
from fmus.tables.plain_data import jsonable
from fmus.tables.table import Column, Table, text_column

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
    return render(
        "observers.html.j2",
        f"Observers on one run: {benchmark.spec.title}",
        benchmark=benchmark,
        overview=benchmark.table(),
        picture=picture,
        phases=benchmark.errors(),
        over_time=_over_time(benchmark),
        certificates=_certificates(benchmark),
        telegrams=telegrams_table({s.label: s.telegrams for s in benchmark.scores if s.telegrams}, {}, "Observer"),
    )


def _certificates(benchmark: BenchmarkScores) -> Table:
    rows = [
        [s.label, c.limit, c.expected, HOLDS.get(str(c.holds_expected)), c.seen, HOLDS.get(str(c.holds_seen))]
        for s in benchmark.scores
        if (c := s.certificate) is not None
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


def _over_time(benchmark: BenchmarkScores) -> bytes | None:
    """The speed errors of all observers as PNG; None where nothing can be drawn."""
    result = _merged_result(benchmark)
    if result is None or benchmark.spec.true_speed is None:
        return None
    names = {signal.name.partition(".")[0] for signal in result.signals}
    spec = benchmark.labelled_spec()
    shown = replace(spec, observers=[name for name in spec.observers if name in names])
    return png(SpeedErrorPanel.draw(result, shown).figure)


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
