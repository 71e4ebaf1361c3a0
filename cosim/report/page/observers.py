"""The page of a comparison of observers: one HTML file that needs nothing else. Touches only the folder it is given."""

from __future__ import annotations

import json
import tempfile
from base64 import b64encode
from dataclasses import replace
from html import escape
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.figure import Figure

from cosim.errors import OutputError
from cosim.evaluation.event_counts import outcome_columns
from cosim.evaluation.numbers import DASH, cell, number
from cosim.report.error_table import html_table
from cosim.report.figures.error_figures import speed_error_figure
from cosim.report.figures.observers_figure import observers_picture
from cosim.report.page.parts import box, bullets, page, paragraph, scrolling, section, simple_table
from cosim.results.result import Result
from cosim.results.summary_file import jsonable

if TYPE_CHECKING:
    from cosim.observer_benchmark.observers import ObserverBenchmark

PAGE, PICTURE, DATA = "observers.html", "observers.png", "observers.json"
DPI = 120


def write_benchmark(benchmark: ObserverBenchmark, directory: str | Path) -> dict[str, Path]:
    """Write page, picture and data of a comparison of observers.

    Returns:
        Paths by kind: ``page``, ``picture``, ``data``.

    Raises:
        OutputError: the folder cannot be written; former files are then still whole.
    """
    folder = Path(directory)
    picture = _png(observers_picture(benchmark.scores))
    data = json.dumps(jsonable(benchmark.to_data()), indent=2) + "\n"
    contents = {PAGE: benchmark_page(benchmark, picture).encode("utf-8"), PICTURE: picture, DATA: data.encode("utf-8")}
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(dir=folder, prefix=".writing-") as scratch:
            for name, content in contents.items():
                (Path(scratch) / name).write_bytes(content)
            for name in contents:
                (Path(scratch) / name).replace(folder / name)
    except OSError as error:
        reason = error.strerror or str(error)
        raise OutputError(
            f"The comparison cannot be written to {folder}: {reason}. Choose another output folder."
        ) from error
    return {"page": folder / PAGE, "picture": folder / PICTURE, "data": folder / DATA}


def benchmark_page(benchmark: ObserverBenchmark, picture: bytes) -> str:
    """The page as text.

    Args:
        benchmark: scores of the observers. picture: PNG of `observers_picture`.
    """
    title = f"Observers on one run: {benchmark.spec.title}"
    failures = [f"{score.label}: {score.failure}" for score in benchmark.scores if score.failure is not None]
    caption = "Speed errors of each observer, and what a communication step costs against the rms speed error."
    return page(
        title,
        [
            f"<header>\n<h1>{escape(title)}</h1>\n{paragraph(_statement(benchmark))}\n</header>",
            box("warning", "Without numbers, or cut short", bullets(failures)) if failures else "",
            section("Overview", _overview(benchmark)),
            section("Errors and cost", _figure(picture, "Errors and cost", caption)),
            section("Errors by phase", _phases(benchmark)),
            section("Speed error against time", _over_time(benchmark)),
            section("Certificates", _certificates(benchmark)),
            section("Telegrams", _telegrams(benchmark)),
            section("How it was done", bullets(benchmark.notes)),
        ],
    )


def _statement(benchmark: ObserverBenchmark) -> str:
    return (
        f"{len(benchmark.scores)} observers, each alone beside the same recorded run of {benchmark.steps} "
        f"communication steps. "
        "v is the speed error, p the position error, estimate minus true value, from the start of the evaluation on. "
        "'At "
        "balises' is just before a telegram is used. 'Holds' says whether the certificate covers the gaps expected "
        "before the "
        "run, and those seen in it. The cost is the time spent in the observer per communication step, called from "
        "Python."
    )


def _overview(benchmark: ObserverBenchmark) -> str:
    rows = benchmark.rows()
    if not rows:
        return ""
    return simple_table(
        list(rows[0]), [[cell(value) for value in row.values()] for row in rows], range(1, len(rows[0]))
    )


def _phases(benchmark: ObserverBenchmark) -> str:
    metrics = [phase for score in benchmark.scores for phase in score.phases]
    return scrolling(html_table(metrics, benchmark.labelled_spec())) if metrics else ""


def _certificates(benchmark: ObserverBenchmark) -> str:
    words = {True: "holds", False: "does not hold", None: DASH}
    rows = [
        [
            score.label,
            number(c.limit),
            number(c.expected),
            words[c.holds_expected],
            number(c.seen),
            words[c.holds_seen],
        ]
        for score in benchmark.scores
        if (c := score.certificate) is not None
    ]
    headings = ["Observer", "Certified [s]", "Expected gap [s]", "For it", "Longest gap seen [s]", "For it"]
    return simple_table(headings, rows, (1, 2, 4)).replace(
        "<td>does not hold</td>", '<td class="bad">does not hold</td>'
    )


def _telegrams(benchmark: ObserverBenchmark) -> str:
    chosen = outcome_columns(score.telegrams for score in benchmark.scores)
    rows = [
        [s.label, *(str(s.telegrams.get(outcome, 0)) for outcome in chosen)] for s in benchmark.scores if s.telegrams
    ]
    return simple_table(["Observer", *chosen.values()], rows, range(1, len(chosen) + 1))


def _over_time(benchmark: ObserverBenchmark) -> str:
    result = merged_result(benchmark)
    if result is None or benchmark.spec.true_speed is None:
        return ""
    names = {signal.name.partition(".")[0] for signal in result.signals}
    spec = benchmark.labelled_spec()
    shown = replace(spec, observers=[name for name in spec.observers if name in names])
    figure = speed_error_figure(result, shown).get_figure(root=True)
    assert figure is not None
    return _figure(_png(figure), "Speed error", "Estimated minus true speed of all observers against time.")


def merged_result(benchmark: ObserverBenchmark) -> Result | None:
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


def _png(figure: Figure) -> bytes:
    stream = BytesIO()
    figure.savefig(stream, format="png", dpi=DPI)
    return stream.getvalue()


def _figure(data: bytes, title: str, caption: str) -> str:
    source = b64encode(data).decode("ascii")
    return (
        f'<figure>\n<img alt="{escape(f"{title}. {caption}")}" src="data:image/png;base64,{source}">\n'
        f"<figcaption><b>{escape(title)}.</b> {escape(caption)}</figcaption>\n</figure>"
    )
