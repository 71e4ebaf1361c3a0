"""Results as Apache Parquet, to the last bit: for pandas, Polars, MATLAB's ``parquetread``. Touches only the file it is
given.

A column each for ``time`` and every signal, in the unit that its FMU declares; ``unit`` (of the numbers), ``si_unit``
where this is another one, ``display_unit``, ``variability`` and ``description`` are the metadata of its field. The
metadata of the file holds telegrams, summary and failure as JSON under ``fmu-observer``, and units by name where pandas
looks for ``DataFrame.attrs``.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from cosim.errors import OutputError
from cosim.results.declared_units import in_own_units, own_units
from cosim.results.formats.about import (
    about_text,
    blocks,
    bring_to_si,
    signal_of_texts,
    signal_texts,
    signals_of,
    with_about,
)
from cosim.results.formats.columns import numbered, result_of_columns
from cosim.results.formats.format import Format
from cosim.results.optional import optional_module
from cosim.results.result_data import ResultData, SignalInfo
from cosim.results.table_layout import table_dtype

_ABOUT = b"fmu-observer"


def _modules() -> tuple[Any, Any]:
    arrow, parquet = (optional_module(name, "Parquet files") for name in ("pyarrow", "pyarrow.parquet"))
    return arrow, parquet


def _ours(file: Any, about: str) -> ResultData:
    schema = file.schema_arrow
    table = np.empty(file.metadata.num_rows, table_dtype(schema.names))
    start = 0
    for batch in file.iter_batches():
        for name, column in zip(schema.names, batch.columns, strict=True):
            table[name][start : start + len(batch)] = column.to_numpy(zero_copy_only=False)
        start += len(batch)
    texts = {field.name: _texts(field) for field in schema}
    signals = [signal_of_texts(name, texts[name]) for name in schema.names[1:]]
    return with_about(bring_to_si(table, texts), signals, about)


def _texts(field: Any) -> dict[str, str]:
    return {key.decode(): value.decode() for key, value in (field.metadata or {}).items()}


def _signal(field: Any) -> SignalInfo:
    known = _texts(field)
    return signal_of_texts(field.name, {"unit": known.get("units"), **known})


def _foreign(source: str, table: Any) -> ResultData:
    described = {field.name: _signal(field) for field in table.schema}
    columns, texts = [], dict[str, tuple[str, ...]]()
    for place, name in enumerate(table.column_names):
        column, items = _numbered(table.column(place))
        columns.append(_column(source, name, column))
        texts |= {name: items} if items else {}
    attributes = json.loads((table.schema.metadata or {}).get(b"PANDAS_ATTRS", b"{}"))
    units = attributes.get("units", {}) if isinstance(attributes, dict) else {}
    known = {n: units.get(n) or (described[n].unit if described[n].unit != "1" else None) for n in table.column_names}
    return result_of_columns(source, table.column_names, columns, known, lambda name: described[name], texts)


def _numbered(column: Any) -> tuple[Any, tuple[str, ...]]:
    """A column of texts as numbers, in the order in which they first stand, and the texts; another one as it is."""
    types = _modules()[0].types
    kind = column.type.value_type if types.is_dictionary(column.type) else column.type
    if not (types.is_string(kind) or types.is_large_string(kind)):
        return column, ()
    numbers, items = numbered(column.cast(kind).to_pylist())
    return _modules()[0].array(numbers), items


def _column(source: str, name: str, column: Any) -> np.ndarray:
    """A column as float64: missing values are NaN, durations seconds."""
    arrow, _ = _modules()
    kind = column.type
    if arrow.types.is_duration(kind):
        column = column.cast(arrow.duration("ns"), safe=False).cast(arrow.int64())
        return np.asarray(column.to_numpy(), np.float64) / 1e9
    if arrow.types.is_boolean(kind):
        column = column.cast(arrow.uint8())
    elif not (arrow.types.is_integer(kind) or arrow.types.is_floating(kind) or arrow.types.is_decimal(kind)):
        raise OutputError(f"{source}: column {name!r} must hold numbers, got {kind}. Leave it out.")
    return np.asarray(column.cast(arrow.float64(), safe=False).to_numpy())


class ParquetFormat(Format):
    """Columns with metadata."""

    name = "parquet"
    endings = (".parquet", ".pq")
    speed = 2
    package = "pyarrow"

    @staticmethod
    def write(path: Path, result: ResultData) -> None:  # noqa: D102 - see Format
        arrow, parquet = _modules()
        signals, own = signals_of(result), own_units(result.table, result.signals)
        texts = {s.name: signal_texts(s, s.name in own) for s in signals}
        fields = [arrow.field("time", arrow.float64(), nullable=False, metadata={"unit": "s", "description": "time"})]
        fields += [
            arrow.field(name, arrow.float64(), nullable=False, metadata={k: v for k, v in says.items() if v})
            for name, says in texts.items()
        ]
        units = {"units": {"time": "s"} | {name: says["unit"] for name, says in texts.items()}}
        schema = arrow.schema(
            fields, metadata={_ABOUT: about_text(result), "PANDAS_ATTRS": json.dumps(units, ensure_ascii=False)}
        )
        names = result.table.dtype.names or ()
        with (
            path.open("wb") as file,
            parquet.ParquetWriter(file, schema, use_dictionary=False, compression="snappy") as writer,
        ):
            for _, kept in blocks(result.table):
                rows = in_own_units(kept, own)
                columns = [arrow.array(np.ascontiguousarray(rows[name])) for name in names]
                writer.write_table(arrow.Table.from_arrays(columns, schema=schema))

    @staticmethod
    def read(path: Path) -> ResultData:  # noqa: D102 - see Format
        arrow, parquet = _modules()
        with path.open("rb") as source:
            try:
                file = parquet.ParquetFile(source)
                about = (file.schema_arrow.metadata or {}).get(_ABOUT)
                return _foreign(str(path), file.read()) if about is None else _ours(file, about.decode())
            except arrow.ArrowException as error:
                raise ValueError(f"{path} is not a Parquet file that can be read: {error}") from error
