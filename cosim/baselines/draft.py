"""A baseline as text, before it is written: the header, and the tables as they stand in their files. Touches no
file.
"""

from __future__ import annotations

import csv
import hashlib
import io
import platform
import sys
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from fnmatch import fnmatchcase
from math import floor, inf, isfinite, log10
from typing import Any

import numpy as np

from cosim.baselines.baseline import Header
from cosim.baselines.header_data import VERSION
from cosim.baselines.model_identity import identities
from cosim.baselines.recipe import Recipe
from cosim.baselines.table_text import rows_text
from cosim.comparison.compare import curve_of
from cosim.comparison.event_comparison import TIMES, telegram_limits
from cosim.comparison.tolerance import Tolerance, Tolerances
from cosim.errors import BaselineError, nearest
from cosim.results.record_rows import TELEGRAM_ROWS
from cosim.results.result import Result
from cosim.results.table_layout import table_dtype

_EVENT_DIGITS = 12
"""Significant digits of the numbers of a telegram, where they need not be exact."""


_SHARE = 1e-3
"""The last digit kept, as a share of the difference allowed: rounding takes at most half of it from the tolerance."""
_MOST = 15
"""Digits behind the point beyond which rounding gains nothing: numbers are then written in full."""


_ROWS = 2000
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


def _select_signals(result: Result, patterns: Iterable[str] | None) -> Result:
    """The result with the chosen signals only, in alphabetical order."""
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


def _kept_rows(result: Result, every: float | None) -> np.ndarray:
    """Which rows to keep: first and last, those of events, those where a held signal changes, and others at a spacing.

    Args:
        result: of a run.
        every: least spacing of the other rows [s], zero for all rows; None for about `_ROWS` rows.

    Returns:
        Indices of the rows, ascending, shape (kept,).

    Raises:
        BaselineError: a negative spacing.
    """
    time = result.time
    if every is not None and not every >= 0.0:
        raise BaselineError(f"every = {every!r} s: expected a spacing that is zero or positive.")
    if every is None and len(time) <= _ROWS:
        every = 0.0
    keep = np.ones(len(time), bool) if every == 0.0 or len(time) < 3 else _spaced(time, every)
    equal = np.flatnonzero(np.diff(time) == 0.0)
    for rows in (equal, equal + 1, *_changes(result)):
        keep[rows] = True
    keep[[0, -1]] = True
    return np.flatnonzero(keep)


