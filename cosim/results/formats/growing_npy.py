"""NumPy files that grow: a header with room for any number of rows, and reading what a run left that did not end.

Imports NumPy only; touches only the file it is given.
"""

from __future__ import annotations

import ast
from pathlib import Path

import numpy as np

from cosim.results.table_layout import column_names

MAGIC = b"\x93NUMPY\x03\x00"
DIGITS = 21  # room that NumPy leaves for the number of rows
CHUNK = 65536


def growing_header(dtype: np.dtype[np.void], rows: int) -> bytes:
    """The first bytes of a NumPy file (format 3.0), as NumPy itself writes them; of the same length for any number of
    rows.

    Args:
        dtype: of a row. rows: how many there are.
    """
    shape = f"({rows},)"
    text = f"{{'descr': {np.lib.format.dtype_to_descr(dtype)!r}, 'fortran_order': False, 'shape': {shape}, }}"
    content = text.encode() + b" " * (DIGITS - len(str(rows)))
    padding = 64 - (len(MAGIC) + 4 + len(content) + 1) % 64
    content += b" " * padding + b"\n"
    return MAGIC + len(content).to_bytes(4, "little") + content


def read_grown(path: str | Path) -> np.ndarray:
    """The rows of a file that was written with `growing_header` and may be torn, as a map of the file, shape (rows,).

    Where the power failed the header may promise rows that never reached the disk: they are left out.

    Args:
        path: the file.

    Raises:
        ValueError: the file is not such a table. OSError: it cannot be read.
    """
    path = Path(path)
    with path.open("rb") as file:
        magic, size = file.read(len(MAGIC)), int.from_bytes(file.read(4), "little")
        header = file.read(size)
    if magic != MAGIC or len(header) < size:
        raise ValueError(f"{path} is not a result table: it does not begin as a NumPy file of format 3.0 does.")
    try:
        said = ast.literal_eval(header.decode())
        dtype, promised = np.dtype([tuple(field) for field in said["descr"]]), int(said["shape"][0])
    except (SyntaxError, ValueError, KeyError, TypeError, IndexError) as error:
        raise ValueError(f"{path} is not a result table: its header cannot be read: {error}") from error
    offset = len(MAGIC) + 4 + size
    rows = min(promised, (path.stat().st_size - offset) // dtype.itemsize)
    if rows < 1:
        return np.empty(0, dtype)
    table: np.ndarray = np.memmap(path, dtype=dtype, mode="r", offset=offset, shape=(rows,))
    column_names(table)
    return table[: _written(table)]


def _written(table: np.ndarray) -> int:
    """How many rows there are before those of which the disk holds nothing but zeros: time never goes back in a run."""
    if len(table) < 2 or any(table[-1].item()):
        return len(table)
    for start in range(1, len(table), CHUNK):
        time = table["time"][start - 1 : start + CHUNK]
        back = np.flatnonzero(np.diff(time) < 0.0)
        if len(back):
            return start + int(back[0])
    return len(table)
