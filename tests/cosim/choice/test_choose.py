"""The choice on a small scenario: what it plays, what it knows, what it says."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from small_scenarios import small

import fmu_observer
from cosim import Scenario
from cosim.choice.choice import INTERRUPTED, Choice
from cosim.choice.choose import Trial, choose, scenario_for_fmu
from cosim.errors import RunError, ScenarioError
from fmus.cache import cached_fmu
from plant_models import PLANTS

FEW = ["odometer_reset", "balise_odometer_ekf", "quasi_lpv_uio", "luenberger"]


@pytest.fixture(scope="module")
def choice() -> Choice:
    return choose(small(), FEW, seeds=2)


def test_every_run_counts_but_the_harder_one(choice: Choice) -> None:
    assert [d.name for d in choice.disturbances] == ["nominal", "seed 1", "seed 2", "harder 3"]
    for row in choice.rows:
        assert list(row.used) == (["nominal", "seed 1", "seed 2"] if row.tried else [])
        assert list(row.harder) == (["harder 3"] if row.tried else [])
    assert {row.label for row in choice.groups["not tried"]} == {"luenberger"}
    assert choice.answer.startswith(f"use {choice.best.label}")


def test_the_lines_to_paste_are_a_component_that_knows_the_train(choice: Choice) -> None:
    name = choice.best.candidate.name
    assert f"[components.{name}]" in choice.lines()
    assert f"-> {name}.odometer" in choice.lines()
    quasi = next(row for row in choice.rows if row.label == "quasi_lpv_uio")
    assert quasi.candidate.table.parameters["mass"] == 90e3  # of the plant, by default, in place of its own 1 kg
    assert quasi.candidate.table.parameters["estimated_speed"] == 10.0


def test_what_workers_find_is_what_one_process_finds(choice: Choice) -> None:
    again = choose(small(), FEW, seeds=2, workers=2)
    assert [(r.label, r.used, r.harder) for r in again.rows] == [(r.label, r.used, r.harder) for r in choice.rows]


def test_the_declared_odometer_is_played_and_not_what_the_driver_hears() -> None:
    data = small().table().model_dump(by_alias=True, exclude_unset=True)
    del data["components"]["observer"]
    data["connections"] = [
        "driver.effort -> locomotive.effort",
        "locomotive.speed -> driver.odometer",
        {"from": "locomotive.wheel_speed", "to": "odometer.wheel_speed", "factor": 1.5},
    ]
    found = choose(Scenario(**data), ["odometer_reset"], seeds=0)
    assert found.best.candidate.sources["odometer"][0] == "odometer.reading"
    assert found.best.score.speed_rms == pytest.approx(5.0, rel=0.05)  # the odometer reads half as much again


def test_what_fails_nominally_is_not_run_again_and_says_why() -> None:
    scenario = small().set("observer.estimated_speed", 1e150)
    found = choose(scenario, ["observer", "odometer_reset"], seeds=1)
    lost = next(row for row in found.rows if row.label == "observer (takagi_sugeno_cdo)")
    assert list(lost.used) == ["nominal"]
    assert not lost.safe
    assert "diverged" in lost.why_not()
    assert found.best.label == "odometer_reset"


def test_an_observer_that_refuses_what_is_known_of_the_train_says_so_and_ends_nothing() -> None:
    """Some trains have a negative Davis coefficient, as printed; an observer that does not allow it is no answer."""
    found = choose(Scenario.load("jam_odometry").set("stop", 12.0), ["adaptive_gain_cdo", "odometer_reset"], seeds=1)
    assert found.best.candidate.model == "odometer_reset"
    refused = next(row for row in found.rows if row.label == "adaptive_gain_cdo")
    assert not refused.tried
    assert "cannot be coupled" in refused.why_not()


def test_a_single_row_is_no_run_to_be_evaluated() -> None:
    with pytest.raises(RunError, match="evaluate_after"):
        choose(small().set("stop", 3.0).report(evaluate_after=3.0), ["odometer_reset"], seeds=0)


def test_an_answer_from_fewer_runs_begins_with_it(choice: Choice) -> None:
    assert replace(choice, stopped=INTERRUPTED).answer.startswith("interrupted after 4 runs; so far: use ")


def test_a_disturbed_run_that_fails_leaves_what_the_others_gave(monkeypatch: pytest.MonkeyPatch) -> None:
    """A plant may crash on one seed: the choice from the other runs is kept, and says what is missing."""
    played = Trial.played

    def failing(trial: Trial, **more: Any) -> Any:
        if trial.number == 1:
            raise RunError("plant: the process that ran it has ended")
        return played(trial, **more)

    monkeypatch.setattr(Trial, "played", failing)
    found = choose(small(), ["odometer_reset"], seeds=2)
    assert [d.name for d in found.disturbances] == ["nominal", "seed 2", "harder 3"]
    assert found.stopped == "A disturbed run failed: plant: the process that ran it has ended"
    assert found.answer.startswith("cut short after 3 runs; so far: use odometer_reset")


def test_what_a_run_will_say_of_the_preset_is_said_with_the_answer() -> None:
    found = choose(small(), ["balise_odometer_ekf:tuned"], seeds=0)
    assert any("is made for the 900 t train" in str(part) for part in found.parts())
    own = choose(small(), ["observer"], seeds=0)
    assert own.lines() == "# it is in the scenario already: components.observer"


def test_balises_reach_whom_the_scenario_names_and_the_observer_that_is_chosen() -> None:
    """What was measured with telegrams is written with them; an own observer that is not named has none."""
    named = small().add("deaf", observer="odometer_reset", **{"as": "block3"}).balises(receivers=["observer"])
    named.connect("odometer.reading -> deaf.odometer")
    found = choose(named, ["deaf", "balise_odometer_ekf"], seeds=0)
    telegrams = [event for outcome in found.benchmark.outcomes.values() for event in outcome.result.events]
    assert {name for event in telegrams for name in event.outcomes} == {"balise_odometer_ekf"}
    assert found.best.candidate.name == "balise_odometer_ekf"
    assert found.with_best().table().balises.receivers == ["observer", "balise_odometer_ekf"]
    assert "# into [balises], receivers = [...]: 'balise_odometer_ekf'" in found.lines()
    assert "No telegram" not in found.answer


def test_an_answer_without_any_telegram_says_so() -> None:
    assert "No telegram reached an observer" in choose(small().balises(latency=9.0), ["odometer_reset"], seeds=0).answer


def test_where_nothing_comes_through_there_is_no_best() -> None:
    found = choose(small(), ["luenberger"], seeds=1)
    assert not found.found
    with pytest.raises(RunError, match="no observer came through"):
        _ = found.best


def test_a_train_of_which_nobody_says_where_it_is_is_refused() -> None:
    data = small().table().model_dump(by_alias=True, exclude_unset=True)
    del data["balises"], data["report"]
    with pytest.raises(ScenarioError, match="nothing says where the train truly is"):
        choose(Scenario(**data), ["luenberger"], seeds=0)


def test_a_plant_fmu_alone_gets_the_scenario_of_its_starter(tmp_path: Path) -> None:
    fmu: Any = cached_fmu(PLANTS["locomotive"](), fmi_version=3)
    scenario = scenario_for_fmu(fmu).set("stop", 3.0)
    with pytest.raises(RunError, match="evaluate_after = 5 s"):
        choose(scenario, ["odometer_reset"], seeds=0)
    scenario.set("report.evaluate_after", 1.0)
    found = choose(scenario, ["odometer_reset", "quasi_lpv_uio"], seeds=0)
    quasi = next(row for row in found.rows if row.label == "quasi_lpv_uio")
    assert quasi.candidate.table.parameters["mass"] == 90e3
    written = found.with_best().save(tmp_path / "chosen.toml")
    assert Scenario.load(written).run(warn=lambda _: None).failure is None


def test_an_fmu_that_is_no_train_is_refused() -> None:
    fmu: Any = cached_fmu(fmu_observer.OBSERVERS["takagi_sugeno_cdo"](), fmi_version=3)
    with pytest.raises(ScenarioError, match="no train in it"):
        scenario_for_fmu(fmu)
