"""What a format of result tables is: a name, file endings, a writer and a reader."""

from __future__ import annotations

from abc import ABC, abstractmethod
from pathlib import Path
from typing import ClassVar

import numpy as np

from cosim.results.result_data import ResultData, SignalInfo
from cosim.results.table_layout import column_names


class Format(ABC):
    """A format. A class of it in a file of this room is a format that can be asked for by its name.

    Attributes:
        name: in scenarios. endings: of file names, the usual one first.
        keeps: whether units, telegrams and summary are in the file, beside the table.
        speed: the larger, the sooner it is read where a folder holds several; CSV has 0.
        package: which package it needs, if one is; None for none.
    """

    name: ClassVar[str]
    endings: ClassVar[tuple[str, ...]]
    keeps: ClassVar[bool] = True
    speed: ClassVar[int] = -1
    package: ClassVar[str | None] = None

    @staticmethod
    @abstractmethod
    def write(path: Path, result: ResultData) -> None:
        """Write a result.

        Args:
            path: of the file. result: what to write.
        """

    @staticmethod
    @abstractmethod
    def read(path: Path) -> ResultData:
        """Read what `write` wrote, bit by bit.

        Args:
            path: of the file.
        """


def bare(table: np.ndarray) -> ResultData:
    """The result of a file that holds nothing but a table.

    Args:
        table: of a result.
    """
    return ResultData(table, [SignalInfo(name) for name in column_names(table)[1:]])
