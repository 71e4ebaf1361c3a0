"""Workers: a job that crashes its process fails alone, and everything else is done once."""

from __future__ import annotations

import os
import re
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import pytest
from worker_tasks import Task, process_id, square

from cosim.process.exit_guard import limited_calls
from cosim.process.last_call import LAST_CALL
from cosim.runs.engine import run_jobs
from cosim.runs.job import Failure, perform
from cosim.runs.journal import Journal
from cosim.runs.workers import Team


def test_one_that_dies_fails_alone_whatever_is_left_to_do() -> None:
    """The last job dies as well, when no worker is needed any more."""
    jobs = [Task(square, argument) for argument in [1, "die", "exit", 2, "raise", "pickle", 3, "exit"]]
    with Team(2) as team:
        done = list(team.each(jobs))
    assert sorted(jobs.index(job) for job, _ in done) == [0, 1, 2, 2, 3, 4, 5, 6]  # two of them are equal
    found = {job.argument: ended for job, ended in done}  # type: ignore[attr-defined]
    assert [found[n].row for n in (1, 2, 3)] == [1, 4, 9]
    assert found["die"].failure == Failure("its process was ended by the signal SIGKILL", outside=True)
    assert found["exit"].failure == Failure("its process ended with exit code 3")
    assert found["raise"].failure == Failure("KeyError: 'nothing here'")
    assert "cannot be passed between processes" in str(found["pickle"].failure)


def test_it_is_done_elsewhere_and_nobody_is_left_behind_when_the_reader_goes() -> None:
    with Team(1) as team:
        rounds = team.each([Task(process_id, n) for n in range(3)])
        _, ended = next(rounds)
        assert ended.row != os.getpid()
        rounds.close()  # type: ignore[attr-defined]
        with pytest.raises(ProcessLookupError):
            os.kill(ended.row, 0)


def test_what_is_raised_here_is_a_failure_too() -> None:
    assert perform(Task(square, "raise")).failure == Failure("KeyError: 'nothing here'")
    assert perform(Task(square, 3)).row == 9
    with pytest.raises(KeyboardInterrupt):
        perform(Task(_interrupt))


def _interrupt(_: None) -> None:
    raise KeyboardInterrupt


def test_who_is_ended_from_outside_gets_another_try(tmp_path: Path) -> None:
    jobs = [Task(die_once, str(tmp_path / "tried")), Task(square, 5)]
    with Team(1) as team:
        found = {done.number: done for done in run_jobs(jobs, team, Journal(tmp_path))}
    assert (found[0].row, found[0].failure, found[1].row) == ("alive", None, 25)


def die_once(path: str) -> str:
    if not Path(path).exists():
        Path(path).touch()
        square("die")
    return "alive"


def test_a_call_that_lets_no_thread_run_is_ended_too() -> None:
    """The process that asks keeps the time: of a regular expression Python comes back to nothing else."""
    with Team(1) as team:
        ends = list(team.each([Task(look_for_ever, 0.3), Task(square, 2)]))
    assert [ended.row for _, ended in ends] == [None, 4]
    limit = "the limit of a call, which call_timeout sets"
    words = f"component 'own' in doStep at t = 0.2 s has not returned for 0.3 s, {limit}"
    assert ends[0][1].failure == Failure(words)


def look_for_ever(limit: float) -> bool:
    with limited_calls(limit), LAST_CALL.making("own", "doStep", 0.2):
        return re.fullmatch("(a+)+", 50 * "a" + "b") is not None


ASKS = """
import sys
from cosim.runs.workers import Team
from worker_tasks import Task, linger
if __name__ == "__main__":
    with Team(1) as team:
        list(team.each([Task(linger, sys.argv[1])]))
"""


@pytest.mark.skipif(os.name == "nt", reason="its processes have no parents that are looked for")
def test_a_worker_that_hangs_ends_with_the_process_that_asked(tmp_path: Path) -> None:
    environment = os.environ | {"PYTHONPATH": str(Path(__file__).parents[1])}
    with subprocess.Popen([sys.executable, "-c", ASKS, str(tmp_path)], env=environment) as asking:
        while not (begun := list(tmp_path.iterdir())):
            time.sleep(0.05)
        asking.kill()
    until = time.monotonic() + 30.0
    while exists(int(begun[0].name)):
        assert time.monotonic() < until
        time.sleep(0.1)


def exists(number: int) -> bool:
    try:
        os.kill(number, 0)
    except ProcessLookupError:
        return False
    return True


SCRIPT = """
from dataclasses import dataclass
from cosim.runs.job import Job
from cosim.runs.workers import Team
{class_}
def work():
    with Team(1) as team:
        print([ended.row or ended.failure for _, ended in team.each([{job}])])
{guard}
    work()
"""
OWN = """
class Mine(Job):
    key, settings = "", {}
    def do(self):
        return "done"
"""
BOTH = f"from worker_tasks import Task, square\n{OWN}"


@pytest.mark.parametrize(
    ("script", "words"),
    [
        ({"class_": "from worker_tasks import Task, square", "job": "Task(square, 2)", "guard": "if True:"}, "[4]"),
        ({"class_": BOTH, "job": "Task(square, 2), Mine()", "guard": "if __name__ == '__main__':"}, "[4, 'done']"),
        ({"class_": OWN, "job": "Mine()", "guard": "if True:"}, "if __name__ == '__main__':"),
    ],
    ids=["classes of modules need no guard", "of a script with one", "of a script without"],
)
def test_a_script_is_run_again_only_for_its_own_classes(script: dict[str, Any], words: str, tmp_path: Path) -> None:
    (tmp_path / "script.py").write_text(SCRIPT.format(**script))
    here = str(Path(__file__).parents[1])
    command = [sys.executable, str(tmp_path / "script.py")]
    done = subprocess.run(
        command, env=os.environ | {"PYTHONPATH": here}, capture_output=True, text=True, check=False, timeout=100
    )
    assert words in done.stdout
