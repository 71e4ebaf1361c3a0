"""Tables as they are in memory, in NumPy's own format: for runs whose CSV would be larger and slower than the run
itself.

Touches only the file it is given. ``numpy.load(path, mmap_mode="r")`` opens it without reading it.
"""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import numpy as np

from cosim.errors import OutputError
from cosim.results.formats.columns import result_of_columns
from cosim.results.formats.format import Format, bare
from cosim.results.result_data import ResultData
from cosim.results.table_layout import column_names

_HEADER = 1 << 26  # bytes; thousands of names need more than NumPy allows unasked


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


def read_foreign_npy(path: Path) -> ResultData:
    """Read a structured array with a field ``time``; one of ours stays in the file, whose pages are read when looked
    at.

    Args:
        path: the file.

    Raises:
        OutputError: it is another kind of array. ValueError: the file is broken. OSError: it cannot be read.
    """
    table: np.ndarray = np.load(path, mmap_mode="r", allow_pickle=False, max_header_size=_HEADER)
    names = table.dtype.names
    if not names or table.ndim != 1:
        found = f"shape {table.shape} and type {table.dtype}"
        raise OutputError(f"{path}: expected a structured array of shape (rows,) with a field 'time', got {found}.")
    kinds: list[np.dtype[Any]] = [table.dtype[name] for name in names]
    if names[0] == "time" and all(kind == np.float64 for kind in kinds):
        return bare(table)
    fields: list[str] = []
    columns: list[np.ndarray] = []
    for field, kind in zip(names, kinds, strict=True):
        if kind.base.kind not in "biuf":
            raise OutputError(f"{path}: field {field!r} must hold numbers, got {kind}. Leave it out.")
        values = np.asarray(table[field]).reshape(len(table), -1)
        fields += [field] if kind.shape == () else [f"{field}[{i + 1}]" for i in range(values.shape[1])]
        columns += list(values.T)
    return result_of_columns(str(path), fields, columns, {})


class NpyFormat(Format):
    """NumPy's own."""

    name = "npy"
    endings = (".npy",)
    keeps = False
    speed = 3

    @staticmethod
    def write(path: Path, result: ResultData) -> None:  # noqa: D102 - see Format
        column_names(result.table)
        if _is_there(path, result.table):
            return
        with path.open("wb") as file:
            np.lib.format.write_array(file, result.table, version=(3, 0), allow_pickle=False)

    @staticmethod
    def read(path: Path) -> ResultData:  # noqa: D102 - see Format
        try:
            return bare(np.load(path, mmap_mode="r", allow_pickle=False, max_header_size=_HEADER))
        except (EOFError, ValueError) as error:
            raise ValueError(f"{path} is not a result table: {error}") from error
