"""The tables of a baseline: text to rows and telegrams, with every fault named by file and line. Touches no file."""

from __future__ import annotations

import csv
import io
from pathlib import Path

import numpy as np

from cosim.baselines.baseline import Header
from cosim.errors import BaselineError
from cosim.results.record_rows import TELEGRAM_ROWS
from cosim.results.result import BaliseRecord
from cosim.results.table_layout import table_dtype

_AGAIN = "Restore it from version control, or make it again."


def parse_table(text: str, header: Header, file: Path) -> np.ndarray:
    """The rows of a baseline; columns are found by name.

    Args:
        text: of the CSV. header: of the baseline. file: its name for messages.

    Returns:
        Structured array, shape (rows,), ``time`` first, then the signals in the order of the header.

    Raises:
        BaselineError: it is cut off, a column is missing, or a cell is no number.
    """
    if not text.strip():
        raise BaselineError(f"{file} is empty; {header.rows} rows were written. {_AGAIN}")
    reader = csv.reader(io.StringIO(text))
    names = next(reader)
    wanted = ["time", *(info.name for info in header.signals)]
    missing = [name for name in wanted if name not in names]
    if missing:
        raise BaselineError(f"{file}: no column {missing[0]!r}, which the header names. {_AGAIN}")
    rows = [_numbers(row, len(names), file, reader.line_num) for row in reader if row]
    if len(rows) != header.rows or not text.endswith("\n"):
        raise BaselineError(
            f"{file} is cut off or was added to: {len(rows)} rows, {header.rows} were written. {_AGAIN}"
        )
    values = np.array(rows, dtype=np.float64).reshape(len(rows), len(names))
    table = np.empty(len(rows), table_dtype(wanted))
    for name in wanted:
        table[name] = values[:, names.index(name)]
    if np.any(np.diff(table["time"]) < 0.0):
        line = int(np.flatnonzero(np.diff(table["time"]) < 0.0)[0]) + 3
        raise BaselineError(f"{file}, line {line}: time runs backwards. {_AGAIN}")
    return table


def _numbers(row: list[str], count: int, file: Path, line: int) -> list[float]:
    if len(row) != count:
        raise BaselineError(
            f"{file}, line {line}: {len(row)} cells, expected {count}; the file is cut off or damaged. {_AGAIN}"
        )
    try:
        return [float(cell) for cell in row]
    except ValueError as error:
        raise BaselineError(f"{file}, line {line}: {error}; expected numbers with a decimal point. {_AGAIN}") from error


def parse_events(text: str, header: Header, file: Path) -> list[BaliseRecord]:
    """The telegrams of a baseline.

    Args:
        text: content of the file.
        header: what the baseline says of itself.
        file: its path, for messages.

    Raises:
        BaselineError: it is cut off, a column is missing, or a cell cannot be read.
    """
    if not text:
        return []
    reader = csv.DictReader(io.StringIO(text))
    missing = [name for name in TELEGRAM_ROWS.columns if name not in (reader.fieldnames or ())]
    if missing:
        raise BaselineError(f"{file}: no column {missing[0]!r}. {_AGAIN}")
    events = []
    for row in reader:
        try:
            events.append(TELEGRAM_ROWS.record(row))
        except (KeyError, TypeError, ValueError) as error:
            raise BaselineError(f"{file}, line {reader.line_num}: {error}. {_AGAIN}") from error
    if len(events) != header.events:
        raise BaselineError(
            f"{file} is cut off or was added to: {len(events)} telegrams, {header.events} were written. {_AGAIN}"
        )
    return events
