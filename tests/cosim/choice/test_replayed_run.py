"""A run of a choice again: the scenario that is written shows the same error."""

from __future__ import annotations

from pathlib import Path

import pytest
from small_scenarios import small

from cosim import Scenario
from cosim.choice.allowance import Allowance, used_allowance
from cosim.choice.choose import choose
from cosim.choice.replayed_run import replayed
from cosim.choice.trial import Trial
from cosim.errors import ScenarioError

FEW = ["odometer_reset", "balise_odometer_ekf"]


def journey() -> Scenario:
    """Long enough for slopes, a skid and noise; packets are lost."""
    scenario = small().set("stop", 3.0).set("seed", 7).set("driver.profile_speed", [12.0] * 8)
    return scenario.network(nodes={"odometer": ["odometer.reading"]}, period=0.05, loss_fraction=0.1)


def test_the_scenario_of_a_run_shows_the_error_that_the_choice_saw(tmp_path: Path) -> None:
    found = choose(journey(), FEW, seeds=1, further=0)
    for row in found.rows:
        for name, used in (*row.used.items(), *row.harder.items()):
            folder = tmp_path / f"{row.label} {name}"
            again = replayed(Trial(journey(), [row.candidate.asked], Allowance()), name, folder / "recording")
            assert again.score.used == used
            assert again.disturbance.name == name
            outcome = Scenario.load(again.scenario.save(folder / "one.toml")).run(warn=lambda _: None)
            assert used_allowance(outcome.result, outcome.spec, row.candidate.name, Allowance()) == used


def test_the_disturbance_stands_in_the_scenario_as_it_is_shown(tmp_path: Path) -> None:
    found = replayed(Trial(journey(), ["balise_odometer_ekf"], Allowance()), "seed 1", tmp_path / "recording")
    table, wrong = found.scenario.table(), found.disturbance
    assert table.components["balise_odometer_ekf"].parameters["mass"] == pytest.approx(wrong.mass * 90e3)
    assert table.components["disturbed_odometer"].parameters["noise_std"] == wrong.noise
    assert table.components["disturbed_wheel"].parameters["fault_onset"] == [fault.onset for fault in wrong.faults]
    assert len(table.components["disturbed_effort"].parameters["fault_offset"]) == len(wrong.slopes)
    (shown,) = (part for part in found.parts() if not isinstance(part, str))
    assert any("packets" in row[0] for row in shown.rows)
    assert len(shown.rows) == 5 + len(wrong.slopes) + len(wrong.faults)


@pytest.mark.parametrize("name", ["seed three", "", "3.5", "-1"])
def test_a_run_that_cannot_be_is_named(name: str, tmp_path: Path) -> None:
    with pytest.raises(ScenarioError, match="expected the number of a seed"):
        replayed(Trial(small(), ["odometer_reset"], Allowance()), name, tmp_path)


def test_several_observers_or_one_that_does_not_fit_are_refused(tmp_path: Path) -> None:
    with pytest.raises(ScenarioError, match="expected one observer, got 2"):
        replayed(Trial(small(), FEW, Allowance()), "nominal", tmp_path)
    with pytest.raises(ScenarioError, match="luenberger: cannot be coupled"):
        replayed(Trial(small(), ["luenberger"], Allowance()), "nominal", tmp_path)
