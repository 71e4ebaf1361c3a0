"""Columns of a file of another tool as a result: the column of time found and checked, values in SI. Touches no
file.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType

import numpy as np

from cosim.errors import OutputError
from cosim.results.result_data import ResultData, SignalInfo
from cosim.results.si import in_si
from cosim.results.table_layout import table_of
from plant_models.hybrid.units import UnitError, conversion, parse_unit

CHUNK = 1 << 20  # rows looked at at a time
SHOWN = 8  # names in a message
TEXTS = "texts"
"""Key of the summary: what the numbers of columns of texts stand for."""


def result_of_columns(
    source: str,
    names: Sequence[str],
    columns: Sequence[np.ndarray],
    units: Mapping[str, str | None],
    described: Callable[[str], SignalInfo] = SignalInfo,
    texts: Mapping[str, Sequence[str]] = MappingProxyType({}),
) -> ResultData:
    """A result of columns as a file names them.

    Args:
        source: what to call the file in messages.
        names: of the columns. One is ``time``, in capitals or not, or ``t``; a first one without a name (the row
            numbers of a data frame) is left out; equal columns of the same name count once.
        columns: arrays of shape (rows,).
        units: of the columns, None where the file says nothing. What can be is converted to SI.
        described: what else is known of a signal. texts: of columns of texts, what their numbers stand for, 1 for the
            first; kept in the summary.

    Raises:
        OutputError: there is no column of time, it goes backwards or holds NaN, or two columns share a name.
    """
    kept = _kept(source, names, columns)
    time = _time_name(source, kept)
    order = [time, *(name for name in kept if name != time)]
    table = table_of(["time", *order[1:]], [kept[name] for name in order])
    table["time"] *= _seconds(source, units.get(time) or "s")
    check_time(source, table["time"])
    signals = [_signal(described(name), units.get(name), name in texts) for name in order[1:]]
    table, described_in_si = in_si(table, signals, lambda name: parse_unit(units.get(name) or "1"))
    signals = [replace(signal, declared_unit=None) for signal in described_in_si]  # no FMU declared another one
    return ResultData(
        table, signals, summary={TEXTS: {name: list(items) for name, items in texts.items()}} if texts else {}
    )


def numbered(texts: Sequence[str | None]) -> tuple[np.ndarray, tuple[str, ...]]:
    """A column of texts as numbers, 1 for the first that stands in it, shape (rows,), NaN where there is none; and the
    texts.

    Args:
        texts: of the rows.
    """
    items = {text: number for number, text in enumerate(dict.fromkeys(t for t in texts if t is not None), start=1)}
    return np.array([np.nan if text is None else items[text] for text in texts], np.float64), tuple(items)


def check_time(source: str, time: np.ndarray) -> None:
    """Time must not go backwards; equal times, before and after an event, are allowed.

    Args:
        source: what to call the file in messages. time: of the rows [s], shape (rows,).

    Raises:
        OutputError: it does, or it is no finite number; the message names the row.
    """
    for start in range(0, len(time), CHUNK):
        part = np.asarray(time[max(start - 1, 0) : start + CHUNK], np.float64)
        bad = np.flatnonzero(~np.isfinite(part))
        if len(bad):
            row = max(start - 1, 0) + int(bad[0]) + 1
            raise OutputError(f"{source}: the time in row {row} is not a finite number, but {part[bad[0]]}.")
        back = np.flatnonzero(part[1:] < part[:-1])
        if len(back):
            at = int(back[0])
            row = max(start - 1, 0) + at + 2
            raise OutputError(
                f"{source}: time goes backwards in row {row}, from {part[at]:g} to {part[at + 1]:g} s. "
                "Rows must be in order of time; two rows with the same time are an event, before and after."
            )


def _kept(source: str, names: Sequence[str], columns: Sequence[np.ndarray]) -> dict[str, np.ndarray]:
    kept: dict[str, np.ndarray] = {}
    for place, (name, column) in enumerate(zip(names, columns, strict=True)):
        if name == "":
            if place == 0 and len(names) > 1:
                continue
            raise OutputError(f"{source}: column {place + 1} has no name. Give it one, or leave it out.")
        if name in kept and not np.array_equal(kept[name], column, equal_nan=True):
            raise OutputError(f"{source}: two different columns are called {name!r}. Rename one of them.")
        kept.setdefault(name, column)
    return kept


def _time_name(source: str, names: Mapping[str, object]) -> str:
    for wanted in ("time", "t"):
        found = [name for name in names if name.lower() == wanted]
        if found:
            return found[0] if wanted not in names else wanted
    shown = ", ".join(list(names)[:SHOWN]) + (", ..." if len(names) > SHOWN else "")
    raise OutputError(
        f"{source}: there is no column 'time'; columns: {shown or 'none'}. Call the column of time 'time'."
    )


def _seconds(source: str, unit: str) -> float:
    try:
        return conversion(parse_unit(unit), parse_unit("s"))[0]
    except UnitError as error:
        raise OutputError(f"{source}: the unit of time {unit!r} is none ({error}). Write 's'.") from error


def _signal(info: SignalInfo, unit: str | None, is_text: bool) -> SignalInfo:
    if is_text:
        return replace(info, unit="1", variability="discrete")
    if unit is None or unit == info.unit:
        return info
    return replace(info, unit=unit)
