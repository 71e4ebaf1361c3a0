"""Workers: jobs done in processes of their own, so that one that crashes takes nothing else with it. Knows no
scenarios.

Processes are started afresh: FMUs are not safe in threads, and a copied process would share their libraries' state.
They are no processes of `multiprocessing`, which a worker of a cluster may not start, and which run the user's script
again: here that is done only for jobs whose classes stand in it.
"""

from __future__ import annotations

import json
import os
import pickle
import signal
import subprocess
import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import AbstractContextManager, suppress
from math import isnan, nan
from multiprocessing import spawn
from multiprocessing.connection import Pipe, wait
from pathlib import Path
from tempfile import TemporaryDirectory
from time import monotonic
from typing import Any

from cosim.errors import RunError
from cosim.process.call_clock import CallClock
from cosim.process.crashes import remember_crash
from cosim.process.last_call import make_page
from cosim.runs.job import Ended, Failure, Job, pickled
from plant_models.left_behind import owned

_STOP_SECONDS = 5.0
_POLL = 0.1
"""How often is looked at calls that may take too long [s]."""
_SERVE = (
    "import json, signal, sys; signal.signal(signal.SIGINT, signal.SIG_IGN); "
    "handle, path, page, script = map(json.loads, sys.argv[1:]); sys.path[:] = path; "
    "from cosim.runs.child import serve; serve(handle, page, script)"
)
importing_script = False
"""Whether this is a worker that is just running the user's script, for its classes."""
_FROM_OUTSIDE = {-signal.SIGTERM, -signal.SIGINT} | ({-signal.SIGKILL} if hasattr(signal, "SIGKILL") else set())
"""Exit codes of processes that were ended by somebody else, perhaps by the system for want of memory."""


class Team(AbstractContextManager["Team"]):
    """Processes that stay for several rounds of jobs; each is started when it is first needed, and replaced when it
    dies.

    Args:
        workers: processes at a time.
    """

    def __init__(self, workers: int) -> None:
        self.workers = workers
        self._idle: list[_Worker] = []
        self._busy: list[_Worker] = []

    def each(self, jobs: Iterable[Job], stopped: Callable[[], bool] = lambda: False) -> Iterator[tuple[Job, Ended]]:
        """One round.

        Args:
            jobs: to be done. stopped: asked now and then, whether nobody waits for them any more.

        Yields:
            Jobs with what they left, as they end.

        Raises:
            RunError: a job cannot be sent to another process.
        """
        waiting = iter(jobs)
        busy = self._busy

        def occupy() -> None:
            while len(busy) < self.workers and (job := next(waiting, None)) is not None:
                busy.append(self._worker_for(job))

        try:
            occupy()
            while busy and not stopped():
                for worker in _ready(busy):
                    job, ended = worker.job, worker.response()
                    busy.remove(worker)
                    if worker.dead:
                        worker.stop()
                    else:
                        self._idle.append(worker)
                    occupy()  # before the answer is used, which may take long
                    yield job, ended
        finally:
            while busy:
                busy.pop().kill()

    def interrupt(self) -> None:
        """Ctrl-C for jobs that hear it: they end by themselves."""
        for worker in self._busy:
            if os.name == "posix":
                worker.process.send_signal(signal.SIGINT)

    def reached(self) -> float | None:
        """Where the calls of the present jobs are that is least far [s]; None where none is in a call with a time."""
        times = [time for worker in self._busy if not isnan(time := worker.time)]
        return min(times, default=None)

    def _worker_for(self, job: Job) -> _Worker:
        """A process that does this job now; one that does not know the script is exchanged where the job needs it."""
        data = pickled(job)
        script = _script() if b"__main__" in data else {}
        worker = self._idle.pop() if self._idle else _Worker(script)
        if script and not worker.script:
            worker.stop()
            worker = _Worker(script)
        worker.give(job, data)
        return worker

    def close(self) -> None:
        """Let all processes end."""
        while self._idle:
            self._idle.pop().stop()

    def __exit__(self, *_: object) -> None:
        self.close()


