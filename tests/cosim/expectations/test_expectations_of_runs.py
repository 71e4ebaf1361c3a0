"""Expectations of scenarios: what cannot be is refused before the run; real runs are judged; exit codes of the
command.
"""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any, Literal

import numpy as np
import pytest
from small_scenarios import small

from cosim import Scenario
from cosim.cli import main
from cosim.components.component import Component
from cosim.errors import ScenarioError
from cosim.expectations.expectation import WindowExpectation
from cosim.expectations.registry import EXPECTATIONS
from cosim.run.checked_tables import _check_expectations
from cosim.run.component_models import component_factories
from cosim.scenario.schema import ScenarioTable


def quiet(_: str) -> None: ...


@pytest.fixture(scope="module")
def components() -> dict[str, Component]:
    factories, _ = component_factories(small().table().components, Path(), "test", quiet, (0.0, 0.5))
    return {name: factory() for name, factory in factories.items()}


@pytest.fixture
def check(components: dict[str, Component]) -> Callable[..., ScenarioTable]:
    def run(*items: dict[str, Any], **changes: Any) -> ScenarioTable:
        table = small(expect=list(items), **changes).table()
        return _check_expectations(table, components, ["observer"], "test")

    return run


WRONG = [
    ({"check": "speed_error", "of": "observr", "max": 1.0}, "did you mean 'observer'"),
    ({"check": "speed_error", "of": "driver", "max": 1.0}, "no variable 'speed'"),
    ({"check": "slip_error", "max": 1.0}, "report.true_slip"),
    ({"check": "speed_error", "max": 1.0, "to": 0.9}, "outside the run"),
    ({"check": "speed_error", "max": 1.0, "from": -0.1}, "outside the run"),
    ({"check": "speed_error", "max": 1.0, "from": 0.401, "to": 0.409}, "no row is recorded"),
    ({"check": "on", "signal": "observer.slip_indicatr", "before": 0.2}, "did you mean 'slip_indicator'"),
    ({"check": "on", "signal": "observer.slip_indicator", "before": 0.7}, "outside the run"),
    ({"check": "on", "signal": "observer.speed", "before": 0.2}, "give 'threshold'"),
    ({"check": "off", "signal": "lokomotive.speed", "threshold": 1.0}, "did you mean 'locomotive'"),
    ({"check": "off", "signal": "speed", "threshold": 1.0}, "component.signal"),
    ({"check": "signal", "signal": "locomotive.effort", "max": 1.0}, "causality 'input'"),
    (
        {"check": "difference", "signal": "locomotive.speed", "reference": "locomotive.position", "max": 1.0},
        "dimensions",
    ),
    (
        {"check": "bound", "signal": "observer.speed", "reference": "locomotive.speed", "bound": "observer.position"},
        "dimensions",
    ),
    (
        {"check": "bound", "signal": "observer.speed", "reference": "locomotive.speed", "bound": "observer.speeed"},
        "did you mean 'speed'",
    ),
    ({"check": "telegrams", "missed": 0, "of": "driver"}, "receives no telegrams"),
    ({"check": "certificate", "of": "locomotive"}, "receives no telegrams"),
    ({"check": "certificate", "of": "lok"}, "no observer 'lok'"),
]


@pytest.mark.parametrize(("item", "text"), WRONG)
def test_what_cannot_be_evaluated_is_refused(
    item: dict[str, Any], text: str, check: Callable[..., ScenarioTable]
) -> None:
    with pytest.raises(ScenarioError, match=text) as caught:
        check({"check": "warnings"}, item)
    assert str(caught.value).startswith(f"test: expect, number 2, '{item['check']}'")


def test_every_fault_is_named(check: Callable[..., ScenarioTable]) -> None:
    with pytest.raises(ScenarioError) as caught:
        check(*(item for item, _ in WRONG))
    assert len(str(caught.value).splitlines()) == len(WRONG)


def test_what_a_source_prints_is_taken_for_no_bound() -> None:
    item = {"check": "bound", "signal": "dmo.speed", "reference": "train.speed", "bound": "dmo.error_as_printed"}
    with pytest.raises(ScenarioError, match="take error_bound or carried_bound"):
        Scenario.load("error_bounds").set("expect", [item]).run(warn=lambda _: None)


