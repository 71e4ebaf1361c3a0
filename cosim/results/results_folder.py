"""A result as a folder of files: table, events, messages, summary. Touches only the folder it is given.

All files are written to a hidden folder beside their places first and moved there when they are complete: a full disk
or a stopped program leaves the former files whole.
"""

from __future__ import annotations

import hashlib
import tempfile
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from pydantic import TypeAdapter, ValidationError

from cosim.diagnostics.messages import read_messages, write_messages
from cosim.errors import OutputError, not_utf8
from cosim.results.block_file import BLOCK_FILE, read_block
from cosim.results.formats.columns import check_time
from cosim.results.formats.growing_npy import read_grown
from cosim.results.formats.known_formats import FORMATS, check_formats, fastest_first, table_files, usual_file
from cosim.results.record_rows import PACKET_ROWS, TELEGRAM_ROWS, Record, RecordRows
from cosim.results.result_data import ResultData, SignalInfo
from cosim.results.summary_file import first_wrong, read_summary, write_summary
from plant_models.left_behind import owned
from plant_models.missing_package import is_installed

EVENTS, MESSAGES, SUMMARY = "events.csv", "messages.csv", "summary.json"
PACKETS = "packets.csv"  # of runs with a network
REPORT, FIGURES = "report.html", "figures"
LAYOUT = 1  # version of the layout of summary.json
_Part = TypeVar("_Part")


@dataclass(frozen=True)
class _Shape:
    """What is relied on of the summary; there may be more."""

    signals: list[SignalInfo]
    summary: dict[str, Any]
    failure: str | None
    ended: bool = True


_SHAPE = TypeAdapter(_Shape)


def remove_report(directory: str | Path, keep: Collection[Path] = ()) -> None:
    """Remove the page and the pictures of an earlier run, which would not speak of these results.

    Args:
        directory: the results folder. keep: pictures that are of this run.
    """
    folder = Path(directory)
    (folder / REPORT).unlink(missing_ok=True)
    for picture in (folder / FIGURES).glob("*.*"):
        if picture.suffix in (".png", ".svg") and picture not in keep:
            picture.unlink(missing_ok=True)


def results_digest(directory: str | Path) -> str:
    """What distinguishes the results in a folder from others, whatever the dates of the files: a hash of their names
    and contents.

    Args:
        directory: the results folder.

    Raises:
        OSError: a file cannot be read.
    """
    whole = hashlib.sha256()
    for name in sorted((*table_files().values(), EVENTS, MESSAGES, PACKETS, SUMMARY)):
        path = Path(directory) / name
        if path.is_file():
            with path.open("rb") as file:
                whole.update(f"{name} {hashlib.file_digest(file, 'sha256').hexdigest()}\n".encode())
    return whole.hexdigest()


def check_writable(directory: str | Path, formats: Sequence[str] = ()) -> Path:
    """Make sure, before a run, that results can be written to a folder; it is created where it does not exist.

    Args:
        directory: the folder.
        formats: formats of the table to be written; the packages they need must be there.

    Returns:
        The folder.

    Raises:
        OutputError: it cannot be created or written, or a format not be written; the message says why and what to do.
    """
    check_formats(formats)
    folder = Path(directory)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder) as file:
            file.write(b"results")
    except OSError as error:
        raise OutputError(
            f"Results cannot be written to {folder}: {_reason(error)}. Choose another output folder."
        ) from error
    for name in (*table_files().values(), EVENTS, MESSAGES, PACKETS, SUMMARY):
        if (folder / name).is_dir():
            raise OutputError(
                f"Results cannot be written to {folder}: {name} is a folder there. Choose another output folder."
            )
    return folder


def _reason(error: OSError) -> str:
    return f"{error.strerror or error}" + (f" ({error.filename})" if error.filename else "")


def _write_all(result: ResultData, folder: Path, formats: Sequence[str]) -> list[str]:
    for name in formats:
        FORMATS[name].write(folder / usual_file(name), result)
    TELEGRAM_ROWS.write(folder / EVENTS, result.events)
    write_messages(folder / MESSAGES, result.messages)
    content = {"layout": LAYOUT, "failure": result.failure, "signals": list(result.signals), "summary": result.summary}
    write_summary(folder / SUMMARY, content)
    if result.packets:
        PACKET_ROWS.write(folder / PACKETS, result.packets)
    packets = [PACKETS] if result.packets else []
    return [*(usual_file(name) for name in dict.fromkeys(formats)), EVENTS, MESSAGES, *packets, SUMMARY]


def write_results(result: ResultData, directory: str | Path, formats: Sequence[str] = ("csv",)) -> dict[str, Path]:
    """Write a result to a folder, replacing what an earlier run left there.

    Args:
        result: what to write.
        directory: the folder; created where it does not exist.
        formats: formats of the table, any of ``csv``, ``mat``, ``npy``, ``parquet``, ``hdf5`` and ``modelica``. A table
            that an earlier run left in another format is removed, since it would not belong to the other files.

    Returns:
        Paths by what they hold: the formats, ``events``, ``messages``, ``summary``, and ``packets`` where there is a
        network.

    Raises:
        OutputError: a format is unknown or lacks a package, or a file cannot be written; former files are then still
        whole.
    """
    check_formats(formats)
    folder = check_writable(directory)
    try:
        with tempfile.TemporaryDirectory(dir=folder, prefix=owned(".writing-", folder)) as scratch:
            for name in _write_all(result, Path(scratch), formats):
                (Path(scratch) / name).replace(folder / name)
        for stale in set(table_files()) - set(formats):
            (folder / usual_file(stale)).unlink(missing_ok=True)
        if not result.packets:
            (folder / PACKETS).unlink(missing_ok=True)
        (folder / BLOCK_FILE).unlink(missing_ok=True)  # of a stream whose program was killed
    except OSError as error:
        hint = "Free the disk, or close the program that has the file open."
        raise OutputError(f"Results could not be written to {folder}: {_reason(error)}. {hint}") from error
    names = {name: usual_file(name) for name in dict.fromkeys(formats)} | {"events": EVENTS, "messages": MESSAGES}
    names |= ({"packets": PACKETS} if result.packets else {}) | {"summary": SUMMARY}
    return {kind: folder / name for kind, name in names.items()}


