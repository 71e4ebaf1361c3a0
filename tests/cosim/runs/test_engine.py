"""The engine of runs: the table does not depend on where, in which order, and in how many sittings jobs are done."""

from __future__ import annotations

import json
import os
import shutil
import sys
from collections.abc import Iterator, Sequence
from functools import partial
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, ClassVar

import pytest
from hypothesis import given
from hypothesis import strategies as st
from test_fmus.events import DEEDS, hostile_fmu
from worker_tasks import Task, square

from cosim import Scenario
from cosim.cli import main
from cosim.errors import OutputError, RunError
from cosim.runs import cluster
from cosim.runs.engine import run_jobs
from cosim.runs.executors import Executor, InThisProcess, make_executor
from cosim.runs.journal import EARLIER, JOURNAL, Journal, read_lines
from cosim.runs.keys import _file_content, code_content
from cosim.runs.run import Run
from cosim.runs.workers import Team
from cosim.studies.sweep_result import SweepResult


@pytest.fixture(scope="module")
def team() -> Iterator[Team]:
    with Team(2) as team:
        yield team


def table(arguments: Sequence[Any], executor: Executor, journal: Journal | None = None) -> dict[int, Any]:
    """Rows and failures by number."""
    jobs = [Task(measure, argument) for argument in arguments]
    return {done.number: (done.row, done.failure) for done in run_jobs(jobs, executor, journal)}


def measure(argument: Any) -> Any:
    return {"number": square(argument)}


@given(data=st.data(), arguments=st.lists(st.floats(-1e9, 1e9) | st.just("raise"), min_size=1, max_size=8, unique=True))
def test_the_table_does_not_depend_on_workers_order_and_sittings(data: Any, arguments: list[Any], team: Team) -> None:
    whole = table(arguments, InThisProcess())
    assert table(arguments, team) == whole
    order = data.draw(st.permutations(range(len(arguments))))
    shuffled = table([arguments[n] for n in order], InThisProcess())
    assert {order[n]: row for n, row in shuffled.items()} == whole
    first = data.draw(st.integers(0, len(arguments)))
    with TemporaryDirectory() as folder:
        begun = run_jobs([Task(measure, a) for a in arguments], InThisProcess(), Journal(Path(folder)))
        for _ in range(first):
            next(begun)
        begun.close()  # type: ignore[attr-defined]
        with (Path(folder) / JOURNAL).open("a") as file:
            file.write('{"key": "cut o')
        resumed = table(arguments, team, Journal(Path(folder), resume=True))
        assert resumed == whole
        assert not (Path(folder) / EARLIER).exists()  # gone on with, and not begun anew
        assert len(read_lines(Path(folder) / JOURNAL)) == len(arguments)


