"""Local variables as sources: sealed FMUs hide what others need, and FMI lets anybody read it."""

from __future__ import annotations

import numpy as np
import pytest
from small_scenarios import small

import fmus
import plant_models
from cosim import Scenario
from cosim.errors import CouplingError

SPEED, LOCAL = "locomotive.speed", "locomotive.train_speed"  # the output is that state


def observed(source: str, **changes: object) -> Scenario:
    scenario = small()
    scenario._data["connections"] = [
        "driver.effort -> locomotive.effort, observer.effort",
        "locomotive.wheel_speed -> odometer.wheel_speed",
        "odometer.reading -> driver.odometer",
        f"{source} -> observer.odometer",
    ]
    for name, value in changes.items():
        scenario.set(name, value)
    return scenario


def test_a_local_variable_is_as_good_a_source_as_the_output_of_equal_value() -> None:
    usual, hidden = observed(SPEED).run(), observed(LOCAL).run()
    assert hidden.failure is None
    for name in usual.result.table.dtype.names or ():
        assert (usual[name] == hidden[name]).all(), name
    assert (hidden[LOCAL] == hidden[SPEED]).all()  # what is read is recorded
    assert any(LOCAL in note for note in hidden.result.summary["notes"])
    assert not any("Local variables" in note for note in usual.result.summary["notes"])


@pytest.mark.compiler
@pytest.mark.parametrize("stepper", ["python", "compiled"])
def test_both_steppers_read_locals_of_native_fmus(stepper: str) -> None:
    path = str(fmus.cached_fmu(plant_models.Locomotive(), fmi_version=2))

    def odometer(source: str) -> np.ndarray:
        scenario = Scenario(stop=0.5, step=0.01).master(stepper=stepper)
        scenario.add("train", fmu=path, parameters={"train_speed": 10.0}).add("follower", fmu=path)
        scenario.connect({"from": f"train.{source}", "to": "follower.effort", "units": "ignore", "factor": 1e3})
        outcome = scenario.run()
        assert outcome.result.summary["master"]["stepper"]["name"] == stepper
        return outcome["follower.speed"]

    assert odometer("speed")[-1] > 0.0
    assert (odometer("speed") == odometer("train_speed")).all()


def test_balises_and_report_may_read_locals() -> None:
    scenario = small()
    scenario.balises(speed=LOCAL).report(true_speed=LOCAL)
    outcome, usual = scenario.run(), small().run()
    assert [e.stamp for e in outcome.result.events] == [e.stamp for e in usual.result.events]
    assert LOCAL in (outcome.result.table.dtype.names or ())


def test_the_structure_shows_them() -> None:
    part = next(p for p in observed(LOCAL).structure().parts if p.name == "locomotive")
    assert [port.name for port in part.outputs if port.name == "train_speed"] == ["train_speed"]
    assert observed(LOCAL).structure().text()


def test_parameters_and_inputs_are_no_sources() -> None:
    with pytest.raises(CouplingError, match=r"causality 'parameter', expected output or local"):
        observed("locomotive.mass").run()


def test_an_input_that_was_set_on_purpose_is_no_doubt() -> None:
    def doubts(**parameters: float) -> list[str]:
        scenario = Scenario(stop=0.1, step=0.01)
        scenario.add("train", model="locomotive", **{"as": "block3"}, parameters=parameters)
        return [text for text in scenario.run().warnings if "start values" in text]

    assert doubts(mass=80e3) == ["Unconnected inputs keep their start values: train.effort."]
    assert doubts(effort=1e3) == []