@pytest.mark.parametrize("kind", ["telegrams", "certificate"])
def test_without_balises_there_are_no_telegrams(kind: str, components: dict[str, Component]) -> None:
    more = {"used": 1} if kind == "telegrams" else {}
    table = small(expect=[{"check": kind, **more}]).table().model_copy(update={"balises": None})
    with pytest.raises(ScenarioError, match="no balises"):
        _check_expectations(table, components, [], "test")


def test_certificates_that_are_ignored_cannot_be_expected(check: Callable[..., ScenarioTable]) -> None:
    with pytest.raises(ScenarioError, match="leaves nothing to evaluate"):
        check({"check": "certificate"}, certificates="ignore")


def test_a_window_that_ends_before_the_evaluation_begins(components: dict[str, Component]) -> None:
    scenario = small(expect=[{"check": "speed_error", "max": 1.0, "to": 0.2}]).report(evaluate_after=0.3)
    with pytest.raises(ScenarioError, match="evaluate_after"):
        _check_expectations(scenario.table(), components, ["observer"], "test")


def test_thresholds_of_shipped_indicators_are_known(check: Callable[..., ScenarioTable]) -> None:
    table = check(
        {"check": "on", "signal": "observer.slip_indicator", "before": 0.2},
        {"check": "off", "signal": "locomotive.adhesion_degraded"},
        {"check": "off", "signal": "observer.slip_indicator", "threshold": 1.25},
    )
    assert [getattr(item, "threshold", None) for item in table.expect] == [1.5, 0.5, 1.25]


SCHEMA = [
    ({"check": "sped_error", "max": 1.0}, "did you mean 'speed_error'"),
    ({"max": 1.0}, "the key 'check'"),
    ({"check": "speed_error"}, "'max', 'rms' or both"),
    ({"check": "speed_error", "mx": 1.0}, "did you mean 'max'"),
    ({"check": "speed_error", "max": -1.0}, "expected at least 0"),
    ({"check": "speed_error", "max": 1.0, "from": 2.0, "to": 1.0}, "must lie behind"),
    ({"check": "signal", "signal": "a.b"}, "'min', 'max' or 'final'"),
    ({"check": "signal", "signal": "a.b", "min": 2.0, "max": 1.0}, "lies above"),
    ({"check": "signal", "signal": "a.b", "final": [2.0, 1.0]}, "lies above"),
    ({"check": "on", "signal": "a.b", "from": 2.0, "before": 1.0}, "must lie behind"),
    ({"check": "on", "signal": "a.b", "before": 1.0, "to": 2.0}, "unknown key"),
    ({"check": "telegrams"}, "at least one of"),
    ({"check": "difference", "signal": "a.b", "reference": "a.c"}, "'max', 'rms' or both"),
]


@pytest.mark.parametrize(("item", "text"), SCHEMA)
def test_what_is_no_expectation_is_refused(item: dict[str, Any], text: str) -> None:
    with pytest.raises(ScenarioError, match=text) as caught:
        small(expect=[item]).table()
    assert str(caught.value).startswith("script: expect, number 1")


# -- real runs
# ----------------------------------------------------------------------------------------------------------


def test_a_run_is_evaluated_by_its_own_numbers() -> None:
    scenario = small().expect("speed_error", of="observer", start=0.1, max=1.0, rms=1e-9)
    scenario.expect("signal", signal="locomotive.position", final=(0.0, 1.0)).expect("telegrams", used=3)
    outcome = scenario.run(warn=quiet)
    error = np.abs(outcome["observer.speed"] - outcome["locomotive.speed"])[outcome.result.time >= 0.1 - 1e-12]
    largest, rms, final, used = outcome.expectations
    assert largest.measured == error.max()
    assert 0.0 < rms.measured < largest.measured
    assert final.measured == outcome["locomotive.position"][-1]
    assert [j.passed for j in (largest, rms, final, used)] == [True, False, False, True]


