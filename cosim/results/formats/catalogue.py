"""The formats of result tables: names, file endings, who writes and who reads them. Packages are loaded where they are
used.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Any

from cosim.errors import OutputError, nearest
from cosim.results.data import ResultData, SignalInfo
from cosim.results.formats.csv_file import read_csv, write_csv
from cosim.results.formats.npy_file import read_npy, write_npy
from cosim.results.optional import is_installed


@dataclass(frozen=True, slots=True)
class Format:
    """One format.

    Args:
        name: in scenarios. endings: of file names, the usual one first.
        write: writes a result to a path. read: reads what `write` wrote, bit by bit.
        keeps: whether units, telegrams and summary are in the file, beside the table.
        package, extra: which package it needs, and the extra of ours that brings it; None for none.
    """

    name: str
    endings: tuple[str, ...]
    write: Callable[[Path, ResultData], None]
    read: Callable[[Path], ResultData]
    keeps: bool = True
    package: str | None = None
    extra: str | None = None


def _later(module: str, function: str) -> Callable[..., Any]:
    """A function of a module here that is loaded when it is first called."""

    def call(*arguments: Any) -> Any:
        return getattr(import_module(f"cosim.results.formats.{module}"), function)(*arguments)

    return call


def _bare(read: Callable[[Path], Any]) -> Callable[[Path], ResultData]:
    def result(path: Path) -> ResultData:
        table = read(path)
        return ResultData(table, [SignalInfo(name) for name in table.dtype.names[1:]])

    return result


FASTEST_FIRST = (
    Format("npy", (".npy",), lambda path, result: write_npy(path, result.table), _bare(read_npy), keeps=False),
    Format(
        "parquet",
        (".parquet", ".pq"),
        _later("parquet_file", "write_parquet"),
        _later("parquet_file", "read_parquet"),
        package="pyarrow",
        extra="parquet",
    ),
    Format(
        "hdf5",
        (".h5", ".hdf5"),
        _later("hdf5_file", "write_hdf5"),
        _later("hdf5_file", "read_hdf5"),
        package="h5py",
        extra="hdf5",
    ),
    Format("csv", (".csv",), lambda path, result: write_csv(path, result.table), _bare(read_csv), keeps=False),
    Format("mat", (".mat",), _later("mat_file", "write_mat"), _later("mat_file", "read_mat")),
    Format(
        "modelica",
        (".modelica.mat",),
        _later("modelica_file", "write_modelica"),
        _later("foreign_mat", "read_modelica"),
    ),
)
_BY_NAME = {item.name: item for item in FASTEST_FIRST}
FORMATS = {name: _BY_NAME[name] for name in ("csv", "mat", "npy", "parquet", "hdf5", "modelica")}


def check_formats(names: Iterable[str]) -> None:
    """Make sure, before a run, that these formats exist and that what they need is installed.

    Args:
        names: of the formats.

    Raises:
        OutputError: one does not, or lacks a package; the message says what to do.
    """
    for name in names:
        if name not in FORMATS:
            raise OutputError(f"Unknown result format {name!r}; {nearest(name, FORMATS)}")
        wanted = FORMATS[name]
        if wanted.package is not None and not is_installed(wanted.package):
            install = f"pip install 'fmu-observer[{wanted.extra}]'"
            raise OutputError(
                f"The result format {name!r} needs the package {wanted.package}: {install}, or choose another format."
            )


def format_of(path: Path) -> Format:
    """The format that the ending of a file name means.

    Args:
        path: the file.

    Raises:
        OutputError: none; the message lists the endings.
    """
    endings = {ending: item for item in FORMATS.values() for ending in item.endings}
    for ending in sorted(endings, key=len, reverse=True):
        if path.name.lower().endswith(ending):
            return endings[ending]
    raise OutputError(f"{path}: the format is told by the ending of the name, one of {', '.join(endings)}.")
