"""Workers: a task that crashes its process fails alone, and everything else is answered once."""

from __future__ import annotations

import os

import pytest
from worker_tasks import process_id, task

from cosim.studies.workers import Died, Raised, attempt, in_processes


def test_one_that_dies_fails_alone_whatever_is_left_to_do() -> None:
    """The last argument dies as well, when no worker is needed any more."""
    arguments = [1, "die", "exit", 2, "raise", "pickle", 3, "exit"]
    answers = list(in_processes(task, arguments, workers=2))
    assert sorted(number for number, _ in answers) == list(range(len(arguments)))
    by_number = dict(answers)
    assert [by_number[n] for n in (0, 3, 6)] == [1, 4, 9]
    assert by_number[1] == Died("its process was ended by the signal SIGKILL")
    assert by_number[2] == by_number[7] == Died("its process ended with exit code 3")
    assert by_number[4] == Raised("KeyError: 'nothing here'")
    assert isinstance(by_number[5], Raised)
    assert "cannot be passed between processes" in by_number[5].reason


def test_it_is_done_elsewhere_and_nobody_is_left_behind_when_the_reader_goes() -> None:
    answers = in_processes(process_id, [0, 1, 2], workers=1)
    _, process = next(answers)
    assert process != os.getpid()
    answers.close()  # type: ignore[attr-defined]
    with pytest.raises(ProcessLookupError):
        os.kill(process, 0)


def test_what_is_raised_here_is_an_answer_too() -> None:
    assert attempt(task, "raise") == Raised("KeyError: 'nothing here'")
    assert attempt(task, 3) == 9
    with pytest.raises(KeyboardInterrupt):
        attempt(_interrupt, None)


def _interrupt(_: None) -> None:
    raise KeyboardInterrupt
