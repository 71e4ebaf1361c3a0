"""A cluster on this machine: a scheduler and two workers, one of which is killed midway; the table is the same."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from small_scenarios import small
from test_fmus.events import DEEDS, hostile_fmu
from worker_tasks import Task, linger, square

from cosim import Scenario
from cosim.cli import main
from cosim.errors import RunError
from cosim.runs import cluster, keys
from cosim.runs.engine import run_jobs
from cosim.runs.executors import make_executor
from cosim.runs.job import Failure
from cosim.runs.journal import JOURNAL, Journal, read_lines
from cosim.studies.seed_runs import seed_study
from cosim.tuning.tune import tune

# Dask is brought by the extra of the second tier alone.
pytestmark = [pytest.mark.slow, pytest.mark.skipif(os.name == "nt", reason="processes are killed by signals")]


def started(stack: ExitStack, *words: str, folder: Path) -> subprocess.Popen[bytes]:
    """A process of the cluster, far from the files of this one; it is gone at the end."""
    log = stack.enter_context((folder / f"{words[0]}.log").open("ab"))
    command = [sys.executable, "-m", f"distributed.cli.{words[0]}", *words[1:]]
    process = subprocess.Popen(command, cwd=folder, stdout=log, stderr=log)
    stack.callback(process.wait)
    stack.callback(process.kill)
    return process


@pytest.fixture
def workers(tmp_path: Path) -> Iterator[tuple[str, list[subprocess.Popen[bytes]]]]:
    """Address of the scheduler, and two workers."""
    at = tmp_path / "cluster"
    at.mkdir()
    with ExitStack() as stack:
        words = ("dask_scheduler", "--port", "0", "--no-dashboard", "--scheduler-file", "s.json")
        scheduler = started(stack, *words, folder=at)
        while not (at / "s.json").is_file():
            assert scheduler.poll() is None, (at / "dask_scheduler.log").read_text()
            time.sleep(0.1)
        more = ["--scheduler-file", "s.json", "--no-dashboard", "--no-nanny", "--nthreads", "1"]
        both = [started(stack, "dask_worker", *more, "--local-directory", f"w{n}", folder=at) for n in range(2)]
        import distributed

        with distributed.Client(scheduler_file=str(at / "s.json")) as client:
            client.wait_for_workers(2, timeout=60)
            address = client.scheduler.address
        yield address, both


def kill_after(count: int, worker: subprocess.Popen[bytes]) -> Callable[[int, int], None]:
    return lambda done, _all: worker.kill() if done == count else None


MODEL = """
from neighbour import GROWTH
class Growing:
    def __init__(self):
        self.size = 1.0
    inputs, outputs = (), ("size",)
    def step(self, t, inputs, dt):
        self.size *= 1.0 + GROWTH * dt
        return {"size": self.size}
"""


WHERE = """
class Where:
    inputs, outputs = (), ("shipped",)
    def step(self, t, inputs, dt):
        return {"shipped": float("cosim-files" in __file__)}
