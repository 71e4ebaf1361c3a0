"""Results as a MATLAB file, to the last bit. Touches only the file it is given.

In MATLAB: ``time`` and one column vector for each signal (``locomotive_position``), ``units.locomotive_position``, the
struct ``signals`` of cell arrays (variable, name, unit, ...) in column order, and the struct ``events`` of columns.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np
import scipy

from cosim.results.events_file import COLUMNS, NUMBERS, record_from_row, record_row
from cosim.results.formats.format import Format
from cosim.results.formats.matlab_names import matlab_names
from cosim.results.result_data import BaliseRecord, ResultData, SignalInfo
from cosim.results.table_layout import column_names, table_dtype

_RESERVED = ("time", "units", "signals", "events")


def _cells(texts: Sequence[str]) -> np.ndarray:
    cells = np.empty((len(texts), 1), dtype=object)
    cells[:, 0] = texts
    return cells


def _texts(value: Any, count: int) -> list[str]:
    """So many text cells as `loadmat` gives them: one string for one cell, an empty array for an empty string."""
    if isinstance(value, str):
        return [value]
    return ["" if not isinstance(text, str) else text for text in value] if len(value) else [""] * count


def _signals_struct(signals: Sequence[SignalInfo], legal: Mapping[str, str]) -> dict[str, np.ndarray]:
    columns = {f.name: _cells([str(getattr(s, f.name) or "") for s in signals]) for f in fields(SignalInfo)}
    return {"variable": _cells([legal[s.name] for s in signals]), **columns}


def _events_struct(events: Sequence[BaliseRecord]) -> dict[str, np.ndarray]:
    rows = [record_row(event) for event in events]
    return {
        name: np.array([row[name] for row in rows], dtype=np.float64).reshape(-1, 1)
        if name in NUMBERS
        else _cells([str(row[name]) for row in rows])
        for name in COLUMNS
    }


def write_mat(path: str | Path, result: ResultData) -> None:
    """Write the table, the units and the events of a result as a MATLAB 5 file.

    Args:
        path: file to write.
        result: what to write; its summary is not part of the file.

    Raises:
        ValueError: the table is not a result table.
        OSError: the file cannot be written.
    """
    names = column_names(result.table)[1:]
    legal = matlab_names(names, _RESERVED)
    known = {signal.name: signal for signal in result.signals}
    signals = [known.get(name, SignalInfo(name)) for name in names]
    content: dict[str, Any] = {"time": result.table["time"]}
    content |= {legal[name]: result.table[name] for name in names}
    content["units"] = {legal[s.name]: s.unit for s in signals}
    content["signals"] = _signals_struct(signals, legal)
    content["events"] = _events_struct(result.events)
    with Path(path).open("wb") as file:
        scipy.io.savemat(file, content, long_field_names=True, do_compression=True, oned_as="column")


def _read_signals(struct: Mapping[str, Any]) -> tuple[list[str], list[SignalInfo]]:
    variables = _texts(struct["variable"], 0)
    known = [f.name for f in fields(SignalInfo) if f.name in struct]  # an older file has fewer
    columns = {name: _texts(struct[name], len(variables)) for name in known}
    rows = [dict(zip(columns, values, strict=True)) for values in zip(*columns.values(), strict=True)]
    signals = [
        SignalInfo(
            **{
                **row,
                "display_unit": row["display_unit"] or None,
                "can_be_missing": row.get("can_be_missing") == str(True),
            }
        )
        for row in rows
    ]
    return variables, signals


def _read_events(struct: Mapping[str, Any]) -> list[BaliseRecord]:
    count = np.size(struct["stamp"])
    columns = {n: np.ravel(struct[n]).tolist() if n in NUMBERS else _texts(struct[n], count) for n in COLUMNS}
    return [record_from_row(dict(zip(columns, values, strict=True))) for values in zip(*columns.values(), strict=True)]


def read_mat(path: str | Path) -> ResultData:
    """Read a file written by `write_mat`.

    Args:
        path: file to read.

    Returns:
        A result with table (bit by bit), signals and events; its summary is empty.

    Raises:
        ValueError: the file is not such a file.
        OSError: the file cannot be read.
    """
    with Path(path).open("rb") as file:
        try:
            content = scipy.io.loadmat(file, simplify_cells=True)
            variables, signals = _read_signals(content["signals"])
            columns = [content["time"], *(content[variable] for variable in variables)]
            events = _read_events(content["events"])
        except (KeyError, TypeError, ValueError, NotImplementedError) as error:
            raise ValueError(f"{path} is not a MATLAB result file: {error}") from error
    names = ["time", *(s.name for s in signals)]
    table = np.empty(np.size(columns[0]), table_dtype(names))
    for name, column in zip(names, columns, strict=True):
        table[name] = np.ravel(column)
    return ResultData(table, signals, events)


class MatFormat(Format):
    """MATLAB 5."""

    name = "mat"
    endings = (".mat",)

    @staticmethod
    def write(path: Path, result: ResultData) -> None:  # noqa: D102 - see Format
        write_mat(path, result)

    @staticmethod
    def read(path: Path) -> ResultData:  # noqa: D102 - see Format
        return read_mat(path)
