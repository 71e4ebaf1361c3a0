"""Many jobs: taken over from the journal or done, each written as it ends; whatever one does, the others go on."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

from cosim.run.outcome import INTERRUPTED
from cosim.runs.executors import Executor
from cosim.runs.job import Ended, Failure, Job
from cosim.runs.journal import Journal

Progress = Callable[[int, int], None]


@dataclass(frozen=True)
class Done:
    """A job that is done.

    Args:
        number: of the job among all, from 0. job: itself. row: what is kept of it; None where there is nothing.
        failure: why it did not reach its end, or None. seconds: wall time [s]. resumed: whether the journal had it.
    """

    number: int
    job: Job
    row: Any
    failure: Failure | None
    seconds: float
    resumed: bool = False


def run_jobs(
    jobs: Sequence[Job],
    executor: Executor,
    journal: Journal | None = None,
    *,
    reduce: Callable[[int, Job, Ended], Any] = lambda _number, _job, ended: ended.row,
    fits: Callable[[int, Any], bool] = lambda _number, _row: True,
    progress: Progress | None = None,
) -> Iterator[Done]:
    """Do jobs, and hand each over as soon as it is done, so that none needs to be kept.

    Args:
        jobs: to be done. executor: where. journal: that jobs are taken over from and written to; None for none.
        reduce: called in this process with the number of a job, the job, and what it left; gives the row, plain data
            where there is a journal.
        fits: called with the number of a job and a row that the journal has; whether this study can use it.
        progress: called with the number done and the number in all, once a job has been handed over.

    Yields:
        Jobs that are done, those of the journal first, the others as they end.

    Raises:
        KeyboardInterrupt: a job was interrupted; it has been handed over. OutputError: the journal cannot be written.
    """
    known = {} if journal is None else _known(jobs, journal, fits)
    for number, entry in known.items():
        failure = None if entry["failure"] is None else Failure(entry["failure"])
        yield Done(number, jobs[number], entry["row"], failure, entry["seconds"], resumed=True)
    numbers = {id(job): number for number, job in enumerate(jobs)}
    waiting = [job for number, job in enumerate(jobs) if number not in known]
    for done, (job, ended) in enumerate(_tried(executor, waiting), start=len(known) + 1):
        number = numbers[id(job)]
        row = reduce(number, job, ended)
        if journal is not None:
            journal.add(job, row, ended.failure, ended.seconds)
        yield Done(number, job, row, ended.failure, ended.seconds)
        if progress is not None:
            progress(done, len(jobs))
        if _interrupted(ended):  # who interrupts one of many means all of them
            raise KeyboardInterrupt


def _known(jobs: Sequence[Job], journal: Journal, fits: Callable[[int, Any], bool]) -> dict[int, dict[str, Any]]:
    """Lines of the journal by the numbers of jobs that need not be done again."""
    entries = {number: journal.taken(job, partial(fits, number)) for number, job in enumerate(jobs)}
    return {number: entry for number, entry in entries.items() if entry is not None}


def _tried(executor: Executor, jobs: Sequence[Job]) -> Iterator[tuple[Job, Ended]]:
    """Jobs with what they left; those that failed for a reason outside are done once more at the end."""
    again: list[Job] = []
    for job, ended in executor.each(jobs):
        if ended.failure is not None and ended.failure.outside and not _interrupted(ended):
            again.append(job)
        else:
            yield job, ended
    yield from executor.each(again)


def _interrupted(ended: Ended) -> bool:
    """Whether somebody stopped it."""
    return ended.failure is not None and ended.failure.reason == INTERRUPTED
