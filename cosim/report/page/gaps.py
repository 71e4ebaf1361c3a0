"""The table of the longest gaps between balises: how far every observer was off at their end."""

from __future__ import annotations

from cosim.evaluation.balise_gaps import GapErrors, largest
from cosim.report.page.page_table import PageTable, simple_table
from fmus.tables.numbers import error_number, number

KMH = 3.6


def gaps_table(found: GapErrors) -> PageTable:
    """Position errors at the end of the longest gaps, in metres and in seconds of running time; last row: the largest
    of all gaps, and how many of them ended within the envelope.

    Args:
        found: from `gap_errors`.

    Returns:
        The table; without rows where there are no gaps.
    """
    headings = ["Gap", "Way [m]", "Time [s]", "Speed at its end [km/h]", "SUBSET-041 [m]"]
    headings += [f"{found.labels[name]} [m]\nrunning time [s]" for name in found.errors]
    seconds = {name: found.running_time(name) for name in found.errors}
    rows = []
    for i in found.longest():
        gap = found.gaps[i]
        row = [f"{gap.origin} to {gap.target}", number(gap.length), number(gap.seconds), number(KMH * gap.speed)]
        row += [number(gap.envelope)]
        row += [
            f"{error_number(float(found.errors[n][i]))}\n{error_number(float(seconds[n][i]))}" for n in found.errors
        ]
        rows.append(row)
    if rows:
        row = [f"all {len(found.gaps)}: largest\nand share within SUBSET-041", "", "", "", ""]
        row += [
            f"{error_number(largest(errors))} m\n{number(100.0 * found.within_envelope(name))} %"
            for name, errors in found.errors.items()
        ]
        rows.append(row)
    return simple_table(headings, rows, range(1, len(headings)))
