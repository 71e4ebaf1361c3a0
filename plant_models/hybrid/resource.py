"""Resources: vector parameters whose start values lie in a file that travels with a model.

Standard library only; it reads and writes no files.
"""

from __future__ import annotations

from dataclasses import dataclass

UNUSED_ENTRY = 1e30
"""What an entry of the vector holds where the file has no row for it."""


@dataclass(frozen=True, slots=True)
class Resource:
    """A vector parameter that an exported model reads from a column of a CSV file at instantiation.

    The file has a header; the column's numbers increase from row to row. Entries of the vector without a row get
    `UNUSED_ENTRY`. Where the file is missing the start values stand.

    Args:
        parameter: name of the vector parameter.
        file: name of the file in the folder ``resources``.
        column: name of the column.
    """

    parameter: str
    file: str
    column: str
