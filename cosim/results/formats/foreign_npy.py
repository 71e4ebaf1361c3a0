"""Structured arrays of NumPy files as results: ours as they are, others as columns. Only reads the file it is given."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from cosim.errors import OutputError
from cosim.results.formats.columns import result_of_columns
from cosim.results.formats.npy_file import HEADER
from cosim.results.result_data import ResultData, SignalInfo


def read_foreign_npy(path: Path) -> ResultData:
    """Read a structured array with a field ``time``; one of ours stays in the file, whose pages are read when looked
    at.

    Args:
        path: the file.

    Raises:
        OutputError: it is another kind of array. ValueError: the file is broken. OSError: it cannot be read.
    """
    table: np.ndarray = np.load(path, mmap_mode="r", allow_pickle=False, max_header_size=HEADER)
    names = table.dtype.names
    if not names or table.ndim != 1:
        found = f"shape {table.shape} and type {table.dtype}"
        raise OutputError(f"{path}: expected a structured array of shape (rows,) with a field 'time', got {found}.")
    kinds: list[np.dtype[Any]] = [table.dtype[name] for name in names]
    if names[0] == "time" and all(kind == np.float64 for kind in kinds):
        return ResultData(table, [SignalInfo(name) for name in names[1:]])
    fields: list[str] = []
    columns: list[np.ndarray] = []
    for field, kind in zip(names, kinds, strict=True):
        if kind.base.kind not in "biuf":
            raise OutputError(f"{path}: field {field!r} must hold numbers, got {kind}. Leave it out.")
        values = np.asarray(table[field]).reshape(len(table), -1)
        fields += [field] if kind.shape == () else [f"{field}[{i + 1}]" for i in range(values.shape[1])]
        columns += list(values.T)
    return result_of_columns(str(path), fields, columns, {})
