"""Reading what is left of a run that was streamed and did not end. Touches only the files it is given."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from cosim.diagnostics.messages import read_messages
from cosim.results.block_file import BLOCK_FILE, read_block
from cosim.results.formats.growing_npy import read_grown
from cosim.results.record_rows import PACKET_ROWS, TELEGRAM_ROWS, Record, RecordRows
from cosim.results.result_data import ResultData, SignalInfo

SPARE = ".unfinished"
"""The folder, within that of the results, to which a run is streamed in case its process dies."""

DID_NOT_END = "the run did not end"
EXPLAINED = (
    f"{DID_NOT_END}: it is still going on, or its program was stopped from outside or taken along by an FMU. The rows "
    "are those written until then."
)


def read_unfinished(table: Path, events: Path, messages: Path, packets: Path, content: dict[str, Any]) -> ResultData:
    """Everything that was whole when the program died.

    Args:
        table, events, messages, packets: the files; the last two may be missing.
        content: of ``summary.json``; how far the run came is added to it.

    Raises:
        ValueError: a file is not what a stream writes. OSError: it cannot be read.
    """
    rows = _all_rows(table)
    reached = float(rows["time"][-1]) if len(rows) else None
    content["summary"] |= {"reached": reached, "rows": len(rows)}
    content["failure"] = f"{content['failure']} They " + (
        "are none." if reached is None else f"end at t = {reached:g} s."
    )
    signals = [SignalInfo(**signal) for signal in content["signals"]]
    logged = read_messages(messages) if messages.exists() else []
    sent = _whole_lines(packets, PACKET_ROWS) if packets.exists() else []
    return ResultData(rows, signals, _whole_lines(events, TELEGRAM_ROWS), messages=logged, packets=sent)


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