def test_a_local_variable_that_is_expected_is_recorded() -> None:
    plain = small().run(warn=quiet)
    hidden = "observer.estimated_speed"  # a state, which is no output
    assert hidden not in (plain.result.table.dtype.names or ())
    outcome = small().expect("signal", signal=hidden, min=0.0).run(warn=quiet)
    assert outcome.expectations[0].measured == outcome[hidden].min()


def write(folder: Path, limit: float) -> str:
    text = f"""
stop = 0.05
step = 0.01
[components.train]
model = "locomotive"
as = "block3"
[[expect]]
check = "signal"
signal = "train.speed"
max = {limit}
[[expect]]
check = "warnings"
at_most = 1
"""
    path = folder / "train.toml"
    path.write_text(text)
    return str(path)


@pytest.mark.parametrize(
    ("limit", "code", "head"), [(1.0, 0, "All 2 expectations are met."), (-1.0, 1, "1 of 2 expectations not met")]
)
def test_the_command_ends_with_1_where_something_is_unmet(
    limit: float, code: int, head: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["run", write(tmp_path, limit), "--out", str(tmp_path / "out"), "--quiet"]) == code
    printed = capsys.readouterr().out
    assert head in printed
    assert bool(
        re.search(r"not met +train.speed, max +0 km/h \(at 0 s\), expected at most -3.6 km/h \(-1 m/s\)", printed)
    ) is (code == 1)
    page = (tmp_path / "out" / "report.html").read_text()
    assert ("expectations are not met" in page) is (code == 1)
    assert "train.speed, max" in page


def test_json_holds_the_expectations(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["run", write(tmp_path, -1.0), "--out", str(tmp_path / "out"), "--json", "--no-report"]) == 1
    data = json.loads(capsys.readouterr().out)
    assert [(e["passed"], e["limit"]) for e in data["expectations"]] == [(False, -1.0), (True, 1.0)]


def test_a_fault_in_an_expectation_ends_with_2(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = Path(write(tmp_path, 1.0))
    path.write_text(path.read_text().replace("train.speed", "train.sped"))
    assert main(["run", str(path), "--out", str(tmp_path / "out"), "--quiet"]) == 2
    assert "did you mean 'speed'" in capsys.readouterr().err


def test_a_copy_and_a_saved_file_keep_the_expectations(tmp_path: Path) -> None:
    scenario = small().expect("speed_error", start=0.1, max=1.0).expect("telegrams", used=3)
    assert scenario.copy().table().expect == scenario.table().expect
    scenario.save(tmp_path / "saved.toml")
    assert Scenario.load(tmp_path / "saved.toml").table().expect == scenario.table().expect


class Broken(WindowExpectation):
    """An expectation with a mistake of its author: which one is its key."""

    check: Literal["test_broken"] = "test_broken"
    mistake: str

    def prepare(self, before: Any) -> Any:
        return {"raises": lambda: 1 / 0, "nothing": lambda: None}.get(self.mistake, lambda: self)()

    def evaluate(self, run: Any) -> Any:
        return 1 / 0 if self.mistake == "later" else "met"


@pytest.mark.parametrize(("mistake", "text"), [("raises", "ZeroDivisionError"), ("nothing", "returned NoneType")])
def test_a_mistake_in_prepare_is_that_of_the_expectation(
    mistake: str, text: str, check: Callable[..., ScenarioTable], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(EXPECTATIONS, "test_broken", Broken)
    with pytest.raises(ScenarioError, match=rf"expect, number 1, 'test_broken': prepare\(\) .*{text}"):
        check({"check": "test_broken", "mistake": mistake})


def test_a_mistake_in_evaluate_is_an_expectation_that_is_not_met(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(EXPECTATIONS, "test_broken", Broken)
    items = [{"check": "test_broken", "mistake": mistake} for mistake in ("later", "text")]
    outcome = small(expect=[*items, {"check": "warnings", "at_most": 99}]).run()
    first, second, third = outcome.result.summary["expectations"]
    assert not first["passed"]
    assert "ZeroDivisionError" in first["text"]
    assert not second["passed"]
    assert "returned str; expected a list of Evaluated" in second["text"]
    assert third["passed"]
