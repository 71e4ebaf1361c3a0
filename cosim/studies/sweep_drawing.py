"""Picture of a sweep: a measure over a varied value. Draws on axes given, or on its own."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from math import isfinite, nan
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator

from cosim.drawing.style import OBSERVER_LINES, axes_or_new, picture, styled
from cosim.errors import OutputError, nearest
from cosim.studies.measures import is_number, setting_text, with_unit
from cosim.studies.setting_units import setting_unit

if TYPE_CHECKING:
    from cosim.studies.sweep_runs import SweepRun, SweepRuns

_LINES_NAMED = 8
"""More lines than these are drawn, but not named in a legend."""


@styled
def sweep_figure(result: SweepRuns, measure: str | None, against: str | None, ax: Axes | None) -> Axes:
    """A measure over a varied value, units on the axes; arguments as for `SweepResult.plot`.

    Args:
        result: the runs.
        measure: its name; None for the first.
        against: what was varied; None for the first that takes several values.
        ax: axes to draw on; None for a figure of its own.

    Raises:
        OutputError: there is no such measure, or this was not varied.
    """
    measure = _chosen("measure", measure, result.measures)
    varied = [name for name in result.names if len({repr(run.settings.get(name)) for run in result.runs}) > 1]
    against = _chosen("varied value", against, result.names if against is not None else varied or result.names)
    ax = axes_or_new(ax, (7.0, 3.6))
    ticks = _categories(run.settings.get(against) for run in result.runs)
    others = [name for name in varied if name != against]
    groups = _groups(result.runs, others)
    for place, (label, runs) in enumerate(groups.items()):
        x, y = _points(runs, against, measure, ticks)
        style = OBSERVER_LINES[place % len(OBSERVER_LINES)]
        # neighbours differ in more than this value, or are seeds, between which there is nothing
        lone = (others and len(groups) == 1) or against.rpartition(".")[2] == "seed"
        style = style | {"linestyle": ""} if lone else style
        ax.plot(x, y, marker="o", markersize=4, label=label or None, **style)
    _set_ticks(ax, ticks, [run.settings.get(against) for run in result.runs])
    ax.set_xlabel(with_unit(against, setting_unit(result.scenario, against)))
    ax.set_ylabel(with_unit(measure, result.unit(measure)))
    if result.failed:
        ax.set_title(f"{len(result.failed)} of {len(result.runs)} runs failed", fontsize="medium", loc="left")
    if 1 < len(groups) <= _LINES_NAMED:
        ax.legend()
    return ax


def _set_ticks(ax: Axes, texts: Sequence[str] | None, values: Sequence[Any]) -> None:
    if texts is not None:
        ax.set_xticks(range(len(texts)), texts)
    elif all(isinstance(value, int) for value in values):
        ax.xaxis.set_major_locator(MaxNLocator(integer=True))  # there is no seed 0.25


def draw_measures(result: SweepRuns, kind: str) -> dict[str, bytes]:
    """Figures of all measures that tables show and some run has, over the first value that varies, by measure.

    Args:
        result: the runs. kind: of file, ``png`` or ``svg``.
    """
    known = [column.key for column in result.columns if any(isfinite(m) for m in _values(result, column.key))]
    return {measure: picture(sweep_figure(result, measure, None, None).figure, kind) for measure in known}


def _values(result: SweepRuns, measure: str) -> list[float]:
    return [run.measures.get(measure, nan) for run in result.runs]


def _chosen(what: str, name: str | None, known: Sequence[str]) -> str:
    if not known:
        raise OutputError(f"There is nothing to draw: this sweep has no {what}.")
    if name is not None and name not in known:
        raise OutputError(f"This sweep has no {what} {name!r}; {nearest(name, known)}")
    return name or known[0]


def _categories(values: Iterable[Any]) -> list[str] | None:
    """The values as texts in order of appearance where they are no numbers; None where they are."""
    listed = list(values)
    return None if all(map(is_number, listed)) else list(dict.fromkeys(map(str, listed)))


def _groups(runs: Sequence[SweepRun], others: Sequence[str]) -> dict[str, list[SweepRun]]:
    """Runs by what else was varied; all in one where that would be a line for each run."""
    groups: dict[str, list[SweepRun]] = {}
    for run in runs:
        groups.setdefault(", ".join(f"{name} = {setting_text(run.settings.get(name))}" for name in others), []).append(
            run
        )
    return {"": list(runs)} if len(groups) == len(runs) else groups


def _points(
    runs: Sequence[SweepRun], against: str, measure: str, ticks: Sequence[str] | None
) -> tuple[np.ndarray, np.ndarray]:
    """Places on the axes, in order of the varied value."""
    values = [run.settings.get(against) for run in runs]
    x = np.array([float(v) for v in values] if ticks is None else [float(ticks.index(str(v))) for v in values])  # type: ignore[arg-type]
    y = np.array([run.measures.get(measure, nan) for run in runs])
    order = np.argsort(x, kind="stable")
    return x[order], y[order]
