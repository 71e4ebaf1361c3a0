"""What of a result a baseline keeps: which signals, and which rows. Arrays in, arrays out."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from fnmatch import fnmatchcase

import numpy as np

from cosim.errors import BaselineError, nearest
from cosim.results.result import Result
from cosim.results.table_layout import table_dtype

ROWS = 2000
"""Rows that a baseline keeps where the user gives no spacing, about; those of events come on top."""


def resolve(pattern: str, names: Sequence[str]) -> str:
    """A name or pattern as it fits the signals `names`: with the component in front where it stands without.

    ``speed`` means ``train.speed`` in a run of the component ``train`` alone.

    Args:
        pattern: name, or pattern such as ``train.*``.
    """
    if any(pattern == name or fnmatchcase(name, pattern) for name in names):
        return pattern
    components = {name.partition(".")[0] for name in names}
    if len(components) == 1:
        whole = f"{next(iter(components))}.{pattern}"
        if any(whole == name or fnmatchcase(name, whole) for name in names):
            return whole
    return pattern


def select_signals(result: Result, patterns: Iterable[str] | None) -> Result:
    """The result with the chosen signals only, in alphabetical order, whatever the order of the components in the run.

    Args:
        result: of a run. patterns: names or patterns (``train.*``); None for all signals.

    Raises:
        BaselineError: a pattern fits no signal.
    """
    names = [info.name for info in result.signals]
    chosen = names if patterns is None else _chosen([resolve(p, names) for p in patterns], names)
    chosen = sorted(chosen)
    table = np.empty(len(result.table), table_dtype(["time", *chosen]))
    for name in ("time", *chosen):
        table[name] = result.table[name]
    by_name = {info.name: info for info in result.signals}
    return replace(result, table=table, signals=[by_name[name] for name in chosen])


def _chosen(patterns: Sequence[str], names: Sequence[str]) -> list[str]:
    kept: list[str] = []
    for pattern in patterns:
        fitting = [name for name in names if name == pattern or fnmatchcase(name, pattern)]
        if not fitting:
            raise BaselineError(f"No signal fits {pattern!r}; {nearest(pattern, names)}")
        kept += [name for name in fitting if name not in kept]
    return kept


def kept_rows(result: Result, every: float | None) -> np.ndarray:
    """Which rows to keep: first and last, those of events, those where a held signal changes, and others at a spacing.

    Args:
        result: of a run.
        every: least spacing of the other rows [s], zero for all rows; None for about `ROWS` rows.

    Returns:
        Indices of the rows, ascending, shape (kept,).

    Raises:
        BaselineError: a negative spacing.
    """
    time = result.time
    if every is not None and not every >= 0.0:
        raise BaselineError(f"every = {every!r} s: expected a spacing that is zero or positive.")
    if every is None and len(time) <= ROWS:
        every = 0.0
    keep = np.ones(len(time), bool) if every == 0.0 or len(time) < 3 else _spaced(time, every)
    same = np.flatnonzero(np.diff(time) == 0.0)
    for rows in (same, same + 1, *_changes(result)):
        keep[rows] = True
    keep[[0, -1]] = True
    return np.flatnonzero(keep)


def _spaced(time: np.ndarray, every: float | None) -> np.ndarray:
    """The first row of each interval of `every` seconds; of as many intervals as `ROWS` where no spacing is given."""
    if every is None:
        rows = np.arange(len(time))
        return np.asarray(rows % -(-len(time) // ROWS) == 0)
    interval = np.floor((time - time[0]) / every + 1e-9)
    return np.asarray(np.diff(interval, prepend=-1.0) > 0.0)


def _changes(result: Result) -> Iterable[np.ndarray]:
    """Rows on both sides of the changes of signals that are held between them."""
    for info in result.signals:
        if info.variability == "discrete":
            values = result.table[info.name]
            changed = np.flatnonzero((values[1:] != values[:-1]) & ~(np.isnan(values[1:]) & np.isnan(values[:-1])))
            yield changed
            yield changed + 1
