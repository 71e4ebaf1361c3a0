"""The page of a comparison of observers: one HTML file that needs nothing else. Touches only the folder it is given."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from cosim.drawing.style import png
from cosim.report.figures.error_figures import SpeedErrorPanel
from cosim.report.page.page_files import explained, write_files
from cosim.report.page.render import render
from cosim.report.page.run_tables import HOLDS, OBSERVER, telegrams_table
from cosim.results.result import Result
from fmus.tables.plain_data import jsonable
from fmus.tables.table import Column, Table, text_column

if TYPE_CHECKING:
    from cosim.choice.benchmark_scores import BenchmarkScores
from collections.abc import Sequence
from math import isfinite
from typing import TYPE_CHECKING, Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from cosim.drawing.style import MARK, axes_or_new, new_figure, observer_line, styled

if TYPE_CHECKING:
    from cosim.choice.observer_scores import ObserverScore

PAGE, PICTURE, DATA = "observers.html", "observers.png", "observers.json"


_MARKERS = "osD^vP*Xph"
"""A shape for each observer beside its colour."""


@styled
def _errors_figure(scores: Sequence[ObserverScore], ax: Axes | None = None) -> Axes:
    """Speed errors of observers in m/s on a logarithmic axis: rms and largest over the whole run, rms just before
    telegrams.
    """
    ax = axes_or_new(ax, (8.2, 1.4 + 0.45 * len(scores)))
    names = [score.name for score in scores]
    labelled: set[str] = set()
    for place, score in enumerate(scores):
        _draw_line(ax, place, score, observer_line(names, score.name)["color"], labelled)
    if any(_points(score) for score in scores):
        ax.set_xscale("log")
    ax.set_yticks(range(len(scores)), [score.label for score in scores])
    ax.set_ylim(len(scores) - 0.5, -0.5)
    ax.set_xlabel("Speed error [m/s]")
    handles, labels = ax.get_legend_handles_labels()
    if handles:
        ax.legend(handles, labels, loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=3, frameon=False)
    return ax


def _draw_line(ax: Axes, place: int, score: ObserverScore, colour: Any, labelled: set[str]) -> None:
    """The line of one observer; what has no label in the legend yet gets one."""
    points = _points(score)
    for what, (value, marker, face) in points.items():
        ax.plot(
            [value],
            [place],
            marker,
            markersize=8,
            markeredgecolor=colour,
            color=colour if face else "none",
            label=None if what in labelled else what,
            linestyle="none",
        )
        labelled.add(what)
    if len(points) > 1:
        ends = [value for value, _, _ in points.values()]
        ax.hlines(place, min(ends), max(ends), color=colour, linewidth=1.0, zorder=1)
    if not points:
        word = "no numbers" if score.failure else "no speed"
        ax.annotate(word, (0.02, place), xycoords=("axes fraction", "data"), va="center", color=MARK)


def _points(score: ObserverScore) -> dict[str, tuple[float, str, bool]]:
    """What to draw of an observer: value, marker, and whether it is filled."""
    speed = None if score.whole is None else score.whole.speed
    at = score.speed_at_balises
    values = {
        "rms": (None if speed is None else speed.rms, "o", True),
        "rms just before telegrams": (None if at is None else at.rms, "D", False),
        "largest": (None if speed is None else speed.max_abs, "|", True),
    }
    return {
        what: (v, marker, face)
        for what, (v, marker, face) in values.items()
        if v is not None and isfinite(v) and v > 0.0
    }


@styled
def _cost_figure(scores: Sequence[ObserverScore], ax: Axes | None = None) -> Axes:
    """Cost in us per communication step against the rms speed error in m/s; left and low is good."""
    ax = axes_or_new(ax, (8.2, 4.0))
    names = [score.name for score in scores]
    for number, score in enumerate(scores):
        error, cost = score.speed_rms, score.cost
        if error is None or cost is None or not isfinite(error) or error <= 0.0:
            continue
        colour = observer_line(names, score.name)["color"]
        marker = _MARKERS[number % len(_MARKERS)]
        ax.plot([error], [cost], marker, markersize=9, color=colour, label=score.label, linestyle="none")
        ax.vlines(error, min(score.costs), max(score.costs), color=colour, linewidth=1.0)
    handles, labels = ax.get_legend_handles_labels()
    if handles:
        ax.set_xscale("log")
        ax.legend(handles, labels, loc="upper left", bbox_to_anchor=(1.0, 1.0), frameon=False)
    ax.set_ylim(0.0, 1.15 * max((max(score.costs) for score in scores if score.costs), default=1.0))
    ax.set_xlabel("rms speed error [m/s]")
    ax.set_ylabel("Cost per communication step [µs]")
    return ax


@styled
def _observers_picture(scores: Sequence[ObserverScore]) -> Figure:
    """Both figures, one above the other."""
    figure = new_figure((9.0, 5.4 + 0.45 * len(scores)))
    upper, lower = figure.subplots(2, 1, height_ratios=[1.0 + 0.45 * len(scores), 3.6])
    _errors_figure(scores, upper)
    _cost_figure(scores, lower)
    return figure


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
    picture = png(_observers_picture(benchmark.scores))
    data = json.dumps(jsonable(benchmark.to_data()), indent=2) + "\n"
    contents = {PAGE: _benchmark_page(benchmark, picture).encode("utf-8"), PICTURE: picture, DATA: data.encode("utf-8")}
    with explained(f"The comparison cannot be written to {folder}", "Choose another output folder."):
        write_files(folder, contents)
    return {"page": folder / PAGE, "picture": folder / PICTURE, "data": folder / DATA}


def _benchmark_page(benchmark: BenchmarkScores, picture: bytes) -> str:
    """The page as text."""
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
