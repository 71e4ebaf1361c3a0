"""Many jobs: taken over from the journal or done, each written as it ends; whatever one does, the others go on."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
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
    waiting: dict[int, int] = {}
    done = 0
    for number, job in enumerate(jobs):
        entry = None if journal is None else journal.taken(job, lambda row, n=number: fits(n, row))  # type: ignore[misc]
        if entry is None:
            waiting[id(job)] = number
            continue
        done += 1
        failure = None if entry["failure"] is None else Failure(entry["failure"])
        yield Done(number, job, entry["row"], failure, entry["seconds"], resumed=True)
    for job, ended in _tried(executor, [jobs[number] for number in waiting.values()]):
        number = waiting[id(job)]
        row = reduce(number, job, ended)
        if journal is not None:
            journal.add(job, row, ended.failure, ended.seconds)
        done += 1
        yield Done(number, job, row, ended.failure, ended.seconds)
        if progress is not None:
            progress(done, len(jobs))
        if interrupted(ended):  # who interrupts one of many means all of them
            raise KeyboardInterrupt


def _tried(executor: Executor, jobs: Sequence[Job]) -> Iterator[tuple[Job, Ended]]:
    """Jobs with what they left; those that failed for a reason outside are done once more at the end."""
    again: list[Job] = []
    for job, ended in executor.each(jobs):
        if ended.failure is not None and ended.failure.outside and not interrupted(ended):
            again.append(job)
        else:
            yield job, ended
    yield from executor.each(again)


def interrupted(ended: Ended) -> bool:
    """Whether somebody stopped it.

    Args:
        ended: what a job left.
    """
    return ended.failure is not None and ended.failure.reason == INTERRUPTED
