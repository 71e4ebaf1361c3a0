"""Records of a run, telegrams and packets, as rows of a table: numbers to the last bit. Touches only the file it is
given.
"""

from __future__ import annotations

import csv
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, fields
from functools import cached_property
from math import inf
from pathlib import Path
from typing import Any, Generic, TypeVar
from urllib.parse import unquote

from cosim.results.result_data import BaliseRecord, PacketRecord

Record = TypeVar("Record")

EVENTS_SUFFIX = ".events.csv"
"""Ending of the file of telegrams beside a table without room for them."""
TELEGRAM_UNITS = {
    "stamp": "s",
    "delivered_at": "s",
    "position": "m",
    "true_position": "m",
    "location_accuracy": "m",
    "odometer_reading": "m/s",
    "time_bound": "s",
}
_PACKET_KINDS = ("sent", "lost", "duplicate")
_ESCAPES = {ord("%"): "%25", ord(";"): "%3B", ord("="): "%3D"}
_FORMER_OUTCOMES = {"told": "notified"}
"""How files written before version 9.3 name an outcome, and its name now."""


def _outcomes_text(outcomes: Mapping[str, str]) -> str:
    """Outcomes as ``name=outcome;name=outcome``; ``%``, ``;`` and ``=`` inside a name are written as in a URL."""
    return ";".join(f"{name.translate(_ESCAPES)}={what.translate(_ESCAPES)}" for name, what in outcomes.items())


def parse_outcomes(text: str) -> dict[str, str]:
    """The mapping that `_outcomes_text` wrote, with the outcomes of earlier versions under the names of today.

    Raises:
        ValueError: a part of `text` is not ``name=outcome``.
    """
    outcomes = {}
    for part in filter(None, text.split(";")):
        name, equals, what = part.partition("=")
        if not equals:
            raise ValueError(f"Outcome {part!r} must read 'receiver=outcome'.")
        outcomes[unquote(name)] = _FORMER_OUTCOMES.get(what, unquote(what))
    return outcomes


_READ: dict[Any, Callable[[Any], Any]] = {
    "float": float,
    "int": int,
    "Mapping[str, str]": lambda text: parse_outcomes(str(text)),
    "Mapping[str, float]": lambda text: {name: float(value) for name, value in parse_outcomes(str(text)).items()},
}
"""What makes the value of a cell, by the annotation of its field; of all others it is the text."""


@dataclass(frozen=True)
class RecordRows(Generic[Record]):
    """Records of one kind as rows, a column for each field.

    Args:
        kind: class of the records, a dataclass. what: a file of them, for messages. check: raises a ValueError where
            a record cannot be. columns: their order in files.
    """

    kind: type[Record]
    what: str
    check: Callable[[Record], None]
    columns: tuple[str, ...]

    @cached_property
    def numbers(self) -> frozenset[str]:
        """Columns of numbers."""
        return frozenset(name for name, read in self._readers.items() if read is float)

    @cached_property
    def _readers(self) -> dict[str, Callable[[Any], Any]]:
        """What makes the value of a cell, by column."""
        return {f.name: _READ.get(f.type, str) for f in fields(self.kind)}  # type: ignore[arg-type]

    def row(self, record: Record) -> dict[str, float | str]:
        """One record by column: numbers as they are, mappings as ``name=value;name=value``.

        Args:
            record: of this kind.
        """
        return {name: _cell(getattr(record, name), name in self.numbers) for name in self.columns}

    def record(self, row: Mapping[str, Any]) -> Record:
        """The record of a row; numbers may still be text.

        Args:
            row: cells by column.

        Raises:
            KeyError: a column is missing. ValueError: a cell cannot be read, or is not legal.
        """
        record = self.kind(**{name: read(row[name]) for name, read in self._readers.items()})
        self.check(record)
        return record

    def records(self, columns: Mapping[str, Sequence[Any]]) -> list[Record]:
        """The records of columns of cells.

        Args:
            columns: by name, of equal length.

        Raises:
            KeyError, ValueError: as for `record`.
        """
        return [self.record(dict(zip(columns, row, strict=True))) for row in zip(*columns.values(), strict=True)]

    def cells(self, record: Record) -> list[str]:
        """One record as the cells of a CSV file.

        Args:
            record: of this kind.
        """
        return [repr(value) if isinstance(value, float) else value for value in self.row(record).values()]

    def write(self, path: str | Path, records: Iterable[Record]) -> None:
        """Write records as CSV.

        Args:
            path: file to write. records: in the order to be kept.

        Raises:
            OSError: the file cannot be written.
        """
        with Path(path).open("w", encoding="utf-8", newline="") as file:
            csv.writer(file, lineterminator="\n").writerows([self.columns, *map(self.cells, records)])

    def read(self, path: str | Path) -> list[Record]:
        """Read the records that `write` wrote.

        Args:
            path: the file.

        Raises:
            ValueError: the file is not such a table; the message names the line.
            OSError: the file cannot be read.
        """
        with Path(path).open(encoding="utf-8", newline="") as file:
            reader = csv.DictReader(file)
            if tuple(reader.fieldnames or ()) != self.columns:
                raise ValueError(f"{path} is not {self.what}: expected the columns {', '.join(self.columns)}.")
            records = []
            for row in reader:
                try:
                    records.append(self.record(row))
                except (TypeError, ValueError) as error:  # a row that is too short holds None
                    raise ValueError(f"{path}, line {reader.line_num}: {error}") from error
            return records


def _cell(value: Any, number: bool) -> float | str:
    if isinstance(value, Mapping):
        return _outcomes_text({k: v if isinstance(v, str) else repr(float(v)) for k, v in value.items()})
    return float(value) if number else str(value)


def require_accuracy(value: float) -> None:
    """Refuse a location accuracy that is none.

    Args:
        value: as stated [m].

    Raises:
        ValueError: it is below zero, infinite or no number.
    """
    if not 0.0 <= value < inf:
        raise ValueError(f"location_accuracy: expected a finite number of 0 m or more, got {value!r}.")


def _check_packet(packet: PacketRecord) -> None:
    if packet.kind not in _PACKET_KINDS:
        raise ValueError(f"kind {packet.kind!r} is none of: {', '.join(_PACKET_KINDS)}.")


TELEGRAM_ROWS: RecordRows[BaliseRecord] = RecordRows(
    BaliseRecord,
    "an event table",
    lambda telegram: require_accuracy(telegram.location_accuracy),
    tuple(f.name for f in fields(BaliseRecord)),
)
PACKET_ROWS: RecordRows[PacketRecord] = RecordRows(
    PacketRecord,
    "a table of packets",
    _check_packet,
    ("stamp", "delivered_at", "node", "number", "kind", "values", "outcomes"),
)
