"""Errors just before and just after the telegrams an observer used. Imports NumPy only."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cosim.evaluation.event_counts import USED
from cosim.evaluation.roles import Quantity, estimation_error
from cosim.evaluation.spec import ReportSpec
from cosim.results.result import BaliseRecord, Result

EQUAL_WITHIN = (
    1e-9  # times this close, relative to their size, are one: an event table may have been written with fewer digits
)


@dataclass(frozen=True, slots=True)
class Corrections:
    """What telegrams did to the error of one observer.

    Args:
        time: of the corrections [s], shape (n,). before, after: error in the row before and the row after, shape (n,).
    """

    time: np.ndarray
    before: np.ndarray
    after: np.ndarray

    @property
    def jump(self) -> np.ndarray:
        """How far the error moved, shape (n,)."""
        return np.asarray(np.abs(self.after - self.before))


def event_rows(time: np.ndarray, instant: float) -> tuple[int, int] | None:
    """The row before and the row after an event, or None where the table holds no two rows for it.

    Args:
        time: of the rows [s], not decreasing. instant: of the event [s].
    """
    if not np.isfinite(instant):
        return None
    close = EQUAL_WITHIN * max(1.0, abs(instant))
    first = int(np.searchsorted(time, instant - close, "left"))
    beyond = int(np.searchsorted(time, instant + close, "right"))
    return (first, beyond - 1) if beyond - first >= 2 else None


def used_by(event: BaliseRecord, observer: str) -> bool:
    """Whether an observer took a telegram into its estimate.

    Args:
        event: the telegram.
        observer: name of its component.
    """
    return event.kind != "missed" and (not event.outcomes or event.outcomes.get(observer) in USED)


def corrections(result: Result, spec: ReportSpec, observer: str, quantity: Quantity) -> Corrections:
    """Errors of an observer around each telegram that it used, as far as the table holds rows before and after it.

    Args:
        result: the run. spec: roles. observer: component. quantity: ``speed`` [m/s] or ``position`` [m].
    """
    error = estimation_error(result, spec, observer, quantity)
    rows = [] if error is None else _rows(result, observer)
    if error is None or not rows:
        return Corrections(np.empty(0), np.empty(0), np.empty(0))
    before, after = np.array(rows).T
    return Corrections(result.time[after], error[before], error[after])


def _rows(result: Result, observer: str) -> list[tuple[int, int]]:
    """Rows around the deliveries, in order of time, each pair once."""
    time = result.time
    found = (event_rows(time, event.delivered_at) for event in result.events if used_by(event, observer))
    return sorted({rows for rows in found if rows is not None})
