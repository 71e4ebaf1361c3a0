"""Summaries as JSON that any reader accepts. Touches only the file it is given.

JSON has no NaN and no infinity: NaN becomes ``null``, infinities become the texts ``"inf"`` and ``"-inf"``, which
`read_summary` turns back. Keys are sorted so that two summaries can be compared line by line.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from fmus.tables.plain_data import jsonable

_INFINITIES = {"inf": math.inf, "-inf": -math.inf}


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


def first_wrong(error: ValidationError) -> str:
    """What is wrong with a table that was read, in words: where, and what was expected.

    Args:
        error: of the check of its shape.
    """
    first = error.errors(include_url=False)[0]
    place = ".".join(map(str, first["loc"]))
    what = f"'{place}' is missing" if first["type"] == "missing" else f"{place}: {first['msg']}"
    return f"{what}; another program wrote it, or it was edited"
