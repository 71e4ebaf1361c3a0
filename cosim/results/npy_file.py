"""Tables as they are in memory, in NumPy's own format: for runs whose CSV would be larger and slower than the run itself.

Touches only the file it is given. ``numpy.load(path, mmap_mode="r")`` opens it without reading it.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from cosim.results.table_layout import column_names


def write_npy(path: str | Path, table: np.ndarray) -> None:
    """Write a result table; a table that is a map of a file is not loaded for it.

    Args:
        path: file to write. table: structured array, shape (rows,), float64 fields, ``time`` first.

    Raises:
        ValueError: `table` is not a result table.
        OSError: the file cannot be written.
    """
    column_names(table)
    with Path(path).open("wb") as file:
        np.lib.format.write_array(file, table, version=(3, 0), allow_pickle=False)


def read_npy(path: str | Path) -> np.ndarray:
    """Read a table written by `write_npy`; it stays in the file, whose pages are read when they are looked at.

    Raises:
        ValueError: the file is not such a table.
        OSError: the file cannot be read.
    """
    try:
        table: np.ndarray = np.load(path, mmap_mode="r", allow_pickle=False)
        column_names(table)
    except (EOFError, ValueError) as error:
        raise ValueError(f"{path} is not a result table: {error}") from error
    return table
