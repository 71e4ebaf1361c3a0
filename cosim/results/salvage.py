"""Salvage: what a run had computed becomes a result when its process is gone. Touches the folders it is given."""

from __future__ import annotations

import shutil
from collections.abc import Mapping
from contextlib import suppress
from itertools import count
from pathlib import Path
from typing import Any

from cosim.errors import CosimError, OutputError
from cosim.results.block_file import BLOCK_FILE, read_block
from cosim.results.formats.growing_npy import growing_header, read_grown
from cosim.results.formats.known_formats import usual_file
from cosim.results.result_data import ResultData
from cosim.results.results_folder import SUMMARY, read_results, remove_report, write_results
from cosim.results.summary_file import read_summary, write_summary
from cosim.results.unfinished import DID_NOT_END, UNFINISHED


def salvage(note: Mapping[str, Any], reason: str) -> str:
    """Keep what was computed.

    Args:
        note: ``fallback``: the folder that was streamed to; ``out``: that of the results, perhaps the same; ``formats``
            of its table. reason: why the run ended.

    Returns:
        What to say to the user.
    """
    fallback, out = Path(note["fallback"]), Path(note["out"])
    try:
        result = salvaged(fallback, reason)
        if result is None:
            return "Nothing had been computed yet."
        if fallback != out:
            write_results(result, out, note["formats"])
            remove_report(out)
            shutil.rmtree(out / "made_from", ignore_errors=True)
    except (CosimError, OSError, ValueError) as error:
        return f"What was computed could not be brought to {out}: {error} It is in {fallback}."
    finally:
        if fallback != out and not (fallback / SUMMARY).exists():
            shutil.rmtree(fallback, ignore_errors=True)
    if fallback != out:
        shutil.rmtree(fallback, ignore_errors=True)
    return f"What was computed is kept: {len(result.table)} rows in {out}. To see it: cosim report {out}"


def salvaged(folder: Path, reason: str) -> ResultData | None:
    """What was recorded in a folder that was streamed to; None where nothing had been.

    Args:
        folder: in which the rows are made a whole table. reason: why the run ended.

    Raises:
        CosimError, OSError, ValueError: a file cannot be read or written, or is none of a stream.
    """
    if not (folder / SUMMARY).exists() or not (folder / usual_file("npy")).exists():
        return None
    _close_unfinished(folder, reason)
    return read_results(folder)


def rescue(directory: Path) -> str:
    """Move what an earlier run left that was ended together with whoever watched it, into a results folder of its own.

    Args:
        directory: results folder, to which nobody writes at present.

    Returns:
        What to say to the user; empty where nothing was left.
    """
    left = directory / UNFINISHED
    try:
        rows = left_rows(directory)
        if not rows:
            return ""
        kept = next(p for k in count(1) if not (p := directory.with_name(f"{directory.name}-unfinished-{k}")).exists())
        left.rename(kept)
        _close_unfinished(kept, "its program was ended from outside")
    except (CosimError, OSError, ValueError) as error:
        return f"What an earlier run left in {left} cannot be read, and is replaced: {error}"
    return f"An earlier run to {directory} was ended from outside: its {rows} rows are kept in {kept}."


def left_rows(directory: Path) -> int:
    """How many rows a run left in a results folder that were not written as results; where there are none, what else it
    left goes.

    Args:
        directory: results folder, to which nobody writes at present.
    """
    left, rows = directory / UNFINISHED, 0
    with suppress(OutputError):  # it had no table yet
        rows = len(read_results(left).table)
    if not rows:
        shutil.rmtree(left, ignore_errors=True)
    return rows


def _close_unfinished(folder: Path, reason: str) -> None:
    """Bring the rows of the block into the table of a folder that was streamed to, and say why the run ended.

    Raises:
        OSError, ValueError: a file cannot be read or written, or is none of a stream.
    """
    table, block = folder / usual_file("npy"), folder / BLOCK_FILE
    if block.exists():
        rows = read_grown(table)
        new = read_block(block).after(len(rows), rows.dtype)
        count, dtype = len(rows) + len(new), rows.dtype
        del rows
        with table.open("r+b") as file:
            start = len(growing_header(dtype, 0))
            file.seek(start + (count - len(new)) * dtype.itemsize)
            file.write(new.tobytes())
            file.truncate(start + count * dtype.itemsize)
            file.seek(0)
            file.write(growing_header(dtype, count))
        block.unlink()
    content = dict(read_summary(folder / SUMMARY))
    content["failure"] = f"{DID_NOT_END}: {reason}. The rows are those recorded until then."
    write_summary(folder / SUMMARY, content)