"""


def studied(fmu: Path, folder: Path) -> Scenario:
    """An FMU that may crash, a model in a file that imports another one, and chance."""
    (folder / "model.py").write_text(MODEL)
    (folder / "neighbour.py").write_text("GROWTH = 0.5\n")
    scenario = Scenario(folder=folder, stop=0.5, step=0.01, master={"isolate": "no"}).add("bad", fmu=str(fmu))
    return scenario.add("growing", model="model.py:Growing")


def test_one_of_two_workers_is_killed_and_the_table_is_equal(
    workers: tuple[str, list[subprocess.Popen[bytes]]], tmp_path: Path
) -> None:
    address, (first, _) = workers
    deeds = [float(DEEDS.index("crashes" if number in (1, 5) else "nothing")) for number in range(8)]
    values = {"bad.deed": deeds, "stop": [0.5, 0.5, 0.4, 0.3, 0.2, 0.4, 0.45, 0.1]}
    sweep = studied(hostile_fmu(tmp_path), tmp_path).vary(values, "zip")
    measure: Any = {"size": lambda outcome: outcome["growing.size"][-1], "y": lambda outcome: outcome["bad.y"][-1]}
    here = sweep.run(2, measure=measure)
    there = sweep.run(measure=measure, scheduler=address, directory=tmp_path / "out", progress=kill_after(2, first))
    assert [str(row) for row in there.table()] == [str(row) for row in here.table()]
    assert [run.number for run in there.failed] == [1, 5]
    assert "component 'bad' in doStep at t = 0.24 s" in str(there[1].failure)
    for one, other in zip(here.runs, there.runs, strict=True):
        if one.outcome is not None and other.outcome is not None:
            np.testing.assert_array_equal(one.outcome.result.table, other.outcome.result.table)
    assert len(read_lines(tmp_path / "out" / JOURNAL)) == 8
    kept = tmp_path / "out" / "run_000" / "made_from" / "files"
    assert sorted(path.name for path in kept.rglob("*.*")) == ["hostile.fmu", "model.py", "neighbour.py"]
    shipped = sorted(path.name for path in (tmp_path / "cluster").glob("w1/**/cosim-files/*/*"))
    assert shipped == ["hostile.fmu", "model.py", "neighbour.py"]  # once, for all the runs
    again = sweep.run(measure=measure, directory=tmp_path / "out", resume=True, keep=False)
    assert [str(row) for row in again.table()] == [str(row) for row in here.table()]


def test_functions_of_the_users_travel_and_seeds_are_equal(
    workers: tuple[str, list[subprocess.Popen[bytes]]], tmp_path: Path
) -> None:
    address, _ = workers
    arguments = [1.5, "raise", 2.5, "exit", "pickle"]
    with make_executor(scheduler=address) as there:
        found = {d.number: d for d in run_jobs([Task(square, a) for a in arguments], there, Journal(tmp_path))}
    assert [found[n].row for n in (0, 2)] == [2.25, 6.25]
    reasons = {n: done.failure.reason for n, done in found.items() if done.failure is not None}
    assert reasons[1] == "KeyError: 'nothing here'"
    assert reasons[3] == "its process ended with exit code 3"
    assert "cannot be passed between processes" in reasons[4]
    (tmp_path / "where.py").write_text(WHERE)
    sweep = (
        Scenario(folder=tmp_path, stop=0.1, step=0.1).add("where", model="where.py:Where").vary({"stop": [0.1, 0.2]})
    )
    places = [[run.outcome["where.shipped"][-1] for run in sweep.run(scheduler=at).runs] for at in (address, None)]  # type: ignore[index]
    assert places == [[1.0, 1.0], [0.0, 0.0]]  # a worker reads its own copy
    words = [
        "sweep",
        str(sweep.scenario.save(tmp_path / "where.toml")),
        "--vary",
        "stop=0.1,0.2",
        "--table-only",
        "--quiet",
    ]
    assert main([*words, "--out", str(tmp_path / "out"), "--scheduler", address]) == 0
    assert [line["failure"] for line in read_lines(tmp_path / "out" / JOURNAL)] == [None, None]
    scenario = Scenario.load("freight_profile_d").set("stop", 5.0)
    assert seed_study(scenario, range(3), scheduler=address).each == seed_study(scenario, range(3)).each


def test_other_versions_and_nobody_are_refused_in_words(
    workers: tuple[str, list[subprocess.Popen[bytes]]], monkeypatch: pytest.MonkeyPatch
) -> None:
    address, both = workers
    monkeypatch.setattr(cluster, "_PATIENCE", 2.0)
    with pytest.raises(RunError, match=r"scheduler tcp://127\.0\.0\.1:9 cannot be reached"):
        make_executor(scheduler="tcp://127.0.0.1:9")
    with make_executor(scheduler=address) as there, monkeypatch.context() as patched:
        patched.setattr(cluster, "version_text", lambda: "others")  # as to a worker that came later
        with pytest.raises(RunError, match=r"Worker tcp://.* has the versions {.*}, the study others"):
            list(there.each([Task(square, 2)]))
    monkeypatch.setattr(keys, "versions", lambda: {"numpy": "1.0"})
    keys.version_text.cache_clear()
    try:
        with pytest.raises(RunError, match=r'Worker tcp://.* its versions are .*, here they are {"numpy": "1\.0"}'):
            make_executor(scheduler=address)
    finally:
        keys.version_text.cache_clear()
    for worker in both:
        worker.kill()
    with pytest.raises(RunError, match="has no workers"):
        make_executor(scheduler=address)


class Lost:
    """A job of which a cluster reports no result."""

    def __init__(self, status: str, error: Exception | None) -> None:
        self.status, self._error = status, error

    def exception(self) -> Exception | None:
        return self._error


def test_a_job_that_no_worker_survives_may_be_done_another_time() -> None:
    distributed = pytest.importorskip("distributed")
    killed = distributed.KilledWorker("job", None, 3)
    for lost in (Lost("error", killed), Lost("lost", None), Lost("cancelled", None)):
        failure = cluster._ended(lost).failure
        assert failure == Failure("the workers that did it were lost, again and again", outside=True)
    assert cluster._ended(Lost("error", MemoryError("all of it"))).failure == Failure(
        "MemoryError: all of it", outside=True
    )


def test_who_interrupts_a_study_ends_its_jobs_on_the_cluster(
    workers: tuple[str, list[subprocess.Popen[bytes]]], tmp_path: Path
) -> None:
    """Those that are being done, and those that wait; the workers do what they are asked for next."""
    begun = tmp_path / "begun"
    begun.mkdir()

    def interrupt() -> None:
        while len(list(begun.iterdir())) < 2:
            time.sleep(0.05)
        os.kill(os.getpid(), signal.SIGINT)

    with make_executor(scheduler=workers[0]) as there:
        before = signal.signal(
            signal.SIGINT, signal.default_int_handler
        )  # ignored where the tests run in the background
        threading.Thread(target=interrupt, daemon=True).start()
        with pytest.raises(KeyboardInterrupt):
            list(there.each([Task(linger, str(begun)) for _ in range(8)]))
        signal.signal(signal.SIGINT, before)
        since = time.monotonic()
        assert [ended.row for _, ended in there.each([Task(square, 2), Task(square, 3)])] in ([4, 9], [9, 4])
        assert time.monotonic() - since < 60.0  # of the 120 s that a job lasts
    processes = [int(path.name) for path in begun.iterdir()]
    assert len(processes) == 2
    for number in processes:
        with pytest.raises(ProcessLookupError):
            os.kill(number, 0)


def test_a_tuning_finds_on_a_cluster_what_it_finds_here(
    tmp_path: Path, workers: tuple[str, list[subprocess.Popen[bytes]]]
) -> None:
    """A plant's values, and an observer's beside a recording that the workers have to be given."""
    train = {"train_speed": 10.0, "wheel_rate": 10.0 / 0.575, "effort": 5e4}
    plant = Scenario(stop=0.1, step=0.01).add("train", model="locomotive", **{"as": "block3"}, parameters=train)
    plant.expect("signal", name="it is fast", signal="train.speed", start=0.05, min=10.1)
    studies: list[tuple[Scenario, dict[str, Any]]] = [
        (plant, {"parameters": {"train.mass": (60e3, 120e3)}, "cost": "-expectation:fast"}),
        (
            small(),
            {
                "parameters": {"balise_gain_position[1]": (0.1, 1.0)},
                "observer": "observer",
                "cost": "position_error_rms",
                "seeds": [0, 3],
            },
        ),
    ]
    for n, (scenario, asked) in enumerate(studies):
        more: dict[str, Any] = {"method": "hand", "iterations": 2}
        here = tune(scenario, **asked, **more)
        there = tune(scenario, **asked, **more, scheduler=workers[0], directory=tmp_path / str(n))
        assert there.to_data() == here.to_data()
