"""Workers: tasks done in processes of their own, so that one that crashes takes nothing else with it. Knows no
scenarios.

Processes are started afresh (spawn): FMUs are not safe in threads, and a copied process would share their libraries'
state.
"""

from __future__ import annotations

import multiprocessing
import signal
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from multiprocessing.connection import Connection, wait
from pathlib import Path
from pickle import PicklingError
from tempfile import TemporaryDirectory
from typing import Any, NamedTuple

from cosim.process.last_call import LAST_CALL, make_page

_STOP_SECONDS = 5.0


class Died(NamedTuple):
    """In place of an answer: the process died. `reason` says how."""

    reason: str


class Raised(NamedTuple):
    """In place of an answer: the task raised what it should not have. `reason` names it."""

    reason: str


def attempt(task: Callable[[Any], Any], argument: Any) -> Any:
    """The answer of a task, or what it raised: one that fails must not stop the others.

    Args:
        task: a function.
        argument: what it is called with.
    """
    try:
        return task(argument)
    except Exception as error:  # whatever it is, it is told
        return Raised(f"{type(error).__name__}: {error}")


def in_processes(task: Callable[[Any], Any], arguments: Sequence[Any], workers: int) -> Iterator[tuple[int, Any]]:
    """Do a task for each argument, a few at a time.

    Args:
        task: a function of a module; it and its arguments and answers are pickled. arguments: one for each call.
        workers: processes at a time.

    Yields:
        Number of the argument and the answer, `Died` or `Raised`, as they come.
    """
    with Team(task, workers) as team:
        yield from team.each(arguments)


class Team:
    """Processes that stay for several rounds of tasks; each is started when it is first needed.

    Args:
        task: a function of a module; it and its arguments and answers are pickled. workers: processes at a time.
    """

    def __init__(self, task: Callable[[Any], Any], workers: int) -> None:
        self.task, self.workers = task, workers
        self._idle: list[_Worker] = []

    def each(self, arguments: Sequence[Any]) -> Iterator[tuple[int, Any]]:
        """One round: the task for each argument.

        Args:
            arguments: one for each call.

        Yields:
            Number of the argument and the answer, `Died` or `Raised`, as they come.
        """
        waiting = list(enumerate(arguments))[::-1]
        busy: list[_Worker] = []

        def occupy() -> None:
            while waiting and len(busy) < self.workers:
                busy.append(self._idle.pop() if self._idle else _Worker(self.task))
                busy[-1].give(*waiting.pop())

        try:
            occupy()
            while busy:
                ready = wait([worker.pipe for worker in busy])
                for worker in [w for w in busy if w.pipe in ready]:
                    number, answer = worker.number, worker.answer()
                    busy.remove(worker)
                    if isinstance(answer, Died):
                        worker.stop()
                    else:
                        self._idle.append(worker)
                    occupy()  # before the answer is looked at, which may take long
                    yield number, answer
        finally:
            for worker in busy:
                worker.kill()

    def close(self) -> None:
        """Let all processes end."""
        while self._idle:
            self._idle.pop().stop()

    def __enter__(self) -> Team:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


class _Worker:
    """One process and the pipe to it."""

    def __init__(self, task: Callable[[Any], Any]) -> None:
        context = multiprocessing.get_context("spawn")
        self.pipe, theirs = context.Pipe()
        self.number = -1
        self._folder = TemporaryDirectory(prefix="worker-")
        page = Path(self._folder.name) / "last_call"
        self._last = make_page(page)
        self.process = context.Process(target=_serve, args=(task, theirs, page), daemon=True)
        self.process.start()
        theirs.close()  # so that the pipe ends when the process does

    def give(self, number: int, argument: Any) -> None:
        """Hand it a task; where it has died already, that is found when the answer is read."""
        self.number = number
        with suppress(BrokenPipeError, ConnectionResetError):
            self.pipe.send(argument)

    def answer(self) -> Any:
        """What it answered."""
        try:
            return self.pipe.recv()
        except (EOFError, ConnectionResetError):
            self.process.join(_STOP_SECONDS)
            return Died(
                self._last.noted or ": ".join(filter(None, (self._last.words(), _how_it_ended(self.process.exitcode))))
            )

    def stop(self) -> None:
        """Let it end; it has nothing to do."""
        self.pipe.close()
        self.process.join(_STOP_SECONDS)
        self.kill()

    def kill(self) -> None:
        """End it, whatever it does."""
        if self.process.is_alive():
            self.process.kill()
        self.process.join()
        self.pipe.close()
        self._folder.cleanup()


def _serve(task: Callable[[Any], Any], pipe: Connection, page: Path) -> None:
    """In the process: answer until nobody asks any more."""
    LAST_CALL.attach(page)
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the one who asks is interrupted, and ends this process
    while True:
        try:
            argument = pipe.recv()
        except (EOFError, ConnectionResetError):
            return
        answer = attempt(task, argument)
        try:
            pipe.send(answer)
        except (TypeError, AttributeError, ValueError, PicklingError) as error:
            pipe.send(Raised(f"its answer cannot be passed between processes: {error}"))


def _how_it_ended(code: int | None) -> str:
    if code is not None and code < 0:
        try:
            return f"its process was ended by the signal {signal.Signals(-code).name}"
        except ValueError:
            return f"its process was ended by signal {-code}"
    hint = "; a script that uses workers needs the line if __name__ == '__main__':" if code == 1 else ""
    return f"its process ended with exit code {code}{hint}"
