"""One result as one file, in the format that its name asks for. Touches only that file, and the telegrams beside it."""

from __future__ import annotations

from pathlib import Path

from cosim.errors import OutputError
from cosim.results.formats.csv_file import write_csv
from cosim.results.formats.format import Format
from cosim.results.formats.known_formats import check_formats, format_of
from cosim.results.record_rows import EVENTS_SUFFIX, TELEGRAM_ROWS
from cosim.results.result_data import ResultData


def save_result(result: ResultData, path: str | Path, *, units: bool = True) -> list[Path]:
    """Write a result as one file; what was there is replaced when the new one is complete.

    Args:
        result: what to write.
        path: the file. Its ending says the format: ``.csv``, ``.mat``, ``.modelica.mat``, ``.npy``, ``.parquet``,
            ``.h5``.
        units: whether the headings of CSV name units, as in ``train.speed [m/s]``; `cosim.load_result` takes them off
            again.

    Returns:
        The files written: `path` and, beside a CSV or NumPy file, ``NAME.events.csv`` where there are telegrams.

    Raises:
        OutputError: the ending is unknown, a package is missing, or the file cannot be written; the former file is then
        whole.
    """
    target = Path(path)
    wanted = format_of(target)
    check_formats([wanted.name])
    scratch = target.with_name(f".writing-{target.name}")
    try:
        try:
            _write(result, scratch, wanted, units)
            scratch.replace(target)
        finally:
            scratch.unlink(missing_ok=True)
        return [target, *_events_beside(result, target, wanted)]
    except ValueError as error:
        raise OutputError(f"{target} cannot be written: {error}") from error
    except OutputError:
        raise
    except OSError as error:
        raise OutputError(f"{target} cannot be written: {error.strerror or error}. Choose another place.") from error


def _write(result: ResultData, path: Path, wanted: type[Format], units: bool) -> None:
    if wanted.name == "csv" and not units:
        write_csv(path, result.table)
    else:
        wanted.write(path, result)


def _events_beside(result: ResultData, target: Path, wanted: type[Format]) -> list[Path]:
    """Telegrams of a format without room for them; a file that is there already would otherwise be taken for theirs."""
    beside = target.with_name(target.with_suffix("").name + EVENTS_SUFFIX)
    if wanted.keeps or not (result.events or beside.exists()):
        return []
    TELEGRAM_ROWS.write(beside, result.events)
    return [beside]
