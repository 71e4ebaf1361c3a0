"""Results as a MATLAB file, to the last bit. Touches only the file it is given.

In MATLAB: ``time`` and one column vector for each signal (``locomotive_position``), ``units.locomotive_position``, the
struct ``signals`` of cell arrays (variable, name, unit, ...) in column order, and the struct ``events`` of columns.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np
import scipy

from cosim.results.formats.about import signals_of
from cosim.results.formats.format import Format
from cosim.results.record_rows import TELEGRAM_ROWS
from cosim.results.result_data import BaliseRecord, ResultData, SignalInfo
from cosim.results.table_layout import table_of

_RESERVED = ("time", "units", "signals", "events")


_MAX_LENGTH = 63  # namelengthmax of MATLAB
_FLOW_KEYWORDS = (
    "break",
    "case",
    "catch",
    "continue",
    "else",
    "elseif",
    "end",
    "for",
    "if",
    "otherwise",
    "parfor",
    "return",
)
_KEYWORDS = frozenset(
    (*_FLOW_KEYWORDS, "classdef", "function", "global", "persistent", "spmd", "switch", "try", "while")
)


def _legal(name: str) -> str:
    legal = re.sub(r"[^A-Za-z0-9_]", "_", name)
    if not legal or not legal[0].isalpha() or legal in _KEYWORDS:
        legal = "x" + legal
    return legal[:_MAX_LENGTH]


def _matlab_names(names: Iterable[str], taken: Iterable[str] = ()) -> dict[str, str]:
    """A legal and unique MATLAB variable name for each name: ``locomotive.position`` gives ``locomotive_position``."""
    used, legal = set(taken), {}
    for name in names:
        stem = candidate = _legal(name)
        number = 1
        while candidate in used:
            number += 1
            suffix = f"_{number}"
            candidate = stem[: _MAX_LENGTH - len(suffix)] + suffix
        used.add(candidate)
        legal[name] = candidate
    return legal


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
    rows = [TELEGRAM_ROWS.row(event) for event in events]
    return {
        name: np.array([row[name] for row in rows], dtype=np.float64).reshape(-1, 1)
        if name in TELEGRAM_ROWS.numbers
        else _cells([str(row[name]) for row in rows])
        for name in TELEGRAM_ROWS.columns
    }


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
                "declared_unit": row.get("declared_unit") or None,
                "can_be_missing": row.get("can_be_missing") == str(True),
            }
        )
        for row in rows
    ]
    return variables, signals


def _read_events(struct: Mapping[str, Any]) -> list[BaliseRecord]:
    count = np.size(struct["stamp"])
    return TELEGRAM_ROWS.records(
        {
            name: np.ravel(struct[name]).tolist() if name in TELEGRAM_ROWS.numbers else _texts(struct[name], count)
            for name in TELEGRAM_ROWS.columns
        }
    )


class MatFormat(Format):
    """MATLAB 5."""

    name = "mat"
    endings = (".mat",)

    @staticmethod
    def write(path: Path, result: ResultData) -> None:  # noqa: D102 - see Format
        signals = signals_of(result)
        names = [signal.name for signal in signals]
        legal = _matlab_names(names, _RESERVED)
        content: dict[str, Any] = {"time": result.table["time"]}
        content |= {legal[name]: result.table[name] for name in names}
        content["units"] = {legal[s.name]: s.unit for s in signals}
        content["signals"] = _signals_struct(signals, legal)
        content["events"] = _events_struct(result.events)
        with path.open("wb") as file:
            scipy.io.savemat(file, content, long_field_names=True, do_compression=True, oned_as="column")

    @staticmethod
    def read(path: Path) -> ResultData:  # noqa: D102 - see Format
        with path.open("rb") as file:
            try:
                content = scipy.io.loadmat(file, simplify_cells=True)
                variables, signals = _read_signals(content["signals"])
                columns = [content["time"], *(content[variable] for variable in variables)]
                events = _read_events(content["events"])
            except (KeyError, TypeError, ValueError, NotImplementedError) as error:
                raise ValueError(f"{path} is not a MATLAB result file: {error}") from error
        return ResultData(table_of(["time", *(s.name for s in signals)], columns), signals, events)
