"""Values in the types that TOML has. Standard library only."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any


def plain(value: Any) -> Any:
    """The value in the types that TOML has: NumPy's numbers and arrays, tuples and paths become numbers, lists and
    texts.

    Args:
        value: any nesting of mappings and sequences; entries that are None are left out.
    """
    if isinstance(value, Mapping):
        return {str(key): plain(entry) for key, entry in value.items() if entry is not None}
    if hasattr(value, "tolist"):  # of NumPy, which is not loaded for this
        return value.tolist()
    if isinstance(value, list | tuple):
        return [plain(entry) for entry in value]
    return str(value) if isinstance(value, Path) else value
