"""Where jobs are done: in this process, in worker processes, or on a cluster."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import AbstractContextManager
from typing import Protocol

from cosim.errors import ScenarioError
from cosim.runs.job import Ended, Job, perform
from cosim.runs.workers import Team


class Executor(AbstractContextManager["Executor"], Protocol):
    """Does jobs, for several rounds; what it holds is freed at the end of its context."""

    def each(self, jobs: Iterable[Job]) -> Iterator[tuple[Job, Ended]]:
        """One round.

        Args:
            jobs: to be done.

        Yields:
            Jobs with what they left, as they end.
        """


class InThisProcess(AbstractContextManager["InThisProcess"]):
    """Does jobs one after the other, here."""

    def each(self, jobs: Iterable[Job]) -> Iterator[tuple[Job, Ended]]:
        """Jobs with what they left, in their order; see `Executor.each`.

        Args:
            jobs: to be done.
        """
        return ((job, perform(job)) for job in jobs)

    def __exit__(self, *_: object) -> None:
        """Nothing to free."""


def make_executor(workers: int = 1, scheduler: str | None = None, *, apart: bool = False) -> Executor:
    """Where jobs are done, as a user asks for it.

    Args:
        workers: processes at a time on this machine. scheduler: address of a scheduler of `dask.distributed`,
            ``tcp://host:8786``, whose workers do the jobs in place of processes here.
        apart: whether a single worker is a process of its own, which a crash takes along in place of this one; else it
            is this process, which costs less.

    Raises:
        ScenarioError: `workers` is less than 1.
        RunError: the scheduler or its workers cannot be used; the message says why.
    """
    if workers < 1:
        raise ScenarioError(f"Many runs need at least one worker (got workers={workers}).")
    if scheduler is not None:
        from cosim.runs.cluster import Cluster  # noqa: PLC0415 - optional

        return Cluster(scheduler)
    return Team(workers) if workers > 1 or apart else InThisProcess()
