"""The table of the longest gaps between balises: how far every observer was off at their end."""

from __future__ import annotations

from typing import Any

from cosim.evaluation.balise_gaps import GapErrors, largest
from fmus.tables.numbers import error_number, number
from fmus.tables.table import Column, Table, name_column

_COLUMNS = (
    Column("length", "Way", "m"),
    Column("seconds", "Time", "s"),
    Column("speed", "Speed at its end", "km/h", factor=3.6),
    Column("envelope", "SUBSET-041", "m", "What is allowed to an odometer after this way"),
)
_ERROR = "Estimated minus true position in the last row before the telegram is used"


def gaps_table(found: GapErrors) -> Table:
    """Position errors at the end of the longest gaps, in metres and in seconds of running time; last row: the largest
    of all gaps, and how many of them ended within the envelope.

    Args:
        found: from `gap_errors`.

    Returns:
        The table; without rows where there are no gaps.
    """
    columns = [name_column("gap", "Gap"), *_COLUMNS]
    columns += [
        Column(name, f"{found.labels[name]} [m]\nrunning time [s]", "", _ERROR, write=_written) for name in found.errors
    ]
    seconds = {name: found.running_time(name) for name in found.errors}
    rows: list[list[Any]] = []
    for i in found.longest():
        gap = found.gaps[i]
        errors = [{"error": float(found.errors[n][i]), "running_time": float(seconds[n][i])} for n in found.errors]
        rows.append([f"{gap.origin} to {gap.target}", gap.length, gap.seconds, gap.speed, gap.envelope, *errors])
    if rows:
        name = f"all {len(found.gaps)}: largest\nand share within SUBSET-041"
        worst = [{"largest": largest(e), "within": found.within_envelope(n)} for n, e in found.errors.items()]
        rows.append([name, *[""] * len(_COLUMNS), *worst])
    return Table("gaps", columns, rows)


def _written(value: dict[str, float]) -> str:
    """An error [m] above its running time [s]; of all gaps the largest [m] above the share that was within [1]."""
    if "error" in value:
        return f"{error_number(value['error'])}\n{error_number(value['running_time'])}"
    return f"{error_number(value['largest'])} m\n{number(100.0 * value['within'])} %"
