"""A run in a process of its own: what kills it kills no script, and rows up to there are kept."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from test_fmus.events import DEEDS, hostile_fmu

from cosim import Scenario, load_result
from cosim.errors import CosimError

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
