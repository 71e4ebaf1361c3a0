"""Which columns of a recording a calibration uses, as what. Knows tables and names only."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cosim.components.recording_data import Chosen, Interpolation, column_courses, interval_ends, said_of
from cosim.errors import CosimError, nearest
from cosim.results.result import Result

Array = NDArray[np.float64]


class CalibrationError(CosimError, ValueError):
    """A calibration that cannot be done; the message says why and what to do."""


@dataclass(frozen=True, eq=False)
class RecordedSignals:
    """A recording, sorted for a calibration.

    Attributes:
        time: instants [s], shape (n,), increasing.
        measured: what is fitted, by the name of the model's signal, each of shape (n,).
        inputs: what drives the model, by the name of its input, each of shape (n,).
        units: of the measured signals, by name.
        ends: what inputs say at begin and end of each interval, by name, each of shape (2, n - 1); without an entry the
            value at the begin is held.
    """

    time: Array
    measured: Mapping[str, Array]
    inputs: Mapping[str, Array]
    units: Mapping[str, str]
    ends: Mapping[str, Array] = field(default_factory=dict)


def sort_columns(
    recording: Result,
    source: str,
    outputs: Sequence[str],
    inputs: Sequence[str],
    signals: Sequence[str] | None,
    begin: float = -np.inf,
    end: float = np.inf,
    between: Chosen = None,
    discrete: Collection[str] = (),
) -> RecordedSignals:
    """Find what drives the model and what it is held against.

    A column fits a signal of its own name, with or without the component before the point. A signal may be given as
    ``name=column`` where the names differ.

    Args:
        recording: the table. source: its name, for messages.
        outputs: signals that the model has. inputs: inputs that it takes.
        signals: those to fit; None for all outputs that were recorded. begin, end: part of the recording to use [s].
        between: whether inputs are held or run on lines between samples, said of all or of some by name. Of the others
            a run of this package says it, else `discrete` does: inputs that are no continuous ones.

    Returns:
        The columns.

    Raises:
        CalibrationError: a signal was not recorded, or nothing is in the part.
    """
    columns = [signal.name for signal in recording.signals]
    units = {signal.name: signal.unit for signal in recording.signals}
    chosen = _fitted(columns, source, outputs, signals)
    rows = _rows_of(recording.time, begin, end, source)
    driving = {name: column for name in inputs if (column := _column(name, columns)) is not None}
    ends = _interval_ends(recording, driving, rows, said_of(between, list(driving), source), discrete)

    def sampled(names: Mapping[str, str]) -> dict[str, Array]:
        return {name: np.asarray(recording[column], dtype=float)[rows.first] for name, column in names.items()}

    return RecordedSignals(
        recording.time[rows.first],
        sampled(chosen),
        sampled(driving),
        {name: units[column] for name, column in chosen.items()},
        ends,
    )


class _Rows(NamedTuple):
    """Rows of each instant: an event has two of the same time.

    Args:
        first, last: numbers of rows, shape (n,).
    """

    first: NDArray[np.intp]
    last: NDArray[np.intp]


def _rows_of(times: Array, begin: float, end: float, source: str) -> _Rows:
    """Rows of the instants in the part to use [s]."""
    time, rows = np.unique(times, return_index=True)
    part = (time >= begin) & (time <= end)
    if np.count_nonzero(part) < 2:
        raise CalibrationError(f"{source}: fewer than two samples in the part to use; there are {len(time)} in all.")
    last = np.append(rows[1:], len(times)) - 1
    return _Rows(rows[part], last[part])


def _interval_ends(
    recording: Result,
    driving: Mapping[str, str],
    rows: _Rows,
    said: Mapping[str, Interpolation],
    discrete: Collection[str],
) -> dict[str, Array]:
    """What inputs say at begin and end of each interval, by name, each of shape (2, n - 1)."""
    courses = column_courses(
        recording,
        driving.values(),
        {driving[name]: kind for name, kind in said.items()},
        [column for name, column in driving.items() if name in discrete],
    )
    return {
        name: interval_ends(np.asarray(recording[column], dtype=float), rows.first, rows.last, course)
        for (name, column), course in zip(driving.items(), courses, strict=True)
    }


def _fitted(
    columns: Sequence[str], source: str, outputs: Sequence[str], signals: Sequence[str] | None
) -> dict[str, str]:
    """The column of each signal to fit."""
    chosen: dict[str, str] = {}
    if signals is None:
        chosen = {name: column for name in outputs if (column := _column(name, columns)) is not None}
        if not chosen:
            raise CalibrationError(
                f"{source}: none of the model's outputs was recorded ({', '.join(outputs) or 'it has none'}). The "
                f"recording holds: {', '.join(columns)}. Say which belong together: --signals NAME=COLUMN."
            )
    for given in signals or ():
        name, sign, asked = given.partition("=")
        if name not in outputs:
            raise CalibrationError(f"The model has no output {name!r}; {nearest(name, outputs)}")
        column = _column(asked if sign else name, columns)
        if column is None:
            raise CalibrationError(
                f"{source}: signal {asked or name!r} was not recorded; {nearest(asked or name, columns)}"
            )
        chosen[name] = column
    return chosen


def _column(name: str, columns: Sequence[str]) -> str | None:
    """The column of a name, whole or behind the component; None where there is none or more than one."""
    if name in columns:
        return name
    fitting = [column for column in columns if column.partition(".")[2] == name or column == name.partition(".")[2]]
    return fitting[0] if len(fitting) == 1 else None
