"""Which columns of a recording a calibration uses, as what. Knows tables and names only."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cosim.components.recording_data import Chosen, Interpolation, column_courses, interval_ends, said_of
from cosim.errors import CosimError, nearest
from cosim.results.result import Result
from fmus.fmi.units import NamedUnit, named_unit

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
        units: of the measured signals and of the inputs, by name; ``1``, or no entry, where it is not known.
        ends: what inputs say at begin and end of each interval, by name, each of shape (2, n - 1); without an entry the
            value at the begin is held.
        places: where signals and inputs come from, by name, for messages.
    """

    time: Array
    measured: Mapping[str, Array]
    inputs: Mapping[str, Array] = field(default_factory=dict)
    units: Mapping[str, str] = field(default_factory=dict)
    ends: Mapping[str, Array] = field(default_factory=dict)
    places: Mapping[str, str] = field(default_factory=dict)

    def part(self, samples: NDArray[np.intp]) -> RecordedSignals:
        """Some of the samples.

        Args:
            samples: their numbers, increasing.
        """
        measured, inputs = ({n: v[samples] for n, v in kind.items()} for kind in (self.measured, self.inputs))
        ends = {name: values[:, samples[:-1]] for name, values in self.ends.items()}
        return replace(self, time=self.time[samples], measured=measured, inputs=inputs, ends=ends)


@dataclass(frozen=True)
class Selection:
    """What of a recording is used.

    Attributes:
        signals: those to fit, ``name`` or ``name=column``; None for all outputs that were recorded.
        inputs: by name of an input the column that drives it, or a constant; others are driven by a column of their
            own name.
        begin, end: part to use [s].
        between: whether inputs are held or run on lines between samples, said of all or of some by name. Of the others
            a run of this package says it; of a table inputs that are no continuous ones are held.
    """

    signals: Sequence[str] | None = None
    inputs: Mapping[str, str | float] = field(default_factory=dict)
    begin: float = -np.inf
    end: float = np.inf
    between: Chosen = None


def sort_columns(
    recording: Result,
    source: str,
    outputs: Mapping[str, NamedUnit | None],
    inputs: Sequence[str],
    selection: Selection = Selection(),
    discrete: Collection[str] = (),
) -> RecordedSignals:
    """Find what drives the model and what it is held against.

    A column fits a signal of its own name, with or without the component before the point; the only output also the
    only column that its unit fits. Numbers and units are those of the recording.

    Args:
        recording: the table. source: its name, for messages.
        outputs: units by the names of the signals that the model has. inputs: that it takes.
        selection: what is used. discrete: inputs that are no continuous ones.

    Raises:
        CalibrationError: a signal was not recorded, or nothing is in the part.
    """
    units = {signal.name: signal.unit for signal in recording.signals}
    chosen = _fitted(units, source, outputs, selection.signals)
    rows = _rows_of(recording.time, selection.begin, selection.end, source)
    driving, constants = _driving(list(units), source, inputs, selection.inputs)
    used = driving | chosen
    ends = _interval_ends(recording, driving, rows, said_of(selection.between, list(driving), source), discrete)
    return RecordedSignals(
        recording.time[rows.first],
        _sampled(recording, chosen, rows),
        _sampled(recording, driving, rows) | {name: np.full(len(rows.first), v) for name, v in constants.items()},
        {name: units[column] for name, column in used.items()},
        ends,
        {name: f"{source}, column {column!r}" for name, column in used.items()},
    )


def _sampled(recording: Result, columns: Mapping[str, str], rows: _Rows) -> dict[str, Array]:
    """Values of columns at the instants, by the names of the model."""
    return {name: np.asarray(recording[column], dtype=float)[rows.first] for name, column in columns.items()}


def _driving(
    columns: Sequence[str], source: str, inputs: Sequence[str], stated: Mapping[str, str | float]
) -> tuple[dict[str, str], dict[str, float]]:
    """Columns and constants that drive inputs, by name."""
    driving = {name: column for name in inputs if (column := _column(name, columns)) is not None}
    constants = dict[str, float]()
    for name, what in stated.items():
        if name not in inputs:
            raise CalibrationError(f"The model has no input {name!r}; {nearest(name, inputs)}")
        if isinstance(what, str):
            driving[name] = _demanded(what, columns, source)
        else:
            driving.pop(name, None)
            constants[name] = what
    return driving, constants


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
        span = f", from {time[0]:g} to {time[-1]:g} s" if len(time) else ""
        raise CalibrationError(
            f"{source}: fewer than two samples in the part to use; there are {len(time)} in all{span}."
        )
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
    units: Mapping[str, str], source: str, outputs: Mapping[str, NamedUnit | None], signals: Sequence[str] | None
) -> dict[str, str]:
    """The column of each signal to fit."""
    if signals is not None:
        return dict(_asked(text, list(units), source, outputs) for text in signals)
    chosen = {name: column for name in outputs if (column := _column(name, list(units))) is not None}
    if not chosen and len(outputs) == 1:
        (name, unit), *_ = outputs.items()
        alike = [column for column, its in units.items() if unit is not None and named_unit(its).fits(unit)]
        alike = alike or list(units)
        chosen = {name: alike[0]} if len(alike) == 1 else {}
    if not chosen:
        raise CalibrationError(
            f"{source}: none of the model's outputs was recorded ({', '.join(outputs) or 'it has none'}). The "
            f"recording holds: {', '.join(units) or 'nothing'}. Say which belong together: --signals NAME=COLUMN."
        )
    return chosen


def _asked(text: str, columns: Sequence[str], source: str, outputs: Collection[str]) -> tuple[str, str]:
    """The signal and the column of ``name`` or ``name=column``."""
    name, _, column = text.partition("=")
    if name not in outputs:
        raise CalibrationError(f"The model has no output {name!r}; {nearest(name, outputs)}")
    return name, _demanded(column or name, columns, source)


def _demanded(name: str, columns: Sequence[str], source: str) -> str:
    """The column of a name.

    Raises:
        CalibrationError: there is none, or more than one.
    """
    column = _column(name, columns)
    if column is None:
        raise CalibrationError(f"{source}: signal {name!r} was not recorded; {nearest(name, columns)}")
    return column


def _column(name: str, columns: Sequence[str]) -> str | None:
    """The column of a name, whole or behind the component; None where there is none or more than one."""
    if name in columns:
        return name
    fitting = [column for column in columns if column.partition(".")[2] == name or column == name.partition(".")[2]]
    return fitting[0] if len(fitting) == 1 else None
