"""Runs of a calibration as jobs: done where a user wants them, written to a journal, and left out where they fail."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cosim.calibration.least_squares import Fit
from cosim.calibration.recorded_signals import RecordedSignals
from cosim.calibration.runs import Runs, in_words
from cosim.errors import CosimError
from cosim.runs.engine import run_jobs
from cosim.runs.executors import Executor
from cosim.runs.job import Job
from cosim.runs.journal import Journal

Array = NDArray[np.float64]


class JobRuns(Runs):
    """Runs that are jobs, those of a derivative at once. One that fails has signals that are no numbers: the fit goes
    on without it, and says so.

    Args:
        where: what is run, for messages. executor: where; it is let go by `close`.
        journal: that runs are written to and taken over from; None for none.
    """

    def __init__(self, where: str, executor: Executor, journal: Journal | None) -> None:
        self.where, self._executor, self._journal = where, executor, journal
        self.failures: list[str] = []

    @abstractmethod
    def job(self, values: Mapping[str, float], recorded: RecordedSignals) -> Job:
        """A run whose row is the signals at the instants, shape (q, n).

        Args:
            values: parameters by name. recorded: as for `run`.
        """

    def run(self, values: Mapping[str, float], recorded: RecordedSignals) -> Array:
        """The signals of one run, see `Runs.run`.

        Raises:
            CosimError: it failed.
        """
        before = len(self.failures)
        found: Array = self.run_all([values], recorded)[0]
        if len(self.failures) > before:
            raise CosimError(f"{self.where}: a run of the calibration failed, with {self.failures.pop()}")
        return found

    def run_all(self, points: Sequence[Mapping[str, float]], recorded: RecordedSignals) -> Array:
        """The signals of several runs, see `Runs.run_all`."""
        found = np.full((len(points), len(recorded.measured), len(recorded.time)), np.nan)
        for done in run_jobs([self.job(values, recorded) for values in points], self._executor, self._journal):
            if done.failure is None:
                found[done.number] = np.array(done.row, dtype=float)  # the journal writes null for what is no number
            else:
                self.failures.append(f"{in_words(points[done.number])}: {done.failure.reason}")
        return found

    def prepare(self, recorded: RecordedSignals) -> tuple[RecordedSignals, Mapping[str, float]]:
        """All of it, see `Runs.prepare`; a fit begins, and what failed before it is none of its business."""
        self.failures.clear()
        return super().prepare(recorded)

    def remarks(self, found: Fit, names: Sequence[str], recorded: RecordedSignals) -> list[str]:
        """Which runs failed, see `Runs.remarks`."""
        if not self.failures:
            return []
        return [
            f"{len(self.failures)} of {found.runs} runs failed and were left out, the first with {self.failures[0]}"
        ]

    def row_of(self, job: Job) -> Any:
        """What a job gives that the journal does not keep.

        Args:
            job: to be done.

        Raises:
            CosimError: it failed.
        """
        ((done),) = run_jobs([job], self._executor)
        if done.failure is not None:
            reason = done.failure.reason
            raise CosimError(reason if reason.startswith(self.where) else f"{self.where}: {reason}")
        return done.row

    def close(self) -> None:
        """Let the worker processes end."""
        self._executor.__exit__(None, None, None)
