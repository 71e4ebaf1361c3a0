"""The store of a campaign: a folder whose rows stand in Parquet files, one for each chunk of runs, with units. Touches
that folder only.

A chunk that is being done has a file ``NUMBER.ATTEMPT.jsonl``: what begins, and each row as soon as it is there, so
that a killed process leaves what it had. Its Parquet file takes its place by renaming, whole or not at all. So several
processes and machines may work in one folder.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from uuid import uuid4

from cosim.errors import OutputError
from cosim.results.optional import optional_module
from cosim.studies.measures import is_number, measure_unit

Row = dict[str, Any]
PARTS = "parts"
FIXED: Mapping[str, str] = {
    "key": "string",
    "number": "int64",
    "point": "int64",
    "design": "int64",
    "failure": "string",
    "warnings": "int32",
    "seconds": "float64",
}
"""Columns of every campaign but for settings and measures, and their types of Arrow."""


def setting_type(values: Sequence[Any]) -> str:
    """The type of Arrow in which a setting is kept.

    Args:
        values: that it takes in all runs.
    """
    if all(isinstance(value, bool) for value in values):
        return "bool"
    if all(map(is_number, values)):
        return "int64" if all(isinstance(value, int) for value in values) else "float64"
    return "string"


def stored_setting(value: Any, kind: str) -> Any:
    """The value of a setting as its column holds it: a list as JSON.

    Args:
        value: of the setting. kind: see `setting_type`.
    """
    if kind != "string":
        return float(value) if kind == "float64" else value
    return value if isinstance(value, str) else json.dumps(value)


@dataclass(frozen=True)
class Store:
    """The rows of a campaign.

    Args:
        directory: the folder. settings: types of their columns by name. units: of settings, by name.
    """

    directory: Path
    settings: Mapping[str, str]
    units: Mapping[str, str]

    def part(self, chunk: int) -> Path:
        """The Parquet file of a chunk.

        Args:
            chunk: its number.
        """
        return self.directory / PARTS / f"{chunk:06d}.parquet"

    def spill(self, chunk: int, attempt: str) -> Path:
        """The file of a chunk that is being done.

        Args:
            chunk: its number. attempt: by whom.
        """
        return self.directory / PARTS / f"{chunk:06d}.{attempt}.jsonl"

    def known(self, chunk: int) -> dict[str, Row]:
        """Rows of a chunk that are there, by key.

        Args:
            chunk: its number.
        """
        parquet = optional_module("pyarrow.parquet", "Campaigns")
        part, found = self.part(chunk), dict[str, Row]()
        for path in self._spills(chunk):
            found |= {row["key"]: row for row in _spilled(path) if "number" in row}
        with suppress(FileNotFoundError):
            found |= {row["key"]: row for row in parquet.read_table(part, partitioning=None).to_pylist()}
        return found

    def begun(self, chunk: int, attempt: str) -> str | None:
        """Key of the run that an attempt had begun and not ended when it was killed; None where there is none.

        Args:
            chunk: its number. attempt: by whom.
        """
        path = self.spill(chunk, attempt)
        last = list(_spilled(path))[-1:] if path.is_file() else []
        return next((line["key"] for line in last if "number" not in line), None)

    def note(self, chunk: int, attempt: str, line: Row) -> None:
        """Write a line: what begins, or the row of a run.

        Args:
            chunk: its number. attempt: by whom. line: plain data with its ``key``.

        Raises:
            OutputError: the folder cannot be written.
        """
        path = self.spill(chunk, attempt)
        try:
            with path.open("a", encoding="utf-8") as file:
                file.write(json.dumps(line) + "\n")
        except OSError as error:
            raise OutputError(f"{path} cannot be written: {error.strerror or error}.") from error

    def commit(self, chunk: int, rows: Sequence[Row]) -> None:
        """Write the Parquet file of a chunk, and remove what led to it.

        Args:
            chunk: its number. rows: of it, all that are known.

        Raises:
            OutputError: the folder cannot be written.
        """
        arrow, parquet = (optional_module(name, "Campaigns") for name in ("pyarrow", "pyarrow.parquet"))
        ordered = sorted(rows, key=lambda row: row["number"])
        schema = arrow.schema([self._field(arrow, name) for name in dict.fromkeys(n for row in ordered for n in row)])
        part = self.part(chunk)
        new = part.with_name(f"{part.stem}.{uuid4().hex}.new")
        try:
            parquet.write_table(arrow.Table.from_pylist(ordered, schema=schema), new)
            new.replace(part)
        except OSError as error:
            with suppress(OSError):
                new.unlink()
            raise OutputError(f"{part} cannot be written: {error.strerror or error}.") from error
        for path in self._spills(chunk):
            with suppress(OSError):
                path.unlink()

    def is_shared(self) -> bool:
        """Whether somebody works in the folder, or was killed while he did."""
        return any((self.directory / PARTS).glob("*.jsonl"))

    def is_here(self) -> bool:
        """Whether this machine sees the folder."""
        return (self.directory / PARTS).is_dir()

    def _spills(self, chunk: int) -> list[Path]:
        return sorted((self.directory / PARTS).glob(f"{chunk:06d}.*.jsonl"))

    def _field(self, arrow: Any, name: str) -> Any:
        """A column with the unit of its numbers."""
        kind = FIXED.get(name) or self.settings.get(name) or "float64"
        unit = {"seconds": "s"}.get(name) or (self.units.get(name) if name in self.settings else measure_unit(name))
        return arrow.field(
            name, getattr(arrow, kind)() if kind != "bool" else arrow.bool_(), metadata=unit and {"unit": unit}
        )


def _spilled(path: Path) -> Iterator[Row]:
    """Lines that were written whole."""
    with suppress(FileNotFoundError):
        for line in path.read_bytes().split(b"\n"):
            with suppress(ValueError):
                entry = json.loads(line)
                if isinstance(entry, dict) and "key" in entry:
                    yield entry


def read_rows(directory: Path) -> Any:
    """All rows of a campaign as a table of Arrow, in the order of their numbers, units in the metadata of the fields.

    Args:
        directory: of the campaign.

    Raises:
        OutputError: there is no such table, or pyarrow is not installed.
    """
    arrow, parquet = (optional_module(name, "Campaigns") for name in ("pyarrow", "pyarrow.parquet"))
    parts = sorted((directory / PARTS).glob("*.parquet"))
    if not parts:
        raise OutputError(f"{directory} holds no runs of a campaign; expected {PARTS}/*.parquet in it.")
    tables = [parquet.read_table(part, partitioning=None) for part in parts]
    return arrow.concat_tables(tables, promote_options="default").sort_by("number")
