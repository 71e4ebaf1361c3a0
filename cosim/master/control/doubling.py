"""Error control by step doubling: every step is taken whole and in two halves, and the difference is its error.

The halves are kept. Steps are the way between two communication points divided by powers of two, so that times are
exact and rows stay where they are. Sources: Hairer, Norsett, Wanner 1993, II.4; Schierz, Arnold, Clauss 2012 for
co-simulation.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import inf
from typing import Any

import numpy as np

from cosim.errors import CouplingError, RunError
from cosim.master.control.control import StepControl
from cosim.master.system import Checkpoint, Row, System
from fmus.fmi.standard import TIME_TOLERANCE

_SAFETY = 0.5
"""A longer step is tried where its expected error is below this share of the tolerance."""

FINEST = 30
"""A communication step is halved no more often than this: a billionth of it is left."""


@dataclass
class _StepStatistics:
    """What became of the steps.

    Args:
        accepted, rejected: numbers of steps. forced: accepted at the smallest step with too large an error.
        shortest: shortest accepted step [s]. worst: largest accepted error as a multiple of the tolerance.
        forced_at: time of the first forced step [s].
    """

    accepted: int = 0
    rejected: int = 0
    forced: int = 0
    shortest: float = inf
    worst: float = 0.0
    forced_at: float | None = None


class DoublingStep(StepControl):
    """Steps as long as the error allows, up to the communication step.

    Args:
        system: what is stepped; all its components must save their state and vary their step.
        tolerance: bound of the error of a step in every continuous signal, relative to its size, absolute below 1.
        order: of the error of one step in its length: 2 with held inputs, 3 with lines.
        smallest_step: no step is shorter [s]; there a too large error is accepted, counted and reported.

    Raises:
        CouplingError: a component cannot save its state, or cannot vary its step.
    """

    name = "doubling"

    def __init__(self, system: System, tolerance: float, order: int = 2, smallest_step: float | None = None) -> None:
        system.demand_states("Error control (master.control = 'doubling')")
        rigid = [step.component.name for step in system.plan.steps if not step.component.can_vary_step]
        if rigid:
            raise CouplingError(
                "Error control (master.control = 'doubling') divides communication steps, and these components cannot "
                "vary "
                f"theirs: {', '.join(rigid)}. Use master.control = 'fixed'."
            )
        super().__init__(system)
        self.tolerance, self.order, self.smallest_step = tolerance, order, smallest_step
        self.statistics = _StepStatistics()
        self._level = 0
        self._watched = system.plan.continuous

    def step(self, t: float, until: float) -> Sequence[Row]:  # noqa: D102 - see StepControl
        rows: list[Row] = []
        finest = self._finest_level(until - t)
        self._level = min(self._level, finest)
        place, level = 0, self._level  # in units of the step divided by 2**level
        while place < 2**level:
            taken = self._try(_between(t, until, place, level + 1), level == finest)
            if taken is None:
                place, level = 2 * place, level + 1
                continue
            found, error = taken
            rows += found
            place += 1
            if place < 2**level:
                self._close_pair(rows, _between(t, until, place, level + 1)[0])
            if self._ended():
                break
            if level > 0 and place % 2 == 0 and error * 2**self.order < _SAFETY:
                place, level = place // 2, level - 1
        self._level = level
        return rows

    def summary(self) -> Mapping[str, Any]:  # noqa: D102 - see StepControl
        statistics = self.statistics
        shortest = None if statistics.shortest == inf else statistics.shortest
        return {
            "name": self.name,
            "tolerance": self.tolerance,
            "accepted": statistics.accepted,
            "rejected": statistics.rejected,
            "forced": statistics.forced,
            "first_forced_at": statistics.forced_at,
            "shortest_step": shortest,
            "worst_error": statistics.worst,
        }

    def warnings(self) -> list[str]:  # noqa: D102 - see StepControl
        if not self.statistics.forced:
            return []
        return [
            f"Error control: {self.statistics.forced} steps of the smallest length have a larger error than the "
            f"tolerance {self.tolerance:g}, the first at t = {self.statistics.forced_at:g} s "
            f"(worst: {self.statistics.worst:.3g} times); "
            "set a smaller master.smallest_step, or accept a larger master.tolerance."
        ]

    # -- internals --------------------------------------------------------------------------------------------------

    def _try(self, times: tuple[float, float, float], finest: bool) -> tuple[Sequence[Row], float] | None:
        """One step over begin, middle, end [s] and its error; None where it was taken back."""
        begin, _, end = times
        system = self.system
        checkpoint = system.save()
        try:
            rows, error = self._twice(times, checkpoint, finest)
            if error > 1.0 and not finest:
                system.restore(checkpoint)
                self.statistics.rejected += 1
                return None
        finally:
            system.release(checkpoint)
        self._count(begin, end - begin, error)
        return rows, error

    def _twice(
        self, times: tuple[float, float, float], checkpoint: Checkpoint, finest: bool
    ) -> tuple[list[Row], float]:
        """The step whole, then in two halves; a step that fails may be too long, so its error is infinite."""
        try:
            return self._whole_and_halves(times, checkpoint)
        except RunError:
            if finest or not all(step.component.usable for step in self.system.plan.steps):
                raise
            return [], inf

    def _whole_and_halves(self, times: tuple[float, float, float], checkpoint: Checkpoint) -> tuple[list[Row], float]:
        """Rows of the halves, and the error."""
        begin, middle, end = times
        system = self.system
        system.advance(begin, end)
        coarse = system.plan.values.copy()
        system.restore(checkpoint)
        rows = [*system.advance(begin, middle)]
        self._close_pair(rows, middle)
        if not self._ended():
            rows += system.advance(middle, end)
        return rows, self._error(coarse)

    def _close_pair(self, rows: list[Row], t: float) -> None:
        """An event at the end of a step within the communication step: nobody else gives the row after it."""
        if rows and abs(rows[-1][0] - t) <= TIME_TOLERANCE:
            rows.append((t, self.system.plan.values.copy()))

    def _error(self, coarse: np.ndarray) -> float:
        """Error of the two halves as a multiple of the tolerance, by Richardson's extrapolation; of the worst
        signal.
        """
        fine = self.system.plan.values[self._watched]
        scale = self.tolerance * np.maximum(1.0, np.abs(fine))
        with np.errstate(invalid="ignore"):  # what is no number is no small error
            difference = np.abs(fine - coarse[self._watched]) / (2.0 ** (self.order - 1) - 1.0)
            return float(np.nan_to_num(np.max(difference / scale, initial=0.0), nan=inf, posinf=inf))

    def _count(self, begin: float, length: float, error: float) -> None:
        statistics = self.statistics
        statistics.accepted += 1
        statistics.shortest, statistics.worst = (
            min(statistics.shortest, length),
            max(statistics.worst, error),
        )
        if error > 1.0:
            statistics.forced += 1
            statistics.forced_at = begin if statistics.forced_at is None else statistics.forced_at

    def _finest_level(self, length: float) -> int:
        if self.smallest_step is None:
            return FINEST if length / 2**FINEST > 4.0 * TIME_TOLERANCE else _levels(length, 4.0 * TIME_TOLERANCE)
        return _levels(length, self.smallest_step)

    def _ended(self) -> bool:
        return any(s.component.terminated for s in self.system.plan.steps)


def _levels(length: float, smallest: float) -> int:
    """How often a length may be halved without falling below the smallest one."""
    return max(int(np.floor(np.log2(max(length / smallest, 1.0)) + 1e-9)), 0)


def _between(t: float, until: float, place: int, level: int) -> tuple[float, float, float]:
    """Begin, middle and end [s] of a step; its halves are number ``2 * place`` and the one after it at `level`."""
    parts = 2**level

    def at(i: int) -> float:
        return until if i == parts else t + (until - t) * (i / parts)

    return at(2 * place), at(2 * place + 1), at(2 * place + 2)
