"""Jobs done on a cluster of `dask.distributed`, an optional extra: by whichever of its workers is free.

Jobs travel as bytes with the user's own classes and functions in them, files by their content: once to a worker, which
keeps them as long as it lives. On a worker a job is done in a process of its own (`cosim.runs.workers`), so that an FMU
that crashes takes neither the worker nor other jobs along. What a worker had begun that is gone is done by another one.
Who stops asking (an interrupt) ends the processes of the jobs that nobody waits for any more.
"""

from __future__ import annotations

import pickle
import sys
import threading
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, suppress
from dataclasses import dataclass
from itertools import islice
from pathlib import Path, PurePosixPath
from tempfile import mkdtemp
from typing import Any
from uuid import uuid4

from cosim.errors import OutputError, RunError
from cosim.run.outcome import INTERRUPTED
from cosim.run.results_manifest import sha256
from cosim.runs.job import Ended, Failure, Job
from cosim.runs.keys import digest, version_text
from cosim.runs.workers import Team
from plant_models.explained_error import explained
from plant_models.missing_package import installation

try:
    import cloudpickle
    import distributed
except ImportError:  # an optional extra; who names a scheduler is refused in words
    distributed = None

_PATIENCE = 30.0
"""How long is waited for the scheduler, and for a first worker of it [s]."""
_AHEAD = 4
"""Jobs that are handed over for each thread of the workers: one is done, others wait."""
_TOO_OFTEN = "the workers that did it were lost, again and again"
_OWN = ("plant_models", "fmu_observer", "fmus", "cosim")


@dataclass(frozen=True)
class _FileSet:
    """A file and those that belong to it.

    Args:
        key: see `ForeignFile`. path: of the file or folder itself, as seen from where they are unpacked.
        parts: their paths, likewise. content: digest of all of them.
    """

    key: str
    path: str
    parts: tuple[str, ...]
    content: str


@dataclass(frozen=True)
class _Shipped(Job):
    """A job as it is done on a worker.

    Args:
        job: pickled. places: of its files there, by key.
    """

    job: bytes
    places: Mapping[str, str]

    settings: Mapping[str, Any] = ()  # type: ignore[assignment]

    @property
    def key(self) -> str:
        return ""

    def do(self) -> Any:
        job: Job = pickle.loads(self.job)
        return (job.moved(self.places) if self.places else job).do()


class Cluster(AbstractContextManager["Cluster"]):
    """The workers of a scheduler.

    Args:
        address: of the scheduler, ``tcp://host:8786``.

    Raises:
        OutputError: dask.distributed is not installed.
        RunError: the scheduler is not reached, has no workers, or one of them has other versions of the packages.
    """

    def __init__(self, address: str) -> None:
        if distributed is None:
            raise OutputError(f"--scheduler needs dask.distributed: {installation('distributed')}")
        self.address = address
        try:
            self._client = distributed.Client(address, timeout=_PATIENCE, set_as_default=False)
        except (OSError, ValueError) as error:
            raise RunError(f"The scheduler {address} cannot be reached: {explained(error)}") from error
        self._contents: dict[str, Any] = {}
        try:
            self._compare_versions()
        except BaseException:
            self._client.close()
            raise

    def each(self, jobs: Iterable[Job]) -> Iterator[tuple[Job, Ended]]:
        """Jobs with what they left, as they end; see `cosim.runs.executors.Executor`.

        Args:
            jobs: to be done.
        """
        waiting, round_ = iter(jobs), uuid4().hex
        known: dict[Any, Job] = {}
        running = distributed.as_completed(loop=self._client.loop)

        def hand_over(count: int) -> None:
            for job in islice(waiting, count):
                future = self._submit(job, round_)
                known[future] = job
                running.add(future)

        try:
            hand_over(_AHEAD * max(1, sum(self._client.nthreads().values())))
            for future in running:
                job = known.pop(future)
                ended = job.brought_back(_ended(future))
                future.release()
                hand_over(1)
                yield job, ended
        finally:
            if known:
                self._stop(list(known), round_)

    def _stop(self, futures: list[Any], round_: str) -> None:
        """End what is waited for no more, also where it is being done; a scheduler that is gone has ended it."""
        with suppress(OSError, TimeoutError, RuntimeError):
            self._client.cancel(futures)
            self._client.run(_stop_round, round_, on_error="return")

    def __exit__(self, *_: object) -> None:
        self._contents.clear()
        self._client.close()

    def _submit(self, job: Job, round_: str) -> Any:
        files = [self._file_set(file.key, file.path, file.parts) for file in job.files() if file.path.exists()]
        contents = [self._contents[file.content] for file in files]
        data = _pickled(job)
        return self._client.submit(_on_worker, data, files, contents, version_text(), round_, pure=False)

    def _file_set(self, key: str, path: Path, parts: Sequence[Path]) -> _FileSet:
        """A file, which is handed over where it has not been; workers fetch it from there when they need it."""
        root = path if path.is_dir() else path.parent
        names = tuple(part.relative_to(root).as_posix() for part in parts)
        content = digest(*(text for name, part in zip(names, parts, strict=True) for text in (name, sha256(part))))
        if content not in self._contents:
            data = [part.read_bytes() for part in parts]
            self._contents[content] = self._client.submit(_itself, data, key=f"cosim-files-{content}")
        return _FileSet(key, "." if path.is_dir() else path.name, names, content)

    def _compare_versions(self) -> None:
        """Refuse workers whose numbers may be others."""
        with suppress(TimeoutError):
            self._client.wait_for_workers(1, timeout=_PATIENCE)
        found = self._client.run(version_text, on_error="return")
        there = {worker: text for worker, text in found.items() if not isinstance(text, OSError)}  # others are lost
        if not there:
            raise RunError(f"The scheduler {self.address} has no workers; start some: dask worker {self.address}")
        for worker, text in there.items():
            if text != version_text():
                raise RunError(f"Worker {worker} of {self.address} cannot be used: {_unlike(text)}")


