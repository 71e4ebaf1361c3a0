"""Jobs: what is done many times, wherever it is done; a failure is a value. Knows no scenarios."""

from __future__ import annotations

import pickle
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from math import nan
from time import perf_counter
from typing import Any

from cosim.errors import CosimError, RunError
from cosim.scenario.origin import ForeignFile


@dataclass(frozen=True)
class Failure:
    """Why a job has no result, or only a part of one.

    Args:
        reason: in words. outside: whether the reason lies outside of the job (interrupted, ended by somebody else, no
            memory left), so that it may succeed another time.
    """

    reason: str
    outside: bool = False


@dataclass(frozen=True)
class Ended:
    """What a job left.

    Args:
        row: what it gave; None where it gave nothing. failure: why it did not reach its end, or None.
        seconds: wall time of the job [s]. warnings: what the user should know of it, whatever is kept as its row.
    """

    row: Any = None
    failure: Failure | None = None
    seconds: float = nan
    warnings: Sequence[str] = ()


class Job(ABC):
    """One of many runs. It is pickled where it is done in another process, so its class stands in a module.

    Attributes:
        settings: what distinguishes it from the others, by name.
    """

    settings: Mapping[str, Any]

    @property
    @abstractmethod
    def key(self) -> str:
        """Digest of all that the row follows from; the same on every machine."""

    @property
    def seed(self) -> int | None:
        """Seed of its chance; None where nothing is left to chance or it is not known."""
        return None

    @abstractmethod
    def do(self) -> Any:
        """The row, or `Ended` with it; raises where there is none."""

    def files(self) -> Sequence[ForeignFile]:
        """Files that it reads, for machines that do not have them."""
        return ()

    def code(self) -> Sequence[Callable[..., Any]]:
        """Functions and classes of the user's that it calls, for machines that do not have their modules."""
        return (type(self),)

    def moved(self, places: Mapping[str, str]) -> Job:
        """The same job with its files at other places.

        Args:
            places: paths by the keys of `files`.
        """
        assert not places
        return self

    def brought_back(self, ended: Ended) -> Ended:
        """What it left on another machine, as if it had been done here.

        Args:
            ended: what it left there.
        """
        return ended


def pickled(job: Job) -> bytes:
    """A job as bytes for another process.

    Args:
        job: to be sent.

    Raises:
        RunError: it holds what cannot be sent.
    """
    try:
        return pickle.dumps(job)
    except (TypeError, AttributeError, ValueError, pickle.PicklingError) as error:
        raise RunError(
            f"A run cannot be passed to a process of its own: {error}. Run with one worker, or take functions and "
            "classes of a module."
        ) from error


def perform(job: Job) -> Ended:
    """Do a job: whatever it raises is its failure, for one that fails must not stop the others.

    Args:
        job: to be done.
    """
    begin = perf_counter()
    try:
        found = job.do()
        ended = found if isinstance(found, Ended) else Ended(found)
    except CosimError as error:
        ended = Ended(failure=Failure(str(error)))
    except Exception as error:  # whatever it is, it is reported
        ended = Ended(failure=Failure(f"{type(error).__name__}: {error}", isinstance(error, MemoryError)))
    return replace(ended, seconds=perf_counter() - begin)
