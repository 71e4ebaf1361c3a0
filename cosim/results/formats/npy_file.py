"""Tables as they are in memory, in NumPy's own format: for runs whose CSV would be larger and slower than the run
itself.

Touches only the file it is given. ``numpy.load(path, mmap_mode="r")`` opens it without reading it.
"""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np

from cosim.results.formats.format import Format, bare
from cosim.results.result_data import ResultData
from cosim.results.table_layout import column_names

HEADER = 1 << 26  # bytes; thousands of names need more than NumPy allows unasked


def _write_npy(path: str | Path, table: np.ndarray) -> None:
    """Write a result table; a table that is a map of a file is not loaded for it.

    Args:
        path: file to write. table: structured array, shape (rows,), float64 fields, ``time`` first.

    Raises:
        ValueError: `table` is not a result table.
        OSError: the file cannot be written.
    """
    column_names(table)
    if _is_there(Path(path), table):
        return
    with Path(path).open("wb") as file:
        np.lib.format.write_array(file, table, version=(3, 0), allow_pickle=False)


def _is_there(path: Path, table: np.ndarray) -> bool:
    """If the table is the whole of a file in the same folder, or in the one above, which needs no copy: a run streamed
    it.
    """
    source = getattr(table, "filename", None)
    if (
        source is None
        or table.flags.writeable
        or Path(source).parent not in (path.absolute().parent, path.absolute().parent.parent)
    ):
        return False
    try:
        whole = np.load(source, mmap_mode="r", allow_pickle=False)
        if whole.dtype != table.dtype or whole.shape != table.shape or whole.strides != table.strides:
            return False
        os.link(source, path)
    except (OSError, ValueError):
        return False
    return True


def _read_npy(path: str | Path) -> np.ndarray:
    """Read a table written by `_write_npy`; it stays in the file, whose pages are read when they are looked at.

    Raises:
        ValueError: the file is not such a table.
        OSError: the file cannot be read.
    """
    try:
        table: np.ndarray = np.load(path, mmap_mode="r", allow_pickle=False, max_header_size=HEADER)
        column_names(table)
    except (EOFError, ValueError) as error:
        raise ValueError(f"{path} is not a result table: {error}") from error
    return table


class NpyFormat(Format):
    """NumPy's own."""

    name = "npy"
    endings = (".npy",)
    keeps = False
    speed = 3

    @staticmethod
    def write(path: Path, result: ResultData) -> None:  # noqa: D102 - see Format
        _write_npy(path, result.table)

    @staticmethod
    def read(path: Path) -> ResultData:  # noqa: D102 - see Format
        return bare(_read_npy, path)
