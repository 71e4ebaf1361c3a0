"""The layout every table of a result has: float64 columns, the first one ``time``. Imports NumPy only."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np


def table_dtype(names: Sequence[str]) -> np.dtype[np.void]:
    """Type of a table with these columns.

    Args:
        names: column names, ``time`` first.

    Returns:
        A structured type with one float64 field for each name.
    """
    return np.dtype([(name, np.float64) for name in names])


def table_of(names: Sequence[str], columns: Sequence[np.ndarray]) -> np.ndarray:
    """A table of columns.

    Args:
        names: column names, ``time`` first. columns: their values, shape (rows,) or (rows, 1) each.
    """
    table = np.empty(np.size(columns[0]), table_dtype(names))
    for name, column in zip(names, columns, strict=True):
        table[name] = np.ravel(column)
    return table


def column_names(table: np.ndarray) -> tuple[str, ...]:
    """Names of the columns of a table, checked.

    Args:
        table: structured array, shape (rows,).

    Returns:
        The names, ``time`` first.

    Raises:
        ValueError: `table` is not a result table; the message names the first offence.
    """
    names = table.dtype.names
    if not names or names[0] != "time" or table.ndim != 1:
        raise ValueError(
            f"A result table is a structured array of shape (rows,) whose first field is 'time'; got {table.dtype}."
        )
    for name in names:
        if table.dtype[name] != np.float64:
            raise ValueError(f"Column {name!r} of a result table must be float64; got {table.dtype[name]}.")
    return names
