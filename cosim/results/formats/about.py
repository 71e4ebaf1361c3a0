"""What a result is beside its table, as plain data for the formats that have room for it. Touches no file."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Mapping
from dataclasses import asdict
from typing import Any

import numpy as np

from cosim.results.record_rows import TELEGRAM_ROWS
from cosim.results.result_data import BaliseRecord, ResultData, SignalInfo
from cosim.results.si import convert
from cosim.results.summary_file import restored
from cosim.results.table_layout import column_names
from fmus.tables.plain_data import jsonable
from plant_models.hybrid.units import parse_unit

BLOCK = 1 << 25  # bytes of a table that are turned over at a time: it may be larger than the memory
_FROM_JSON = {None: math.nan, "inf": math.inf, "-inf": -math.inf}


def signals_of(result: ResultData) -> list[SignalInfo]:
    """What each column but ``time`` is, in the order of the table.

    Args:
        result: the table and what its columns are.

    Raises:
        ValueError: the table is not a result table.
    """
    known = {signal.name: signal for signal in result.signals}
    return [known.get(name, SignalInfo(name)) for name in column_names(result.table)[1:]]


_SIGNAL_KEYS = (
    "unit",
    "si_unit",
    "display_unit",
    "declared_unit",
    "display_scale",
    "variability",
    "can_be_missing",
    "description",
)
"""Keys of what a file says of a signal: ``unit`` is that of its numbers, ``si_unit`` the one of SI where this is
another one."""


def signal_texts(signal: SignalInfo, is_own: bool) -> dict[str, str]:
    """What a file says of a signal, a text for each of the keys; empty where there is nothing to say.

    Args:
        signal: what it is. is_own: whether the file holds it in its declared unit, else in SI.
    """
    own = {"unit": signal.declared_unit, "si_unit": signal.unit} if is_own else {"si_unit": None}
    scale = None if signal.display_scale is None else " ".join(map(repr, signal.display_scale))
    known = {**asdict(signal), "display_scale": scale, "can_be_missing": signal.can_be_missing or None, **own}
    return {key: str(known[key] or "") for key in _SIGNAL_KEYS}


def signal_of_texts(name: str, texts: Mapping[str, str | None]) -> SignalInfo:
    """What a signal is by what a file says of it; the other way of `signal_texts`.

    Args:
        name: of the signal. texts: of the keys that the file has; an older one has fewer.
    """
    scale = [float(number) for number in (texts.get("display_scale") or "").split()]
    return SignalInfo(
        name,
        texts.get("si_unit") or texts.get("unit") or "1",
        texts.get("display_unit") or None,
        "discrete" if texts.get("variability") == "discrete" else "continuous",
        texts.get("description") or "",
        texts.get("can_be_missing") == str(True),
        texts.get("declared_unit") or None,
        (scale[0], scale[1]) if len(scale) == 2 else None,
    )


def bring_to_si(table: np.ndarray, texts: Mapping[str, Mapping[str, str | None]]) -> np.ndarray:
    """Rows as they are kept, of those that a file holds.

    Args:
        table: structured rows; changed in place. texts: what the file says of signals, by name.
    """
    convert(table, {name: parse_unit(says["unit"] or "1") for name, says in texts.items() if says.get("si_unit")})
    return table


def blocks(table: np.ndarray, size: int = BLOCK) -> Iterator[tuple[int, np.ndarray]]:
    """Number of the first row and rows of a table, piece by piece; at least one piece, which may be empty.

    Args:
        table: rows, a structured array, shape (rows,).
        size: rows of a piece.
    """
    rows = max(size // table.dtype.itemsize, 1)
    for start in range(0, max(len(table), 1), rows):
        yield start, np.asarray(table[start : start + rows])


def about_text(result: ResultData) -> str:
    """Telegrams, summary and failure as JSON.

    Args:
        result: with telegrams, summary and failure.
    """
    content = {
        "events": [TELEGRAM_ROWS.row(e) for e in result.events],
        "summary": result.summary,
        "failure": result.failure,
    }
    return json.dumps(jsonable(content), ensure_ascii=False, allow_nan=False)


def with_about(table: np.ndarray, signals: list[SignalInfo], text: str) -> ResultData:
    """The result of a table and what `about_text` stated; NaN in the summary has become None.

    Args:
        table: rows, a structured array, shape (rows,).
        signals: what each column but ``time`` is.
        text: from `about_text`.

    Raises:
        KeyError, TypeError, ValueError: the text is none of ours.
    """
    content = json.loads(text)
    events = [_record(row) for row in content["events"]]
    summary = {"events_recorded": True, **restored(content["summary"])}
    return ResultData(table, signals, events, summary, content["failure"])


def _record(row: Mapping[str, Any]) -> BaliseRecord:
    return TELEGRAM_ROWS.record({n: _FROM_JSON.get(v, v) if n in TELEGRAM_ROWS.numbers else v for n, v in row.items()})
