"""Which signals differ most between runs. Imports NumPy only."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cosim.evaluation.roles import recorded
from cosim.report.figures.scales import bounded
from cosim.report.overlay.overlaid_runs import OverlayRun
from cosim.results.result import Result


def changing_signals(runs: Sequence[OverlayRun], most: int) -> list[str]:
    """Common signals that differ most between the first run and the others, relative to their range, in column order.

    Args:
        runs: from `make_runs`. most: how many names at most.
    """
    first = runs[0].result
    common = [
        n for n in (first.table.dtype.names or ())[1:] if all(recorded(run.result, n) is not None for run in runs)
    ]
    changes = {name: largest_change(runs, name) for name in common}
    chosen = sorted(common, key=lambda name: -changes[name])[:most]
    return [name for name in common if name in chosen]


def largest_change(runs: Sequence[OverlayRun], name: str) -> float:
    """Largest difference of a signal to the first run, in ranges of its values there [1].

    Args:
        runs: from `make_runs`. name: of a signal that all have.
    """
    return max((_change(runs[0].result, run, name) for run in runs[1:]), default=0.0)


def _change(first: Result, run: OverlayRun, name: str) -> float:
    """Largest difference to the first run, in ranges of its values."""
    values, other = (bounded(np.nan_to_num(result[name])) for result in (first, run.result))
    if not np.array_equal(first.time, run.result.time):  # rows of events are met by those of the same time only
        other = np.interp(first.time, run.result.time, other)
    reach = float(np.ptp(values)) or max(float(np.max(np.abs(values))), 1e-300)
    return float(np.max(np.abs(other - values))) / reach
