"""The call log and the counts of calls, against the sequence of calls that the standard and the run prescribe."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from coupled_runs import prepare
from hypothesis import given
from hypothesis import strategies as st
from mock_slaves import FMI2, Counter, Mock, component
from small_scenarios import small
from test_fmus.build import linear_fmu
from test_fmus.events import awkward_fmu
from test_fmus.typed import typed_fmu

from cosim import Scenario
from cosim.cli import main
from cosim.components.loading import load_fmu
from cosim.components.logged_slave import log_calls
from cosim.diagnostics.call_log import HEADER, CallLog, _DescribedCall
from cosim.diagnostics.call_statistics import EARLY, EVERY, CallStatistics
from cosim.errors import OutputError
from cosim.evaluation.cost import cost_table
from cosim.master.master import close
from cosim.report.live.render import live_page
from cosim.report.page.run_page import run_page

LINE = re.compile(
    r"(?P<time>\S+) (?P<who>\S+) (?P<what>\w+)\((?P<arguments>.*)\) -> (?P<status>[\w ]+), (?P<us>[\d.]+) us(, "
    r"(?P<out>.*))?"
)
TESTS = Path(__file__).parents[2]
INTEGRATOR: Any = {"A": [[0.0]], "B": [[1.0]], "C": [[1.0]], "D": [[0.0]], "inputs": ["u"], "outputs": ["y"]}


def calls_in(path: Path) -> list[dict[str, str]]:
    first, *lines = path.read_text(encoding="utf-8").splitlines(keepends=True)
    assert first == HEADER
    found = [LINE.fullmatch(line.rstrip("\n")) for line in lines]
    assert all(found), [line for line, m in zip(lines, found, strict=True) if not m]
    return [m.groupdict() for m in found if m]


def pair(folder: Path, version: Any) -> Scenario:
    """An integrator of a constant 2, and an integrator of that."""
    linear_fmu(folder, "integrator", version=version, **INTEGRATOR)
    scenario = Scenario(stop=0.3, step=0.1, folder=folder)
    scenario.add("first", fmu="integrator.fmu", parameters={"u": 2.0}).add("second", fmu="integrator.fmu")
    return scenario.connect("first.y -> second.u")


VALUES = "(?:(?:Set|Get)(?:Real|Float64))*"
LIFE = {
    1: f"InstantiateSlave{VALUES}InitializeSlave(?:(?:Set|Get)(?:Real|Float64)|DoStep)*TerminateSlaveFreeSlaveInstance",
    2: f"Instantiate{VALUES}SetupExperimentEnterInitializationMode{VALUES}ExitInitializationMode"
    f"(?:(?:Set|Get)(?:Real|Float64)|DoStep)*TerminateFreeInstance",
    3: f"InstantiateCoSimulation{VALUES}EnterInitializationMode{VALUES}ExitInitializationMode"
    f"(?:(?:Set|Get)(?:Real|Float64)|DoStep)*TerminateFreeInstance",
}
"""The life of a slave that saves no state, as the state machines of the standards allow it."""


@pytest.mark.compiler
@pytest.mark.parametrize("version", [1, 2, 3])
def test_a_native_run_is_logged_call_by_call(version: Any, tmp_path: Path) -> None:
    outcome = pair(tmp_path, version).run(call_log=tmp_path / "calls.log", warn=lambda _: None)
    assert outcome.failure is None
    calls = calls_in(tmp_path / "calls.log")
    for name in ("first", "second"):
        own = "".join(c["what"].removeprefix(f"fmi{version}") for c in calls if c["who"] == name)
        assert re.fullmatch(LIFE[version], own), own
    assert (calls[0]["time"], calls[-1]["time"]) == ("-", "0.3")
    begin = next(i for i, c in enumerate(calls) if c["what"].endswith("DoStep"))
    end = next(i for i, c in enumerate(calls) if "Terminate" in c["what"]) - 1
    real = "Float64" if version == 3 else "Real"
    one_step = [
        ("first", "DoStep"),
        ("first", f"Get{real}"),
        ("second", f"Set{real}"),
        ("second", "DoStep"),
        ("second", f"Get{real}"),
    ]
    assert [(c["who"], c["what"].removeprefix(f"fmi{version}")) for c in calls[begin:end]] == 3 * one_step
    # what was set is read back as initialisation ends, before anything is set again, and after the last step
    for back in (calls[begin - 2], calls[end]):
        assert (back["who"], back["arguments"], back["out"]) == ("first", "u", "2")
    for k in range(3):
        step, read, write, _, _ = calls[begin + 5 * k : begin + 5 * (k + 1)]
        assert float(step["time"]) == pytest.approx(0.1 * k, abs=1e-12)
        assert float(re.findall(r"communicationStepSize=([^,]+)", step["arguments"])[0]) == pytest.approx(0.1)
        assert (read["arguments"], float(read["out"])) == ("y", pytest.approx(2.0 * 0.1 * (k + 1)))
        assert write["arguments"] == f"u={read['out']}"
    assert {c["status"] for c in calls[begin:end]} == {"ok"}
    assert all(0.0 <= float(c["us"]) < 1e6 for c in calls)


@pytest.mark.parametrize("kind", [Counter, type("Counter2", (FMI2, Counter), {})])
def test_a_run_of_blocks_is_logged_call_by_call(kind: type[Mock], tmp_path: Path) -> None:
    a, b = component(kind(), "a"), component(kind(), "b")
    log = CallLog(tmp_path / "calls.log")
    for each in (a, b):
        log_calls(each, log)
    master = prepare([a, b], [("a.total", "b.rate")], 0.5, 2)
    master.run()
    close(master.plan)
    log.close()
    calls = calls_in(tmp_path / "calls.log")
    assert log.count == len(calls)
    begin = next(i for i, c in enumerate(calls) if c["what"] == "doStep")
    real = "Real" if kind.version == 2 else "Float64"
    steps = [(c["time"], c["who"], c["what"], c["arguments"], c["out"]) for c in calls[begin:-4]]
    results = (None, None) if kind.version == 2 else ("[False, False, False, 0.5]", "[False, False, False, 1]")
    further = ", True" if kind.version == 2 else ""  # nothing is saved, so nothing leads back
    expected = []
    for k, (t, until) in enumerate((("0", "0.5"), ("0.5", "1"))):
        total, second = ("0.5", "0.25") if k == 0 else ("1", "0.75")
        expected += [
            (t, "a", "doStep", f"{t}, 0.5{further}", results[k]),
            (until, "a", f"get{real}", "total", f"[{total}]"),
            (t, "b", f"set{real}", f"rate={total}", None),
            (t, "b", "doStep", f"{t}, 0.5{further}", results[k]),
            (until, "b", f"get{real}", "total", f"[{second}]"),
        ]
    assert steps == expected
    assert [c["what"] for c in calls[-4:]] == ["terminate", "freeInstance"] * 2


@pytest.mark.compiler
@pytest.mark.parametrize("version", [1, 2, 3])
def test_each_name_stands_with_its_value_and_long_lists_are_cut(version: Any, tmp_path: Path) -> None:
    names = [f"u{i}" for i in range(1, 9)]
    rows = {"A": [[0.0]], "B": [[1.0] * 8], "C": [[1.0]], "D": [[0.0] * 8]}
    made = load_fmu(linear_fmu(tmp_path, "wide", *rows.values(), version=version), "wide")
    log = CallLog(tmp_path / "calls.log")
    log_calls(made, log)
    made.instantiate()
    for count in (2, 8):
        write, buffer = made.writer(names[:count])
        buffer[:] = range(1, count + 1)
        write()
    made.free()
    log.close()
    written = [c["arguments"] for c in calls_in(tmp_path / "calls.log") if "Set" in c["what"]]
    assert written == ["u1=1, u2=2", "u1=1, u2=2, u3=3, u4=4, u5=5, u6=6, ... 8 in all"]


@pytest.mark.compiler
def test_logging_changes_no_number(tmp_path: Path) -> None:
    for scenario in (pair(tmp_path, 2), small()):
        plain, logged = (
            scenario.run(warn=lambda _: None),
            scenario.run(call_log=tmp_path / "calls.log", warn=lambda _: None),
        )
        assert (plain.result.table == logged.result.table).all()
        assert (
            logged.result.summary["components"][0]["cost"]["doStep"]["calls"]
            == plain.result.summary["components"][0]["cost"]["doStep"]["calls"]
        )


@pytest.mark.compiler
def test_a_failing_call_is_logged_with_its_status(tmp_path: Path) -> None:
    awkward_fmu(tmp_path, "fails", "fails", version=2)
    scenario = Scenario(stop=1.0, step=0.1, folder=tmp_path).add("plant", fmu="fails.fmu")
    assert scenario.run(call_log=tmp_path / "calls.log", warn=lambda _: None).failure is not None
    last = [c for c in calls_in(tmp_path / "calls.log") if c["what"] == "fmi2DoStep"][-1]
    assert last["status"] == "error"


@pytest.mark.compiler
def test_values_of_every_type_can_be_logged(tmp_path: Path) -> None:
    typed_fmu(tmp_path, "typed")
    scenario = Scenario(stop=0.2, step=0.1, folder=tmp_path).add("a", fmu="typed.fmu").add("b", fmu="typed.fmu")
    scenario.connect(
        "a.y_string -> b.u_string", "a.y_binary -> b.u_binary", "a.y_matrix -> b.u_matrix", "a.y_uint64 -> b.u_uint64"
    )
    assert scenario.run(call_log=tmp_path / "calls.log", warn=lambda _: None).failure is None
    functions = {c["what"] for c in calls_in(tmp_path / "calls.log")}
    assert {
        f"fmi3{verb}{kind}" for verb in ("Get", "Set") for kind in ("String", "Binary", "Float64", "UInt64")
    } <= functions


KILLED = """
import os, signal, sys
sys.path[:0] = [TESTS]
from pathlib import Path
from cosim import Scenario
from cosim.components.component import Component
Component.note = lambda *_: os.kill(os.getpid(), signal.SIGKILL)  # while the FMU is inside doStep
scenario = Scenario(stop=1.0, step=0.1, folder=FOLDER).add("talker", fmu="chatty.fmu", log="all").add("other", fmu="chatty.fmu")
scenario.run(call_log=Path(FOLDER) / "calls.log", warn=lambda _: None)
"""  # noqa: E501


@pytest.mark.compiler
@pytest.mark.parametrize("version", [2, 3])
def test_the_log_of_a_killed_process_ends_with_the_last_call_begun(version: Any, tmp_path: Path) -> None:
    awkward_fmu(tmp_path, "chatty", "chatty", version=version, at=0.25)
    code = KILLED.replace("TESTS", repr(str(TESTS))).replace("FOLDER", repr(str(tmp_path)))
    ended = subprocess.run([sys.executable, "-c", code], check=False, capture_output=True, text=True, cwd=TESTS.parent)
    assert ended.returncode == -9, ended.stderr
    *lines, last = (tmp_path / "calls.log").read_text().split("\n")
    assert all(" -> " in line for line in lines[1:])
    assert " -> " not in last
    time, who, call = last.split(" ", 2)
    assert (float(time), who) == (pytest.approx(0.2), "talker")
    assert call.startswith(f"fmi{version}DoStep(currentCommunicationPoint=0.2, communicationStepSize=0.1")


def test_a_call_within_a_call_and_one_that_raises(tmp_path: Path) -> None:
    log = CallLog(tmp_path / "calls.log")
    words = _DescribedCall("outer()", lambda _: ("ok", ""))
    inner = _DescribedCall("inner(x=1)", lambda _: ("warning", "2.5"))
    log.call(1.0, "a", words, lambda: log.call(1.5, "b", inner, int))
    with pytest.raises(ZeroDivisionError):
        log.call(2.0, "a", words, lambda: 1 // 0)
    log.close()
    lines = [re.sub(r"[\d.]+ us", "t us", line) for line in (tmp_path / "calls.log").read_text().splitlines()[1:]]
    assert lines == [
        "1 a outer()",
        "1.5 b inner(x=1) -> warning, t us, 2.5",
        "... outer() -> ok, t us",
        "2 a outer() -> ZeroDivisionError, t us",
    ]
    log.call(3.0, "a", words, int)  # after the end: no error, no line
    assert len((tmp_path / "calls.log").read_text().splitlines()) == 5


def test_a_log_that_cannot_be_written(tmp_path: Path) -> None:
    with pytest.raises(OutputError, match=r"cannot be written to .*No such file"):
        CallLog(tmp_path / "nowhere" / "calls.log")
    with pytest.raises(OutputError, match="call log cannot be written"):
        small().run(call_log=tmp_path / "nowhere" / "calls.log")


def test_a_log_that_breaks_later_is_reported(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    import cosim.diagnostics.call_log as module

    written: list[bytes] = []

    def write(_file: int, data: bytes) -> int:
        written.append(data)
        if len(written) > 50:
            raise OSError(28, "No space left on device")
        return len(data)

    monkeypatch.setattr(module.os, "write", write)
    outcome = small().run(call_log=tmp_path / "calls.log", warn=lambda _: None)
    assert outcome.failure is None
    assert any("ends after 25 calls: No space left on device" in w for w in outcome.warnings)
    assert len(written) == 51


def test_the_command_line_logs_calls_beside_the_results(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Any
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "own.toml").write_text(
        'stop = 0.2\nstep = 0.1\n[components.driver]\nmodel = "driver"\nas = "block3"\n'
        "parameters = { odometer = 0.0 }\n",
        encoding="utf-8",
    )
    quiet = ["run", "own.toml", "--quiet", "--no-report"]
    assert main([*quiet, "--log-calls"]) == 0
    assert "results/own/calls.log" in capsys.readouterr().out
    assert {c["who"] for c in calls_in(Path("results/own/calls.log"))} == {"driver"}
    assert main(quiet) == 0
    assert not Path("results/own/calls.log").exists()  # it would not belong to these results
    assert main([*quiet, "--log-calls", "elsewhere.log"]) == 0
    assert main([*quiet, "--set", "master.log_calls=true"]) == 0
    assert len(calls_in(Path("elsewhere.log"))) == len(calls_in(Path("results/own/calls.log")))


# -- counts
# -------------------------------------------------------------------------------------------------------------


@given(
    st.lists(st.integers(0, 3 * EVERY), min_size=1, max_size=4),
    st.lists(st.tuples(st.integers(0, 9), st.floats(0, 9)), max_size=3),
)
def test_a_tally_counts_every_call_of_every_port(ports: list[int], added: list[tuple[int, float]]) -> None:
    call_statistics, made = CallStatistics(), []
    for number, count in enumerate(ports):
        call = call_statistics.counting(lambda number=number: made.append(number), ValueError)  # type: ignore[misc]
        for _ in range(count):
            call()
    for count, seconds in added:
        call_statistics.add(seconds, count)
    assert (
        call_statistics.count
        == len(made) + sum(count for count, _ in added)
        == sum(ports) + sum(count for count, _ in added)
    )
    assert [made.count(number) for number in range(len(ports))] == ports
    assert call_statistics.seconds >= 0.0


def test_time_is_extrapolated_from_the_calls_that_were_timed(monkeypatch: pytest.MonkeyPatch) -> None:
    import cosim.diagnostics.call_statistics as module

    now = [0.0]
    monkeypatch.setattr(module, "perf_counter", lambda: now[0])

    def slow() -> None:
        now[0] += 2.0

    call_statistics = CallStatistics()
    call = call_statistics.counting(slow, ValueError)
    for _ in range(EARLY + EVERY + 5):
        call()
    assert call_statistics.seconds == pytest.approx(2.0 * (EARLY + EVERY + 5))


def test_a_call_that_fails_is_explained_and_counted() -> None:
    call_statistics = CallStatistics()

    def fail() -> None:
        raise KeyError("x")

    call = call_statistics.counting(fail, lambda error: ValueError(f"explained: {error}"))
    for _ in range(EARLY + 2):
        with pytest.raises(ValueError, match="explained: 'x'"):
            call()
    assert call_statistics.count == EARLY + 2


def counted(scenario: Scenario, tmp_path: Path) -> tuple[dict[str, Any], dict[str, dict[str, int]]]:
    """What a run counts, and what its call log shows."""
    outcome = scenario.run(call_log=tmp_path / "calls.log", warn=lambda _: None)
    assert outcome.failure is None
    logged: dict[str, dict[str, int]] = {}
    for call in calls_in(tmp_path / "calls.log"):
        name = re.sub(r"^fmi[123]", "", call["what"])
        own = logged.setdefault(call["who"], {})
        own[name[:1].lower() + name[1:]] = own.get(name[:1].lower() + name[1:], 0) + 1
    return {c["name"]: c["cost"] for c in outcome.result.summary["components"]}, logged


@pytest.mark.parametrize("version", [2, 3])
def test_counts_are_those_of_the_call_log(version: int, tmp_path: Path) -> None:
    scenario = small()
    for name in ("locomotive", "odometer", "driver", "observer"):
        scenario.set(f"{name}.as", f"block{version}")
    cost, logged = counted(scenario, tmp_path)
    state = "FMUstate" if version == 2 else "FMUState"
    for name, kinds in cost.items():
        assert kinds["doStep"]["calls"] == logged[name]["doStep"]
        assert all(entry["seconds"] >= 0.0 for entry in kinds.values())
    locomotive = cost["locomotive"]
    assert locomotive["save"]["calls"] == logged["locomotive"][f"get{state}"] > 0
    assert locomotive["restore"]["calls"] == logged["locomotive"][f"set{state}"] > 0
    assert locomotive["release"]["calls"] == logged["locomotive"][f"free{state}"] > 0
    assert cost["odometer"]["get"]["calls"] == logged["odometer"]["getReal" if version == 2 else "getFloat64"]
    starts = 1  # its seed, which follows from that of the run, is set before time begins
    assert cost["odometer"]["set"]["calls"] == logged["odometer"]["setReal" if version == 2 else "setFloat64"] - starts
    assert cost["observer"]["event"]["calls"] == 3  # balises


@pytest.mark.compiler
def test_both_steppers_count_equally(tmp_path: Path) -> None:
    counts, rows = [], []
    for stepper in ("python", "compiled"):
        outcome = pair(tmp_path, 2).set("stop", 20.0).master(stepper=stepper).run(warn=lambda _: None)
        assert outcome.failure is None
        counts.append([{k: v["calls"] for k, v in c["cost"].items()} for c in outcome.result.summary["components"]])
        rows.append(cost_table(outcome.result).cells)
    assert counts[0] == counts[1]
    assert counts[0][0]["doStep"] == 200
    steps, reading = zip(*(row[1:3] for row in (rows[0][0], rows[1][0])), strict=True)
    assert all(float(cell.removeprefix("200 / ")) > 0.0 for cell in steps)
    assert "–" not in reading[0]
    assert reading[1].endswith(" / –")  # in C reading is counted and not timed


def test_the_closing_table_and_the_report_show_them() -> None:
    outcome = small().run(warn=lambda _: None)
    rows = {name: cells for name, *cells in cost_table(outcome.result).cells}
    cost = {c["name"]: c["cost"] for c in outcome.result.summary["components"]}
    assert rows["odometer"][0].startswith(f"{cost['odometer']['doStep']['calls']} / ")
    assert rows["observer"][3].startswith("3 / ")
    states = sum(cost["locomotive"][kind]["calls"] for kind in ("save", "restore", "release"))
    assert rows["locomotive"][4].startswith(f"{states} / ")
    text = cost_table(outcome.result).text()
    assert [line.split()[0] for line in text.splitlines()[2:]] == list(rows)
    assert "<h2>Calls</h2>" in live_page(run_page(outcome.result, outcome.spec))


def test_seconds_of_a_component_are_those_of_its_calls() -> None:
    summary = small().run(warn=lambda _: None).result.summary
    for entry in summary["components"]:
        assert summary["seconds"][entry["name"]] == pytest.approx(
            sum(kind["seconds"] for kind in entry["cost"].values())
        )
