"""Load a result from wherever it is kept: a results folder, a table of ours or of another tool. Only reads."""

from __future__ import annotations

import logging
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

from cosim.errors import OutputError
from cosim.results.formats.columns import TEXTS, check_time
from cosim.results.formats.foreign_csv import read_foreign_csv
from cosim.results.formats.foreign_mat import read_foreign_mat
from cosim.results.formats.known_formats import FORMATS, fastest_first, table_files
from cosim.results.formats.npy_file import read_foreign_npy
from cosim.results.record_rows import EVENTS_SUFFIX, TELEGRAM_ROWS
from cosim.results.result import Result
from cosim.results.result_data import ResultData
from cosim.results.results_folder import SUMMARY, read_results
from cosim.results.unfinished import UNFINISHED
from fmus.near_files import near_files

LOG = logging.getLogger(__name__)

_NO_RESULTS = {
    ".toml": "a scenario, which 'cosim run' runs",
    ".ssp": "a scenario, which 'cosim run' runs",
    ".fmu": "an FMU",
}
"""What files are that are taken for results, by their endings."""


def load_result(path: str | Path, *, texts: bool = False) -> Result:
    """A result from a folder or a file; what kind of file it is is seen from what it holds.

    Args:
        path: a results folder, one of the tables in it (units, telegrams and summary are then taken from the folder),
            or a table by itself: CSV of ours, of fmpy, OpenModelica, Dymola, FMI-LS-REF or a spreadsheet; MATLAB;
            Modelica trajectories (MAT, version 4); NumPy; Parquet; HDF5. Beside ``NAME.csv`` and ``NAME.npy``,
            telegrams are read from ``NAME.events.csv`` where it exists.
        texts: whether a table may hold columns of texts; they become 1, 2, ... in the order in which they first stand,
            and ``summary["texts"]`` has them by column.

    Returns:
        The result in SI units. ``summary["file"]`` and ``summary["events_recorded"]`` say where a single table came
        from and whether telegrams were kept with it.

    Raises:
        OutputError: nothing is there, or it cannot be read; the message names the file and the line, and what was
        expected.
    """
    source = Path(path)
    if source.is_dir():
        return Result.of(_folder(source))
    if not source.exists():
        raise OutputError(f"There is no {source}; {near_files(source)}")
    if source.suffix.lower() in _NO_RESULTS:
        raise OutputError(f"{source} is {_NO_RESULTS[source.suffix.lower()]}; expected a results folder or a table.")
    folder = source.parent
    if source.name in table_files().values() and (folder / SUMMARY).is_file():
        return Result.of(read_results(folder, table=source.name))
    try:
        result = _reader(source, texts)(source)
        _refuse_texts(source, {} if texts else result.summary.get(TEXTS, {}))
        check_time(str(source), result.table["time"])
        return Result.of(_with_events(result, source))
    except OutputError:
        raise
    except OSError as error:
        raise OutputError(f"{source} cannot be read: {error.strerror or error}.") from error
    except Exception as error:  # whatever a broken file leads the libraries into that read it
        raise OutputError(_named(source, str(error) or type(error).__name__)) from error


def _named(source: Path, text: str) -> str:
    """What a library says, with the name of the file."""
    return text if str(source) in text else f"{source} cannot be read: {text}."


def _folder(folder: Path) -> ResultData:
    left = folder / UNFINISHED
    if (folder / SUMMARY).is_file():
        if (left / SUMMARY).is_file():
            LOG.warning("%s: these are former results; a later run that has not ended is in %s.", folder, left)
        return read_results(folder)
    if (left / SUMMARY).is_file():
        return read_results(left)
    tables = [name for name in table_files().values() if (folder / name).is_file()]
    if tables:
        raise OutputError(
            f"{folder} is not a results folder: {SUMMARY} is missing. For the table alone: {folder / tables[0]}."
        )
    raise OutputError(f"{folder} is not a results folder: it holds neither {SUMMARY} nor a table. {_holds(folder)}")


def _holds(folder: Path) -> str:
    names = sorted(p.name for p in folder.iterdir() if not p.name.startswith("."))
    below = [name for name in names if (folder / name / SUMMARY).is_file()]
    if below:
        return f"Results are in: {', '.join(str(folder / name) for name in below[:5])}."
    return f"It holds: {', '.join(names[:8])}{', ...' if len(names) > 8 else ''}." if names else "It is empty."


def _refuse_texts(source: Path, found: Mapping[str, Sequence[str]]) -> None:
    for name, texts in found.items():
        raise OutputError(f"{source}: column {name!r} must hold numbers, got {texts[0]!r}. Leave it out.")


def _reader(path: Path, texts: bool) -> Callable[[Path], ResultData]:
    """Who reads a file, by its first bytes."""
    with path.open("rb") as file:
        start = file.read(16)
    if not start:
        raise OutputError(f"{path} is empty: expected a table with a column 'time'.")
    if start.startswith(b"\x93NUMPY"):
        return read_foreign_npy
    if start.startswith(b"PAR1"):
        return FORMATS["parquet"].read
    if start.startswith((b"\x89HDF", b"MATLAB 7.3")):
        return FORMATS["hdf5"].read
    if start.startswith(b"MATLAB") or path.suffix.lower() == ".mat":
        return partial(read_foreign_mat, texts=texts)
    if start.startswith((b"PK\x03\x04", b"\x1f\x8b")):
        raise OutputError(
            f"{path} is an archive (FMU, spreadsheet, zip or gzip), not a table. Unpack it, or export it as CSV."
        )
    named = [item for item in fastest_first() if item.name != "csv" and path.name.lower().endswith(item.endings)]
    return named[0].read if named else partial(read_foreign_csv, texts=texts)


def _with_events(result: ResultData, source: Path) -> ResultData:
    """The telegrams of a file without room for them, from the one beside it."""
    recorded = bool(result.summary.get("events_recorded"))
    beside = source.with_name(source.with_suffix("").name + EVENTS_SUFFIX)
    if "events_recorded" not in result.summary and beside.is_file():
        result, recorded = replace(result, events=TELEGRAM_ROWS.read(beside)), True
    return replace(result, summary={**result.summary, "file": str(source), "events_recorded": recorded})
