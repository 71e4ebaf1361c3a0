"""Summaries as JSON that any reader accepts. Touches only the file it is given.

JSON has no NaN and no infinity: NaN becomes ``null``, infinities become the texts ``"inf"`` and ``"-inf"``, which
`read_summary` turns back. Keys are sorted so that two summaries can be compared line by line.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import asdict, is_dataclass
from enum import Enum
from pathlib import Path
from typing import Any

import numpy as np

_INFINITIES = {"inf": math.inf, "-inf": -math.inf}


def _number(value: float) -> float | str | None:
    if math.isnan(value):
        return None
    return float(value) if math.isfinite(value) else str(float(value))


def jsonable(value: Any) -> Any:
    """`value` in JSON's own types.

    Args:
        value: any nesting of mappings, sequences, dataclasses, enumerations, NumPy scalars and arrays; whatever is none
            of these is written as its text.

    Returns:
        Dictionaries with text keys, lists, strings, integers, finite floats, booleans and None.
    """
    if isinstance(value, Enum):
        value = value.value
    elif isinstance(value, (np.ndarray, np.generic)):
        value = value.tolist()
    elif is_dataclass(value) and not isinstance(value, type):
        value = asdict(value)
    if value is None or isinstance(value, (str, bool, int)):
        return value
    return _number(value) if isinstance(value, float) else _container(value)


def _container(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {str(key): jsonable(item) for key, item in value.items()}
    if isinstance(value, (set, frozenset)):
        value = sorted(value, key=str)
    return [jsonable(item) for item in value] if isinstance(value, (list, tuple)) else str(value)


def restored(value: Any) -> Any:
    """A value of `jsonable` with its infinities; NaN stays None.

    Args:
        value: as read from JSON.
    """
    if isinstance(value, dict):
        return {key: restored(item) for key, item in value.items()}
    if isinstance(value, list):
        return [restored(item) for item in value]
    return _INFINITIES.get(value, value) if isinstance(value, str) else value


def write_summary(path: str | Path, summary: Mapping[str, Any]) -> None:
    """Write a summary as indented JSON with sorted keys.

    Args:
        path: file to write.
        summary: what `jsonable` accepts.

    Raises:
        OSError: the file cannot be written.
    """
    text = json.dumps(jsonable(summary), indent=2, sort_keys=True, ensure_ascii=False, allow_nan=False)
    Path(path).write_text(text + "\n", encoding="utf-8")


def read_summary(path: str | Path) -> dict[str, Any]:
    """Read a summary written by `write_summary`; ``null`` is read as None.

    Args:
        path: the file.

    Raises:
        ValueError: the file holds no JSON object.
        OSError: the file cannot be read.
    """
    content = json.loads(Path(path).read_text(encoding="utf-8"))
    if not isinstance(content, dict):
        raise ValueError(f"{path} is not a summary: expected a JSON object, got {type(content).__name__}.")
    return {key: restored(value) for key, value in content.items()}
