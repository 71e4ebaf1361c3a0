"""Values as JSON's own types. Standard library only.

JSON has no NaN and no infinity: NaN becomes ``null``, infinities become the texts ``"inf"`` and ``"-inf"``.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, is_dataclass
from enum import Enum
from typing import Any


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
    elif hasattr(value, "tolist"):  # of NumPy, which is not loaded for this
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
