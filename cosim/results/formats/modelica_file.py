"""Results as the trajectory file of Dymola and OpenModelica, to the last bit. Touches only the file it is given.

A MATLAB file of version 4 with the matrices ``Aclass``, ``name``, ``description``, ``dataInfo``, ``data_1`` (parameters
at the start and at the end) and ``data_2`` (time and signals), stored transposed (``binTrans``), so that rows follow
each other. Units stand in the descriptions as these tools write them, ``speed of the train [m/s|km/h]``. Rows before
and after an event have the same time, as theirs. A last matrix ``fmu_observer``, which these tools leave alone, holds
what has no place in the format.
"""

from __future__ import annotations

import json
import math
import struct
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from cosim.results.formats.about import about_text, blocks, signals_of
from cosim.results.result_data import ResultData, SignalInfo
from cosim.results.table_layout import column_names

_ACLASS = [text.ljust(11) for text in ("Atrajectory", "1.1", "", "binTrans")]  # OpenModelica wants it so to the byte
ABOUT = "fmu_observer"
TEXT, INTEGERS, _DOUBLES = 51, 20, 0  # types of a matrix: little-endian; letters are bytes of UTF-8
LARGEST = 2**31 - 1


def write_modelica(path: str | Path, result: ResultData) -> None:
    """Write a result; a table larger than the memory is written block by block.

    Args:
        path: file to write.
        result: what to write. The numbers among the ``parameters`` of the components in its summary become parameters.

    Raises:
        ValueError: the table is not a result table, or it has more rows than the format can count.
        OSError: the file cannot be written.
    """
    names = column_names(result.table)
    if len(result.table) > LARGEST:
        raise ValueError(
            f"A Modelica trajectory holds at most {LARGEST} rows, got {len(result.table)}. Use another format."
        )
    signals = signals_of(result)
    parameters = _parameters(result.summary, names)
    with Path(path).open("wb") as file:
        _matrix(file, "Aclass", TEXT, np.array([list(text) for text in _ACLASS], "S1"))
        _text_matrix(file, "name", [*names, *parameters])
        _text_matrix(file, "description", ["Time [s]", *map(_description, signals), *[""] * len(parameters)])
        _matrix(file, "dataInfo", INTEGERS, _data_info(len(names), len(parameters)))
        ends = _ends(result.table)
        _matrix(file, "data_1", _DOUBLES, np.array([ends, *([value] * 2 for value in parameters.values())]))
        _header(file, "data_2", _DOUBLES, len(names), len(result.table))
        for _, rows in blocks(result.table):
            file.write(np.ascontiguousarray(rows).tobytes())
        more = {"signals": [asdict(signal) for signal in signals], "about": about_text(result)}
        _text_matrix(file, ABOUT, [json.dumps(more, ensure_ascii=False)])


def _parameters(summary: Mapping[str, Any], taken: Iterable[str]) -> dict[str, float]:
    """Start values of the components by ``component.parameter``, but for those that have a column."""
    found: dict[str, float] = {}
    for component in summary.get("components", ()):
        for name, value in (component.get("parameters") or {}).items():
            if isinstance(value, (bool, int, float)) and not math.isnan(value):  # OpenModelica takes NaN for a change
                found[f"{component['name']}.{name}"] = float(value)
    return {name: value for name, value in found.items() if name not in set(taken)}


def _ends(table: np.ndarray) -> list[float]:
    return [float(table["time"][0]), float(table["time"][-1])] if len(table) else [0.0, 0.0]


def _data_info(columns: int, parameters: int) -> np.ndarray:
    """For each name: matrix (0 for time), row in it, linear interpolation, and what holds outside: nothing, or the
    value.
    """
    rows = [
        (0, 1, 0, -1),
        *((2, i + 1, 0, -1) for i in range(1, columns)),
        *((1, i + 2, 0, 0) for i in range(parameters)),
    ]
    return np.array(rows, np.int32).T


def _description(signal: SignalInfo) -> str:
    unit = signal.unit if signal.display_unit is None else f"{signal.unit}|{signal.display_unit}"
    if unit == "1" and not signal.description.endswith("]"):
        return signal.description
    return f"{signal.description} [{unit}]" if signal.description else f"[{unit}]"


def split_description(text: str) -> tuple[str, str | None, str | None]:
    """Description, unit and display unit of a description in such a file, e.g. ``Mass of the train [kg]``.

    Dymola puts types in too, ``[:#(type=Boolean)]``, which are left out.

    Args:
        text: the description.
    """
    start = text.rfind("[")
    if start < 0 or not text.endswith("]"):
        return text, None, None
    unit, _, display = text[start + 1 : -1].partition(":#")[0].partition("|")
    return text[:start].removesuffix(" "), unit or None, display or None


def _text_matrix(file: BinaryIO, name: str, texts: Sequence[str]) -> None:
    """Texts filled up with NUL, each a column."""
    encoded = [text.encode() for text in texts]
    width = max(map(len, encoded)) + 1  # one NUL at least: then trailing spaces are part of a text
    _header(file, name, TEXT, width, len(texts))
    file.write(b"".join(text.ljust(width, b"\0") for text in encoded))


def _matrix(file: BinaryIO, name: str, kind: int, values: np.ndarray) -> None:
    _header(file, name, kind, *values.shape)
    file.write(values.tobytes(order="F"))


def _header(file: BinaryIO, name: str, kind: int, rows: int, columns: int) -> None:
    file.write(struct.pack("<5i", kind, rows, columns, 0, len(name) + 1) + name.encode() + b"\0")