def _ready(busy: Sequence[_Worker]) -> list[_Worker]:
    """Those of the workers whose answers can be read, after a while at most; a call that takes too long is ended."""
    begin = monotonic()
    responses = wait([worker.pipe for worker in busy], _POLL)
    elapsed = min(monotonic() - begin, 2.0 * _POLL)  # this program may have been stopped meanwhile
    for worker in busy:
        if worker.pipe not in responses:
            worker.check_duration(elapsed)
    return [worker for worker in busy if worker.pipe in responses]


class _Worker:
    """One process and the pipe to it.

    Args:
        script: see `cosim.runs.child.serve`.
    """

    job: Job

    def __init__(self, script: dict[str, str]) -> None:
        if importing_script:
            raise RunError("A script whose own classes run in worker processes needs: if __name__ == '__main__':")
        self.script, self.dead = script, False
        self.pipe, theirs = Pipe()
        self._folder = TemporaryDirectory(prefix=owned("worker-"))
        page = Path(self._folder.name) / "last_call"
        self._last = make_page(page)
        self._clock, self._why = CallClock(self._last), ""
        words = [json.dumps(value) for value in (theirs.fileno(), sys.path, str(page), script)]
        self.process = subprocess.Popen([sys.executable, "-c", _SERVE, *words], **_inherited(theirs.fileno()))
        theirs.close()  # so that the pipe ends when the process does

    @property
    def time(self) -> float:
        """Of its present call [s]; NaN where it is in none, or in one without a time."""
        return float(self._last.time[0]) if self._last.call[0] else nan

    def give(self, job: Job, data: bytes) -> None:
        """Hand it a job; where it has died already, that is found when the answer is read."""
        self.job = job
        with suppress(BrokenPipeError, ConnectionResetError):
            self.pipe.send_bytes(data)

    def response(self) -> Ended:
        """What the job left."""
        try:
            ended: Ended = pickle.loads(self.pipe.recv_bytes())
            return ended
        except (EOFError, ConnectionResetError):
            self.dead = True
            return Ended(failure=self._end())

    def check_duration(self, elapsed: float) -> None:
        """End the process where its present call takes too long.

        Args:
            elapsed: since the last check [s].
        """
        self._clock.add(elapsed)
        if why := self._clock.over_limit:
            self._why = f"{self._last.words()} {why}"
            self.process.kill()

    def _end(self) -> Failure:
        """How the process ended."""
        with suppress(subprocess.TimeoutExpired):
            self.process.wait(_STOP_SECONDS)
        code = self.process.returncode
        if self._why or not (self._last.noted or code in _FROM_OUTSIDE):
            remember_crash(self._last, self._clock.over_limit or _how_it_ended(code))
        if said := self._why or self._last.noted:
            return Failure(said)
        words = ": ".join(filter(None, (self._last.words(), _how_it_ended(code))))
        return Failure(words, outside=code in _FROM_OUTSIDE)

    def stop(self) -> None:
        """Let it end; it has nothing to do."""
        self.pipe.close()
        with suppress(subprocess.TimeoutExpired):
            self.process.wait(_STOP_SECONDS)
        self.kill()

    def kill(self) -> None:
        """End it, whatever it does."""
        if self.process.poll() is None:
            self.process.kill()
        self.process.wait()
        self.pipe.close()
        self._folder.cleanup()


def _inherited(handle: int) -> dict[str, Any]:
    """What passes a pipe on to a process."""
    if sys.platform == "win32":
        os.set_handle_inheritable(handle, True)
        return {"close_fds": False}
    return {"pass_fds": (handle,)}


def _script() -> dict[str, str]:
    """Where the classes of the user's script are found again."""
    known = spawn.get_preparation_data("worker")
    return {key: str(value) for key, value in known.items() if key.startswith("init_main_from")}


def _how_it_ended(code: int | None) -> str:
    if code is not None and code < 0:
        try:
            return f"its process was ended by the signal {signal.Signals(-code).name}"
        except ValueError:
            return f"its process was ended by signal {-code}"
    return f"its process ended with exit code {code}"