def _part(path: Path, read: Callable[[Path], _Part]) -> _Part:
    """What a file of the folder holds; what is wrong with it is said with its name, and the line that is no text."""
    try:
        return read(path)
    except UnicodeDecodeError:
        raise ValueError(f"{path.name}: {not_utf8(path.read_bytes())}") from None
    except ValueError as error:
        said = first_wrong(error) if isinstance(error, ValidationError) else str(error).removesuffix(".")
        raise ValueError(said if path.name in said else f"{path.name}: {said}") from error


def _table(folder: Path, name: str | None, signals: Sequence[SignalInfo]) -> np.ndarray:
    """The table of a folder with these signals, from the file with that name or from the one that is read fastest."""
    present = [item for item in fastest_first() if (folder / usual_file(item.name)).exists()]
    named = [item for item in fastest_first() if usual_file(item.name) == name]
    readable = [item for item in present if item.package is None or is_installed(item.package)]
    chosen = next(iter([*named, *readable, *present]), FORMATS["csv"])
    path = folder / usual_file(chosen.name)
    table = _part(path, chosen.read).table
    check_time(str(path), table["time"])
    lost = [signal.name for signal in signals if signal.name not in (table.dtype.names or ())]
    if lost:
        raise ValueError(f"{SUMMARY} speaks of signal {lost[0]!r}, which {path.name} does not have")
    return table


def _stated(path: Path) -> dict[str, Any]:
    """The summary with all that is relied on."""
    content = read_summary(path)
    if content.get("layout") != LAYOUT:
        raise ValueError(f"it has layout {content.get('layout')!r}, this version reads layout {LAYOUT}")
    return {**content, "signals": _SHAPE.validate_python(content).signals}


def _read(folder: Path, table_name: str | None = None) -> tuple[ResultData, Mapping[str, Any]]:
    content = _part(folder / SUMMARY, _stated)
    if not content.get("ended", True):  # it was streamed here, and its program died
        rows, events, logged, sent = (folder / name for name in (usual_file("npy"), EVENTS, MESSAGES, PACKETS))
        return _read_unfinished(rows, events, logged, sent, content), content
    table = _table(folder, table_name, content["signals"])
    logged, sent = folder / MESSAGES, folder / PACKETS
    messages = _part(logged, read_messages) if logged.exists() else []  # older results have none
    packets = _part(sent, PACKET_ROWS.read) if sent.exists() else []
    telegrams = _part(folder / EVENTS, TELEGRAM_ROWS.read)
    return ResultData(table, content["signals"], telegrams, messages=messages, packets=packets), content


def read_results(directory: str | Path, table: str | None = None) -> ResultData:
    """Read the result that `write_results` left in a folder.

    Args:
        directory: the folder.
        table: name of the file to take the table from, where there are several; all hold the same.

    Returns:
        The result: table and events bit by bit; in the summary NaN has become None and tuples have become lists.

    Raises:
        OutputError: a file is missing or is not what `write_results` writes; the message names it.
    """
    folder = Path(directory)
    try:
        result, content = _read(folder, table)
        return replace(result, summary=content["summary"], failure=content["failure"])
    except OutputError:
        raise
    except OSError as error:
        raise OutputError(f"No complete result in {folder}: {_reason(error)}. Run the scenario again.") from error
    except (KeyError, TypeError, ValueError) as error:
        raise OutputError(
            f"The result in {folder} cannot be read: {str(error).removesuffix('.')}. Run the scenario again."
        ) from error


def _read_unfinished(table: Path, events: Path, messages: Path, packets: Path, content: dict[str, Any]) -> ResultData:
    """Everything that was whole when the program died."""
    rows = _all_rows(table)
    reached = float(rows["time"][-1]) if len(rows) else None
    content["summary"] |= {"reached": reached, "rows": len(rows)}
    content["failure"] = f"{content['failure']} They " + (
        "are none." if reached is None else f"end at t = {reached:g} s."
    )
    logged = _part(messages, read_messages) if messages.exists() else []
    sent = _whole_lines(packets, PACKET_ROWS) if packets.exists() else []
    return ResultData(rows, content["signals"], _whole_lines(events, TELEGRAM_ROWS), messages=logged, packets=sent)


def _all_rows(table: Path) -> np.ndarray:
    """The rows of the table and those of the block, which may be on their way from one to the other while this is
    read.
    """
    path = table.with_name(BLOCK_FILE)
    block = read_block(path) if path.exists() else None
    rows = read_grown(table)
    if block is None:
        return rows
    new = block.after(len(rows), rows.dtype)
    return np.concatenate([rows, new]) if len(new) else rows


def _whole_lines(path: Path, rows: RecordRows[Record]) -> list[Record]:
    """The telegrams or packets but for a last line that was not written to its end."""
    content = path.read_bytes()
    if content.endswith(b"\n") or b"\n" not in content:
        return rows.read(path)
    with tempfile.TemporaryDirectory() as scratch:
        whole = Path(scratch) / path.name
        whole.write_bytes(content[: content.rindex(b"\n") + 1])
        return rows.read(whole)
