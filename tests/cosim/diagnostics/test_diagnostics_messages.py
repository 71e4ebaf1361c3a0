"""What the components log: captured with time, category and status, from C FMUs of all versions and from blocks."""

from __future__ import annotations

import math
import tempfile
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from small_scenarios import small
from test_fmus.events import awkward_fmu, chatter

from cosim import Scenario
from cosim.components.loading import load_fmu
from cosim.diagnostics.messages import OMITTED, Message, MessageLog, in_order, read_messages, write_messages
from cosim.errors import CouplingError, ScenarioError
from cosim.report.live.render import live_page
from cosim.report.page.run_page import run_page
from cosim.results.results_folder import read_results
from fmus.fmi.native_log import _listeners

STEP = 0.05


def chatty(folder: Path, version: Any, log: Any, stop: float = 1.0) -> Scenario:
    """A chatty FMU beside a component that says nothing."""
    awkward_fmu(folder, "chatty", "chatty", version=version, at=0.25, every=0.125)
    scenario = Scenario(stop=stop, step=STEP, folder=folder)
    table = {} if log is None else {"log": log}
    return scenario.add("talker", fmu="chatty.fmu", parameters={"u": 2.5}, **table).add("quiet", fmu="chatty.fmu")


@pytest.mark.compiler
@pytest.mark.parametrize("stepper", ["python", "compiled"])
@pytest.mark.parametrize("version", [1, 2, 3])
def test_messages_come_with_arguments_times_categories_and_statuses(version: Any, stepper: str, tmp_path: Path) -> None:
    outcome = chatty(tmp_path, version, "all").master(stepper=stepper).run()
    assert outcome.failure is None
    said = chatter(1.0, 0.25, 0.125, 2.5)
    assert len(said) == 7
    words = ("ok", "warning", "discard", "error")
    assert [(words[w] if isinstance(w, int) else w, c, text) for _, w, c, text in said] == [
        (m.status, m.category, m.text) for m in outcome.result.messages
    ]
    for message, (when, *_) in zip(outcome.result.messages, said, strict=True):
        assert message.component == "talker"
        # said within the step that ends at or after `when`: the time is the start of that step
        assert message.time == pytest.approx((math.ceil(when / STEP - 1e-9) - 1) * STEP, abs=1e-12)


@pytest.mark.compiler
@pytest.mark.parametrize("version", [2, 3])
def test_only_the_categories_asked_for_are_logged(version: Any, tmp_path: Path) -> None:
    outcome = chatty(tmp_path, version, ["logEvents", "logAll"]).run()
    assert {m.category for m in outcome.result.messages} == {"logEvents", "logAll"}
    everything = chatter(1.0, 0.25, 0.125, 2.5)
    assert len(outcome.result.messages) == sum(category != "logStatusWarning" for _, _, category, _ in everything)


@pytest.mark.compiler
@pytest.mark.parametrize("log", ["errors", "none", None])
def test_how_much_is_logged(log: Any, tmp_path: Path) -> None:
    outcome = chatty(tmp_path, 2, log).run()
    assert {m.status for m in outcome.result.messages} == ({"warning"} if log == "errors" else set())


@pytest.mark.compiler
def test_an_unknown_category_is_refused_with_those_there_are(tmp_path: Path) -> None:
    with pytest.raises(
        CouplingError, match=r"talker: log: there is no log category 'logEvent'; did you mean 'logEvents'"
    ):
        chatty(tmp_path, 3, ["logEvent"]).run()
    with pytest.raises(CouplingError, match="declares none; use log = 'all'"):
        chatty(tmp_path, 1, ["logEvents"]).run()
    with pytest.raises(ScenarioError, match=r"components\.talker\.log"):
        chatty(tmp_path, 3, "everything").run()


@pytest.mark.compiler
@pytest.mark.parametrize("version", [1, 2])
def test_two_instances_of_one_fmu_are_distinguished(version: Any, tmp_path: Path) -> None:
    scenario = chatty(tmp_path, version, "all").set("quiet.log", "all").set("quiet.u", -1.0)
    found = scenario.run().result.messages
    for name, u in (("talker", 2.5), ("quiet", -1.0)):
        assert [m.text for m in found if m.component == name] == [text for *_, text in chatter(1.0, 0.25, 0.125, u)]


@pytest.mark.compiler
def test_two_instances_of_one_name_are_distinguished(tmp_path: Path) -> None:
    """While an FMU is probed, there is another one of its name."""
    path = awkward_fmu(tmp_path, "chatty", "chatty", version=2, at=0.05, every=0.1)
    run, probed = (load_fmu(path, "plant") for _ in range(2))
    for made, u in ((run, 1.0), (probed, 7.0)):
        made.choose_log("all")
        made.instantiate()
        made.set_start("u", u)
        made.enter_initialization(0.0, 1.0)
        made.exit_initialization()
    for made in (probed, run):
        made.advance(0.0, 0.2)
    assert [m.text for m in run.messages] == [text for *_, text in chatter(0.2, 0.05, 0.1, 1.0)]
    assert [m.text for m in probed.messages] == [text for *_, text in chatter(0.2, 0.05, 0.1, 7.0)]
    for made in (run, probed):
        made.free()


