"""The page of a sweep or campaign: its runs as a table to sort and filter, distributions, parallel coordinates, and a
measure over what was varied. Touches no file.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from cosim.report.live.live_page import LivePage, Mood, PageCurve, PagePanel, PageRecording, PageVerdict, Rows, Section
from cosim.results.results_folder import REPORT
from cosim.statistics.sensitivity import rank_correlation
from cosim.studies.measures import UNMET, is_number, setting_text
from cosim.studies.setting_units import setting_unit
from cosim.studies.warnings_of_runs import counted
from fmus.tables.numbers import number
from fmus.tables.table import Column, Table

if TYPE_CHECKING:
    from cosim.studies.sweep_runs import SweepRun, SweepRuns

_MOST_ROWS = 500
"""Runs whose rows the page of a sweep holds; a row of 20 measures takes a kilobyte."""
_MOST_LINES = 100
"""Lines of what failed."""
_MOST_CURVES = 8
"""Combinations of the other values that are drawn as lines."""
_SPREADS = 4  # components whose spread the verdict says
_SHOWN = 2  # measures that are drawn at first
_FEWEST = 5  # runs from which a rank correlation says something
_STRONG = 0.6  # rank correlation that is named


def sweep_page(result: SweepRuns, directory: Path) -> LivePage:
    """What the page of a sweep shows.

    Args:
        result: the runs. directory: where the page will stand, which its links are relative to.
    """
    (recordings, panels), shown = measured_curves(result), _shown_runs(result)
    links, folders = [_link(run, directory) for run in shown.runs], [_folder(run, directory) for run in shown.runs]
    click = "see its page" if any(links) else "see how its page is made" if any(folders) else ""
    about = f"What was varied: {', '.join(result.names)}. Drag on an axis to choose runs."
    more = f" Click a run to {click}." if click else " No results of a single run were kept."
    return LivePage(
        title=f"{result.scenario.name}: {len(result)} runs",
        verdict=_verdict(result),
        finding=_finding(result),
        lead=about + more,
        recordings=recordings,
        panels=panels,
        sections=[
            Section("Runs", [*_left_out(result, shown), Rows(_table(shown), links, folders)], is_open=True),
            Section("What failed", [_first_lines(result.troubles())], mood="bad"),
            *_warnings(result),
        ],
    )


def _shown_runs(result: SweepRuns) -> SweepRuns:
    """The runs whose rows the page holds, in their order: of many those that failed or are not as expected, then those
    with the largest size of the measure that the page speaks of first.
    """
    if len(result) <= _MOST_ROWS:
        return result
    column = _measure(result)
    sizes = {run.number: abs(value) for run, value in _known(result, column.key)} if column is not None else {}
    first = sorted(result.runs, key=lambda run: (run.ending == "done", -sizes.get(run.number, np.inf)))[:_MOST_ROWS]
    return replace(result, runs=sorted(first, key=lambda run: run.number))


def _left_out(result: SweepRuns, shown: SweepRuns) -> list[str]:
    """Which rows the page does not hold, in a sentence; nothing where it holds all."""
    if len(shown) == len(result):
        return []
    column = _measure(result)
    largest = f", then those with the largest {column.heading}" if column is not None else ""
    count = f"{len(shown)} of {len(result)} runs"
    return [f"{count}: those that failed or are not as expected{largest}. All stand in index.csv."]


def _first_lines(lines: list[str]) -> list[str]:
    """The first lines of what failed, and how many more there are."""
    left = len(lines) - _MOST_LINES
    return lines if left <= 0 else [*lines[:_MOST_LINES], f"and {left} more, see the column failure of index.csv"]


def _warnings(result: SweepRuns) -> list[Section]:
    """The distinct warnings of the runs, folded; nothing where there is none."""
    lines = [warning.line() for warning in result.warnings]
    return [Section(f"Warnings ({len(lines)})", [lines], mood="doubt")] if lines else []


def measured_curves(result: SweepRuns) -> tuple[list[PageRecording], list[PagePanel]]:
    """Measures over what was varied, and the panels that show them, first of those that differ between the runs.

    Args:
        result: the runs.
    """
    recordings = _recordings(result)
    names = list(dict.fromkeys(curve.name for recording in recordings for curve in recording.curves))
    return recordings, [PagePanel(name, [name], is_shown=place < _SHOWN) for place, name in enumerate(names)]


def _folder(run: SweepRun, directory: Path) -> str | None:
    """Its results as seen from the page of the sweep, None where there are none beside it."""
    return run.folder.name if run.folder is not None and run.folder.parent == directory else None


def _link(run: SweepRun, directory: Path) -> str | None:
    """Its page as seen from that of the sweep, None where it has none."""
    folder = _folder(run, directory)
    return f"{folder}/{REPORT}" if folder is not None and (directory / folder / REPORT).exists() else None


def _table(result: SweepRuns) -> Table:
    """A row for each run: what was varied, what became of it, the chosen measures; numbers as such, which are sorted
    and drawn.
    """
    shown = result.shown()
    numbers = {name for name in result.names if all(is_number(run.settings.get(name)) for run in result.runs)}
    columns = [
        Column(c.key, c.heading, setting_unit(result.scenario, c.key) or "", write=setting_text)
        if c.key in numbers
        else c
        for c in shown.columns
    ]
    return replace(shown, columns=columns)


def _known(result: SweepRuns, measure: str) -> list[tuple[SweepRun, float]]:
    """Runs with a finite value of a measure, the largest size first."""
    found = [(run, run.measures[measure]) for run in result.runs if np.isfinite(run.measures.get(measure, np.nan))]
    return sorted(found, key=lambda entry: -abs(entry[1]))


def _measure(result: SweepRuns) -> Column | None:
    """The measure that the page speaks of first: one that differs between the runs, where there is one."""
    return next(iter(result.varying_first), None)


def _verdict(result: SweepRuns) -> PageVerdict:
    count, failed = len(result), len(result.failed)
    if not count:
        return PageVerdict("No run was made.", "bad")
    text = f"{count - failed} of {count} runs came to their end"
    text += f", {result.unmet}." if result.unmet else " and met all expectations." if _is_met(result) else "."
    column = next(iter(result.columns), None)
    values = [value for _, value in _known(result, column.key)] if column is not None else []
    diverged = count - failed - len(values) if column is not None else 0
    text += _spreads(result)
    if diverged and column is not None:
        text += f" In {diverged} {column.heading} is no finite number."
    text += f" {counted(len(result.warnings))}." if result.warnings else ""
    doubtful = failed or diverged or result.unmet or result.warnings
    mood: Mood = "bad" if failed == count else "doubt" if doubtful else ""
    return PageVerdict(text, "good" if not mood and _is_met(result) else mood)


def _is_met(result: SweepRuns) -> bool:
    """Whether the scenario has expectations, and all runs meet them."""
    return all(run.measures.get(UNMET) == 0.0 for run in result.runs)


def _spreads(result: SweepRuns) -> str:
    """Between what the first measure lies over the runs, of each component that has it: the least extreme first."""
    first = _measure(result)
    found = []
    for column in result.columns:
        values = [value for _, value in _known(result, column.key)]
        if first is not None and values and _kind(column) == _kind(first):
            low, middle, high = (float(v) for v in np.percentile(values, (0, 50, 100)))
            found.append((max(abs(low), abs(high)), column, low, middle, high))
    if first is None or not found:
        return ""
    unit = f" {first.unit}" if first.unit else ""
    if len(found) == 1:
        _, column, *numbers = found[0]
        least, median, most = map(column.cell, numbers)
        return f" {column.heading}: {median}{unit} in the median, {least} to {most}{unit}."
    found.sort(key=lambda entry: entry[0])
    listed = [f"{c.key.rpartition('.')[0]} {c.cell(low)} to {c.cell(high)}{unit}" for _, c, low, _, high in found]
    more = [f"{len(listed) - _SPREADS} more"] if len(listed) > _SPREADS else []
    return f" {_kind(first)}: {', '.join([*listed[:_SPREADS], *more])}."


def _kind(column: Column) -> str:
    """What a column measures, of whatever component."""
    return column.key.rpartition(".")[2]


def _finding(result: SweepRuns) -> str:
    """The run with the largest value of a measure that differs, its settings, and which setting goes with it; or what
    failed first.
    """
    column = _measure(result)
    known = _known(result, column.key) if column is not None else []
    if column is None or not known:
        return next(iter(result.troubles()), "")
    if len(known) > 1 and not result.varies(column.key):
        return "No measure differs between the runs: what is varied changes none of them."
    run, value = known[0]
    settings = ", ".join(f"{name} = {setting_text(run.settings.get(name))}" for name in result.names)
    unit = f" {column.unit}" if column.unit else ""
    text = f"{column.heading} is largest in run {run.number}, {column.cell(value)}{unit}: {settings}."
    strongest = max(_correlations(result, column.key), key=lambda entry: abs(entry[1]), default=("", 0.0))
    if abs(strongest[1]) < _STRONG:
        return text
    way = "rises" if strongest[1] > 0.0 else "falls"
    return f"{text} It {way} with {strongest[0]} (rank correlation {number(strongest[1], 2)})."


def _correlations(result: SweepRuns, measure: str) -> list[tuple[str, float]]:
    """Rank correlations of a measure with every number that was varied."""
    runs = [run for run, _ in _known(result, measure)]
    found = []
    for name in result.names if len(runs) >= _FEWEST else ():
        settings, values = [run.settings.get(name) for run in runs], [run.measures[measure] for run in runs]
        if all(map(is_number, settings)) and len(set(settings)) > 2 and len(set(values)) > 2:
            found.append((name, rank_correlation(settings, values).value))
    return found


def _recordings(result: SweepRuns) -> list[PageRecording]:
    """The measures over the first number that was varied, a line for each combination of the others; none where these
    are too many.
    """
    numbers = [n for n in result.names if all(is_number(run.settings.get(n)) for run in result.runs)]
    varied = [n for n in numbers if len({run.settings[n] for run in result.runs}) > 2]
    if not varied or varied[0].rpartition(".")[2] == "seed":  # between seeds there is nothing
        return []
    against = varied[0]
    groups: dict[str, list[SweepRun]] = {}
    for run in result.runs:
        others = [f"{n} = {setting_text(run.settings.get(n))}" for n in result.names if n != against]
        groups.setdefault(", ".join(others) or "all runs", []).append(run)
    if len(groups) > _MOST_CURVES:
        return []
    return [_line(result, against, label, runs) for label, runs in groups.items()]


def _line(result: SweepRuns, against: str, label: str, runs: Sequence[SweepRun]) -> PageRecording:
    ordered = sorted(runs, key=lambda run: float(run.settings[against]))
    curves = []
    for column in result.varying_first:
        values = np.array([run.measures.get(column.key, np.nan) for run in ordered])
        curves.append(PageCurve(column.heading, column.factor * values, column.unit or "1"))
    x = np.array([float(run.settings[against]) for run in ordered])
    return PageRecording(label, x, curves, against, setting_unit(result.scenario, against) or "1")
