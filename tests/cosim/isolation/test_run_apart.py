"""A run in a process of its own: what kills it kills no script, and rows up to there are kept."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from test_fmus.events import DEEDS, hostile_fmu

from cosim import Scenario, load_result
from cosim.errors import CosimError
from cosim.runs.run_apart import isolated_unless_stated, where_it_runs
from plant_models.hybrid import HybridSystem, output_signal

pytestmark = [pytest.mark.compiler, pytest.mark.skipif(not Path("/proc/self/task").exists(), reason="Linux")]


def hostile(folder: Path, deed: str, **master: Any) -> Scenario:
    parameters = {"deed": float(DEEDS.index(deed))}
    scenario = Scenario(stop=0.5, step=0.01, master={"isolate": "run", **master})
    return scenario.add("bad", fmu=str(hostile_fmu(folder)), parameters=parameters)


def test_the_outcome_is_that_of_a_run_in_this_process(tmp_path: Path) -> None:
    heard: list[str] = []
    finished: list[Any] = []
    apart = hostile(tmp_path, "warns").run(warn=heard.append, finished=finished.append, call_log=tmp_path / "calls.log")
    here = hostile(tmp_path, "warns", isolate="no", log_calls=False).run(warn=lambda _: None)
    assert apart.failure is None
    assert apart.result.table.tobytes() == here.result.table.tobytes()
    assert "fmi2DoStep 25 times" in " ".join(heard)
    assert finished == [apart]
    assert "fmi2DoStep" in (tmp_path / "calls.log").read_text()


@pytest.mark.parametrize(
    ("deed", "words"), [("crashes", "SIGSEGV"), ("exits-at-once", "exit code 0"), ("hangs", "1 s")]
)
def test_what_ends_it_ends_the_run_alone_and_rows_are_kept(tmp_path: Path, deed: str, words: str) -> None:
    ended = hostile(tmp_path, deed, call_timeout=1.0).run(warn=lambda _: None)
    assert "component 'bad' in doStep at t = 0.24 s" in str(ended.failure)
    assert words in str(ended.failure)
    assert len(ended.result.table) == 25


def test_what_was_streamed_is_where_it_was_asked_for(tmp_path: Path) -> None:
    ended = hostile(tmp_path, "crashes").run(warn=lambda _: None, stream=tmp_path / "out")
    assert "SIGSEGV" in str(ended.failure)
    assert load_result(tmp_path / "out").table.tobytes() == ended.result.table.tobytes()


def test_what_cannot_begin_is_an_error(tmp_path: Path) -> None:
    with pytest.raises(CosimError, match="nothing"):
        hostile(tmp_path, "nothing").connect("bad.nothing -> bad.y").run(warn=lambda _: None)


@pytest.fixture
def nothing_said(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("FMU_OBSERVER_ISOLATE")
    monkeypatch.setenv("FMU_OBSERVER_CACHE", str(tmp_path / "cache"))  # where an FMU that crashed is remembered


def plain(folder: Path, deed: str = "nothing", **component: Any) -> Scenario:
    parameters = {"deed": float(DEEDS.index(deed))}
    scenario = Scenario(stop=0.5, step=0.01)
    return scenario.add("bad", fmu=str(hostile_fmu(folder)), parameters=parameters, **component)


@pytest.mark.usefixtures("nothing_said")
def test_where_nothing_is_said_an_fmu_of_others_takes_no_script_along(tmp_path: Path) -> None:
    reached: list[float] = []
    ended = plain(tmp_path, "crashes").run(warn=lambda _: None, progress=lambda t, _: reached.append(t))
    assert "SIGSEGV" in str(ended.failure)
    assert len(ended.result.table) == 25
    assert all(0.0 <= t <= 0.5 for t in reached)


@pytest.mark.usefixtures("nothing_said")
def test_where_a_run_is_made_follows_from_what_is_said_the_nearest_first(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert where_it_runs(plain(tmp_path)) == ("run", "")
    assert where_it_runs(plain(tmp_path, isolate="component")) == (None, "")  # each has its own
    assert where_it_runs(Scenario(stop=1.0, step=0.1).add("train", model="locomotive")) == (None, "")
    monkeypatch.setenv("FMU_OBSERVER_ISOLATE", "no")
    assert where_it_runs(plain(tmp_path)) == (None, "")
    with isolated_unless_stated("component"):
        assert where_it_runs(plain(tmp_path)) == ("component", "")
        with isolated_unless_stated(None):
            assert where_it_runs(plain(tmp_path)) == ("component", "")
        assert where_it_runs(plain(tmp_path).master(isolate="run")) == ("run", "")
    monkeypatch.setenv("FMU_OBSERVER_ISOLATE", "never")
    with pytest.raises(CosimError, match="FMU_OBSERVER_ISOLATE is 'never'; expected one of no, run, component"):
        plain(tmp_path).run()


@pytest.mark.usefixtures("nothing_said")
def test_what_cannot_be_sent_runs_here_and_a_note_says_so(tmp_path: Path) -> None:
    class Local(HybridSystem):
        name, description, source = "local", "known to this function", "a test"
        outputs = (output_signal("y", "1"),)

        def output(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
            return {"y": t}

    scenario = plain(tmp_path).add("local", model=Local)
    outcome = scenario.run(warn=lambda _: None)
    assert outcome.failure is None
    assert "share the process of the script" in " ".join(outcome.result.summary["notes"])


@pytest.mark.usefixtures("nothing_said")
def test_an_error_of_the_setup_is_the_same_wherever_it_is_found(tmp_path: Path) -> None:
    wrong = plain(tmp_path)
    next(tmp_path.rglob("*.fmu")).unlink()
    errors = []
    for isolate in ("run", "no"):
        with isolated_unless_stated(isolate), pytest.raises(CosimError) as found:  # type: ignore[arg-type]
            wrong.run(warn=lambda _: None)
        errors.append((type(found.value), str(found.value)))
    assert errors[0] == errors[1]