@pytest.fixture(scope="module")
def fmu(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return hostile_fmu(tmp_path_factory.mktemp("hostile"))


def three(fmu: Path) -> Scenario:
    return Scenario(stop=0.5, step=0.01, master={"isolate": "no"}).add("bad", fmu=str(fmu))


DEED = {"bad.deed": [0.0, float(DEEDS.index("crashes")), 0.0], "stop": [0.4, 0.5, 0.5]}


@pytest.mark.compiler
@pytest.mark.skipif(not hasattr(os, "fork"), reason="the crash is a signal")
def test_a_crash_in_the_second_of_three_runs_with_one_worker_is_a_row(fmu: Path, tmp_path: Path) -> None:
    sweep = three(fmu).vary(DEED, "zip")
    way = {"y": lambda outcome: float(outcome["bad.y"][-1])}
    result = sweep.run(measure=way, directory=tmp_path)
    crashed(result)
    before = (tmp_path / JOURNAL).read_text()
    again = sweep.run(measure=way, directory=tmp_path, resume=True)
    crashed(again)
    assert again.table()[0] == result.table()[0]
    assert (tmp_path / JOURNAL).read_text() == before  # the failure is the run's own: nothing is done again
    crashed(sweep.run(measure=way, directory=tmp_path, resume=True, retry=True))
    assert len(read_lines(tmp_path / JOURNAL)) == 4


def crashed(result: SweepResult) -> None:
    assert [run.failure is None for run in result.runs] == [True, False, True]
    words = "component 'bad' in doStep at t = 0.24 s: its process was ended by the signal SIGSEGV"
    assert result[1].failure == words
    assert [result[n].measures["y"] for n in (0, 2)] == pytest.approx([0.4, 0.5])


@pytest.mark.compiler
def test_only_scenarios_with_code_of_others_are_run_apart(fmu: Path) -> None:
    plant = Scenario(stop=0.2, step=0.01).add("train", model="locomotive", **{"as": "block3"})
    assert Run(three(fmu)).apart
    assert not Run(plant).apart
    assert Run(plant, {"train.fmu": str(fmu)}).apart
    assert Run(plant, {"master.call_timeout": 1.0}).apart
    assert not Run(plant, {"master.call_timeout": -1.0}).apart  # what it cannot be is said by the run


HARMFUL = """
import ctypes, os, re

class Harmful:
    inputs, outputs = (), ("y",)

    def __init__(self, deed=0.0):
        self.deed = deed

    def step(self, t, inputs, dt):
        if t > 0.245 and self.deed == 1.0:
            os._exit(0)
        if t > 0.245 and self.deed == 2.0:
            ctypes.string_at(0)
        if t > 0.245 and self.deed == 3.0:
            re.fullmatch("(a+)+", 50 * "a" + "b")
        return {"y": t}
"""


@pytest.mark.skipif(not hasattr(os, "fork"), reason="the crash is a signal")
def test_a_python_model_that_ends_its_process_or_hangs_is_a_row_where_calls_are_limited(tmp_path: Path) -> None:
    (tmp_path / "harmful.py").write_text(HARMFUL)
    scenario = Scenario(folder=tmp_path, stop=0.5, step=0.01, master={"call_timeout": 1.0})
    scenario.add("own", model="harmful.py:Harmful")
    found = [run.failure for run in scenario.vary({"own.deed": [0.0, 1.0, 2.0, 3.0, 0.0]}).run().runs]
    where = "component 'own' in doStep at t = 0.25 s"
    assert found == [
        None,
        f"{where}: its process ended with exit code 0",
        f"{where}: its process was ended by the signal SIGSEGV",
        f"{where} has not returned for 1 s, the limit of a call, which call_timeout sets",
        None,
    ]


@pytest.mark.compiler
def test_a_key_is_of_contents_and_not_of_places(fmu: Path, tmp_path: Path) -> None:
    key = Run(three(fmu)).key
    moved = Path(shutil.copy(fmu, tmp_path / "other.fmu"))
    assert _file_content(moved) != _file_content(fmu)  # its name may be part of what is read
    moved = Path(shutil.copy(fmu, tmp_path / fmu.name))
    assert Run(three(moved)).key == key
    others = [Run(three(moved), {"seed": 1}), Run(three(moved), {"bad.deed": 1.0}), Run(three(moved), rests_on="other")]
    assert len({key, *(run.key for run in others)}) == 4
    assert Run(three(moved).set("bad.deed", 1.0)).key == others[1].key  # wherever it is set
    with moved.open("ab") as file:
        file.write(b" ")
    assert Run(three(moved)).key != key


def test_whoever_forgets_to_resume_has_lost_nothing(tmp_path: Path) -> None:
    table([1.0], InThisProcess(), Journal(tmp_path))
    first = (tmp_path / JOURNAL).read_text()
    table([2.0], InThisProcess(), Journal(tmp_path))
    assert (tmp_path / EARLIER).read_text() == first
    assert len(read_lines(tmp_path / JOURNAL)) == 1


@pytest.mark.parametrize("name", [JOURNAL, "evaluations.jsonl", "../seeds.csv"])
def test_a_journal_of_version_0_1_is_refused_in_words(tmp_path: Path, name: str) -> None:
    folder = tmp_path / "study"
    folder.mkdir()
    former = {"key": "9f", "settings": {}, "measures": {}, "failure": None, "faults": [], "folder": None}
    (folder / name).write_text(json.dumps(former) + "\n")
    with pytest.raises(OutputError, match=r"was written by version 0\.1.*Run without resuming"):
        Journal(folder, resume=True)
    Journal(folder)  # anew it may


def test_a_command_refuses_to_resume_what_is_too_old(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    scenario = Scenario(stop=0.2, step=0.01).add("train", model="locomotive", **{"as": "block3"})
    path, out = str(scenario.save(tmp_path / "plain.toml")), tmp_path / "out"
    out.mkdir()
    (out / JOURNAL).write_text(json.dumps({"key": "9f", "measures": {}}) + "\n")
    words = ["sweep", path, "--vary", "stop=0.1", "--table-only", "--quiet", "--out", str(out)]
    assert main([*words, "--resume"]) == 2
    assert "was written by version 0.1" in capsys.readouterr().err
    assert main(words) == 0


def test_results_of_another_number_are_no_results_of_this_run(tmp_path: Path) -> None:
    """A sweep that is longer than the one it goes on from: a folder holds the run of its number."""
    plant = Scenario(stop=0.2, step=0.01).add("train", model="locomotive", **{"as": "block3"})
    plant.vary({"stop": [0.1, 0.3]}).run(directory=tmp_path)
    resumed = plant.vary({"stop": [0.1, 0.2, 0.3]}).run(directory=tmp_path, resume=True, keep=False)
    assert [float(run.result.time[-1]) for run in resumed.runs if run.result] == pytest.approx([0.1, 0.2, 0.3])


def test_a_scheduler_without_its_packages_is_refused_in_words(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cluster, "distributed", None)
    with pytest.raises(OutputError, match=r"needs dask.distributed: pip install 'distributed>="):
        make_executor(scheduler="tcp://nowhere:1")


FUNCTION = "def half(_outcome):\n    return {value}\n\n\ndef make(value):\n    return lambda outcome: value\n"


def test_an_own_measure_that_was_changed_is_taken_anew(tmp_path: Path) -> None:
    sweep = Scenario(stop=0.02, step=0.01).add("train", model="locomotive", **{"as": "block3"}).vary({"seed": [0]})
    file = tmp_path / "measure_of_a_user.py"
    for value in (0.5, 1.5, 1.5, 0.5):
        file.write_text(FUNCTION.format(value=value))
        module = loaded(file)
        for measure in (module.half, module.make(value), partial(lambda wanted, _outcome: wanted, value)):
            found = sweep.run(directory=tmp_path / "out", folders=False, resume=True, measure={"own": measure})
            assert found[0].measures["own"] == value


def loaded(file: Path) -> Any:
    spec = spec_from_file_location(file.stem, file)
    assert spec is not None
    module = sys.modules[file.stem] = module_from_spec(spec)
    exec(compile(file.read_text(), str(file), "exec"), module.__dict__)  # no byte code of an earlier second
    return module


def test_a_function_of_which_nothing_changed_is_known_again(tmp_path: Path) -> None:
    file = tmp_path / "measure_of_a_user.py"
    file.write_text(FUNCTION.format(value=1.0))
    first, again = loaded(file), loaded(file)
    assert code_content(first.half) == code_content(again.half) != code_content(first.make(1.0))
    assert code_content(first.make(1.0)) == code_content(again.make(1.0)) != code_content(first.make(2.0))
    assert code_content(partial(first.make, 1)) != code_content(partial(first.make, 2))


class Doubling:
    """A model of a script that no other process can be sent."""

    inputs: ClassVar[dict[str, str]] = {}
    outputs: ClassVar[dict[str, str]] = {"y": "s"}

    def __init__(self) -> None:
        self.rule = lambda t: 2.0 * t

    def step(self, t: float, _h: float, _u: Any) -> dict[str, float]:
        return {"y": self.rule(t)}


@pytest.mark.compiler
def test_what_cannot_be_sent_is_run_here_and_refused_in_words_elsewhere(fmu: Path) -> None:
    sweep = three(fmu).add("own", model=Doubling()).vary({"stop": [0.1, 0.2]})
    assert [run.failure for run in sweep.run().runs] == [None, None]
    with pytest.raises(RunError, match=r"cannot be passed to a process of its own: .*Run with one worker"):
        sweep.run(workers=2)