@pytest.mark.compiler
def test_what_went_wrong_is_part_of_the_failure_and_not_what_was_said_after(tmp_path: Path) -> None:
    awkward_fmu(tmp_path, "fails", "fails", version=2)
    outcome = Scenario(stop=1.0, step=STEP, folder=tmp_path).add("plant", fmu="fails.fmu", log="all").run()
    assert outcome.failure is not None
    assert "The FMU says: the solver gave up at 0.25 s" in outcome.failure
    (message,) = (m for m in outcome.result.messages if m.status == "error")
    assert (message.component, message.category, message.text) == (
        "plant",
        "logStatusError",
        "the solver gave up at 0.25 s",
    )
    assert message.time == pytest.approx(0.2, abs=1e-12)
    assert any("plant logged 1 of status error" in warning for warning in outcome.warnings)


@pytest.mark.compiler
def test_a_freed_component_is_forgotten(tmp_path: Path) -> None:
    path = awkward_fmu(tmp_path, "chatty", "chatty", version=2)
    before = len(_listeners)
    component = load_fmu(path, "talker")
    component.instantiate()
    assert len(_listeners) == before + 1
    component.free()
    assert len(_listeners) == before


@pytest.mark.parametrize("backend", ["block2", "block3"])
def test_blocks_log_like_fmus(backend: str, tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    scenario = small()
    scenario.balises(latency=0.05).set("observer.as", backend).set("observer.late_policy", "reject")
    outcome = scenario.run()
    rejected = outcome.result.summary["components"][-1]["events"]["rejected"]
    assert rejected > 0
    assert [(m.component, m.status, m.category) for m in outcome.result.messages] == [
        ("observer", "warning", "logStatusWarning")
    ] * rejected
    assert all("it is rejected" in m.text for m in outcome.result.messages)
    assert not [r for r in caplog.records if "rejected" in r.getMessage() and r.name != "cosim"]
    page = live_page(run_page(outcome.result, outcome.spec))
    assert "Messages of the components" in page
    paths = outcome.write(tmp_path, report=False)
    assert read_messages(paths["messages"]) == list(outcome.result.messages)
    assert list(read_results(tmp_path).messages) == list(outcome.result.messages)


@given(first=st.integers(0, 5), last=st.integers(1, 5), count=st.integers(0, 30))
def test_the_first_and_last_are_kept_and_all_are_counted(first: int, last: int, count: int) -> None:
    log = MessageLog("a", first, last)
    for i in range(count):
        log.add(float(i), f"message {i}", i % 2, b"c")
    kept = [m.text for m in log.kept() if m.status != OMITTED]
    reported = [f"message {i}" for i in range(count)]
    assert kept == (reported if count <= first + last else reported[:first] + reported[-last:])
    omitted = [m.text for m in log.kept() if m.status == OMITTED]
    assert omitted == (
        [f"{count - first - last} messages here were counted and not kept"] if count > first + last else []
    )
    assert log.total == count == sum(log.counts.values())


def test_memory_stays_bounded_and_the_reason_is_the_last_thing_wrong() -> None:
    log = MessageLog("a")
    log.add(0.0, b"broken: \xff", 3)
    for _ in range(10_000):
        log.add(1.0, "x" * 10_000, 0)
    assert sum(len(m.text) for m in log.kept()) < 2_000_000
    assert log.reason.startswith("broken: ")
    log.add(2.0, "  \n", 3)
    assert log.total == 10_001


text = st.text(st.characters(codec="utf-8", exclude_characters="\0"), min_size=1).filter(lambda t: t.strip() == t)


@given(st.lists(st.builds(Message, st.floats(allow_nan=False), text, text, st.sampled_from(["ok", "error"]), text)))
def test_files_give_back_what_was_written(messages: list[Message]) -> None:
    with tempfile.TemporaryDirectory() as folder:
        write_messages(Path(folder) / "messages.csv", messages)
        assert read_messages(Path(folder) / "messages.csv") == messages


def test_messages_of_several_components_come_in_order_of_time() -> None:
    logs = [MessageLog("a"), MessageLog("b")]
    logs[0].add(2.0, "late")
    logs[1].add(math.nan, "at instantiation")
    logs[1].add(1.0, "early")
    assert [m.text for m in in_order(logs)] == ["at instantiation", "early", "late"]


def test_a_file_of_something_else_is_refused(tmp_path: Path) -> None:
    (tmp_path / "messages.csv").write_text("a,b\n1,2\n")
    with pytest.raises(ValueError, match="expected the columns time, component"):
        read_messages(tmp_path / "messages.csv")
