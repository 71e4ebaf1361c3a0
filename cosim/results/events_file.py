"""The balise telegrams of a run as CSV, one row each. Touches only the file it is given."""

from __future__ import annotations

import csv
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import fields
from math import inf
from pathlib import Path
from typing import Any, TypeVar
from urllib.parse import unquote

from cosim.results.result_data import BaliseRecord

Record = TypeVar("Record")

EVENTS_SUFFIX = ".events.csv"
"""Ending of the file of telegrams beside a table without room for them."""

COLUMNS = tuple(f.name for f in fields(BaliseRecord))
NUMBERS = frozenset(f.name for f in fields(BaliseRecord) if f.type == "float")
_ESCAPES = {ord("%"): "%25", ord(";"): "%3B", ord("="): "%3D"}


def outcomes_text(outcomes: Mapping[str, str]) -> str:
    """Outcomes as ``name=outcome;name=outcome``; ``%``, ``;`` and ``=`` inside a name are written as in a URL.

    Args:
        outcomes: by name of the receiver.
    """
    return ";".join(f"{name.translate(_ESCAPES)}={what.translate(_ESCAPES)}" for name, what in outcomes.items())


def parse_outcomes(text: str) -> dict[str, str]:
    """The mapping that `outcomes_text` wrote.

    Raises:
        ValueError: a part of `text` is not ``name=outcome``.
    """
    outcomes = {}
    for part in filter(None, text.split(";")):
        name, equals, what = part.partition("=")
        if not equals:
            raise ValueError(f"Outcome {part!r} must read 'receiver=outcome'.")
        outcomes[unquote(name)] = unquote(what)
    return outcomes


def record_row(record: BaliseRecord) -> dict[str, float | str]:
    """One telegram by column: numbers as they are, the outcomes as text.

    Args:
        record: the telegram.
    """
    row: dict[str, Any] = {name: getattr(record, name) for name in COLUMNS}
    row["outcomes"] = outcomes_text(record.outcomes)
    return {name: float(value) if name in NUMBERS else str(value) for name, value in row.items()}


def record_from_row(row: Mapping[str, Any]) -> BaliseRecord:
    """The telegram of a row; numbers may still be text.

    Args:
        row: cells by column.

    Raises:
        KeyError: a column is missing. ValueError: a number or an outcome cannot be read, or is not legal.
    """
    values: dict[str, Any] = {name: float(row[name]) if name in NUMBERS else str(row[name]) for name in COLUMNS}
    require_accuracy(values["location_accuracy"])
    values["outcomes"] = parse_outcomes(values["outcomes"])
    return BaliseRecord(**values)


def require_accuracy(value: float) -> None:
    """Refuse a location accuracy that is none.

    Args:
        value: as told [m].

    Raises:
        ValueError: it is below zero, infinite or no number.
    """
    if not 0.0 <= value < inf:
        raise ValueError(f"location_accuracy: expected a finite number of 0 m or more, got {value!r}.")


def write_events(path: str | Path, events: Iterable[BaliseRecord]) -> None:
    """Write telegrams as CSV, numbers to the last bit.

    Args:
        path: file to write.
        events: the telegrams, in the order to be kept.

    Raises:
        OSError: the file cannot be written.
    """
    with Path(path).open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(COLUMNS)
        for record in events:
            writer.writerow([repr(v) if isinstance(v, float) else v for v in record_row(record).values()])


def read_events(path: str | Path) -> list[BaliseRecord]:
    """Read the telegrams written by `write_events`.

    Args:
        path: the file.

    Raises:
        ValueError: the file is not such a table; the message names the line.
        OSError: the file cannot be read.
    """
    return read_rows(path, COLUMNS, "an event table", record_from_row)


def read_rows(
    path: str | Path, columns: Sequence[str], what: str, from_row: Callable[[Mapping[str, str]], Record]
) -> list[Record]:
    """Read a CSV file with a row for each record.

    Args:
        path: the file. columns: that it must have. what: what such a file is, for the message. from_row: makes a record
            of the cells by column.

    Raises:
        ValueError: the file has other columns, or a row cannot be read; the message names the line.
        OSError: the file cannot be read.
    """
    with Path(path).open(encoding="utf-8", newline="") as file:
        reader = csv.DictReader(file)
        if tuple(reader.fieldnames or ()) != tuple(columns):
            raise ValueError(f"{path} is not {what}: expected the columns {', '.join(columns)}.")
        records = []
        for row in reader:
            try:
                records.append(from_row(row))
            except (TypeError, ValueError) as error:  # a row that is too short holds None
                raise ValueError(f"{path}, line {reader.line_num}: {error}") from error
        return records
