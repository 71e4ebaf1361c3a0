"""Results as a MATLAB file, to the last bit. Touches only the file it is given.

In MATLAB: ``time`` and one column vector for each signal (``locomotive_position``), in the unit that its FMU declares,
``units.locomotive_position``, the struct ``signals`` of cell arrays (variable, name, unit, ...) in column order, and
the struct ``events`` of columns.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import scipy

from cosim.results.declared_units import in_own_units, own_units
from cosim.results.formats.about import bring_to_si, signal_of_texts, signal_texts, signals_of
from cosim.results.formats.format import Format
from cosim.results.record_rows import TELEGRAM_ROWS
from cosim.results.result_data import BaliseRecord, ResultData, SignalInfo
from cosim.results.table_layout import table_of

_RESERVED = ("time", "units", "signals", "events")
_KEYS = tuple(signal_texts(SignalInfo(""), is_own=False))


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


def _signals_struct(texts: Mapping[str, Mapping[str, str]], legal: Mapping[str, str]) -> dict[str, np.ndarray]:
    columns = {key: _cells([says[key] for says in texts.values()]) for key in _KEYS}
    return {"variable": _cells([legal[name] for name in texts]), "name": _cells(list(texts)), **columns}


def _events_struct(events: Sequence[BaliseRecord]) -> dict[str, np.ndarray]:
    rows = [TELEGRAM_ROWS.row(event) for event in events]
    return {
        name: np.array([row[name] for row in rows], dtype=np.float64).reshape(-1, 1)
        if name in TELEGRAM_ROWS.numbers
        else _cells([str(row[name]) for row in rows])
        for name in TELEGRAM_ROWS.columns
    }


def _read_signals(struct: Mapping[str, Any]) -> tuple[list[str], dict[str, dict[str, str | None]]]:
    """Names of the variables, and what the file says of each signal; an older file says less."""
    variables = _texts(struct["variable"], 0)
    columns = {key: _texts(struct[key], len(variables)) for key in ("name", *_KEYS) if key in struct}
    rows = [dict(zip(columns, values, strict=True)) for values in zip(*columns.values(), strict=True)]
    return variables, {row["name"]: {**row} for row in rows}


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
        own = own_units(result.table, result.signals)
        texts = {signal.name: signal_texts(signal, signal.name in own) for signal in signals_of(result)}
        names, table = list(texts), in_own_units(result.table, own)
        legal = _matlab_names(names, _RESERVED)
        content: dict[str, Any] = {"time": table["time"]}
        content |= {legal[name]: table[name] for name in names}
        content["units"] = {legal[name]: says["unit"] for name, says in texts.items()}
        content["signals"] = _signals_struct(texts, legal)
        content["events"] = _events_struct(result.events)
        with path.open("wb") as file:
            scipy.io.savemat(file, content, long_field_names=True, do_compression=True, oned_as="column")

    @staticmethod
    def read(path: Path) -> ResultData:  # noqa: D102 - see Format
        with path.open("rb") as file:
            try:
                content = scipy.io.loadmat(file, simplify_cells=True)
                variables, texts = _read_signals(content["signals"])
                columns = [content["time"], *(content[variable] for variable in variables)]
                events = _read_events(content["events"])
            except (KeyError, TypeError, ValueError, NotImplementedError) as error:
                raise ValueError(f"{path} is not a MATLAB result file: {error}") from error
        table = bring_to_si(table_of(["time", *texts], columns), texts)
        return ResultData(table, [signal_of_texts(name, says) for name, says in texts.items()], events)