def _unlike(found: Any) -> str:
    """What is wrong with the versions of a worker."""
    if isinstance(found, Exception):
        return f"this package does not answer there: {explained(found)}"
    return f"its versions are {found}, here they are {version_text()}. Install the same ones."


def _pickled(job: Job) -> bytes:
    """A job as bytes, with the modules in it that are the user's own."""
    modules = {sys.modules[code.__module__] for code in job.code() if code.__module__ in sys.modules}
    own = [m for m in modules if m.__name__.partition(".")[0] not in _OWN and m.__name__ != "__main__"]
    own = [m for m in own if not {"site-packages", "dist-packages"} & set(Path(m.__file__ or "").parts)]
    for module in own:
        cloudpickle.register_pickle_by_value(module)
    try:
        data: bytes = cloudpickle.dumps(job)
        return data
    finally:
        for module in own:
            cloudpickle.unregister_pickle_by_value(module)


def _ended(future: Any) -> Ended:
    """What a job left, or why it is not known."""
    if future.status == "finished":
        ended: Ended = future.result()
        return ended
    error = future.exception() if future.status == "error" else None
    if isinstance(error, RunError):  # another version on a worker that came later
        raise error
    if error is None or isinstance(error, distributed.KilledWorker):
        return Ended(failure=Failure(_TOO_OFTEN, outside=True))
    return Ended(failure=Failure(explained(error), outside=True))


# -- on a worker ------------------------------------------------------------------------------------------------------

_of_thread = threading.local()
_stopped: set[str] = set()
"""Rounds whose jobs nobody waits for."""


def _itself(data: list[bytes]) -> list[bytes]:
    """Files, as one thing that a worker has or has not."""
    return data


def _stop_round(round_: str) -> None:
    """End the processes of the jobs of a round, and begin no more of them."""
    _stopped.add(round_)


def _on_worker(job: bytes, files: list[_FileSet], contents: list[list[bytes]], versions: str, round_: str) -> Ended:
    """Do a job in the process that belongs to this thread of the worker."""
    if version_text() != versions:
        address = distributed.get_worker().address
        raise RunError(f"Worker {address} has the versions {version_text()}, the study {versions}.")
    root = Path(distributed.get_worker().local_directory) / "cosim-files"
    places = {file.key: _unpacked(root, file, data) for file, data in zip(files, contents, strict=True)}
    if not hasattr(_of_thread, "team"):
        _of_thread.team = Team(1)
    found = [ended for _, ended in _of_thread.team.each([_Shipped(job, places)], lambda: round_ in _stopped)]
    return found[0] if found else Ended(failure=Failure(INTERRUPTED, outside=True))


def _unpacked(root: Path, file: _FileSet, data: list[bytes]) -> str:
    """Where a file is on this machine; written there by the first job that needs it."""
    folder = root / file.content
    if not folder.is_dir():
        root.mkdir(parents=True, exist_ok=True)
        new = Path(mkdtemp(dir=root))
        for name, content in zip(file.parts, data, strict=True):
            place = new / PurePosixPath(name)
            place.parent.mkdir(parents=True, exist_ok=True)
            place.write_bytes(content)
        try:
            new.rename(folder)
        except OSError:  # another thread was quicker
            if not folder.is_dir():
                raise
    return str(folder / file.path)
