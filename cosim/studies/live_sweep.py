"""The page of a sweep or campaign: its runs as a table to sort and filter, distributions, parallel coordinates, and a
measure over what was varied. Touches no file.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import scipy

from cosim.report.live.live_page import LivePage, PageCurve, PagePanel, PageRecording, PageVerdict, Rows, Section
from cosim.results.results_folder import REPORT
from cosim.studies.measures import setting_text
from cosim.studies.setting_units import setting_unit
from fmus.tables.numbers import number
from fmus.tables.table import Column, Table

if TYPE_CHECKING:
    from cosim.studies.sweep_runs import SweepRun, SweepRuns

_MOST_LINES = 8
"""Combinations of the other values that are drawn as lines."""
_SHOWN = 2  # measures that are drawn at first
_FEWEST = 5  # runs from which a rank correlation says something
_STRONG = 0.6  # rank correlation that is named


def sweep_page(result: SweepRuns, directory: Path) -> LivePage:
    """What the page of a sweep shows.

    Args:
        result: the runs. directory: where the page will stand, which its links are relative to.
    """
    recordings, table = _recordings(result), _table(result)
    names = list(dict.fromkeys(curve.name for recording in recordings for curve in recording.curves))
    about = f"What was varied: {', '.join(result.names)}. Click a run to see its page; drag on an axis to choose runs."
    more = "" if any(_link(run, directory) for run in result.runs) else " Of a single run: cosim open, and its folder."
    return LivePage(
        title=f"{result.scenario.name}: {len(result)} runs",
        verdict=_verdict(result),
        finding=_finding(result),
        lead=about + more,
        recordings=recordings,
        panels=[PagePanel(name, [name], is_shown=place < _SHOWN) for place, name in enumerate(names)],
        sections=[
            Section("Runs", [Rows(table, [_link(run, directory) for run in result.runs])], is_open=True),
            Section("What failed", [result.troubles()], mood="bad"),
        ],
    )


def _link(run: SweepRun, directory: Path) -> str | None:
    """Its page as seen from that of the sweep, None where it has none."""
    if run.folder is None or run.folder.parent != directory or not (run.folder / REPORT).exists():
        return None
    return f"{run.folder.name}/{REPORT}"


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _table(result: SweepRuns) -> Table:
    """A row for each run: what was varied, what became of it, the chosen measures; numbers as such, which are sorted
    and drawn.
    """
    shown = result.shown()
    numbers = {name for name in result.names if all(_is_number(run.settings.get(name)) for run in result.runs)}
    columns = [
        Column(c.key, c.heading, setting_unit(result, c.key) or "", digits=6) if c.key in numbers else c
        for c in shown.columns
    ]
    return replace(shown, columns=columns)


def _known(result: SweepRuns, measure: str) -> list[tuple[SweepRun, float]]:
    """Runs with a finite value of a measure, the largest size first."""
    found = [(run, run.measures[measure]) for run in result.runs if np.isfinite(run.measures.get(measure, np.nan))]
    return sorted(found, key=lambda entry: -abs(entry[1]))


def _measure(result: SweepRuns) -> Column | None:
    """The measure that the page speaks of first."""
    return next(iter(result.columns), None)


def _verdict(result: SweepRuns) -> PageVerdict:
    count, failed = len(result), len(result.failed)
    text = f"{count - failed} of {count} runs came to their end{f', {result.unmet}' if result.unmet else ''}."
    column = _measure(result)
    values = [value for _, value in _known(result, column.key)] if column is not None else []
    diverged = count - failed - len(values) if column is not None else 0
    if column is not None and values:
        unit = f" {column.unit}" if column.unit else ""
        low, middle, high = (column.cell(float(v)) for v in np.percentile(values, (0, 50, 100)))
        text += f" {column.heading}: {middle}{unit} in the median, {low} to {high}{unit}."
    if diverged:
        text += f" In {diverged} it is no finite number."
    return PageVerdict(text, "bad" if failed == count else "doubt" if failed or diverged or result.unmet else "good")


def _finding(result: SweepRuns) -> str:
    """The run with the largest first measure, its settings, and which setting goes with it; or what failed first."""
    column = _measure(result)
    known = _known(result, column.key) if column is not None else []
    if column is None or not known:
        return next(iter(result.troubles()), "")
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
        if all(map(_is_number, settings)) and len(set(settings)) > 2 and len(set(values)) > 2:
            found.append((name, float(scipy.stats.spearmanr(settings, values).statistic)))
    return found


def _recordings(result: SweepRuns) -> list[PageRecording]:
    """The measures over the first number that was varied, a line for each combination of the others; none where these
    are too many.
    """
    numbers = [n for n in result.names if all(_is_number(run.settings.get(n)) for run in result.runs)]
    varied = [n for n in numbers if len({run.settings[n] for run in result.runs}) > 2]
    if not varied or varied[0].rpartition(".")[2] == "seed":  # between seeds there is nothing
        return []
    against = varied[0]
    groups: dict[str, list[SweepRun]] = {}
    for run in result.runs:
        others = [f"{n} = {setting_text(run.settings.get(n))}" for n in result.names if n != against]
        groups.setdefault(", ".join(others) or "all runs", []).append(run)
    if len(groups) > _MOST_LINES:
        return []
    return [_line(result, against, label, runs) for label, runs in groups.items()]


def _line(result: SweepRuns, against: str, label: str, runs: Sequence[SweepRun]) -> PageRecording:
    ordered = sorted(runs, key=lambda run: float(run.settings[against]))
    curves = []
    for column in result.columns:
        values = np.array([run.measures.get(column.key, np.nan) for run in ordered])
        curves.append(PageCurve(column.heading, column.factor * values, column.unit or "1"))
    x = np.array([float(run.settings[against]) for run in ordered])
    return PageRecording(label, x, curves, against, setting_unit(result, against) or "1")
