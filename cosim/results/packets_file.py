"""The packets of a run's network as CSV, one row each. Touches only the file it is given."""

from __future__ import annotations

import csv
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Literal

from cosim.results.events_file import outcomes_text, parse_outcomes, read_rows
from cosim.results.result_data import PacketRecord

Kind = Literal["sent", "lost", "duplicate"]
KINDS: Mapping[str, Kind] = {"sent": "sent", "lost": "lost", "duplicate": "duplicate"}
COLUMNS = ("stamp", "delivered_at", "node", "number", "kind", "values", "outcomes")


def packet_row(packet: PacketRecord) -> dict[str, str]:
    """One packet by column; values and outcomes as ``name=value;name=value``.

    Args:
        packet: of a run.
    """
    values = {name: repr(float(value)) for name, value in packet.values.items()}
    return {
        "stamp": repr(float(packet.stamp)),
        "delivered_at": repr(float(packet.delivered_at)),
        "node": packet.node,
        "number": str(packet.number),
        "kind": packet.kind,
        "values": outcomes_text(values),
        "outcomes": outcomes_text(packet.outcomes),
    }


def _packet_from_row(row: Mapping[str, str]) -> PacketRecord:
    """The packet of a row.

    Raises:
        ValueError: a number, the kind or an outcome cannot be read.
    """
    kind = KINDS.get(row["kind"])
    if kind is None:
        raise ValueError(f"kind {row['kind']!r} is none of: {', '.join(KINDS)}.")
    values = {name: float(text) for name, text in parse_outcomes(row["values"]).items()}
    stamp, delivered_at = float(row["stamp"]), float(row["delivered_at"])
    outcomes = parse_outcomes(row["outcomes"])
    return PacketRecord(stamp, delivered_at, row["node"], int(row["number"]), values, kind, outcomes)


def write_packets(path: str | Path, packets: Iterable[PacketRecord]) -> None:
    """Write packets as CSV, numbers to the last bit.

    Args:
        path: file to write. packets: in the order to be kept.

    Raises:
        OSError: the file cannot be written.
    """
    with Path(path).open("w", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(file, COLUMNS, lineterminator="\n")
        writer.writeheader()
        writer.writerows(packet_row(packet) for packet in packets)


def read_packets(path: str | Path) -> list[PacketRecord]:
    """Read the packets written by `write_packets`.

    Args:
        path: the file.

    Raises:
        ValueError: the file is not such a table; the message names the line.
        OSError: the file cannot be read.
    """
    return read_rows(path, COLUMNS, "a table of packets", _packet_from_row)