def _spaced(time: np.ndarray, every: float | None) -> np.ndarray:
    """The first row of each interval of `every` seconds; of as many intervals as `_ROWS` where no spacing is given."""
    if every is None:
        rows = np.arange(len(time))
        return np.asarray(rows % -(-len(time) // _ROWS) == 0)
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


def _decimals_for(allowed: float) -> int | None:
    """Digits behind the decimal point that a column keeps."""
    if not (allowed > 0.0 and isfinite(allowed)):
        return None
    digits = -floor(log10(allowed * _SHARE))
    return digits if digits <= _MOST else None


@dataclass(frozen=True)
class BaselineDraft:
    """A baseline before it is written.

    Args:
        header: all but numbers. table: the CSV of the rows. events: the CSV of the telegrams; empty where there are
            none.
    """

    header: Header
    table: str
    events: str


def make_draft(
    result: Result,
    tolerances: Tolerances | None = None,
    *,
    recipe: Recipe | None = None,
    signals: Iterable[str] | None = None,
    every: float | None = None,
) -> BaselineDraft:
    """A baseline of a result.

    Args:
        result: of a run that was found right.
        tolerances: how far later results may be from it; they also say how many digits are kept.
        recipe: what was run. signals: names or patterns of those to keep; None for all.
        every: least spacing of the rows [s]; None for at most about 2000 rows. Rows of events are kept always.

    Raises:
        BaselineError: the run failed or is empty, or a pattern fits no signal.
    """
    if result.failure is not None:
        raise BaselineError(f"No baseline is made of a run that failed: {result.failure}")
    if not len(result.table):
        raise BaselineError("No baseline is made of an empty run: it has no rows.")
    selection = None if signals is None else tuple(signals)
    chosen = _select_signals(result, selection)
    names = [info.name for info in chosen.signals]
    tolerances = resolved(tolerances or Tolerances(), names)
    table = _table_text(chosen, _kept_rows(chosen, every), tolerances)
    events = _events_text(result, tolerances.default) if result.events else ""
    header = Header(
        title=_title(result),
        recipe=recipe or Recipe(),
        span=_span(result),
        components=identities(result),
        signals=chosen.signals,
        tolerances=tolerances,
        selection=selection,
        every=every,
        rows=table.count("\n") - 1,
        events=len(result.events) if result.events or "components" in result.summary else None,
        digest=text_digest(table, events),
        versions=versions_of(result),
        version=VERSION,
    )
    return BaselineDraft(header, table, events)


def resolved(tolerances: Tolerances, names: Sequence[str]) -> Tolerances:
    """Tolerances with the component put in front of names that stand without, where there is one component only.

    Args:
        tolerances: what is allowed, signal by signal.
        names: of the signals.
    """
    by_signal = {resolve(pattern, names): stated for pattern, stated in tolerances.by_signal.items()}
    return replace(
        tolerances, by_signal=by_signal, ignore=tuple(resolve(pattern, names) for pattern in tolerances.ignore)
    )


def _title(result: Result) -> str:
    return str(result.summary.get("title") or result.summary.get("scenario") or "")


def _span(result: Result) -> dict[str, float]:
    time = result.time
    step = result.summary.get("step")
    steps = np.diff(time)
    smallest = float(np.min(steps[steps > 0.0], initial=np.inf)) if step is None else float(step)
    start, stop = (float(result.summary.get(key, value)) for key, value in (("start", time[0]), ("stop", time[-1])))
    return {"start": start, "stop": stop, "step": smallest if np.isfinite(smallest) else 0.0}


def versions_of(result: Result) -> dict[str, str]:
    """Versions as the run states them, without what differs between two machines of one kind.

    Args:
        result: the run.
    """
    versions: Mapping[str, Any] = result.summary.get("versions") or {}
    kept = {name: str(value) for name, value in versions.items() if name != "platform"}
    return kept | {"platform": f"{sys.platform} {platform.machine()}"}


def _table_text(result: Result, rows: np.ndarray, tolerances: Tolerances) -> str:
    length = float(result.time[-1] - result.time[0])
    entries = [tolerances.default, *tolerances.by_signal.values()]
    by_column, columns = [_decimals_for(min(entry.time_for(length) for entry in entries))], [result.time[rows]]
    for info in result.signals:
        by_column.append(_decimals_for(tolerances.value_for(info.name, curve_of(result, info.name))))
        columns.append(result.table[info.name][rows])
    heading = io.StringIO()
    csv.writer(heading, lineterminator="\n").writerow(["time", *(info.name for info in result.signals)])
    return heading.getvalue() + rows_text(columns, by_column)


def _events_text(result: Result, tolerance: Tolerance) -> str:
    """Telegrams as CSV, one a line."""
    allowed = telegram_limits(result.events, tolerance, float(result.time[-1] - result.time[0]))
    room = {**dict.fromkeys(TIMES, allowed.time), **allowed.payload}
    lines = io.StringIO()
    writer = csv.writer(lines, lineterminator="\n")
    writer.writerow(TELEGRAM_ROWS.columns)
    for record in result.events:
        writer.writerow([_event_cell(value, room.get(name, inf)) for name, value in TELEGRAM_ROWS.row(record).items()])
    return lines.getvalue()


def _event_cell(value: float | str, allowed: float) -> str:
    """A cell; a number is rounded where that takes next to nothing from the difference allowed."""
    if isinstance(value, str):
        return value
    short = float(f"{value:.{_EVENT_DIGITS}g}")
    return repr(value if abs(short - value) > _SHARE * allowed else short).removesuffix(".0")


def text_digest(table: str, events: str) -> str:
    """Digest of the tables, the same whatever line endings they were given on the way.

    Args:
        table: the rows as CSV.
        events: the telegrams as CSV.
    """
    return hashlib.sha256((table + "\0" + events).replace("\r\n", "\n").encode()).hexdigest()
